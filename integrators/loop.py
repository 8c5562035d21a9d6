"""The outer loop as a function that runs until something happens, then comes back.

Ask every machine for an enabled edge, fire, ask again until all is quiet; then freeze the states
and let the kernel advance to the next stop. All memory lies in arrays, so that the loop can come
back at every event and be called again: Python's generator (`integrators.hybrid`) hands each event
to its listener, the compiled engine (`record`) writes it into columns.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from integrators.advance import (
    CROSSED,
    FULL,
    NEXT_TIME,
    NOT_FINITE,
    REACHED,
    ROW,
    STEPS,
    TOO_SMALL,
    Output,
    Plan,
    advance,
    put_row,
    raise_floor,
)
from integrators.crossings import Watched, listed
from integrators.sliding import (
    Functions,
    Held,
    Sliding,
    flow_on,
    look,
    margins_on,
    seize,
)
from integrators.step_size import error_norm, starting_step
from integrators.steps import (
    ANCHOR,
    ERROR_BEFORE,
    SWITCHED,
    T_STOP,
    H,
    Motion,
    Now,
    Scratch,
    T,
    Vector,
)

__all__ = [
    "MOST_SWITCHES",
    "Buffers",
    "Log",
    "Machines",
    "Memory",
    "Switch",
    "record",
    "run_to_event",
]

MOST_SWITCHES = 100  # of one machine, or of one relation, without progress
# Switches make no progress where they follow each other by less than this part of the time itself
CLOCK_STANDS = 1e-9
# ... or by less than this, while the state moves by less than a tenth of its tolerance a switch.
CLOCK_CRAWLS = 1e-6
STATE_STANDS = 0.1

# What happened (TOO_SMALL and NOT_FINITE are the kernel's).
ROWS, FIRING, FIRED, STOPPED, DONE, SLID = 10, 11, 12, 13, 14, 15
MACHINE_LIVELOCK, RELATION_LIVELOCK, ADVANCE, TOO_MANY_STEPS = 16, 17, 18, 19
NOTHING = -1  # yet
# Places in Memory.counts.
PLACES = 11
PHASE, MICROSTEP, MACHINE, EDGE, FIRED_ONE, FRESH, STATUS, JUMP, ACTIVE, TAKEN, NEW_ARC = range(
    PLACES
)
# Phases.
START, ASK, PICK, FIRE, SETTLED, BEGIN, ARC, AFTER, JUMPING, FINISH, END = range(11)
# Places in Log.counts.
FIRINGS, STOPS = 0, 1


class Switch(Protocol):
    """The machines, as the loop sees them."""

    def ask(self, t: float, y: Vector, mode: list[int], p: Any, edges: list[int]) -> None:
        """Fill the first enabled edge of each machine, or -1."""

    def act(self, edge: int, machine: int, t: float, y: Vector, mode: list[int], p: Any) -> None:
        """Take an edge: update mode, and y if the edge assigns something."""


class Machines(NamedTuple):
    """A `Switch` of two functions, and what a firing is seen by."""

    ask: Callable[..., Any]
    act: Callable[..., Any]
    observe: Callable[..., Any]  # observe(t, y, mode, signs, p, seen)


class Memory(NamedTuple):
    """What the loop remembers between two calls."""

    counts: list[int]  # see the places above
    edges: list[int]  # the enabled edge of each machine, or -1
    switches: list[int]  # firings of each machine since the time Now.clock[ANCHOR]
    changes: list[int]  # changes of each relation since then
    anchor: Vector  # the state then


class Buffers(NamedTuple):
    """All that one run needs besides the system's functions; changed in place."""

    plan: Plan
    now: Now
    memory: Memory
    relations: Watched
    sliding: Sliding
    out: Output
    scratch: Scratch


class Log(NamedTuple):
    """Columns that `record` fills: one entry a firing, and both sides of every stop."""

    counts: list[int]  # [firings, stops]
    t: Vector
    machine: list[int]
    edge: list[int]
    numbers: list[Vector]  # [own variable, seen 0, own seen, seen 1 before, seen 1 after]
    seen: Vector  # scratch of `observe`
    rows_microstep: list[int]  # beside the rows of Output
    rows_mode: list[list[int]]  # of each machine, then for each surface whether it is slid on
    stops_t: Vector
    stops_microstep: list[int]
    stops_y: list[Vector]
    stops_mode: list[list[int]]


