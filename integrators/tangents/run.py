"""A run with its tangents: the loop goes on as ever, and they follow each of its steps and events.

Along a step a state and its tangents are integrated together, group of directions by group. They
take no part in the choice of the steps, so that the run has its bits; an error estimate of their
own divides a step where the tangents need it.
"""

from __future__ import annotations

from typing import Any

from integrators.advance import CROSSED, TICK
from integrators.loop import DONE, FIRED, ROWS, SLID, STOPPED, Buffers
from integrators.sliding import Held, Sliding, follow_on, margins_on
from integrators.step_size import INFINITY, root_of
from integrators.steps import (
    ArcMotion,
    Now,
    Scratch,
    Vector,
    fit_dense,
    interpolate,
    moves_alone,
    take_step,
    weighted_sum,
)
from integrators.switching.machines import Machines
from integrators.tangents import switches
from integrators.tangents.motion import (
    Lanes,
    TakenStep,
    TangentCourse,
    Traced,
    groups_of,
    put_group,
    rate_in_lanes,
    slope_in_lanes,
    take_group,
)
from integrators.tangents.switches import (
    NO_SLOPE,
    arm_here,
    arrive,
    doubt,
    fix,
    rate_of_instant,
    slide_as,
)

__all__ = ["machines_that_note"]

SAFE, LEAST, MOST = 0.9, 0.2, 3.0  # of the step control
ORDER = 5
LOOSE = 100.0  # tolerances that a step of tangents may take
SHARE = 1e-3  # of the largest tangent that a component could have: what is small beside it
ROUNDING = 2.0**-52
SMALLEST = 1e-300


def machines_that_note() -> Machines:
    """Return the machines of a run with traced parameters, whose tangents follow it."""
    s = switches
    return Machines(s.ask, s.act, s.tick, s.jolts, s.observe, moved, noted)


def noted(event: int, on: Held, b: Buffers) -> bool:
    """Follow what has happened; return whether there is room for what the next event may bring."""
    traced: Any = on.functions.p
    c: TangentCourse = traced.course
    now, memory = b.now, b.memory
    own = Held(on.functions, c.held, c.sliding)
    if event == ROWS:
        if c.instant > 0 and b.out.row > memory.taken:
            _hold(own, b)
    elif event in (FIRED, SLID):
        _hold(own, b)
    elif event in (STOPPED, DONE):
        if c.instant == 0 and memory.status == CROSSED and now.t <= now.seen:
            _cross(own, b)
        c.instant = 1
        for j in range(len(c.y)):
            c.y[j] = now.y[j]
        c.t = max(c.t, min(now.t, now.seen))  # a jump is one clock tick later
        if event == DONE:
            _finish(own, b)
    names: int = c.named + 3 * len(c.watch)
    return c.doubts + 3 < len(c.doubt_t) and names < len(c.doubt_names)


# --------------------------------------------------------------------------- instants
def _hold(own: Held, b: Buffers) -> None:
    """Note a row of an instant."""
    traced: Any = own.functions.p
    c, y = traced.course, b.now.y
    for j in range(len(y)):
        c.y[j] = y[j]
    c.instant = 1
    if traced.every[0] > 0:
        if c.moving > 0:
            slide_as(c.sliding, b.sliding)
            arm_here(own, b.now.mode)
            rate_of_instant(own, b.now.mode)
        place = c.table[c.rows]
        wide = len(c.t_t)
        for j in range(len(y)):
            for q in range(wide):
                back = c.f[j] * c.t_t[q] if c.moving > 0 else 0.0
                place[j * wide + q] = c.S[j][q] - back
        c.rows_t[c.rows] = c.t
        c.rows += 1


def _cross(own: Held, b: Buffers) -> None:
    """Go to the moving instant at which comparisons have changed."""
    c: TangentCourse = own.functions.p.course
    c.changed = 0
    for r in range(len(c.watch)):
        c.watch[r] = 0
    for a in range(b.memory.active):
        r = b.relations.room[a]
        if b.relations.changed[r]:
            c.watch[r] = 1
            c.changed += 1
    if c.changed > 0:
        arrive(own)


def _begin(own: Held, now: Now, sliding: Sliding) -> None:
    """Begin an arc."""
    traced: Any = own.functions.p
    c, along = traced.course, traced.lanes.now
    slide_as(c.sliding, sliding)
    for k in range(len(c.held)):
        c.held[k] = now.held[k]
        along.held[k] = now.held[k]
    for i in range(len(c.mode)):
        c.mode[i] = now.mode[i]
        along.mode[i] = now.mode[i]
    for j in range(len(c.y)):
        c.sizes[j] = max(c.sizes[j], abs(c.y[j]))
    fix(own, c.mode)
    c.instant = 0
    c.changed = 0
    c.fresh = 1
    c.finite = 1
    for j in range(len(c.S)):
        for u in c.S[j]:
            if not abs(u) < INFINITY:
                c.finite = 0
    for group in range(len(c.steps)):
        c.steps[group] = INFINITY


def _finish(own: Held, b: Buffers) -> None:
    """Come to a fixed time at the end, and keep the rows that are wanted there."""
    traced: Any = own.functions.p
    c = traced.course
    slide_as(c.sliding, b.sliding)
    arm_here(own, b.now.mode)
    fix(own, b.now.mode)
    wide = len(c.t_t)
    while c.next_time < len(c.times):
        place = c.table[c.rows]
        for j in range(len(c.y)):
            for q in range(wide):
                place[j * wide + q] = c.S[j][q]
        c.rows_t[c.rows] = c.times[c.next_time]
        c.rows += 1
        c.next_time += 1


