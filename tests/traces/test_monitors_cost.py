"""Monitors cost nothing in a run without them; with them no row is computed twice.

Their running time is measured by benchmarks/monitors.py.
"""

from __future__ import annotations

import sys
from typing import Any

import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.traces import trace
from gms_fsm.traces.failures import LivelockError
from gms_fsm.traces.monitors import _examining as monitors
from tests.helpers import FIG4_SINE, pulled_mass, stick_slip
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


def test_nothing_is_called_when_off_and_no_rows_are_observed_for_the_log_alone(
    calls: list[str],
) -> None:
    for output in ("all", "end"):
        run = simulate(*pulled_mass(), 20.0, output=output)
        assert run.monitors == {}
        assert "seen" not in vars(run)
    with pytest.raises(LivelockError) as caught:
        simulate(memoryless([0.5]), SLOWING, 30.0)
    assert caught.value.trace.monitors == {}
    assert calls == []
    assert simulate(*pulled_mass(), 20.0, monitors="chattering").monitors["chattering"].ok
    assert calls != []
    assert "observe" not in calls


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
