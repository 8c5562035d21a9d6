"""The outer loop as a function that goes on until something happens, then comes back.

Ask every machine for an enabled edge, fire, ask again until all is quiet; then freeze the states
and let the kernel advance to the next stop. All memory lies in arrays, so that the loop can come
back at every happening and be called again: Python's generator (`integrators.hybrid`) hands each
happening to its listener, the compiled engine (`record`) writes it into columns.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from integrators.advance import (
    CROSSED,
    FULL,
    NEXT_TIME,
    NOT_FINITE,
    REACHED,
    ROW,
    STEPS,
    TOO_SMALL,
    Control,
    Output,
    Work,
    advance,
    put_row,
    raise_floor,
)
from integrators.crossings import Margins, Watched
from integrators.sliding import (
    Held,
    Sliding,
    Surfaces,
    flow_on,
    look,
    margins_on,
    seize,
)
from integrators.step_size import error_norm, starting_step
from integrators.steps import Coefficients, Flow, Vector

__all__ = ["MOST_SWITCHES", "Log", "Memory", "Plan", "go_on", "record"]

MOST_SWITCHES = 100  # of one machine, or of one relation, without progress
# Switches make no progress where they follow each other by less than this part of the time itself
CLOCK_STANDS = 1e-9
# ... or by less than this, while the state moves by less than a tenth of its tolerance a switch.
CLOCK_CRAWLS = 1e-6
STATE_STANDS = 0.1

# What happened (TOO_SMALL and NOT_FINITE are the kernel's).
ROWS, FIRING, FIRED, STOPPED, DONE, SLID = 10, 11, 12, 13, 14, 15
MACHINE_LIVELOCK, RELATION_LIVELOCK, ADVANCE, TOO_MANY_STEPS = 16, 17, 18, 19
# Places in Memory.now.
T, H, ERROR_BEFORE, T_STOP, ANCHOR, SWITCHED = 0, 1, 2, 3, 4, 5
# Places in Memory.counts.
PLACES = 11
PHASE, MICROSTEP, MACHINE, EDGE, FIRED_ONE, FRESH, STATUS, JUMP, ACTIVE, TAKEN, NEW_ARC = range(
    PLACES
)
# Phases.
START, ASK, PICK, FIRE, SETTLED, BEGIN, ARC, AFTER, JUMPING, FINISH, END = range(11)


class Plan(NamedTuple):
    """What the outer loop keeps to."""

    t_end: float
    located: bool  # stop at crossings; else ask once at the end of each step
    foreign: bool  # the caller takes the steps (ADVANCE asks for them)
    jumps: Vector  # times at which the flow jumps, increasing
    before_jumps: Vector  # one clock tick before each
    knots: Vector  # times that steps may not jump over
    max_steps: int  # tried, in the whole run


class Memory(NamedTuple):
    """What the outer loop remembers between two calls."""

    now: Vector  # [time, step, controller's error, next stop, since when switches count, last]
    counts: list[int]  # see the places above
    edges: list[int]  # the enabled edge of each machine, or -1
    switches: list[int]  # firings of each machine since then
    changes: list[int]  # changes of each relation since then
    room: list[int]  # indices of the watched relations
    f: Vector  # slope
    anchor: Vector  # the state since when switches count


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


def go_on(
    flow: Flow,
    arm: Callable[..., Any],
    margins: Margins,
    normal: Callable[..., Any],
    ask: Callable[..., Any],
    act: Callable[..., Any],
    method: Coefficients,
    control: Control,
    plan: Plan,
    memory: Memory,
    y: Vector,
    mode: list[int],
    held: Vector,
    p: Any,
    relations: Watched,
    surfaces: Surfaces,
    sliding: Sliding,
    out: Output,
    work: Work,
    ride: Flow,
    seen: Margins,
    on: Any,
    most_steps: int,
) -> int:
    """Run until something happens.

    Parameters
    ----------
    flow, arm, margins, normal : callable
        The system.
    ask : callable
        ``ask(t, y, mode, p, edges)`` fills each machine's first enabled edge, or -1.
    act : callable
        ``act(edge, machine, t, y, mode, p)`` takes an edge.
    method, control, plan
        How to integrate.
    memory, y, mode, held, p, relations, surfaces, sliding, out, work
        The state of the run, changed in place.
    ride, seen, on
        How to flow, what is watched, and their parameters: `flow_on`, `margins_on` and a `Held`.
        While nothing is slid on, `flow`, `margins` and `p` do the same in less time.
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
    now, counts, cursor = memory.now, memory.counts, out.cursor
    w = active_relations(relations, memory)
    held_on = Held(
        flow, margins, normal, p, held, surfaces.sign, sliding.which, sliding.sigma, sliding.table
    )
    while True:
        if cursor[ROW] > counts[TAKEN]:
            return ROWS
        phase = counts[PHASE]
        t = now[T]

        if phase == ASK:
            ask(t, y, mode, p, memory.edges)
            counts[MACHINE] = -1
            counts[FIRED_ONE] = 0
            counts[PHASE] = PICK

        elif phase == PICK:
            i = counts[MACHINE] + 1
            while i < len(mode) and memory.edges[i] < 0:
                i += 1
            if i < len(mode):
                counts[MACHINE] = i
                counts[EDGE] = memory.edges[i]
                counts[PHASE] = FIRE
                return FIRING
            counts[PHASE] = ASK if counts[FIRED_ONE] == 1 and plan.located else SETTLED

        elif phase == FIRE:
            i = counts[MACHINE]
            counts[MICROSTEP] += 1
            counts[FIRED_ONE] = 1
            counts[FRESH] = 1
            counts[PHASE] = PICK
            act(counts[EDGE], i, t, y, mode, p)
            _look_at_clock(memory, t, y)
            memory.switches[i] += 1
            if memory.switches[i] >= MOST_SWITCHES and _no_progress(memory, control, work, t, y):
                counts[PHASE] = AFTER
                counts[STATUS] = MACHINE_LIVELOCK
            return FIRED

        elif phase == SETTLED:
            if t >= plan.t_end:
                counts[PHASE] = FINISH
                continue
            # A step that ends on a jump would see the value behind it: stop one clock tick before.
            while counts[JUMP] < len(plan.jumps) and plan.jumps[counts[JUMP]] <= t:
                counts[JUMP] += 1
            now[T_STOP] = plan.t_end
            if counts[JUMP] < len(plan.jumps):
                now[T_STOP] = min(now[T_STOP], plan.before_jumps[counts[JUMP]])
            counts[STATUS] = FULL
            slid = False
            if plan.located:
                w, slid = _rearm(
                    arm, margins, t, y, mode, held, p, relations, surfaces, sliding, held_on, memory
                )
                if _undefined(w):
                    counts[PHASE] = AFTER
                    counts[STATUS] = NOT_FINITE
                    continue
            counts[PHASE] = BEGIN
            if slid:  # y lies on the surface now: whoever compares with it has to be asked again
                counts[PHASE] = ASK
                return SLID

        elif phase == BEGIN:
            if plan.located or counts[FRESH] == 1:
                counts[NEW_ARC] = 1
                if not plan.foreign:
                    _begin_arc(
                        ride, method, control, t, y, mode, held, on, memory, work, plan.located
                    )
                counts[FRESH] = 0
            counts[PHASE] = ARC
            if plan.foreign:
                return ADVANCE

        elif phase == ARC:
            counts[MICROSTEP] = 0
            if cursor[STEPS] >= plan.max_steps:
                return TOO_MANY_STEPS
            if not plan.foreign:
                steps = min(most_steps, plan.max_steps - cursor[STEPS]) if plan.located else 1
                counts[STATUS], now[T], now[H], now[ERROR_BEFORE] = advance(
                    ride,
                    seen,
                    method,
                    control,
                    t,
                    y,
                    memory.f,
                    now[H],
                    now[ERROR_BEFORE],
                    now[T_STOP],
                    plan.knots,
                    mode,
                    held,
                    on,
                    w,
                    out,
                    work,
                    steps,
                )
            if counts[STATUS] != FULL or not plan.located:
                counts[PHASE] = AFTER
            else:
                return ADVANCE if plan.foreign else ROWS

        elif phase == AFTER:
            status = counts[STATUS]
            if status in (TOO_SMALL, NOT_FINITE, MACHINE_LIVELOCK):
                return status
            counts[PHASE] = ASK
            if status == REACHED and t < plan.t_end:
                counts[PHASE] = JUMPING
                return STOPPED
            if status == FULL and not plan.located:
                return ROWS  # perhaps none, but a caller may want to breathe
            if status == CROSSED:
                if _often_changed(
                    seen, t, y, mode, w, surfaces, sliding, on, memory, control, work
                ):
                    return RELATION_LIVELOCK
                return STOPPED

        elif phase == JUMPING:
            now[T] = plan.jumps[counts[JUMP]]
            counts[PHASE] = ASK
            if out.every_step:
                put_row(out, now[T], y)
            return STOPPED

        elif phase == START:
            counts[PHASE] = ASK
            counts[FRESH] = 1
            raise_floor(control, work.floor, y)
            if out.every_step:
                put_row(out, t, y)

        elif phase == FINISH:
            counts[PHASE] = END
            while cursor[NEXT_TIME] < len(out.times) and out.times[cursor[NEXT_TIME]] <= t:
                put_row(out, out.times[cursor[NEXT_TIME]], y)
                cursor[NEXT_TIME] += 1

        else:
            return DONE


