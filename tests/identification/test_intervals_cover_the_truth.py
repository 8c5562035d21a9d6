"""95 % intervals cover the truth about 95 times in 100, under white and under correlated noise.

Of a model linear in its parameters, so that many draws take no time.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.identification.certainty.statistics import certainty, correlation_time, phase_floor
from tests.identification.records import noise

ROWS, DRAWS = 4000, 100


def _coverage(correlation: float) -> FloatArray:
    """Return in which share of the draws the interval of each coefficient holds 0."""
    t = np.arange(ROWS) / 200.0
    columns = [np.sin(0.5 * t), np.tanh(8.0 * np.sin(0.5 * t)), np.ones(ROWS), np.cos(3.0 * t)]
    slopes = np.stack(columns, axis=1)
    hits = np.zeros(4)
    for draw in range(DRAWS):
        error = 0.1 * noise(draw, ROWS, correlation)
        found, *_ = np.linalg.lstsq(slopes, error, rcond=None)
        sure = certainty(slopes, [slopes @ found - error], np.zeros(4, dtype=bool), 1.0)
        hits += np.abs(found) <= sure.half
        assert not sure.open.any()
    return hits / DRAWS


@pytest.mark.slow
@pytest.mark.parametrize("correlation", [0.0, 0.95])
def test_coverage_of_each_coefficient_the_offset_included(correlation: float) -> None:
    share = _coverage(correlation)
    assert (share >= 0.9).all()
    assert (share <= 0.99).all()


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_correlation_time_is_that_of_the_process(correlation: float) -> None:
    expected = (1.0 + correlation) / (1.0 - correlation)
    parts = [noise(seed, 6000, correlation) for seed in range(4)]
    assert correlation_time(parts) == pytest.approx(expected, rel=0.15)


def test_residuals_of_zero_have_no_correlation() -> None:
    assert correlation_time([np.zeros(100)]) == 1.0


def test_a_direction_without_influence_is_open_and_spares_the_others() -> None:
    t = np.arange(2000) / 200.0
    both = np.sin(t)
    slopes = np.stack([both, 2.0 * both, np.ones(2000)], axis=1)
    sure = certainty(slopes, [0.1 * noise(0, 2000)], np.zeros(3, dtype=bool), 1.0)
    assert sure.open.tolist() == [True, True, False]
    assert np.isinf(sure.half).tolist() == [True, True, False]
    # The loose direction is the combination that the force does not show: two of one, one less of
    # the other.
    assert abs(sure.directions[:, -1]) == pytest.approx(
        np.array([2.0, 1.0, 0.0]) / 5**0.5, abs=1e-9
    )


def test_repeatability_floor_is_the_noise_of_single_cycles() -> None:
    t = np.arange(20_000) / 200.0
    force = np.sin(2.0 * np.pi * t / 4.0) ** 3 + 0.05 * noise(1, t.size)
    assert phase_floor(t, force, 4.0) == pytest.approx(0.05, rel=0.03)
    assert np.isnan(phase_floor(t[:500], force[:500], 4.0))