# --------------------------------------------------------------------------- arcs
def moved(t: float, now: Now, scratch: Scratch, whole: bool, on: Held) -> None:
    """Go on along a step; one of no length is of the instant before."""
    traced: Any = on.functions.p
    c = traced.course
    if t <= c.t:
        return
    own = Held(on.functions, c.held, c.sliding)
    if c.instant > 0:
        _begin(own, now, on.sliding)
    for j in range(len(c.y)):
        c.sizes[j] = max(c.sizes[j], abs(now.y[j]))
    sliding = len(on.sliding.which) > 0 and on.sliding.count > 0
    alike = 1 if whole and not sliding else 0
    step = TakenStep(own, scratch)
    first, finite = c.next_time, True
    for group in range(groups_of(traced)):
        take_group(traced, group, c.y)
        c.next_time = first
        finite = _along(step, alike * traced.same[0], t, now.y, group) and finite
        put_group(traced, group)
    c.rows += traced.every[0] + c.next_time - first
    c.fresh = 0
    if not finite and c.finite > 0:
        for r in range(len(c.watch)):
            c.watch[r] = 0
        doubt(c, NO_SLOPE, t, -1)
        c.finite = 0
    c.before = c.t
    c.t = t
    for j in range(len(c.y)):
        c.y_before[j] = c.y[j]
        c.y[j] = now.y[j]


def _along(taken: TakenStep, alike: int, end: float, y: Vector, group: int) -> bool:
    """Integrate the lanes of a group to the end of a step; return whether they are finite there.

    Where that is short enough for them, and alike, its own stages are theirs.
    """
    own = taken.on
    traced: Any = own.functions.p
    c, w = traced.course, traced.lanes
    motion = ArcMotion(rate_in_lanes, margins_on, own, follow_on, moves_alone)
    as_taken = ArcMotion(slope_in_lanes, margins_on, taken, follow_on, moves_alone)
    now, slope, size, place = w.now, c.slope[group], len(y), c.rows
    now.t = c.t
    c.stage = 0
    if c.fresh > 0 and alike > 0:
        slope_in_lanes(now.t, now.y, now.mode, now.held, taken, now.f)
    elif c.fresh > 0:
        rate_in_lanes(now.t, now.y, now.mode, now.held, own, now.f)
    else:
        for k in range(len(slope)):
            now.f[k] = slope[k]
    tick = TICK * max(abs(now.t), abs(end))
    while now.t < end:
        step = min(c.steps[group], end - now.t)
        t_new = end if end - now.t - step <= tick else now.t + step
        step = t_new - now.t
        whole = now.t == c.t and t_new == end
        if alike > 0 and whole:
            c.stage = 1
            take_step(as_taken, traced.method, now, t_new, w.scratch)
        else:
            take_step(motion, traced.method, now, t_new, w.scratch)
        worst = _error(traced, step)
        if worst > LOOSE and step > tick:
            c.steps[group] = step * max(LEAST, SAFE / root_of(worst / LOOSE, ORDER))
        else:
            if whole:  # the steps of the run are short enough
                c.steps[group] = INFINITY
            else:
                longer = step * min(MOST, SAFE / root_of(worst / LOOSE, ORDER))
                c.steps[group] = max(c.steps[group], longer)
            wanted = c.next_time < len(c.times) and c.times[c.next_time] < t_new
            if wanted:
                fit_dense(traced.method, step, now.y, w.scratch)
            while c.next_time < len(c.times) and c.times[c.next_time] < t_new:
                time = c.times[c.next_time]
                interpolate(w.scratch.dense, (time - now.t) / step, w.scratch.error)
                _put(w, size, c.table[place], group, w.scratch.error)
                c.rows_t[place] = time
                place += 1
                c.next_time += 1
            now.t = t_new
            for k in range(len(now.y)):
                now.y[k] = w.scratch.y_new[k]
                now.f[k] = w.scratch.f_new[k]
    for j in range(size):
        now.y[j] = y[j]
    finite = True
    for k in range(len(slope)):
        slope[k] = now.f[k]
        finite = finite and abs(now.y[k]) < INFINITY
    if traced.every[0] > 0:
        _put(w, size, c.table[place], group, now.y)
        c.rows_t[place] = end
    return finite


def _put(w: Lanes, size: int, place: Vector, group: int, y: Vector) -> None:
    """Write the tangents of a group into a row."""
    lanes = len(w.t)
    wide = len(place) // size
    for j in range(size):
        for lane in range(lanes):
            place[j * wide + group * lanes + lane] = y[size + j * lanes + lane]


def _error(traced: Traced, h: float) -> float:
    """Return the error of the step in units of the tolerances: that of the worst tangent."""
    c, w, method, rtol = traced.course, traced.lanes, traced.method, traced.rtol[0]
    scratch, now = w.scratch, w.now
    weighted_sum(method.E, len(method.B), scratch.f_new, scratch.k, scratch.error)
    size, lanes, worst, most = len(c.y), len(w.t), 0.0, 0.0
    error, y, y_new = scratch.error, now.y, scratch.y_new
    for k in range(size, len(y)):
        most = max(most, abs(y_new[k]))
    for j in range(size):
        for lane in range(lanes):
            k = size + j * lanes + lane
            own = max(abs(y[k]), abs(y_new[k])) + SHARE * c.sizes[j] / w.scales[lane]
            worst = max(worst, abs(h * error[k]) / (rtol * own + ROUNDING * most + SMALLEST))
    return worst
