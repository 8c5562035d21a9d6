"""Lesson 3: guards evaluated once per step find a reversal only if a sample is in |v| <= v_c.

The grid alone predicts which ones they find; after a missed one z is a single exponential.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from gms_fsm.app.lessons import l3_missed_window as lesson
from tests.lesson_checks import check_figure, check_lines

pytestmark = pytest.mark.slow  # they share one run of the lesson


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


def met(step: float) -> list[float]:
    """Return the reversals with a multiple of the step in the window."""
    found = []
    for turn in (10.0, 20.0, 30.0, 40.0, 50.0, 60.0):
        ticks = [step * (round(turn / step) + i) for i in (-1, 0, 1)]
        if min(abs(0.2 * math.sin(math.pi * t / 10)) for t in ticks) <= 1e-6:
            found.append(turn)
    return found


def test_the_switches_found_follow_from_the_grid(result: lesson.Result) -> None:
    """Four break-aways; then at a reversal that is hit four arrests, and until 61 s four more."""
    for step, count, reversals in zip(lesson.STEPS, result.counts, result.met, strict=True):
        turns = met(step)
        assert reversals == len(turns)
        assert count == 4 + 4 * len(turns) + 4 * sum(turn < 60 for turn in turns), step
    assert max(result.counts) == 48
    assert min(result.counts) == 4


def test_located_finds_all_with_the_same_steps(result: lesson.Result) -> None:
    log = result.located.transitions
    assert len(log) == 48
    assert len(result.once.transitions) == 4
    # v = A sin(w t) falls to v_c at t_r - v_c / (A w), to first order.
    arrests = log.t[log.edge == "arrest"].reshape(6, 4)
    early = 1e-6 / (0.2 * math.pi / 10)
    assert np.abs(arrests - (lesson.REVERSALS[:, None] - early)).max() < 1e-11
    assert result.arrest_error < 1e-11
    assert 0 < result.late <= lesson.STEP


def test_after_a_missed_reversal_it_slips_with_the_wrong_sign(result: lesson.Result) -> None:
    """From 10 to 20 s element 1 goes from +s to -s as exp(-C t / s) instead of sticking."""
    expected = -0.4 + 0.8 * math.exp(-0.1 * 10 / 0.4)
    assert result.once.z[result.once.t == 20.0, 0] == pytest.approx(expected, abs=0.01)
    # With located switches z sticks and follows x from +0.4 to -0.4, where it slips.
    assert result.located.z[result.located.t == 20.0, 0] == pytest.approx(-0.4, abs=0.01)
    assert result.z_error > 0.5
    assert result.F_error > 1.0


def test_the_window_has_the_stated_width() -> None:
    grid = np.linspace(10 - 3e-5, 10 + 3e-5, 600_001)
    inside = grid[np.abs(0.2 * np.sin(math.pi * grid / 10)) <= 1e-6]
    assert np.ptp(inside) == pytest.approx(lesson.window_width(), rel=1e-4)


def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    check_figure(lesson, result)
