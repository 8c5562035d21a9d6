"""Stiction, impacts, rest and a clutch meet their closed forms."""

from __future__ import annotations

import math
import random
from itertools import pairwise

import numpy as np
import pytest

from gms_fsm import Body, Chart, Contact, State, System, simulate
from tests.systems_cases import BALL, DRY, ball, gear_box, impact, pulled_mass


def test_a_pulled_mass_sticks_and_slips_at_the_times_of_its_closed_form() -> None:
    m, K, V = 1.0, 2.0, 0.1
    F_c, F_s = DRY["F_c"], DRY["F_s"]
    w, stretch = math.sqrt(K / m), (F_s - F_c) / K
    slip = 2 / w * (math.pi - math.atan(stretch * w / V))
    stick = 2 * (F_s - F_c) / (K * V)
    wanted = [F_s / (K * V)]
    while wanted[-1] < 60.0:
        wanted.append(wanted[-1] + (slip if len(wanted) % 2 else stick))
    trace = pulled_mass().run("ifelse")
    assert len(trace.transitions) == len(wanted) - 1
    np.testing.assert_allclose(trace.transitions.t, wanted[:-1], rtol=0, atol=1e-6)
    stuck = trace.states[:, 0] == "stuck"
    assert stuck.any()
    assert (trace.v[stuck] == 0.0).all()
    np.testing.assert_allclose(trace.F[stuck], K * (V * trace.t - trace.x)[stuck], atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_a_tree_of_locked_bodies_moves_as_one_whatever_the_order_of_its_contacts(seed: int) -> None:
    """Each contact pulls all that hangs on it; the velocities are equal to the last bit."""
    n, m = 15, 0.5
    weld = Chart("weld", states=(State("held", locked=True),))
    contacts = [Contact(f"c{i}", weld, v=f"v{i} - v{(i - 1) // 2}") for i in range(1, n)]
    random.Random(seed).shuffle(contacts)
    system = System(
        "tree",
        bodies=[
            Body(f"b{i}", inertia=m, force="0" if i else "sin(t)", x=f"x{i}", v=f"v{i}")
            for i in range(n)
        ],
        contacts=contacts,
    )
    trace = simulate(system, 5.0, rtol=1e-10, engine="ifelse")
    hanging = [1.0] * n
    for i in reversed(range(1, n)):
        hanging[(i - 1) // 2] += hanging[i]
    for i in range(1, n):
        assert trace.body(f"b{i}").v.tolist() == trace.body("b0").v.tolist()
        pull = -hanging[i] / n * np.sin(trace.t)
        np.testing.assert_allclose(trace.contact(f"c{i}").F, pull, rtol=0, atol=1e-14)
    v = (1.0 - np.cos(trace.t)) / (n * m)
    np.testing.assert_allclose(trace.body("b0").v, v, rtol=0, atol=1e-9)


def test_a_ball_rests_after_finitely_many_bounces_and_its_weight_is_carried() -> None:
    trace, g = ball().run("ifelse"), 9.81
    wanted, v = [math.sqrt(2 * BALL["x_s"] / g)], math.sqrt(2 * g * BALL["x_s"])
    while v > BALL["v_r"]:
        v *= BALL["e"]
        wanted.append(wanted[-1] + 2 * v / g)
    log = trace.transitions
    assert log.edge.tolist() == ["bounce"] * (len(wanted) - 1) + ["settle"]
    np.testing.assert_allclose(log.t, wanted, rtol=0, atol=1e-6)
    rest = trace.t > log.t[-1]
    assert rest.any()
    np.testing.assert_array_equal(trace.F[rest], 2.0 * g)
    np.testing.assert_array_equal(trace.v[rest], 0.0)


def test_an_impact_of_two_bodies_keeps_the_momentum() -> None:
    trace = impact().run("ifelse")
    a, b = trace.body("a").v, trace.body("b").v
    assert trace.transitions.edge.tolist() == ["bounce"]
    np.testing.assert_allclose(1.0 * a + 3.0 * b, 1.0, rtol=0, atol=4e-16)
    assert abs((b - a)[-1] - 0.5) < 1e-15  # e times the speed of approach


def test_a_clutch_with_ratio_3_joins_the_inertias() -> None:
    trace = gear_box().run("ifelse")
    J1, J2, N, M = 1.0, 2.0, 3.0, 0.5
    t, w1, w2 = trace.t, trace.body("a").v, trace.body("b").v
    before = 10.0 + M * 0.5 / J1
    joined = before * J1 * N / (J1 * N**2 + J2)  # w2 right after the impact
    engaged = trace.states[:, 0] == "engaged"
    assert [str(edge) for edge in trace.transitions.edge] == ["engage", "disengage"]
    rate = M * N / (J1 * N**2 + J2)
    np.testing.assert_allclose(w2[engaged], joined + rate * (t[engaged] - 0.5), atol=1e-12)
    np.testing.assert_allclose(w1[engaged], N * w2[engaged], rtol=4e-16)
    np.testing.assert_allclose(trace.F[engaged], M - J1 * N * rate, atol=1e-12)
    after = t > trace.transitions.t[-1]
    assert np.ptp(w2[after]) == 0.0
    assert all(one < other for one, other in pairwise(w1[after]))
