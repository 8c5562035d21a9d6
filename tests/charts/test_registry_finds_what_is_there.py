"""The charts in the folder are found, and files that do not fit there are reported.

Each built-in chart has numbers that run, with the same result on two engines.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import gms_fsm.charts
from gms_fsm import (
    ChartModel,
    Prescribed,
    Stribeck,
    simulate,
)
from gms_fsm.charts import CHARTS, GMS_ELEMENT, LAWS, LUGRE
from gms_fsm.charts.broken import BROKEN
from gms_fsm.charts.registry import entry, registered
from gms_fsm.errors import ChartError
from tests.helpers import same_bits

CURVE = Stribeck(1.0, 1.5, 1e-3)


def every() -> list[tuple[str, str]]:
    return [(name, law) for name, each in registered().items() for law in each.laws or ("",)]


def test_the_registry_is_the_only_list() -> None:
    wanted = [
        each.chart(law)
        for each in registered().values()
        if not each.wrong
        for law in each.laws or ("",)
    ]
    assert list(CHARTS.values()) == wanted
    for name in {*CHARTS} & {*registered()} - {"lugre"}:  # the others than the paper's
        assert CHARTS[name].reference
        assert registered()[name].demonstration.source.startswith("chosen by us")


def test_the_built_in_charts_are_found() -> None:
    assert entry("lugre").chart() is LUGRE
    assert [entry("gms").chart(law) for law in LAWS] == [GMS_ELEMENT[law] for law in LAWS]
    for name, broken in BROKEN.items():
        found = entry(f"broken:{name}")
        assert (found.chart(), found.wrong, found.domain) == (
            broken.chart,
            broken.wrong,
            broken.domain,
        )
    faulty = [bool(each.wrong) for each in registered().values()]
    assert faulty == sorted(faulty)


@pytest.mark.parametrize(("name", "law"), every())
def test_every_parameter_has_a_unit_and_a_meaning(name: str, law: str) -> None:
    assert entry(name).demonstration.source
    for each in entry(name).chart(law).parameters:
        assert each.unit
        assert each.meaning


# --------------------------------------------------------------------------- invalid entries


# --------------------------------------------------------------------------- files
@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder whose modules count as built-in charts."""
    monkeypatch.setattr(gms_fsm.charts, "__path__", [*gms_fsm.charts.__path__, str(tmp_path)])
    before = set(sys.modules)
    registered.cache_clear()
    yield tmp_path
    registered.cache_clear()
    for name in set(sys.modules) - before:
        del sys.modules[name]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("CHARTS = (", "odd.py: it cannot be imported .SyntaxError"),
        ("import nothing_of_that_name", "odd.py: it cannot be imported .ModuleNotFoundError"),
        ("from gms_fsm import State; State('a', flow=3)", "odd.py: state 'a': flow is 3"),
        ("CHARTS = [1]", r"odd.py: CHARTS is \[1\]; it must be a tuple of Entry"),
        ("CHARTS = (1,)", r"odd.py: CHARTS is \(1,\); it must be a tuple of Entry"),
        (
            "from gms_fsm.charts.zoo.bristles.lugre import CHARTS",
            "odd.py: the name 'lugre' is already used by gms_fsm/charts/zoo/bristles/lugre.py",
        ),
    ],
)
def test_an_invalid_file_is_named(text: str, words: str, folder: Path) -> None:
    (folder / "odd.py").write_text(text)
    with pytest.raises(ChartError, match=f"^gms_fsm/charts/{words}"):
        registered()


def test_a_module_without_charts_is_skipped(folder: Path) -> None:
    (folder / "helpers_of_mine.py").write_text("HALF = 0.5\n")
    assert "lugre" in registered()


def test_the_order_of_the_values_does_not_matter() -> None:
    """The tolerance of z comes from guards and forces, computed with the parameters by name."""
    element = GMS_ELEMENT["signed"]
    values = {"k": 40.0, "sigma": 0.3, "C": 0.02, "v_c": 1e-6}
    turned = dict(reversed(values.items()))
    runs = [
        simulate(ChartModel(element, given, stribeck=CURVE), Prescribed("0.2*sin(t)"), 9.0)
        for given in (values, turned)
    ]
    same_bits(*runs)
    assert runs[0].settings == runs[1].settings
