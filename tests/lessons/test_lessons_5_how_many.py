"""Lesson 5: n elements approximate a parabola to F_c/(4 n^2); without slip a loop loses nothing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from gms_fsm.app.lessons import l5_how_many as lesson
from tests.lesson_checks import check_figure, check_lines


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


@pytest.mark.slow
def test_the_first_loading_is_a_chain_of_chords(result: lesson.Result) -> None:
    for n, trace in result.loadings.items():
        fine = trace.refined(2000)
        corners = lesson.X * np.arange(n + 1) / n
        chain = np.interp(fine.x, corners, lesson.parabola(corners))
        np.testing.assert_allclose(fine.F, chain, rtol=0, atol=1e-6)


@pytest.mark.slow
def test_its_error_is_a_quarter_over_n_squared(result: lesson.Result) -> None:
    expected = lesson.F_c / (4 * np.array(lesson.COUNTS) ** 2)
    np.testing.assert_allclose(result.errors, expected, rtol=1e-3)


def test_a_loop_loses_the_energy_of_its_slipping_elements(result: lesson.Result) -> None:
    """4 k s (a - s) for each element with s < a."""
    a = lesson.SMALL
    for n, loss in zip(lesson.COUNTS, result.losses, strict=True):
        p = lesson.bank(n).parameters
        s = p.weights * lesson.F_c
        expected = (4 * p.k * s * np.maximum(a - s, 0.0)).sum()
        assert loss == pytest.approx(expected, rel=1e-3, abs=1e-10)
    assert np.abs(result.losses[:2]).max() < 1e-10  # one and two elements: a line, no loop
    assert 0.85 < result.losses[2] / lesson.smooth_loss(a) < 0.9
    assert 0.97 < result.losses[3] / lesson.smooth_loss(a) < 0.98


def test_the_smooth_loop_is_masings() -> None:
    a = lesson.SMALL
    # Area between the rising branch -F_a + 2 f((a + x)/2) and the falling F_a - 2 f((a - x)/2).
    area, _ = quad(
        lambda x: (
            2 * float(lesson.parabola((a + x) / 2))
            + 2 * float(lesson.parabola((a - x) / 2))
            - 2 * float(lesson.parabola(a))
        ),
        -a,
        a,
    )
    assert area == pytest.approx(lesson.smooth_loss(a), rel=1e-9)


@pytest.mark.slow
def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    check_figure(lesson, result)
