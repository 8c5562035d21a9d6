"""States are frozen within a step, including Runge-Kutta stages, and sticking causes no stops.

For comparison: a naive Runge-Kutta step whose stages may switch loses its order.
"""

import math

import numpy as np
import pytest

import integrators
from gms_fsm import Prescribed, simulate
from gms_fsm.lowering.program import lower
from gms_fsm.run.machines import IfElse
from tests.helpers import one_element, open_loop, pulled_mass, stick_slip

C, v = 1.0, -0.5  # published law: after the break-away z = s + (z0 - s) exp(C t / s), s = 1
EXACT = 1 - 2 * math.exp(1.0)  # at t = 3, one second after t* = 2


def naive_rk4(h, T):
    """Let each stage decide for itself whether the element slips."""

    def flow(z):
        return v if z > -1.0 else -C * (1 - z)

    z = 0.0
    for _ in range(round(T / h)):
        k1 = flow(z)
        k2 = flow(z + h / 2 * k1)
        k3 = flow(z + h / 2 * k2)
        k4 = flow(z + h * k3)
        z += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return z


def test_stages_that_switch_cost_the_order():
    """rk4 over a break-away inside a step: ours is accurate to h^4, the naive one is not."""
    for steps in (7, 11, 17):
        h = 3.0 / steps
        ours = simulate(
            one_element("published", F_s=1.0 + 1e-15, C=C, v_s=1e-3),
            Prescribed(v),
            3.0,
            method="rk4",
            step=h,
        ).z[-1, 0]
        assert abs(ours - EXACT) < 0.04 * h**4
        assert abs(naive_rk4(h, 3.0) - EXACT) > 3 * abs(ours - EXACT)
        assert abs(naive_rk4(h, 3.0) - EXACT) > 1e-3


@pytest.mark.parametrize("case", ["open loop", "pulled mass"])
@pytest.mark.parametrize("method", ["dp45", "rk4"])
def test_the_flow_sees_one_mode_per_step(case, method):
    """Every call of the flow between two firings has the same modes."""
    model, rig = pulled_mass() if case == "pulled mass" else (stick_slip("signed"), open_loop())
    program = lower(model, rig)
    modes: list[tuple[int, ...]] = []

    def flow(t, y, mode, held, p, dy):
        modes.append(tuple(mode))
        program.ieee["flow"](t, y, mode, held, p, dy)

    equations = integrators.Equations(
        flow=flow,
        flow_live=program.ieee["flow_live"],
        arm=program.ieee["arm"],
        margins=program.ieee["margins"],
        normal=program.ieee["normal"],
        p=program.p,
        held=program.held,
        strict=program.strict,
        relations=program.relations,
        surfaces=program.surfaces,
    )
    switch = IfElse(program)
    options = integrators.LoopOptions(
        integrators.METHODS[method],
        0.0501 if method == "rk4" else None,
        1e-6,
        [1e-9] * program.layout.y.size,
        math.inf,
        1.0,
        100_000,
        True,
        None,
    )
    arcs = firings = 0
    y = [0.0] * program.layout.y.size
    for event in integrators.run(equations, switch, 0.0, y, [0] * 4, 21.0, options):
        if isinstance(event, integrators.Firing):
            firings += 1
        elif isinstance(event, integrators.Arc):
            arcs += 1
            assert set(modes) <= {event.mode[:4]}  # followed by the surfaces' flags
        if not isinstance(event, integrators.Stop):
            modes.clear()
    assert firings > 10
    assert arcs > firings / 4


@pytest.mark.slow
@pytest.mark.parametrize("amplitude", [5e-3, 0.1])
@pytest.mark.parametrize("law", ["signed", "published"])
def test_sticking_makes_no_stops_at_reversals(law, amplitude):
    """20 waves below break-away: v passes v_c, 0 and -v_c 40 times and nothing stops there."""
    T = 20.0
    signal = f"{amplitude}*sin(2*pi*t + 0.3)"
    trace = simulate(stick_slip(law), Prescribed(signal), T, t_eval=[T])
    assert len(trace.transitions) == 0
    # The naive way stops three times in each of 40 passages. Landmarks of s(v) may be stops;
    # the smallest of them is a considerable fraction of v_s = 1e-3 m/s.
    stop_v = amplitude * np.sin(2 * np.pi * trace.stops.t[1:] + 0.3)
    assert np.abs(stop_v).min(initial=np.inf) > 10e-6
