"""The outer loop: ask, fire, advance.

States of all machines are frozen while the kernel runs; they change only here, between two calls.
The loop is a generator: it yields what happened (`Arc`, `Firing`) and raises when it cannot go on,
so whoever listens keeps everything up to there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from integrators import advance as kernel
from integrators.advance import Control, Output, Work, put_row
from integrators.crossings import Margins, Watched, watched
from integrators.step_size import LEAST, starting_step
from integrators.steps import Coefficients, Dense, Flow, Vector, coefficients
from integrators.tableaux import Tableau

__all__ = [
    "Arc",
    "Firing",
    "HybridError",
    "Livelock",
    "NotFinite",
    "Options",
    "StepTooSmall",
    "Stepper",
    "Stop",
    "Switch",
    "System",
    "Workspace",
    "run",
]

MOST_SWITCHES = 100  # of one machine, or of one relation, while time stands still
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
    p : Any
        Parameters, handed on.
    held : int
        Number of held signs.
    strict : list of bool
        For each relation whether zero is false.
    relations : list of str
        Their names, for messages.
    knots : list of float
        Times that steps may not jump over.
    jumps : list of float
        Times at which the flow jumps: the step size starts anew.
    """

    flow: Flow
    flow_live: Flow
    arm: Callable[..., Any]
    margins: Margins
    p: Any
    held: int
    strict: list[bool]
    relations: list[str]
    knots: list[float] = field(default_factory=list)
    jumps: list[float] = field(default_factory=list)


class Switch(Protocol):
    """The machines, as the loop sees them."""

    mode: list[int]

    def ask(self, t: float, y: Vector) -> Sequence[tuple[int, int]]:
        """Return (machine, edge) for each machine that has an enabled edge, in machine order."""

    def fire(self, machine: int, edge: int, t: float, y: Vector) -> None:
        """Take an edge: update `mode`, and y if the edge assigns something."""


@dataclass(frozen=True)
class Options:
    """How to integrate.

    Parameters
    ----------
    method : Tableau or type
        A tableau, or a `scipy.integrate.OdeSolver` class.
    step : float, optional
        Fixed step; adaptive when left out.
    rtol, atol, max_step : float
        Of adaptive steps.
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
    atol: float
    max_step: float
    located: bool
    times: list[float] | None
    rows_at_once: int = ROWS_AT_ONCE


# --------------------------------------------------------------------------- what comes out
@dataclass(frozen=True, eq=False)
class Arc:
    """Rows between two switches: times, states y (rows, m), and the modes that held."""

    t: list[float]
    y: list[Vector]
    mode: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Stop:
    """A place where an arc ends: a crossing, either side of a jump, the end of the run."""

    t: float
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

    def __init__(self, message: str, t: float, y: Vector) -> None:
        super().__init__(message)
        self.t = t
        self.y = list(y)


class Livelock(HybridError):
    """Switches without progress in time, of one machine or of one relation."""

    def __init__(
        self, t: float, y: Vector, machine: int | None, edge: int | None, relations: list[str]
    ) -> None:
        super().__init__(f"{MOST_SWITCHES} switches without progress", t, y)
        self.machine = machine
        self.edge = edge
        self.relations = relations


class StepTooSmall(HybridError):
    """The error estimate asks for steps under the clock's resolution."""


class NotFinite(HybridError):
    """The flow returned NaN or infinity."""


# --------------------------------------------------------------------------- steppers
@dataclass(eq=False)
class Workspace:
    """Everything mutable of one run that a stepper shares with the loop."""

    system: System
    flow: Flow
    mode: list[int]
    held: Vector
    w: Watched
    out: Output
    knots: list[float]
    resolution: float


class Stepper(Protocol):
    """Carries a state along an arc; begins anew after each stop."""

    def begin(self, t: float, y: Vector, t_stop: float, ws: Workspace) -> None:
        """Start an arc at (t, y)."""

    def advance(
        self, t: float, y: Vector, t_stop: float, ws: Workspace, most_steps: int
    ) -> tuple[int, float]:
        """Integrate y in place; return the kernel's status and the time reached."""


