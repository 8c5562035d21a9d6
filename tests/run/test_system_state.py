"""A whole system steps in a loop of one's own: values by name, and forward and back.

That its steps give the bits of `simulate` is in tests/laws/test_a_stepped_system_is_simulated.py.
"""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Body,
    Chart,
    Contact,
    ParameterError,
    Sampled,
    SimulationError,
    State,
    StepLimitError,
    Supervisor,
    System,
    SystemState,
    Transition,
    simulate,
)
from gms_fsm.charts import CHARTS
from gms_fsm.traces.system_scope import SystemScope, system_names
from tests.helpers import FASTEST, stick_slip

engines = pytest.mark.parametrize("engine", sorted({"ifelse", FASTEST}))
PUSHED = System(
    "pushed",
    bodies=(
        Body("mass", inertia="m", force="u + w + i - 3 * x + cos(t)", x="x", v="v"),
        Body("belt", velocity="V * sin(t)", x="x_b", v="v_b"),
    ),
    contacts=(
        Contact("pad", stick_slip("signed"), v="v - v_b"),
        Contact("stop", CHARTS["stiction"], {"F_c": 0.1, "F_s": 0.2, "b": 0.1}, v="v"),
    ),
    numbers={"m": 1.0, "V": 0.2},
    signals={"r": "0.1 * t"},
    flow={"i": "r - i"},
    sampled=(Sampled("hold", period=0.25, updates={"w": "r - x"}),),
    let={"far": "x + u"},
    inputs=("u",),
)


def moved(state: SystemState, start: int, stop: int) -> list[Any]:
    """Return what was found on the way."""
    found: list[Any] = []
    for k in range(start, stop):
        state.advance(0.1, u=(4.0 * (k % 3), 4.0 * ((k + 1) % 3)) if k % 2 else 3.0)
        found.append((state.t, state.value("x"), state.value("pad.F"), state.switches))
    return found


@pytest.mark.every(2)
@engines
def test_every_name_of_a_run_has_the_value_of_the_run(engine: str) -> None:
    state = SystemState(PUSHED, engine=engine)
    state.advance(0.9, u=(0.0, 3.0))
    record = [0.0, 0.9], [0.0, 3.0]
    trace = simulate(PUSHED, 0.9, inputs={"u": record}, engine="ifelse")
    watched = SystemScope.over(trace).watches()
    for name in system_names(PUSHED):
        assert state.value(name) == np.ravel(watched[name])[-1], name
    assert state.value("mass.v") == state.value("v")
    assert {*system_names(PUSHED)} < {*state.names}
    assert {name: list(each) for name, each in state.states.items()} == {
        name: [str(each) for each in trace.contact(name).states[-1]] for name in ("pad", "stop")
    }


@engines
def test_a_snapshot_serves_its_system_and_another_one(engine: str) -> None:
    one, other = SystemState(PUSHED, engine=engine), SystemState(PUSHED, engine=engine)
    moved(one, 1, 9)
    before = one.snapshot()
    first = moved(one, 9, 20)
    for each in (one, other):
        each.restore(before)
        assert each.t == before.t
        assert moved(each, 9, 20) == first
    assert any(switches for *_, switches in first)


