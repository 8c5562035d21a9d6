"""The outer loop for Python: a generator over `integrators.loop.go_on`.

It yields what happened (`Arc`, `Stop`, `Firing`) and raises when it cannot go on, so whoever
listens keeps everything up to there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from integrators import advance as kernel
from integrators import loop
from integrators.advance import Control, Output, Work
from integrators.crossings import Margins, Watched, watched
from integrators.loop import MOST_SWITCHES, Memory, Plan
from integrators.sliding import (
    MOST_SLIDING,
    Held,
    Sliding,
    Surfaces,
    flow_on,
    margins_on,
    room_to_slide,
)
from integrators.steps import Coefficients, Dense, Flow, Vector, coefficients
from integrators.tableaux import EULER, Tableau

__all__ = [
    "MOST_SWITCHES",
    "ROWS_AT_ONCE",
    "Arc",
    "Firing",
    "HybridError",
    "Livelock",
    "NotFinite",
    "Options",
    "Slide",
    "StepTooSmall",
    "Stop",
    "Switch",
    "System",
    "TooManySteps",
    "buffers",
    "happenings",
    "run",
    "state_of",
    "take_rows",
]

ROWS_AT_ONCE = 512  # a buffer


# --------------------------------------------------------------------------- what goes in
@dataclass(frozen=True, eq=False)
class System:
    """What flows, and what is watched meanwhile.

    Parameters
    ----------
    flow : callable
        ``flow(t, y, mode, held, p, dy)`` with held signs.
    flow_live : callable
        The same with signs evaluated live.
    arm : callable
        ``arm(t, y, mode, p, held, watch)`` fills the held signs and flags relations.
    margins : callable
        ``margins(t, y, mode, p, watch, out)`` fills the margins of flagged relations.
    normal : callable
        ``normal(surface, t, y, mode, p, out)`` fills a surface's gradient over y, then its rate in
        t.
    p : Any
        Parameters, handed on.
    held : int
        Number of held signs.
    strict : list of bool
        For each relation whether zero is false.
    relations : list of str
        Their names, for messages.
    surfaces : Surfaces
        What can be slid on.
    knots : list of float
        Times that steps may not jump over.
    jumps : list of float
        Times at which the flow jumps: the step size starts anew.
    """

    flow: Flow
    flow_live: Flow
    arm: Callable[..., Any]
    margins: Margins
    normal: Callable[..., Any]
    p: Any
    held: int
    strict: list[bool]
    relations: list[str]
    surfaces: Surfaces
    knots: list[float] = field(default_factory=list)
    jumps: list[float] = field(default_factory=list)


class Switch(Protocol):
    """The machines, as the loop sees them."""

    def ask(self, t: float, y: Vector, mode: list[int], p: Any, edges: list[int]) -> None:
        """Fill the first enabled edge of each machine, or -1."""

    def act(self, edge: int, machine: int, t: float, y: Vector, mode: list[int], p: Any) -> None:
        """Take an edge: update mode, and y if the edge assigns something."""


@dataclass(frozen=True)
class Options:
    """How to integrate.

    Parameters
    ----------
    method : Tableau or type
        A tableau, or a `scipy.integrate.OdeSolver` class.
    step : float, optional
        Fixed step; adaptive when left out.
    rtol, max_step : float
        Of adaptive steps.
    atol : list of float, shape (m,)
        Absolute tolerances of the components; one that is 0 follows the largest value that the
        component has had, times rtol.
    time_scale : float
        Of the system, s; first steps are chosen by it. 0 if it has none.
    max_steps : int
        How many steps may be tried.
    located : bool
        Stop at crossings; otherwise the machines are asked once at the end of each step, and take
        at most one edge each.
    times : list of float, optional
        Wanted rows; every accepted step when left out.
    rows_at_once : int
        How many steps an arc that is yielded holds at most.
    """

    method: Tableau | type[Any]
    step: float | None
    rtol: float
    atol: list[float]
    max_step: float
    time_scale: float
    max_steps: int
    located: bool
    times: list[float] | None
    rows_at_once: int = ROWS_AT_ONCE


# --------------------------------------------------------------------------- what comes out
@dataclass(frozen=True, eq=False)
class Arc:
    """Rows between two switches: times, states y (rows, m), and the modes that held."""

    t: list[float]
    y: list[Vector]
    mode: tuple[int, ...]  # of each machine, then for each surface whether it is slid on


@dataclass(frozen=True, eq=False)
class Stop:
    """A place where an arc ends: a crossing, either side of a jump, the end of the run."""

    t: float
    y: Vector
    mode: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Slide:
    """Onto a surface, or off it: the modes from here."""

    t: float
    microstep: int
    y: Vector
    mode: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Firing:
    """One edge taken: where, when, and both sides of it."""

    t: float
    microstep: int
    machine: int
    edge: int
    y_before: Vector
    mode_before: tuple[int, ...]
    y: Vector
    mode: tuple[int, ...]


class HybridError(Exception):
    """The run cannot go on; carries the scene."""

    def __init__(self, message: str, t: float, y: Vector, mode: Sequence[int]) -> None:
        super().__init__(message)
        self.t = t
        self.y = list(y)
        self.mode = tuple(mode)


class Livelock(HybridError):
    """Switches without progress in time, of one machine or of one relation."""

    def __init__(
        self,
        t: float,
        y: Vector,
        mode: Sequence[int],
        machine: int | None,
        times: int,
        relations: list[str],
    ) -> None:
        super().__init__(f"{times} switches without progress", t, y, mode)
        self.machine = machine
        self.times = times
        self.relations = relations


class StepTooSmall(HybridError):
    """The error estimate asks for steps under the clock's resolution."""


