"""Velocities that an impulse, or a jump of what is given, changes at once: who must react first.

Where a lock makes it matter, the velocities at the end of each arc are kept (`was`), and machines
whose velocities differ from these at the same instant are marked.
"""

from __future__ import annotations

from typing import Any

from integrators.advance import RunPlan, tick_at
from integrators.steps import Now, Vector, time_of

# The marks. LET_GO: what held the velocity does not.
JUMPED, LET_GO = 1, 2
# The kinds of an edge, as bits. The others are asked again after an impulse, or once forces have
# changed. Some wait for their machine's tick, or from EVENT on for an event each.
IMPULSE, CHANGES_FORCES, TICK, EVENT = 1, 2, 4, 8
ALONE = IMPULSE | CHANGES_FORCES
MOST_EVENTS = 27  # that are told apart, since bits are those of a whole number in any language


def only_let_go(located: bool, edges: list[int], jolt: list[int]) -> int:
    """Let locks that were moved let go first; return a machine with no edge it may take, or -1.

    What the others read depends on those. If crossings are not located, marks last for one set.
    """
    moved = marked(jolt, LET_GO)
    refused = -1
    for i in range(len(edges)):
        if moved and jolt[i] != LET_GO:
            edges[i] = -1
        elif edges[i] < -1 or (edges[i] < 0 and jolt[i] == LET_GO):
            refused = i
        if not located and not moved:
            jolt[i] = 0
    return refused


def marked(marks: list[int], mark: int) -> bool:
    """Return whether a machine has a mark."""
    found = False
    for i in range(len(marks)):
        found = found or marks[i] == mark
    return found


def only_new(kinds: list[int], edges: list[int], heard: list[int]) -> None:
    """Drop edges that wait for a tick, or an event, which their machine has answered."""
    for i in range(len(edges)):
        edge = max(edges[i], -2 - edges[i])  # one that is refused, too
        if edge >= 0 and kinds[edge] & heard[i] >= TICK:
            edges[i] = -1


def cut(located: bool, kinds: list[int], edges: list[int], heard: list[int], moved: bool) -> bool:
    """Drop the edges behind one after which all are asked again; return whether all had their turn.

    Whoever had none, as others go first, hears events and its tick once more.
    """
    alone, whole = False, not moved
    for i in range(len(edges)):
        if edges[i] >= 0:
            kind = kinds[edges[i]]
            if alone:
                whole = whole and kind < TICK
                edges[i] = -1
            alone = alone or (located and kind & ALONE > 0)
    for i in range(len(edges)):
        if whole:
            heard[i] = TICK
        elif edges[i] >= 0:
            heard[i] |= kinds[edges[i]]
    return whole


def jolted(switch: Any, now: Now, was: Vector, jolt: list[int], p: Any) -> None:
    """Mark what has just been moved by an impulse or a jump."""
    switch.jolts(time_of(now), now.y, now.mode, p, now.floor, 1, was, jolt)


def arrived(
    switch: Any, plan: RunPlan, now: Now, was: Vector, jolt: list[int], crossed: bool, p: Any
) -> None:
    """Store velocities at the end of an arc; mark those that jump there without an edge."""
    t = time_of(now)
    if plan.leaps and crossed:
        # What is given has its values before the crossing a few ticks earlier.
        before = t - 2.0 * tick_at(t)
        switch.jolts(before, now.y, now.mode, p, now.floor, 0, was, jolt)
        switch.jolts(t, now.y, now.mode, p, now.floor, 1, was, jolt)
    else:
        switch.jolts(t, now.y, now.mode, p, now.floor, 0, was, jolt)
