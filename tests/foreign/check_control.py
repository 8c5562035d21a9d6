"""Claim: in python-control the servo converges to that of `simulate`, with order one."""

from __future__ import annotations

import control
import numpy as np
import pytest

from tests.adapters.loops import LOAD, T_END, exact_servo, servo_in_control


def end_of_load(dt: float) -> float:
    """Return where the load is at the end."""
    t = dt * np.arange(round(T_END / dt) + 1)
    response = control.input_output_response(servo_in_control(dt), t, np.zeros((0, t.size)))
    return float(response.outputs[2, -1])


def test_the_servo() -> None:
    exact = exact_servo().body("load").x[-1]
    assert exact == pytest.approx(LOAD, rel=1e-4)
    steps = np.array([2e-4, 1e-4, 5e-5, 2e-5])
    errors = np.array([abs(end_of_load(dt) - exact) for dt in steps])
    assert errors[0] < 5e-3 * LOAD
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(1.0, abs=0.2)
