"""A ball without a state of rest bounces ever faster: the error says by which factor, until when.

It used to say that the flows on both sides of the guard push back.
"""

from __future__ import annotations

import re

import pytest

from gms_fsm import Chart, ChartModel, Slider, State, Transition, simulate
from gms_fsm.traces.failures import LivelockError
from tests.traces.test_monitors_see_what_happens import SLOWING, memoryless

GRAVITY, THROWN = 9.81, 2.0  # m/s^2 towards the stop, m/s away from it


def ball(e: float) -> ChartModel:
    """Return a rigid stop at x = 0 with restitution, and nothing else."""
    chart = Chart(
        "ball",
        inputs=("x", "v"),
        parameters=("e",),
        states=(State("free", outputs={"F": "0"}),),
        transitions=(
            Transition("bounce", "free", "free", "x >= 0 and v > 0", actions={"v": "-e * v"}),
        ),
    )
    return ChartModel(chart, {"e": e})


@pytest.mark.parametrize("e", [0.005, 0.01, 0.2, 0.5, 0.8, 0.95])
def test_the_factor_is_the_restitution_and_the_end_the_sum_of_all_flights(e: float) -> None:
    with pytest.raises(LivelockError) as caught:
        simulate(ball(e), Slider(1.0, str(GRAVITY)), 100.0, initial={"v": -THROWN}, engine="ifelse")
    error = caught.value
    factor, end = map(
        float,
        re.findall(r"each to ([\d.e-]+) of the one before, and end at t = ([\d.]+) s", str(error))[
            0
        ],
    )
    assert factor == pytest.approx(e, rel=1e-4)
    assert end == pytest.approx(2.0 * THROWN / GRAVITY / (1.0 - e), rel=1e-8)
    assert "a state of rest is missing" in error.reason
    assert "locked state" in error.advice
    assert "rest speed" in error.advice
    assert error.place == "element 1"
    assert "push back" not in str(error)


def test_two_restitutions_in_turn_are_one_sequence() -> None:
    """A stop that is hard and soft in turn: every second interval is 0.36 of the one before."""
    chart = Chart(
        "ratchet",
        inputs=("x", "v"),
        parameters=("e",),
        states=(State("odd", outputs={"F": "0"}), State("even", outputs={"F": "0"})),
        transitions=(
            Transition("hard", "odd", "even", "x >= 0 and v > 0", actions={"v": "-e * v"}),
            Transition("soft", "even", "odd", "x >= 0 and v > 0", actions={"v": "-0.9 * v"}),
        ),
    )
    rig = Slider(1.0, str(GRAVITY))
    with pytest.raises(LivelockError) as caught:
        simulate(ChartModel(chart, {"e": 0.4}), rig, 100.0, initial={"v": -THROWN}, engine="ifelse")
    first = 2.0 * THROWN / GRAVITY  # then 0.4, then 0.9 of it, and so on
    end = first * (1.0 + 0.4) / (1.0 - 0.4 * 0.9)
    assert "each to 0.6 of the one before" in str(caught.value)
    assert f"end at t = {end:.9g}" in str(caught.value)


def test_chattering_is_not_taken_for_it() -> None:
    with pytest.raises(LivelockError, match="chattering") as caught:
        simulate(memoryless([0.5]), SLOWING, 10.0, engine="ifelse")
    assert "shrink" not in str(caught.value)
