"""Monitors cost nothing in a run without them; with them no row is computed twice.

Their running time is measured by benchmarks/monitors.py.
"""

from __future__ import annotations

from typing import Any

import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.traces import trace
from gms_fsm.traces.failures import LivelockError
from tests.helpers import FIG4_SINE, pulled_mass, stick_slip
from tests.traces.test_monitors_see_what_happens import SLOWING, memoryless


@pytest.fixture
def observed(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Record every table of observed rows."""
    noted: list[int] = []
    observe = trace.Observed

    def noting(*arguments: Any, **options: Any) -> Any:
        noted.append(len(noted))
        return observe(*arguments, **options)

    monkeypatch.setattr(trace, "Observed", noting)
    return noted


def test_no_row_is_observed_without_monitors_or_for_the_log_alone(observed: list[int]) -> None:
    for output in ("all", "end"):
        run = simulate(*pulled_mass(), 20.0, output=output)
        assert run.monitors == {}
        assert "seen" not in vars(run)
    with pytest.raises(LivelockError) as caught:
        simulate(memoryless([0.5]), SLOWING, 30.0)
    assert caught.value.trace.monitors == {}
    assert simulate(*pulled_mass(), 20.0, monitors="chattering").monitors["chattering"].ok
    assert observed == []


def test_rows_are_observed_once_for_all_monitors_and_for_the_reader(observed: list[int]) -> None:
    monitors = ["all", "abs(z) <= 2*s", "F < 99"]
    run = simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 50.0, monitors=monitors)
    assert observed == [0]
    assert run.F.size == run.v.size == len(run)
    assert observed == [0]
