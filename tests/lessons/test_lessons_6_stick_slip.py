"""Lesson 6: a pulled mass waits for a length divided by V; its slip time hardly depends on V."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from gms_fsm import PulledSlider, simulate
from gms_fsm.app.lessons import l6_stick_slip as lesson
from tests.lesson_checks import check_figure, check_lines

pytestmark = pytest.mark.slow  # they share one run of the lesson


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


def test_the_known_run(result: lesson.Result) -> None:
    log = result.portrait.transitions
    assert Counter(log.edge.tolist()) == {"break_away_forward": 38, "arrest": 34}
    assert result.portrait.v.min() == pytest.approx(-0.024, abs=1e-3)
    assert result.portrait.v.max() == pytest.approx(0.36, abs=2e-3)


def test_waits_are_a_length_over_the_speed_and_slips_are_not(result: lesson.Result) -> None:
    V = np.array(lesson.SPEEDS)
    lengths = (result.waits * V)[:-1]  # at the highest speed it hardly comes to rest
    assert np.ptp(lengths) < 0.06 * lengths.mean()
    assert result.slips.max() / result.slips.min() < 1.5
    assert (np.diff(result.waits + result.slips) < 0).all()
    # Between oscillations of the free mass on its spring, half a period and a whole one.
    free = 2 * np.pi * np.sqrt(lesson.MASS / lesson.STIFFNESS)
    assert 0.5 * free < result.slips.min()
    assert result.slips.max() < 1.2 * free


def test_the_wait_stretches_the_spring_from_the_stop_to_stiction(result: lesson.Result) -> None:
    for V, cycle in zip(lesson.SPEEDS, result.cycles, strict=True):
        assert cycle.pull_at_slip == pytest.approx(lesson.F_s, rel=0.04)
        assert cycle.pull_at_stop < lesson.F_c
        # K (V wait - creep) = rise of the pull; the mass creeps below the lowest threshold.
        stretched = (cycle.pull_at_slip - cycle.pull_at_stop) / lesson.STIFFNESS
        creep = V * cycle.wait - stretched
        assert -0.01 < creep < lesson.F_s / 4 / lesson.K.min()


def test_over_a_cycle_pull_and_friction_balance(result: lesson.Result) -> None:
    """Momentum is the same at both ends of a cycle: the mean of pull minus friction is zero."""
    trace = result.portrait
    log = trace.transitions
    ends = log.t[(log.element == 3) & (log.edge == "break_away_forward")][-2:]
    fine = trace.sample(np.linspace(*ends, 20_001))
    net = lesson.STIFFNESS * (lesson.SPEED * fine.t - fine.x) - fine.F
    assert abs(np.mean(0.5 * (net[1:] + net[:-1]))) < 1e-3
    assert np.abs(net).max() > 0.2


def test_it_keeps_sliding_without_falling_friction_or_when_pulled_fast(
    result: lesson.Result,
) -> None:
    assert set(result.rests.values()) == {0}
    trace = simulate(
        lesson.bank(), PulledSlider(lesson.MASS, lesson.STIFFNESS, lesson.TOO_FAST), lesson.END
    )
    V = lesson.TOO_FAST
    assert trace.v[-1] == pytest.approx(V, abs=2e-3)
    assert trace.F[-1] == pytest.approx(lesson.F_c + lesson.SIGMA_2 * V, abs=2e-3)


def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    check_figure(lesson, result)
