"""A sliding mode at v = 0 follows its closed form; the naive loop chatters.

An element in slip with z <= -s cannot arrest; its force pushes v back to zero from both sides. At
v = 0 the force equals the applied one, so sigma dz/dt = F_a - k z: z tends to F_a / k like
exp(-k t / sigma), and the sign is replaced by sigma = (dz/dt) / (C (1 - z / s)).
"""

import math

import numpy as np
import pytest

from gms_fsm import Slider, simulate
from tests.helpers import one_element

F_c, F_s, v_s, C, sigma, k = 1.0, 1.5, 0.05, 0.1, 5.0, 1.0
z0, v0 = -2.5, 0.05  # |z| > s = 1.5 at v = 0
F_a = k * z0 + 0.1  # between the forces on both sides of v = 0


def case(law):
    model = one_element(law, F_c=F_c, F_s=F_s, v_s=v_s, C=C, sigma=sigma, k=k)
    return model, Slider(1.0, F_a), {"z": [z0], "states": ["slip"], "v": v0}


def test_the_naive_loop_chatters():
    """Euler steps of 1 ms: v changes its sign hundreds of times in a second."""
    z, v, signs, before = z0, v0, 0, 1.0
    for _ in range(1000):
        s = F_c + (F_s - F_c) * math.exp(-((v / v_s) ** 2))
        sign = (v > 0) - (v < 0)
        dz = sign * C * (1 - z / s)
        z, v = z + 1e-3 * dz, v + 1e-3 * (F_a - k * z - sigma * dz)
        if sign and sign != before:
            signs, before = signs + 1, sign
    assert signs > 100
    assert abs(v) < 1e-2


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        {"engine": "machines"},
        {"engine": "ifelse"},
        {"method": "bs23"},
        {"method": "rk4", "step": 1e-3},
    ],
)
def test_sliding_follows_the_closed_form(options):
    """It reaches v = 0 after 38 ms and never leaves: |z| stays above s."""
    model, rig, start = case("published")
    trace = simulate(model, rig, 20.0, initial=start, **options)
    (slide,) = trace.sliding
    assert slide.t_start == pytest.approx(0.0380130, abs=1e-5)
    assert slide.t_end == 20.0
    on = trace.rows.mode[:, 1] == 1
    t, z = trace.t[on], trace.z[on, 0]
    exact = F_a / k + (z[0] - F_a / k) * np.exp(-k * (t - t[0]) / sigma)
    assert np.abs(z - exact).max() < 2e-6
    assert (trace.v[on] == 0.0).all()
    assert np.abs(trace.F[on] - F_a).max() < 1e-14
    rate = (F_a - k * z) / sigma
    assert slide.sigma_start == pytest.approx(rate[0] / (C * (1 - z[0] / F_s)), abs=1e-12)
    assert slide.sigma_end == pytest.approx(rate[-1] / (C * (1 - z[-1] / F_s)), abs=1e-12)


def test_it_leaves_when_the_push_exceeds_both_sides():
    """F_a falls until the side v < 0 releases: sigma reaches -1, and v becomes negative."""
    model, _, start = case("published")
    trace = simulate(model, Slider(1.0, f"{F_a} - 5*t"), 5.0, initial=start)
    (slide,) = trace.sliding
    assert slide.sigma_end == pytest.approx(-1.0, abs=1e-9)
    after = trace.t > slide.t_end
    assert (trace.v[after] < 0.0).all()


def test_below_the_threshold_it_arrests():
    """The same rig with |z| < s at the reversal arrests and continues."""
    model, _, start = case("published")
    start |= {"z": [-1.2]}
    trace = simulate(model, Slider(1.0, -1.2 * k), 5.0, initial=start)
    assert trace.transitions.edge[0] == "arrest"
    assert trace.t[-1] == 5.0