def active_relations(relations: Watched, memory: Memory) -> Watched:
    """Return the relations with the active ones listed."""
    return Watched(
        relations.watch,
        memory.room[: memory.counts[ACTIVE]],
        relations.truth,
        relations.changed,
        relations.strict,
        relations.start,
        relations.end,
        relations.low,
        relations.high,
        relations.probe,
        relations.rights,
        relations.places,
        relations.depths,
        relations.y_probe,
    )


def _rearm(
    arm: Callable[..., Any],
    margins: Margins,
    t: float,
    y: Vector,
    mode: list[int],
    held: Vector,
    p: Any,
    relations: Watched,
    surfaces: Surfaces,
    sliding: Sliding,
    on: Held,
    memory: Memory,
) -> tuple[Watched, bool]:
    """Hold signs, choose what to watch and to slide on, remember the truth of what is watched.

    Returns what is watched, and whether other surfaces are slid on than before.
    """
    watch = relations.watch
    for a in range(memory.counts[ACTIVE]):
        watch[memory.room[a]] = 0
    arm(t, y, mode, p, held, watch)
    w = _listed(relations, memory)
    margins(t, y, mode, p, watch, w.start)
    slid = False
    if len(surfaces.sign) > 0:
        slid = seize(on, surfaces, sliding, t, y, mode, w)
        count = sliding.which[-1]
        if count > 0:
            first = len(watch) - 2 * len(sliding.sigma)
            for c in range(count):
                k = sliding.which[c]
                watch[surfaces.above[k]] = watch[surfaces.at_least[k]] = 0
                watch[first + 2 * c] = watch[first + 2 * c + 1] = 1
            w = _listed(relations, memory)
            margins_on(t, y, mode, on, watch, w.start)
    for r in w.active:
        g = w.start[r]
        w.truth[r] = g > 0.0 or (g == 0.0 and not w.strict[r])
    for k in range(len(surfaces.sign)):  # one met exactly is left to the side of its sign
        sign = held[surfaces.sign[k]]
        if watch[surfaces.above[k]] and sign != 0.0:
            w.truth[surfaces.above[k]] = w.truth[surfaces.at_least[k]] = sign > 0.0
    return w, slid


