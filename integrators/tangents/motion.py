"""A state and its tangents as one motion: the state comes first, then its tangents in lanes.

Tangents of a number stand side by side, one for each direction of a group: lane after lane. The
text of a system says how they change (`LaneFunctions`); along surfaces the derivative of the
sigmas comes from the same linear system as the sigmas themselves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from integrators.sliding import (
    Functions,
    Held,
    Sliding,
    go_back,
    go_to,
    slope_on,
    solve,
    to_neither,
)
from integrators.step_size import INFINITY
from integrators.steps import Coefficients, Now, Scratch, Vector
from integrators.switching.machines import Machines


class LaneFunctions(NamedTuple):
    """The functions of a system with tangents; y and dy have them behind the state.

    Each takes its own arguments, then the tangents of t, of the numbers, and of what it fills.
    """

    slope: Callable[..., Any]  # only the tangents that flow fills, those of t left out
    flow: Callable[..., Any]
    margins: Callable[..., Any]
    normal: Callable[..., Any]
    act: Callable[..., Any]
    tick: Callable[..., Any]
    follow: Callable[..., Any]


class SlideLanes(NamedTuple):
    """Scratch space for tangents along surfaces; small if there are none."""

    y: Vector  # the state alone
    dy: Vector
    upper: Vector  # the motion on either side
    lower: Vector
    halves: list[Vector]  # of each surface slid on: half their difference
    g: Vector  # a normal, and its tangents
    g_t: Vector
    right: Vector  # of the linear system, lanes of each surface
    sigma_t: Vector
    solved: Vector


class Lanes(NamedTuple):
    """A group of directions."""

    now: Now  # y has the state and its tangents
    scratch: Scratch
    mode: list[int]
    t: Vector  # tangents of the time
    scales: Vector  # how much the numbers of each direction change at most
    shared: Vector  # of the numbers with one value
    own: list[Vector]  # ... and of those of the elements
    margins: Vector
    margins_t: Vector
    slide: SlideLanes


@dataclass(slots=True, eq=False)
class TangentCourse:
    """Where the tangents of a run are, and what has been kept of them."""

    t: float  # the time that they are at
    before: float  # the time of the row before
    settled: float  # the time of the last instant at which something switched
    span: float  # length of the run
    instant: int  # whether the last arc has ended
    changed: int  # how many comparisons have ended it
    moving: int  # whether the tangents are at an instant that moves
    fresh: int  # whether an arc begins, of which no slope is known
    finite: int  # whether all tangents were finite where the arc began, and are
    stage: int  # of the step of the run that they follow
    rows: int  # how many are kept
    fired: int
    next_time: int
    doubts: int
    named: int  # comparisons that doubts name
    y: Vector
    y_before: Vector
    mode: list[int]
    held: Vector
    f: Vector
    sizes: Vector  # the largest value of each component
    watch: list[int]  # the comparisons that have ended the arc
    only: list[int]  # scratch space for flags
    armed: list[int]
    margins: Vector
    rates: Vector  # of the margins
    guards: list[list[int]]  # comparisons in the guard of each edge of a bank, and -1
    first_guards: list[int]  # for each machine where those begin, less its first edge
    sliding: Sliding
    # Of every direction, and of the time, which is the last one:
    S: list[Vector]  # shape (m, directions)
    t_t: Vector  # of the instant
    t_before: Vector  # of the last one
    slopes: list[Vector]  # of the margins, shape (relations, directions)
    slope: list[Vector]  # of each group: that of the state and its tangents
    steps: Vector  # ... and the longest step
    moves: list[Vector]  # of the numbers, lanes of each group: shared, then own ones
    scales: Vector
    # What is kept:
    times: Vector  # of the rows that are wanted, if not all are
    rows_t: Vector
    table: list[Vector]  # of each row the tangents of all components
    firings: list[Vector]  # of each firing those of its time
    doubt_t: Vector
    doubt_kind: list[int]
    doubt_end: list[int]  # where the comparisons end that it names
    doubt_names: list[int]


class Traced(NamedTuple):
    """The parameters of a run whose edges and ticks are followed: those of its functions, too."""

    functions: Functions
    machines: Machines
    tangents: LaneFunctions
    method: Coefficients
    rtol: Vector
    every: list[int]  # whether all rows are kept
    same: list[int]  # whether the run has the method of its tangents
    locks: list[int]  # whether locks determine components
    wide: list[int]  # number of directions
    course: TangentCourse
    lanes: Lanes


# --------------------------------------------------------------------------- the motion
def rate_in_lanes(t: float, y: Vector, mode: list[int], held: Vector, on: Held, dy: Vector) -> None:
    """Fill the rates of a state and of its tangents; usable as a flow."""
    if len(on.sliding.which) == 0 or on.sliding.count == 0:
        w = on.functions.p.lanes
        p = on.functions.p.functions.p
        on.functions.p.tangents.flow(t, y, mode, held, p, dy, w.t, (w.shared, w.own))
    else:
        slide_in_lanes(on, t, y, mode, dy)


class TakenStep(NamedTuple):
    """A step of a run that its tangents follow stage by stage."""

    on: Held
    scratch: Scratch


def slope_in_lanes(
    t: float, y: Vector, mode: list[int], held: Vector, step: TakenStep, dy: Vector
) -> None:
    """Fill the rates of tangents at the next stage of a step, whose own rates are known."""
    traced: Any = step.on.functions.p
    c, w, k = traced.course, traced.lanes, step.scratch.k
    numbers = w.shared, w.own
    traced.tangents.slope(t, y, mode, held, traced.functions.p, dy, w.t, numbers)
    for j in range(len(c.y)):
        if c.stage < len(k):
            dy[j] = k[c.stage][j]
        else:
            dy[j] = step.scratch.f_new[j]
    c.stage += 1


def slide_in_lanes(on: Held, t: float, y: Vector, mode: list[int], dy: Vector) -> None:
    """Fill the rates along the surfaces slid on, and the tangents of the sigmas."""
    traced, sliding, held = on.functions.p, on.sliding, on.held
    p, tangents, w = traced.functions.p, traced.tangents, traced.lanes
    s, numbers, lanes = w.slide, (w.shared, w.own), len(w.t)
    which, surfaces, sigma, count = sliding.which, sliding.surfaces, sliding.sigma, sliding.count
    size = len(s.y)
    for j in range(size):
        s.y[j] = y[j]
    slope_on(on, t, s.y, mode, s.dy)
    to_neither(sliding, held)
    if count > 1:
        tangents.flow(t, y, mode, held, p, dy, w.t, numbers)
    for j in range(size, len(dy)):
        dy[j] = (1.0 - count) * dy[j] if count > 1 else 0.0
    for c in range(count):
        kept = go_to(surfaces, which[c], 1.0, held, mode)
        tangents.flow(t, y, mode, held, p, s.upper, w.t, numbers)
        go_to(surfaces, which[c], -1.0, held, mode)
        tangents.flow(t, y, mode, held, p, s.lower, w.t, numbers)
        go_back(surfaces, which[c], kept, held, mode)
        half = s.halves[c]
        for j in range(len(dy)):
            half[j] = 0.5 * (s.upper[j] - s.lower[j])
            if j >= size:
                dy[j] += 0.5 * (s.upper[j] + s.lower[j]) + sigma[c] * half[j]
    for r in range(count):
        tangents.normal(which[r], t, y, mode, p, s.g, w.t, numbers, s.g_t)
        for lane in range(lanes):
            rest = s.g_t[size * lanes + lane]
            for j in range(size):
                rest += s.g_t[j * lanes + lane] * s.dy[j] + s.g[j] * dy[size + j * lanes + lane]
            s.right[r * lanes + lane] = -rest
    for lane in range(lanes):
        put_gains(sliding, size)
        for r in range(count):
            sliding.matrix[r][count] = s.right[r * lanes + lane]
        solve(sliding.matrix, count, s.solved, INFINITY)
        for c in range(count):
            s.sigma_t[c * lanes + lane] = s.solved[c]
            for j in range(size):
                dy[size + j * lanes + lane] += s.solved[c] * sliding.halves[c][j]
    for j in range(size):
        dy[j] = s.dy[j]


def put_gains(sliding: Sliding, size: int) -> None:
    """Fill the linear system of the surfaces slid on, but for its right side."""
    for r in range(sliding.count):
        g, row = sliding.normals[r], sliding.matrix[r]
        for c in range(sliding.count):
            half, gain = sliding.halves[c], 0.0
            for j in range(size):
                gain += g[j] * half[j]
            row[c] = gain


def margins_in_lanes(
    on: Held, t: float, y: Vector, mode: list[int], watch: list[int], w: Lanes
) -> None:
    """Fill margins and, after them, those of the ends of slides, all with their tangents."""
    traced, sliding, lanes = on.functions.p, on.sliding, len(w.t)
    numbers, g, g_t = (w.shared, w.own), w.margins, w.margins_t
    traced.tangents.margins(t, y, mode, traced.functions.p, watch, g, w.t, numbers, g_t)
    if len(sliding.which) > 0 and sliding.count > 0:
        slide_in_lanes(on, t, y, mode, w.now.f)
        first = len(watch) - 2 * len(sliding.sigma)
        for c in range(sliding.count):
            g[first + 2 * c] = 1.0 - sliding.sigma[c]
            g[first + 2 * c + 1] = 1.0 + sliding.sigma[c]
            for lane in range(lanes):
                slope = w.slide.sigma_t[c * lanes + lane]
                g_t[(first + 2 * c) * lanes + lane] = -slope
                g_t[(first + 2 * c + 1) * lanes + lane] = slope


# --------------------------------------------------------------------------- groups of directions
def groups_of(traced: Traced) -> int:
    """Return how many groups have a direction; the time, in the next place, may have one alone."""
    lanes = len(traced.lanes.t)
    return (traced.wide[0] + lanes - 1) // lanes


def take_group(traced: Traced, group: int, y: Vector) -> None:
    """Put a state and the tangents of a group of directions into its lanes; of the time none."""
    w, S, size = traced.lanes, traced.course.S, len(y)
    lanes, move = len(w.t), traced.course.moves[group]
    for j in range(size):
        w.now.y[j] = y[j]
        for lane in range(lanes):
            w.now.y[size + j * lanes + lane] = S[j][group * lanes + lane]
    for lane in range(lanes):
        w.t[lane] = 0.0
        w.scales[lane] = traced.course.scales[group * lanes + lane]
    for k in range(len(w.shared)):
        w.shared[k] = move[k]
    at = len(w.shared)
    for k in range(len(w.own)):
        row = w.own[k]
        for i in range(len(row)):
            row[i] = move[at + i]
        at += len(row)


def put_group(traced: Traced, group: int) -> None:
    """Take the tangents of a group out of its lanes."""
    w, S = traced.lanes, traced.course.S
    lanes, size = len(w.t), len(S)
    for j in range(size):
        for lane in range(lanes):
            S[j][group * lanes + lane] = w.now.y[size + j * lanes + lane]
