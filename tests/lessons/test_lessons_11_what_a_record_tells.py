"""Lesson 11: what cannot be told is named, intervals hold the truth, and rows are not counted."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.app.lessons import l11_what_a_record_tells as lesson
from tests.lesson_checks import check_figure, check_lines

pytest.importorskip("llvmlite", reason="fits take long without machine code")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


def test_the_sine_does_not_reach_the_second_threshold(result: lesson.Result) -> None:
    first, second = lesson.TRUTH[2:] * lesson.F_c  # m: at any speed thresholds are at least this
    assert first < lesson.AMPLITUDE < second
    assert 2.0 * second * lesson.F_s / lesson.F_c < lesson.STROKE
    slipped = {name: {*trace.transitions.element.tolist()} for name, trace in result.moved.items()}
    assert slipped == {"sine": {0}, "designed motion": {0, 1}}


def test_an_excellent_fit_does_not_know_a_parameter(result: lesson.Result) -> None:
    assert result.sine.training["r2"] > 0.9995
    assert result.sine.open == ("weights2",)
    assert result.sine.never_slipped == (2,)
    assert result.sine["weights2"].value == pytest.approx(lesson.START[3])  # where it began
    assert result.unseen == 0.0


@pytest.mark.parametrize(("amplitude", "opened"), [(220e-6, ("weights2",)), (260e-6, ())])
def test_it_is_the_amplitude_and_not_the_start(amplitude: float, opened: tuple[str, ...]) -> None:
    """Started at the truth, which slips at its reversal beyond F_s / F_c times 200 µm."""
    record = lesson.recorded(lesson.sine(amplitude), 0.0, 1)
    found = lesson.fitted(record, second=lesson.TRUTH[3])
    assert found.open == opened


def test_a_start_without_slope_is_left_by_the_walk() -> None:
    """From too high a threshold the element never slips, but the fit finds the way."""
    found = lesson.fitted(lesson.recorded(lesson.sine(300e-6), 0.0, 1))
    assert found.open == ()
    assert found.training["rmse"] == pytest.approx(lesson.NOISE, rel=0.05)
    assert found["weights2"].low < lesson.TRUTH[3] < found["weights2"].high


def test_above_the_least_weight_nothing_changes(result: lesson.Result) -> None:
    motion = lesson.sine()
    truth = lesson.force(lesson.bank(lesson.TRUTH), motion)
    for factor, seen in ((1.01, False), (0.99, True)):
        numbers = [*lesson.TRUTH[:3], factor * result.least]
        off = np.abs(lesson.force(lesson.bank(numbers), motion) - truth).max()
        assert (off > 1e-3) == seen, (factor, off)


def test_the_designed_motion_tells_all(result: lesson.Result) -> None:
    assert result.designed.open == ()
    assert result.designed.never_slipped == ()
    assert result.hits == 4
    for name, true in zip(lesson.NAMES, lesson.TRUTH, strict=True):
        assert result.designed[name].value == pytest.approx(true, rel=0.005)


def test_a_few_rows_count_where_noise_is_correlated(result: lesson.Result) -> None:
    a = lesson.CORRELATION
    rows = result.designed.training["rows"]
    assert result.designed.effective_rows == pytest.approx(rows, rel=0.1)
    assert result.correlated.training["rows"] == rows
    assert result.correlated.effective_rows == pytest.approx(rows * (1 - a) / (1 + a), rel=0.5)
    assert result.correlated.training["rmse"] == pytest.approx(lesson.NOISE, rel=0.15)
    for name, true in zip(lesson.NAMES, lesson.TRUTH, strict=True):
        assert result.correlated[name].low < true < result.correlated[name].high


def test_intervals_from_rows_are_those_of_the_textbook(result: lesson.Result) -> None:
    """With independent noise both are the same; with correlated noise they are too short."""
    every = [result.designed[name] for name in lesson.NAMES]
    tabled = [0.5 * (each.high - each.low) / each.value for each in every]
    textbook = 1.96 * result.designed.training["rmse"] * result.unit
    np.testing.assert_allclose(tabled, textbook, rtol=0.25)
    assert result.too_short == pytest.approx(np.sqrt(1.95 / 0.05), rel=0.3)
    short, long = result.coverage
    assert 0.2 < short < 0.6
    assert 0.93 <= long <= 1.0


def test_repeated_records_need_no_fit(result: lesson.Result) -> None:
    """The derivatives at the truth predict what a fit to a new record finds."""
    off = np.linalg.pinv(result.slopes) @ lesson.noise(len(result.slopes), lesson.CORRELATION, 3)
    found = [result.correlated[name].value for name in lesson.NAMES]
    np.testing.assert_allclose(np.log(found / lesson.TRUTH), off[:4], atol=5e-4)


def test_noise_has_the_size_and_the_correlation_it_is_said_to_have() -> None:
    for a in (0.0, lesson.CORRELATION):
        made = lesson.noise(200_000, a, 0)
        assert np.std(made) == pytest.approx(lesson.NOISE, rel=0.03)
        assert np.corrcoef(made[1:], made[:-1])[0, 1] == pytest.approx(a, abs=0.01)


def test_scale_and_weights_are_one_number(result: lesson.Result) -> None:
    motion = lesson.sine(4e-4)
    t, v = motion.columns["time"], motion.columns["velocity"]
    runs = [
        simulate(lesson.bank(lesson.TRUTH, scale), Prescribed((t, v)), float(t[-1]))
        for scale in (1.0, 4.0)
    ]
    np.testing.assert_allclose(runs[1].F, runs[0].F, rtol=1e-9, atol=1e-12)
    values = [[each[name].value for name in ("F_c", "weights1")] for each in result.products]
    (one, w_one), (other, w_other) = values
    assert other > 2.0 * one
    assert one * w_one == pytest.approx(other * w_other, rel=1e-4)
    for each in result.products:
        assert {"weights1", "weights2", "F_c"} <= {*each.open}
        assert each["k1"].told
    assert result.weakest.endswith(" N")
    for name in ("F_c", "weights1", "weights2"):
        assert name in result.weakest


def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    lines = result.lines()
    assert "R² is 0.9998. Elements that never slipped: 2. Cannot be told: weights2;" in lines[2]
    assert "changes the force by 0 N" in lines[2]
    assert "Cannot be told: nothing; 4 of 4 intervals contain the truth" in lines[2]
    assert f"count for {result.correlated.effective_rows:.0f}; intervals" in lines[3]
    assert f"are {result.too_short:.1f} times shorter" in lines[3]
    check_figure(lesson, result)