def _listed(relations: Watched, memory: Memory) -> Watched:
    """List the flagged relations."""
    active = 0
    for r in range(len(relations.watch)):
        if relations.watch[r]:
            memory.room[active] = r
            active += 1
    memory.counts[ACTIVE] = active
    return active_relations(relations, memory)


def _begin_arc(
    ride: Flow,
    method: Coefficients,
    control: Control,
    t: float,
    y: Vector,
    mode: list[int],
    held: Vector,
    on: Any,
    memory: Memory,
    work: Work,
    located: bool,
) -> None:
    """Fill the slope and choose the first step of an arc."""
    now = memory.now
    ride(t, y, mode, held, on, memory.f)
    # Without location the solver knows of no switch: it keeps its step.
    if control.step <= 0.0 and (located or now[H] <= 0.0):
        now[ERROR_BEFORE] = 1.0
        # Where the system has a scale, how far there is to go does not count: the kernel cuts.
        scale = control.time_scale if control.time_scale > 0.0 else now[T_STOP] - t
        now[H] = starting_step(
            ride,
            t,
            y,
            memory.f,
            mode,
            held,
            on,
            method.error_order,
            control.rtol,
            work.floor,
            scale,
            control.max_step,
            work.y_new,
            work.f_new,
        )


def _undefined(w: Watched) -> bool:
    """Tell whether a comparison that keeps a guard false is of NaN: it would never turn true."""
    undefined = False
    for r in w.active:
        undefined = undefined or w.start[r] != w.start[r]
    return undefined