@engines
@pytest.mark.parametrize("again", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
@pytest.mark.parametrize("count", [0, 8])
def test_copies_go_their_own_ways(
    again: Callable[[SystemState], SystemState], count: int, engine: str
) -> None:
    state = SystemState(PUSHED, t=1.0, engine=engine)
    moved(state, 1, 1 + count)
    other = again(state)
    first = moved(state, 1 + count, 15)
    assert moved(other, 1 + count, 15) == first


@engines
def test_looking_ahead_changes_nothing(engine: str) -> None:
    state, other = SystemState(PUSHED, engine=engine), SystemState(PUSHED, engine=engine)
    for each in (state, other):
        moved(each, 1, 6)
    relations = state._plant.memory.buffers.relations
    above = [*relations.above]
    seen = state.peek(0.1, "x", "pad.F", u=(8.0, 0.0))
    assert (state.t, state.switches) == (other.t, other.switches)
    relations.above[:] = [1.0] * len(above)  # of motions along a surface, where it turns
    state.restore(other.snapshot())
    assert [*relations.above] == above
    state.advance(0.1, u=(8.0, 0.0))
    assert seen == (state.value("x"), state.value("pad.F"))
    other.advance(0.1, u=(8.0, 0.0))
    assert moved(state, 7, 15) == moved(other, 7, 15)


@engines
def test_a_tick_at_the_end_waits_for_the_next_sample(engine: str) -> None:
    held = System(
        "held",
        bodies=(Body("mass", inertia=1.0, force="w"),),
        contacts=(Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0}),),
        sampled=(Sampled("hold", period=0.1, updates={"w": "u"}),),
        inputs=("u",),
    )
    state = SystemState(held, engine=engine)
    state.advance_to(0.1, u=1.0)
    state.advance_to(0.2, u=2.0)
    assert state.value("w") == 2.0  # of t = 0.1
    state.advance(0.0, u=3.0)
    assert state.value("w") == 3.0


ROOT = Chart(
    "root", inputs=("v",), variables=("z",),
    states=(State("only", flow={"z": "v * sqrt(sgn(0.5 - z))"}, outputs={"F": "z"}),),
)  # fmt: skip


@engines
def test_an_error_leaves_everything_as_it_was(engine: str) -> None:
    system = System(
        "root",
        bodies=(Body("mass", inertia=1.0, force="u + cos(t)"),),
        contacts=(Contact("pad", ROOT),),
        inputs=("u",),
    )
    state, other = (SystemState(system, engine=engine) for _ in range(2))
    for each in (state, other):
        each.advance(0.1, u=1.0)
    for wrong in ({"u": 900.0}, {"u": (1.0, 900.0)}):
        with pytest.raises(SimulationError, match=r"as it was before the call, at t = 0\.1 s"):
            state.advance(20.0, **wrong)
        assert (state.t, state.value("x"), state.value("u")) == (0.1, other.value("x"), 1.0)
    with pytest.raises(ParameterError):
        state.advance(0.1)
    with pytest.raises(StepLimitError, match="one sample needs more than max_steps steps"):
        SystemState(system, engine=engine, max_steps=3).advance(2.0, u=1.0)
    for each in (state, other):
        each.advance(0.1, u=0.5)
    assert state.value("pad.z1") == other.value("pad.z1")


@engines
@pytest.mark.parametrize("after", [1.0, 2.0], ids=["as before", "jumps"])
def test_an_event_is_heard_whatever_the_inputs_do(engine: str, after: float) -> None:
    mode = Chart(
        "mode",
        inputs=(),
        velocities=(),
        states=(State("cold", outputs={"N": "1"}), State("hot", outputs={"N": "2"})),
        transitions=(Transition("heat", "cold", "hot", event="hot"),),
    )
    system = System(
        "heated",
        bodies=(Body("mass", inertia=1.0, force="u * mode.N + cos(t)"),),
        contacts=(Contact("pad", stick_slip("signed")),),
        supervisors=(Supervisor("mode", mode),),
        inputs=("u",),
    )
    state = SystemState(system, engine=engine)
    state.advance(0.1, u=1.0)
    state.send("hot")
    state = pickle.loads(pickle.dumps(state))
    assert state.peek(0.1, "mode.N", u=after) == (2.0,)
    state.advance(0.1, u=after)
    assert state.switches[0] == (0.1, "mode", 0, "heat")
    state.advance(0.1, u=1.0)
    assert "heat" not in [each.edge for each in state.switches]


def test_a_system_with_its_inputs_is_a_file(tmp_path: Any) -> None:
    path = PUSHED.save(tmp_path / "pushed.toml")
    assert System.load(path) == PUSHED
