"""Every statement that something is not supported names something that raises."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from scipy.integrate import Radau

from gms_fsm import (
    Body,
    Chart,
    Contact,
    FrictionState,
    GMSError,
    Settings,
    State,
    System,
    export,
    simulate,
)
from gms_fsm.charts import CHARTS
from tests.helpers import ROOT, stick_slip

PAGE = (ROOT / "docs" / "comparison.md").read_text(encoding="utf-8")
FOUND = re.findall(r"^- ((?:.|\n  )+)$", PAGE.partition("## Not supported")[2], re.MULTILINE)
STATEMENTS = [" ".join(each.split()) for each in FOUND]


def system(force: str = "0", **signals: Any) -> System:
    return System(
        "a mass",
        bodies=(Body("mass", inertia=1.0, force=force),),
        contacts=(Contact("pad", stick_slip("signed")),),
        signals=signals,
    )


def exported(what: Any, name: str, **more: Any) -> None:
    with tempfile.TemporaryDirectory() as folder:
        export(what, name, folder, **more)


def parallel() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "chart.scxml"
        inside = '<parallel id="a"><state id="b"/></parallel>'
        path.write_text(f'<scxml xmlns="http://www.w3.org/2005/07/scxml">{inside}</scxml>')
        Chart.from_scxml(path, name="it", outputs={"F": "0"})


# Each call stands for its statement; tests/exporters tries all formats and all parts of charts.
REFUSED: dict[str, list[Callable[[], object]]] = {
    "Parallel": [parallel, lambda: State("a", states=(State("b"),), history="deep")],  # type: ignore[arg-type]
    "Stepping": [
        lambda: FrictionState(Contact("a", CHARTS["stiction"], {"F_c": 1.0, "F_s": 2.0, "b": 0.0})),
        lambda: FrictionState(
            Contact("a", CHARTS["planar-coulomb"], {"F_c": 1.0, "F_s": 2.0, "v_c": 1e-3})
        ),
    ],
    "Whole systems": [lambda: exported(system(), "st")],
    "Python functions": [lambda: exported(system("f", f=lambda t: t), "c99")],
    "SciPy": [lambda: exported(stick_slip("signed"), "c99", settings=Settings(method=Radau))],
}


def test_each_statement_has_something_that_raises() -> None:
    assert [each for each in STATEMENTS if not each.startswith(tuple(REFUSED))] == []
    assert len(STATEMENTS) == len(REFUSED)


CASES = [
    (f"{name} {k + 1}", call) for name, calls in REFUSED.items() for k, call in enumerate(calls)
]


@pytest.mark.parametrize("call", [call for _, call in CASES], ids=[name for name, _ in CASES])
def test_it_is_refused_with_a_sentence(call: Callable[[], object]) -> None:
    with pytest.raises(GMSError, match=r"\w+"):
        call()


def test_no_page_says_so_elsewhere() -> None:
    """A sentence of that kind belongs to the list, where it is tried."""
    pages = [path for path in (ROOT / "docs").rglob("*.md") if path.name != "comparison.md"]
    said = [
        f"{path.name}: {line}"
        for path in (ROOT / "README.md", *pages)
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.search(r"\bnot supported\b", line)
    ]
    assert said == []


@pytest.mark.matrix
@pytest.mark.slow
def test_the_opposite_runs() -> None:
    """The same calls without what is not supported."""
    exported(stick_slip("signed"), "c99", settings=Settings())
    exported(system("f", f="t"), "c99")
    assert len(simulate(system("2 * x"), 0.1)) > 1
