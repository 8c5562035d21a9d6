"""What a switch does to tangents.

The time of a switch has a derivative: that of the zero of the margin that has just changed. There
tangents are followed at the moving instant (S + dy/dt t_t), taken through every edge and every tick
as they happen, and then brought back to a fixed time with the flow behind it (saltation).
"""

from __future__ import annotations

from typing import Any

from integrators.advance import tick_at
from integrators.sliding import Functions, Held, Sliding, arm_on, flow_on, margins_on, solve
from integrators.step_size import INFINITY
from integrators.steps import Vector
from integrators.tangents.motion import (
    TangentCourse,
    Traced,
    groups_of,
    margins_in_lanes,
    put_gains,
    put_group,
    slide_in_lanes,
    take_group,
)

NAN = float("nan")
GRAZES, JUMPS, TIE, NO_SLOPE = 1, 2, 3, 4  # kinds of doubts
ALIKE = 1e-7  # times of switches that differ by less have one derivative
ROUNDING = 1e-12  # of the length of a run
SHORT = 64.0  # ticks: an arc that a switch has ended at once
NOTHING = 1e-9  # of the natural size of a margin's derivative
BACK = 1e-8  # of the last step: just before a switch
GRAZING = 1e-4  # of the mean rate of a margin over its last step


# --------------------------------------------------------------------------- machines that note
# The loop passes its parameters to all functions of a system: here these are traced ones.
def flow(t: float, y: Vector, mode: list[int], held: Vector, p: Traced, dy: Vector) -> None:
    """Fill the rates of a state."""
    p.functions.flow(t, y, mode, held, p.functions.p, dy)


def arm(t: float, y: Vector, mode: list[int], p: Traced, held: Vector, watch: list[int]) -> None:
    """Hold signs, and flag what is watched."""
    p.functions.arm(t, y, mode, p.functions.p, held, watch)


def margins(t: float, y: Vector, mode: list[int], p: Traced, watch: list[int], out: Vector) -> None:
    """Fill margins."""
    p.functions.margins(t, y, mode, p.functions.p, watch, out)


def normal(k: int, t: float, y: Vector, mode: list[int], p: Traced, out: Vector) -> None:
    """Fill a normal."""
    p.functions.normal(k, t, y, mode, p.functions.p, out)


def follow(t: float, y: Vector, mode: list[int], held: Vector, p: Traced) -> None:
    """Set what others determine."""
    p.functions.follow(t, y, mode, held, p.functions.p)


def ask(t: float, y: Vector, mode: list[int], p: Traced, jolt: list[int], edges: list[int]) -> None:
    """Ask the machines."""
    p.machines.ask(t, y, mode, p.functions.p, jolt, edges)


def observe(t: float, y: Vector, mode: list[int], signs: Vector, p: Traced, seen: Vector) -> None:
    """Observe a state."""
    p.machines.observe(t, y, mode, signs, p.functions.p, seen)


def jolts(
    t: float,
    y: Vector,
    mode: list[int],
    p: Traced,
    floor: Vector,
    mark: int,
    was: Vector,
    jolt: list[int],
) -> None:
    """Compare velocities."""
    p.machines.jolts(t, y, mode, p.functions.p, floor, mark, was, jolt)


def act(edge: int, machine: int, t: float, y: Vector, mode: list[int], p: Traced) -> None:
    """Take an edge, and the tangents through it."""
    c, w = p.course, p.lanes
    if c.changed > 1:
        _await(p, edge, machine, y, mode)
    place = c.firings[c.fired]
    for q in range(len(c.t_t)):
        place[q] = c.t_t[q]
    c.fired += 1
    for group in range(groups_of(p)):
        _take_moving(p, group, y, mode)
        p.tangents.act(edge, machine, t, w.now.y, w.mode, p.functions.p, w.t, (w.shared, w.own))
        put_group(p, group)
    p.machines.act(edge, machine, t, y, mode, p.functions.p)