def run_to_event(
    functions: Functions, switch: Switch, motion: Motion, b: Buffers, most_steps: int
) -> int:
    """Run until something happens.

    Parameters
    ----------
    functions : Functions
        The system.
    switch : Switch
        Its machines.
    motion : Motion
        How to flow and what is watched: `flow_on`, `margins_on` and a `Held`. While nothing is slid
        on, those of the system itself do the same in less time.
    b : Buffers
        The run, changed in place.
    most_steps : int
        Come back after so many steps at most.

    Returns
    -------
    int
        ROWS (to be taken, all of the present mode; possibly none when the steps are used up),
        FIRING (before) and FIRED (after an edge), STOPPED (a crossing, either side of a jump),
        SLID (onto a surface or off it), ADVANCE (a foreign solver is to go on), DONE; or the error
        TOO_SMALL, NOT_FINITE, MACHINE_LIVELOCK, RELATION_LIVELOCK, TOO_MANY_STEPS.
    """
    plan, now, memory = b.plan, b.now, b.memory
    relations, sliding, scratch = b.relations, b.sliding, b.scratch
    clock, counts, p = now.clock, memory.counts, functions.p
    out, cursor = b.out, b.out.cursor
    while True:
        if cursor[ROW] > counts[TAKEN]:
            return ROWS
        phase, event = counts[PHASE], NOTHING
        if phase == ASK:
            switch.ask(clock[T], now.y, now.mode, p, memory.edges)
            counts[MACHINE] = -1
            counts[FIRED_ONE] = 0
            counts[PHASE] = PICK
        elif phase == PICK:
            event = _pick(plan, counts, memory.edges)
        elif phase == FIRE:
            switch.act(counts[EDGE], counts[MACHINE], clock[T], now.y, now.mode, p)
            event = _fired(plan, now, memory, scratch)
        elif phase == SETTLED:
            _choose_stop(plan, clock, counts)
            if plan.located and counts[PHASE] == BEGIN:
                event = _rearm(functions, now, relations, sliding, counts)
        elif phase == BEGIN:
            event = _begin_arc(motion, plan, now, scratch, counts)
        elif phase == ARC:
            steps = _steps_ahead(plan, cursor, most_steps)
            if steps > 0 and not plan.foreign:
                w = listed(relations, counts[ACTIVE])
                counts[STATUS] = advance(motion, plan, now, w, out, scratch, steps)
            event = _flowed(plan, counts, steps)
        elif phase == AFTER:
            often = False
            if counts[STATUS] == CROSSED:
                w = listed(relations, counts[ACTIVE])
                often = _often_changed(motion, plan, now, w, sliding, memory, scratch)
            event = _end_arc(plan, clock, counts, often)
        elif phase == JUMPING:
            event = _jump(plan, now, counts, out)
        elif phase == START:
            _start(plan, now, counts, out)
        elif phase == FINISH:
            _finish(now, counts, out)
        else:
            return DONE
        if event != NOTHING:
            return event


# --------------------------------------------------------------------------- one helper per phase
# They are handed what they need, not all the buffers: a call hands on every array by itself.
def _start(plan: Plan, now: Now, counts: list[int], out: Output) -> None:
    counts[PHASE] = ASK
    counts[FRESH] = 1
    raise_floor(plan.control, now)
    if out.every_step:
        put_row(out, now.clock[T], now.y)


def _pick(plan: Plan, counts: list[int], edges: list[int]) -> int:
    """Find the next machine with an enabled edge."""
    i = counts[MACHINE] + 1
    while i < len(edges) and edges[i] < 0:
        i += 1
    if i < len(edges):
        counts[MACHINE] = i
        counts[EDGE] = edges[i]
        counts[PHASE] = FIRE
        return FIRING
    counts[PHASE] = ASK if counts[FIRED_ONE] == 1 and plan.located else SETTLED
    return NOTHING


def _fired(plan: Plan, now: Now, memory: Memory, scratch: Scratch) -> int:
    """Count the edge just taken."""
    counts, i = memory.counts, memory.counts[MACHINE]
    counts[MICROSTEP] += 1
    counts[FIRED_ONE] = 1
    counts[FRESH] = 1
    counts[PHASE] = PICK
    _look_at_clock(now, memory)
    memory.switches[i] += 1
    if memory.switches[i] >= MOST_SWITCHES and _no_progress(plan, now, memory, scratch):
        counts[PHASE] = AFTER
        counts[STATUS] = MACHINE_LIVELOCK
    return FIRED


