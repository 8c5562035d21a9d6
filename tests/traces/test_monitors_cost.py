"""Monitors cost nothing in a run without them; with them no row is computed twice.

Their running time is measured by benchmarks/monitors.py.
"""

from __future__ import annotations

import sys
from typing import Any

import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.lowering.program import lower
from gms_fsm.traces import trace
from gms_fsm.traces.failures import LivelockError
from gms_fsm.traces.monitors import _examining as monitors
from tests.helpers import FIG4_SINE, open_loop, pulled_mass, stick_slip
from tests.traces.test_monitors_see_what_happens import SLOWING, memoryless

FUNCTIONS = (
    "checked",
    "examine",
    "watched",
    "chattering",
    "invariant_verdict",
    "passivity",
    "coverage",
)


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Record every call into the monitors, and every table of observed rows."""
    noted: list[str] = []

    def noting(name: str, function: Any) -> Any:
        def noted_function(*arguments: Any, **options: Any) -> Any:
            noted.append(name)
            return function(*arguments, **options)

        return noted_function

    for name in FUNCTIONS:
        monkeypatch.setattr(monitors, name, noting(name, getattr(monitors, name)))
    for name in ("checked", "watched"):
        monkeypatch.setattr(sys.modules["gms_fsm.run.simulate"], name, getattr(monitors, name))
    monkeypatch.setattr(trace, "Observed", noting("observe", trace.Observed))
    return noted


@pytest.mark.parametrize("engine", ["machines", "ifelse"])
@pytest.mark.parametrize("output", ["all", "end"])
def test_nothing_is_called_when_off(calls: list[str], engine: str, output: str) -> None:
    model, rig = pulled_mass()
    run = simulate(model, rig, 20.0, engine=engine, output=output)
    assert calls == []
    assert run.monitors == {}
    assert "seen" not in vars(run)


def test_nothing_is_called_when_off_and_the_run_fails(calls: list[str]) -> None:
    with pytest.raises(LivelockError) as caught:
        simulate(memoryless([0.5]), SLOWING, 30.0)
    assert calls == []
    assert caught.value.trace.monitors == {}


def test_the_run_itself_is_the_same(calls: list[str]) -> None:
    """Rows, log and the text of the program do not depend on monitors."""
    model, rig = stick_slip("published"), open_loop()
    plain = simulate(model, rig, 30.0)
    assert calls == []
    watched = simulate(model, rig, 30.0, monitors=["all", "z <= s"])
    assert calls != []
    assert (plain.t == watched.t).all()
    assert (plain.rows.y == watched.rows.y).all()
    assert (plain.transitions == watched.transitions).all()
    assert lower(model, rig).source == watched.program.source


def test_rows_are_observed_once_for_all_monitors_and_for_the_reader(calls: list[str]) -> None:
    run = simulate(
        stick_slip("signed"),
        Prescribed(FIG4_SINE),
        50.0,
        monitors=["all", "abs(z) <= 2*s", "F < 99"],
    )
    assert calls.count("observe") == 1
    assert run.F.size == run.v.size == len(run)
    assert calls.count("observe") == 1


def test_chattering_alone_needs_no_rows(calls: list[str]) -> None:
    model, rig = pulled_mass()
    run = simulate(model, rig, 20.0, monitors="chattering")
    assert "observe" not in calls
    assert run.monitors["chattering"].ok