class NotFinite(HybridError):
    """The flow returned NaN or infinity."""


class TooManySteps(HybridError):
    """The steps are used up before the end."""


# --------------------------------------------------------------------------- the loop
def run(
    system: System,
    switch: Switch,
    t: float,
    y: Vector,
    mode: list[int],
    t_end: float,
    options: Options,
) -> Iterator[Arc | Stop | Slide | Firing]:
    """Integrate from t to t_end and yield arcs, stops and firings in order.

    Parameters
    ----------
    system : System
        What flows.
    switch : Switch
        The machines; asked at the start and after every stop.
    t : float
        Start.
    y, mode : list of float, shape (m,), and of int, shape (n,)
        State and modes at t; copies are taken.
    t_end : float
        End, > t.
    options : Options
        Method, tolerances, rows.

    Yields
    ------
    Arc, Stop, Slide or Firing
        Arcs hold the rows wanted; firings come one per edge, m of them at one time numbered 1..m.

    Raises
    ------
    Livelock, StepTooSmall, NotFinite, TooManySteps
        When it cannot go on; all before has been yielded.
    """
    return happenings(system, switch, buffers(system, t, y, mode, t_end, options), options)


def happenings(
    system: System, switch: Switch, b: Buffers, options: Options
) -> Iterator[Arc | Stop | Slide | Firing]:
    """Go on from where some buffers are; see `run`.

    Between two happenings the buffers hold all there is to know of the run (`state_of`).

    Parameters
    ----------
    system, switch, options
        As in `run`.
    b : Buffers
        From `buffers`, perhaps with a state put back.

    Yields
    ------
    Arc, Stop, Slide or Firing
        As `run`.
    """
    flow = system.flow if options.located else system.flow_live
    s = b.sliding
    on = Held(
        flow,
        system.margins,
        system.normal,
        system.p,
        b.held,
        b.surfaces.sign,
        s.which,
        s.sigma,
        s.table,
    )
    solver = None
    if b.plan.foreign:
        from integrators.scipy_arcs import SciPyStepper

        solver = SciPyStepper(on, b, options)
    now, counts, cursor, y = b.memory.now, b.memory.counts, b.out.cursor, b.y
    before: tuple[Vector, tuple[int, ...]] = [], ()
    plainly: tuple[Flow, Margins, Any] = flow, system.margins, system.p
    along: tuple[Flow, Margins, Any] = flow_on, margins_on, on
    while True:
        ride, seen, q = along if s.which[-1] else plainly
        try:
            happening = loop.go_on(
                flow,
                system.arm,
                system.margins,
                system.normal,
                switch.ask,
                switch.act,
                b.method,
                b.control,
                b.plan,
                b.memory,
                y,
                b.mode,
                b.held,
                system.p,
                b.relations,
                b.surfaces,
                b.sliding,
                b.out,
                b.work,
                ride,
                seen,
                q,
                options.rows_at_once,
            )
            if solver is not None and happening == loop.ADVANCE:
                solver.advance(options.rows_at_once if options.located else 1)
        except Exception:
            if cursor[kernel.ROW]:
                yield take_rows(b)
            raise
        t, mode = now[loop.T], modes_of(b)
        if happening == loop.ROWS:
            if cursor[kernel.ROW]:
                yield take_rows(b)
        elif happening == loop.FIRING:
            before = list(y), mode
        elif happening == loop.FIRED:
            machine, edge = counts[loop.MACHINE], counts[loop.EDGE]
            yield Firing(t, counts[loop.MICROSTEP], machine, edge, *before, list(y), mode)
        elif happening == loop.SLID:
            yield Slide(t, counts[loop.MICROSTEP], list(y), mode)
        elif happening in (loop.STOPPED, loop.DONE):
            yield Stop(t, list(y), mode)
            if happening == loop.DONE:
                return
        elif happening != loop.ADVANCE:
            raise failure(happening, b, system.relations)


