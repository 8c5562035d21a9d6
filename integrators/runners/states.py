"""The state of a run between two events: what is stored, and put back to resume bit for bit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from integrators.loop import Buffers, Memory
from integrators.machine_code.records import arrays_of, numbers_in, numbers_of, put_numbers
from integrators.steps import Now, Vector

# Numbers of the loop's state, in the order in which files and arrays have them.
CLOCK, COUNTS = tuple(numbers_of(Now)), tuple(numbers_of(Memory))
CURSOR = ("row", "next_time", "next_knot", "steps")


def state_of(b: Buffers) -> dict[str, Any]:
    """Return what makes up a run's state: numbers, and the lists (or arrays) themselves."""
    now, memory, w, s = b.now, b.memory, b.relations, b.sliding
    return {
        "clock": numbers_in(now, CLOCK),
        **{name: getattr(now, name) for name in arrays_of(Now)},
        "counts": numbers_in(memory, COUNTS),
        **{name: getattr(memory, name) for name in arrays_of(Memory)},
        "watch": w.watch,
        "room": w.room,
        "truth": w.truth,
        "start": w.start,
        "above": w.above,
        "cursor": numbers_in(b.out, CURSOR),
        "slid": s.flags,
        "arrived": s.arrived,
        "which": [*s.which, s.count],
    }


def put_state(b: Buffers, state: Mapping[str, Sequence[Any]]) -> None:
    """Return to a state, or to parts of it."""
    for name, place in state_of(b).items():
        if name in state:
            match name:
                case "clock":
                    put_numbers(b.now, CLOCK, state[name])
                case "counts":
                    put_numbers(b.memory, COUNTS, state[name])
                case "cursor":
                    put_numbers(b.out, CURSOR, state[name])
                case "which":
                    *b.sliding.which[:], b.sliding.count = state[name]
                case _:
                    place[:] = state[name]


def beginning(t: float, t_end: float) -> dict[str, float]:
    """Return the numbers of `Now` for a run that has not started."""
    return {
        "t": t,
        "h": 0.0,
        "error_before": 1.0,
        "t_stop": t_end,
        "anchor": t,
        "switched": -math.inf,
        "pause": math.inf,
        "latest": abs(t_end),
        "seen": math.inf,
    }


def begin(
    b: Buffers, t: float, y: Sequence[float], mode: Sequence[int], t_end: float, floor: Vector
) -> None:
    """Put the start of a run into buffers, which are otherwise as they were at the beginning."""
    begun = beginning(t, t_end)
    put_numbers(b.now, begun.keys(), begun.values())
    b.now.y[:], b.now.mode[:], b.memory.anchor[:] = y, mode, y
    b.now.floor[:] = floor
