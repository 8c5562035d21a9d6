"""What coverage says of an edge that waits for an event, or for a condition to last."""

from __future__ import annotations

import pytest

from gms_fsm import Chart, State, Supervisor, System, Transition, coverage, simulate

TICK = Transition("tick", "a", "a", guard="after(0.3)", emit="q")


def said_of(*edges: Transition) -> str:
    """Return what is said of a supervisor with two states after a run of 1 s."""
    states = (State("a"), State("b"))
    chart = Chart("w", inputs=("u",), velocities=(), states=states, transitions=edges)
    system = System("s", supervisors=(Supervisor("m", chart, inputs={"u": "t"}),))
    return " ".join(str(coverage(simulate(system, 1.0))).split())


@pytest.mark.parametrize("guard", ["True", "u > 0.5"])
def test_an_event_that_never_came_has_no_distance(guard: str) -> None:
    said = said_of(Transition("go", "a", "b", guard, event="q"))
    assert said.endswith(" never taken: go from a: the event q never came while it was in a")


def test_an_event_that_came_too_early_is_told_with_what_it_met() -> None:
    said = said_of(TICK, Transition("go", "a", "b", "u > 0.95", event="q"))
    assert "go from a: the event q never came while `u > 0.95` was true" in said
    assert "go from a: `u > 0.95` was never true while the event q came (closest: -0.05)" in said


def test_how_long_a_condition_has_held_is_told_as_the_chart_shows_it() -> None:
    said = said_of(Transition("go", "a", "b", "duration(u >= 0) >= 3"))
    assert "`duration(u >= 0) >= 3` was never true (closest: -2 s)" in said
