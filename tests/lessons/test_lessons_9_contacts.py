"""Lesson 9: contacts lock exactly, keep momentum, and leave the bodies alone."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import simulate
from gms_fsm.app.lessons import l9_contacts as lesson
from tests.lesson_checks import check_figure, check_lines


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


def test_the_mass_is_at_rest_exactly_while_it_is_stuck(result: lesson.Result) -> None:
    assert result.speeds_while_stuck.size >= 10
    assert set(result.speeds_while_stuck.tolist()) == {0.0}
    assert result.released == pytest.approx(1.5 / (2.0 * 0.1), abs=1e-9)
    before = result.stiction.t <= result.released
    assert set(result.stiction.x[before].tolist()) == {0.0}


def test_the_bank_creeps_before_it_slips(result: lesson.Result) -> None:
    """Only the contact is exchanged; when all elements slip, the spring pulls with nearly F_s."""
    assert lesson.pulled().bodies == lesson.pulled(bristles=True).bodies
    t, x = result.crept
    pull = lesson.STIFFNESS * (lesson.SPEED * t - x)
    assert pull == pytest.approx(lesson.F_s, rel=0.05)
    assert x > 0.01


def test_the_load_stands_still_in_the_dead_time(result: lesson.Result) -> None:
    dead = result.dead
    assert len(dead) == 3
    np.testing.assert_allclose(dead[:, 1] - dead[:, 0], 2 * 0.02 / 0.05 + 0.4 / 200.0, rtol=1e-9)
    t, w = result.gear.t, result.gear.body("load").v
    for begin, end in dead:
        assert set(w[(t >= begin) & (t <= end)].tolist()) == {0.0}


def test_the_flank_lets_go_before_the_gap_opens(result: lesson.Result) -> None:
    gear = result.gear.contact("gear")
    first = gear.transitions[gear.transitions.target == "apart"][0]
    row = np.flatnonzero(gear.t == first.t)[-1]
    assert gear.x[row] == pytest.approx(0.02 + 0.4 * 0.05 / 200.0, rel=1e-9)


@pytest.mark.parametrize("e", [0.0, 0.5, 0.9])
def test_the_impact_keeps_momentum_and_takes_energy(e: float) -> None:
    trace = simulate(lesson.impact(e), 0.3, initial={"one.v": lesson.FIRST})
    one, two = (trace.body(name).v for name in ("one", "two"))
    np.testing.assert_allclose(one + 3 * two, 1.0, rtol=1e-15)
    assert one[-1] == pytest.approx((1 - 3 * e) / 4)
    assert two[-1] == pytest.approx((1 + e) / 4)
    left = 0.5 * one[-1] ** 2 + 1.5 * two[-1] ** 2
    assert 0.5 - left == pytest.approx(0.5 * 0.75 * (1 - e**2))


def test_the_shafts_have_a_common_speed_after_the_clutch_closes(result: lesson.Result) -> None:
    trace = result.clutch
    one, two = (trace.body(name).v for name in ("one", "two"))
    closed = trace.states[:, 0] == "engaged"
    assert trace.transitions.t.tolist() == pytest.approx([1.0], abs=1e-15)  # within a tick
    assert closed.any()
    assert (one[closed] == two[closed]).all()
    np.testing.assert_allclose(one[closed], 10 / 3, rtol=1e-15)
    np.testing.assert_allclose(result.spin, 10.0, rtol=1e-15)


def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    check_figure(lesson, result)
