"""Lesson 1: Maxwell elements close their inner loops, and one LuGre bristle does not.

Compared with element-wise stops (z moves with x between -s and s) and LuGre's exponentials.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from gms_fsm.app.lessons import l1_hysteresis as lesson
from tests.lesson_checks import check_figure, check_lines

PATH = [0.0, *lesson.TURNS]
WINDOW = 1e-9  # m: the distance within |v| <= v_c at a reversal, v_c**2 / (2 * 5e-4 m/s2)


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


def stops(x: np.ndarray) -> np.ndarray:
    """Return the force of springs that slip at s_i = 0.25/k_i, moved along the positions x."""
    k, z, F = lesson.K, np.zeros(4), []
    for step in np.diff(x, prepend=0.0):
        z = np.clip(z + step, -0.25 / k, 0.25 / k)
        F.append(float(k @ z))
    return np.array(F)


def test_the_run_follows_the_stops(result: lesson.Result) -> None:
    fine = result.gms.refined(4000)
    assert np.abs(fine.F - stops(fine.x)).max() < lesson.K.sum() * WINDOW
    assert result.masing_error < lesson.K.sum() * WINDOW


def test_elements_slip_at_their_thresholds(result: lesson.Result) -> None:
    np.testing.assert_allclose(result.let_go, 0.25 / lesson.K, rtol=0, atol=WINDOW)


def test_the_turning_points_are_where_they_should_be(result: lesson.Result) -> None:
    np.testing.assert_allclose(
        result.gms.sample(result.turn_times).x, lesson.TURNS, rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(
        result.gms.sample(result.back).x, lesson.TURNS[[2, 0]], rtol=0, atol=1e-12
    )


def test_old_reversal_points_are_met_again_and_forgotten(result: lesson.Result) -> None:
    assert np.abs(result.misses).max() < 1e-6
    after = np.linspace(result.back[1], result.turn_times[-1] - lesson.RAMP, 50)
    beyond_A = result.gms.sample(after)  # as if the inner loops had not happened
    assert np.abs(beyond_A.F - lesson.first_loading(beyond_A.x)).max() < 1e-4


def test_lugre_misses_them_as_its_exponentials_predict(result: lesson.Result) -> None:
    """With F_s = F_c and no damping the bristle is rate-independent: dz/dx = 1 -+ sigma_0 z/F_c."""
    sigma_0 = lesson.K.sum()

    def stroke(F: float, way: float) -> float:
        end = math.copysign(1.0, way)
        return end + (F - end) * math.exp(-sigma_0 * abs(way))

    F = [0.0]
    for here, there in itertools.pairwise(PATH):
        F.append(stroke(F[-1], there - here))
    _, F_A, _, F_C, F_D, _ = F
    expected = [
        stroke(F_D, lesson.TURNS[2] - lesson.TURNS[3]) - F_C,
        stroke(F_D, lesson.TURNS[0] - lesson.TURNS[3]) - F_A,
    ]
    np.testing.assert_allclose(result.lugre_misses, expected, rtol=0, atol=1e-5)
    assert abs(result.lugre_misses[0]) > 0.05


def test_the_loss_is_that_of_the_two_loops(result: lesson.Result) -> None:
    """An element that slips at s dissipates 4 k s (a - s) in a loop of amplitude a > s."""
    k, s = lesson.K, 0.25 / lesson.K
    A, B, C, D, _ = lesson.TURNS
    outer, inner = (A - B) / 2, (C - D) / 2
    expected = sum((4 * k * s * np.maximum(a - s, 0.0)).sum() for a in (outer, inner))
    assert result.loss == pytest.approx(expected, rel=1e-3)


@pytest.mark.slow
def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    check_figure(lesson, result)
