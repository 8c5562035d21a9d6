"""Every method has its order: on smooth flow, across a located break-away, corners and jumps.

The slope of log(error) against log(step) is a least-squares fit over 14 fixed steps whose errors
all lie above 1e-13; it is at least p - 0.3.
"""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    Prescribed,
    Slider,
    State,
    Stribeck,
    simulate,
)
from tests.helpers import event_sequence, non_drifting, one_element

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


def slipping(h: float) -> float:
    """z > s while v turns: sgn(v) jumps in the slip flow at t = 1."""
    trace = simulate(
        one_element("signed", F_s=1.0, C=0.3, v_s=1e-3),
        Prescribed("0.4*cos(pi*t/2)"),
        2.0,
        method="rk4",
        step=h,
        initial={"z": [3.0], "states": ["slip"]},
    )
    turn = 1 + 2 * np.exp(-0.3)
    return float(trace.z[-1, 0] - (-1 + (turn + 1) * np.exp(-0.3)))


def pushed(h: float | None) -> float:
    """A force that jumps at 0.33 s, on a bank."""
    rig = Slider(1.0, [(0, 0), (0.33, 0), (0.33, 0.2), (2, 0.2)])
    how = {"method": "rk4", "step": h} if h else {"rtol": 1e-12, "atol": 1e-14}
    return float(simulate(non_drifting("published")[0], rig, 1.0, **how).x[-1])


def bent(h: float | None) -> float:
    """A stiffness that changes at x = 0.3."""
    states = (State("on", flow={"z": "v"}),)
    chart = Chart("bent", ("v", "x"), ("z",), ("c",), states, (), {"F": "c * abs(x - 0.3)"})
    how = {"method": "rk4", "step": h} if h else {"rtol": 1e-12, "atol": 1e-14}
    return float(simulate(ChartModel(chart, {"c": 5.0}), Slider(1.0, "1"), 1.0, **how).x[-1])


def test_rk4_keeps_its_order_across_a_sign_a_jump_and_a_corner():
    """An error by h^4: no stage looks beyond the place, and steps end on it."""
    for run, exact, steps in (
        (slipping, 0.0, [2 / 7, 2 / 13, 2 / 25, 2 / 49]),
        (pushed, pushed(None), [0.02, 0.01]),
        (bent, bent(None), [1 / 20, 1 / 40, 1 / 80]),
    ):
        errors = np.abs([run(h) - exact for h in steps])
        assert np.polyfit(np.log(steps), np.log(errors), 1)[0] > 3.5
