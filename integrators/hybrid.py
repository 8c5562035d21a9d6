"""The outer loop for Python: a generator over `integrators.loop.run_to_event`.

It yields events (`Arc`, `Stop`, `Slide`, `Firing`) and raises an error when it cannot continue, so
that the caller keeps everything up to that point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from integrators import advance as kernel
from integrators import loop
from integrators.advance import Output, Plan
from integrators.crossings import listed, watched
from integrators.loop import MOST_SWITCHES, Buffers, Memory, Switch
from integrators.sliding import (
    MOST_SLIDING,
    Functions,
    Held,
    Surfaces,
    flow_on,
    margins_on,
    sliding_scratch,
)
from integrators.step_size import Control
from integrators.steps import Dense, Flow, Margins, Motion, Now, Scratch, T, Vector, coefficients
from integrators.tableaux import EULER, Tableau

__all__ = [
    "MOST_SWITCHES",
    "ROWS_AT_ONCE",
    "Arc",
    "Buffers",
    "Equations",
    "Event",
    "Firing",
    "HybridError",
    "Livelock",
    "NotFinite",
    "Options",
    "Slide",
    "StepTooSmall",
    "Stop",
    "Switch",
    "TooManySteps",
    "buffers",
    "events",
    "plan_of",
    "run",
    "state_of",
    "take_rows",
]

ROWS_AT_ONCE = 512  # capacity of a buffer


# --------------------------------------------------------------------------- input
@dataclass(frozen=True, eq=False)
class Equations:
    """The system's flow, and what is watched meanwhile.

    Parameters
    ----------
    flow : callable
        ``flow(t, y, mode, held, p, dy)`` with held signs.
    flow_live : callable
        The same with signs evaluated live.
    arm : callable
        ``arm(t, y, mode, p, held, watch)`` fills the held signs, and says why relations are watched
        (`FOR_A_SIGN`, `FOR_A_GUARD` and `WAITING`, as bits).
    margins : callable
        ``margins(t, y, mode, p, watch, out)`` fills the margins of flagged relations.
    normal : callable
        ``normal(surface, t, y, mode, p, out)`` fills a surface's gradient over y, then its rate in
        t.
    p : Any
        Parameters, passed on to the functions.
    held : int
        Number of held signs.
    strict : list of bool
        For each relation, whether it is false at zero.
    relations : list of str
        Their names, for messages.
    surfaces : Surfaces
        The surfaces that can be slid on.
    knots : list of float
        Times that steps may not jump over.
    jumps : list of float
        Times at which the flow jumps; the step size is chosen afresh there.
    ticks : mapping of float to int
        For each time at which something ticks what does, as bits: samplers, or discrete machines.
    discrete : list of int
        For each machine the bit at whose ticks alone it is asked; 0 for one that may fire any time.
    seen : int
        Number of values that `integrators.columns.record` observes.
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
    ticks: Mapping[float, int] = field(default_factory=dict)
    discrete: list[int] = field(default_factory=list)
    seen: int = 0

    def functions(self, located: bool) -> Functions:
        """Return the functions for a run with or without located crossings."""
        flow = self.flow if located else self.flow_live
        return Functions(flow, self.arm, self.margins, self.normal, self.p)


@dataclass(frozen=True)
class Options:
    """How to integrate.

    Parameters
    ----------
    method : Tableau or type
        A tableau, or a `scipy.integrate.OdeSolver` class.
    step : float, optional
        Fixed step; adaptive if omitted.
    rtol, max_step : float
        For adaptive steps.
    atol : list of float, shape (m,)
        Absolute tolerances of the components; a component with tolerance 0 is measured relative to
        its largest value so far.
    time_scale : float
        Time scale of the system, s; used to choose first steps. 0 if it has none.
    max_steps : int
        Maximum number of attempted steps.
    located : bool
        Stop at crossings; otherwise guards are evaluated once at the end of each step, and each
        machine takes at most one edge.
    times : list of float or ndarray, optional
        Requested rows; every accepted step if omitted.
    rows_at_once : int
        Maximum number of steps in each arc that is yielded.
    """

    method: Tableau | type[Any]
    step: float | None
    rtol: float
    atol: list[float]
    max_step: float
    time_scale: float
    max_steps: int
    located: bool
    times: Sequence[float] | Any | None
    rows_at_once: int = ROWS_AT_ONCE


