"""Runs of one record under many numbers: the motion drives the model, the rows are those measured.

A run that fails, or needs more steps than its budget, is lost; nothing else is. Every thread keeps
its own buffers, so that runs can go side by side.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import GMSError, MissingExtraError, ParameterError, RecordError, shown
from gms_fsm.foundation.arguments import some_of, unknown
from gms_fsm.foundation.quantities import per_second
from gms_fsm.lowering.compiling import check_llvmlite
from gms_fsm.lowering.program import Program, arguments, same_text
from gms_fsm.records.motion import pieces
from gms_fsm.records.record import Record
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun
from gms_fsm.run.settings import Settings
from gms_fsm.run.simulate import Run
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.signals import Corners
from gms_fsm.traces.observed import Observed
from gms_fsm.traces.trace import Trace

BEGINS = ("relaxed", "run in")
MOVING = "run in from motion"  # a record that begins at rest is taken to be relaxed
COVERED = 0.9  # share of the travel that a run-in must cover
AT_REST = 1e-2  # of the highest speed
NEAR = 0.02  # of the travel: where the motion is back at its start
STEPS_PER_ROW = 60  # default budget of a run
FEWEST_STEPS = 200_000
MOST_KEPT = 32  # runs with their buffers, in each thread


def engine() -> str:
    """Return the fastest engine that is installed; all give the same numbers."""
    try:
        check_llvmlite()
    except MissingExtraError:
        return "ifelse"
    return "compiled"


@dataclass(frozen=True)
class ComparedColumn:
    """What of a run is compared with which column of the record.

    Parameters
    ----------
    text : str
        As the user gave it: ``"F"``, ``"gear.F"``, ``"load.x"``.
    column : str
        ``"force"``, ``"position"`` or ``"velocity"``.
    contact : str
        The contact whose force it is, if it is one.
    body : str
        The body whose position or velocity it is, if it is one.
    unit : str
        Its unit.
    """

    text: str
    column: str
    contact: str = ""
    body: str = ""
    unit: str = ""

    @classmethod
    def of(cls, text: Any, subject: Mounted) -> ComparedColumn:
        """Read what is measured; a `ParameterError` if the subject has no such thing."""
        contacts = [each.name for each in subject.system.contacts] if subject.named else []
        bodies = subject.bodies
        owner, _, which = text.rpartition(".") if isinstance(text, str) else ("", "", "")
        if which == "F":
            if not owner and len(contacts) <= 1:
                owner = subject.system.contacts[0].name
            if owner in [each.name for each in subject.system.contacts]:
                unit = subject.system.contact(owner).chart.force
                return cls(text, "force", contact=owner, unit=unit)
        elif owner in bodies and which in ("x", "v"):
            length = subject.system.body(owner).unit
            column, unit = {"x": ("position", length), "v": ("velocity", per_second(length))}[which]
            return cls(text, column, body=owner, unit=unit)
        known = ["F"] if len(contacts) <= 1 else []
        known += [f"{name}.F" for name in contacts]
        known += [f"{name}.{each}" for name in bodies for each in "xv"]
        raise ParameterError(
            f"there is nothing called {shown(text)} to compare with the record",
            place="measured",
            advice=f"it can be {some_of(known)}",
        )

    @property
    def length(self) -> str:
        """Unit of the position of what it belongs to."""
        return "rad" if self.unit in ("Nm", "rad", "rad/s") else "m"

    def values(self, ran: FinishedRun, program: Program | None = None) -> FloatArray:
        """Return its values at the rows of a run, with the numbers of a program."""
        program = ran.program if program is None else program
        if self.body:
            return np.asarray(
                getattr(ran.trace.body(self.body), {"position": "x"}.get(self.column, "v"))
            )
        seen = Observed(program, ran.trace.rows, compiled=engine() == "compiled")
        return seen[program.layout.contact(self.contact).of("F")]


@dataclass(frozen=True, eq=False)
class Course:
    """What one record makes a model do.

    Parameters
    ----------
    record : Record
        The record.
    t, v, x : ndarray, shape (rows,)
        The motion at its rows: s, m/s, m.
    measured : ndarray, shape (rows,)
        What the model is compared with.
    rows : ndarray of bool, shape (rows,)
        The rows that count.
    lead : tuple of ndarray
        Times and velocities before the first row: the run-in; empty without one.
    budget : int
        Steps a run may take.
    inputs : mapping of str to tuple of ndarray
        What the record gives to inputs of the chart, in the run-in and at the rows.
    initial : mapping
        The initial state; empty for that of the chart.
    known : bool
        Whether the state at the first row is known: the motion begins there, at rest, or a run-in
        leads to it, or it was asked for.
    """

    record: Record
    t: FloatArray
    v: FloatArray
    x: FloatArray
    measured: FloatArray
    rows: NDArray[np.bool_]
    lead: tuple[FloatArray, FloatArray]
    budget: int
    inputs: Mapping[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    initial: Mapping[str, Any] = field(default_factory=dict)
    known: bool = True

    @cached_property
    def signal(self) -> Corners:
        """The velocity, with the run-in."""
        return self._over_time(self.lead[1], self.v)

    @cached_property
    def given(self) -> dict[str, Corners]:
        """The inputs, with the run-in."""
        return {name: self._over_time(*values) for name, values in self.inputs.items()}

    def _over_time(self, before: FloatArray, values: FloatArray) -> Corners:
        times = np.concatenate([self.lead[0], self.t])
        return Corners(times, np.concatenate([before, values]), held=False)

    @cached_property
    def acceleration(self) -> FloatArray:
        """Of the motion at its rows, m/s^2: slopes of a cubic spline through the velocity.

        Differences of neighbours would be too small, at 25 rows a period by 1 %.
        """
        if self.t.size < 2:
            return np.zeros(self.t.size)
        slopes: FloatArray = CubicSpline(self.t, self.v)(self.t, 1)
        return slopes

    def thinned(self, every: int) -> Course:
        """Return the same course with every n-th row only."""
        if every <= 1:
            return self

        def fewer(before: FloatArray) -> FloatArray:
            return before[::-1][every - 1 :: every][::-1]

        found = self._with_rows(slice(None, None, every))
        inputs = {name: (fewer(before), u) for name, (before, u) in found.inputs.items()}
        return replace(found, lead=(fewer(self.lead[0]), fewer(self.lead[1])), inputs=inputs)

    def _with_rows(self, kept: slice) -> Course:
        return replace(
            self,
            t=self.t[kept],
            v=self.v[kept],
            x=self.x[kept],
            measured=self.measured[kept],
            rows=self.rows[kept],
            inputs={name: (before, u[kept]) for name, (before, u) in self.inputs.items()},
        )

    def begun(self, initial: Mapping[str, Any]) -> Course:
        """Return the same course from a given state, without a run-in."""
        nothing = np.empty(0)
        inputs = {name: (nothing, u) for name, (_, u) in self.inputs.items()}
        return replace(self, lead=(nothing, nothing), inputs=inputs, initial=initial)

    def ended(self) -> Course:
        """Return the same course up to the last row that counts."""
        return self._with_rows(slice(None, int(np.flatnonzero(self.rows)[-1]) + 1))


def courses_of(
    record: Record,
    column: str,
    *,
    rows: NDArray[np.bool_] | None,
    smoothing: float | None,
    begin: str,
    most_steps: int | None,
    seen: int | None = None,
    inputs: Sequence[str] = (),
) -> list[Course]:
    """Return what a record makes a model do: one course for each stretch without a gap in time.

    A stretch of one row alone is none.
    """
    for name in inputs:
        if name not in record.inputs:
            raise RecordError(
                f"it gives no input {name!r}, which the model reads",
                place=record.place,
                advice=f"give inputs={{{name!r}: ...}} when making the record",
            )
    motion = record.motion(smoothing)
    every = record.chosen if rows is None else rows & record.chosen
    force = record.columns.get(column, np.full(motion.time.size, np.nan))
    fastest = float(np.abs(motion.velocity).max())
    found = []
    for part in pieces(motion.time):
        if part.stop - part.start < 2:
            continue
        t, x, v = motion.time[part], motion.position[part], motion.velocity[part]
        last = 0
        still = part.start == 0 and abs(v[0]) < AT_REST * fastest
        if begin == BEGINS[1] or (begin == MOVING and not still):
            until = None if seen is None else max(seen - part.start, 0)
            last = _run_in(t[:until], x[:until], v[:until])
        lead = t[:last] - (t[last] - t[0]), v[:last]
        given = {name: record.inputs[name][part] for name in inputs}
        count = t.size + last
        found.append(
            Course(
                record,
                t,
                v,
                x,
                force[part],
                every[part],
                lead,
                max(FEWEST_STEPS, STEPS_PER_ROW * count) if most_steps is None else most_steps,
                {name: (u[:last], u) for name, u in given.items()},
                known=bool(last) or still or (begin == BEGINS[0] and part.start == 0),
            )
        )
    return found


def _run_in(t: FloatArray, x: FloatArray, v: FloatArray) -> int:
    """Return how many rows make a first pass, to put before the record; 0 if there is none.

    It ends where the motion is back at its starting position in the same direction after covering
    its travel, so that position and velocity continue.
    """
    travel, fastest = float(np.ptp(x)) if x.size else 0.0, float(np.abs(v).max(initial=0.0))
    if travel == 0.0:
        return 0
    moving = np.flatnonzero(np.abs(v) >= AT_REST * fastest)
    onward = v[moving[0]]  # a motion that begins at rest continues in the way it then takes
    covered = np.maximum.accumulate(x) - np.minimum.accumulate(x) >= COVERED * travel
    back = covered & (np.abs(x - x[0]) <= NEAR * travel) & (v * onward > 0.0)
    found = np.flatnonzero(back)
    if not found.size:
        return 0
    # The nearest of the first passage.
    passage = found[found < found[0] + max(2, t.size // 20)]
    return int(passage[np.argmin(np.abs(x[passage] - x[0]))])


@dataclass(frozen=True, eq=False)
class FinishedRun:
    """A run that reached its end.

    Parameters
    ----------
    program : Program
        With the numbers of the run.
    trace : Trace
        Its rows are those of the course.
    """

    program: Program
    trace: Trace


@dataclass(eq=False)
class _Kept:
    """The compiled run of a course in one thread, to be used again."""

    course: Course
    run: CompiledRun


@dataclass(frozen=True, eq=False)
class Driver:
    """Runs a subject along courses.

    Parameters
    ----------
    drive : str
        The signal of a system that the record's velocity replaces; empty for a model, and for a
        system that moves by itself.
    rtol : float
        Relative tolerance.
    budgets : int
        How many budgets of its course a run may take.
    """

    drive: str
    rtol: float
    budgets: int
    _own: threading.local = field(default_factory=threading.local, repr=False)

    def run(self, subject: Mounted, course: Course) -> FinishedRun:
        """Run; a `GMSError` if the numbers break a rule or the run fails."""
        kept, what = self._runs.get(id(course)), self.driven(subject, course)
        if kept is not None and same_text(kept.run.start.system, what.system):
            kept.run.reset(what)
            run: Run | CompiledRun = kept.run
        else:
            start = self.start(subject, course)
            if start.chosen.engine == "compiled":
                run = CompiledRun(start)
                while len(self._runs) >= MOST_KEPT:  # the oldest goes first
                    del self._runs[next(iter(self._runs))]
                self._runs[id(course)] = _Kept(course, run)
            else:
                run = Run(start)
        while run.advance():
            pass
        trace = run.recorder.trace()
        return FinishedRun(run.recorder.start.program, trace)

    @property
    def _runs(self) -> dict[int, _Kept]:
        runs: dict[int, _Kept] = vars(self._own).setdefault("runs", {})
        return runs

    def driven(self, subject: Mounted, course: Course) -> Mounted:
        """Return a subject that the motion of a course drives."""
        signals = course.given | ({self.drive: course.signal} if self.drive else {})
        return subject.driven(signals) if signals else subject

    def start(self, subject: Mounted, course: Course) -> Problem:
        """Return the start of a run along a course."""
        settings = Settings(
            engine=engine(), rtol=self.rtol, t_eval=course.t, max_steps=course.budget * self.budgets
        )
        first = float(course.signal.times[0] if self.drive else course.t[0])
        what, end = self.driven(subject, course), float(course.t[-1])
        return Problem.on(what, end, settings, t_start=first, initial=dict(course.initial))


def driver_of(subject: Mounted, drive: str | None, rtol: float, budgets: int) -> Driver:
    """Return what runs a subject."""
    system = subject.system
    if not subject.named:
        if drive is not None:
            raise ParameterError(
                "a model is driven by the velocity of the record",
                place="drive",
                value=drive,
                advice="leave it out; only a system has signals to choose from",
            )
        return Driver("v", rtol, budgets)
    if drive is not None:
        if drive not in system.signals:
            raise unknown("signal", drive, system.signals, place="drive")
        return Driver(drive, rtol, budgets)
    driven = [each.velocity for each in system.bodies if each.driven]
    if not driven:
        return Driver("", rtol, budgets)
    if len(driven) == 1 and driven[0] in system.signals:
        return Driver(str(driven[0]), rtol, budgets)
    raise ParameterError(
        "it cannot be told which signal the velocity of the record replaces",
        place="drive",
        advice=f"name one of {', '.join(system.signals) or 'the signals of the system'}",
    )


def with_numbers(program: Program, subject: Mounted, course: Course, driver: Driver) -> Program:
    """Return a program with the numbers of a subject in place of its own."""
    return replace(program, p=arguments(driver.driven(subject, course).system))


# --------------------------------------------------------------------------- side by side
Given = TypeVar("Given")
Result = TypeVar("Result")


class ThreadPool:
    """Calls side by side in threads; results come in order, whatever ends first.

    Parameters
    ----------
    workers : int, optional
        Number of threads; one per core by default.
    """

    def __init__(self, workers: int | None = None) -> None:
        self._threads = ThreadPoolExecutor(workers or os.cpu_count() or 1)
        self._limits: contextlib.AbstractContextManager[object] = contextlib.nullcontext()

    def __enter__(self) -> ThreadPool:
        self._limits = _alone()
        self._limits.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._threads.shutdown(wait=True, cancel_futures=True)
        self._limits.__exit__(None, None, None)

    def map(self, call: Callable[[Given], Result], given: Iterable[Given]) -> list[Result]:
        """Return the results of calls in the order given."""
        tasks = [self._threads.submit(call, each) for each in given]
        try:
            return [task.result() for task in tasks]
        finally:  # also on Ctrl-C: what has not begun does not begin
            for task in tasks:
                task.cancel()


def _alone() -> contextlib.AbstractContextManager[object]:
    """Let linear algebra use one thread per call, if the extra ``fast`` is there to say so.

    Its own threads would wait for each other and for those of the pool: a fit takes three times as
    long, and its last digits depend on the number of cores.
    """
    try:
        from threadpoolctl import threadpool_limits
    except ImportError:
        return contextlib.nullcontext()
    limits: contextlib.AbstractContextManager[object] = threadpool_limits(1, user_api="blas")
    return limits


LOST = (GMSError, ArithmeticError, np.linalg.LinAlgError)  # what makes a proposal worthless
