"""What a lag in place of the delay costs: the numbers in the chart's docstring."""

from __future__ import annotations

import numpy as np
import pytest

import gms_fsm.charts.zoo.bristles.seven_parameter as page
from gms_fsm import ChartModel, Prescribed, simulate
from gms_fsm.charts.registry import entry

P = entry("seven-parameter").demonstration.values
TAU = P["tau_L"]
COST = {1.0: (4e-6, 1.1e-3), 10.0: (4e-4, 1.1e-2), 25.0: (2.5e-3, 2.7e-2)}


@pytest.mark.slow
@pytest.mark.parametrize("w", COST)
def test_the_cost_of_the_lag_is_as_documented(w: float) -> None:
    """In the steady state of v = 1e-3 (1.5 + cos w t); f is 0.5 N to 1e-5 N after a long rest."""
    period = 2 * np.pi / w
    drive = f"1e-3 * (1.5 + cos({w!r} * t))"
    start = {"f": [P["F_s"] - P["F_c"]], "states": ["forward"]}
    times = np.linspace(1.0, 1.0 + period, 400)
    trace = simulate(
        ChartModel(page.SEVEN_PARAMETER, P),
        Prescribed(drive),
        times[-1],
        t_eval=times,
        initial=start,
        rtol=1e-10,
        engine="ifelse",
    )

    def force(delay: float) -> np.ndarray:
        late = 1e-3 * (1.5 + np.cos(w * (times - delay)))
        now = 1e-3 * (1.5 + np.cos(w * times))
        return P["F_c"] + 0.5 / (1 + (late / P["v_s"]) ** 2) + P["F_v"] * now

    cost, memory = abs(trace.F - force(TAU)).max(), abs(force(0.0) - force(TAU)).max()
    assert (cost, memory) == pytest.approx(COST[w], rel=0.05)
    words = " ".join((page.__doc__ or "").split())
    assert "4e-6, 4e-4 and 2.5e-3 N" in words
    assert "1.1e-3, 1.1e-2 and 2.7e-2 N" in words