# --------------------------------------------------------------------------- output
@dataclass(frozen=True, eq=False)
class Arc:
    """Rows between two switches: times, states y (rows, m), and the modes that were active."""

    t: list[float]
    y: list[Vector]
    mode: tuple[int, ...]  # of each machine, then for each surface whether the motion slides on it


@dataclass(frozen=True, eq=False)
class Stop:
    """The end of an arc: a crossing, either side of a jump, the end of the run."""

    t: float
    y: Vector
    mode: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Slide:
    """Start or end of sliding on a surface: the modes from here on."""

    t: float
    microstep: int
    y: Vector
    mode: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Firing:
    """One edge taken: where, when, and the state on both sides of it."""

    t: float
    microstep: int
    machine: int
    edge: int
    y_before: Vector
    mode_before: tuple[int, ...]
    y: Vector
    mode: tuple[int, ...]


Event = Arc | Stop | Slide | Firing


class HybridError(Exception):
    """The run cannot continue; carries the time, state and modes."""

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
    """Error control requires steps below the clock's resolution."""


class NotFinite(HybridError):
    """The flow returned NaN or infinity."""


class TooManySteps(HybridError):
    """The maximum number of steps was reached before the end."""


# --------------------------------------------------------------------------- the loop
def run(
    equations: Equations,
    switch: Switch,
    t: float,
    y: Vector,
    mode: list[int],
    t_end: float,
    options: Options,
) -> Iterator[Event]:
    """Integrate from t to t_end and yield arcs, stops and firings in order.

    Parameters
    ----------
    equations : Equations
        The system.
    switch : Switch
        The machines; their guards are evaluated at the start and after every stop.
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
        Arcs contain the requested rows; each edge gives one firing, numbered from 1 at each time.

    Raises
    ------
    Livelock, StepTooSmall, NotFinite, TooManySteps
        If it cannot continue; everything before has been yielded.
    """
    return events(equations, switch, buffers(equations, t, y, mode, t_end, options), options)


def events(equations: Equations, switch: Switch, b: Buffers, options: Options) -> Iterator[Event]:
    """Continue from the state in some buffers; see `run`.

    Between two events the buffers contain the complete state of the run (`state_of`).

    Parameters
    ----------
    equations, switch, options
        As in `run`.
    b : Buffers
        From `buffers`, possibly with a restored state.

    Yields
    ------
    Arc, Stop, Slide or Firing
        As in `run`.
    """
    functions = equations.functions(options.located)
    on = Held(functions, b.now.held, b.sliding)
    solver = None
    if b.plan.foreign:
        from integrators.scipy_arcs import SciPyStepper

        solver = SciPyStepper(on, b, options)
    plainly = Motion(functions.flow, functions.margins, functions.p)
    along = Motion(flow_on, margins_on, on)
    counts, cursor, y = b.memory.counts, b.out.cursor, b.now.y
    before: tuple[Vector, tuple[int, ...]] = [], ()
    while True:
        motion = along if b.sliding.which[-1] else plainly
        try:
            event = loop.run_to_event(functions, switch, motion, b, options.rows_at_once)
            if solver is not None and event == loop.ADVANCE:
                left = b.plan.max_steps - cursor[kernel.STEPS]
                solver.advance(min(options.rows_at_once if options.located else 1, left))
        except Exception:
            if cursor[kernel.ROW]:
                yield take_rows(b)
            raise
        t, mode = b.now.clock[T], modes_of(b)
        if event == loop.ROWS:
            if cursor[kernel.ROW]:
                yield take_rows(b)
        elif event == loop.FIRING:
            before = list(y), mode
        elif event == loop.FIRED:
            machine, edge = counts[loop.MACHINE], counts[loop.EDGE]
            yield Firing(t, counts[loop.MICROSTEP], machine, edge, *before, list(y), mode)
        elif event == loop.SLID:
            yield Slide(t, counts[loop.MICROSTEP], list(y), mode)
        elif event in (loop.STOPPED, loop.DONE):
            yield Stop(t, list(y), mode)
            if event == loop.DONE:
                return
        elif event != loop.ADVANCE:
            raise failure(event, b, equations.relations)


