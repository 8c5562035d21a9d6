"""A sliding mode at v = 0 ends in a LivelockError that names the scene and keeps the run so far.

An element in slip with z <= -s cannot arrest; its force pushes v back to zero from both sides.
The naive fixed-step loop chatters there without a word.
"""

import math

import pytest

from gms_fsm import Slider, simulate
from gms_fsm.errors import LivelockError
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


@pytest.mark.parametrize("engine", ["machines", "ifelse"])
def test_the_error_names_the_scene(engine):
    """Element, state, edge, z, s, v, time; the part of the run before it is in `.trace`."""
    model, rig, start = case("published")
    with pytest.raises(LivelockError) as caught:
        simulate(model, rig, 5.0, initial=start, engine=engine)
    text, trace = str(caught.value), caught.value.trace
    for part in ("element 1", "slip", "arrest", "z = -2.4", "s = 1.5", "v = ", "t = "):
        assert part in text
    assert len(trace) > 3
    assert trace.t[0] == 0.0
    assert 0.0 < trace.t[-1] < 1.0
    assert abs(trace.v[-1]) < 1e-9
    assert trace.z[0, 0] == z0


@pytest.mark.parametrize("options", [{"method": "bs23"}, {"method": "rk4", "step": 1e-3}])
def test_other_methods_end_there_too(options):
    """Adaptive or fixed, the same place within the step's accuracy."""
    model, rig, start = case("published")
    with pytest.raises(LivelockError) as caught:
        simulate(model, rig, 5.0, initial=start, **options)
    assert abs(caught.value.trace.v[-1]) < 1e-6


def test_below_the_threshold_it_arrests():
    """The same rig with |z| < s at the reversal arrests and goes on."""
    model, _, start = case("published")
    start |= {"z": [-1.2]}
    trace = simulate(model, Slider(1.0, -1.2 * k), 5.0, initial=start)
    assert trace.transitions.edge[0] == "arrest"
    assert trace.t[-1] == 5.0
