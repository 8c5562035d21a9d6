"""The reference of `tests.soak.exact_systems` gives closed forms to rounding."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

from tests.soak.exact_reference import (
    Controller,
    Endless,
    Plain,
    Run,
    Touch,
    Undecided,
    first_root,
    simulate,
)

FREE = (0.0, 1.0, 0.0, 0.0, 0.0)  # no load


def plain(
    masses: Sequence[float],
    touches: Sequence[Touch],
    v: Sequence[float] = (0.0, 0.0),
    t_end: float = 3.0,
    **given: Any,
) -> Plain:
    """Return a system at x = 0 without springs, loads, belts and controllers, if none are given."""
    rest = {"springs": [], "loads": [FREE] * len(masses), "belts": [], "controllers": []} | given
    x = [0.0] * len(masses)
    return Plain(masses=masses, touches=touches, x=x, v=v[: len(masses)], t_end=t_end, **rest)


def stiction(row: Mapping[int, float], state: str = "stuck", **values: float) -> Touch:
    return Touch("pad", "stiction", row, {"F_c": 0.5, "F_s": 0.7, "b": 0.0} | values, state)


def stop(row: Mapping[int, float], **values: float) -> Touch:
    return Touch("stop", "end-stop", row, {"x_s": 0.5, "e": 0.6, "v_r": 1e-3} | values, "free")


def edges(run: Run) -> list[tuple[str, float]]:
    return [(each.edge, each.t) for each in run.firings]


def is_(*expected: tuple[str, float]) -> Any:
    return [(edge, pytest.approx(t, rel=1e-12, abs=1e-12)) for edge, t in expected]


def test_a_mass_on_a_spring_stops_where_its_arc_ends() -> None:
    k, v = 20.0, 1.0
    w, x_0 = math.sqrt(k), -0.5 / k  # the centre of the arc
    stops = math.atan2(v / w, -x_0) / w
    x = x_0 + math.hypot(v / w, x_0)
    one = plain([1.0], [stiction({0: 1.0}, "forward")], [v], 0.5, springs=[(0, -1, k, 0.0)])
    run = simulate(one)
    assert edges(run) == is_(("arrest_forward", stops), ("release_backward", stops))
    centre = 0.5 / k
    assert run.x[0] == pytest.approx(centre + (x - centre) * math.cos(w * (0.5 - stops)), rel=1e-12)


def test_a_pad_is_released_where_the_load_exceeds_its_stiction() -> None:
    run = simulate(plain([2.0], [stiction({0: 1.0})], loads=[(0.0, 1.0, 0.0, 0.0, 3.0)]))
    t = 0.7 / 3.0
    assert edges(run) == is_(("release_forward", t))
    right = (1.5 * (9.0 - t * t) - 0.5 * (3.0 - t)) / 2.0
    assert run.v[0] == pytest.approx(right, rel=1e-12)


def test_a_ball_bounces_in_a_geometric_sequence_and_rests() -> None:
    g, h, e = 9.81, 0.5, 0.5
    ball = plain([2.0], [stop({0: 1.0}, e=e, v_r=0.5)], loads=[(0.0, 1.0, 0.0, 2 * g, 0.0)])
    t, v, expected = math.sqrt(2 * h / g), math.sqrt(2 * g * h), []
    while v > 0.5:
        expected.append(("bounce", t))
        v *= e
        t += 2 * v / g
    assert edges(simulate(ball)) == is_(*expected, ("settle", t))


def test_without_a_rest_speed_the_bounces_do_not_end() -> None:
    ball = plain([2.0], [stop({0: 1.0}, v_r=1e-300)], loads=[(0.0, 1.0, 0.0, 20.0, 0.0)])
    with pytest.raises((Endless, Undecided)):
        simulate(ball)


@pytest.mark.parametrize("F_s", [None, 2e-6])
def test_an_impact_divides_momentum_whether_or_not_a_pad_lets_go(F_s: float | None) -> None:
    touches = [stop({0: 1.0, 1: -1.0})]
    if F_s is not None:
        touches.append(stiction({1: 1.0}, F_c=F_s, F_s=F_s))
    run = simulate(plain([1.0, 1.0], touches, [1.0, 0.0], 1.0))
    assert run.v == pytest.approx([0.2, 0.8], abs=2e-6)
    assert len(run.firings) == len(touches)


def test_an_impact_reverses_the_friction() -> None:
    pad = stiction({0: 1.0}, "forward", F_c=0.01, F_s=0.01)
    run = simulate(plain([1.0], [stop({0: 1.0}), pad], [1.0], 0.6))
    v = math.sqrt(1.0 - 2 * 0.01 * 0.5)
    t = (1.0 - v) / 0.01
    assert edges(run) == is_(("bounce", t), ("reverse_forward", t))
    assert run.v[0] == pytest.approx(-0.6 * v + 0.01 * (0.6 - t), rel=1e-12)


def test_a_gear_engages_with_the_momentum_of_both() -> None:
    clutch = Touch("gear", "dog-clutch", {0: 1.0, 1: -2.0}, {"t_on": 1.0, "t_off": 9.0}, "open")
    run = simulate(plain([3.0, 0.5], [clutch], [1.0, 2.0]))
    v_1 = (2.0 * 3.0 * 1.0 + 0.5 * 2.0) / (0.5 + 4.0 * 3.0)
    assert run.v == pytest.approx([2.0 * v_1, v_1], rel=1e-14)


def test_a_clutch_that_jerks_a_pad_lets_it_go() -> None:
    clutch = Touch("gear", "dog-clutch", {0: 1.0, 1: -1.0}, {"t_on": 1.0, "t_off": 9.0}, "open")
    run = simulate(plain([1.0, 3.0], [stiction({1: 1.0}), clutch], [1.0, 0.0], 1.0))
    assert edges(run) == is_(("engage", 1.0), ("release_forward", 1.0))
    assert run.v == pytest.approx([0.25, 0.25])


def test_a_belt_carries_a_body_exactly_until_it_turns_too_fast() -> None:
    corners = [(0.0, 0.0), (1.0, 0.1), (1.3, -1.0), (3.0, -1.0)]
    run = simulate(plain([1.0], [stiction({0: 1.0, 1: -1.0})], belts=[corners]))
    # Deceleration at 0.5 m/s^2 from 0.1 m/s at t = 1 until the belt's speed -1 is reached.
    assert edges(run) == is_(("release_forward", 1.0), ("arrest_forward", 1.0 + 1.1 / 0.5))[:1]
    assert run.v[0] == pytest.approx(0.1 - 0.5 * 2.0, rel=1e-12)


def test_two_flanks_reflect_after_half_a_period() -> None:
    flank = Touch("gap", "backlash", {0: 1.0}, {"k": 80.0, "d": 0.0, "gap": 0.1}, "apart")
    run = simulate(plain([2.0], [flank], [0.5], 1.2))
    half = math.pi * math.sqrt(2.0 / 80.0)
    assert edges(run)[:3] == is_(
        ("touch_right", 0.2), ("leave_right", 0.2 + half), ("touch_left", 0.6 + half)
    )


def test_an_element_breaks_away_at_its_threshold_and_arrests_at_rest() -> None:
    values = {"k": [50.0], "sigma": [0.0], "C": [0.1], "weights": [0.01], "F_c": 1.0}
    bank = Touch("bank", "gms", {0: 1.0}, {**values, "sigma_2": 0.0, "v_c": 1e-6}, "stick")
    run = simulate(plain([2.0], [bank], [0.4], 3.0))
    w, s = 5.0, 0.01
    t = math.asin(s * w / 0.4) / w
    v = math.sqrt(0.4**2 - (s * w) ** 2)  # then it slips at the constant force k s = m a
    assert edges(run)[:2] == is_(("break_away_forward", t), ("arrest", t + v / (50.0 * s / 2.0)))


def test_a_sampled_spring_follows_its_recursion() -> None:
    law = Controller(0.05, [("u", {"x0": -30.0, "v0": -2.0})], "u", 0)
    out = Touch("far", "end-stop", {0: 1.0}, {"x_s": 9.0, "e": 0.5, "v_r": 1e-3}, "free")
    run = simulate(plain([1.0], [out], [1.0], 3.0, controllers=[law]))
    x, v = 0.0, 1.0
    for _ in range(60):
        u = -30.0 * x - 2.0 * v
        x, v = x + 0.05 * v + 0.5 * 0.05**2 * u, v + 0.05 * u
    assert (run.x[0], run.v[0]) == pytest.approx((x, v), rel=1e-10)


def test_a_double_crossing_between_two_points_is_found() -> None:
    p = np.zeros(23)
    p[:3] = 0.53**2 - 1e-8, -2 * 0.53, 1.0  # (x - 0.53)^2 - 1e-8
    assert first_root(p, np.full(23, 1e-14)) == pytest.approx(0.53 - 1e-4, rel=1e-12)
