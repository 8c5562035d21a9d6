"""A run of a system with several contacts that fails says which contact and element it was."""

from __future__ import annotations

import pytest

from gms_fsm import Body, Chart, Contact, State, System, Transition, simulate
from gms_fsm.run.simulate import Moment
from gms_fsm.traces.failures import LivelockError, StepLimitError
from tests.systems_cases import DRY, STICTION


def _loop(back: str) -> Chart:
    """A chart that switches at v = 0.2, and back."""
    return Chart(
        "loop",
        states=(State("p", outputs={"F": "0"}), State("q", outputs={"F": "0"})),
        transitions=(
            Transition("go", "p", "q", guard="v > 0.2"),
            Transition("back", "q", "p", guard=back),
        ),
    )


def _system(chart: Chart, n: int = 1) -> System:
    return System(
        "two",
        bodies=(
            Body("a", inertia=1.0, force="0.5", x="x1", v="v1"),
            Body("b", inertia=1.0, force="1", x="x2", v="v2"),
        ),
        contacts=(Contact("pad", STICTION, DRY, v="v1"), Contact("loop", chart, v="v2", n=n)),
    )


@pytest.mark.parametrize("engine", ["machines", "ifelse"])
def test_a_livelock(engine: str) -> None:
    with pytest.raises(LivelockError, match=r"^loop 1 at t = 0\.2") as caught:
        simulate(_system(_loop("v > 0.1"), 2), 1.0, engine=engine)
    assert "[v > 0.1] and that of go, [v > 0.2], hold together" in str(caught.value)


def test_too_many_steps() -> None:
    with pytest.raises(StepLimitError) as caught:
        simulate(_system(_loop("v > 9")), 1.0, engine="ifelse", max_steps=3)
    assert "max_steps = 3" in str(caught.value)


def test_a_moment_has_the_values_of_each_contact() -> None:
    seen: list[Moment] = []
    simulate(_system(_loop("v > 9")), 1.0, engine="ifelse", progress=seen.append)
    last = seen[-1]
    assert last.states == ["stuck", "q"]
    assert last.values["pad.F"] == pytest.approx(0.5)
    assert last.values["loop.v"] == pytest.approx(last.t)
