"""Lesson 8: chart and if-else code agree bit for bit; late guards and held outputs differ.

The spike and the residual after it are predicted from the delay, the lag from the sample time.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from gms_fsm.app.lessons import l8_chart_or_ifelse as lesson
from tests.helpers import same_bits
from tests.lesson_checks import check_figure, check_lines

pytestmark = pytest.mark.slow  # they share one run of the lesson


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


def test_with_the_same_driver_they_are_identical(result: lesson.Result) -> None:
    same_bits(result.chart, result.ifelse)
    same_bits(result.chart_once, result.ifelse_once)
    assert result.differ[0] == result.differ_once[0] == 0
    assert result.differ_once[1] > 300_000
    assert result.differ_held[0] == 0
    assert result.differ_held[1] > 100_000


def test_the_spike_is_the_step_of_F(result: lesson.Result) -> None:
    """sum sigma_i (dz_slip - v), with dz_slip = 0 at z = s; t* from the cosine of the motion."""
    w = 2 * math.pi / 25
    t = math.acos(1 - 0.4 * w / 0.15) / w  # x = 0.15 (1 - cos w t) / w reaches s = F_c = 0.4
    spike = (0.3 + 0.4 + 0.5 + 0.6) * 0.15 * math.sin(w * t)
    first = result.chart.transitions.t[0]
    assert first == pytest.approx(t, abs=1e-6)
    measured = np.abs(result.residual[result.t == first])
    assert measured == pytest.approx(spike, rel=1e-3)


def test_the_residual_is_proportional_to_the_delay(result: lesson.Result) -> None:
    assert (result.late > 0).all()
    assert (result.late <= lesson.STEPS).all()
    np.testing.assert_allclose(result.left, lesson.predicted(result.late, result.chart), rtol=0.01)
    # About v late sum k: the excess deflection of all springs.
    first = result.chart.transitions[0]
    rough = first.v * result.late * 4 * 0.7
    assert (result.left < rough).all()
    assert (result.left > 0.9 * rough).all()


def test_the_papers_residual_needs_a_later_switch_than_its_step(result: lesson.Result) -> None:
    assert lesson.PAPER_STEP < result.late_for_the_papers < 4e-3
    assert np.median(result.between(0.0, 4.9)) < 1e-5
    plateau = np.median(result.between(5.0, 12.4))
    assert 2e-5 < plateau < 5e-4


def test_evaluated_once_per_step_the_arrests_are_missed(result: lesson.Result) -> None:
    assert set(result.ifelse_once.transitions.edge) == {"break_away_forward"}
    assert (result.chart.transitions.edge == "arrest").any()
    assert result.between(13.0, lesson.END).max() > 1.0


def test_held_outputs_explain_the_papers_residuals_within_a_factor_of_10(
    result: lesson.Result,
) -> None:
    ramp, swing = result.pushed_largest
    for size, papers in ((ramp, 1e-4), (swing, 1e-4), (result.held.median[0], 1e-3)):
        assert papers / 10 < size < 10 * papers
    assert result.held.largest[0] == pytest.approx(0.25, abs=0.01)  # the spike, as located


def test_the_residual_of_held_outputs_is_proportional_to_the_sample_time(
    result: lesson.Result,
) -> None:
    """On the ramp the held force is off by half a step's rise of the applied 0.25 N/s."""
    assert [lag.period for lag in result.pushed] == [2e-3, 1e-3, 5e-4]
    sizes = np.array([lag.largest for lag in result.pushed])
    np.testing.assert_allclose(sizes[:-1] / sizes[1:], 2.0, rtol=0.03)
    for lag in result.pushed:
        settled = lag.during((1.5, 2.0))
        np.testing.assert_allclose(settled.force, 0.25 * lag.period / 2, rtol=0.01)
        np.testing.assert_allclose(settled.before, -0.25 * lag.period / 2, rtol=0.01)


def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    check_figure(lesson, result)
