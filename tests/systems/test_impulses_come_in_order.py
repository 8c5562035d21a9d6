"""What an edge does happens in written order: what follows an impulse reads the new velocity."""

from __future__ import annotations

import pytest

from gms_fsm import Body, Chart, Contact, Parameter, State, System, Transition, simulate
from tests.helpers import FASTEST

HIT = Chart(
    "hit",
    inputs=("x", "v"),
    variables=("old", "new", "twice"),
    parameters=(Parameter("e", rule=">= 0"), Parameter("x_s", "m", "> 0")),
    let={"w": "2 * v"},
    states=(State("free", outputs={"F": "0"}),),
    transitions=(
        Transition(
            "bounce",
            "free",
            "free",
            guard="x >= x_s and v > 0",
            actions={"old": "v", "v": "-e * v", "new": "v", "twice": "w"},
        ),
    ),
)


@pytest.mark.parametrize("engine", ["machines", "ifelse", FASTEST])
def test_an_action_after_an_impulse_reads_the_new_velocity(engine: str) -> None:
    system = System(
        "two masses",
        bodies=(Body("a", inertia=2.0, x="x1", v="v1"), Body("b", inertia=3.0, x="x2", v="v2")),
        contacts=(Contact("stop", HIT, {"e": 0.5, "x_s": 1.0}, v="v1 - v2"),),
    )
    trace = simulate(system, 2.0, initial={"a.v": 1.0}, engine=engine)
    stop = trace.contact("stop")
    found = [float(stop.variable(name)[-1, 0]) for name in HIT.variables]
    assert found == pytest.approx([1.0, -0.5, -1.0], abs=1e-15)
    momentum = 2.0 * trace.body("a").v[-1] + 3.0 * trace.body("b").v[-1]
    assert momentum == pytest.approx(2.0, abs=1e-15)