def _choose_stop(plan: Plan, clock: Vector, counts: list[int]) -> None:
    """All machines are quiet: on to the next jump, or to the end."""
    t, jumps = clock[T], plan.jumps
    if t >= plan.t_end:
        counts[PHASE] = FINISH
        return
    # A step that ends on a jump would see the value behind it: stop one clock tick before.
    while counts[JUMP] < len(jumps) and jumps[counts[JUMP]] <= t:
        counts[JUMP] += 1
    clock[T_STOP] = plan.t_end
    if counts[JUMP] < len(jumps):
        clock[T_STOP] = min(clock[T_STOP], plan.before_jumps[counts[JUMP]])
    counts[STATUS] = FULL
    counts[PHASE] = BEGIN


def _rearm(
    functions: Functions, now: Now, relations: Watched, sliding: Sliding, counts: list[int]
) -> int:
    """Hold signs, choose what to watch and to slide on, remember the truth of what is watched."""
    surfaces, watch, p = sliding.surfaces, relations.watch, functions.p
    t, y = now.clock[T], now.y
    mode, held = now.mode, now.held
    for a in range(counts[ACTIVE]):
        watch[relations.room[a]] = 0
    functions.arm(t, y, mode, p, held, watch)
    w = _list(relations, counts)
    functions.margins(t, y, mode, p, watch, w.start)
    slid = False
    if len(surfaces.sign) > 0:
        on = Held(functions, held, sliding)
        slid = seize(on, now, w)
        count = sliding.which[-1]
        if count > 0:
            first = len(watch) - 2 * len(sliding.sigma)
            for c in range(count):
                k = sliding.which[c]
                watch[surfaces.above[k]] = watch[surfaces.at_least[k]] = 0
                watch[first + 2 * c] = watch[first + 2 * c + 1] = 1
            w = _list(relations, counts)
            margins_on(t, y, mode, on, watch, w.start)
    for r in w.active:
        g = w.start[r]
        w.truth[r] = g > 0.0 or (g == 0.0 and not w.strict[r])
    for k in range(len(surfaces.sign)):  # one met exactly is left to the side of its sign
        sign = held[surfaces.sign[k]]
        if watch[surfaces.above[k]] and sign != 0.0:
            w.truth[surfaces.above[k]] = w.truth[surfaces.at_least[k]] = sign > 0.0
    if _undefined(w):
        counts[PHASE] = AFTER
        counts[STATUS] = NOT_FINITE
    elif slid:  # y lies on the surface now: whoever compares with it has to be asked again
        counts[PHASE] = ASK
        return SLID
    return NOTHING


def _list(relations: Watched, counts: list[int]) -> Watched:
    """List the flagged relations."""
    active = 0
    for r in range(len(relations.watch)):
        if relations.watch[r]:
            relations.room[active] = r
            active += 1
    counts[ACTIVE] = active
    return listed(relations, active)


def _undefined(w: Watched) -> bool:
    """Tell whether a comparison that keeps a guard false is of NaN: it would never turn true."""
    undefined = False
    for r in w.active:
        undefined = undefined or w.start[r] != w.start[r]
    return undefined


def _begin_arc(motion: Motion, plan: Plan, now: Now, scratch: Scratch, counts: list[int]) -> int:
    """Behind a switch or a jump fill the slope and choose the first step."""
    control, clock = plan.control, now.clock
    counts[PHASE] = ARC
    if plan.located or counts[FRESH] == 1:
        counts[NEW_ARC] = 1
        counts[FRESH] = 0
        if not plan.foreign:
            motion.flow(clock[T], now.y, now.mode, now.held, motion.p, now.f)
            # Without location the solver knows of no switch: it keeps its step.
            if control.step <= 0.0 and (plan.located or clock[H] <= 0.0):
                clock[ERROR_BEFORE] = 1.0
                clock[H] = starting_step(motion, plan.method.error_order, control, now, scratch)
    return ADVANCE if plan.foreign else NOTHING


def _steps_ahead(plan: Plan, cursor: list[int], most_steps: int) -> int:
    """Return how many steps may be taken at once."""
    left = plan.max_steps - cursor[STEPS]
    return min(most_steps, left) if plan.located else min(1, left)