@dataclass(frozen=True, eq=False)
class Buffers:
    """All that one run needs besides the system's functions."""

    method: Coefficients
    control: Control
    plan: Plan
    memory: Memory
    y: Vector
    mode: list[int]
    held: Vector
    relations: Watched
    surfaces: Surfaces
    sliding: Sliding
    out: Output
    work: Work


def buffers(
    system: System,
    t: float,
    y: Vector,
    mode: list[int],
    t_end: float,
    options: Options,
    capacity: int | None = None,
    seen: int = 0,
) -> Buffers:
    """Make the buffers of a run, as lists.

    Parameters
    ----------
    system, t, y, mode, t_end, options
        As in `run`.
    capacity : int, optional
        Room for rows.
    seen : int
        How many numbers `integrators.loop.record` is to observe.

    Returns
    -------
    Buffers
        Ready for the first call of `integrators.loop.go_on`.
    """
    size, n = len(y), len(mode)
    surfaces = system.surfaces
    most_sliding = min(len(surfaces.sign), MOST_SLIDING)
    # Behind the system's relations those that end a slide: sigma <= 1 and sigma >= -1.
    strict = system.strict + [False] * (2 * most_sliding)
    r = len(strict)
    # A SciPy solver needs no coefficients, but the loop's signature does.
    tableau = options.method if isinstance(options.method, Tableau) else EULER
    jumps = [s for s in system.jumps if options.located and t < s <= t_end]
    times = options.times
    if capacity is None:
        capacity = ROWS_AT_ONCE if times is None else len(times)

    def vector() -> Vector:
        return [0.0] * size

    return Buffers(
        method=coefficients(tableau),
        control=Control(
            step=options.step or 0.0,
            origin=t,
            rtol=options.rtol,
            atol=options.atol,
            max_step=options.max_step,
            time_scale=options.time_scale,
        ),
        plan=Plan(
            t_end=t_end,
            located=options.located,
            foreign=tableau is not options.method,
            jumps=jumps,
            before_jumps=[math.nextafter(s, -math.inf) for s in jumps],
            knots=system.knots if options.located else [],
            max_steps=options.max_steps,
        ),
        memory=Memory(
            now=beginning(t, t_end),
            counts=[0] * loop.PLACES,
            edges=[-1] * n,
            switches=[0] * n,
            changes=[0] * r,
            room=[0] * r,
            f=vector(),
            anchor=list(y),
        ),
        y=list(y),
        mode=list(mode),
        held=[0.0] * system.held,
        relations=watched(strict, size),
        surfaces=surfaces,
        sliding=room_to_slide(surfaces, size, system.held, r, seen),
        out=Output(
            times=times or [],
            every_step=times is None,
            rows_t=[0.0] * capacity,
            rows_y=[vector() for _ in range(capacity)],
            cursor=[0, 0, 0, 0],
        ),
        work=Work(
            k=[vector() for _ in tableau.B],
            y_new=vector(),
            f_new=vector(),
            error=vector(),
            floor=list(options.atol),
            dense=Dense(vector(), vector(), vector(), vector(), vector()),
        ),
    )


