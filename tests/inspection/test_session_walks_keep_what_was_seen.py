"""Rows that were seen stay, parents never change, and each branch is a run of its own.

Random walks of step, back, next, prev, goto, until (both ways), switch and poke on random small
models.
"""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gms_fsm import GMS, Trace, simulate
from gms_fsm.session.session import Session
from gms_fsm.systems.rigs import Rig
from gms_fsm.traces.failures import SimulationError
from tests.helpers import same_bits
from tests.strategies import banks, moves, options, rigs

T_END = 4.0


def poked(session: Session, z: float, state: str | None) -> dict[str, Any]:
    """Poke element 1; return the initial values of an equivalent separate run."""
    here = session.here
    initial: dict[str, Any] = {"x": here.x, "z": [z, *here.z[1:]], "states": list(here.states)}
    if session.rig.acceleration is not None:
        initial["v"] = here.v
    if state is not None:
        initial["states"][0] = state
    session.poke({"z": {0: z}}, state={} if state is None else {0: state})
    return {"t_start": here.t, "initial": initial}


def outcome(model: GMS, rig: Rig, how: dict[str, Any]) -> tuple[Trace, str | None]:
    try:
        return simulate(model, rig, T_END, **how), None
    except SimulationError as error:  # a livelock is an outcome too
        return error.trace, str(error)


@pytest.mark.slow
@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(banks(), rigs(), options(), st.lists(moves(T_END), min_size=1, max_size=25))
def test_random_walks(
    model: GMS, rig: Rig, how: dict[str, Any], walk: list[tuple[str, Any]]
) -> None:
    session = Session(model, rig, T_END, **how)
    seen: list[list[Any]] = [[]]  # of each branch, its rows when they were first seen
    alone: list[dict[str, Any]] = [{}]  # what simulate() needs for a branch
    step = {
        "step": session.step,
        "back": session.back,
        "next": lambda _: session.next_transition(),
        "prev": lambda _: session.prev_transition(),
        "goto": session.goto,
        "until": session.until,
        "last": lambda condition: session.until(condition, back=True),
        "switch": lambda number: session.switch(number % len(session.branches)),
    }
    for move, given_ in walk:
        if move != "poke":
            step[move](given_)
        elif session.here.t < T_END and len(session.branches) < 4:
            alone.append(poked(session, *given_))
            seen.append([])
        for branch, rows in zip(session.branches, seen, strict=True):
            assert [branch.raw(row) for row in range(len(rows))] == rows
            rows += [branch.raw(row) for row in range(len(rows), len(branch))]
    for number, branch in enumerate(session.branches):
        session.switch(number)
        session.goto(T_END)
        trace, said = outcome(model, rig, how | alone[number])
        assert branch.ended == (said is None)
        assert branch.failure is None or str(branch.failure) == said
        if number == 0:
            same_bits(branch.trace(), trace)
        own = len(branch) - len(branch.run.recorder.rows.t)
        rows = [branch.raw(row) for row in range(own, len(branch))]
        assert [[row[0], row[1], row[2], list(row[3])] for row in rows] == [
            list(row)
            for row in zip(
                trace.t.tolist(),
                trace.microstep.tolist(),
                trace.rows.y.tolist(),
                trace.rows.mode.tolist(),
                strict=True,
            )
        ]
        assert [(r[0], r[1], r[2]) for r in branch.run.recorder.log] == [
            (r.t, r.element, r.edge) for r in trace.transitions
        ]
