"""Runs follow exact solutions: at constant velocity, at boundary values, while everything sticks.

Sticking, z grows with x; slipping at constant velocity it is one exponential; with F_s = F_c the
element is Maxwell's, and a bank is a sum of play operators.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from scipy.integrate import DOP853
from scipy.linalg import expm

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, simulate
from tests.helpers import FASTEST, event_sequence, non_drifting, one_element

F_c, F_s, v_s, C, sigma, V_C = 1.0, 1.5, 0.05, 0.4, 0.3, 1e-6
LAWS = ("signed", "published")
VELOCITIES = (0.3, -0.3, 0.04, -0.04)  # outside the Stribeck dip, and inside it


@dataclass(frozen=True)
class Case:
    """A run of one element, its exact z, and its edges with their times."""

    model: GMS
    velocity: Any
    t_end: float
    z: Callable[[np.ndarray], np.ndarray]
    start: dict[str, Any]
    edges: list[tuple[str, float]] = field(default_factory=list)


def s_of(v: float) -> float:
    return F_c + (F_s - F_c) * math.exp(-((v / v_s) ** 2))


def slip(law: str, v: float, z0: float, t: np.ndarray, s: float = 0.0) -> np.ndarray:
    s = s or s_of(v)
    if law == "published" and v < 0:
        return s + (z0 - s) * np.exp(C * t / s)
    z_inf = math.copysign(s, v)
    return z_inf + (z0 - z_inf) * np.exp(-C * t / s)


def edge_of(v: float) -> str:
    return "break_away_forward" if v > 0 else "break_away_backward"


def slipping(law: str, v: float, share: float) -> Case:
    """From any z0 = share * s, up to C T / s = 5."""
    s = s_of(v)
    start = {"z": [share * s], "states": ["slip"]}
    exact = lambda t: slip(law, v, share * s, t)  # noqa: E731
    return Case(one_element(law, C=C, sigma=sigma), v, 5 * s / C, exact, start)


def sticking(law: str, v: float) -> Case:
    """z = z0 + v t until it meets s (or -s), then the slip law."""
    s, z0 = math.copysign(s_of(v), v), 0.25
    t_star = (s - z0) / v

    def exact(t: np.ndarray) -> np.ndarray:
        later = slip(law, v, s, np.maximum(t - t_star, 0.0))
        return np.where(t < t_star, z0 + v * t, later)

    t_end, edges = t_star + 2 * abs(s) / C, [(edge_of(v), t_star)]
    return Case(one_element(law, C=C, sigma=sigma), v, t_end, exact, {"z": [z0]}, edges)


def on_the_threshold(law: str, side: int, speed: float) -> Case:
    """z = s (or -s): it breaks away at once if v is beyond v_c outward, and else sticks."""
    v = side * speed * V_C
    s = side * F_s
    start = {"z": [s]}
    model = one_element(law, C=C, v_c=V_C)
    if speed > 1.0:
        exact = lambda t: slip(law, v, s, t, F_s)  # noqa: E731
        return Case(model, v, 1.0, exact, start, [(edge_of(v), 0.0)])
    return Case(model, v, 1.0, lambda t: s + v * t, start)  # v_c itself is not beyond v_c


def dwelling(law: str) -> Case:
    """sgn(0) = 0: z > s decays by exp(-C t / s) under the signed law, and rests under the other."""
    exact = {"signed": lambda t: 2.5 * np.exp(-C * t / F_s), "published": lambda t: 2.5 + 0 * t}
    start = {"z": [2.5], "states": ["slip"]}
    return Case(one_element(law, C=C), 0.0, 1.0, exact[law], start)


def reversing() -> Case:
    """v turns at t = 1, where z is still above s = 1: the element slips on, the other way."""
    z_turn = 1.0 + 2.0 * math.exp(-C)

    def exact(t: np.ndarray) -> np.ndarray:
        before, after = 1.0 + 2.0 * np.exp(-C * t), -1.0 + (z_turn + 1.0) * np.exp(-C * (t - 1.0))
        return np.where(t < 1.0, before, after)

    start = {"z": [3.0], "states": ["slip"]}
    model = one_element("signed", F_s=F_c, v_s=1e-3, C=C)
    return Case(model, "0.4*cos(pi*t/2)", 2.0, exact, start)


CASES = {
    f"slip, {law}, v = {v}, {share} s": slipping(law, v, share)
    for law in LAWS
    for v in VELOCITIES
    for share in (-1.7, 0.5, 1.4)
}
CASES |= {f"stick, {law}, v = {v}": sticking(law, v) for law in LAWS for v in VELOCITIES}
CASES |= {
    f"on s, {law}, {side} * {speed} v_c": on_the_threshold(law, side, speed)
    for law in LAWS
    for side in (1, -1)
    for speed in (0.0, 1.0, 2.0, -2.0)
}
CASES |= {f"v = 0, {law}": dwelling(law) for law in LAWS} | {"reversal": reversing()}
METHODS: dict[str, dict[str, Any]] = {
    "dp45": {},
    "bs23": {"method": "bs23"},
    "DOP853": {"method": DOP853},
    "rk4": {"method": "rk4", "step": 7e-3},
}
OTHERS = ("slip, signed, v = -0.04, 1.4 s", "stick, published, v = 0.3", "reversal")
RUNS = [(name, "dp45") for name in CASES]
RUNS += [(name, method) for name in OTHERS for method in METHODS if method != "dp45"]


@pytest.mark.parametrize(("name", "method"), RUNS)
def test_z_is_the_closed_form(name: str, method: str) -> None:
    case = CASES[name]
    times = np.linspace(0.0, case.t_end, 41)
    trace = simulate(
        case.model,
        Prescribed(case.velocity),
        case.t_end,
        t_eval=times,
        initial=case.start,
        rtol=1e-10,
        atol=1e-12,
        **METHODS[method],
    )
    assert trace.transitions.edge.tolist() == [edge for edge, _ in case.edges]
    assert trace.transitions.t == pytest.approx([t for _, t in case.edges], rel=1e-12)
    np.testing.assert_allclose(trace.z[:, 0], case.z(times), rtol=1e-9, atol=2e-9)


@pytest.mark.parametrize("v", VELOCITIES)
@pytest.mark.parametrize("law", LAWS)
def test_the_force_steps_at_the_break_away(law: str, v: float) -> None:
    """F_after - F_before = sigma (dz_slip - v): the force is not continuous there."""
    trace = simulate(one_element(law, C=C, sigma=sigma), Prescribed(v), 1.8 / abs(v))
    record = trace.transitions[0]
    sign = math.copysign(1.0, v)
    ratio = record.z / record.s
    dz_slip = C * (sign - ratio) if law == "signed" else sign * C * (1 - ratio)
    assert record.F_after - record.F_before == pytest.approx(sigma * (dz_slip - v), rel=1e-12)
    assert abs(record.F_after - record.F_before) > 0.01


def test_it_breaks_away_when_v_leaves_the_window() -> None:
    """z is s from the start: no comparison of z changes. v = v_c at 2 microseconds."""
    trace = simulate(
        one_element("signed"), Prescribed([(0, 0), (1, 0.5)]), 1.0, initial={"z": [1.5]}
    )
    assert event_sequence(trace) == [(0, "break_away_forward")]
    assert trace.transitions.t[0] == pytest.approx(2e-6, rel=1e-6)
    assert np.diff(trace.t).min() >= 0


# --------------------------------------------------------------------------- v dwells at 0
def test_an_arrested_element_rests_with_its_force() -> None:
    ramps = [(0, 0.5), (3, 0.5), (4, 0), (6, 0), (7, 0.5), (9, 0.5)]
    trace = simulate(one_element("signed"), Prescribed(ramps), 9.0, rtol=1e-9, atol=1e-12)
    edges = ["break_away_forward", "arrest", "break_away_forward"]
    assert trace.transitions.edge.tolist() == edges
    assert trace.transitions.t[1] == pytest.approx(4 - 2 * V_C, abs=1e-9)
    dwell = (trace.t >= 4) & (trace.t <= 6)
    assert np.ptp(trace.z[dwell, 0]) == np.ptp(trace.F[dwell]) == 0.0


def test_a_slipping_element_decays_to_s_and_arrests() -> None:
    """The signed law; how long it takes is the exponential's."""
    model, start = one_element("signed", C=0.5), {"z": [2.5], "states": ["slip"]}
    ramps = [(0, 0.5), (1, 0), (6, 0)]
    trace = simulate(model, Prescribed(ramps), 6.0, rtol=1e-10, atol=1e-13, initial=start)
    (record,) = trace.transitions
    z_1 = trace.z[trace.t >= 1.0, 0][0]
    assert (record.edge, record.s) == ("arrest", 1.5)
    assert record.t == pytest.approx(1.0 + 1.5 / 0.5 * math.log(z_1 / 1.5), abs=1e-8)
    assert trace.z[-1, 0] == record.z < 1.5