class ExplicitStepper:
    """The kernel with one of our tableaux."""

    def __init__(self, method: Tableau, control: Control, size: int) -> None:
        self.method: Coefficients = coefficients(method)
        self.control = control

        def vector() -> Vector:
            return [0.0] * size

        self.f = vector()
        self.work = Work(
            k=[vector() for _ in method.B],
            y_new=vector(),
            f_new=vector(),
            error=vector(),
            dense=Dense(vector(), vector(), vector(), vector(), vector()),
        )
        self.h = 0.0
        self.error_before = 1.0

    def begin(self, t: float, y: Vector, t_stop: float, ws: Workspace) -> None:
        """Evaluate the slope and choose a fresh starting step."""
        p = ws.system.p
        ws.flow(t, y, ws.mode, ws.held, p, self.f)
        if self.control.step > 0.0:
            return
        self.error_before = 1.0
        longest = min(self.control.max_step, t_stop - t)
        while True:
            try:
                self.h = starting_step(
                    ws.flow, t, y, self.f, ws.mode, ws.held, p, self.method.error_order,
                    self.control.rtol, self.control.atol, longest,
                    self.work.y_new, self.work.f_new,
                )  # fmt: skip
                return
            except Exception as error:
                longest *= LEAST  # its trial step went too far, see `advance`
                if not _is_arithmetic(error) or longest <= ws.resolution:
                    raise

    def refresh(self, t: float, y: Vector, ws: Workspace) -> None:
        """Evaluate the slope again but keep the step size (a solver that knows of no switch)."""
        ws.flow(t, y, ws.mode, ws.held, ws.system.p, self.f)

    def advance(
        self, t: float, y: Vector, t_stop: float, ws: Workspace, most_steps: int
    ) -> tuple[int, float]:
        """Run the kernel."""
        while True:
            try:
                return self._run_kernel(t, y, t_stop, ws, most_steps)
            except Exception as error:
                # Where IEEE arithmetic gives NaN and the kernel shrinks its step, Python's exp,
                # sqrt and / raise: a trial step too far must not end the run before its time.
                self.h *= LEAST
                if not _is_arithmetic(error) or self.h <= ws.resolution:
                    raise
                t = max(t, ws.out.reached[0])

    def _run_kernel(
        self, t: float, y: Vector, t_stop: float, ws: Workspace, most_steps: int
    ) -> tuple[int, float]:
        status, t, self.h, self.error_before = kernel.advance(
            ws.flow, ws.system.margins, self.method, self.control, t, y, self.f, self.h,
            self.error_before, t_stop, ws.knots, ws.mode, ws.held, ws.system.p, ws.w, ws.out,
            self.work, most_steps,
        )  # fmt: skip
        return status, t


# --------------------------------------------------------------------------- the loop
def run(
    system: System, switch: Switch, t: float, y: Vector, t_end: float, options: Options
) -> Iterator[Arc | Stop | Firing]:
    """Integrate from t to t_end and yield arcs, stops and firings in order.

    Parameters
    ----------
    system : System
        What flows.
    switch : Switch
        The machines; asked at the start and after every stop.
    t : float
        Start.
    y : list of float, shape (m,)
        State at t; a copy is taken.
    t_end : float
        End, > t.
    options : Options
        Method, tolerances, rows.

    Yields
    ------
    Arc, Stop or Firing
        Arcs hold the rows wanted; firings come one an edge, m of them at one time numbered 1..m.

    Raises
    ------
    Livelock, StepTooSmall, NotFinite
        When it cannot go on; all before has been yielded.
    """
    y = list(y)
    resolution = 4.0 * math.ulp(max(abs(t), abs(t_end)))
    ws = _workspace(system, switch, len(y), options, resolution)
    stepper = _stepper(options, len(y), t, resolution)
    out = ws.out
    clock = _Clock(system, ws, resolution)
    if out.every_step:
        yield Arc([t], [list(y)], tuple(switch.mode))
    fresh = True
    jumps = [s for s in system.jumps if options.located and s <= t_end]
    while True:
        microstep = 0
        while wanted := _ask(switch, t, y):
            for machine, edge in wanted:
                microstep += 1
                yield _fire(switch, machine, edge, t, y, microstep)
                clock.count_machine(t, y, machine, edge)
            fresh = True
            if not options.located:
                break
        if t >= t_end:
            break
        # A step that ends on a jump would see the value behind it: stop one clock tick before.
        jump = min((s for s in jumps if s > t), default=math.inf)
        t_stop = min(math.nextafter(jump, -math.inf), t_end)
        try:
            if options.located:
                _arm(ws, t, y)
            if fresh or options.located:
                # Without location the solver knows of no switch: it goes on with its old step.
                if not options.located and isinstance(stepper, ExplicitStepper) and stepper.h:
                    stepper.refresh(t, y, ws)
                else:
                    stepper.begin(t, y, t_stop, ws)
                fresh = False
            status = kernel.FULL
            while status == kernel.FULL:
                steps = options.rows_at_once if options.located else 1
                status, t = stepper.advance(t, y, t_stop, ws, steps)
                if out.cursor[kernel.ROW]:
                    yield _take_rows(out, switch)
                if not options.located:
                    break
        except Exception as error:
            t = max(t, out.reached[0])
            if out.cursor[kernel.ROW]:
                yield _take_rows(out, switch)
            if _is_arithmetic(error):
                raise NotFinite(f"{type(error).__name__}: {error}", t, y) from None
            raise
        if status == kernel.TOO_SMALL:
            raise StepTooSmall("step size under the clock's resolution", t, y)
        if status == kernel.NOT_FINITE:
            raise NotFinite("NaN or infinity", t, y)
        if status == kernel.REACHED and t < t_end:
            yield Stop(t, list(y), tuple(switch.mode))
            t = jump
            yield Stop(t, list(y), tuple(switch.mode))
            if out.every_step:
                yield Arc([t], [list(y)], tuple(switch.mode))
        if status == kernel.CROSSED:
            clock.count_relations(t, y)
            yield Stop(t, list(y), tuple(switch.mode))
    while out.cursor[kernel.NEXT_TIME] < len(out.times) and (
        out.times[out.cursor[kernel.NEXT_TIME]] <= t
    ):
        put_row(out, out.times[out.cursor[kernel.NEXT_TIME]], y)
        out.cursor[kernel.NEXT_TIME] += 1
    if out.cursor[kernel.ROW]:
        yield _take_rows(out, switch)
    yield Stop(t, list(y), tuple(switch.mode))


