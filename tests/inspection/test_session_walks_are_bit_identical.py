"""Moving back and forth shows the same bits, parents never change, rows equal those of simulate().

Random walks of step, back, next, prev, goto, until, switch and poke on random small models.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gms_fsm import GMS, GMSParameters, Prescribed, PulledSlider, Slider, Stribeck, Trace, simulate
from gms_fsm.session.session import Branch, Here, Session
from gms_fsm.systems.rigs import Rig
from gms_fsm.traces.failures import SimulationError
from tests.helpers import pulled_mass, same_bits

pytestmark = pytest.mark.slow

T_END = 6.0
OPTIONS: list[dict[str, Any]] = [
    {},
    {"engine": "ifelse", "rtol": 1e-4},
    {"method": "rk4", "step": 0.05},
    {"method": "bs23", "max_step": 0.2},
    {"events": "step", "step": 0.02, "method": "heun"},
]
RIGS: list[Rig] = [
    Prescribed("0.8*sin(2*pi*t/3)"),
    Prescribed([(0.0, 0.0), (1.0, 0.5), (3.0, -0.7), (6.0, 0.4)]),
    PulledSlider(1.0, 3.0, 0.4),
    Slider(0.5, "1.5*sin(2*t)"),
]


@st.composite
def models(draw: st.DrawFn) -> GMS:
    n = draw(st.integers(1, 3))
    several = st.lists(st.floats(0.5, 3.0), min_size=n, max_size=n)
    parameters = GMSParameters(
        draw(several),
        [0.1] * n,
        draw(several),
        sigma_2=0.1,
        stribeck=Stribeck(draw(st.floats(0.1, 0.39)), draw(st.floats(0.4, 0.6)), 0.1),
        v_c=1e-4,
        weights=[1.0 / (n * k) for k in draw(several)],
    )
    return GMS(parameters, law=draw(st.sampled_from(["signed", "published"])))


MOVES = st.one_of(
    st.tuples(st.sampled_from(["step", "back"]), st.integers(1, 30)),
    st.tuples(st.sampled_from(["next", "prev"]), st.none()),
    st.tuples(st.just("goto"), st.floats(0.0, T_END)),
    st.tuples(st.just("until"), st.sampled_from(["z1 > 0.1", "z1 < -0.05", "v > 0.2"])),
    st.tuples(st.just("switch"), st.integers(0, 5)),
    st.tuples(st.just("poke"), st.tuples(st.floats(-0.3, 0.3), st.sampled_from([None, "slip"]))),
)


def _own_part(branch: Branch) -> list[Any]:
    rows = [branch.raw(row) for row in range(len(branch))]
    return rows[len(rows) - len(branch.run.recorder.rows.t) :]


def _simulated(model: GMS, rig: Rig, options: dict[str, Any]) -> tuple[Trace, str | None]:
    try:
        return simulate(model, rig, T_END, **options), None
    except SimulationError as error:  # a livelock is an outcome too
        return error.trace, str(error)


def _poked(session: Session, z: float, state: str | None) -> dict[str, Any]:
    """Poke element 1; return the initial values of an equivalent separate run."""
    here: Here = session.here
    initial: dict[str, Any] = {"x": here.x, "z": [z, *here.z[1:]], "states": list(here.states)}
    if session.rig.acceleration is not None:
        initial["v"] = here.v
    if state is not None:
        initial["states"][0] = state
    session.poke({"z": {0: z}}, state={} if state is None else {0: state})
    return {"t_start": here.t, "initial": initial}


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    models(),
    st.sampled_from(RIGS),
    st.sampled_from(OPTIONS),
    st.lists(MOVES, min_size=1, max_size=25),
)
def test_random_walks(
    model: GMS, rig: Rig, options: dict[str, Any], moves: list[tuple[str, Any]]
) -> None:
    session = Session(model, rig, T_END, **options)
    seen: list[list[Any]] = [[]]  # of each branch, its rows when they were first seen
    alone: list[dict[str, Any]] = [{}]  # what simulate() needs for a branch
    for move, how in moves:
        match move:
            case "step":
                session.step(how)
            case "back":
                session.back(how)
            case "next":
                session.next_transition()
            case "prev":
                session.prev_transition()
            case "goto":
                session.goto(how)
            case "until":
                session.until(how)
            case "switch":
                session.switch(how % len(session.branches))
            case "poke" if session.here.t < T_END and len(session.branches) < 4:
                alone.append(_poked(session, *how))
                seen.append([])
        for branch, rows in zip(session.branches, seen, strict=True):
            assert [branch.raw(row) for row in range(len(rows))] == rows
            rows += [branch.raw(row) for row in range(len(rows), len(branch))]
    for number, branch in enumerate(session.branches):
        session.switch(number)
        session.goto(T_END)
        trace, outcome = _simulated(model, rig, options | alone[number])
        assert branch.ended == (outcome is None)
        assert branch.failure is None or str(branch.failure) == outcome
        if number == 0:
            same_bits(branch.trace(), trace)
        rows = _own_part(branch)
        assert [row[0] for row in rows] == trace.t.tolist()
        assert [row[1] for row in rows] == trace.microstep.tolist()
        assert [row[2] for row in rows] == trace.rows.y.tolist()
        assert [list(row[3]) for row in rows] == trace.rows.mode.tolist()
        last = branch.run.recorder.log
        assert [(r[0], r[1], r[2]) for r in last] == [
            (r.t, r.element, r.edge) for r in trace.transitions
        ]


def test_a_long_walk_back_and_forth_on_the_pulled_mass() -> None:
    model, rig = pulled_mass()
    session = Session(model, rig, 60.0)
    forward = [session.here]
    while (here := session.step()).row > forward[-1].row:
        forward.append(here)
    assert [session.at(row) for row in range(len(forward))] == forward
    for expected in reversed(forward[:-1]):
        assert session.back() == expected
    for expected in forward[1:]:
        assert session.step() == expected
    same_bits(session.branch.trace(), simulate(model, rig, 60.0))


def test_transitions_forward_are_those_backward() -> None:
    model, rig = pulled_mass()
    session = Session(model, rig, 60.0)
    forward = []
    while (here := session.next_transition()).microstep > 0:
        forward.append(here)
    assert len(forward) == 72
    backward = []
    while (here := session.prev_transition()).row > 0:
        backward.append(here)
    assert backward == forward[::-1]


@pytest.mark.parametrize("t", [0.0, 1e-9, 4.8, 4.912760672466885, 12.5, 19.99])
def test_goto_is_the_last_row_at_or_before_a_time(t: float) -> None:
    model, rig = pulled_mass()
    session = Session(model, rig, 20.0)
    times = simulate(model, rig, 20.0).t
    row = int(np.searchsorted(times, t, side="right")) - 1
    assert session.goto(t).row == row
    session.goto(20.0)
    assert session.goto(t).row == row
