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
    TOO_SMALL,
    Control,
    Output,
    Work,
    advance,
    put_row,
)
from integrators.crossings import Margins, Watched
from integrators.step_size import starting_step
from integrators.steps import Coefficients, Flow, Vector

__all__ = ["MOST_SWITCHES", "Log", "Memory", "Plan", "go_on", "record"]

MOST_SWITCHES = 100  # of one machine, or of one relation, while time stands still

# What happened (TOO_SMALL and NOT_FINITE are the kernel's).
ROWS, FIRING, FIRED, STOPPED, DONE = 10, 11, 12, 13, 14
MACHINE_LIVELOCK, RELATION_LIVELOCK, ADVANCE = 15, 16, 17
# Places in Memory.now.
T, H, ERROR_BEFORE, T_STOP, SWITCHED = 0, 1, 2, 3, 4
# Places in Memory.counts.
PLACES = 11
PHASE, MICROSTEP, MACHINE, EDGE, FIRED_ONE, FRESH, STATUS, JUMP, ACTIVE, TAKEN, NEW_ARC = range(
    PLACES
)
# Phases.
START, ASK, PICK, FIRE, SETTLED, ARC, AFTER, JUMPING, FINISH, END = range(10)


class Plan(NamedTuple):
    """What the outer loop keeps to."""

    t_end: float
    located: bool  # stop at crossings; else ask once at the end of each step
    foreign: bool  # the caller takes the steps (ADVANCE asks for them)
    jumps: Vector  # times at which the flow jumps, increasing
    before_jumps: Vector  # one clock tick before each
    knots: Vector  # times that steps may not jump over
    standstill: float  # s; progress in time smaller than this is none


class Memory(NamedTuple):
    """What the outer loop remembers between two calls."""

    now: Vector  # [time, step, controller's error, next stop, last switch]
    counts: list[int]  # see the places above
    edges: list[int]  # the enabled edge of each machine, or -1
    switches: list[int]  # firings of each machine while time stands still
    changes: list[int]  # changes of each relation while time stands still
    room: list[int]  # indices of the watched relations
    f: Vector  # slope


class Log(NamedTuple):
    """Columns that `record` fills: one entry a firing, and both sides of every stop."""

    counts: list[int]  # [firings, stops]
    t: Vector
    machine: list[int]
    edge: list[int]
    numbers: list[Vector]  # [own variable, seen 0, own seen, seen 1 before, seen 1 after]
    seen: Vector  # scratch of `observe`
    rows_microstep: list[int]  # beside the rows of Output
    rows_mode: list[list[int]]
    stops_t: Vector
    stops_microstep: list[int]
    stops_y: list[Vector]
    stops_mode: list[list[int]]


def go_on(
    flow: Flow,
    arm: Callable[..., Any],
    margins: Margins,
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
    out: Output,
    work: Work,
    most_steps: int,
) -> int:
    """Run until something happens.

    Parameters
    ----------
    flow, arm, margins : callable
        The system.
    ask : callable
        ``ask(t, y, mode, p, edges)`` fills each machine's first enabled edge, or -1.
    act : callable
        ``act(edge, machine, t, y, mode, p)`` takes an edge.
    method, control, plan
        How to integrate.
    memory, y, mode, held, p, relations, out, work
        The state of the run, changed in place.
    most_steps : int
        Come back after so many steps at most.

    Returns
    -------
    int
        ROWS (to be taken, all of the present mode; possibly none when the steps are used up),
        FIRING (before) and FIRED (after an edge), STOPPED (a crossing, either side of a jump),
        ADVANCE (a foreign solver is to go on), DONE; or the error TOO_SMALL, NOT_FINITE,
        MACHINE_LIVELOCK, RELATION_LIVELOCK.
    """
    now, counts, cursor = memory.now, memory.counts, out.cursor
    w = active_relations(relations, memory)
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
            _look_at_clock(memory, t, plan.standstill)
            memory.switches[i] += 1
            if memory.switches[i] >= MOST_SWITCHES:
                counts[PHASE] = AFTER
                counts[STATUS] = MACHINE_LIVELOCK
            return FIRED

        elif phase == SETTLED:
            counts[MICROSTEP] = 0
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
            if plan.located:
                w = _rearm(arm, margins, t, y, mode, held, p, relations, memory)
                if _undefined(w):
                    counts[PHASE] = AFTER
                    counts[STATUS] = NOT_FINITE
                    continue
            if plan.located or counts[FRESH] == 1:
                counts[NEW_ARC] = 1
                if not plan.foreign:
                    flow(t, y, mode, held, p, memory.f)
                    # Without location the solver knows of no switch: it keeps its step.
                    if control.step <= 0.0 and (plan.located or now[H] <= 0.0):
                        now[ERROR_BEFORE] = 1.0
                        now[H] = starting_step(
                            flow, t, y, memory.f, mode, held, p, method.error_order,
                            control.rtol, control.atol, min(control.max_step, now[T_STOP] - t),
                            work.y_new, work.f_new,
                        )  # fmt: skip
                counts[FRESH] = 0
            counts[PHASE] = ARC
            if plan.foreign:
                return ADVANCE

        elif phase == ARC:
            if not plan.foreign:
                steps = most_steps if plan.located else 1
                counts[STATUS], now[T], now[H], now[ERROR_BEFORE] = advance(
                    flow, margins, method, control, t, y, memory.f, now[H], now[ERROR_BEFORE],
                    now[T_STOP], plan.knots, mode, held, p, w, out, work, steps,
                )  # fmt: skip
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
                if _often_changed(margins, t, y, mode, p, w, memory, plan.standstill):
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
        relations.watch, memory.room[: memory.counts[ACTIVE]], relations.truth, relations.strict,
        relations.start, relations.end, relations.low, relations.high, relations.probe,
        relations.rights, relations.places, relations.depths, relations.y_probe,
    )  # fmt: skip