def _workspace(
    system: System, switch: Switch, size: int, options: Options, resolution: float
) -> Workspace:
    times = options.times
    capacity = ROWS_AT_ONCE if times is None else len(times)
    return Workspace(
        system=system,
        flow=system.flow if options.located else system.flow_live,
        mode=switch.mode,
        held=[0.0] * system.held,
        w=watched(system.strict, size),
        out=Output(
            times=times or [],
            every_step=times is None,
            rows_t=[0.0] * capacity,
            rows_y=[[0.0] * size for _ in range(capacity)],
            cursor=[0, 0, 0],
            reached=[-math.inf],
        ),
        knots=system.knots if options.located else [],
        resolution=resolution,
    )


def _stepper(options: Options, size: int, t: float, resolution: float) -> Stepper:
    if not isinstance(options.method, Tableau):
        from integrators.scipy_arcs import SciPyStepper

        return SciPyStepper(options.method, options, t)
    control = Control(
        step=options.step or 0.0,
        origin=t,
        rtol=options.rtol,
        atol=options.atol,
        max_step=options.max_step,
        resolution=resolution,
    )
    return ExplicitStepper(options.method, control, size)


def _is_arithmetic(error: Exception) -> bool:
    """Tell whether an error is math's way to say inf or nan (exp, sqrt and / raise in Python)."""
    return isinstance(error, ArithmeticError) or type(error) is ValueError


def _ask(switch: Switch, t: float, y: Vector) -> Sequence[tuple[int, int]]:
    try:
        return switch.ask(t, y)
    except Exception as error:
        if _is_arithmetic(error):
            raise NotFinite(f"a guard, {type(error).__name__}: {error}", t, y) from None
        raise


def _arm(ws: Workspace, t: float, y: Vector) -> None:
    """Hold signs, choose what to watch, remember its truth."""
    system, w = ws.system, ws.w
    for r in w.active:
        w.watch[r] = 0
    system.arm(t, y, ws.mode, system.p, ws.held, w.watch)
    w.active[:] = [r for r, flag in enumerate(w.watch) if flag]
    system.margins(t, y, ws.mode, system.p, w.watch, w.start)
    for r in w.active:
        g = w.start[r]
        w.truth[r] = g > 0.0 or (g == 0.0 and not w.strict[r])


def _fire(switch: Switch, machine: int, edge: int, t: float, y: Vector, microstep: int) -> Firing:
    y_before, mode_before = list(y), tuple(switch.mode)
    switch.fire(machine, edge, t, y)
    return Firing(t, microstep, machine, edge, y_before, mode_before, list(y), tuple(switch.mode))


def _take_rows(out: Output, switch: Switch) -> Arc:
    rows = out.cursor[kernel.ROW]
    out.cursor[kernel.ROW] = 0
    return Arc(out.rows_t[:rows], [list(y) for y in out.rows_y[:rows]], tuple(switch.mode))


class _Clock:
    """Counts switches while time stands still, and stops the run when there are too many."""

    def __init__(self, system: System, ws: Workspace, resolution: float) -> None:
        self.system, self.ws = system, ws
        self.standstill = 1000.0 * resolution
        self.t = -math.inf
        self.machines: dict[int, int] = {}
        self.relations: dict[int, int] = {}

    def _look(self, t: float) -> None:
        if t - self.t > self.standstill:
            self.machines.clear()
            self.relations.clear()
        self.t = t

    def count_machine(self, t: float, y: Vector, machine: int, edge: int) -> None:
        """Count a firing."""
        self._look(t)
        count = self.machines[machine] = self.machines.get(machine, 0) + 1
        if count >= MOST_SWITCHES:
            raise Livelock(t, y, machine, edge, [])

    def count_relations(self, t: float, y: Vector) -> None:
        """Count the relations that have just changed."""
        self._look(t)
        w, system = self.ws.w, self.system
        system.margins(t, y, self.ws.mode, system.p, w.watch, w.probe)
        for r in w.active:
            g = w.probe[r]
            if (g > 0.0 or (g == 0.0 and not w.strict[r])) != w.truth[r]:
                self.relations[r] = self.relations.get(r, 0) + 1
        often = [r for r, count in self.relations.items() if count >= MOST_SWITCHES]
        if often:
            raise Livelock(t, y, None, None, [system.relations[r] for r in often])
