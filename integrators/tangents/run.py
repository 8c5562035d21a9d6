"""A run with its tangents: the loop goes on as ever, and they follow each of its steps and events.

Between two rows a state and its tangents are integrated together, group of directions by group.
They take no part in the choice of the steps, so that the run has its bits; an error estimate of
their own divides a step where the tangents need it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from integrators.advance import CROSSED, TICK
from integrators.loop import DONE, FIRED, FIRING, ROWS, SLID, STOPPED, Buffers, run_to_event
from integrators.sliding import Functions, Held, flow_on, follow_on, margins_on
from integrators.step_size import INFINITY, root_of
from integrators.steps import (
    ArcMotion,
    Vector,
    fit_dense,
    interpolate,
    take_step,
    weighted_sum,
)
from integrators.switching.machines import Machines
from integrators.tangents.motion import (
    Lanes,
    TangentCourse,
    Traced,
    put_group,
    rate_in_lanes,
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

__all__ = ["FollowArguments", "follow_run"]

SAFE, LEAST, MOST = 0.9, 0.2, 3.0  # of the step control
ORDER = 5
LOOSE = 30.0  # tolerances that a step of tangents may take
SHARE = 1e-3  # of the largest tangent that a component could have: what is small beside it
ROUNDING = 2.0**-52
SMALLEST = 1e-300


class FollowArguments(NamedTuple):
    """The arguments of `follow_run`, without the last one."""

    functions: Functions  # with traced parameters
    machines: Machines  # those that note
    buffers: Buffers  # with rows of every step


def follow_run(functions: Functions, machines: Machines, b: Buffers, most_steps: int) -> int:
    """Run until the end (DONE), until something has no room or for so many steps (ROWS)."""
    traced: Any = functions.p
    c, now, out, memory = traced.course, b.now, b.out, b.memory
    on, own = Held(functions, now.held, b.sliding), Held(functions, c.held, c.sliding)
    motion, last = ArcMotion(flow_on, margins_on, on, follow_on), out.steps + most_steps
    while True:
        if out.steps >= last or _is_full(traced, len(out.rows_t)):
            return ROWS
        event = run_to_event(functions, machines, motion, b, len(out.rows_t))
        if event == ROWS:
            _take_rows(own, b)
            out.row = 0
            memory.taken = 0
        elif event in (FIRED, SLID):
            _hold(own, b, now.y)
        elif event in (STOPPED, DONE):
            if c.instant == 0 and memory.status == CROSSED and now.t <= now.seen:
                _cross(own, b)
            c.instant = 1
            for j in range(len(c.y)):
                c.y[j] = now.y[j]
            c.t = max(c.t, min(now.t, now.seen))  # a jump is one clock tick later
            if event == DONE:
                _finish(own, b)
                return DONE
        elif event != FIRING:
            return event


def _is_full(traced: Traced, rows: int) -> bool:
    """Return whether a column has no room for what the next event may bring."""
    c = traced.course
    if traced.every[0] > 0 and c.rows + rows + 1 >= len(c.rows_t):
        return True
    if c.doubts + 2 >= len(c.doubt_t) or c.named + 2 * len(c.watch) >= len(c.doubt_names):
        return True
    return c.fired >= len(c.firings)


# --------------------------------------------------------------------------- instants
def _hold(own: Held, b: Buffers, y: Vector) -> None:
    """Note a row of an instant."""
    traced: Any = own.functions.p
    c = traced.course
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


def _begin(own: Held, b: Buffers) -> None:
    """Begin an arc."""
    c: TangentCourse = own.functions.p.course
    slide_as(c.sliding, b.sliding)
    for k in range(len(c.held)):
        c.held[k] = b.now.held[k]
    for i in range(len(c.mode)):
        c.mode[i] = b.now.mode[i]
    fix(own, c.mode)
    c.instant = 0
    c.changed = 0


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
def _take_rows(own: Held, b: Buffers) -> None:
    """Go on along new rows; those at the very start of an arc belong to the instant before."""
    traced: Any = own.functions.p
    c, out, first = traced.course, b.out, 0
    while first < out.row and out.rows_t[first] <= c.t:
        _hold(own, b, out.rows_y[first])
        first += 1
    if first < out.row:
        if c.instant > 0:
            _begin(own, b)
        for j in range(len(c.y)):
            c.sizes[j] = max(c.sizes[j], abs(c.y[j]))
            for row in range(first, out.row):
                c.sizes[j] = max(c.sizes[j], abs(out.rows_y[row][j]))
        finite, bad = _is_finite(c.S), INFINITY
        lanes = len(traced.lanes.t)
        end, wanted = out.rows_t[out.row - 1], c.next_time
        while wanted < len(c.times) and c.times[wanted] < end:
            wanted += 1
        kept = out.row - first if traced.every[0] > 0 else wanted - c.next_time
        for group in range((traced.wide[0] + lanes - 1) // lanes):
            take_group(traced, group, c.y)
            bad = min(bad, _along(own, b, first, group))
            put_group(traced, group)
        if finite and bad < INFINITY:
            for r in range(len(c.watch)):
                c.watch[r] = 0
            doubt(c, NO_SLOPE, bad, -1)
        c.rows += kept
        c.next_time = wanted
        for row in range(max(first, out.row - 2), out.row):
            c.before = c.t
            c.t = out.rows_t[row]
            for j in range(len(c.y)):
                c.y_before[j] = c.y[j]
                c.y[j] = out.rows_y[row][j]


def _is_finite(S: list[Vector]) -> bool:
    finite = True
    for j in range(len(S)):
        for u in S[j]:
            finite = finite and abs(u) < INFINITY
    return finite


def _along(own: Held, b: Buffers, first: int, group: int) -> float:
    """Integrate the lanes of a group along rows; return when they stop to be finite."""
    traced: Any = own.functions.p
    c, w, out = traced.course, traced.lanes, b.out
    motion, size = ArcMotion(rate_in_lanes, margins_on, own, follow_on), len(c.y)
    now, bad = w.now, INFINITY
    place, wanted = c.rows, c.next_time
    h = out.rows_t[out.row - 1] - c.t
    now.t = c.t
    for i in range(len(c.mode)):
        now.mode[i] = c.mode[i]
    for k in range(len(c.held)):
        now.held[k] = c.held[k]
    rate_in_lanes(now.t, now.y, now.mode, now.held, own, now.f)
    for row in range(first, out.row):
        end = out.rows_t[row]
        tick = TICK * max(abs(now.t), abs(end))
        undivided = True
        while now.t < end:
            step = min(h, end - now.t)
            t_new = end if end - now.t - step <= tick else now.t + step
            step = t_new - now.t
            take_step(motion, traced.method, now, t_new, w.scratch)
            worst = _error(traced, step)
            if worst > LOOSE and step > tick:
                undivided = False
                h = step * max(LEAST, SAFE / root_of(worst / LOOSE, ORDER))
            else:
                undivided = undivided and t_new == end
                h = max(h, step * min(MOST, SAFE / root_of(worst / LOOSE, ORDER)))
                if wanted < len(c.times) and c.times[wanted] < t_new:
                    fit_dense(traced.method, step, now.y, w.scratch)
                while wanted < len(c.times) and c.times[wanted] < t_new:
                    interpolate(w.scratch.dense, (c.times[wanted] - now.t) / step, w.scratch.error)
                    _put(w, size, c.table[place], group, w.scratch.error)
                    c.rows_t[place] = c.times[wanted]
                    place += 1
                    wanted += 1
                now.t = t_new
                for j in range(len(now.y)):
                    now.y[j] = w.scratch.y_new[j]
                    now.f[j] = w.scratch.f_new[j]
        if undivided:  # the steps of the run are short enough
            h = out.rows_t[out.row - 1] - c.t
        known = out.rows_y[row]
        for j in range(size):
            now.y[j] = known[j]
        if traced.every[0] > 0:
            _put(w, size, c.table[place], group, now.y)
            c.rows_t[place] = end
            place += 1
        if bad == INFINITY:
            for k in range(len(now.y)):
                if not abs(now.y[k]) < INFINITY:
                    bad = end
    return bad


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
