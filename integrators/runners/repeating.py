"""Runs one system again and again with other numbers, so that no call is needed between two runs.

The block that holds everything is looked at as plain words, too: to begin anew is to copy them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from integrators.loop import DONE, ROWS, Buffers, Machines
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
    columns: list[int]  # its element; -1 for a shared one, -2 for an initial value in that row
    values: list[Vector]  # of each run, then of each number
    end: list[Vector]  # of each run: the time, the state, what is observed
    mode: list[list[int]]  # of each run: the modes of a row
    counts: list[list[int]]  # of each run: the last event, and the number of firings
    # Of rows: places of a value and of what says its slopes, in the state or after it among what
    # is observed; numbers that are moved, with the slope that each says (0: none); where the cells
    # of each pass begin; by how much they are moved; of each run, then of each row, all of them.
    kept: list[int]
    cells: list[list[int]]  # row, column, slope
    passes: list[int]
    steps: Vector
    table: list[Vector]  # empty: of runs the ends


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
            if column < -1:
                now.y[row] = values[j]
            elif column < 0:
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
        if len(repeats.table) > 0:
            log.firings = fired  # of rows no log is kept
            if event == DONE:
                put_slopes(machines, on, b, log, repeats, run * b.out.row)
        end[0] = now.t
        for j in range(size):
            end[1 + j] = now.y[j]
        for k in range(len(log.seen)):
            end[1 + size + k] = log.seen[k]
    return count


def put_slopes(
    machines: Machines, on: Held, b: Buffers, log: LogColumns, repeats: Repeats, first: int
) -> None:
    """Write a value of each row and its slopes: differences, which are exact where it is linear."""
    shared, own, _ = on.functions.p
    cells, steps, size = repeats.cells, repeats.steps, len(b.now.y)
    for k in range(len(cells)):
        row, column = cells[k][0], cells[k][1]
        steps[k] = shared[row] if column < 0 else own[row][column]
        if steps[k] == 0.0:
            steps[k] = 1.0
    for i in range(b.out.row):
        t, y, mode, kept = (
            b.out.rows_t[i],
            b.out.rows_y[i],
            log.rows_mode[i],
            repeats.table[first + i],
        )
        observe_row(machines.observe, on, t, y, mode, log.seen)
        for j in range(len(repeats.kept)):
            place = repeats.kept[j]
            kept[j] = y[place] if place < size else log.seen[place - size]
        for q in range(len(repeats.passes) - 1):
            start, end = repeats.passes[q], repeats.passes[q + 1]
            for k in range(start, end):
                _add(on.functions.p, cells[k], steps[k])
            observe_row(machines.observe, on, t, y, mode, log.seen)
            for k in range(start, end):
                _add(on.functions.p, cells[k], -steps[k])
                j = cells[k][2]
                if j > 0:
                    place = repeats.kept[j]
                    moved = y[place] if place < size else log.seen[place - size]
                    kept[j] = (moved - kept[j]) / steps[k]


def _add(p: Any, cell: list[int], by: float) -> None:
    """Add to a number."""
    shared, own, _ = p
    row, column = cell[0], cell[1]
    if column < 0:
        shared[row] += by
    else:
        own[row][column] += by
