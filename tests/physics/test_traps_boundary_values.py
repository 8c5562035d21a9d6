"""Values on a boundary are ordinary: each case has one result, stated here.

F_s = F_c, a start on z = s with v around v_c, and a record that dwells at v = 0.
"""

import math

import numpy as np
import pytest

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, simulate
from tests.helpers import event_sequence, one_element

V_C = 1e-6
LAWS = ["signed", "published"]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("speed", [0.0, 0.5, 1.0, 2.0, -1.0, -2.0])
def test_start_on_the_threshold(side, speed, law):
    """z = s (or -s): it breaks away at once if v > v_c outward, and keeps sticking otherwise."""
    v = side * speed * V_C
    model = one_element(law)
    s = float(model.stribeck(v))
    trace = simulate(model, Prescribed(v), 1.0, initial={"z": [side * s]})
    if speed > 1.0:  # beyond v_c, outward
        edge = "break_away_forward" if side > 0 else "break_away_backward"
        assert event_sequence(trace) == [(0, edge)]
        assert trace.transitions.t[0] == 0.0
        if law == "published" and side < 0:
            expected = s - 2 * s * math.exp(0.1 / s)  # eq. (1) as printed, v < 0
        else:
            expected = side * s
    else:  # v_c itself is not beyond v_c
        assert len(trace.transitions) == 0
        expected = side * s + v
    assert trace.z[-1, 0] == pytest.approx(expected, rel=1e-6)


def test_plain_maxwell_slip_holds_z_on_s():
    """F_s = F_c, signed: z stays on the threshold to the last bits while it slips."""
    model = one_element("signed", F_s=1.0)
    trace = simulate(model, Prescribed("1.5*sin(t)"), 20.0)
    slipping = trace.states[:, 0] == "slip"
    assert slipping.any()
    assert np.abs(np.abs(trace.z[slipping, 0]) - 1.0).max() < 1e-9
    edges = [edge for _, edge in event_sequence(trace)]
    assert edges[0] == "break_away_forward"
    assert "break_away_backward" in edges
    assert np.abs(trace.z).max() < 1 + 1e-9


def test_plain_maxwell_slip_is_the_play_operator():
    """F_s = F_c, signed, many elements: z_i is the clipped play of x, as in Maxwell's model."""
    weights = np.array([0.3, 0.1, 0.55, 0.2])
    parameters = GMSParameters(
        [1.0] * 4,
        [0.0] * 4,
        [50.0] * 4,
        sigma_2=0.0,
        stribeck=Stribeck(1.0, 1.0, 1e-3),
        v_c=V_C,
        weights=weights,
    )
    ramps = [
        (0, 0.4), (2, 0.4), (2.001, -0.4), (3.5, -0.4), (3.501, 0.4), (4, 0.4), (4.001, -0.4),
        (7, -0.4),
    ]  # fmt: skip
    times = np.linspace(0, 7, 14001)
    trace = simulate(
        GMS(parameters, law="signed"), Prescribed(ramps), 7.0, t_eval=times, rtol=1e-8, atol=1e-11
    )
    z, play = np.zeros(4), []
    for dx in np.diff(trace.x, prepend=trace.x[0]):
        z = np.clip(z + dx, -weights, weights)
        play.append(z)
    assert np.abs(trace.z - np.array(play)).max() < 1e-6


def test_a_dwell_at_zero_ends_an_arrested_element():
    """Ramps that stop: an element below s arrests at v_c and rests with z unchanged."""
    ramps = [(0, 0.5), (3, 0.5), (4, 0), (6, 0), (7, 0.5), (9, 0.5)]
    trace = simulate(one_element("signed"), Prescribed(ramps), 9.0, rtol=1e-9, atol=1e-12)
    assert [e for _, e in event_sequence(trace)] == [
        "break_away_forward",
        "arrest",
        "break_away_forward",
    ]
    assert trace.transitions.t[1] == pytest.approx(4 - 2 * V_C, abs=1e-9)
    dwell = (trace.t >= 4) & (trace.t <= 6)
    assert np.ptp(trace.z[dwell, 0]) == 0.0
    assert (trace.F[dwell] == trace.F[dwell][0]).all()


DWELL = [(0, 0.5), (1, 0), (6, 0), (7, 0.5), (9, 0.5)]


def test_a_dwell_while_an_element_slips_signed():
    """z > s at v = 0: sgn(0) = 0 lets z decay by exp(-C t / s) until |z| < s, then it arrests."""
    C, z0 = 0.5, 2.5
    trace = simulate(
        one_element("signed", C=C),
        Prescribed(DWELL),
        6.0,
        rtol=1e-10,
        atol=1e-13,
        initial={"z": [z0], "states": ["slip"]},
    )
    assert event_sequence(trace) == [(0, "arrest")]
    record = trace.transitions[0]
    i = int(np.flatnonzero(trace.t >= 1.0)[0])
    z_1 = trace.z[i, 0]
    assert trace.t[i] == pytest.approx(1.0, abs=1e-12)
    assert record.s == 1.5
    assert record.z < 1.5
    assert record.t == pytest.approx(1.0 + 1.5 / C * math.log(z_1 / 1.5), abs=1e-8)
    assert trace.z[-1, 0] == record.z


def test_a_dwell_while_an_element_slips_published():
    """Published: with sgn(0) = 0 the deflection is constant at v = 0 and cannot arrest."""
    trace = simulate(
        one_element("published", C=0.5),
        Prescribed(DWELL),
        6.0,
        initial={"z": [2.5], "states": ["slip"]},
    )
    assert len(trace.transitions) == 0
    dwell = trace.t >= 1.0
    assert dwell.sum() > 1
    assert np.ptp(trace.z[dwell, 0]) < 1e-12
    assert trace.z[-1, 0] > 1.5


def test_the_published_law_with_equal_thresholds_warns():
    """F_s = F_c: eq. (1) rests exactly on |z| = s, so |z| < s never occurs; signed is fine."""
    with pytest.warns(UserWarning, match="never arrests"):
        model = one_element("published", F_s=1.0)
    trace = simulate(model, Prescribed([(0, 0.5), (3, 0.5), (4, 0), (6, 0)]), 6.0)
    assert event_sequence(trace) == [(0, "break_away_forward")]
    assert trace.z[-1, 0] == pytest.approx(1.0, abs=1e-9)
    one_element("signed", F_s=1.0)  # a warning would end the test here