def tick(bits: int, t: float, y: Vector, mode: list[int], p: Traced) -> None:
    """Let something tick, and the tangents with it."""
    w = p.lanes
    for group in range(groups_of(p)):
        _take_moving(p, group, y, mode)
        p.tangents.tick(bits, t, w.now.y, w.mode, p.functions.p, w.t, (w.shared, w.own))
        put_group(p, group)
    p.machines.tick(bits, t, y, mode, p.functions.p)


def _take_moving(p: Traced, group: int, y: Vector, mode: list[int]) -> None:
    """Put the tangents of a group at the moving instant into its lanes."""
    w, lanes = p.lanes, len(p.lanes.t)
    take_group(p, group, y)
    for lane in range(lanes):
        w.t[lane] = p.course.t_t[group * lanes + lane]
    for i in range(len(mode)):
        w.mode[i] = mode[i]


def functions_of(traced: Traced) -> Functions:
    """Return the functions of a system with traced parameters."""
    return Functions(flow, arm, margins, normal, follow, traced)


# --------------------------------------------------------------------------- back to a fixed time
def slide_as(own: Sliding, sliding: Sliding) -> None:
    """Note what a motion slides on."""
    own.count = sliding.count
    for c in range(len(own.which)):
        own.which[c] = sliding.which[c]
    for k in range(len(own.flags)):
        own.flags[k] = sliding.flags[k]


def arm_here(on: Held, mode: list[int]) -> None:
    """Hold the signs that an arc starting here would hold."""
    c: TangentCourse = on.functions.p.course
    for r in range(len(c.armed)):
        c.armed[r] = 0
    arm_on(on, c.t, c.y, mode, c.armed)


def rate_of_instant(on: Held, mode: list[int]) -> None:
    """Fill dy/dt at this instant; 0 if it does not move."""
    c: TangentCourse = on.functions.p.course
    if c.moving:
        flow_on(c.t, c.y, mode, c.held, on, c.f)
    else:
        for j in range(len(c.f)):
            c.f[j] = 0.0


def fix(on: Held, mode: list[int]) -> None:
    """Bring the tangents to a fixed time, onto surfaces slid on, and to what locks hold."""
    traced: Any = on.functions.p
    c, w = traced.course, traced.lanes
    if c.moving:
        rate_of_instant(on, mode)
        for j in range(len(c.f)):
            for q in range(len(c.t_t)):
                c.S[j][q] -= c.f[j] * c.t_t[q]
    if len(on.sliding.which) > 0 and on.sliding.count > 0:
        _onto(on, mode)
    if traced.locks[0] > 0:
        for group in range(groups_of(traced)):
            take_group(traced, group, c.y)
            p = traced.functions.p
            traced.tangents.follow(c.t, w.now.y, mode, c.held, p, w.t, (w.shared, w.own))
            put_group(traced, group)
    for j in range(len(c.f)):
        c.S[j][traced.wide[0]] = 0.0
    c.moving = 0
    c.settled = c.t
    for q in range(len(c.t_t)):
        c.t_before[q] = c.t_t[q]
        c.t_t[q] = 0.0


def _onto(on: Held, mode: list[int]) -> None:
    """Put tangents on the surfaces slid on: what leads off them has come back at once."""
    traced: Any = on.functions.p
    c, w, sliding = traced.course, traced.lanes, on.sliding
    s, lanes, count, size = w.slide, len(w.t), sliding.count, len(c.y)
    for r in range(len(c.armed)):
        c.armed[r] = 0
    for r in range(count):
        c.armed[sliding.surfaces.above[sliding.which[r]]] = 1
    for group in range(groups_of(traced)):
        take_group(traced, group, c.y)
        slide_in_lanes(on, c.t, w.now.y, mode, w.now.f)
        p, numbers = traced.functions.p, (w.shared, w.own)
        traced.tangents.margins(
            c.t, w.now.y, mode, p, c.armed, w.margins, w.t, numbers, w.margins_t
        )
        for lane in range(lanes):
            put_gains(sliding, size)
            for r in range(count):
                above = sliding.surfaces.above[sliding.which[r]]
                sliding.matrix[r][count] = w.margins_t[above * lanes + lane]
            solve(sliding.matrix, count, s.solved, INFINITY)
            for k in range(count):
                back = s.solved[k] if abs(s.solved[k]) < INFINITY else 0.0
                for j in range(size):
                    w.now.y[size + j * lanes + lane] -= back * sliding.halves[k][j]
        put_group(traced, group)


