"""A motion for a rig stays in the stroke, reaches all speeds, begins and ends at rest, and tells.

It tells more than a sine of the same stroke, measured by the condition number of the derivatives
of the force with respect to the logarithms of k, weights, C, F_s, v_s and sigma_2 of four elements:
how much further the worst told combination of parameters is from the best told one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import ParameterError, Prescribed, Trace, excite, simulate
from tests.helpers import FASTEST
from tests.identification.records import bank

CASES: list[dict[str, Any]] = [
    {"stroke": 2e-3, "speeds": [5e-3, 5e-4, 1e-3, 1e-3]},
    {"stroke": 0.1, "speeds": [0.01, 0.25], "acceleration": 1.0},
    {"stroke": 3e-5, "speeds": [7e-6, 2e-5], "rate": 333.0, "acceleration": 1e-3},
]


@pytest.mark.parametrize("case", CASES)
def test_it_is_a_motion_within_the_limits(case: dict[str, Any]) -> None:
    motion = excite(**case)
    assert "force" not in motion.columns
    t, x, v = (motion.columns[name] for name in ("time", "position", "velocity"))
    half, fastest = case["stroke"] / 2, max(case["speeds"])
    assert np.abs(x).max() == pytest.approx(half, rel=1e-9)
    assert np.abs(x).max() <= half
    assert np.abs(v).max() <= fastest * (1 + 1e-12)
    rate = 1.0 / t[1]
    np.testing.assert_allclose(np.diff(t), 1.0 / rate, rtol=1e-6)
    assert rate == pytest.approx(case.get("rate", rate))
    # The acceleration is bounded; its difference quotient never exceeds it.
    bound = case.get("acceleration", np.pi * fastest**2 / case["stroke"])
    assert np.abs(np.diff(v)).max() * rate <= bound * (1 + 1e-6)
    # At rest in the middle at both ends; each speed is reached in both directions.
    for end in (slice(5), slice(-5, None)):
        assert not np.any([x[end], v[end]])
    for speed in (side * each for each in case["speeds"] for side in (1.0, -1.0)):
        assert (np.abs(v - speed) < 0.03 * abs(speed)).any(), speed
        assert any(f"at {abs(speed):g} m/s: the Stribeck curve" in note for note in motion.notes)
    # The trapezoidal rule on at least 10 rows a ramp: h**2 / 12 of the second derivative of v.
    change = np.diff(x) - 0.5 * (v[1:] + v[:-1]) * t[1]
    assert np.abs(change).max() <= 0.01 * np.abs(v).max() * t[1]
    followed = motion.motion().position
    np.testing.assert_allclose(followed, x, atol=2e-3 * case["stroke"])


def test_reversals_go_further_and_further() -> None:
    motion = excite(2e-3, [1e-3, 2e-3])
    x, v = motion.columns["position"], motion.columns["velocity"]
    turns = np.flatnonzero(v[:-1] * v[1:] < 0)
    rests = np.flatnonzero((v == 0.0) & (np.abs(x) > 0))
    corners = np.abs(x[np.union1d(turns, rests)])
    levels = corners[: np.argmax(corners > 0.999e-3)]
    assert len(levels) > 10
    assert (np.diff(levels) > -2e-3 * levels[1:]).all()  # a row need not be at the very turn
    assert levels[0] == pytest.approx(1e-5, rel=0.05)


@pytest.mark.parametrize("limit", [{"acceleration": 1.0}, {"rate": 50.0}])
def test_a_speed_out_of_reach_names_the_largest(limit: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match="speeds: 9 m/s cannot be reached in") as caught:
        excite(0.1, [0.01, 9.0], **limit)
    possible = float(str(caught.value).partition("possible speed is ")[2].split()[0])
    assert excite(0.1, [possible], **limit).columns["velocity"].max() > 0.9 * possible
    with pytest.raises(ParameterError, match="cannot be reached"):
        excite(0.1, [1.02 * possible], **limit)


# --------------------------------------------------------------------------- it tells
STROKE, SPEEDS = 2e-3, (5e-4, 2e-3, 1e-2)  # m, m/s
R = np.array([3e-5, 8e-5, 1.8e-4, 4e-4])  # F_c = 1 N: the weights are the thresholds
NUMBERS = np.concatenate([[8e3, 4e3, 2e3, 5e2], R, np.full(4, 2e-3), [1.3, 1.5e-3, 20.0]])


def run(numbers: np.ndarray, t: np.ndarray, v: np.ndarray) -> Trace:
    k, r, C = numbers[:12].reshape(3, 4)
    F_s, v_s, sigma_2 = numbers[12:].tolist()
    model = bank(k, r, C=C, F_s=F_s, v_s=v_s, sigma_2=sigma_2, v_c=1e-6)
    return simulate(model, Prescribed((t, v)), t[-1], t_eval=t, engine=FASTEST, rtol=1e-9)


def condition(t: np.ndarray, v: np.ndarray) -> float:
    def force(numbers: np.ndarray) -> np.ndarray:
        trace = run(numbers, t, v)
        return np.interp(t, trace.t, trace.F)

    steps = 1.0 + 1e-3 * np.eye(NUMBERS.size)
    columns = [force(NUMBERS * step) - force(NUMBERS / step) for step in steps]
    singular = np.linalg.svd(np.array(columns), compute_uv=False)
    return float(singular[0] / singular[-1])


@pytest.mark.matrix
@pytest.mark.slow
def test_all_elements_slip_and_it_is_better_conditioned_than_a_sine() -> None:
    motion = excite(STROKE, SPEEDS, rate=100.0)
    t, v = motion.columns["time"], motion.columns["velocity"]
    log = run(NUMBERS, t, v).transitions
    for edge in ("break_away_forward", "break_away_backward", "arrest"):
        assert {int(each) for each in log.element[log.edge == edge]} == {0, 1, 2, 3}, edge
    ours = condition(t, v)
    sines = [condition(t, speed * np.cos(2.0 * speed / STROKE * t)) for speed in SPEEDS]
    assert 20.0 * ours < sines[-1]  # the sine with the same highest speed
    assert 5.0 * ours < min(sines), (ours, sines)