def buffers(
    equations: Equations,
    t: float,
    y: Vector,
    mode: list[int],
    t_end: float,
    options: Options,
    capacity: int | None = None,
) -> Buffers:
    """Create the buffers of a run, as lists.

    Parameters
    ----------
    equations, t, y, mode, t_end, options
        As in `run`.
    capacity : int, optional
        Capacity for rows.

    Returns
    -------
    Buffers
        Ready for the first call of `integrators.loop.run_to_event`.
    """
    size, n, surfaces = len(y), len(mode), equations.surfaces
    # After the relations of the equations, those that end a slide: sigma <= 1 and sigma >= -1.
    strict = equations.strict + [False] * (2 * min(len(surfaces.sign), MOST_SLIDING))
    plan = plan_of(equations, t, t_end, options, n)
    times = options.times
    if capacity is None:
        capacity = ROWS_AT_ONCE if times is None else len(times)

    def vector() -> Vector:
        return [0.0] * size

    return Buffers(
        plan=plan,
        now=Now(
            clock=beginning(t, t_end),
            y=list(y),
            f=vector(),
            mode=list(mode),
            held=[0.0] * equations.held,
            floor=list(options.atol),
        ),
        memory=Memory(
            counts=[0] * loop.PLACES,
            edges=[-1] * n,
            switches=[0] * n,
            changes=[0] * len(strict),
            anchor=list(y),
            due=[0] * n,
        ),
        relations=watched(strict, size),
        sliding=sliding_scratch(surfaces, size, equations.held, len(strict), equations.seen),
        out=Output(
            times=[] if times is None else _as_list(times),
            every_step=times is None,
            rows_t=[0.0] * capacity,
            rows_y=[vector() for _ in range(capacity)],
            cursor=[0, 0, 0, 0],
        ),
        scratch=Scratch(
            k=[vector() for _ in plan.method.B],
            y_new=vector(),
            f_new=vector(),
            error=vector(),
            dense=Dense(vector(), vector(), vector(), vector(), vector()),
        ),
    )


def _as_list(numbers: Sequence[float] | Any) -> Vector:
    """Return Python numbers: those of numpy are slow one by one."""
    return numbers.tolist() if hasattr(numbers, "tolist") else list(numbers)


def plan_of(equations: Equations, t: float, t_end: float, options: Options, machines: int) -> Plan:
    """Return the settings of a run in the form that the kernel uses.

    Parameters
    ----------
    equations, t, t_end, options
        As in `run`.
    machines : int
        Their number.

    Returns
    -------
    Plan
        Made of lists.
    """
    # A SciPy solver needs no coefficients, but the loop's signature requires them.
    tableau = options.method if isinstance(options.method, Tableau) else EULER
    ticks = {s: bits for s, bits in equations.ticks.items() if t <= s < t_end}
    jumps = sorted({*(s for s in equations.jumps if options.located and t < s <= t_end), *ticks})
    control = Control(
        step=options.step or 0.0,
        origin=t,
        rtol=options.rtol,
        atol=options.atol,
        max_step=options.max_step,
        time_scale=options.time_scale,
    )
    return Plan(
        method=coefficients(tableau),
        control=control,
        t_end=t_end,
        located=options.located,
        foreign=tableau is not options.method,
        jumps=jumps,
        before_jumps=[math.nextafter(s, -math.inf) for s in jumps],
        ticks=[ticks.get(s, 0) for s in jumps],
        discrete=equations.discrete or [0] * machines,
        knots=equations.knots if options.located else [],
        max_steps=options.max_steps,
    )


