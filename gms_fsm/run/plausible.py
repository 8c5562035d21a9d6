"""Whether numbers from outside can be the state of a loop: machine code uses them as addresses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.run.problem import Problem
from integrators import FOR_A_GUARD, FOR_A_SIGN, LET_GO, WAITING, hybrid, loop
from integrators.runners import states
from integrators.switching.jolts import EVENT, MOST_EVENTS


def last_states(start: Problem) -> NDArray[np.int64]:
    """Return of each machine the number of its last state."""
    return np.array([len(chart.states) - 1 for chart in _charts(start)])


def last_edges(start: Problem) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return of each machine its first and its last edge, which are counted over all contacts."""
    banks = start.program.layout.banks
    first = np.array([bank.first_edge for bank in banks for _ in range(bank.n)])
    return first, first + [len(chart.transitions) - 1 for chart in _charts(start)]


def _charts(start: Problem) -> list[Any]:
    contacts = {each.name: each for each in start.system.machines}
    return [contacts[b.name].chart for b in start.program.layout.banks for _ in range(b.n)]


Bounds = tuple[Any, Any]  # the least and the largest value, numbers or arrays


def bounds_of(start: Problem, b: hybrid.Buffers, t_end: float = np.inf) -> dict[str, Bounds]:
    """Return between which values the state of a run is."""
    _, last_edge = last_edges(start)
    n, relations = len(b.now.mode), len(b.relations.watch)
    slid = len(b.sliding.sigma)
    most_surfaces = [max(0, start.program.layout.surfaces - 1)] * slid
    return {
        "clock": _bounds(states.CLOCK, t=(start.t_start, t_end)),
        "mode": (0, last_states(start)),
        "edges": (-1, last_edge),
        "room": (0, relations - 1),
        "watch": (0, FOR_A_SIGN | FOR_A_GUARD | WAITING),
        "truth": (0, 1),
        "heard": (0, (EVENT << MOST_EVENTS) - 1),
        "jolt": (0, LET_GO),
        "counts": _bounds(
            states.COUNTS,
            hold=(0, sum({*start.program.discrete})),
            phase=(loop.START, loop.END),
            machine=(-1, n - 1),
            edge=(0, max(0, last_edge.max())),
            jump=(0, len(b.plan.jumps)),
            active=(0, relations),
        ),
        "cursor": _bounds(
            states.CURSOR, next_time=(0, len(b.out.times)), next_knot=(0, len(b.plan.knots))
        ),
        "which": (0, np.array([*most_surfaces, slid])),
        "slid": (0, 1),
        "arrived": (-1, 1),
    }


def _bounds(names: Sequence[str], **bounds: Bounds) -> Bounds:
    """Return the bounds of numbers with names; most may have any value."""
    found = np.array([bounds.get(name, (-np.inf, np.inf)) for name in names])
    return found[:, 0], found[:, 1]


def check_state(start: Problem, b: hybrid.Buffers, state: Mapping[str, Any], t_end: float) -> None:
    """Raise a ValueError unless a run like this one can have reached such a state."""
    check_ranges({name: (state[name], *u) for name, u in bounds_of(start, b, t_end).items()})
    first_edge, last_edge = last_edges(start)
    counts = dict(zip(states.COUNTS, state["counts"], strict=True))
    enabled = np.asarray(state["edges"]) >= 0
    edges = state["edges"][enabled], first_edge[enabled], last_edge[enabled]
    more: dict[str, tuple[Any, Any, Any]] = {"enabled edges": edges}
    if counts["phase"] == loop.FIRE:
        machine = counts["machine"]
        more["machine"] = machine, 0, len(b.now.mode) - 1
        if machine >= 0:
            more["edge"] = counts["edge"], first_edge[machine], last_edge[machine]
    check_ranges(more)


def check_ranges(ranges: Mapping[str, tuple[Any, Any, Any]]) -> None:
    """Raise a ValueError unless all numbers are within their ranges."""
    for name, (found, least, most) in ranges.items():
        if not np.all((np.asarray(found) >= least) & (np.asarray(found) <= most)):
            raise ValueError(f"{name}: not within {least} to {most}")
