"""Every method has its order: on smooth flow, and across a located break-away.

The slope of log(error) against log(step) is a least-squares fit over 14 fixed steps whose errors
all lie above 1e-13; it is at least p - 0.3.
"""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from gms_fsm import GMS, GMSParameters, Prescribed, Slider, Stribeck, simulate
from tests.helpers import event_sequence

ORDERS = {"euler": 1, "heun": 2, "bs23": 3, "rk4": 4, "dp45": 5}
SIZES = np.unique(np.round(np.geomspace(6, 40, 14)).astype(int))  # steps in a unit of time


def fitted_slope(steps: np.ndarray, errors: np.ndarray) -> float:
    assert len(errors) >= 12
    assert errors.min() > 1e-13
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


@pytest.mark.parametrize("method", ORDERS)
def test_order_on_smooth_flow(method):
    """A slider on sticking elements is a forced linear oscillator: exact by matrix exponential."""
    # v_s is so wide that the run never leaves the dip: no stop cuts a step.
    parameters = GMSParameters(
        [3.0, 5.0], [0.1, 0.2], [1.0, 1.0], sigma_2=0.1, stribeck=Stribeck(9.0, 9.5, 10.0), v_c=1e-6
    )
    model = GMS(parameters, law="signed")
    K, D, w, T = 8.0, 0.4, 1.5, 2.0
    # (x, v, sin wt, cos wt)' for m = 1 and F_a = 2 sin wt
    A = np.array([[0, 1, 0, 0], [-K, -D, 2, 0], [0, 0, 0, w], [0, 0, -w, 0]], dtype=float)
    x0, v0 = 0.1, -0.2
    exact = (expm(A * T) @ [x0, v0, 0.0, 1.0])[:2]
    steps, errors = T / (2 * SIZES), []
    for h in steps:
        trace = simulate(
            model,
            Slider(1.0, f"2*sin({w}*t)"),
            T,
            method=method,
            step=float(h),
            initial={"x": x0, "v": v0, "z": [x0, x0]},
        )
        assert len(trace.transitions) == 0
        errors.append(np.hypot(trace.x[-1] - exact[0], trace.v[-1] - exact[1]))
    assert fitted_slope(steps, np.array(errors)) >= ORDERS[method] - 0.3


@pytest.mark.parametrize("method", ORDERS)
def test_order_across_a_break_away(method):
    """The break-away is at the fraction 0.37 of its step for all step sizes."""
    F_c, C = 1.0, 1.0
    parameters = GMSParameters(
        [1.0], [0.1], [C], sigma_2=0.0, stribeck=Stribeck(F_c, 1.5, 1e-3), v_c=1e-6
    )
    model = GMS(parameters, law="published")  # v < 0: after the break-away z grows without bound

    def z_stick(t: float) -> float:
        return -0.5 * t - 0.1 * (1 - np.cos(2 * t))

    t_star = brentq(lambda t: z_stick(t) + F_c, 0.0, 3.0, xtol=1e-15)
    T = 2 * t_star
    exact = F_c - 2 * F_c * np.exp(C * (T - t_star) / F_c)
    steps, errors, places = t_star / (3 * SIZES + 0.37), [], []
    for h in steps:
        trace = simulate(model, Prescribed("-0.5 - 0.2*sin(2*t)"), T, method=method, step=float(h))
        assert event_sequence(trace) == [(0, "break_away_backward")]
        errors.append(abs(trace.z[-1, 0] - exact))
        places.append(abs(trace.transitions.t[0] - t_star))
    assert fitted_slope(steps, np.array(errors)) >= ORDERS[method] - 0.3
    assert max(places) < max(steps)
