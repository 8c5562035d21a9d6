"""A run with located events finds every switch without a prescribed step, however short its window.

v passes |v| <= v_c in microseconds, and the Stribeck dip in milliseconds; steps grow past half a
period while an element slides at rest; z - s changes its sign twice within a step.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, Trace, simulate
from tests.helpers import (
    FASTEST,
    FIG4_SINE,
    event_sequence,
    one_element,
    open_loop,
    pulled_mass,
    stick_slip,
)

TIGHT = {"rtol": 1e-12, "atol": 1e-15}
V_C = 1e-6


def guards_hold(trace: Trace) -> None:
    """Assert that each guard is true on the logged numbers, without any tolerance."""
    for each in trace.transitions:
        holds = {
            "break_away_forward": each.z >= each.s and each.v > V_C,
            "break_away_backward": each.z <= -each.s and each.v < -V_C,
            "arrest": abs(each.v) <= V_C and abs(each.z) < each.s,
        }
        assert holds[each.edge], each


# --------------------------------------------------------------------------- reversals
@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "T", "options"),
    [
        ("signed", 0.5, {"method": "bs23"}),
        ("signed", 20.0, {}),
        ("published", 7.3, {"method": "rk4", "step": 0.0501}),
        ("published", 300.0, {}),
    ],
)
def test_every_half_wave_has_its_arrest(law: str, T: float, options: dict[str, Any]) -> None:
    """An arrest at each reversal and a break-away in each half wave, however long the wave.

    A sliding element rests at z = s and limits no step; x, the integral of v, does.
    """
    waves, A = 8, 4.0 / T  # the same stroke of 4/pi m in every wave
    model = one_element(law, F_c=0.4, v_s=1e-3, C=1e-3 / T)
    rig = Prescribed(f"{A}*sin(2*pi*t/{T})")
    trace = simulate(model, rig, (waves + 0.45) * T, **options)
    log = trace.transitions
    reversals = T / 2 * np.arange(1, 2 * waves + 1)
    np.testing.assert_allclose(log.t[log.edge == "arrest"], reversals, rtol=0, atol=1e-4 * T)
    assert len(log) == 4 * waves + 1
    assert np.diff(trace.t).max() < T / 2
    guards_hold(trace)


# --------------------------------------------------------------------------- the dip of s(v)
# F_c, F_s, v_s, C, amplitude, period: Table I's first element, and dips that are still shorter
# relative to everything else in the run.
DIPS = {
    "Table I, element 1": (0.4, 1.5, 1e-3, 0.1, 0.2, 20.0),
    "fast pass": (0.16, 1.26, 1.3e-3, 0.57, 1.7, 10.0),
    "faster pass": (0.05, 0.12, 8.5e-4, 0.068, 0.61, 18.0),
    "narrow dip": (0.29, 0.86, 4.7e-4, 0.47, 1.4, 17.0),
    "shallow and fast": (0.26, 0.75, 2e-3, 0.014, 1.3, 8.1),
    "slow input": (0.4, 1.5, 1e-3, 0.1, 0.2, 200.0),
    "quick input": (0.4, 1.5, 1e-3, 0.1, 0.6, 4.0),
}


def z_at_arrest(F_c: float, F_s: float, v_s: float, C: float, A: float, T: float) -> float:
    """Return z where v = A sin(2 pi t / T) has fallen to v_c, after slipping for a long time.

    The linear flow dz = C (1 - z/s) from z = F_c, by its integral formula:
    z = F_c + integral of g(t) exp(-G(t)) dt with u = z - F_c, du = C (1 - F_c/s) - C u / s.
    """
    w = 2 * math.pi / T
    start, end = (T / 2 - math.asin(v / A) / w for v in (7 * v_s, V_C))

    def s(t: float) -> float:
        return F_c + (F_s - F_c) * math.exp(-((A * math.sin(w * t) / v_s) ** 2))

    def integrand(t: float) -> float:
        return C * (1 - F_c / s(t)) * math.exp(-quad(lambda u: C / s(u), t, end, epsabs=1e-13)[0])

    return F_c + float(quad(integrand, start, end, epsabs=1e-13)[0])


@pytest.mark.parametrize("name", DIPS)
def test_the_dip_is_integrated_and_not_stepped_over(name: str) -> None:
    """At the defaults z at the arrest is right to 2e-5 m, at rtol 1e-10 to 1e-8 m."""
    F_c, F_s, v_s, C, A, T = DIPS[name]
    model, rig = one_element("signed", F_c=F_c, F_s=F_s, v_s=v_s, C=C), f"{A}*sin(2*pi*t/{T})"
    exact = z_at_arrest(*DIPS[name])
    assert exact - F_c > 1e-5  # the dip has an effect
    tight = {"rtol": 1e-10, "atol": 1e-13}
    for near, options in ((2e-5, {}), (2e-5, {"method": "bs23"}), (1e-8, tight)):
        trace = simulate(model, Prescribed(rig), 0.55 * T, **options)
        assert event_sequence(trace)[:2] == [(0, "break_away_forward"), (0, "arrest")]
        assert abs(trace.transitions.z[1] - exact) < near


def test_the_error_norm_is_a_maximum() -> None:
    """One slipping element among 49 at rest is integrated as well as alone."""
    F_c, F_s, v_s, C, A, T = DIPS["Table I, element 1"]
    n = 50
    parameters = GMSParameters(
        np.ones(n),
        np.zeros(n),
        np.full(n, C),
        sigma_2=0.0,
        stribeck=Stribeck(F_c, F_s, v_s),
        v_c=V_C,
        weights=np.append(np.full(n - 1, 100.0), 1.0),
    )
    trace = simulate(GMS(parameters, law="signed"), Prescribed(f"{A}*sin(2*pi*t/{T})"), 11.0)
    assert event_sequence(trace) == [(n - 1, "break_away_forward"), (n - 1, "arrest")]
    assert abs(trace.transitions.z[1] - z_at_arrest(F_c, F_s, v_s, C, A, T)) < 2e-5


# --------------------------------------------------------------------------- true and false again
# F_c, F_s, v_s, corners of v, z(0). While |v| < 6.1 v_s there is no landmark, and a sticking
# element takes steps of up to a second. z passes -s before the reversal, where s exceeds |z| again.
WINDOWS = [
    (0.29, 0.38, 0.052, [(0, -0.24), (2.7, 0.14)], -0.14),
    (0.18, 0.38, 0.062, [(0, -0.19), (2.8, 0.19)], -0.1),
    (0.45, 0.99, 0.035, [(0, -0.15), (1.8, 0.13)], -0.42),
    (0.48, 0.77, 0.059, [(0, -0.32), (1.6, 0.22)], -0.38),
    (0.25, 0.33, 0.075, [(0, 0.5), (1.5, -0.25), (3, -0.25), (5, 0.3), (6.5, 0.1)], 0.0),
]


@pytest.mark.slow
@pytest.mark.parametrize("window", WINDOWS)
def test_a_break_away_inside_a_long_step_is_found(window: Any) -> None:
    F_c, F_s, v_s, ramps, z0 = window
    model, rig = one_element("signed", F_c=F_c, F_s=F_s, v_s=v_s, C=0.1), Prescribed(ramps)
    T, start = ramps[-1][0], {"z": [z0]}
    fine = simulate(model, rig, T, initial=start, max_step=1e-3)
    assert event_sequence(fine) == [(0, "break_away_backward"), (0, "arrest")]
    for options in ({}, {"rtol": 1e-10, "atol": 1e-13}, {"method": "bs23"}):
        trace = simulate(model, rig, T, initial=start, **options)
        assert event_sequence(trace) == event_sequence(fine)
        np.testing.assert_allclose(trace.transitions.t, fine.transitions.t, rtol=0, atol=1e-5)


# --------------------------------------------------------------------------- whole runs
COUNT = {"signed": 48, "published": 39}
T_END = 61.0
TIMES = np.linspace(0.0, T_END, 3001)


@pytest.mark.slow
@pytest.mark.parametrize("law", COUNT)
def test_table_i_has_all_its_switches_in_place(law: str) -> None:
    """At the defaults and with fixed steps: those of the run at rtol 1e-12."""
    model, rig = stick_slip(law), open_loop()
    reference = simulate(model, rig, T_END, t_eval=TIMES, engine=FASTEST, **TIGHT)
    trace = simulate(model, rig, T_END, t_eval=TIMES, engine=FASTEST)
    assert len(trace.transitions) == COUNT[law]
    assert event_sequence(trace) == event_sequence(reference)
    # Under the published law z grows without bound while v < 0, and errors with it.
    time_bound, z_bound = {"signed": (5e-5, 2e-5), "published": (1e-4, 1e-4)}[law]
    assert np.abs(trace.transitions.t - reference.transitions.t).max() < time_bound
    assert np.abs(trace.z - reference.z).max() < z_bound
    guards_hold(trace)
    fixed = simulate(model, rig, T_END, method="rk4", step=1.0001e-2)
    assert event_sequence(fixed) == event_sequence(reference)
    assert np.abs(fixed.transitions.t - reference.transitions.t).max() < 1e-5


@pytest.mark.slow
def test_guards_asked_at_step_ends_lose_the_arrest() -> None:
    """With steps of 1.003 ms no sample falls into |v| <= v_c; with 1 ms one does, by luck."""
    model, found = one_element("signed", F_c=0.4, v_s=1e-3), {}
    located = simulate(model, open_loop(), 13.0)
    for step in (1.003e-3, 1e-3):
        at_ends = simulate(model, open_loop(), 13.0, method="euler", step=step, events="step")
        found[step] = len(at_ends.transitions), abs(at_ends.z[-1, 0] - located.z[-1, 0])
    assert event_sequence(located) == [(0, "break_away_forward"), (0, "arrest")]
    assert located.transitions.t[1] == pytest.approx(10.0, abs=1e-4)
    assert found[1.003e-3] == (1, pytest.approx(0.2, abs=0.15))
    assert found[1e-3] == (2, pytest.approx(0.0, abs=5e-3))


@pytest.mark.slow
def test_the_pulled_mass() -> None:
    """72 transitions, 34 of them arrests, and the known range of v."""
    model, rig = pulled_mass()
    trace = simulate(model, rig, 60.0, engine=FASTEST)
    tight = simulate(model, rig, 60.0, engine=FASTEST, **TIGHT)
    assert Counter(trace.transitions.edge.tolist()) == {"break_away_forward": 38, "arrest": 34}
    assert event_sequence(trace) == event_sequence(tight)
    assert trace.v.min() == pytest.approx(-0.024, abs=1e-3)
    assert trace.v.max() == pytest.approx(0.360, abs=1e-3)
    guards_hold(trace)


def log_of(trace: Trace, edge: str, after: float, before: float) -> dict[int, float]:
    """Return {element counted from 1: time} of an edge within a time window."""
    log = trace.transitions
    chosen = log[(log.edge == edge) & (log.t > after) & (log.t < before)]
    return dict(zip((chosen.element + 1).tolist(), chosen.t.tolist(), strict=True))


def test_fig_4_published() -> None:
    """The signal of Fig. 4 under eq. (1) as printed: where it splits, and how far z goes."""
    trace = simulate(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)
    for edge, after, before, elements, times, near in (
        ("break_away_forward", 0, 12, [1, 2, 3, 4], 4.91, 5e-3),
        ("arrest", 0, 20, [1, 2, 3, 4], 12.5, 1e-4),
        ("break_away_backward", 12, 25, [4, 3, 2, 1], 20.14, 1e-2),
        ("break_away_forward", 25, 37.5, [4, 3], [32.64, 35.04], 5e-3),
        # Element 1 slipped on through the reversal at 25 s: |z| >= s, so it could not arrest.
        ("arrest", 20, 30, [2, 3, 4], 25.0, 1e-3),
    ):
        found = log_of(trace, edge, after, before)
        assert list(found) == elements
        assert [*found.values()] == pytest.approx(np.broadcast_to(times, len(found)), abs=near)
    lowest = trace.z.min(axis=0)
    assert lowest == pytest.approx([-3.1, -2.3, -0.68, -0.40], abs=0.05)
    assert trace.z[-1, [0, 2, 3]] == pytest.approx([-3.076, -0.683, -0.401], abs=2e-3)


def test_fig_4_signed() -> None:
    """Under the signed law nothing splits: every wave has the same four switches at each place."""
    trace = simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 99.0)
    for number, after in enumerate((0, 12.6, 25.1, 37.6, 50.1, 62.6, 75.1, 87.6)):
        edge = "break_away_backward" if number % 2 else "break_away_forward"
        found = log_of(trace, edge, after, after + 12.3)
        assert sorted(found) == [1, 2, 3, 4]
        assert max(found.values()) - min(found.values()) < 0.02
    assert np.abs(trace.z[-1]).max() < 0.45
    assert np.ptp(trace.z[-1]) < 3e-3
