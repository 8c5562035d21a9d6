"""At constant velocity an element follows the closed forms of both laws to 1e-9.

Sticking, z grows linearly and breaks away at t* = (s - z0)/v; slipping, z is one exponential. At
the break-away the force steps by sigma (dz_slip - v).
"""

import math

import numpy as np
import pytest
from scipy.integrate import DOP853

from gms_fsm import Prescribed, simulate
from tests.helpers import event_sequence, one_element

TIGHT = {"rtol": 1e-10, "atol": 1e-12}
METHODS = [{"method": "dp45"}, {"method": "bs23"}, {"method": DOP853}]
F_c, F_s, v_s, C, sigma = 1.0, 1.5, 0.05, 0.4, 0.3
# Far outside the Stribeck dip, and inside it, where s is between F_c and F_s.
VELOCITIES = [0.3, -0.3, 0.04, -0.04]


def s_of(v: float) -> float:
    return F_c + (F_s - F_c) * math.exp(-((v / v_s) ** 2))


def slip_closed_form(law: str, v: float, z0: float, t: np.ndarray) -> np.ndarray:
    s = s_of(v)
    if law == "published" and v < 0:
        return s + (z0 - s) * np.exp(C * t / s)
    z_inf = math.copysign(s, v)
    return z_inf + (z0 - z_inf) * np.exp(-C * t / s)


@pytest.mark.parametrize("method", METHODS, ids=lambda m: str(m["method"]))
@pytest.mark.parametrize("share", [-1.7, -0.6, 0.0, 0.5, 1.4])
@pytest.mark.parametrize("v", VELOCITIES)
@pytest.mark.parametrize("law", ["signed", "published"])
def test_a_slipping_element_follows_its_exponential(law, v, share, method):
    """From any start z0 = share * s the deflection is the exponential, up to C T / s = 5."""
    s = s_of(v)
    z0, T = share * s, 5 * s / C
    times = np.linspace(0.0, T, 41)
    trace = simulate(
        one_element(law, C=C, sigma=sigma),
        Prescribed(v),
        T,
        t_eval=times,
        initial={"z": [z0], "states": ["slip"]},
        **TIGHT,
        **method,
    )
    expected = slip_closed_form(law, v, z0, times)
    np.testing.assert_allclose(trace.z[:, 0], expected, rtol=1e-9, atol=1e-9 * s)
    assert len(trace.transitions) == 0


@pytest.mark.parametrize(
    "method", [*METHODS, {"method": "rk4", "step": 7e-3}], ids=lambda m: str(m["method"])
)
@pytest.mark.parametrize("v", VELOCITIES)
@pytest.mark.parametrize("law", ["signed", "published"])
def test_a_sticking_element_breaks_away_at_t_star(law, v, method):
    """z = z0 + v t until t* = (s - z0)/v (mirrored for v < 0); then the slip law takes over."""
    s, z0 = s_of(v), 0.25
    t_star = (math.copysign(s, v) - z0) / v
    T = t_star + 2 * s / C
    times = np.union1d(np.linspace(0.0, t_star * (1 - 1e-9), 20), np.linspace(t_star, T, 21)[1:])
    trace = simulate(
        one_element(law, C=C, sigma=sigma),
        Prescribed(v),
        T,
        t_eval=times,
        initial={"z": [z0]},
        **TIGHT,
        **method,
    )
    edge = "break_away_forward" if v > 0 else "break_away_backward"
    assert event_sequence(trace) == [(0, edge)]
    assert trace.transitions.t[0] == pytest.approx(t_star, rel=1e-12)
    expected = np.where(
        times < t_star,
        z0 + v * times,
        slip_closed_form(law, v, math.copysign(s, v), np.maximum(times - t_star, 0.0)),
    )
    np.testing.assert_allclose(trace.z[:, 0], expected, rtol=1e-9, atol=1e-9 * s)
    assert (trace.states[:, 0] == np.where(times < t_star, "stick", "slip")).all()


@pytest.mark.parametrize("v", VELOCITIES)
@pytest.mark.parametrize("law", ["signed", "published"])
def test_the_force_steps_at_the_break_away(law, v):
    """F_after - F_before = sigma (dz_slip - v): the force is not continuous there."""
    trace = simulate(one_element(law, C=C, sigma=sigma), Prescribed(v), 1.8 / abs(v), **TIGHT)
    record = trace.transitions[0]
    if law == "signed":
        dz_slip = C * (math.copysign(1.0, v) - record.z / record.s)
    else:
        dz_slip = math.copysign(1.0, v) * C * (1 - record.z / record.s)
    step = record.F_after - record.F_before
    assert step == pytest.approx(sigma * (dz_slip - v), rel=1e-12)
    assert abs(step) > 0.01
