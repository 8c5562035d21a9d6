"""All elements slip in the motion for a rig, and it tells more than a sine of the same stroke.

Measured by the condition number of the derivatives of the force with respect to the logarithms of
k, weights, C, F_s, v_s and sigma_2 of four elements: how much further the worst told combination of
parameters is from the best told one.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, Trace, excite, simulate
from tests.helpers import FASTEST

STROKE, SPEEDS = 2e-3, (5e-4, 2e-3, 1e-2)  # m, m/s
K = np.array([8e3, 4e3, 2e3, 5e2])
R = np.array([3e-5, 8e-5, 1.8e-4, 4e-4])  # F_c = 1 N: the weights are the thresholds
NUMBERS = np.concatenate([K, R, np.full(4, 2e-3), [1.3, 1.5e-3, 20.0]])
BETTER = 5.0  # than the best of the sines
MUCH_BETTER = 20.0  # than the sine with the same highest speed


def run(numbers: np.ndarray, t: np.ndarray, v: np.ndarray) -> Trace:
    k, r, C = numbers[:12].reshape(3, 4)
    F_s, v_s, sigma_2 = numbers[12:].tolist()
    curve = Stribeck(1.0, F_s, v_s)
    parameters = GMSParameters(
        k, np.zeros(4), C, sigma_2=sigma_2, stribeck=curve, v_c=1e-6, weights=r
    )
    model = GMS(parameters, law="signed")
    return simulate(model, Prescribed((t, v)), t[-1], t_eval=t, engine=FASTEST, rtol=1e-9)


def condition(t: np.ndarray, v: np.ndarray) -> float:
    def force(numbers: np.ndarray) -> np.ndarray:
        trace = run(numbers, t, v)
        return np.interp(t, trace.t, trace.F)

    steps = 1.0 + 1e-3 * np.eye(NUMBERS.size)
    columns = [force(NUMBERS * step) - force(NUMBERS / step) for step in steps]
    singular = np.linalg.svd(np.array(columns), compute_uv=False)
    return float(singular[0] / singular[-1])


@functools.cache
def designed() -> tuple[np.ndarray, np.ndarray]:
    motion = excite(STROKE, SPEEDS, rate=100.0)
    return motion.columns["time"], motion.columns["velocity"]


@pytest.mark.slow
def test_all_elements_slip_where_the_stroke_is_over_twice_the_largest_threshold() -> None:
    assert 2.0 * R.max() * 1.3 < STROKE
    log = run(NUMBERS, *designed()).transitions
    for edge in ("break_away_forward", "break_away_backward", "arrest"):
        assert {int(each) for each in log.element[log.edge == edge]} == {0, 1, 2, 3}, edge


@pytest.mark.slow
def test_it_is_better_conditioned_than_a_sine() -> None:
    t, v = designed()
    ours = condition(t, v)
    sines = [condition(t, speed * np.cos(2.0 * speed / STROKE * t)) for speed in SPEEDS]
    assert MUCH_BETTER * ours < sines[-1]
    assert BETTER * ours < min(sines), (ours, sines)
