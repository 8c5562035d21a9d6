"""One sample of somebody else's loop: inputs on straight lines from its start to its end.

The end of a sample is a knot, as in a record: steps end there, but nothing is asked, armed or
restarted. So the results are those of a run over the same samples as a record, to the last bit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from integrators.advance import NEXT_KNOT, STEPS, Plan
from integrators.loop import (
    ARC,
    ASK,
    EDGE,
    FIRED,
    FIRING,
    JUMP,
    MACHINE,
    PAUSED,
    PHASE,
    ROWS,
    SETTLED,
    SLID,
    START,
    STOPPED,
    Buffers,
    Machines,
    run_to_event,
)
from integrators.seizing import let_go, look_back
from integrators.sliding import (
    Functions,
    Held,
    flow_on,
    follow_on,
    look,
    look_held,
    margins_on,
)
from integrators.step_size import INFINITY
from integrators.steps import LATEST, PAUSE, Motion, T, Vector

__all__ = [
    "CODE",
    "FULL_LOG",
    "MEAN",
    "RESUMED",
    "SWITCHES",
    "Clocks",
    "Sample",
    "next_tick",
    "restart",
    "step_to",
]

FULL_LOG = 21  # the log is full: empty it, and call again
# Indices into Sample.counts: switches in the log; whether this call continues one that returned
# FULL_LOG; whether the mean is wanted; what was returned.
SWITCHES, RESUMED, MEAN, CODE = range(4)
EXACT = 2.0**53  # up to here every whole number is a float


class Clocks(NamedTuple):
    """What ticks: samplers, then discrete machines, each with its bit.

    Periods and offsets are whole numbers of units, so that no sum of them is rounded.
    """

    per_second: Vector  # [units in a second]
    period: Vector
    offset: Vector  # of each its first tick, from the start
    begin: Vector  # [time, units]: their sum is the start
    made: list[int]  # ticks in the plan, or past


class Sample(NamedTuple):
    """What a call is given, and what it finds."""

    end: Vector  # [time]
    inputs: list[Vector]  # of each input its value at the start and at the end; never empty
    counts: list[int]  # see the indices above
    wanted: list[int]  # [place of the force among the observed values]
    force: Vector  # [at the end, integral over the sample]
    seen: Vector  # observed values at the end
    t: Vector  # of each switch its time
    machine: list[int]
    edge: list[int]
    before: Vector  # scratch space: the state at the start of a step
    middle: Vector  # ... and in its middle
    slope: Vector
    clocks: Clocks


def step_to(functions: Functions, machines: Machines, b: Buffers, sample: Sample) -> int:
    """Advance to the end of a sample.

    Parameters
    ----------
    functions, machines
        The system; its inputs are the corner tables among its parameters.
    b : Buffers
        The state, changed in place. The plan has one knot and no end.
    sample : Sample
        What is given and found. A sample that has no length shows the force at its end.

    Returns
    -------
    int
        0 at its end, FULL_LOG, or an error as in `run_to_event`.
    """
    now, counts, observe = b.now, b.memory.counts, machines.observe
    clock, done = now.clock, sample.counts
    end = sample.end[0]
    on = Held(functions, now.held, b.sliding)
    motion = Motion(flow_on, margins_on, on, follow_on)
    if done[RESUMED] == 0:
        _begin(functions, b, sample)
    done[CODE] = 0
    while clock[T] < end or not (counts[PHASE] == ARC or counts[PHASE] == SETTLED):
        t = clock[T]
        for j in range(len(now.y)):
            sample.before[j] = now.y[j]
        event = run_to_event(functions, machines, motion, b, 1)
        if len(b.plan.jumps) > 0 and b.plan.jumps[1] <= clock[T]:
            next_tick(b.plan, sample.clocks)
            counts[JUMP] = 0
        if done[MEAN] > 0 and clock[T] > t:
            impulse = _impulse(machines, motion, b, sample, t)
            sample.force[1] += impulse
        if event == FIRED:
            row = done[SWITCHES]
            sample.t[row] = clock[T]
            sample.machine[row] = counts[MACHINE]
            sample.edge[row] = counts[EDGE]
            done[SWITCHES] = row + 1
            if row + 1 == len(sample.t):
                done[CODE] = FULL_LOG
                return FULL_LOG
        elif event not in (ROWS, FIRING, STOPPED, SLID, PAUSED):
            done[CODE] = event
            return event
    look(observe, on, clock[T], now.y, now.mode, sample.seen)
    sample.force[0] = sample.seen[sample.wanted[0]]
    return 0


def next_tick(plan: Plan, clocks: Clocks) -> None:
    """Put a further tick into the plan, which has two: the last one, and the next one.

    Parameters
    ----------
    plan : Plan
        Its jumps are these ticks.
    clocks : Clocks
        What ticks, at least one.
    """
    plan.jumps[0] = plan.jumps[1]
    plan.ticks[0] = plan.ticks[1]
    t = INFINITY
    for i in range(len(clocks.period)):
        t = min(t, _due(clocks, i))
    bits = 0
    for i in range(len(clocks.period)):
        if _due(clocks, i) <= t:
            bits |= 1 << i
            clocks.made[i] += 1
    plan.jumps[1] = t
    plan.ticks[1] = bits
    # A step that ends on a jump would see the value after it: stop one clock tick before.
    plan.before_jumps[0] = plan.before_jumps[1]
    plan.before_jumps[1] = math.nextafter(t, -INFINITY)


def _due(clocks: Clocks, i: int) -> float:
    """Return the next tick of a clock."""
    units = clocks.begin[1] + clocks.offset[i] + clocks.made[i] * clocks.period[i]
    return clocks.begin[0] + units / clocks.per_second[0]


def restart(b: Buffers, clocks: Clocks) -> None:
    """Let all clocks begin at the time in the buffers, and put the first two ticks into the plan.

    Parameters
    ----------
    b : Buffers
        Their plan has room for two ticks, or for none if nothing ticks.
    clocks : Clocks
        What ticks.
    """
    t, plan = b.now.clock[T], b.plan
    clocks.begin[0], clocks.begin[1] = t, 0.0
    units = t * clocks.per_second[0]
    if abs(units) < EXACT:
        whole = int(units + 0.5) if units > 0.0 else int(units - 0.5)
        if whole / clocks.per_second[0] == t:
            clocks.begin[0], clocks.begin[1] = 0.0, float(whole)
    for i in range(len(clocks.made)):
        clocks.made[i] = 0
    for _k in range(len(plan.jumps)):
        next_tick(plan, clocks)


def _begin(functions: Functions, b: Buffers, sample: Sample) -> None:
    """Write the straight lines; where an input jumps, guards are asked again."""
    clock, counts, end = b.now.clock, b.memory.counts, sample.end[0]
    _shared, _own, tables = functions.p
    first = 1 if clock[T] >= end else 0  # of a sample without length only its end matters
    on, jumps = Held(functions, b.now.held, b.sliding), False
    for k in range(len(tables) // 2):
        jumps = jumps or tables[2 * k + 1][1] != sample.inputs[k][first]
    jumps = jumps and counts[PHASE] != START
    if jumps:
        look_back(on, b.now, b.relations)
    for k in range(len(tables) // 2):
        times, values, given = tables[2 * k], tables[2 * k + 1], sample.inputs[k]
        times[0] = clock[T]
        times[1] = end
        values[0] = given[0]
        values[1] = given[1]
    if jumps:
        counts[PHASE] = ASK
        let_go(on, b.now, b.relations)
    clock[PAUSE] = end
    clock[LATEST] = abs(end)
    b.plan.knots[0] = end
    b.out.cursor[NEXT_KNOT] = 0
    b.out.cursor[STEPS] = 0
    sample.counts[SWITCHES] = 0
    sample.force[1] = 0.0


def _impulse(machines: Machines, motion: Motion, b: Buffers, sample: Sample, t: float) -> float:
    """Return the integral of the force over the step from t, with the signs held in it (Simpson).

    The state in the middle is on the cubic through both ends.
    """
    now, on, place = b.now, motion.p, sample.wanted[0]
    before, middle, slope, first = sample.before, sample.middle, sample.slope, b.scratch.k[0]
    h = now.clock[T] - t
    motion.flow(now.clock[T], now.y, now.mode, now.held, motion.p, slope)
    for j in range(len(now.y)):
        middle[j] = 0.5 * (before[j] + now.y[j]) + 0.125 * h * (first[j] - slope[j])
    look_held(machines.observe, on, t, before, now.mode, sample.seen)
    total = sample.seen[place]
    look_held(machines.observe, on, t + 0.5 * h, middle, now.mode, sample.seen)
    total += 4.0 * sample.seen[place]
    look_held(machines.observe, on, now.clock[T], now.y, now.mode, sample.seen)
    return h * (total + sample.seen[place]) / 6.0
