"""Finds where in a step a watched relation first changes its truth.

A relation is a margin that is true where positive (or, if not strict, where zero). Its truth at the
start of the arc is remembered; a crossing is the first place where any watched truth differs. The
place is bracketed until both ends are one clock tick apart and the *right* end is kept: there the
raw comparison has changed, so whoever asks next just evaluates it. Half-open on the left: a margin
that starts at zero does not fire again.

Roads not taken: a root finder on the margin stops at a place where the comparison is not yet true
(margin -5e-17); a bracket by sign fails when the arc starts on the zero; one relation after another
misses what becomes true and false again before the first of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from integrators.steps import Vector

__all__ = ["NO_CHANGE", "Margins", "Watched", "any_changed", "first_change"]

Margins = Callable[..., Any]  # margins(t, y, mode, p, watch, out) -> None, fills watched entries
NO_CHANGE = 2.0


class Watched(NamedTuple):
    """The relations watched during an arc, and scratch for their margins."""

    watch: list[int]  # flag a relation, shape (r,)
    active: list[int]  # indices of the flagged ones
    truth: list[bool]  # truth at the arc's start, shape (r,)
    strict: list[bool]  # shape (r,)
    low: Vector  # margins at the left end of the bracket, shape (r,)
    high: Vector  # ... at the right end
    middle: Vector
    probe: Vector
    y_probe: Vector  # shape (m,)


def any_changed(w: Watched, margin: Vector) -> bool:
    """Tell whether any watched relation differs from its truth at the arc's start."""
    for r in w.active:
        g = margin[r]
        if (g > 0.0 or (g == 0.0 and not w.strict[r])) != w.truth[r]:
            return True
    return False


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

    Expects ``w.low`` filled with the margins at t; on `NO_CHANGE` it holds those at t_new.

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
    margins(t_new, y_new, mode, p, w.watch, w.high)
    high = 1.0
    if not any_changed(w, w.high):
        high = _look_inside(interpolate, dense, margins, t, h, mode, p, w)
        if high == NO_CHANGE:
            for r in w.active:
                w.low[r] = w.high[r]
            return NO_CHANGE
    low = 0.0
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
            for r in w.active:
                w.high[r] = w.probe[r]
        else:
            low = guess
            for r in w.active:
                w.low[r] = w.probe[r]
        halve = high - low > 0.5 * width
    return high


def _look_inside(
    interpolate: Callable[..., Any],
    dense: Any,
    margins: Margins,
    t: float,
    h: float,
    mode: list[int],
    p: Any,
    w: Watched,
) -> float:
    """Look for a change that is undone before the step's end; return a place inside it.

    Margins at the start, the middle and the end make a parabola; where its peak comes near a
    change (over half the remaining way), the margins are looked at there too.
    """
    interpolate(dense, 0.5, w.y_probe)
    margins(t + 0.5 * h, w.y_probe, mode, p, w.watch, w.middle)
    if any_changed(w, w.middle):
        for r in w.active:
            w.high[r] = w.middle[r]
        return 0.5
    for r in w.active:
        sign = -1.0 if w.truth[r] else 1.0  # of a margin that runs toward a change
        a, m, b = sign * w.low[r], sign * w.middle[r], sign * w.high[r]
        curve = 2.0 * (a - 2.0 * m + b)
        slope = 4.0 * m - 3.0 * a - b
        if curve >= 0.0 or slope <= 0.0 or slope >= -2.0 * curve:
            continue  # no peak inside
        theta = -slope / (2.0 * curve)
        if a + 0.5 * slope * theta > 0.5 * max(a, m, b):
            interpolate(dense, theta, w.y_probe)
            margins(t + theta * h, w.y_probe, mode, p, w.watch, w.probe)
            if any_changed(w, w.probe):
                for q in w.active:
                    w.high[q] = w.probe[q]
                return theta
    return NO_CHANGE
