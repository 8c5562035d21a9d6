"""At a jump of a signal its left value is used before, its right value after, at full order."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Prescribed, Slider, simulate
from tests.helpers import non_drifting, one_element


def test_velocity_step_moves_z_exactly() -> None:
    """Stick integrates v exactly, so a step in v leaves no error at all, whatever the step."""
    ramps = [(0, 0.1), (1.05, 0.1), (1.05, -0.3), (3, -0.3)]
    for options in ({}, {"method": "rk4", "step": 0.2}, {"method": "euler", "step": 0.2}):
        trace = simulate(one_element("signed", F_s=9, F_c=9), Prescribed(ramps), 2.0, **options)
        assert trace.z[-1, 0] == pytest.approx(0.1 * 1.05 - 0.3 * 0.95, abs=1e-14)
        at = np.flatnonzero(np.abs(trace.t - 1.05) < 1e-12)
        assert trace.v[at].tolist() == [0.1, -0.3]


@pytest.mark.slow
def test_force_step_keeps_the_order_of_the_method() -> None:
    """The error of rk4 across a force step falls with the fourth power of the step."""
    model, _ = non_drifting("published")
    rig = Slider(1.0, [(0, 0), (0.33, 0), (0.33, 0.2), (2, 0.2)])
    exact = simulate(model, rig, 1.0, rtol=1e-12, atol=1e-14).x[-1]
    errors = [
        abs(simulate(model, rig, 1.0, method="rk4", step=h).x[-1] - exact) for h in (0.02, 0.01)
    ]
    assert errors[1] < errors[0] / 12


def test_a_requested_time_on_a_jump_is_right_continuous() -> None:
    ramps = [(0, 0.1), (1, 0.1), (1, -0.3), (3, -0.3)]
    trace = simulate(one_element("signed"), Prescribed(ramps), 2.0, t_eval=[0.5, 1.0, 2.0])
    assert trace.v.tolist() == [0.1, -0.3, -0.3]