def _flowed(plan: Plan, counts: list[int], steps: int) -> int:
    """Tell whether the arc goes on; a foreign solver has taken its steps before."""
    counts[MICROSTEP] = 0
    if steps <= 0:
        return TOO_MANY_STEPS
    if counts[STATUS] != FULL or not plan.located:
        counts[PHASE] = AFTER
        return NOTHING
    return ADVANCE if plan.foreign else ROWS


def _end_arc(plan: Plan, clock: Vector, counts: list[int], often: bool) -> int:
    """Tell why the arc has ended."""
    status = counts[STATUS]
    if status in (TOO_SMALL, NOT_FINITE, MACHINE_LIVELOCK):
        return status
    counts[PHASE] = ASK
    if status == REACHED and clock[T] < plan.t_end:
        counts[PHASE] = JUMPING
        return STOPPED
    if status == FULL and not plan.located:
        return ROWS  # perhaps none, but a caller may want to breathe
    if status == CROSSED:
        return RELATION_LIVELOCK if often else STOPPED
    return NOTHING


def _jump(plan: Plan, now: Now, counts: list[int], out: Output) -> int:
    """Go over a jump of the flow."""
    now.clock[T] = plan.jumps[counts[JUMP]]
    counts[PHASE] = ASK
    if out.every_step:
        put_row(out, now.clock[T], now.y)
    return STOPPED


def _finish(now: Now, counts: list[int], out: Output) -> None:
    """Write the rows wanted at the end itself."""
    counts[PHASE] = END
    t, cursor = now.clock[T], out.cursor
    while cursor[NEXT_TIME] < len(out.times) and out.times[cursor[NEXT_TIME]] <= t:
        put_row(out, out.times[cursor[NEXT_TIME]], now.y)
        cursor[NEXT_TIME] += 1


# --------------------------------------------------------------------------- progress
def _look_at_clock(now: Now, memory: Memory) -> None:
    """Count anew where time has gone on since the last switch."""
    t = now.clock[T]
    if t - now.clock[SWITCHED] > CLOCK_CRAWLS * abs(t):
        _count_anew(now, memory)
    now.clock[SWITCHED] = t


def _count_anew(now: Now, memory: Memory) -> None:
    now.clock[ANCHOR] = now.clock[T]
    for j in range(len(now.y)):
        memory.anchor[j] = now.y[j]
    for i in range(len(memory.switches)):
        memory.switches[i] = 0
    for r in range(len(memory.changes)):
        memory.changes[r] = 0


def _no_progress(plan: Plan, now: Now, memory: Memory, scratch: Scratch) -> bool:
    """Tell whether the switches counted led nowhere; if they led on, count anew from here."""
    y, anchor, moved = now.y, memory.anchor, scratch.error
    t, elapsed = now.clock[T], now.clock[T] - now.clock[ANCHOR]
    stands = elapsed <= MOST_SWITCHES * CLOCK_STANDS * abs(t)
    if not stands and elapsed <= MOST_SWITCHES * CLOCK_CRAWLS * abs(t):
        for j in range(len(y)):
            moved[j] = y[j] - anchor[j]
        distance = error_norm(moved, 1.0, y, anchor, plan.control.rtol, now.floor)
        stands = distance <= MOST_SWITCHES * STATE_STANDS
    if not stands:
        _count_anew(now, memory)
    return stands


def _often_changed(
    motion: Motion,
    plan: Plan,
    now: Now,
    w: Watched,
    sliding: Sliding,
    memory: Memory,
    scratch: Scratch,
) -> bool:
    """Count the relations that have just changed; tell whether one has too often."""
    changes, probe, surfaces = memory.changes, w.search.probe, sliding.surfaces
    _look_at_clock(now, memory)
    motion.margins(now.clock[T], now.y, now.mode, motion.p, w.watch, probe)
    often = False
    for r in w.active:
        g = probe[r]
        if (g > 0.0 or (g == 0.0 and not w.strict[r])) != w.truth[r]:
            changes[r] += 1
            often = often or changes[r] >= MOST_SWITCHES
            w.changed[r] = 1
        else:
            w.changed[r] = 0
    for k in range(len(surfaces.sign)):
        above, at_least = surfaces.above[k], surfaces.at_least[k]
        if w.watch[above] and (w.changed[above] or w.changed[at_least]):
            sliding.arrived[k] = 1
    return often and _no_progress(plan, now, memory, scratch)


