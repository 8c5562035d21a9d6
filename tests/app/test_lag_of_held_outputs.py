"""`lag_of` takes differences at the ticks, and just before the next tick."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import simulate
from gms_fsm.app.paper.held import lag_of
from tests.helpers import non_drifting


def test_before_a_tick_the_force_is_that_of_the_tick_before() -> None:
    model, rig = non_drifting("published")
    h, end = 0.02, 0.4
    ticks = h * np.arange(20)
    held = simulate(model, rig, end, events="held", step=h, t_eval=np.append(ticks, end))
    inside = simulate(model, rig, end, rtol=1e-9)
    lag = lag_of(held, inside)
    np.testing.assert_array_equal(lag.t, ticks)
    exact = inside.sample([*ticks, end])
    np.testing.assert_array_equal(lag.force, held.F[:-1] - exact.F[:-1])
    np.testing.assert_array_equal(lag.before, held.F[:-1] - exact.F[1:])
    np.testing.assert_array_equal(lag.place, held.x[:-1] - exact.x[:-1])
    assert lag.during((0.1, 0.2)).t == pytest.approx([0.1, 0.12, 0.14, 0.16, 0.18])
    assert lag.largest_before > lag.median[0]


def test_it_needs_a_sample_time() -> None:
    run = simulate(*non_drifting("published"), 0.1)
    with pytest.raises(TypeError, match="must have a sample time"):
        lag_of(run, run)
