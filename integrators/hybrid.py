"""The outer loop for Python: a generator over `integrators.loop.run_to_event`.

It yields events (`Arc`, `Stop`, `Slide`, `Firing`) and raises an error when it cannot continue, so
that the caller keeps everything up to that point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from integrators import loop
from integrators.advance import Output, RunPlan
from integrators.crossings import watched
from integrators.failures import (
    Entangled,
    HybridError,
    Livelock,
    NotFinite,
    Refused,
    StepTooSmall,
    TooManySteps,
    failure,
    modes_of,
)
from integrators.loop import MOST_SWITCHES, Buffers, Memory, Switching
from integrators.runners.states import COUNTS, CURSOR, beginning
from integrators.runners.ticks import Ticks
from integrators.sliding import (
    LIVE,
    MOST_SLIDING,
    Functions,
    Held,
    Surfaces,
    flow_on,
    follow_on,
    margins_on,
    sliding_scratch,
)
from integrators.step_size import Control
from integrators.steps import (
    ArcMotion,
    Dense,
    Flow,
    Margins,
    Now,
    Scratch,
    Vector,
    coefficients,
    stays,
)
from integrators.switching.jolts import TICK
from integrators.tableaux import EULER, Tableau

__all__ = [
    "MOST_SWITCHES",
    "ROWS_AT_ONCE",
    "Arc",
    "Buffers",
    "Entangled",
    "Equations",
    "Event",
    "Firing",
    "HybridError",
    "Livelock",
    "LoopOptions",
    "NotFinite",
    "Refused",
    "Slide",
    "StepTooSmall",
    "Stop",
    "Switching",
    "TooManySteps",
    "buffers",
    "events",
    "failure",
    "modes_of",
    "plan_of",
    "relaxation_times",
    "run",
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
    ticks : Ticks
        What ticks when: samplers, or discrete machines.
    discrete : list of int
        For each machine the bit at whose ticks alone it is asked; 0 for one that may fire any time.
    seen : int
        Number of values that `integrators.runners.columns.record` observes.
    follow : callable
        ``follow(t, y, mode, held, p)`` sets the components of y that others determine.
    kinds : list of int
        For each edge what matters to others (`IMPULSE`, `CHANGES_FORCES`, `TICK`, and `EVENT`
        shifted by the number of the event that it waits for), as bits; empty if all are 0.
    velocities : int
        Number of values that `Switch.jolts` compares; 0 if nothing can be jolted.
    leaps : bool
        Whether these may jump at a crossing, without an edge.
    events : int
        The bit with which a tick forgets events, once all machines were asked; 0 if there are none.
    lasting : int
        The bit with which a tick, before machines are asked, sets times of conditions to 0 that do
        not hold; 0 if there are none.
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
    ticks: Ticks = field(default_factory=Ticks.none)
    discrete: list[int] = field(default_factory=list)
    seen: int = 0
    follow: Callable[..., Any] = stays
    kinds: list[int] = field(default_factory=list)
    velocities: int = 0
    leaps: bool = False
    events: int = 0
    lasting: int = 0

    def functions(self, located: bool) -> Functions:
        """Return the functions for a run with or without located crossings."""
        flow = self.flow if located else self.flow_live
        return Functions(flow, self.arm, self.margins, self.normal, self.follow, self.p)


@dataclass(frozen=True)
class LoopOptions:
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
    floor : list of float, shape (m,), optional
        Tolerances to begin with where `atol` is 0: they never fall below; those of `atol` if
        omitted.
    relaxing : list of list of float
        For each machine in each of its modes, the relaxation time of the fastest component that
        relaxes at a constant rate, s; 0 if there is none.
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
    floor: list[float] | None = None
    relaxing: list[list[float]] = field(default_factory=list)


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
    seen: float  # the time at which the system shows it: t, or one clock tick before a jump at t


Event = Arc | Stop | Slide | Firing


# --------------------------------------------------------------------------- the loop
def run(
    equations: Equations,
    switch: Switching,
    t: float,
    y: Vector,
    mode: list[int],
    t_end: float,
    options: LoopOptions,
) -> Iterator[Event]:
    """Integrate from t to t_end and yield arcs, stops and firings in order.

    Parameters
    ----------
    equations : Equations
        The system.
    switch : Switching
        The machines; their guards are evaluated at the start and after every stop.
    t : float
        Start.
    y, mode : list of float, shape (m,), and of int, shape (n,)
        State and modes at t; copies are taken.
    t_end : float
        End, > t.
    options : LoopOptions
        Method, tolerances, rows.

    Yields
    ------
    Arc, Stop, Slide or Firing
        Arcs contain the requested rows, possibly none; each edge gives one firing, numbered from 1
        at each time.

    Raises
    ------
    Livelock, Entangled, StepTooSmall, NotFinite, TooManySteps
        If it cannot continue; everything before has been yielded.
    """
    return events(equations, switch, buffers(equations, t, y, mode, t_end, options), options)


def events(
    equations: Equations, switch: Switching, b: Buffers, options: LoopOptions, solver: Any = None
) -> Iterator[Event]:
    """Continue from the state in some buffers; see `run`.

    Between two events the buffers contain the complete state of the run
    (`integrators.runners.states`).

    Parameters
    ----------
    equations, switch, options
        As in `run`.
    b : Buffers
        From `buffers`, possibly with a restored state.
    solver : object, optional
        What takes the steps of a plan that is foreign; SciPy's solver of the options if omitted.

    Yields
    ------
    Arc, Stop, Slide or Firing
        As in `run`.
    """
    functions = equations.functions(options.located)
    on = Held(functions, b.now.held, b.sliding)
    if b.plan.foreign and solver is None:
        from integrators.runners.scipy_arcs import SciPyStepper

        solver = SciPyStepper(on, b, options)
    plainly = ArcMotion(functions.flow, functions.margins, functions.p, functions.follow)
    along = ArcMotion(flow_on, margins_on, on, follow_on)
    now, memory, out = b.now, b.memory, b.out
    before: tuple[Vector, tuple[int, ...]] = [], ()
    while True:
        motion = along if b.sliding.count else plainly
        try:
            event = loop.run_to_event(functions, switch, motion, b, options.rows_at_once)
            if solver is not None and event == loop.ADVANCE:
                left = b.plan.max_steps - out.steps
                solver.advance(min(options.rows_at_once if options.located else 1, left))
        except Exception:
            if out.row:
                yield take_rows(b)
            raise
        t, y, mode = now.t, now.y, modes_of(b)
        seen = min(t, now.seen)
        if event == loop.ROWS:
            yield take_rows(b)
        elif event == loop.FIRING:
            before = list(y), mode
        elif event == loop.FIRED:
            machine, edge = memory.machine, memory.edge
            scenes = (*before, list(y), mode)
            yield Firing(t, memory.microstep, machine, edge, *scenes, seen=seen)
        elif event == loop.SLID:
            yield Slide(t, memory.microstep, list(y), mode)
        elif event in (loop.STOPPED, loop.DONE):
            yield Stop(seen, list(y), mode)
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
    options: LoopOptions,
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
    plan = plan._replace(
        jumps=_as_list(plan.jumps),
        before_jumps=_as_list(plan.before_jumps),
        ticks=_as_list(plan.ticks),
    )
    times = options.times
    if capacity is None:
        capacity = ROWS_AT_ONCE if times is None else len(times)

    def vector() -> Vector:
        return [0.0] * size

    return Buffers(
        plan=plan,
        now=Now(
            **beginning(t, t_end),
            y=list(y),
            f=vector(),
            mode=list(mode),
            held=[0.0 if options.located else LIVE] * equations.held,
            floor=list(options.floor or options.atol),
        ),
        memory=Memory(
            **_zeros(COUNTS),
            edges=[-1] * n,
            switches=[0] * n,
            changes=[0] * len(strict),
            anchor=list(y),
            heard=[TICK] * n,
            was=[0.0] * equations.velocities,
            jolt=[0] * n,
        ),
        relations=watched(strict, size),
        sliding=sliding_scratch(
            surfaces, size, equations.held, len(strict), equations.seen, machines=n
        ),
        out=Output(
            **_zeros(CURSOR),
            every_step=times is None,
            times=[] if times is None else _as_list(times),
            rows_t=[0.0] * capacity,
            rows_y=[vector() for _ in range(capacity)],
        ),
        scratch=Scratch(
            k=[vector() for _ in plan.method.B],
            y_new=vector(),
            f_new=vector(),
            error=vector(),
            dense=Dense(vector(), vector(), vector(), vector(), vector()),
        ),
    )


def _zeros(names: Sequence[str]) -> dict[str, Any]:
    return dict.fromkeys(names, 0)


def _as_list(numbers: Sequence[float] | Any) -> list[Any]:
    """Return Python numbers: those of numpy are slow one by one."""
    return numbers.tolist() if hasattr(numbers, "tolist") else list(numbers)


def plan_of(
    equations: Equations, t: float, t_end: float, options: LoopOptions, machines: int
) -> RunPlan:
    """Return the settings of a run in the form that the kernel uses.

    Parameters
    ----------
    equations, t, t_end, options
        As in `run`.
    machines : int
        Their number.

    Returns
    -------
    RunPlan
        Made of lists, except for the jumps and ticks, of which there may be many: arrays.
    """
    # A SciPy solver needs no coefficients, but the loop's signature requires them.
    tableau = options.method if isinstance(options.method, Tableau) else EULER
    ticks = equations.ticks.between(t, t_end)
    if jumps := [s for s in equations.jumps if options.located and t < s <= t_end]:
        ticks = Ticks.of([ticks.times, np.array(jumps)], [ticks.bits, 0])
    times: Any = ticks.times  # arrays, where the plan's type says lists
    before: Any = np.nextafter(ticks.times, -math.inf)
    bits: Any = ticks.bits
    control = Control(
        step=options.step or 0.0,
        origin=t,
        rtol=options.rtol,
        atol=options.atol,
        max_step=options.max_step,
        time_scale=options.time_scale,
    )
    return RunPlan(
        method=coefficients(tableau),
        control=control,
        t_end=t_end,
        located=options.located,
        foreign=tableau is not options.method,
        jumps=times,
        before_jumps=before,
        ticks=bits,
        kinds=equations.kinds,
        leaps=equations.leaps,
        events=equations.events,
        lasting=equations.lasting,
        discrete=equations.discrete or [0] * machines,
        knots=equations.knots if options.located else [],
        relaxing=relaxation_times(options),
        max_steps=options.max_steps,
    )


def relaxation_times(options: LoopOptions) -> Vector:
    """Return the relaxation times of the modes of each machine, one machine after another.

    Parameters
    ----------
    options : LoopOptions
        Contains them by machine.

    Returns
    -------
    list of float
        As many for each machine, infinity where nothing relaxes.
    """
    rows = options.relaxing
    modes = max((len(row) for row in rows), default=0)
    padded = [row + [0.0] * (modes - len(row)) for row in rows]
    return [time or math.inf for row in padded for time in row]


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
    rows = b.out.row
    b.out.row = 0
    states = [list(y) for y in b.out.rows_y[:rows]]
    return Arc(b.out.rows_t[:rows], states, modes_of(b))