# --------------------------------------------------------------------------- into columns
def record(
    functions: Functions,
    machines: Machines,
    b: Buffers,
    log: Log,
    first: int,
    most_steps: int,
    pause: bool,
) -> int:
    """Run on, writing all that happens into columns, until they are full or the run has ended.

    Parameters
    ----------
    functions, machines
        The system. ``observe(t, y, mode, signs, p, seen)`` fills what is seen of a state; the log
        keeps seen[0], seen[1] on both sides of a firing and, of machine i, seen[2 + i] and
        y[first + i].
    b : Buffers
        The run, changed in place.
    log : Log
        Filled; with room in ``stops_t`` stops are kept too.
    first : int
        Where the machines' own variables start in y.
    most_steps : int
        Come back after about so many steps or events.
    pause : bool
        Come back before each firing too.

    Returns
    -------
    int
        ROWS when a column is full or the steps are used up, FIRING, DONE or an error as
        `run_to_event`.
    """
    observe, now = machines.observe, b.now
    counts, cursor = b.memory.counts, b.out.cursor
    seen_at = float("nan")  # the time log.seen is of
    on = Held(functions, now.held, b.sliding)
    motion = Motion(flow_on, margins_on, on)
    left = most_steps
    while True:
        left -= 1
        if left < 0 or _is_full(b.out, log):
            return ROWS
        event = run_to_event(functions, machines, motion, b, most_steps)
        t = now.clock[T]
        if event == ROWS:
            for row in range(counts[TAKEN], cursor[ROW]):
                log.rows_microstep[row] = 0
                _put_modes(now.mode, b.sliding.flags, log.rows_mode[row])
            counts[TAKEN] = cursor[ROW]
            if counts[PHASE] == ARC:
                return ROWS
        elif event == FIRING:
            if seen_at != t:
                look(observe, on, t, now.y, now.mode, log.seen)
            _put_firing(now, counts, log, first)
            if pause:
                return FIRING
        elif event == FIRED:
            look(observe, on, t, now.y, now.mode, log.seen)
            seen_at = t
            log.numbers[log.counts[FIRINGS]][4] = log.seen[1]
            log.counts[FIRINGS] += 1
        elif event == SLID:
            seen_at = float("nan")
        elif event not in (STOPPED, DONE):
            return event
        if event not in (ROWS, FIRING):
            switched = event in (FIRED, SLID)
            _put_stop(now, counts, b.out, b.sliding.flags, log, switched)
        if event == DONE:
            return DONE


def _is_full(out: Output, log: Log) -> bool:
    """Tell whether a column has no room for what may come next."""
    if out.every_step and out.cursor[ROW] + 1 >= len(out.rows_t):
        return True
    if log.counts[FIRINGS] >= len(log.t):
        return True
    return 0 < len(log.stops_t) <= log.counts[STOPS]


def _put_firing(now: Now, counts: list[int], log: Log, first: int) -> None:
    """Write what is known before a firing."""
    i, row = counts[MACHINE], log.counts[FIRINGS]
    numbers = log.numbers[row]
    log.t[row] = now.clock[T]
    log.machine[row] = i
    log.edge[row] = counts[EDGE]
    numbers[0] = now.y[first + i]
    numbers[1] = log.seen[0]
    numbers[2] = log.seen[2 + i]
    numbers[3] = log.seen[1]


def _put_stop(
    now: Now, counts: list[int], out: Output, flags: list[int], log: Log, switched: bool
) -> None:
    """Write the state and the modes from here on."""
    t = now.clock[T]
    if out.every_step and switched:
        row = out.cursor[ROW]
        put_row(out, t, now.y)
        log.rows_microstep[row] = counts[MICROSTEP]
        _put_modes(now.mode, flags, log.rows_mode[row])
        counts[TAKEN] = out.cursor[ROW]
    if len(log.stops_t) > 0:
        row = log.counts[STOPS]
        log.stops_t[row] = t
        log.stops_microstep[row] = counts[MICROSTEP] if switched else 0
        for j in range(len(now.y)):
            log.stops_y[row][j] = now.y[j]
        _put_modes(now.mode, flags, log.stops_mode[row])
        log.counts[STOPS] += 1


def _put_modes(mode: list[int], flags: list[int], place: list[int]) -> None:
    n = len(mode)
    for i in range(n):
        place[i] = mode[i]
    for k in range(len(flags)):
        place[n + k] = flags[k]
