"""Runs a system and writes all events into columns: what the compiled engine does.

Everything is in arrays, so that the whole function can be machine code.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from integrators.advance import Output, put_row
from integrators.loop import (
    ARC,
    DONE,
    FIRED,
    FIRING,
    ROWS,
    SLID,
    STOPPED,
    Buffers,
    Machines,
    Memory,
    run_to_event,
)
from integrators.sliding import Functions, Held, flow_on, follow_on, look, margins_on
from integrators.steps import ArcMotion, Now, Vector


class Recorded(NamedTuple):
    """Where the numbers are that a log stores for each machine."""

    own: list[int]  # place in y of its own variable, -1 if it has none
    seen: list[list[int]]  # three places among what is observed; the third is read after, too


class RowTally(NamedTuple):
    """Counts of rows, in place of the rows themselves; without places nothing is counted."""

    count: Callable[..., Any]  # count(t, y, mode, p, counts, near)
    counts: list[int]
    near: Vector


def counts_nothing(
    t: float, y: Vector, mode: list[int], p: Any, counts: list[int], near: Vector
) -> None:
    """Count no row."""


@dataclass(slots=True, eq=False)
class LogColumns:
    """Columns that `record` fills: one entry per firing, and both sides of every stop."""

    firings: int
    stops: int
    t: Vector
    machine: list[int]
    edge: list[int]
    numbers: list[Vector]  # [own variable, the three of `Recorded.seen`, the third after]
    seen: Vector  # scratch space for `observe`
    rows_microstep: list[int]  # alongside the rows of Output
    rows_mode: list[list[int]]  # of each machine, then for each surface whether it slides
    stops_t: Vector
    stops_microstep: list[int]
    stops_y: list[Vector]
    stops_mode: list[list[int]]


def record(
    functions: Functions,
    machines: Machines,
    b: Buffers,
    log: LogColumns,
    recorded: Recorded,
    tally: RowTally,
    most_steps: int,
    pause: bool,
) -> int:
    """Run and write all events into columns, until they are full or the run has ended."""
    observe, now = machines.observe, b.now
    memory, out, p = b.memory, b.out, functions.p
    counting, last = len(tally.counts) > 0, b.out.steps + most_steps
    seen_at = float("nan")  # the time at which log.seen was computed
    on = Held(functions, now.held, b.sliding)
    motion = ArcMotion(flow_on, margins_on, on, follow_on, machines.moved)
    left, room = most_steps, True
    while True:
        left -= 1
        if left < 0 or not room or _is_full(out, log):
            return ROWS
        event = run_to_event(functions, machines, motion, b, most_steps)
        room = machines.noted(event, on, b)
        t = min(now.t, now.seen)
        if event == ROWS:
            if counting:
                _count(out, memory, now.mode, tally, p)
            for row in range(memory.taken, out.row):
                log.rows_microstep[row] = 0
                put_modes(now.mode, b.sliding.flags, log.rows_mode[row])
            memory.taken = out.row
            if memory.phase == ARC and (not counting or out.steps >= last):
                return ROWS
        elif event == FIRING:
            if seen_at != t:
                look(observe, on, t, now.y, now.mode, log.seen)
            _put_firing(now, memory, log, recorded)
            if pause:
                return FIRING
        elif event == FIRED:
            look(observe, on, t, now.y, now.mode, log.seen)
            seen_at = t
            log.numbers[log.firings][4] = log.seen[recorded.seen[memory.machine][2]]
            log.firings += 1
        elif event == SLID:
            seen_at = float("nan")
        elif event not in (STOPPED, DONE):
            return event
        if event not in (ROWS, FIRING):
            switched = event in (FIRED, SLID)
            _put_stop(now, memory, out, b.sliding.flags, log, switched)
            if counting and switched:
                _count(out, memory, now.mode, tally, p)
        if event == DONE:
            return DONE


def _count(out: Output, memory: Memory, mode: list[int], tally: RowTally, p: Any) -> None:
    """Count the rows since the last event, all in the same modes, and forget them."""
    for row in range(out.row):
        tally.count(out.rows_t[row], out.rows_y[row], mode, p, tally.counts, tally.near)
    out.row = 0
    memory.taken = 0


def _is_full(out: Output, log: LogColumns) -> bool:
    """Return whether a column has no room for the next event."""
    if out.every_step and out.row + 1 >= len(out.rows_t):
        return True
    if log.firings >= len(log.t):
        return True
    return 0 < len(log.stops_t) <= log.stops


def _put_firing(now: Now, memory: Memory, log: LogColumns, recorded: Recorded) -> None:
    """Write the values known before a firing."""
    i, row = memory.machine, log.firings
    numbers = log.numbers[row]
    log.t[row] = now.t
    log.machine[row] = i
    log.edge[row] = memory.edge
    own, seen = recorded.own[i], recorded.seen[i]
    numbers[0] = now.y[own] if own >= 0 else float("nan")
    numbers[1] = log.seen[seen[0]]
    numbers[2] = log.seen[seen[1]]
    numbers[3] = log.seen[seen[2]]


def _put_stop(
    now: Now, memory: Memory, out: Output, flags: list[int], log: LogColumns, switched: bool
) -> None:
    """Write the state and the modes from here on."""
    t = now.t if switched else min(now.t, now.seen)
    if out.every_step and switched:
        row = out.row
        put_row(out, t, now.y)
        log.rows_microstep[row] = memory.microstep
        put_modes(now.mode, flags, log.rows_mode[row])
        memory.taken = out.row
    if len(log.stops_t) > 0:
        row = log.stops
        log.stops_t[row] = t
        log.stops_microstep[row] = memory.microstep if switched else 0
        for j in range(len(now.y)):
            log.stops_y[row][j] = now.y[j]
        put_modes(now.mode, flags, log.stops_mode[row])
        log.stops += 1


def put_modes(mode: list[int], flags: list[int], place: list[int]) -> None:
    """Write the modes of a row: of the machines, then of the surfaces."""
    n = len(mode)
    for i in range(n):
        place[i] = mode[i]
    for k in range(len(flags)):
        place[n + k] = flags[k]
