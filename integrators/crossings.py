"""Locating the first point in a step where a watched relation changes its truth value.

A relation is a margin that is true where positive (or, if not strict, where zero). Its truth value
at the start of the arc is stored; a crossing is the first point where any watched value differs.
The point is bracketed until both ends are one clock tick apart, and the *right* end is returned:
there the raw comparison has changed, so the caller can simply evaluate it. The interval is
half-open on the left: a margin that starts at zero does not fire again.

Before a point is accepted as the first one, the step up to it is searched for a change that is
undone again: an interval counts as quiet only if start, middle and end show each margin to be
monotone, or farther from a change than `WARY` times the curvature they show could carry it;
otherwise it is halved.

Alternatives considered: a root finder on the margin stops at a point where the comparison is not
yet true (margin -5e-17); a bracket by sign fails if the arc starts on the zero; searching one
relation after another misses one that becomes true and false again before the first of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from integrators.step_size import INFINITY
from integrators.steps import ArcMotion, Now, Scratch, Vector

__all__ = [
    "DEEPEST",
    "FOR_A_GUARD",
    "FOR_A_SIGN",
    "NO_CHANGE",
    "Path",
    "Search",
    "Watched",
    "any_changed",
    "first_change",
    "is_quiet_step",
    "listed",
    "longest_next",
    "watched",
]

NO_CHANGE = 2.0
# A margin with a narrow hump between two of the points has more curvature than they show.
WARY = 4.0
# Why a relation is watched, as bits: a sign is held; it keeps a guard false; and this guard can
# change while nothing moves.
FOR_A_SIGN, FOR_A_GUARD, WAITING = 1, 2, 4
# Bend of a margin over a step, as a share of its size, that limits the step's growth where nothing
# else does. A sine is then sampled every 2 radians or more often.
MOST_BENT = 0.1
# A margin above this is not below zero: there is no number between them. So one comparison decides.
JUST_BELOW = -5e-324
DEEPEST = 8  # halvings of a step: windows down to 1/256 of it are found
# Where more relations are watched, they change one soon after another: steps are aimed at the next
# change.
MANY = 500
AIMED = 1.05  # of the time to the next change


class Search(NamedTuple):
    """Scratch for margins on the way to a crossing."""

    low: Vector  # margins at the left end of the bracket, shape (r,)
    high: Vector  # ... at its right end
    probe: Vector  # ... at the point under test
    y_probe: Vector  # the state there, shape (m,)
    rights: list[Vector]  # margins at right ends of intervals to search, shape (DEEPEST + 1, r)
    places: Vector  # positions of these right ends, shape (DEEPEST + 1,)
    depths: list[int]  # how often they were halved, shape (DEEPEST + 1,)
    few: list[int]  # space for the indices of those that have changed, shape (r,)


class Watched(NamedTuple):
    """The relations watched during an arc."""

    watch: list[int]  # why each relation is watched, 0 if it is not, shape (r,)
    room: list[int]  # space for the indices of the flagged ones, shape (r,)
    active: list[int]  # those indices
    truth: list[bool]  # truth values at the arc's start, shape (r,)
    changed: list[int]  # whether the value was different where the arc ended, shape (r,)
    above: Vector  # true where the margin is above this, shape (r,); see JUST_BELOW
    start: Vector  # margins at the step's start, shape (r,)
    end: Vector  # ... at its end
    search: Search


class Path(NamedTuple):
    """The last step in the form that the search uses."""

    motion: ArcMotion
    mode: list[int]
    interpolate: Callable[..., Any]  # interpolate(dense, theta, out) -> None, fills out
    dense: Any
    t: float
    t_new: float
    seen: float  # the time at which its end is seen: t_new, or one clock tick before a jump there


def watched(strict: list[bool], size: int) -> Watched:
    """Return storage for watching relations, with none of them flagged yet.

    Parameters
    ----------
    strict : list of bool, shape (r,)
        For each relation, whether it is false at zero.
    size : int
        Length of the state vector.

    Returns
    -------
    Watched
        With scratch space for all of them.
    """
    r = len(strict)

    def vector() -> Vector:
        return [0.0] * r

    search = Search(
        low=vector(),
        high=vector(),
        probe=vector(),
        y_probe=[0.0] * size,
        rights=[vector() for _ in range(DEEPEST + 1)],
        places=[0.0] * (DEEPEST + 1),
        depths=[0] * (DEEPEST + 1),
        few=[0] * r,
    )
    above = [0.0 if each else JUST_BELOW for each in strict]
    return Watched([0] * r, [0] * r, [], [False] * r, [0] * r, above, vector(), vector(), search)


def listed(w: Watched, count: int) -> Watched:
    """Return the relations with the first `count` indices in `room` as the active ones."""
    return Watched(
        w.watch, w.room, w.room[:count], w.truth, w.changed, w.above, w.start, w.end, w.search
    )


def any_changed(w: Watched, margin: Vector) -> bool:
    """Return whether any watched relation differs from its truth value at the arc's start.

    Parameters
    ----------
    w : Watched
        The relations and their truth values at the start.
    margin : list of float, shape (r,)
        Current margins; only the active ones are read.

    Returns
    -------
    bool
        True at the first difference.
    """
    truth, above = w.truth, w.above
    for r in w.active:
        g = margin[r]
        if (g > above[r]) != truth[r]:
            return True
    return False


def copy_margins(w: Watched, source: Vector, target: Vector) -> None:
    """Copy the active margins."""
    for r in w.active:
        target[r] = source[r]


def is_quiet_step(motion: ArcMotion, now: Now, t_new: float, scratch: Scratch, w: Watched) -> bool:
    """Return whether a whole step is quiet: most are, and then no dense output is needed.

    Expects ``w.start`` to contain the margins at its start; fills ``w.end`` with those at its end.
    The midpoint is taken from the cubic through both ends and both slopes.

    Parameters
    ----------
    motion : ArcMotion
        ``margins(t, y, mode, p, watch, out)`` fills the margins.
    now : Now
        The step's start.
    t_new : float
        Its end.
    scratch : Scratch
        State and slope there.
    w : Watched
        The relations.

    Returns
    -------
    bool
        False if `first_change` must search.
    """
    margins, p, mode = motion.margins, motion.p, now.mode
    t, y, f = now.t, now.y, now.f
    y_new, f_new = scratch.y_new, scratch.f_new
    middle, probe = w.search.y_probe, w.search.probe
    seen = now.seen
    margins(min(t_new, seen), y_new, mode, p, w.watch, w.end)
    h = t_new - t
    for j in range(len(y)):
        middle[j] = 0.5 * (y[j] + y_new[j]) + 0.125 * h * (f[j] - f_new[j])
    margins(min(t + 0.5 * h, seen), middle, mode, p, w.watch, probe)
    return _is_quiet(w, w.start, probe, w.end)


def steps_to_change(w: Watched, after: Vector) -> float:
    """Return when the first relation changes if margins go on as from the start to `after`."""
    first = INFINITY
    for r in w.active:
        left, gone = w.start[r], w.start[r] - after[r]
        if gone < 0.0:
            left, gone = -left, -gone
        if 0.0 < left < first * gone:  # to divide takes long, and is seldom wanted
            first = left / gone
    return first


def aimed_step(motion: ArcMotion, now: Now, h: float, w: Watched) -> float:
    """Return a first step to just beyond the next change, as far as slopes at the start tell."""
    y, f, place, probe = now.y, now.f, w.search.y_probe, w.search.probe
    for j in range(len(y)):
        place[j] = y[j] + h * f[j]
    motion.margins(min(now.t + h, now.seen), place, now.mode, motion.p, w.watch, probe)
    return AIMED * h * steps_to_change(w, probe)


def longest_next(motion: ArcMotion, now: Now, t_new: float, scratch: Scratch, w: Watched) -> float:
    """Return how long the next step may be, from how waiting margins bend in this one.

    Where nothing moves, the error of a step is zero, and steps would grow over whole periods of
    what depends on time alone, such as the load of a body that is held. The quarter point is there
    because a sine does not bend where it is steepest.

    Parameters
    ----------
    motion, now, t_new, scratch, w
        As in `is_quiet_step`, which has been called before.

    Returns
    -------
    float
        At least this step's length, since a margin that starts at zero bends by as much as it
        grows; infinity if no relation waits.
    """
    longest = INFINITY
    if any_changed(w, w.end):  # the step ends earlier
        return longest
    y, f, y_new, f_new = now.y, now.f, scratch.y_new, scratch.f_new
    place, quarter, middle = w.search.y_probe, w.search.low, w.search.probe
    h = t_new - now.t
    for j in range(len(y)):  # of the same cubic
        place[j] = 0.84375 * y[j] + 0.15625 * y_new[j] + h * (0.140625 * f[j] - 0.046875 * f_new[j])
    motion.margins(now.t + 0.25 * h, place, now.mode, motion.p, w.watch, quarter)
    for r in w.active:
        if w.watch[r] & WAITING:
            a, q, m, b = w.start[r], quarter[r], middle[r], w.end[r]
            size = max(abs(a), abs(m), abs(b))
            bend = max(abs((b - m) - (m - a)), 4.0 * abs((m - q) - (q - a)))
            if bend > 1e-9 * size:  # not just rounding
                longest = min(longest, h * math.sqrt(MOST_BENT * size / bend))
    return max(longest, h)


def first_change(path: Path, w: Watched, resolution: float) -> float:
    """Return the fraction of the step at which a watched truth value first differs.

    Expects ``w.start`` and ``w.end`` to contain the margins at its start and its end.

    Parameters
    ----------
    path : Path
        The step.
    w : Watched
        The relations.
    resolution : float
        The width of the bracket, in time, at which the search ends.

    Returns
    -------
    float
        In (0, 1], or `NO_CHANGE`.
    """
    search = w.search
    found = NO_CHANGE
    low, high = 0.0, 1.0
    quiet = 1.0  # the step up to this point must be searched; its margins are in rights[0]
    if any_changed(w, w.end):
        quiet, found = _close(path, low, high, w.start, w.end, w, resolution)
    else:
        copy_margins(w, w.end, search.rights[0])
    while quiet > 0.0:
        low, high = _search(path, quiet, w)
        if high == NO_CHANGE:
            break
        quiet, found = _close(path, low, high, search.low, search.high, w, resolution)
    return found


def _probe(path: Path, place: float, w: Watched) -> bool:
    """Fill the margins at a point; return whether any has changed there."""
    motion, search = path.motion, w.search
    path.interpolate(path.dense, place, search.y_probe)
    t = min(path.t + place * (path.t_new - path.t), path.seen)
    motion.margins(t, search.y_probe, path.mode, motion.p, w.watch, search.probe)
    return any_changed(w, search.probe)


def _close(
    path: Path,
    low: float,
    high: float,
    left: Vector,
    right: Vector,
    w: Watched,
    resolution: float,
) -> tuple[float, float]:
    """Close the bracket (low unchanged, high changed), given the margins at both.

    Leaves the margins at the point before the change in ``search.rights[0]``, for `_search`.
    """
    if len(w.truth) > MANY and len(w.active) > MANY:
        return _close_few(path, low, high, left, right, w, resolution)
    search = w.search
    copy_margins(w, left, search.low)
    copy_margins(w, right, search.high)
    low, high = _bracket(path, low, high, w, resolution)
    copy_margins(w, search.low, search.rights[0])
    return low, high


def _close_few(
    path: Path,
    low: float,
    high: float,
    left: Vector,
    right: Vector,
    w: Watched,
    resolution: float,
) -> tuple[float, float]:
    """Do the same while looking only at relations that have changed."""
    search = w.search
    while True:
        few = _changed(w, right)
        copy_margins(few, left, search.low)
        copy_margins(few, right, search.high)
        low, high = _bracket(path, low, high, few, resolution)
        if low <= 0.0 or not _probe(path, low, w):
            copy_margins(w, search.probe, search.rights[0])
            return low, high
        low, high, left, right = 0.0, low, w.start, search.probe


def _changed(w: Watched, margin: Vector) -> Watched:
    """Return the relations that have changed as the only active ones."""
    flags, few = w.changed, w.search.few
    for r in range(len(flags)):
        flags[r] = 0
    count = 0
    for r in w.active:
        if (margin[r] > w.above[r]) != w.truth[r]:
            flags[r] = 1
            few[count] = r
            count += 1
    return Watched(flags, few, few[:count], w.truth, flags, w.above, w.start, w.end, w.search)


def _bracket(
    path: Path, low: float, high: float, w: Watched, resolution: float
) -> tuple[float, float]:
    """Close the bracket (low unchanged, high changed; margins in search.low, search.high)."""
    search = w.search
    tolerance = max(resolution / (path.t_new - path.t), 4e-16)
    missed, rising = 0, False
    while high - low > tolerance:
        guess = 0.5 * (low + high)
        if missed < 2:
            guess = high
            for r in w.active:
                b = search.high[r]
                if (b > w.above[r]) != w.truth[r]:
                    a = search.low[r]
                    if a != b:
                        guess = min(guess, low + (high - low) * (a / (a - b)))
            if missed == 1:  # lines meet zero on one side again and again; twice as far is beyond
                guess = 2.0 * guess - (low if rising else high)
            # Half a tick inside the bracket, so that the last evaluation closes it.
            guess = min(max(guess, low + 0.5 * tolerance), high - 0.5 * tolerance)
        width = high - low
        rising = not _probe(path, guess, w)
        if rising:
            low = guess
            copy_margins(w, search.probe, search.low)
        else:
            high = guess
            copy_margins(w, search.probe, search.high)
        if missed == 2:  # halved; where slopes have misled, every other guess is theirs
            missed = 1
        else:
            missed = missed + 1 if high - low > 0.5 * width else 0
    return low, high


def _search(path: Path, quiet: float, w: Watched) -> tuple[float, float]:
    """Search [0, quiet], unchanged at both ends, for a change inside.

    Returns an unchanged point and a changed one right of it, with their margins in search.low and
    search.high, or `NO_CHANGE`.
    """
    search = w.search
    places, depths, rights = search.places, search.depths, search.rights
    low = 0.0
    copy_margins(w, w.start, search.low)
    places[0] = quiet
    depths[0] = 0
    top = 0
    while top >= 0:
        right, depth = places[top], depths[top]
        middle = 0.5 * (low + right)
        if _probe(path, middle, w):
            copy_margins(w, search.probe, search.high)
            return low, middle
        if depth >= DEEPEST or _is_quiet(w, search.low, search.probe, rights[top]):
            low = right
            copy_margins(w, rights[top], search.low)
            top -= 1
        else:  # left half first: the earliest change counts
            depths[top] = depth + 1
            top += 1
            places[top] = middle
            depths[top] = depth + 1
            copy_margins(w, search.probe, rights[top])
    return 0.0, NO_CHANGE


def _is_quiet(w: Watched, left: Vector, middle: Vector, right: Vector) -> bool:
    """Return whether no margin has changed at or between three points, after the first one."""
    truth, above = w.truth, w.above
    for r in w.active:
        a, m, b = left[r], middle[r], right[r]
        if (b > above[r]) != truth[r]:
            return False
        first, second = m - a, b - m
        bend = abs(second - first)
        if bend < min(abs(first), abs(second)):  # monotone: the middle is between the ends
            continue
        if (m > above[r]) != truth[r]:
            return False
        largest = -min(a, m, b) if truth[r] else max(a, m, b)  # of what is negative if unchanged
        if largest + WARY * bend >= 0.0 and bend > 0.0:
            return False
    return True