def _look_at_clock(memory: Memory, t: float, y: Vector) -> None:
    """Count anew where time has gone on since the last switch."""
    if t - memory.now[SWITCHED] > CLOCK_CRAWLS * abs(t):
        _count_anew(memory, t, y)
    memory.now[SWITCHED] = t


def _count_anew(memory: Memory, t: float, y: Vector) -> None:
    memory.now[ANCHOR] = t
    for j in range(len(y)):
        memory.anchor[j] = y[j]
    for i in range(len(memory.switches)):
        memory.switches[i] = 0
    for r in range(len(memory.changes)):
        memory.changes[r] = 0


def _no_progress(memory: Memory, control: Control, work: Work, t: float, y: Vector) -> bool:
    """Tell whether the switches counted led nowhere; if they led on, count anew from here."""
    elapsed = t - memory.now[ANCHOR]
    stands = elapsed <= MOST_SWITCHES * CLOCK_STANDS * abs(t)
    if not stands and elapsed <= MOST_SWITCHES * CLOCK_CRAWLS * abs(t):
        moved = work.error
        for j in range(len(y)):
            moved[j] = y[j] - memory.anchor[j]
        distance = error_norm(moved, 1.0, y, memory.anchor, control.rtol, work.floor)
        stands = distance <= MOST_SWITCHES * STATE_STANDS
    if not stands:
        _count_anew(memory, t, y)
    return stands


def _often_changed(
    seen: Margins,
    t: float,
    y: Vector,
    mode: list[int],
    w: Watched,
    surfaces: Surfaces,
    sliding: Sliding,
    on: Any,
    memory: Memory,
    control: Control,
    work: Work,
) -> bool:
    """Count the relations that have just changed; tell whether one has too often."""
    _look_at_clock(memory, t, y)
    seen(t, y, mode, on, w.watch, w.probe)
    often = False
    for r in w.active:
        g = w.probe[r]
        if (g > 0.0 or (g == 0.0 and not w.strict[r])) != w.truth[r]:
            memory.changes[r] += 1
            often = often or memory.changes[r] >= MOST_SWITCHES
            w.changed[r] = 1
        else:
            w.changed[r] = 0
    for k in range(len(surfaces.sign)):
        above, at_least = surfaces.above[k], surfaces.at_least[k]
        if w.watch[above] and (w.changed[above] or w.changed[at_least]):
            sliding.arrived[k] = 1
    return often and _no_progress(memory, control, work, t, y)


