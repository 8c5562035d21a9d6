"""A tip on a soft spring jumps from valley to valley; on a stiff one it slides without friction.

The spring is soft if K < 2 pi F_0 / a_0. Pulled slowly, a tip leaves its valley where the slope of
the total force vanishes: cos(2 pi x / a_0) = -K a_0 / (2 pi F_0).
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from gms_fsm import ChartModel, PulledSlider, Trace, simulate
from gms_fsm.charts import CHARTS

F_0, a_0 = 1.0, 0.2
STEEP = 2 * math.pi * F_0 / a_0  # N/m


def pulled(K: float, *, V: float, t_end: float) -> Trace:
    model = ChartModel(CHARTS["prandtl-tomlinson"], {"F_0": F_0, "a_0": a_0, "c": 10.0})
    grid = np.linspace(0.0, t_end, 20001)
    return simulate(model, PulledSlider(1.0, K, V), t_end, t_eval=grid, engine="ifelse")


@pytest.mark.slow
def test_a_soft_spring_makes_atomic_stick_slip() -> None:
    K, V = 2.0, 0.002
    trace = pulled(K, V=V, t_end=1000.0)
    pull = K * (V * trace.t - trace.x)
    x_jump = a_0 / (2 * math.pi) * math.acos(-K / STEEP)
    first = F_0 * math.sin(2 * math.pi * x_jump / a_0)  # the static friction
    assert pull.max() == pytest.approx(first, rel=0.03)
    assert first < F_0
    # Sawtooth: over half of the time it is slower than the spring, and then much faster.
    assert np.median(trace.v) < 0.5 * V
    assert trace.v.max() > 10 * V
    late = trace.t > 450.0
    tops = np.flatnonzero((trace.v[1:] > V) & (trace.v[:-1] <= V) & late[1:])
    assert np.diff(trace.t[tops]) == pytest.approx(a_0 / V, rel=0.02)  # one valley per jump
    assert pull[late].mean() > 0.4 * F_0


@pytest.mark.slow
def test_a_stiff_spring_slides_without_friction() -> None:
    K, V = 3 * STEEP, 0.01
    trace = pulled(K, V=V, t_end=60.0)
    late = trace.t > 20.0  # two valleys
    assert trace.v.max() < 5 * V
    mean = (K * (V * trace.t - trace.x))[late].mean()
    assert mean == pytest.approx(10.0 * V, rel=0.5)  # viscous only: c V
    assert mean < 0.2 * F_0
