"""Finds where in a step a watched relation first changes its truth.

A relation is a margin that is true where positive (or, if not strict, where zero). Its truth at the
start of the arc is remembered; a crossing is the first place where any watched truth differs. The
place is bracketed until both ends are one clock tick apart and the *right* end is kept: there the
raw comparison has changed, so whoever asks next just evaluates it. Half-open on the left: a margin
that starts at zero does not fire again.

Before a place is believed to be the first, the step up to it is searched for a change that is
undone again: an interval counts as quiet only where start, middle and end show each margin to be
monotone, or farther from a change than `WARY` times the curvature they show could carry it; else
it is halved.

Roads not taken: a root finder on the margin stops at a place where the comparison is not yet true
(margin -5e-17); a bracket by sign fails when the arc starts on the zero; one relation after another
misses what becomes true and false again before the first of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from integrators.steps import Vector

__all__ = [
    "DEEPEST",
    "NO_CHANGE",
    "Margins",
    "Watched",
    "any_changed",
    "first_change",
    "nothing_near",
    "watched",
]

Margins = Callable[..., Any]  # margins(t, y, mode, p, watch, out) -> None, fills watched entries
NO_CHANGE = 2.0
# A margin with a narrow hump between two of the places bends more than they show.
WARY = 4.0
DEEPEST = 8  # halvings of a step: windows down to 1/256 of it are searched for


class Watched(NamedTuple):
    """The relations watched during an arc, and scratch for their margins."""

    watch: list[int]  # flag a relation, shape (r,)
    active: list[int]  # indices of the flagged ones
    truth: list[bool]  # truth at the arc's start, shape (r,)
    changed: list[int]  # whether it is another where the arc ended, shape (r,)
    strict: list[bool]  # shape (r,)
    start: Vector  # margins at the step's start, shape (r,)
    end: Vector  # ... at its end
    low: Vector  # ... at the left end of the bracket
    high: Vector  # ... at its right end
    probe: Vector
    rights: list[Vector]  # right ends of the intervals still to search, shape (DEEPEST + 1, r)
    places: Vector  # where these are, shape (DEEPEST + 1,)
    depths: list[int]  # how often they were halved, shape (DEEPEST + 1,)
    y_probe: Vector  # shape (m,)


def watched(strict: list[bool], size: int) -> Watched:
    """Return room to watch relations, none of them flagged yet.

    Parameters
    ----------
    strict : list of bool, shape (r,)
        For each relation whether zero is false.
    size : int
        Length of the state vector.

    Returns
    -------
    Watched
        With scratch for all of them.
    """
    r = len(strict)

    def vector() -> Vector:
        return [0.0] * r

    return Watched(
        [0] * r,
        [],
        [False] * r,
        [0] * r,
        strict,
        vector(),
        vector(),
        vector(),
        vector(),
        vector(),
        rights=[vector() for _ in range(DEEPEST + 1)],
        places=[0.0] * (DEEPEST + 1),
        depths=[0] * (DEEPEST + 1),
        y_probe=[0.0] * size,
    )


def any_changed(w: Watched, margin: Vector) -> bool:
    """Tell whether any watched relation differs from its truth at the arc's start.

    Parameters
    ----------
    w : Watched
        The relations and their truth then.
    margin : list of float, shape (r,)
        Margins now; only the active ones are read.

    Returns
    -------
    bool
        True at the first difference.
    """
    truth, strict = w.truth, w.strict
    for r in w.active:
        g = margin[r]
        if (g > 0.0 or (g == 0.0 and not strict[r])) != truth[r]:
            return True
    return False


def copy_margins(w: Watched, source: Vector, target: Vector) -> None:
    """Copy the active margins."""
    for r in w.active:
        target[r] = source[r]


def nothing_near(
    margins: Margins,
    t: float,
    t_new: float,
    y: Vector,
    f: Vector,
    y_new: Vector,
    f_new: Vector,
    mode: list[int],
    p: Any,
    w: Watched,
) -> bool:
    """Tell whether a whole step is quiet: most are, and then no dense output is needed.

    Expects ``w.start`` filled with the margins at t; fills ``w.end`` with those at t_new. The place
    between is that of the cubic through both ends and both slopes.

    Parameters
    ----------
    margins : callable
        ``margins(t, y, mode, p, watch, out)``.
    t, t_new : float
        Ends of the step.
    y, f, y_new, f_new : list of float, shape (m,)
        State and slope there.
    mode, p
        Handed on.
    w : Watched
        Relations.

    Returns
    -------
    bool
        False if `first_change` has to look.
    """
    margins(t_new, y_new, mode, p, w.watch, w.end)
    if any_changed(w, w.end):
        return False
    h = t_new - t
    middle = w.y_probe
    for j in range(len(y)):
        middle[j] = 0.5 * (y[j] + y_new[j]) + 0.125 * h * (f[j] - f_new[j])
    margins(t + 0.5 * h, middle, mode, p, w.watch, w.probe)
    return not any_changed(w, w.probe) and _is_quiet(w, w.start, w.probe, w.end)


def first_change(
    interpolate: Callable[..., Any],
    dense: Any,
    margins: Margins,
    t: float,
    t_new: float,
    y_new: Vector,
    mode: list[int],
    p: Any,
    w: Watched,
    resolution: float,
) -> float:
    """Return the fraction of the step at which a watched truth first differs.

    Expects ``w.start`` filled with the margins at t; on `NO_CHANGE` ``w.end`` holds those at t_new.

    Parameters
    ----------
    interpolate, dense
        The dense output: ``interpolate(dense, theta, out)``.
    margins : callable
        ``margins(t, y, mode, p, watch, out)``.
    t, t_new : float
        Ends of the step.
    y_new : list of float, shape (m,)
        State at t_new.
    mode, p
        Handed on.
    w : Watched
        Relations.
    resolution : float
        The bracket's width in time at which the search ends.

    Returns
    -------
    float
        In (0, 1], or `NO_CHANGE`.
    """
    h = t_new - t
    margins(t_new, y_new, mode, p, w.watch, w.end)
    found = NO_CHANGE
    quiet = 1.0  # the step up to here is to be searched; its margins are in rights[0]
    copy_margins(w, w.end, w.rights[0])
    if any_changed(w, w.end):
        copy_margins(w, w.start, w.low)
        copy_margins(w, w.end, w.high)
        quiet, found = _bracket(interpolate, dense, margins, t, h, 0.0, 1.0, mode, p, w, resolution)
    while quiet > 0.0:
        low, high = _search(interpolate, dense, margins, t, h, quiet, mode, p, w)
        if high == NO_CHANGE:
            break
        quiet, found = _bracket(
            interpolate, dense, margins, t, h, low, high, mode, p, w, resolution
        )
    return found


def _bracket(
    interpolate: Callable[..., Any],
    dense: Any,
    margins: Margins,
    t: float,
    h: float,
    low: float,
    high: float,
    mode: list[int],
    p: Any,
    w: Watched,
    resolution: float,
) -> tuple[float, float]:
    """Close the bracket (low unchanged, high changed; margins in w.low, w.high).

    Leaves the margins of the place before the change in ``w.rights[0]``, for `_search`.
    """
    tolerance = max(resolution / h, 4e-16)
    halve = False
    while high - low > tolerance:
        guess = 0.5 * (low + high)
        if not halve:
            guess = high
            for r in w.active:
                b = w.high[r]
                if (b > 0.0 or (b == 0.0 and not w.strict[r])) != w.truth[r]:
                    a = w.low[r]
                    if a != b:
                        guess = min(guess, low + (high - low) * (a / (a - b)))
            # One half tick inside the bracket, so that the last look closes it.
            guess = min(max(guess, low + 0.5 * tolerance), high - 0.5 * tolerance)
        width = high - low
        interpolate(dense, guess, w.y_probe)
        margins(t + guess * h, w.y_probe, mode, p, w.watch, w.probe)
        if any_changed(w, w.probe):
            high = guess
            copy_margins(w, w.probe, w.high)
        else:
            low = guess
            copy_margins(w, w.probe, w.low)
        halve = high - low > 0.5 * width
    copy_margins(w, w.low, w.rights[0])
    return low, high


def _search(
    interpolate: Callable[..., Any],
    dense: Any,
    margins: Margins,
    t: float,
    h: float,
    quiet: float,
    mode: list[int],
    p: Any,
    w: Watched,
) -> tuple[float, float]:
    """Search [0, quiet], unchanged at both ends, for a change inside.

    Returns an unchanged place and a changed one right of it, with their margins in w.low and
    w.high, or `NO_CHANGE`.
    """
    low = 0.0
    copy_margins(w, w.start, w.low)
    w.places[0] = quiet
    w.depths[0] = 0
    top = 0
    while top >= 0:
        right, depth = w.places[top], w.depths[top]
        middle = 0.5 * (low + right)
        interpolate(dense, middle, w.y_probe)
        margins(t + middle * h, w.y_probe, mode, p, w.watch, w.probe)
        if any_changed(w, w.probe):
            copy_margins(w, w.probe, w.high)
            return low, middle
        if depth >= DEEPEST or _is_quiet(w, w.low, w.probe, w.rights[top]):
            low = right
            copy_margins(w, w.rights[top], w.low)
            top -= 1
        else:  # left half first: the earliest change counts
            w.depths[top] = depth + 1
            top += 1
            w.places[top] = middle
            w.depths[top] = depth + 1
            copy_margins(w, w.probe, w.rights[top])
    return 0.0, NO_CHANGE


def _is_quiet(w: Watched, left: Vector, middle: Vector, right: Vector) -> bool:
    """Tell whether no margin can have changed between three unchanged places."""
    truth = w.truth
    for r in w.active:
        sign = -1.0 if truth[r] else 1.0  # of a margin that is negative while unchanged
        a, m, b = sign * left[r], sign * middle[r], sign * right[r]
        first, second = m - a, b - m
        bend = abs(second - first)
        monotone = bend < min(abs(first), abs(second))  # of opposite signs they bend by more
        if not monotone and max(a, m, b) + WARY * bend >= 0.0 and bend > 0.0:
            return False
    return True
