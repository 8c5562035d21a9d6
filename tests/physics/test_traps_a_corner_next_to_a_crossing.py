"""A crossing a few clock ticks before a corner of a signal is no reason to give up.

A velocity made from positions is about 1e-17 m/s at the turning points, not 0: its sign changes
just before the sample, and what is left is too short for a first step of the usual size.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import ChartModel, Prescribed, Record, simulate
from gms_fsm.charts.registry import registered

CHART = registered()["maxwell-slip"].chart("")


@pytest.mark.parametrize("engine", ["ifelse", "compiled"])
@pytest.mark.parametrize(("period", "rows"), [(2.5, 801), (2.0, 401), (1.0, 1001), (4.0, 801)])
def test_turning_points_at_samples(period: float, rows: int, engine: str) -> None:
    if engine == "compiled":
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    t = np.linspace(0.0, 20.0, rows)
    x = 1e-3 * np.sin(2.0 * np.pi * t / period)
    v = Record.from_arrays(time=t, position=x).motion().velocity
    model = ChartModel(CHART, {"k": 1e4, "F_c": 1.0})
    run = simulate(model, Prescribed((t, v)), 20.0, engine=engine, t_eval=t)
    switches = run.transitions
    turns = sum(edge.startswith("turn") for edge in switches.edge)
    assert turns == round(20.0 / (0.5 * period))  # one for each turning point
    assert np.abs(run.F).max() == pytest.approx(1.0, abs=1e-9)