def state_of(b: Buffers) -> dict[str, Any]:
    """Return the lists (or arrays) that make up a run's state, without copying them.

    Parameters
    ----------
    b : Buffers
        The buffers of a run between two events.

    Returns
    -------
    dict
        By name; to resume bit for bit, copy them back into buffers created in the same way.
    """
    w, s = b.relations, b.sliding
    return {
        **b.now._asdict(),
        **b.memory._asdict(),
        "watch": w.watch,
        "room": w.room,
        "truth": w.truth,
        "start": w.start,
        "cursor": b.out.cursor,
        "slid": s.flags,
        "arrived": s.arrived,
        "which": s.which,
    }


def modes_of(b: Buffers) -> tuple[int, ...]:
    """Return the mode of each machine, then for each surface whether the motion slides on it.

    Parameters
    ----------
    b : Buffers
        The buffers of a run.

    Returns
    -------
    tuple of int
        The modes stored with rows.
    """
    return (*b.now.mode, *b.sliding.flags)


def beginning(t: float, t_end: float) -> Vector:
    """Return `Now.clock` for a run that has not started."""
    return [t, 0.0, 1.0, t_end, t, -math.inf, math.inf, abs(t_end)]


def failure(event: int, b: Buffers, relations: list[str]) -> HybridError:
    """Return the error for an event that ends a run.

    Parameters
    ----------
    event : int
        The value returned by `integrators.loop.run_to_event`.
    b : Buffers
        The buffers of the run.
    relations : list of str
        Their names.

    Returns
    -------
    HybridError
        The error to raise.
    """
    memory = b.memory
    counts = memory.counts
    scene = b.now.clock[T], b.now.y, modes_of(b)
    if event == kernel.TOO_SMALL:
        return StepTooSmall("step size below the clock's resolution", *scene)
    if event == loop.TOO_MANY_STEPS:
        return TooManySteps(f"the maximum of {b.plan.max_steps} steps was reached", *scene)
    if event == loop.MACHINE_LIVELOCK:
        machine = counts[loop.MACHINE]
        return Livelock(*scene, machine, memory.switches[machine], [])
    if event == loop.RELATION_LIVELOCK:
        # A relation in a guard may have changed once more than its machine has switched.
        machine = max(range(len(b.now.mode)), key=lambda i: memory.switches[i])
        if memory.switches[machine] >= MOST_SWITCHES // 2:
            return Livelock(*scene, machine, memory.switches[machine], [])
        names = [*relations, *["the pull onto a surface"] * (len(memory.changes) - len(relations))]
        often = [name for r, name in enumerate(names) if memory.changes[r] >= MOST_SWITCHES]
        return Livelock(*scene, None, MOST_SWITCHES, often)
    w = listed(b.relations, counts[loop.ACTIVE])
    undefined = [
        name for r, name in enumerate(relations) if r in w.active and w.start[r] != w.start[r]
    ]
    text = f"{undefined[0]} compares NaN" if undefined else "NaN or infinity"
    return NotFinite(text, *scene)


def take_rows(b: Buffers) -> Arc:
    """Take the rows waiting in the buffers; only complete ones are counted there.

    Parameters
    ----------
    b : Buffers
        The buffers of the run.

    Returns
    -------
    Arc
        Possibly without rows.
    """
    rows = b.out.cursor[kernel.ROW]
    b.out.cursor[kernel.ROW] = 0
    states = [list(y) for y in b.out.rows_y[:rows]]
    return Arc(b.out.rows_t[:rows], states, modes_of(b))
