"""v passes |v| <= v_c in microseconds, and no arrest is stepped over.

Compared with the naive ways: guards evaluated only at step ends, the zero of one composed margin,
and a root of a margin taken for a point where the guard is true.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, simulate
from tests.helpers import SINE, event_sequence, open_loop, pulled_mass, stick_slip

F_c, F_s, v_s, v_c, C = 0.4, 1.5, 1e-3, 1e-6, 0.1  # Table I, element 1


def velocity(t):
    return 0.2 * math.sin(2 * math.pi * t / 20)


def s_of(v):
    return F_c + (F_s - F_c) * math.exp(-((v / v_s) ** 2))


def first_element():
    parameters = GMSParameters(
        [0.7], [0.3], [C], sigma_2=0.1, stribeck=Stribeck(F_c, F_s, v_s), v_c=v_c
    )
    return GMS(parameters, law="signed")


def guards_at_step_ends(h, T):
    """Return the number of switches and z(T) of an Euler if-else loop."""
    z, state, switches = 0.0, "stick", 0
    for j in range(round(T / h)):
        v = velocity(j * h)
        s = s_of(v)
        if state == "stick" and ((z >= s and v > v_c) or (z <= -s and v < -v_c)):
            state, switches = "slip", switches + 1
        elif state == "slip" and abs(v) <= v_c and abs(z) < s:
            state, switches = "stick", switches + 1
        z += h * (v if state == "stick" else C * (math.copysign(1, v) - z / s))
    return switches, z


def test_step_ends_step_over_the_window():
    """The naive loop never arrests; the located run arrests at 10 s and keeps z."""
    located = simulate(first_element(), open_loop(), 13.0, rtol=1e-9, atol=1e-12)
    assert event_sequence(located) == [(0, "break_away_forward"), (0, "arrest")]
    assert located.transitions.t[1] == pytest.approx(10.0, abs=1e-4)
    switches, z = guards_at_step_ends(1.003e-3, 13.0)
    assert switches == 1
    assert abs(z - located.z[-1, 0]) > 0.05
    # The Euler step is not to blame: with samples in the window the same loop is right.
    switches, z = guards_at_step_ends(1e-3, 13.0)
    assert switches == 2
    assert abs(z - located.z[-1, 0]) < 5e-3


def test_a_composed_margin_shows_no_sign_change():
    """SciPy's event search on min(v_c - |v|, s - |z|) sees no arrest at any tolerance."""

    def slip(t, z):
        return [C * (1.0 - z[0] / s_of(velocity(t)))]

    def arrest(t, z):
        v = velocity(t)
        return min(v_c - abs(v), s_of(v) - abs(z[0]))

    for rtol in (1e-6, 1e-9, 1e-12):
        run = solve_ivp(slip, (5.0, 13.0), [0.4], events=arrest, rtol=rtol, atol=1e-12)
        assert len(run.t_events[0]) == 0
    ours = simulate(
        first_element(),
        Prescribed(SINE),
        13.0,
        t_start=5.0,
        initial={"z": [0.4], "states": ["slip"]},
    )
    assert event_sequence(ours) == [(0, "arrest")]


def guard_holds(record, v_c):
    z, v, s = record.z, record.v, record.s
    return {
        "break_away_forward": z >= s and v > v_c,
        "break_away_backward": z <= -s and v < -v_c,
        "arrest": abs(v) <= v_c and abs(z) < s,
    }[record.edge]


@pytest.mark.parametrize("method", [{}, {"method": "bs23"}, {"method": "rk4", "step": 0.0501}])
@pytest.mark.parametrize("case", ["open, signed", "open, published", "pulled mass"])
def test_raw_guards_hold_where_they_fire(case, method):
    """At every firing the guard is true on the logged numbers, without any tolerance."""
    if case == "pulled mass":
        trace = simulate(*pulled_mass(), 30.0, **method)
    else:
        trace = simulate(stick_slip(case.split()[1]), open_loop(), 61.0, **method)
    assert len(trace.transitions) > 20
    for record in trace.transitions:
        assert guard_holds(record, v_c)


@pytest.mark.slow
def test_a_root_is_not_yet_true():
    """A root finder's zero of v_c - v(t) often lies where |v| <= v_c is still false."""
    false = 0
    for period in range(3, 43):
        root = brentq(
            lambda t, T=period: 0.2 * math.sin(2 * math.pi * t / T) - v_c,
            0.3 * period,
            0.6 * period,
            xtol=1e-15,
        )
        false += not abs(0.2 * math.sin(2 * math.pi * root / period)) <= v_c
        ours = simulate(
            first_element(),
            Prescribed(f"0.2*sin(2*pi*t/{period})"),
            0.6 * period,
            t_start=0.3 * period,
            initial={"z": [0.4], "states": ["slip"]},
        )
        assert event_sequence(ours) == [(0, "arrest")]
        assert guard_holds(ours.transitions[0], v_c)
    assert false > 5


def test_a_margin_that_starts_at_zero_is_not_lost():
    """z starts exactly on s: as soon as v passes v_c the element breaks away, with no bracket."""
    model = first_element()
    for v in (0.3, -0.3):
        s = float(Stribeck(F_c, F_s, v_s)(v))
        trace = simulate(model, Prescribed(v), 0.1, initial={"z": [math.copysign(s, v)]})
        assert len(trace.transitions) == 1
        assert trace.transitions.t[0] == 0.0
    ramp = Prescribed([(0, 0), (1, 0.5)])
    trace = simulate(model, ramp, 1.0, initial={"z": [F_s]})
    assert event_sequence(trace) == [(0, "break_away_forward")]
    # v = v_c at 2 microseconds, one clock tick more or less.
    assert trace.transitions.t[0] == pytest.approx(2e-6, rel=1e-6)
    assert np.diff(trace.t).min() >= 0
