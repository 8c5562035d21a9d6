"""In slip z tends to s without causing stops: z - s is not watched where no edge needs it.

For comparison: the naive way, a stop at every change of z >= s, stops again and again.
"""

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from tests.helpers import one_element


@pytest.mark.parametrize("law", ["signed", "published"])
@pytest.mark.parametrize("start", [0.3, 1.0, 1.8])
def test_settling_on_the_threshold_makes_no_stop(law, start):
    """Constant v, C T / s = 200: z reaches s to the last bit; no stop, and few steps."""
    trace = simulate(
        one_element(law, C=1.0),
        Prescribed(0.4),
        200.0,
        t_eval=[200.0],
        initial={"z": [start], "states": ["slip"]},
    )
    assert trace.z[-1, 0] == pytest.approx(1.0, abs=1e-6)
    assert len(trace.stops) == 2  # the start and the end
    rows = simulate(
        one_element(law, C=1.0), Prescribed(0.4), 200.0, initial={"z": [start], "states": ["slip"]}
    )
    assert len(rows) < 250  # explicit steps are limited by stability, not by stops


@pytest.mark.slow
def test_a_threshold_that_moves_is_not_followed():
    """v wobbles inside the dip, and s with it; z crosses s twice per wave without a stop."""
    rig, T = Prescribed("0.05 + 0.03*sin(3*t)"), 40.0
    start = {"z": [1.2], "states": ["slip"]}
    times = np.linspace(0.0, T, 8001)
    trace = simulate(one_element("signed", C=1.0), rig, T, t_eval=times, initial=start)
    stops_of_the_naive_way = np.count_nonzero(np.diff((trace.z >= trace.s)[:, 0]))
    assert stops_of_the_naive_way > 30
    # Stops at landmarks of v are fine; none of them is where z meets s.
    v = 0.05 + 0.03 * np.sin(3 * trace.stops.t[1:])
    gap = trace.stops.y[1:, 1] - trace.model.stribeck(v)
    assert np.abs(gap).min(initial=np.inf) > 1e-6
    assert len(trace.transitions) == 0


def test_slipping_for_an_hour_costs_few_steps():
    """3,600 s at constant speed: the number of stops does not grow with time."""
    trace = simulate(one_element("signed", C=1e-3), Prescribed(0.1), 3600.0, t_eval=[3600.0])
    assert len(trace.transitions) == 1
    assert len(trace.stops) == 4  # the start, the break-away before and after, the end
