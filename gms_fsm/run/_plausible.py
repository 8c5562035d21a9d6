"""Whether numbers from outside can be the state of a loop: machine code uses them as addresses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.run.start import Start
from integrators import FOR_A_GUARD, FOR_A_SIGN, WAITING, hybrid, loop
from integrators.advance import NEXT_KNOT, NEXT_TIME
from integrators.steps import T

__all__ = ["check_ranges", "check_state", "last_edges", "last_states"]


def last_states(start: Start) -> NDArray[np.int64]:
    """Return of each machine the number of its last state."""
    return np.array([len(chart.states) - 1 for chart in _charts(start)])


def last_edges(start: Start) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return of each machine its first and its last edge, which are counted over all contacts."""
    banks = start.program.layout.banks
    first = np.array([bank.first_edge for bank in banks for _ in range(bank.n)])
    return first, first + [len(chart.transitions) - 1 for chart in _charts(start)]


def _charts(start: Start) -> list[Any]:
    contacts = {each.name: each for each in start.system.contacts}
    return [contacts[b.name].chart for b in start.program.layout.banks for _ in range(b.n)]


def check_state(
    start: Start, b: hybrid.Buffers, state: Mapping[str, Any], t_end: float = np.inf
) -> None:
    """Raise a ValueError unless a run like this one can have reached such a state.

    Parameters
    ----------
    start : Start
        The run.
    b : Buffers
        Its buffers.
    state : mapping of str to ndarray
        As `integrators.hybrid.state_of`.
    t_end : float
        s: the end of the run.

    Raises
    ------
    ValueError
        Naming what is not plausible.
    """
    first_edge, last_edge = last_edges(start)
    n, counts = len(b.now.mode), state["counts"]
    machine = 0 if counts[loop.PHASE] == loop.FIRE else -1
    enabled = np.asarray(state["edges"]) >= 0
    fired = 0, max(0, last_edge.max())
    if machine == 0 and 0 <= counts[loop.MACHINE] < n:
        fired = first_edge[counts[loop.MACHINE]], last_edge[counts[loop.MACHINE]]
    check_ranges(
        {
            "time": (state["clock"][T], start.t_start, t_end),
            "mode": (state["mode"], 0, last_states(start)),
            "edges": (state["edges"], -1, last_edge),
            "enabled edges": (state["edges"][enabled], first_edge[enabled], last_edge[enabled]),
            "room": (state["room"], 0, len(b.relations.watch) - 1),
            "watch": (state["watch"], 0, FOR_A_SIGN | FOR_A_GUARD | WAITING),
            "due": (state["due"], 0, 1),
            "held": (counts[loop.HOLD], 0, sum({*start.program.discrete})),
            "phase": (counts[loop.PHASE], loop.START, loop.END),
            "machine": (counts[loop.MACHINE], machine, n - 1),
            "edge": (counts[loop.EDGE], *fired),
            "jump": (counts[loop.JUMP], 0, len(b.plan.jumps)),
            "active relations": (counts[loop.ACTIVE], 0, len(b.relations.watch)),
            "wanted time": (state["cursor"][NEXT_TIME], 0, len(b.out.times)),
            "knot": (state["cursor"][NEXT_KNOT], 0, len(b.plan.knots)),
            "surfaces": (state["which"][:-1], 0, max(0, start.program.layout.surfaces - 1)),
            "surfaces slid on": (state["which"][-1], 0, len(b.sliding.sigma)),
            "slid": (state["slid"], 0, 1),
            "arrived": (state["arrived"], 0, 1),
        }
    )


def check_ranges(ranges: Mapping[str, tuple[Any, Any, Any]]) -> None:
    """Raise a ValueError unless all numbers are within their ranges.

    Parameters
    ----------
    ranges : mapping of str to (found, least, most)
        Numbers or arrays.

    Raises
    ------
    ValueError
        Naming the first one that is not.
    """
    for name, (found, least, most) in ranges.items():
        if not np.all((np.asarray(found) >= least) & (np.asarray(found) <= most)):
            raise ValueError(f"{name}: not within {least} to {most}")