# --------------------------------------------------------------------------- a moving instant
def arrive(on: Held) -> None:
    """Go from a fixed time to the moving instant of a crossing."""
    traced: Any = on.functions.p
    c = traced.course
    flow_on(c.t, c.y, c.mode, c.held, on, c.f)
    _move_instants(on, c.mode, c.watch)
    if c.t - c.settled <= SHORT * tick_at(c.t):
        _at_once(on)
    else:
        _check(on)
    first = _first(c.watch)
    for q in range(len(c.t_t)):
        c.t_t[q] = c.slopes[first][q]
        c.moving = 1 if c.moving or c.t_t[q] != 0.0 else 0
    for j in range(len(c.f)):
        for q in range(len(c.t_t)):
            if c.t_t[q] != 0.0:
                c.S[j][q] += c.f[j] * c.t_t[q]


def _first(watch: list[int]) -> int:
    """Return the first comparison that is flagged."""
    found = -1
    for r in range(len(watch)):
        if found < 0 and watch[r] > 0:
            found = r
    return found


def _move_instants(on: Held, mode: list[int], watch: list[int]) -> None:
    """Find for each comparison how far its zero is from the instant, and its rate.

    What is flat behind its zero, as max(N, 0), is taken from just before it.
    """
    traced: Any = on.functions.p
    c = traced.course
    time = traced.wide[0]
    _slopes(on, c.t, 0.0, mode, watch)
    flat = 0
    for r in range(len(watch)):
        c.armed[r] = 1 if watch[r] > 0 and c.slopes[r][time] == 0.0 else 0
        flat += c.armed[r]
    back = max(BACK * (c.t - c.before), SHORT * tick_at(c.t))
    if flat > 0 and back < c.t - c.settled:
        _slopes(on, c.t - back, back, mode, c.armed)
    for r in range(len(watch)):
        if watch[r] > 0:
            row = c.slopes[r]
            c.rates[r] = row[time]
            for q in range(len(row)):
                if row[q] != 0.0:
                    row[q] = -row[q] / c.rates[r] if c.rates[r] != 0.0 else NAN
            row[time] = 0.0


def _slopes(on: Held, t: float, back: float, mode: list[int], watch: list[int]) -> None:
    """Fill the derivatives of margins in each direction, at a time that is a little back."""
    traced: Any = on.functions.p
    c, w, time = traced.course, traced.lanes, traced.wide[0]
    size, lanes = len(c.y), len(w.t)
    for group in range(len(c.moves)):
        _take_moving(traced, group, c.y, mode)
        for j in range(size):
            w.now.y[j] = c.y[j] - back * c.f[j]
        own = time - group * lanes
        if own >= 0 and own < lanes:
            w.t[own] = 1.0
            for j in range(size):
                w.now.y[size + j * lanes + own] = c.f[j]
        margins_in_lanes(on, t, w.now.y, mode, watch, w)
        for r in range(len(watch)):
            if watch[r] > 0:
                for lane in range(lanes):
                    c.slopes[r][group * lanes + lane] = w.margins_t[r * lanes + lane]