def _rearm(
    arm: Callable[..., Any],
    margins: Margins,
    t: float,
    y: Vector,
    mode: list[int],
    held: Vector,
    p: Any,
    relations: Watched,
    memory: Memory,
) -> Watched:
    """Hold signs, choose what to watch, remember its truth."""
    for a in range(memory.counts[ACTIVE]):
        relations.watch[memory.room[a]] = 0
    arm(t, y, mode, p, held, relations.watch)
    active = 0
    for r in range(len(relations.watch)):
        if relations.watch[r]:
            memory.room[active] = r
            active += 1
    memory.counts[ACTIVE] = active
    w = active_relations(relations, memory)
    margins(t, y, mode, p, w.watch, w.start)
    for r in w.active:
        g = w.start[r]
        w.truth[r] = g > 0.0 or (g == 0.0 and not w.strict[r])
    return w


def _undefined(w: Watched) -> bool:
    """Tell whether a comparison that keeps a guard false is of NaN: it would never turn true."""
    undefined = False
    for r in w.active:
        undefined = undefined or w.start[r] != w.start[r]
    return undefined


def _look_at_clock(memory: Memory, t: float, standstill: float) -> None:
    """Forget the counts when time has gone on."""
    if t - memory.now[SWITCHED] > standstill:
        for i in range(len(memory.switches)):
            memory.switches[i] = 0
        for r in range(len(memory.changes)):
            memory.changes[r] = 0
    memory.now[SWITCHED] = t


def _often_changed(
    margins: Margins,
    t: float,
    y: Vector,
    mode: list[int],
    p: Any,
    w: Watched,
    memory: Memory,
    standstill: float,
) -> bool:
    """Count the relations that have just changed; tell whether one has too often."""
    _look_at_clock(memory, t, standstill)
    margins(t, y, mode, p, w.watch, w.probe)
    often = False
    for r in w.active:
        g = w.probe[r]
        if (g > 0.0 or (g == 0.0 and not w.strict[r])) != w.truth[r]:
            memory.changes[r] += 1
            often = often or memory.changes[r] >= MOST_SWITCHES
    return often


def record(
    flow: Flow,
    arm: Callable[..., Any],
    margins: Margins,
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
        ``observe(t, y, mode, p, seen)``; the log keeps seen[0], seen[1] on both sides of a firing
        and, of machine i, seen[2 + i] and y[first + i].
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
    left = most_steps
    while True:
        left -= 1
        if left < 0 or (out.every_step and cursor[ROW] + 1 >= len(out.rows_t)):
            return ROWS
        if entries[0] >= len(log.t) or (keep_stops and entries[1] >= len(log.stops_t)):
            return ROWS
        happening = go_on(
            flow, arm, margins, ask, act, method, control, plan, memory, y, mode, held, p,
            relations, out, work, most_steps,
        )  # fmt: skip
        t = memory.now[T]
        if happening == ROWS:
            for row in range(counts[TAKEN], cursor[ROW]):
                log.rows_microstep[row] = 0
                for i in range(len(mode)):
                    log.rows_mode[row][i] = mode[i]
            counts[TAKEN] = cursor[ROW]
            if counts[PHASE] == ARC:
                return ROWS
        elif happening == FIRING:
            if seen_at != t:
                observe(t, y, mode, p, log.seen)
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
            observe(t, y, mode, p, log.seen)
            seen_at = t
            log.numbers[entries[0]][4] = log.seen[1]
            entries[0] += 1
            if out.every_step:
                row = cursor[ROW]
                put_row(out, t, y)
                log.rows_microstep[row] = counts[MICROSTEP]
                for i in range(len(mode)):
                    log.rows_mode[row][i] = mode[i]
                counts[TAKEN] = cursor[ROW]
        elif happening not in (STOPPED, DONE):
            return happening
        if keep_stops and happening in (FIRED, STOPPED, DONE):
            row = entries[1]
            log.stops_t[row] = t
            log.stops_microstep[row] = counts[MICROSTEP] if happening == FIRED else 0
            for j in range(len(y)):
                log.stops_y[row][j] = y[j]
            for i in range(len(mode)):
                log.stops_mode[row][i] = mode[i]
            entries[1] += 1
        if happening == DONE:
            return DONE
