"""The kernel: run on with all states frozen until the next stop or a full buffer.

Array-only, plain loops, the system's functions as arguments. It neither asks nor fires: that is the
outer loop's work, between two calls.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from integrators.crossings import (
    NO_CHANGE,
    Margins,
    Watched,
    copy_margins,
    first_change,
    nothing_near,
)
from integrators.step_size import error_norm, next_factor, retry_factor
from integrators.steps import (
    Coefficients,
    Dense,
    Flow,
    Vector,
    fit_dense,
    interpolate,
    take_step,
    weigh,
)

__all__ = ["Control", "Output", "Work", "advance"]

# Why the kernel came back.
REACHED, CROSSED, FULL, TOO_SMALL, NOT_FINITE = 0, 1, 2, 3, 4
REDO = 0.9  # a crossing before this fraction of an adaptive step has the step done again
SMALLEST = 1e-280  # an absolute tolerance: smaller numbers lose their digits
AT_ONCE = 1e3  # ticks; a crossing that is nearer comes at once
# Of a time: a difference that counts. Four places of its last digit, whatever the run's length.
TICK = 4.0 * 2.0**-52
# Places in Output.cursor.
ROW, NEXT_TIME, NEXT_KNOT, STEPS = 0, 1, 2, 3


class Control(NamedTuple):
    """How steps are chosen."""

    step: float  # fixed grid if > 0, else adaptive
    origin: float  # where the grid starts
    rtol: float
    atol: Vector  # shape (m,); 0 for a component without a scale of its own
    max_step: float
    time_scale: float  # of the system, for starting steps; 0 if it has none


class Output(NamedTuple):
    """Where rows go: every accepted step, or the wanted times."""

    times: Vector  # wanted times, increasing
    every_step: bool
    rows_t: Vector  # shape (capacity,)
    rows_y: list[Vector]  # shape (capacity, m)
    cursor: list[int]  # [rows written, next wanted time, next knot, steps tried]


class Work(NamedTuple):
    """Scratch of one run."""

    k: list[Vector]  # shape (stages, m)
    y_new: Vector
    f_new: Vector
    error: Vector
    floor: Vector  # absolute tolerances; without a scale they grow with the component
    dense: Dense


def put_row(out: Output, t: float, y: Vector) -> None:
    """Write one row."""
    row = out.cursor[ROW]
    out.rows_t[row] = t
    place = out.rows_y[row]
    for j in range(len(y)):
        place[j] = y[j]
    out.cursor[ROW] = row + 1


def tick_at(t: float) -> float:
    """Return the smallest difference of times that counts at t."""
    return TICK * abs(t)


def raise_floor(control: Control, floor: Vector, y: Vector) -> None:
    """Let the tolerances of components without a scale follow the largest value they have had."""
    for j in range(len(y)):
        if control.atol[j] == 0.0:
            floor[j] = max(floor[j], control.rtol * abs(y[j]), SMALLEST)


def advance(
    flow: Flow,
    margins: Margins,
    method: Coefficients,
    control: Control,
    t: float,
    y: Vector,
    f: Vector,
    h: float,
    error_before: float,
    t_stop: float,
    knots: Vector,
    mode: list[int],
    held: Vector,
    p: Any,
    w: Watched,
    out: Output,
    work: Work,
    most_steps: int,
) -> tuple[int, float, float, float]:
    """Integrate y in place from t until t_stop, a crossing, a full buffer or most_steps steps.

    Parameters
    ----------
    flow, margins : callable
        The system.
    method, control
        The method and how steps are chosen.
    t : float
        Start.
    y, f : list of float, shape (m,)
        State and slope at t; on return those at the time returned (f is not valid after a
        crossing).
    h, error_before : float
        The controller's memory.
    t_stop : float
        Where the outer loop wants to be asked.
    knots : list of float
        Times that a step may end on but not jump over.
    mode, held, p
        Frozen, handed on to the system.
    w : Watched
        Relations; ``w.start`` holds the margins at t.
    out, work
        Buffers.
    most_steps : int
        How many steps at most.

    Returns
    -------
    (status, t, h, error_before)
        One of REACHED, CROSSED, FULL, TOO_SMALL, NOT_FINITE, and the new values.
    """
    fixed = control.step > 0.0
    watching = len(w.active) > 0
    order = method.error_order
    cursor = out.cursor
    infinity = float("inf")
    scaleless = False
    for j in range(len(y)):
        scaleless = scaleless or control.atol[j] == 0.0
    rejected = False
    redone = False
    while True:
        if t >= t_stop:
            return REACHED, t, h, error_before
        if most_steps <= 0 or (out.every_step and cursor[ROW] >= len(out.rows_t)):
            return FULL, t, h, error_before

        # Where to: the grid or the controller's step, but not past a stop, and no sliver before it.
        if fixed:
            index = int((t - control.origin) / control.step) + 1
            t_new = control.origin + index * control.step
            while t_new - t <= tick_at(t_new):
                index += 1
                t_new = control.origin + index * control.step
        else:
            t_new = t + min(h, control.max_step)
        limit = t_stop
        while cursor[NEXT_KNOT] < len(knots) and knots[cursor[NEXT_KNOT]] <= t:
            cursor[NEXT_KNOT] += 1
        if cursor[NEXT_KNOT] < len(knots):
            limit = min(limit, knots[cursor[NEXT_KNOT]])
        tick = TICK * max(abs(t), abs(t_new))
        if t_new + tick >= limit:
            t_new = limit
        if not t_new > t:
            return TOO_SMALL, t, h, error_before
        h_now = t_new - t
        cursor[STEPS] += 1

        take_step(flow, method, t, y, f, t_new, mode, held, p, work.k, work.y_new, work.f_new)
        if fixed:
            total = 0.0
            for j in range(len(y)):
                total += abs(work.y_new[j]) + abs(work.f_new[j])
            if not total < infinity:
                return NOT_FINITE, t, h, error_before
        else:
            weigh(method.E, len(method.B), work.f_new, work.k, work.error)
            error = error_norm(work.error, h_now, y, work.y_new, control.rtol, work.floor)
            if not error <= 1.0:
                h = h_now * retry_factor(error, order)
                rejected = True
                if h <= tick:
                    status = TOO_SMALL if error < infinity else NOT_FINITE
                    return status, t, h, error_before
                continue
            factor = next_factor(error, error_before, order)
            if rejected:
                factor = min(factor, 1.0)
            # A step cut short by a stop says little of the step after it.
            h = max(h, h_now * factor) if h_now < h and not rejected else h_now * factor
            error_before = max(error, 1e-4)
            rejected = False

        wanted = cursor[NEXT_TIME] < len(out.times) and out.times[cursor[NEXT_TIME]] < t_new
        theta = NO_CHANGE
        near = watching and not nothing_near(
            margins, t, t_new, y, f, work.y_new, work.f_new, mode, p, w
        )
        if near or wanted:
            fit_dense(method, h_now, y, work.k, work.y_new, work.f_new, work.dense)
        if near:
            theta = first_change(
                interpolate, work.dense, margins, t, t_new, work.y_new, mode, p, w, tick
            )
        if theta < REDO and theta * h_now > AT_ONCE * tick and not fixed and not redone:
            # The stages lay behind the crossing and may have jumped what comes before it: the step
            # up to the crossing is done for its own sake. Not where it is next to none: rounding
            # may then take the crossing back, and a run would creep on by ticks.
            h = theta * h_now
            redone = True
            continue
        redone = False
        if theta < 1.0:
            t_new = t + theta * h_now
        else:
            copy_margins(w, w.end, w.start)
        # Rows at wanted times are right-continuous: a time that falls on a stop is written
        # after it, when the states have switched.
        while cursor[NEXT_TIME] < len(out.times) and out.times[cursor[NEXT_TIME]] < t_new:
            time = out.times[cursor[NEXT_TIME]]
            row = cursor[ROW]
            interpolate(work.dense, (time - t) / h_now, out.rows_y[row])
            out.rows_t[row] = time
            cursor[ROW] = row + 1
            cursor[NEXT_TIME] += 1
        if theta < 1.0:
            interpolate(work.dense, theta, y)
        else:
            for j in range(len(y)):
                y[j] = work.y_new[j]
                f[j] = work.f_new[j]
        t = t_new
        most_steps -= 1
        if scaleless:
            raise_floor(control, work.floor, y)
        if out.every_step:
            put_row(out, t, y)
        if theta != NO_CHANGE:
            return CROSSED, t, h, error_before