def _at_once(on: Held) -> None:
    """Let what changes right after a switch, because of it, change with it.

    Its margin is zero at that switch, also after a change of the numbers. From there it may grow as
    the square of the time, so that its rate says nothing.
    """
    traced: Any = on.functions.p
    c, w = traced.course, traced.lanes
    size, lanes = len(c.y), len(w.t)
    for r in range(len(c.margins)):
        c.margins[r] = 0.0
    for first in range(size):  # the natural size of its derivative, by components
        for k in range(len(w.now.y)):
            w.now.y[k] = c.y[k] if k < size else 0.0
        for k in range(len(w.shared)):
            w.shared[k] = 0.0
        for k in range(len(w.own)):
            for i in range(len(w.own[k])):
                w.own[k][i] = 0.0
        for lane in range(lanes):
            w.t[lane] = 0.0
        w.now.y[size + first * lanes] = c.sizes[first]
        margins_in_lanes(on, c.t, w.now.y, c.mode, c.watch, w)
        for r in range(len(c.watch)):
            if c.watch[r] > 0:
                c.margins[r] += abs(w.margins_t[r * lanes])
    for r in range(len(c.watch)):
        if c.watch[r] > 0:
            row = c.slopes[r]
            for q in range(traced.wide[0]):
                left = abs(c.rates[r] * (c.t_before[q] - row[q]))
                if not left > NOTHING * c.margins[r] / c.scales[q]:
                    row[q] = c.t_before[q]


def _check(on: Held) -> None:
    """Note a crossing that grazes, or that is several ones at once."""
    traced: Any = on.functions.p
    c, wide = traced.course, traced.wide[0]
    if c.t > c.before and wide > 0:
        slowest, grazes = -1, 0
        margins_on(c.before, c.y_before, c.mode, on, c.watch, c.margins)
        w = traced.lanes
        margins_on(c.t, c.y, c.mode, on, c.watch, w.margins)
        for r in range(len(c.watch)):
            if c.watch[r] > 0:
                mean = abs(w.margins[r] - c.margins[r]) / (c.t - c.before)
                if abs(c.rates[r]) < GRAZING * mean:
                    slowest = r if slowest < 0 else slowest
                    grazes = 1 if c.rates[r] != 0.0 else grazes
        if slowest >= 0:
            doubt(c, GRAZES if grazes > 0 else JUMPS, c.t, slowest)
            for r in range(len(c.watch)):
                if c.watch[r] > 0:
                    for q in range(wide):
                        c.slopes[r][q] = NAN
    apart = 0
    for q in range(wide):
        low, high = INFINITY, -INFINITY
        for r in range(len(c.watch)):
            if c.watch[r] > 0:
                low, high = min(low, c.slopes[r][q]), max(high, c.slopes[r][q])
        if high - low > ALIKE * max(abs(low), abs(high)) + ROUNDING * c.span / c.scales[q]:
            apart = 1
    if apart > 0:
        doubt(c, TIE, c.t, -1)


def doubt(c: TangentCourse, kind: int, t: float, only: int) -> None:
    """Note a doubt about some comparisons, or only one."""
    for r in range(len(c.watch)):
        if c.watch[r] > 0 and (only < 0 or only == r):
            c.doubt_names[c.named] = r
            c.named += 1
    c.doubt_t[c.doubts], c.doubt_kind[c.doubts], c.doubt_end[c.doubts] = t, kind, c.named
    c.doubts += 1


def _await(p: Traced, edge: int, machine: int, y: Vector, mode: list[int]) -> None:
    """Go on to the instant of an edge, where it does not wait for what came first."""
    c = p.course
    guard, first = c.guards[c.first_guards[machine] + edge], -1
    for k in range(len(guard)):
        if first < 0 and guard[k] >= 0:
            first = guard[k] if c.watch[guard[k]] > 0 else -1
    if first >= 0:
        on = Held(functions_of(p), c.held, c.sliding)
        slid = c.sliding.count
        c.sliding.count = 0
        for j in range(len(y)):
            c.y[j] = y[j]
        arm_here(on, mode)
        flow_on(c.t, c.y, mode, c.held, on, c.f)
        for r in range(len(c.only)):
            c.only[r] = 1 if r == first else 0
        _move_instants(on, mode, c.only)
        later, apart = c.slopes[first], 0
        for q in range(len(later)):
            size = max(abs(c.t_t[q]), abs(c.t_t[q] + later[q]))
            apart = 1 if abs(later[q]) > ALIKE * size else apart
        if apart > 0:
            for q in range(len(later)):
                for j in range(len(y)):
                    c.S[j][q] += c.f[j] * later[q]
                c.t_t[q] += later[q]
            c.moving = 1
        c.sliding.count = slid
