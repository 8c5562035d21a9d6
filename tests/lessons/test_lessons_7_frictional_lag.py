"""Lesson 7: friction lags, the loop widens with the frequency up to w = C/s, and closes above that.

With shares of one C all elements have one z/s, so the whole model is dF/dt = C (1 - F/s(v)).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gms_fsm.app.lessons import l7_frictional_lag as lesson
from tests.lesson_checks import check_figure, check_lines

pytestmark = pytest.mark.slow  # they share one run of the lesson


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


def s(v):
    return 1.0 + 0.5 * np.exp(-((v / 1e-3) ** 2))


@pytest.mark.parametrize("w", lesson.OMEGAS)
def test_the_model_is_a_first_order_lag(result: lesson.Result, w: float) -> None:
    loop = result.loops[w]

    def flow(t, F):
        return lesson.C * (1 - F / s(1e-3 * (1.5 + math.cos(w * t))))

    # The initial transient has decayed by exp(-50 / 1.5) after a second.
    run = solve_ivp(
        flow,
        (loop.t[0] - 1.0, loop.t[-1]),
        [1.2],
        t_eval=loop.t,
        rtol=1e-10,
        atol=1e-12,
        method="DOP853",
        max_step=0.1 / w,
    )
    np.testing.assert_allclose(loop.F - 0.4 * loop.v, run.y[0], rtol=0, atol=2e-5)


def test_friction_is_higher_while_accelerating_at_the_three_frequencies(
    result: lesson.Result,
) -> None:
    assert (result.widths > 0).all()
    width = dict(zip(lesson.OMEGAS, result.widths, strict=True))
    one, ten, twenty_five = (width[w] for w in lesson.SHOWN)
    assert one < ten < twenty_five


def test_the_slow_loop_has_the_width_predicted_by_the_delay(result: lesson.Result) -> None:
    """F = s - (s/C) ds/dt for slow changes: width 2 (s/C) |s'(v)| w SWING at the mean speed."""
    v = 1.5e-3
    slope = 0.5 * 2 * v / 1e-6 * math.exp(-((v / 1e-3) ** 2))
    expected = 2 * s(v) / lesson.C * slope * 1.0 * 1e-3
    assert result.widths[0] == pytest.approx(expected, rel=0.02)


def test_the_loop_is_widest_near_C_over_s_and_closes_above(result: lesson.Result) -> None:
    widest = int(result.widths.argmax())
    assert 0.7 < lesson.OMEGAS[widest] * 1.2 / lesson.C < 1.3
    assert (np.diff(result.widths[: widest + 1]) > 0).all()
    assert (np.diff(result.widths[widest:]) < 0).all()
    assert result.widths[-1] < 0.2 * result.widths[widest]


def test_every_element_slips_throughout(result: lesson.Result) -> None:
    for loop in result.loops.values():
        assert (loop.states == "slip").all()


def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    check_figure(lesson, result)
