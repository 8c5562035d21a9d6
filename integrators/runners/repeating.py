"""Runs one system again and again with other numbers, so that no call is needed between two runs.

The block that holds everything is looked at as plain words, too: to begin anew is to copy them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from integrators.loop import ROWS, Buffers, Machines
from integrators.runners.columns import LogColumns, put_modes
from integrators.runners.observing import observe_row
from integrators.sliding import Functions, Held
from integrators.steps import Vector


class Repeats(NamedTuple):
    """What `repeat` needs besides the arguments of a run."""

    run: Callable[..., int]  # run(words, most_steps, pause): `record` on the block
    follow: Callable[..., float]  # lets everything follow from the numbers, returns the time scale
    words: list[int]  # the block
    floats: Vector  # the same memory
    first: list[int]  # its contents at the beginning
    scale: list[int]  # the word of the time scale
    rows: list[int]  # of each number: its place among the shared ones, or its row
    columns: list[int]  # its element; -1 for a shared one
    values: list[Vector]  # of each run, then of each number
    end: list[Vector]  # of each run: the time, the state, what is observed
    mode: list[list[int]]  # of each run: the modes of a row
    counts: list[list[int]]  # of each run: the last event, and the number of firings


def repeat(
    functions: Functions,
    machines: Machines,
    b: Buffers,
    log: LogColumns,
    more: Any,
    repeats: Repeats,
    start: int,
    count: int,
    most_steps: int,
) -> int:
    """Make runs from a number on; the log keeps growing. Return the first that has no room in it.

    A run that does not reach its end in so many steps is left as it is then.
    """
    now, words, first, size = b.now, repeats.words, repeats.first, len(b.now.y)
    shared, own, _ = functions.p
    on = Held(functions, now.held, b.sliding)
    for run in range(start, count):
        fired = log.firings
        for k in range(len(words)):
            words[k] = first[k]
        log.firings = fired
        values, end, mode = repeats.values[run], repeats.end[run], repeats.mode[run]
        for j in range(len(values)):
            row, column = repeats.rows[j], repeats.columns[j]
            if column < 0:
                shared[row] = values[j]
            else:
                own[row][column] = values[j]
        time = repeats.follow(functions, b, log.seen, b.sliding.live, more)
        repeats.floats[repeats.scale[0]] = time
        event = repeats.run(words, most_steps, False)
        if event == ROWS and log.firings >= len(log.t):
            log.firings = fired
            return run
        repeats.counts[run][0] = event
        repeats.counts[run][1] = log.firings - fired
        put_modes(now.mode, b.sliding.flags, mode)
        observe_row(machines.observe, on, now.t, now.y, mode, log.seen)
        end[0] = now.t
        for j in range(size):
            end[1 + j] = now.y[j]
        for k in range(len(log.seen)):
            end[1 + size + k] = log.seen[k]
    return count