def test_the_published_law_with_equal_thresholds_warns() -> None:
    """F_s = F_c: eq. (1) rests exactly on |z| = s, so |z| < s never occurs; signed is fine."""
    with pytest.warns(UserWarning, match="never arrests"):
        model = one_element("published", F_s=1.0)
    trace = simulate(model, Prescribed([(0, 0.5), (3, 0.5), (4, 0), (6, 0)]), 6.0)
    assert event_sequence(trace) == [(0, "break_away_forward")]
    assert trace.z[-1, 0] == pytest.approx(1.0, abs=1e-9)
    one_element("signed", F_s=1.0)  # a warning would end the test here


# --------------------------------------------------------------------------- banks
@pytest.mark.slow
def test_plain_maxwell_slip_is_the_play_operator() -> None:
    """F_s = F_c, signed: z_i is the clipped play of x, on the threshold while it slips."""
    weights = np.array([0.3, 0.1, 0.55, 0.2])
    curve = Stribeck(1.0, 1.0, 1e-3)
    parameters = GMSParameters(
        [1.0] * 4, [0.0] * 4, [50.0] * 4, sigma_2=0.0, stribeck=curve, v_c=V_C, weights=weights
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
    slips = trace.states == "slip"
    assert np.abs(np.abs(trace.z) - weights)[slips].max() < 1e-8


# While everything sticks the slider of Fig. 3 is m x'' + D x' + K x = F_a(t), with the state
# (x, v, 1, t, sin wt, cos wt), t from the start of a piece: F_a = a + b t + A sin wt.
K, D, w = 111.1, 12.1 + 4.0, 4 * np.pi
PIECES = [(0.0, 2.0, 0.0, 0.25, 0.0), (2.0, 4.0, 0.5, -0.125, 0.0), (4.0, np.inf, 0.25, 0.0, 0.1)]


def oscillator(times: np.ndarray) -> np.ndarray:
    """Return x and v, shape (2, m)."""
    out, x, v = np.empty((2, times.size)), 0.0, 0.0
    for start, end, a, b, A in PIECES:
        M = np.zeros((6, 6))
        M[0, 1] = M[3, 2] = 1.0
        M[1] = [-K, -D, a, b, A, 0.0]
        M[4, 5], M[5, 4] = w, -w
        first = np.array([x, v, 1.0, 0.0, 0.0, 1.0])
        for j in np.flatnonzero((times >= start) & (times <= end)):
            out[:, j] = (expm(M * (times[j] - start)) @ first)[:2]
        if end < np.inf:
            x, v = (expm(M * (end - start)) @ first)[:2]
    return out


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_while_everything_sticks_fig_3_is_a_linear_oscillator(law: str) -> None:
    """x, v, all z and F over 30 s, to 1e-9; at the default tolerances x to 1e-8 m."""
    model, rig = non_drifting(law)
    times = np.linspace(0.0, 30.0, 301)
    x, v = oscillator(times)
    tight = {"rtol": 1e-11, "atol": 1e-14}
    trace = simulate(model, rig, 30.0, t_eval=times, engine=FASTEST, **tight)
    assert len(trace.transitions) == 0
    near = 1e-9 * np.abs(x).max()
    np.testing.assert_allclose(trace.x, x, rtol=0, atol=near)
    np.testing.assert_allclose(trace.v, v, rtol=0, atol=1e-9 * np.abs(v).max())
    np.testing.assert_allclose(trace.z, np.tile(x, (4, 1)).T, rtol=0, atol=near)
    np.testing.assert_allclose(trace.F, K * x + D * v, rtol=0, atol=1e-9)
    usual = simulate(model, rig, 30.0, t_eval=times, engine=FASTEST)
    assert np.abs(usual.x - x).max() < 1e-8
