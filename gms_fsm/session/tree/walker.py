"""Moving the cursor of a branch: by rows, by firings, to a time, or until a condition is true."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator

import numpy as np

from gms_fsm.errors import SessionError, shown
from gms_fsm.session.arguments import check_count
from gms_fsm.session.tree.branch import Branch, BranchRow
from gms_fsm.traces.between import first_true

LOOKS = 16  # points between two rows at which a condition is evaluated


def backward(branch: Branch) -> Iterator[int]:
    """Move back by rows to the start, and yield the number of each row reached."""
    if branch.between is not None:
        branch.between = None
        yield branch.cursor
    while branch.cursor > 0:
        branch.on_row()
        branch.cursor -= 1
        yield branch.cursor


def forward(branch: Branch) -> Iterator[int]:
    """Move forward by rows to the end, and yield the number of each new row."""
    branch.between = None
    while branch.cursor + 1 < len(branch) or branch.pull():
        branch.on_row()
        branch.cursor += 1
        yield branch.cursor


def step(branch: Branch, count: int) -> None:
    """Go forward by rows, or to the end."""
    check_count(count)
    branch.between = None
    for _ in itertools.islice(forward(branch), count):
        pass


def back(branch: Branch, count: int) -> None:
    """Go back by rows; from a located point, the first is the row before it."""
    check_count(count)
    if branch.between is not None and count > 0:
        branch.between, count = None, count - 1
    branch.cursor = max(0, branch.cursor - count)


def next_firing(branch: Branch) -> None:
    """Go forward to the next firing, or the end."""
    for row in forward(branch):
        if branch.raw(row).microstep > 0:
            return


def previous_firing(branch: Branch) -> None:
    """Go back to the previous firing, or the start."""
    row = branch.cursor - (branch.between is None)
    branch.between = None
    while row > 0 and branch.raw(row).microstep == 0:
        row -= 1
    branch.cursor = max(row, 0)


def goto(branch: Branch, t: float) -> None:
    """Go to the last row at or before a time; raise `SessionError` before the start."""
    start = branch.raw(0).t
    if not isinstance(t, float | int | np.number):
        raise SessionError("it must be a number of seconds", place="t", value=t)
    if not t >= start:
        raise SessionError(f"t = {shown(t)} s is before the start, {start!r} s")
    branch.between = None
    while branch.last.t <= t and branch.pull():
        pass
    branch.cursor = branch.row_at(t)


def walk_to(branch: Branch, row: int, t: float | None) -> None:
    """Go to a row, or to a time between it and the next, computing rows as needed."""
    while row + (t is not None) >= len(branch) and branch.pull():
        pass
    branch.cursor = min(row, len(branch) - 1)
    branch.between = None if t is None else branch.behind(branch.cursor)(t)


def reaches(branch: Branch, holds: Callable[[BranchRow], bool]) -> bool:
    """Go forward to the next point where a condition becomes true, located between rows."""
    truth = holds(branch.here)
    begin = None if branch.between is None else branch.between.t  # a second `until` starts there
    while True:
        branch.on_row()
        row = branch.cursor
        if row + 1 >= len(branch) and not branch.pull():
            branch.between = None
            branch.cursor = len(branch) - 1
            return False
        place, truth = _first_true(branch, row, begin, 1, holds, truth)
        begin = None
        branch.between = place
        if place is not None:
            return True
        branch.cursor = row + 1
        now = holds(branch.here)
        if now and not truth:
            return True
        truth = now


def reached(branch: Branch, holds: Callable[[BranchRow], bool]) -> bool:
    """Go back to the last point where a condition was true, located between rows."""
    truth = holds(branch.here)
    begin = None if branch.between is None else branch.between.t
    row = branch.cursor - (begin is None)  # the row before where we are
    while row >= 0:
        branch.on_row()
        place, truth = _first_true(branch, row, begin, -1, holds, truth)
        begin = None
        branch.cursor, branch.between = row, place
        if place is not None:
            return True
        now = holds(branch.here)
        if now and not truth:
            return True
        truth, row = now, row - 1
    branch.cursor, branch.between = 0, None
    return False


def _first_true(
    branch: Branch,
    row: int,
    begin: float | None,
    way: int,
    holds: Callable[[BranchRow], bool],
    truth: bool,
) -> tuple[BranchRow | None, bool]:
    """Search between a row and the next for the first point on the way where a condition is true.

    The way is 1 forward and -1 back. The row at its end is left to the caller. Returns the point,
    and the last truth value.
    """
    before, after = branch.raw(row), branch.raw(row + 1)
    if after.microstep > 0 or branch.start.program.ticks.at(after.t):
        return None, truth  # at a tick values jump: nothing is between the rows
    first, last = (before, after) if way > 0 else (after, before)
    low = start = way * (first.t if begin is None else begin)  # time as it passes on the way
    end = way * last.t
    if end <= start:
        return None, truth
    between = branch.behind(row)

    def place(passed: float) -> BranchRow:
        return between(way * passed)

    for look in range(1, LOOKS + 1):
        at_end = look == LOOKS
        passed = end if at_end else start + (end - start) * look / LOOKS
        now = holds(last if at_end else place(passed))
        if now and not truth:
            found = first_true(low, passed, lambda passed: holds(place(passed)))
            if at_end and found == end:
                break
            return place(found), True
        low, truth = passed, now
    return None, truth
