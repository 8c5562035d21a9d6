"""Observed values of recorded rows: velocities, forces, whatever a system shows of a state.

The modes of a row are those of the machines, then for each surface whether the motion slides on it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from integrators.sliding import LIVE, Functions, Held, Sliding, look
from integrators.steps import Vector


def observe_rows(
    functions: Functions,
    observe: Callable[..., Any],
    held: Vector,
    sliding: Sliding,
    t: Vector,
    y: list[Vector],
    mode: list[list[int]],
    seen: Vector,
    table: list[Vector],
    start: int,
    first: int,
    count: int,
) -> int:
    """Observe many rows, those before `first` excepted, which do not slide."""
    on = Held(functions, held, sliding)
    for row in range(first, count):
        observe_row(observe, on, t[row], y[row], mode[row], seen)
        kept = table[row]
        for k in range(len(kept)):
            kept[k] = seen[start + k]
    if len(sliding.sigma) > 0:
        for row in range(max(first - 1, 0), count - 1):
            if is_turn(sliding, t, mode, row):
                observe_beside(observe, on, t, y, mode, count, row, 1, seen, table, start)
                observe_beside(observe, on, t, y, mode, count, row + 1, -1, seen, table, start)
    return count


def observe_free(
    observe: Callable[..., Any],
    p: Any,
    sliding: Sliding,
    t: Vector,
    y: list[Vector],
    mode: list[list[int]],
    seen: Vector,
    table: list[Vector],
    start: int,
    count: int,
) -> int:
    """Observe the rows before the first that slides on a surface, and return their number."""
    first = 0
    while first < count:
        now, end = mode[first], first + 1
        for k in range(len(now) - len(sliding.flags), len(now)):
            if now[k] != 0:
                return first
        while end < count and are_equal(now, mode[end]):
            end += 1
        observe_alike(observe, p, sliding, t, y, now, seen, table, start, first, end)
        first = end
    return count


def are_equal(one: list[int], other: list[int]) -> bool:
    """Return whether the modes of two rows are the same."""
    differ = 0
    for k in range(len(one)):
        differ |= one[k] ^ other[k]
    return differ == 0


def observe_alike(
    observe: Callable[..., Any],
    p: Any,
    sliding: Sliding,
    t: Vector,
    y: list[Vector],
    mode: list[int],
    seen: Vector,
    table: list[Vector],
    start: int,
    first: int,
    end: int,
) -> None:
    """Observe rows of the same modes; in machine code several side by side."""
    for row in range(first, end):
        observe(t[row], y[row], mode, sliding.live, p, seen)
        kept = table[row]
        for k in range(len(kept)):
            kept[k] = seen[start + k]


def value_rows(
    values: Callable[..., Any],
    p: Any,
    calm: list[int],
    t: Vector,
    y: list[Vector],
    mode: list[list[int]],
    table: list[Vector],
    count: int,
) -> int:
    """Compute what can be read at many rows; no velocity has jumped at any."""
    for row in range(count):
        values(t[row], y[row], mode[row], p, calm, table[row])
    return count


def observe_row(
    observe: Callable[..., Any], on: Held, t: float, y: Vector, mode: list[int], out: Vector
) -> None:
    """Observe one row: with live signs, but with sigmas on the surfaces that it slides on."""
    sliding = on.sliding
    n, slid = len(mode) - len(sliding.flags), 0
    for k in range(len(sliding.flags)):
        if mode[n + k] != 0:
            sliding.which[slid] = k
            slid += 1
    sliding.count = slid
    if len(sliding.flags) > 0 and slid > 0:
        look(observe, on, t, y, mode, out)
    else:
        observe(t, y, mode, sliding.live, on.functions.p, out)


def is_turn(sliding: Sliding, t: Vector, mode: list[list[int]], row: int) -> bool:
    """Return whether a slide begins or ends between a row and the next one, at the same time."""
    if t[row + 1] != t[row]:
        return False
    n, turns = len(mode[row]) - len(sliding.flags), False
    for k in range(len(sliding.flags)):
        turns = turns or mode[row][n + k] != mode[row + 1][n + k]
    return turns


def observe_beside(
    observe: Callable[..., Any],
    on: Held,
    t: Vector,
    y: list[Vector],
    mode: list[list[int]],
    count: int,
    row: int,
    side: int,
    seen: Vector,
    table: list[Vector],
    start: int,
) -> None:
    """Observe a row next to a slide with the signs held by the arc it belongs to.

    Such a row lies on the surface or a rounding error past it, so the sign computed from the state
    is not the held one: before a slide it is that of the preceding arc, after it that of the
    following arc. Where an edge fires at the same time, the row belongs to no arc, and is what the
    log has for that edge.
    """
    sliding, other = on.sliding, row - side
    if other < 0 or other >= count or t[other] == t[row]:
        return
    now, beside = mode[row], mode[row + side]
    n, changed = len(now) - len(sliding.flags), 0
    for k in range(len(sliding.flags)):
        if now[n + k] != 0:
            return
        if beside[n + k] != 0 and sliding.surfaces.machine[k] < 0:  # of machines the modes say it
            changed += 1
    if changed == 0:
        return
    p, signs = on.functions.p, sliding.live
    for place in range(len(on.held)):
        on.held[place] = 0.0
    on.functions.arm(t[other], y[other], now, p, on.held, sliding.watch)
    for k in range(len(sliding.flags)):
        place = sliding.surfaces.sign[k]
        if beside[n + k] != 0 and sliding.surfaces.machine[k] < 0 and on.held[place] != 0.0:
            signs[place] = on.held[place]
    observe(t[row], y[row], now, signs, p, seen)
    for k in range(len(sliding.flags)):
        if sliding.surfaces.machine[k] < 0:
            signs[sliding.surfaces.sign[k]] = LIVE
    kept = table[row]
    for k in range(len(kept)):
        kept[k] = seen[start + k]
