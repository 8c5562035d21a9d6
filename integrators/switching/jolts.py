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


def only_let_go(located: bool, edges: list[int], jolt: list[int]) -> int:
    """Let locks that were moved let go first; return a machine with no edge it may take, or -1.

    What the others read depends on those. If crossings are not located, marks last for one set.
    """
    moved = moves_a_lock(jolt)
    refused = -1
    for i in range(len(edges)):
        if moved and jolt[i] != LET_GO:
            edges[i] = -1
        elif edges[i] < -1 or (edges[i] < 0 and jolt[i] == LET_GO):
            refused = i
        if not located and not moved:
            jolt[i] = 0
    return refused


def moves_a_lock(jolt: list[int]) -> bool:
    """Return whether a lock is to let go."""
    found = False
    for i in range(len(jolt)):
        found = found or jolt[i] == LET_GO
    return found


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


def forget(marks: list[int], none: int) -> None:
    """Set all marks to what stands for none."""
    for i in range(len(marks)):
        marks[i] = none
