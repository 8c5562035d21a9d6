"""One sample of a co-simulation: inputs on straight lines from its start to its end.

The end of a sample is a knot, as in a record: steps end there, but nothing is asked, armed or
restarted. So the results are those of a run over the same samples as a record, to the last bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from integrators.advance import RunPlan
from integrators.loop import (
    ARC,
    ASK,
    FIRED,
    FIRING,
    JUMPING,
    PAUSED,
    ROWS,
    SETTLED,
    SLID,
    START,
    STOPPED,
    Buffers,
    Machines,
    run_to_event,
)
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
from integrators.steps import ArcMotion, Vector
from integrators.switching.sliding_bounds import let_go, look_back

FULL_LOG = 21  # the log is full: empty it, and call again
EXACT = 2.0**53  # up to here every whole number is a float


@dataclass(slots=True, eq=False)
class Clocks:
    """What ticks: samplers, then discrete machines, each with its bit.

    Periods and offsets are whole numbers of units, so that no sum of them is rounded.
    """

    per_second: float  # units in a second
    begin: float  # a time, s
    units: float  # after that time: their sum is the start
    period: Vector
    offset: Vector  # of each its first tick, from the start
    made: list[int]  # ticks in the plan, or past


@dataclass(slots=True, eq=False)
class Sample:
    """What a call is given, and what it finds."""

    end: float  # its time
    until: float  # where straight lines end, if later
    given: int  # how many straight lines a call gives
    waits: bool  # whether what happens just at the end, a tick or a jump, waits for the next call
    jumps: bool  # whether an input jumps at the end
    wanted: int  # place of the force among the observed values
    mean: bool  # whether the mean is wanted
    resumed: bool  # whether this call continues one that returned FULL_LOG
    switches: int  # in the log
    code: int  # what was returned
    force: float  # at the end
    impulse: float  # integral of the force over the sample, if the mean is wanted
    inputs: list[Vector]  # of each input its value at the start and at the end; never empty
    events: list[int]  # places of events among the states: 1 where one waits to be heard
    seen: Vector  # observed values at the end
    t: Vector  # of each switch its time
    machine: list[int]
    edge: list[int]
    before: Vector  # scratch space: the state at the start of a step
    middle: Vector  # ... and in its middle
    slope: Vector
    clocks: Clocks


@dataclass(slots=True, eq=False)
class ShortSample:
    """A sample of which there is one input."""

    v0: float
    v1: float
    dt: float
    t: float  # where it ends, if dt is NaN


@dataclass(slots=True, eq=False)
class ShortCall:
    """What `advance_by` and `peek_by` are given, and what they keep."""

    latest: float  # time at which a sample may end
    begin: float  # of the last sample
    last: bool  # whether that was advanced by `advance_by`
    row: int  # 0 or 1: what holds the state before it, `even` or `odd`
    given: ShortSample
    even: list[int]
    odd: list[int]


def short_call(words: int, latest: float = 0.0) -> ShortCall:
    """Return the beginning of short calls on a state of so many words."""
    given = ShortSample(0.0, 0.0, 0.0, 0.0)
    return ShortCall(latest, 0.0, False, 0, given, [0] * words, [0] * words)


def advance_by(
    functions: Functions, machines: Machines, b: Buffers, sample: Sample, short: ShortCall,
    words: list[int],
) -> float:  # fmt: skip
    """Advance by a sample and return the force; if that needs a closer look, stay: INFINITY.

    The words are all that a sample changes.
    """
    begin, given = sample.end, short.given
    end = given.t if given.dt != given.dt else begin + given.dt
    if not (begin < end and _is_plain(short, end)):
        return INFINITY
    keep_words(short, words)
    if _fails(functions, machines, b, sample, short, end):
        take_words(short, words)
        return INFINITY
    short.begin = begin
    short.row = 1 - short.row
    short.last = True
    return sample.force


def peek_by(
    functions: Functions, machines: Machines, b: Buffers, sample: Sample, short: ShortCall,
    words: list[int],
) -> float:  # fmt: skip
    """Return what `advance_by` would return, and stay."""
    end = sample.end + short.given.dt
    if not (short.given.dt >= 0.0 and _is_plain(short, end)):
        return INFINITY
    keep_words(short, words)
    failed = _fails(functions, machines, b, sample, short, end)
    force = sample.force
    take_words(short, words)
    return INFINITY if failed else force


def _is_plain(short: ShortCall, end: float) -> bool:
    """Return whether the arguments need no closer look."""
    finite = abs(short.given.v0) < INFINITY and abs(short.given.v1) < INFINITY
    return finite and end < short.latest


def _fails(
    functions: Functions, machines: Machines, b: Buffers, sample: Sample, short: ShortCall,
    end: float,
) -> bool:  # fmt: skip
    """Advance to a time; return whether that fails, or takes further calls."""
    sample.end = end
    sample.inputs[0][0] = short.given.v0
    sample.inputs[0][1] = short.given.v1
    return step_to(functions, machines, b, sample) != 0 or not abs(sample.force) < INFINITY


def keep_words(short: ShortCall, words: list[int]) -> None:
    """Keep the state, not where the one before the last sample is."""
    if short.row == 1:
        copy_words(words, short.even)
    else:
        copy_words(words, short.odd)


def take_words(short: ShortCall, words: list[int]) -> None:
    """Return to what `keep_words` kept."""
    if short.row == 1:
        copy_words(short.even, words)
    else:
        copy_words(short.odd, words)


def copy_words(source: list[int], target: list[int]) -> None:
    """Copy words to others."""
    for k in range(len(source)):
        target[k] = source[k]


def step_to(functions: Functions, machines: Machines, b: Buffers, sample: Sample) -> int:
    """Advance to the end of a sample."""
    now, memory, observe, end = b.now, b.memory, machines.observe, sample.end
    on = Held(functions, now.held, b.sliding)
    motion = ArcMotion(flow_on, margins_on, on, follow_on)
    if not sample.resumed:
        _begin(functions, b, sample)
    if len(b.plan.jumps) > 0 and sample.jumps:
        put_jump(b, sample.clocks, sample.end)
    sample.code = 0
    while now.t < end or not (memory.phase == ARC or memory.phase == SETTLED):
        if sample.waits and memory.phase == JUMPING and b.plan.jumps[memory.jump] >= end:
            break
        first = memory.phase == ASK and memory.microstep == 0
        if sample.waits and first and now.t >= end and len(memory.was) > 0:
            break  # a lock feels how fast its body speeds up, and what is given may have a corner
        t = now.t
        for j in range(len(now.y)):
            sample.before[j] = now.y[j]
        event = run_to_event(functions, machines, motion, b, 1)
        if len(b.plan.jumps) > 0 and b.plan.jumps[1] <= now.t:
            next_tick(b.plan, sample.clocks)
            memory.jump = 0
            if sample.jumps:
                put_jump(b, sample.clocks, sample.end)
        if sample.mean and now.t > t:
            impulse = _impulse(machines, motion, b, sample, t)
            sample.impulse += impulse
        if event == FIRED:
            row = sample.switches
            sample.t[row] = now.t
            sample.machine[row] = memory.machine
            sample.edge[row] = memory.edge
            sample.switches = row + 1
            if row + 1 == len(sample.t):
                sample.code = FULL_LOG
                return FULL_LOG
        elif event not in (ROWS, FIRING, STOPPED, SLID, PAUSED):
            sample.code = event
            return event
    if memory.phase == SETTLED and now.seen < now.t:  # what is before the jump has switched
        memory.phase = JUMPING
    look(observe, on, now.t, now.y, now.mode, sample.seen)
    sample.force = sample.seen[sample.wanted]
    return 0


def next_tick(plan: RunPlan, clocks: Clocks) -> None:
    """Put a further tick into the plan, which has two: the last one, and the next one."""
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


def put_jump(b: Buffers, clocks: Clocks, t: float) -> None:
    """Put a jump before the next tick into the plan, if the time is before it."""
    plan, now, memory = b.plan, b.now, b.memory
    if now.t < t and t < plan.jumps[1]:
        for i in range(len(clocks.made)):
            if plan.ticks[1] & (1 << i):
                clocks.made[i] -= 1  # it will be the next one again
        plan.jumps[1] = t
        plan.ticks[1] = 0
        plan.before_jumps[1] = math.nextafter(t, -INFINITY)
        if memory.phase == ARC:
            now.seen = plan.before_jumps[1]
            now.t_stop = t


def _due(clocks: Clocks, i: int) -> float:
    """Return the next tick of a clock."""
    units = clocks.units + clocks.offset[i] + clocks.made[i] * clocks.period[i]
    return clocks.begin + units / clocks.per_second


def restart(b: Buffers, clocks: Clocks) -> None:
    """Let all clocks begin at the time in the buffers; put the first two ticks into the plan."""
    t, plan = b.now.t, b.plan
    clocks.begin, clocks.units = t, 0.0
    units = t * clocks.per_second
    if abs(units) < EXACT:
        whole = int(units + 0.5) if units > 0.0 else int(units - 0.5)
        if whole / clocks.per_second == t:
            clocks.begin, clocks.units = 0.0, float(whole)
    for i in range(len(clocks.made)):
        clocks.made[i] = 0
    if len(plan.jumps) > 0:
        next_tick(plan, clocks)
        if plan.jumps[1] <= t:
            next_tick(plan, clocks)
        else:
            plan.jumps[0] = -INFINITY  # none yet
            plan.ticks[0] = 0


def _begin(functions: Functions, b: Buffers, sample: Sample) -> None:
    """Write the straight lines; where an input jumps or an event waits, guards are asked again."""
    now, memory, end = b.now, b.memory, sample.end
    _shared, _own, tables = functions.p
    start = now.t
    if memory.phase == JUMPING:  # the last sample has waited
        start = b.plan.jumps[memory.jump]
    first = 1 if start >= end else 0  # of a sample without length only its end matters
    on, jumps = Held(functions, now.held, b.sliding), False
    for k in range(sample.given):
        last = len(tables[2 * k]) - 1
        jumps = jumps or tables[2 * k + 1][last] != sample.inputs[k][first]
    for place in sample.events:
        jumps = jumps or now.y[place] != 0.0
    jumps = jumps and memory.phase != START and memory.phase != JUMPING
    if jumps:
        look_back(on, now, b.relations)
    for k in range(sample.given):
        times, values, given = tables[2 * k], tables[2 * k + 1], sample.inputs[k]
        last = len(times) - 1
        # With three corners what was before stays: the loop looks back at it.
        values[0] = values[last]
        times[0] = start
        values[last - 1] = given[0]
        times[last - 1] = start
        values[last] = given[1]
        times[last] = max(end, sample.until)
    if jumps:
        memory.phase = ASK
        let_go(on, now, b.relations)
    now.pause = end
    now.latest = abs(end)
    b.plan.knots[0] = end
    b.out.next_knot = 0
    b.out.steps = 0
    sample.switches = 0
    sample.impulse = 0.0


def _impulse(machines: Machines, motion: ArcMotion, b: Buffers, sample: Sample, t: float) -> float:
    """Return the integral of the force over the step from t, with the signs held in it (Simpson).

    The state in the middle is on the cubic through both ends.
    """
    now, on, place = b.now, motion.p, sample.wanted
    before, middle, slope, first = sample.before, sample.middle, sample.slope, b.scratch.k[0]
    h = now.t - t
    motion.flow(now.t, now.y, now.mode, now.held, motion.p, slope)
    for j in range(len(now.y)):
        middle[j] = 0.5 * (before[j] + now.y[j]) + 0.125 * h * (first[j] - slope[j])
    look_held(machines.observe, on, t, before, now.mode, sample.seen)
    total = sample.seen[place]
    look_held(machines.observe, on, t + 0.5 * h, middle, now.mode, sample.seen)
    total += 4.0 * sample.seen[place]
    look_held(machines.observe, on, now.t, now.y, now.mode, sample.seen)
    return h * (total + sample.seen[place]) / 6.0