def record(
    flow: Flow,
    arm: Callable[..., Any],
    margins: Margins,
    normal: Callable[..., Any],
    ask: Callable[..., Any],
    act: Callable[..., Any],
    observe: Callable[..., Any],
    method: Coefficients,
    control: Control,
    plan: Plan,
    memory: Memory,
    y: Vector,
    mode: list[int],
    held: Vector,
    p: Any,
    relations: Watched,
    surfaces: Surfaces,
    sliding: Sliding,
    out: Output,
    work: Work,
    log: Log,
    first: int,
    most_steps: int,
    pause: bool,
) -> int:
    """Go on, writing all that happens into columns, until they are full or the run has ended.

    Parameters
    ----------
    observe : callable
        ``observe(t, y, mode, signs, p, seen)``; the log keeps seen[0], seen[1] on both sides of a
        firing and, of machine i, seen[2 + i] and y[first + i].
    log : Log
        Filled; with room in ``stops_t`` stops are kept too.
    first : int
        Where the machines' own variables start in y.
    most_steps : int
        Come back after about so many steps or happenings.
    pause : bool
        Come back before each firing too.

    Others as in `go_on`.

    Returns
    -------
    int
        ROWS when a column is full or the steps are used up, FIRING, DONE or an error as `go_on`.
    """
    cursor, counts, entries = out.cursor, memory.counts, log.counts
    keep_stops = len(log.stops_t) > 0
    seen_at = float("nan")  # the time log.seen is of
    on = Held(
        flow, margins, normal, p, held, surfaces.sign, sliding.which, sliding.sigma, sliding.table
    )
    left = most_steps
    while True:
        left -= 1
        if left < 0 or (out.every_step and cursor[ROW] + 1 >= len(out.rows_t)):
            return ROWS
        if entries[0] >= len(log.t) or (keep_stops and entries[1] >= len(log.stops_t)):
            return ROWS
        happening = go_on(
            flow,
            arm,
            margins,
            normal,
            ask,
            act,
            method,
            control,
            plan,
            memory,
            y,
            mode,
            held,
            p,
            relations,
            surfaces,
            sliding,
            out,
            work,
            flow_on,
            margins_on,
            on,
            most_steps,
        )
        t = memory.now[T]
        if happening == ROWS:
            for row in range(counts[TAKEN], cursor[ROW]):
                log.rows_microstep[row] = 0
                _put_modes(mode, sliding, log.rows_mode[row])
            counts[TAKEN] = cursor[ROW]
            if counts[PHASE] == ARC:
                return ROWS
        elif happening == FIRING:
            if seen_at != t:
                look(observe, arm, on, sliding, t, y, mode, log.seen)
            i = counts[MACHINE]
            row = entries[0]
            log.t[row] = t
            log.machine[row] = i
            log.edge[row] = counts[EDGE]
            log.numbers[row][0] = y[first + i]
            log.numbers[row][1] = log.seen[0]
            log.numbers[row][2] = log.seen[2 + i]
            log.numbers[row][3] = log.seen[1]
            if pause:
                return FIRING
        elif happening == FIRED:
            look(observe, arm, on, sliding, t, y, mode, log.seen)
            seen_at = t
            log.numbers[entries[0]][4] = log.seen[1]
            entries[0] += 1
        elif happening == SLID:
            seen_at = float("nan")
        elif happening not in (STOPPED, DONE):
            return happening
        if out.every_step and happening in (FIRED, SLID):
            row = cursor[ROW]
            put_row(out, t, y)
            log.rows_microstep[row] = counts[MICROSTEP]
            _put_modes(mode, sliding, log.rows_mode[row])
            counts[TAKEN] = cursor[ROW]
        if keep_stops and happening in (FIRED, SLID, STOPPED, DONE):
            row = entries[1]
            log.stops_t[row] = t
            log.stops_microstep[row] = counts[MICROSTEP] if happening in (FIRED, SLID) else 0
            for j in range(len(y)):
                log.stops_y[row][j] = y[j]
            _put_modes(mode, sliding, log.stops_mode[row])
            entries[1] += 1
        if happening == DONE:
            return DONE


def _put_modes(mode: list[int], sliding: Sliding, place: list[int]) -> None:
    n = len(mode)
    for i in range(n):
        place[i] = mode[i]
    for k in range(len(sliding.flags)):
        place[n + k] = sliding.flags[k]
