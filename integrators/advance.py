"""The kernel: integrate with all states frozen until the next stop or a full buffer.

Array-only, plain loops, with the system's functions as arguments. It neither evaluates guards nor
fires edges: the outer loop does so between two calls.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from integrators.crossings import (
    AIMED,
    MANY,
    NO_CHANGE,
    WAITING,
    Path,
    Watched,
    copy_margins,
    first_change,
    is_quiet_step,
    longest_next,
    steps_to_change,
)
from integrators.step_size import (
    INFINITY,
    Control,
    error_norm,
    memory_of,
    next_factor,
    retry_factor,
    root_of,
)
from integrators.steps import (
    ArcMotion,
    Coefficients,
    Dense,
    Now,
    Scratch,
    Vector,
    fit_dense,
    interpolate,
    take_step,
    weighted_sum,
)

__all__ = ["Output", "RunPlan", "advance"]

# Reasons for returning from the kernel.
REACHED, CROSSED, FULL, TOO_SMALL, NOT_FINITE = 0, 1, 2, 3, 4
# Outcomes of a step, besides TOO_SMALL and NOT_FINITE.
ACCEPTED, REJECTED = 5, 6
REDO = 0.9  # a crossing before this fraction of an adaptive step causes the step to be repeated
ROUGH = 0.01  # of a step: width of the bracket that decides whether it is repeated
SMALLEST = 1e-280  # of an absolute tolerance: smaller numbers lose precision
AT_ONCE = 1e3  # ticks; a crossing closer than this is taken immediately
# Error control alone lets what relaxes wander by its tolerance about where it tends to, at the edge
# of stability. A guard that compares the two would be decided by chance. So the last steps before a
# crossing are this many, of this length in relaxation times: each leaves a fifth of a deviation.
CALM_STEPS = 8.0
CALM = 2.0
QUIET = 0.55  # what the controller remembers of a step with hardly an error
# Significant difference of two times: four units in the last place, whatever the run's length.
TICK = 4.0 * 2.0**-52


class RunPlan(NamedTuple):
    """The settings of a run."""

    method: Coefficients
    control: Control
    t_end: float
    located: bool  # stop at crossings; otherwise evaluate guards once at the end of each step
    foreign: bool  # the caller takes the steps (the loop requests them)
    jumps: Vector  # times at which the flow jumps, increasing
    before_jumps: Vector  # one clock tick before each, where the system shows what is before
    ticks: list[int]  # what ticks at each jump, as bits
    discrete: list[int]  # for each machine the bit with which it is asked; 0: whenever it may fire
    knots: Vector  # times that steps may not jump over
    relaxing: Vector  # relaxation times of the modes of each machine, one machine after another
    max_steps: int  # attempted steps in the whole run
    kinds: list[int]  # of each edge what matters to others, see `integrators.switching.jolts`
    leaps: bool  # whether velocities that are given may jump at a crossing
    events: int  # the bit with which events are forgotten once all machines were asked; or 0
    lasting: int  # that with which, before they are, times of conditions that ceased end; or 0


@dataclass(slots=True, eq=False)
class Output:
    """The destination of rows: every accepted step, or the requested times."""

    row: int  # rows written
    next_time: int  # the next requested time
    next_knot: int
    steps: int  # tried
    every_step: bool
    times: Vector  # requested times, increasing
    rows_t: Vector  # shape (capacity,)
    rows_y: list[Vector]  # shape (capacity, m)


def put_row(out: Output, t: float, y: Vector) -> None:
    """Write one row."""
    row = out.row
    out.rows_t[row] = t
    place = out.rows_y[row]
    for j in range(len(y)):
        place[j] = y[j]
    out.row = row + 1


def is_full(out: Output) -> bool:
    """Return whether there is no room for the row of another step."""
    return out.every_step and out.row >= len(out.rows_t)


def tick_at(t: float) -> float:
    """Return the smallest significant difference of times at t."""
    return TICK * abs(t)


def raise_floor(control: Control, now: Now) -> None:
    """Let the tolerances of components without a scale follow their largest value so far."""
    for j in range(len(now.y)):
        if control.atol[j] == 0.0:
            now.floor[j] = max(now.floor[j], control.rtol * abs(now.y[j]), SMALLEST)


def next_on_grid(control: Control, t: float) -> float:
    """Return the next point of the fixed grid, avoiding a sliver before it."""
    index = int((t - control.origin) / control.step) + 1
    t_new = control.origin + index * control.step
    while t_new - t <= tick_at(t_new):
        index += 1
        t_new = control.origin + index * control.step
    return t_new


def knot_after(plan: RunPlan, now: Now, out: Output) -> float:
    """Return the next knot; infinity if there is none."""
    knots = plan.knots
    while out.next_knot < len(knots) and knots[out.next_knot] <= now.t:
        out.next_knot += 1
    return knots[out.next_knot] if out.next_knot < len(knots) else INFINITY


def limit_after(plan: RunPlan, now: Now, out: Output) -> float:
    """Return the end of the next step at the latest: the next stop or knot."""
    return min(now.t_stop, knot_after(plan, now, out))


def calm_step(plan: RunPlan, mode: list[int]) -> float:
    """Return the length of steps before a crossing; infinity if nothing relaxes in these modes."""
    fastest, relaxing = INFINITY, plan.relaxing
    if len(relaxing) > 0:
        modes = len(relaxing) // len(mode)
        for i in range(len(mode)):
            fastest = min(fastest, relaxing[i * modes + mode[i]])
    return CALM * fastest


def _is_ahead(w: Watched, steps: float) -> bool:
    """Return whether a relation will change within this many more of the last step."""
    ahead = False
    for r in w.active:
        g = w.end[r] + steps * (w.end[r] - w.start[r])
        ahead = ahead or (g > w.above[r]) != w.truth[r]
    return ahead


# Long because a step is judged, searched and stored in one order, and calls cost time.
def advance(
    motion: ArcMotion,
    plan: RunPlan,
    now: Now,
    w: Watched,
    out: Output,
    scratch: Scratch,
    most_steps: int,
) -> int:
    """Integrate in place until the next stop, a crossing, a full buffer or most_steps steps.

    Parameters
    ----------
    motion : ArcMotion
        The flow and what is watched.
    plan : RunPlan
        The method and the step-size settings.
    now : Now
        The state of the run. The slope is not valid after a crossing.
    w : Watched
        Relations; ``w.start`` contains the margins at the start.
    out, scratch
        Buffers.
    most_steps : int
        Attempted steps after which it returns; one that is being repeated is completed.

    Returns
    -------
    int
        One of REACHED, CROSSED, FULL, TOO_SMALL, NOT_FINITE.
    """
    y, f = now.y, now.f
    y_new, f_new = scratch.y_new, scratch.f_new
    times = out.times
    adaptive = not plan.control.step > 0.0
    watching = len(w.active) > 0
    why = 0
    for each in w.watch:
        why |= each
    waiting = adaptive and why & WAITING != 0
    scaleless = False
    for j in range(len(y)):
        scaleless = scaleless or plan.control.atol[j] == 0.0
    calm = calm_step(plan, now.mode) if adaptive and watching else INFINITY
    rejected = redone = False
    while True:
        t = now.t
        if t >= now.t_stop:
            return REACHED
        if not (rejected or redone) and (most_steps <= 0 or is_full(out)):
            return FULL
        t_new, seen, tick = _next_end(plan, now, out)
        if not t_new > t:
            return TOO_SMALL
        h = t_new - t
        out.steps += 1
        most_steps -= 1
        take_step(motion, plan.method, now, t_new, scratch)
        status = _assess_step(plan, now, h, tick, scratch, rejected)
        rejected = status == REJECTED
        if rejected:
            continue
        if status != ACCEPTED:
            return status

        wanted = out.next_time < len(times) and times[out.next_time] < t_new
        theta = NO_CHANGE
        near = watching and not is_quiet_step(motion, now, t_new, scratch, w)
        wanders = calm < INFINITY and not redone and now.error_before > QUIET
        if wanders and not near and _is_ahead(w, CALM_STEPS * calm / h):
            if h - calm > AT_ONCE * tick:
                now.h = calm
                continue
            now.h = min(now.h, calm)
        if waiting:
            now.h = min(now.h, longest_next(motion, now, t_new, scratch, w))
        if near or wanted:
            fit_dense(plan.method, h, y, scratch)
        if near:
            path = Path(motion, now.mode, interpolate, scratch.dense, t, t_new, seen)
            rough = tick
            if adaptive and not redone:
                # If the stages lay far beyond the crossing they may have missed events before it:
                # the step up to the crossing is repeated on its own, and a rough place is enough.
                # Except if its length is almost zero: rounding might then undo the crossing, and a
                # run would creep forward tick by tick. Of many, the next one was aimed at.
                if len(w.truth) <= MANY or len(w.active) <= MANY:
                    rough = max(ROUGH * h, tick)
                theta = first_change(path, w, rough)
                if theta <= ROUGH and rough > tick:  # perhaps almost zero
                    theta = first_change(path, w, tick)
                if wanders and theta < NO_CHANGE and theta * h - calm > AT_ONCE * tick:
                    now.h = max(calm, theta * h - CALM_STEPS * calm)
                    continue
                if theta < REDO and theta * h > AT_ONCE * tick:
                    now.h = theta * h
                    redone = True
                    continue
            if not adaptive or redone or (theta != NO_CHANGE and rough > tick):
                theta = first_change(path, w, tick)
        redone = False
        if theta < 1.0:
            t_new = min(t + theta * h, t_new)
        else:
            if adaptive and len(w.truth) > MANY and len(w.active) > MANY:
                ahead = AIMED * h * (steps_to_change(w, w.end) - 1.0)
                now.h = min(now.h, max(ahead, max(ROUGH * h, tick)))
            copy_margins(w, w.end, w.start)
        if wanted:
            _put_wanted(motion, now, out, scratch.dense, h, t_new)
        if theta < 1.0:
            interpolate(scratch.dense, theta, y)
        else:
            for j in range(len(y)):
                y[j] = y_new[j]
                f[j] = f_new[j]
        motion.follow(min(t_new, seen), y, now.mode, now.held, motion.p)
        motion.moved(min(t_new, seen), now, scratch, theta >= 1.0 and t_new <= seen, motion.p)
        now.t = t_new
        if scaleless:
            raise_floor(plan.control, now)
        if out.every_step:
            put_row(out, min(t_new, seen), y)
        if theta != NO_CHANGE:
            return CROSSED


def _next_end(plan: RunPlan, now: Now, out: Output) -> tuple[float, float, float]:
    """Return the end of the next step, when it is seen, and the significant difference of times.

    It follows the grid or the controller, but not past a stop, and avoids a sliver before one. Two
    equal steps before a stop would have a smaller error than a long and a short one, but what comes
    before the end of a run must not know of it, nor of what may follow.
    """
    t, control = now.t, plan.control
    if control.step > 0.0:
        t_new = next_on_grid(control, t)
    else:
        t_new = t + min(now.h, control.max_step)
    limit = limit_after(plan, now, out)
    tick = TICK * max(abs(t), abs(t_new))
    if t_new + tick >= limit:
        t_new = limit
    return t_new, min(t_new, now.seen), tick


def _assess_step(
    plan: RunPlan, now: Now, h: float, tick: float, scratch: Scratch, rejected: bool
) -> int:
    """Return the outcome of the attempted step of length h, and choose the next step's length."""
    control, method = plan.control, plan.method
    y_new, f_new = scratch.y_new, scratch.f_new
    if control.step > 0.0:
        total = 0.0
        for j in range(len(y_new)):
            total += abs(y_new[j]) + abs(f_new[j])
        return ACCEPTED if total < INFINITY else NOT_FINITE
    order = method.error_order
    weighted_sum(method.E, len(method.B), f_new, scratch.k, scratch.error)
    error = error_norm(scratch.error, h, now.y, y_new, control.rtol, now.floor)
    if not error <= 1.0:
        now.h = h * retry_factor(error, order)
        if now.h > tick:
            return REJECTED
        return TOO_SMALL if error < INFINITY else NOT_FINITE
    root = root_of(error, order)
    factor = next_factor(root, now.error_before)
    if rejected:
        factor = min(factor, 1.0)
    # A step cut short by a stop says little about the step after it. One that is shorter by the
    # rounding of its end is not cut short.
    cut_short = h + tick < now.h and not rejected
    now.h = max(now.h, h * factor) if cut_short else h * factor
    now.error_before = memory_of(root)
    return ACCEPTED


def _put_wanted(
    motion: ArcMotion, now: Now, out: Output, dense: Dense, h: float, t_new: float
) -> None:
    """Write the rows requested before t_new, from the step of length h that begins now.

    They are right-continuous: a time that coincides with a stop is written after the stop, when the
    states have switched.
    """
    t = now.t
    while out.next_time < len(out.times) and out.times[out.next_time] < t_new:
        time = out.times[out.next_time]
        row = out.row
        interpolate(dense, (time - t) / h, out.rows_y[row])
        motion.follow(min(time, now.seen), out.rows_y[row], now.mode, now.held, motion.p)
        out.rows_t[row] = time
        out.row = row + 1
        out.next_time += 1