def state_of(b: Buffers) -> dict[str, Any]:
    """Return the lists (or arrays) that say how far a run is; not copies.

    Parameters
    ----------
    b : Buffers
        Of a run between two happenings.

    Returns
    -------
    dict
        By name; to go on bit for bit, put copies of them back into buffers made alike.
    """
    w, s = b.relations, b.sliding
    return {
        **b.memory._asdict(),
        "y": b.y,
        "mode": b.mode,
        "held": b.held,
        "watch": w.watch,
        "truth": w.truth,
        "start": w.start,
        "cursor": b.out.cursor,
        "floor": b.work.floor,
        "slid": s.flags,
        "arrived": s.arrived,
        "which": s.which,
    }


def modes_of(b: Buffers) -> tuple[int, ...]:
    """Return the mode of each machine, then for each surface whether it is slid on.

    Parameters
    ----------
    b : Buffers
        Of a run.

    Returns
    -------
    tuple of int
        What rows are kept with.
    """
    return (*b.mode, *b.sliding.flags)


def beginning(t: float, t_end: float) -> Vector:
    """Return `Memory.now` of a run that has not begun."""
    return [t, 0.0, 1.0, t_end, t, -math.inf]


def failure(happening: int, b: Buffers, relations: list[str]) -> HybridError:
    """Return the error for a happening that ends a run.

    Parameters
    ----------
    happening : int
        What `integrators.loop.go_on` returned.
    b : Buffers
        Of the run.
    relations : list of str
        Their names.

    Returns
    -------
    HybridError
        To be raised.
    """
    memory = b.memory
    t, counts = memory.now[loop.T], memory.counts
    scene = t, b.y, modes_of(b)
    if happening == kernel.TOO_SMALL:
        return StepTooSmall("step size under the clock's resolution", *scene)
    if happening == loop.TOO_MANY_STEPS:
        return TooManySteps(f"{b.plan.max_steps} steps are used up", *scene)
    if happening == loop.MACHINE_LIVELOCK:
        machine = counts[loop.MACHINE]
        return Livelock(*scene, machine, memory.switches[machine], [])
    if happening == loop.RELATION_LIVELOCK:
        # A relation in a guard may have changed once more than its machine has switched.
        machine = max(range(len(b.mode)), key=lambda i: memory.switches[i])
        if memory.switches[machine] >= MOST_SWITCHES // 2:
            return Livelock(*scene, machine, memory.switches[machine], [])
        names = [*relations, *["the pull onto a surface"] * (len(memory.changes) - len(relations))]
        often = [name for r, name in enumerate(names) if memory.changes[r] >= MOST_SWITCHES]
        return Livelock(*scene, None, MOST_SWITCHES, often)
    w = loop.active_relations(b.relations, memory)
    undefined = [
        name for r, name in enumerate(relations) if r in w.active and w.start[r] != w.start[r]
    ]
    text = f"{undefined[0]} compares NaN" if undefined else "NaN or infinity"
    return NotFinite(text, *scene)


def take_rows(b: Buffers) -> Arc:
    """Take the rows that wait in the buffers; only whole ones are counted there.

    Parameters
    ----------
    b : Buffers
        Of the run.

    Returns
    -------
    Arc
        Perhaps without rows.
    """
    rows = b.out.cursor[kernel.ROW]
    b.out.cursor[kernel.ROW] = 0
    states = [list(y) for y in b.out.rows_y[:rows]]
    return Arc(b.out.rows_t[:rows], states, modes_of(b))
