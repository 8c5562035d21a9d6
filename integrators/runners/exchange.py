"""A run whose steps a solver takes that asks for slopes and margins and goes to the events.

The caller sets the time and the state in the buffers. `settle` brings the states of the machines up
to date and freezes them; until the next call of `settle` everything is smooth. A margin that leads
to an event is given as an indicator, which is zero a little behind the crossing: at its root the
comparison has really changed, so the caller need not step past it.

The machines are run by the same loop as always (`integrators.loop`), as for a foreign solver.
"""

from __future__ import annotations

from dataclasses import dataclass

from integrators.advance import CROSSED, REACHED
from integrators.crossings import any_changed, listed
from integrators.loop import (
    ADVANCE,
    AFTER,
    ARC,
    FIRED,
    FIRING,
    ROWS,
    SLID,
    START,
    STOPPED,
    Buffers,
    Machines,
    run_to_event,
)
from integrators.runners.stepping import Clocks, next_tick
from integrators.sliding import Functions, Held, flow_on, follow_on, look, margins_on
from integrators.step_size import INFINITY
from integrators.steps import ArcMotion, Vector

__all__ = ["Exchange", "changed", "indicate", "observe", "settle", "slope"]

SOON = 1e-9  # of its time: a tick that is not farther away is now


@dataclass(slots=True, eq=False)
class Exchange:
    """What the caller is given besides the buffers."""

    next: float  # time of the next tick, infinity if there is none
    switches: int  # since the start
    moved: bool  # whether the last `settle` moved the state
    slope: Vector  # dy/dt, shape (m,)
    seen: Vector  # observed values
    margins: Vector  # left - right of each comparison, 0 if it is not watched, shape (r,)
    indicators: Vector  # 1 for a comparison that is not watched, shape (r,)
    shift: Vector  # how far behind the crossing each indicator is zero, shape (r,)
    before: Vector  # scratch space: the state before `settle`
    signs: Vector  # scratch space: held signs


def settle(
    functions: Functions, machines: Machines, b: Buffers, clocks: Clocks, x: Exchange
) -> int:
    """Take all enabled edges at an event, until none is; then freeze states and signs.

    Parameters
    ----------
    functions, machines
        The system.
    b : Buffers
        Their plan has a foreign solver and no end; time and state are those of the event.
    clocks : Clocks
        What ticks, as in `integrators.runners.stepping`.
    x : Exchange
        Its numbers are filled.

    Returns
    -------
    int
        0, or an error as in `run_to_event`.
    """
    now, memory, plan = b.now, b.memory, b.plan
    for j in range(len(now.y)):
        x.before[j] = now.y[j]
    now.latest = abs(now.t)
    due = False
    if memory.phase == ARC:  # what crossed is counted, as after a step of ours
        if len(plan.jumps) > 0:
            tick = plan.jumps[memory.jump]
            due = tick - now.t <= SOON * abs(tick)
        if due:  # what crossed comes first
            now.t = plan.before_jumps[memory.jump]
        memory.status = CROSSED
        memory.phase = AFTER
    error = _quiet(functions, machines, b, clocks, x)
    if due and error == 0:
        memory.status = REACHED
        memory.phase = AFTER
        error = _quiet(functions, machines, b, clocks, x)
    x.next = plan.jumps[memory.jump] if len(plan.jumps) > 0 else INFINITY
    x.moved = False
    for j in range(len(now.y)):
        if now.y[j] != x.before[j]:
            x.moved = True
    return error


def _quiet(
    functions: Functions, machines: Machines, b: Buffers, clocks: Clocks, x: Exchange
) -> int:
    """Run the loop until a solver would have to go on."""
    now, memory, plan = b.now, b.memory, b.plan
    motion = ArcMotion(flow_on, margins_on, Held(functions, now.held, b.sliding), follow_on)
    event = ROWS
    while event != ADVANCE:
        event = run_to_event(functions, machines, motion, b, 1)
        if len(plan.jumps) > 0 and plan.jumps[1] <= now.t:
            next_tick(plan, clocks)
            memory.jump = 0
        if event == FIRED:
            x.switches += 1
        elif event not in (FIRING, STOPPED, SLID, ROWS, ADVANCE):
            return event
    return 0


def slope(functions: Functions, b: Buffers, x: Exchange) -> None:
    """Fill dy/dt with states and signs as of the last `settle`; before the first, with live signs.

    Parameters
    ----------
    functions : Functions
        The system.
    b : Buffers
        With the time and the state in question.
    x : Exchange
        Its slope is filled.
    """
    now = b.now
    if b.memory.phase == START:
        functions.arm(now.t, now.y, now.mode, functions.p, now.held, b.sliding.watch)
    flow_on(now.t, now.y, now.mode, now.held, Held(functions, now.held, b.sliding), x.slope)


def indicate(functions: Functions, b: Buffers, x: Exchange) -> None:
    """Fill the margins and the event indicators.

    Parameters
    ----------
    functions : Functions
        The system.
    b : Buffers
        With the time and the state in question.
    x : Exchange
        Its margins and indicators are filled.
    """
    now, watch, truth = b.now, b.relations.watch, b.relations.truth
    for r in range(len(watch)):
        x.margins[r] = 0.0
    on = Held(functions, now.held, b.sliding)
    margins_on(now.t, now.y, now.mode, on, watch, x.margins)
    for r in range(len(watch)):
        if watch[r] == 0:
            x.indicators[r] = 1.0
        elif truth[r]:
            x.indicators[r] = x.margins[r] + x.shift[r]
        else:
            x.indicators[r] = x.margins[r] - x.shift[r]


def changed(functions: Functions, b: Buffers, x: Exchange) -> int:
    """Return 1 if a watched comparison has changed since the last `settle`, else 0.

    Parameters
    ----------
    functions, b, x
        As in `indicate`.

    Returns
    -------
    int
        Whether `settle` is due.
    """
    indicate(functions, b, x)
    w = listed(b.relations, b.memory.active)
    return 1 if any_changed(w, x.margins) else 0


def observe(functions: Functions, machines: Machines, b: Buffers, x: Exchange) -> None:
    """Fill the observed values; the frozen signs stay as they are, whatever the state is.

    Parameters
    ----------
    functions, machines
        The system.
    b : Buffers
        With the time and the state in question.
    x : Exchange
        Its observed values are filled.
    """
    now = b.now
    for k in range(len(now.held)):
        x.signs[k] = now.held[k]
    on = Held(functions, now.held, b.sliding)
    look(machines.observe, on, now.t, now.y, now.mode, x.seen)
    for k in range(len(now.held)):
        now.held[k] = x.signs[k]
