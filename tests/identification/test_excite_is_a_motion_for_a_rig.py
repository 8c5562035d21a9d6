"""A motion for a rig stays in the stroke, reaches all speeds, and begins and ends at rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import ParameterError, excite

CASES: list[dict[str, Any]] = [
    {"stroke": 2e-3, "speeds": [1e-3]},
    {"stroke": 2e-3, "speeds": [5e-3, 5e-4, 1e-3, 1e-3]},
    {"stroke": 0.1, "speeds": [0.01, 0.25], "acceleration": 1.0},
    {"stroke": 2e-3, "speeds": [1e-3, 1e-2], "rate": 200.0},
    {"stroke": 3e-5, "speeds": [7e-6, 2e-5], "rate": 333.0, "acceleration": 1e-3},
]


@pytest.mark.parametrize("case", CASES)
def test_it_is_a_motion_within_the_limits(case: dict[str, Any]) -> None:
    motion = excite(**case)
    t, x, v = (motion.columns[name] for name in ("time", "position", "velocity"))
    half, fastest = case["stroke"] / 2, max(case["speeds"])
    assert np.abs(x).max() == pytest.approx(half, rel=1e-9)
    assert np.abs(x).max() <= half
    assert np.abs(v).max() <= fastest * (1 + 1e-12)
    assert motion.name == "excitation"
    assert "force" not in motion.columns
    rate = 1.0 / t[1]
    np.testing.assert_allclose(np.diff(t), 1.0 / rate, rtol=1e-6)
    assert rate == pytest.approx(case.get("rate", rate))
    # The acceleration is bounded; its difference quotient never exceeds it.
    bound = case.get("acceleration", np.pi * fastest**2 / case["stroke"])
    assert np.abs(np.diff(v)).max() * rate <= bound * (1 + 1e-6)


@pytest.mark.parametrize("case", CASES)
def test_it_begins_and_ends_at_rest_in_the_middle(case: dict[str, Any]) -> None:
    motion = excite(**case)
    for end in (slice(5), slice(-5, None)):
        assert (motion.columns["position"][end] == 0.0).all()
        assert (motion.columns["velocity"][end] == 0.0).all()


@pytest.mark.parametrize("case", CASES)
def test_each_speed_is_reached_in_both_directions(case: dict[str, Any]) -> None:
    v = excite(**case).columns["velocity"]
    for speed in case["speeds"]:
        for side in (1.0, -1.0):
            assert (np.abs(side * v - speed) < 0.03 * speed).any(), (speed, side)


@pytest.mark.parametrize("case", CASES)
def test_the_velocity_is_the_derivative_of_the_position(case: dict[str, Any]) -> None:
    motion = excite(**case)
    x, v = motion.columns["position"], motion.columns["velocity"]
    change = np.diff(x) - 0.5 * (v[1:] + v[:-1]) * motion.columns["time"][1]
    # The trapezoidal rule on at least 10 rows a ramp: h**2 / 12 of the second derivative of v.
    assert np.abs(change).max() <= 0.01 * np.abs(v).max() * motion.columns["time"][1]
    np.testing.assert_allclose(
        motion.motion().position, x, atol=2e-3 * case["stroke"], err_msg="as a run follows it"
    )


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


def test_notes_say_what_each_part_is_for() -> None:
    notes = excite(2e-3, [1e-3, 5e-3]).notes
    assert notes[0] == "from 0 s: at rest"
    assert any("growing amplitude at 0.001 m/s: the thresholds" in note for note in notes)
    for speed in ("0.001", "0.005"):
        assert any(f"reversals at {speed} m/s: the Stribeck curve" in note for note in notes)


@pytest.mark.parametrize("limit", [{"acceleration": 1.0}, {"rate": 50.0}])
def test_a_speed_out_of_reach_names_the_largest(limit: dict[str, float]) -> None:
    with pytest.raises(ParameterError) as caught:
        excite(0.1, [0.01, 9.0], **limit)
    text = str(caught.value)
    assert "speeds: 9 m/s cannot be reached in a stroke of 0.1 m" in text
    possible = float(text.partition("the largest possible speed is ")[2].split()[0])
    assert excite(0.1, [possible], **limit).columns["velocity"].max() > 0.9 * possible
    with pytest.raises(ParameterError, match="cannot be reached"):
        excite(0.1, [1.02 * possible], **limit)
