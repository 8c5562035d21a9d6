"""The jump of sgn(v) in the slip flow costs no order: steps end on it and the sign is frozen.

For comparison: a naive Runge-Kutta loop that evaluates sgn in its stages falls back to order 1.
"""

import math

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from tests.helpers import one_element

# F_s = F_c = 1: s = 1. From z0 = 3 the element still has z > s when v turns at t = 1.
C, z0, T = 0.3, 3.0, 2.0
Z_TURN = 1 + (z0 - 1) * math.exp(-C)
EXACT = -1 + (Z_TURN + 1) * math.exp(-C)


def naive_rk4(h):
    def flow(t, z):
        v = 0.4 * math.cos(math.pi * t / 2)
        return C * ((v > 0) - (v < 0) - z)

    z, t = z0, 0.0
    for _ in range(round(T / h)):
        k1 = flow(t, z)
        k2 = flow(t + h / 2, z + h / 2 * k1)
        k3 = flow(t + h / 2, z + h / 2 * k2)
        k4 = flow(t + h, z + h * k3)
        z, t = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), t + h
    return z


def ours(**options):
    trace = simulate(
        one_element("signed", F_c=1.0, F_s=1.0, C=C, v_s=1e-3),
        Prescribed("0.4*cos(pi*t/2)"),
        T,
        initial={"z": [z0], "states": ["slip"]},
        **options,
    )
    assert len(trace.transitions) == 0
    return trace


def test_fixed_steps_keep_order_four():
    """Our rk4 is accurate to 1e-6 at once and gains with h^4; the naive one is wrong by 1e-2."""
    steps = [2 / 7, 2 / 13, 2 / 25, 2 / 49]
    errors = np.array([abs(ours(method="rk4", step=h).z[-1, 0] - EXACT) for h in steps])
    assert errors.max() < 1e-5
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] > 3.7
    naive = np.array([abs(naive_rk4(h) - EXACT) for h in steps])
    assert (naive > 1e3 * errors).all()
    assert naive[-1] > 1e-4


@pytest.mark.parametrize("options", [{}, {"method": "bs23"}])
def test_adaptive_steps_do_not_shrink_toward_the_reversal(options):
    """Adaptive runs stop once at the reversal instead of shrinking their steps toward it."""
    trace = ours(**options)
    assert abs(trace.z[-1, 0] - EXACT) < 2e-6
    assert len(trace) < 200


def test_the_sign_is_zero_only_at_zero():
    """sgn(0) = 0: while v dwells at exactly 0 a slipping element creeps to z = 0 (signed law)."""
    model = one_element("signed", F_c=1.0, F_s=1.0, C=C)
    start = {"z": [2.0], "states": ["slip"]}
    trace = simulate(model, Prescribed(0.0), 1.5, initial=start, rtol=1e-9, atol=1e-12)
    assert trace.z[-1, 0] == pytest.approx(2.0 * math.exp(-C * 1.5), rel=1e-8)
    published = one_element("published", F_c=1.0, F_s=1.5, C=C)
    trace = simulate(published, Prescribed(0.0), 1.5, initial=start)
    assert trace.z[-1, 0] == 2.0
