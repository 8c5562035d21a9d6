"""A missing extra is reported: the module, the extra, and what works without it.

One function writes these texts, `gms_fsm.foundation.extras.missing`, from one table of the extras.
"""

from __future__ import annotations

import importlib
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from gms_fsm import Prescribed, Sweep, Trace, prove, simulate, sweep
from gms_fsm.errors import MissingExtraError
from gms_fsm.foundation.extras import EXTRAS, missing, require
from tests.helpers import ROOT, stick_slip
from tests.structure.source import PACKAGES

FOR_DEVELOPERS = {"all", "bench", "cluster", "dev", "docs", "foreign", "hosts", "mutation", "test"}


def test_the_table_has_the_extras_that_users_can_install() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(EXTRAS) == set(project["optional-dependencies"]) - FOR_DEVELOPERS


@pytest.mark.parametrize("extra", EXTRAS)
def test_a_message_names_the_command_and_what_works_without(extra: str) -> None:
    needed, without = EXTRAS[extra]
    said = str(missing("thing", extra))
    assert said.startswith(f"{needed} thing, which is not installed: ")
    assert f'pip install "gms-fsm[{extra}]"' in said
    assert said.endswith(f"(without it: {without})")


def test_the_text_is_in_one_place() -> None:
    texts = {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
    }
    homes = {path for path, text in texts.items() if "gms-fsm[" in text}
    raised = {path for path, text in texts.items() if "MissingExtraError(" in text}
    assert homes == {"gms_fsm/foundation/extras.py"}
    assert raised == {"gms_fsm/foundation/extras.py", "gms_fsm/errors.py"}


def made() -> Sweep:
    return sweep(stick_slip("signed"), Prescribed("0.2"), 1.0, {"v_s": [0.1]}, engine="machines")


def replayed() -> str:
    from plots.page.replay import replay_html

    return replay_html(trace())


def trace() -> Trace:
    return simulate(stick_slip("signed"), Prescribed("0.2"), 0.1)


def hosted(name: str) -> None:
    """Make the friction of an adapter."""
    adapter = importlib.import_module(f"gms_fsm.adapters.{name}")
    if name == "pathsim":
        adapter._block_class.cache_clear()
        adapter.friction_block(stick_slip("signed"), 1e-3)
    if name == "control":
        adapter.friction_system(stick_slip("signed"), 1e-3)
    if name == "mujoco":
        adapter.JointFriction(None, None, {"hinge": stick_slip("signed")})


CALLS: list[tuple[str, str, Callable[[Path], object]]] = [
    ("pandas", "pandas", lambda _: trace().to_pandas()),
    ("pandas", "pandas", lambda _: made().to_dataframe()),
    ("xarray", "sweep", lambda _: made().to_xarray()),
    ("pandas", "sweep", lambda folder: made().save(folder / "a.parquet")),
    ("z3", "check", lambda _: prove(stick_slip("signed").chart)),
    ("uplot", "replay", lambda _: replayed()),
    *(
        (name, name, lambda _, name=name: hosted(name))
        for name in ("pathsim", "control", "mujoco", "gymnasium")
    ),
]


@pytest.mark.parametrize(("module", "extra", "call"), CALLS)
def test_a_function_names_the_module_and_the_extra(
    module: str,
    extra: str,
    call: Callable[[Path], object],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    for name in [each for each in sys.modules if each.startswith(f"{module}.")]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.delitem(sys.modules, "gms_fsm.adapters.gymnasium", raising=False)
    words = rf"need\w* (?i:{module})\S*, which is not .*pip install \"gms-fsm\[{extra}\]\""
    with pytest.raises(MissingExtraError, match=words):
        call(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("absent", ["matplotlib", "PIL"])
def test_a_module_names_the_module_and_the_extra(absent: str) -> None:
    """PIL is needed by matplotlib only."""
    pytest.importorskip("matplotlib", reason="needs the extra plots")
    code = f"""
import importlib, sys
sys.modules[{absent!r}] = None
from gms_fsm.errors import MissingExtraError
for module in ("figures", "panels", "systems.elements", "film.animation"):
    try:
        importlib.import_module("plots." + module)
    except MissingExtraError as error:
        print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    said = f'need {absent}, which is not installed: pip install "gms-fsm[plots]"'
    assert [said in line for line in done.stdout.splitlines()] == [True] * 4


def test_a_broken_module_is_not_reported_as_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "halfdone.py").write_text("from math import no_such_name")
    (tmp_path / "needy.py").write_text("import no_such_module")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(MissingExtraError, match=r"halfdone, which cannot be imported \(Import"):
        require("halfdone", "plots")
    with pytest.raises(MissingExtraError, match="need no_such_module, which is not installed"):
        require("needy", "plots")
    assert require("xml.etree", "plots") is sys.modules["xml.etree"]
