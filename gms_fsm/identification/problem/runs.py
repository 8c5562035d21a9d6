"""Runs of one record under many numbers: the motion drives the model, the rows are those measured.

A run that fails, or needs more steps than its budget, is lost; nothing else is. Every thread keeps
its own buffers, so that runs can go side by side.
"""

from __future__ import annotations

import contextlib
import os
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
from gms_fsm.lowering.layout import SystemLayout
from gms_fsm.lowering.program import Program
from gms_fsm.records.motion import pieces
from gms_fsm.records.record import Record
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun
from gms_fsm.run.repeated.block import INITIAL, Place, RepeatedRun, Slope
from gms_fsm.run.repeated.numbers import RepeatedRuns
from gms_fsm.run.settings import Settings
from gms_fsm.run.simulate import Run
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.signals import Corners
from gms_fsm.systems.system import System
from gms_fsm.traces.observed import Observed
from gms_fsm.traces.trace import Trace

BEGINS = ("relaxed", "run in")
MOVING = "run in from motion"  # a record that begins at rest is taken to be relaxed
COVERED = 0.9  # share of the travel that a run-in must cover
AT_REST = 1e-2  # of the highest speed
NEAR = 0.02  # of the travel: where the motion is back at its start
STEPS_PER_ROW = 60  # default budget of a run
FEWEST_STEPS = 200_000
Names = Sequence[str]


def engine() -> str:
    """Return the fastest engine that is installed; all give the same numbers."""
    try:
        check_llvmlite()
    except MissingExtraError:
        return "ifelse"
    return "compiled"


@dataclass(frozen=True)
class ComparedColumn:
    """What of a run is compared with which column of the record."""

    text: str  # as the user gave it: ``"F"``, ``"gear.F"``, ``"load.x"``
    column: str  # ``"force"``, ``"position"`` or ``"velocity"``
    contact: str = ""  # the contact whose force it is, if it is one
    body: str = ""  # the body whose position or velocity it is, if it is one
    unit: str = ""  # its unit

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

    def name(self, system: System, layout: SystemLayout) -> str:
        """Return what the layout calls it."""
        if self.contact:
            return layout.contact(self.contact).of("F")
        body = system.body(self.body)
        return body.x if self.column == "position" else body.v

    def values(self, trace: Trace, program: Program | None = None) -> FloatArray:
        """Return its values at the rows of a run, with the numbers of a program."""
        program = trace.program if program is None else program
        if self.body:
            return np.asarray(
                getattr(trace.body(self.body), {"position": "x"}.get(self.column, "v"))
            )
        seen = Observed(program, trace.rows, compiled=engine() == "compiled")
        return seen[program.layout.contact(self.contact).of("F")]


@dataclass(frozen=True, eq=False)
class Course:
    """What one record makes a model do."""

    record: Record  # the record
    t: FloatArray  # (rows,) s
    v: FloatArray  # (rows,) velocity, m/s or rad/s
    x: FloatArray  # (rows,) position, m or rad
    measured: FloatArray  # (rows,) what the model is compared with
    rows: NDArray[np.bool_]  # (rows,) the rows that count
    lead: tuple[FloatArray, FloatArray]  # times and velocities before the first row
    budget: int  # steps a run may take
    inputs: Mapping[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    initial: Mapping[str, Any] = field(default_factory=dict)  # the initial state
    known: bool = True  # whether the state at the first row is known

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
class Driver:
    """Runs a subject along courses."""

    drive: str  # the signal of a system that the record's velocity replaces
    rtol: float  # relative tolerance
    budgets: int  # how many budgets of its course a run may take

    def run(self, subject: Mounted, course: Course) -> Trace:
        """Run; a `GMSError` if the numbers break a rule or the run fails."""
        start = self.start(subject, course)
        run = CompiledRun(start) if start.chosen.engine == "compiled" else Run(start)
        while run.advance():
            pass
        return run.recorder.trace()

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


class CourseRuns:
    """A course under many numbers, all in one call of machine code; of one thread.

    `known` says whether it can be: else each run is made alone, from new.
    """

    def __init__(
        self, start: Problem, compared: ComparedColumn, searched: Names, solved: Names
    ) -> None:
        self.runs, layout = RepeatedRuns(start), start.program.layout
        name, known = compared.name(start.system, layout), self.runs.known or {}
        placed = name in layout.y.shared or name in layout.observed.shared
        self.known = placed and bool(known) and {*known} >= {*searched, *solved}
        if not self.known:
            return
        self.run = RepeatedRun(start)
        self.known = self.run.columns.block.is_whole
        self.searched, self.kept = searched, layout.place(name)
        own = compared.contact and not start.system.contact(compared.contact).chart.totals
        parts = layout.contact(compared.contact).of("F_elements") if own else ""
        groups: dict[object, list[Slope]] = {}
        for i, name in enumerate(solved, 1):
            number = known[name]
            row, shared, element = number.place
            places = [number.place._replace(element=k) for k in range(number.n)] or [number.place]
            # Elements that only share a sum are moved together, and each part says its own slope.
            alone = not parts or element is None
            kept = self.kept if alone else layout.place(parts, element)
            groups.setdefault(name if alone else (row, shared), []).append(Slope(i, places, kept))
        self.slopes = [*groups.values()]

    def tables(self, numbers: FloatArray, others: FloatArray) -> tuple[NDArray[Any], FloatArray]:
        """Return which runs reached their end; for each the values at the rows, slopes, and others.

        Those left out have numbers that need a look, or have failed.
        """
        which: NDArray[np.intp] = np.arange(len(numbers))
        places: list[Place] = []
        values = numbers
        if self.searched:
            cells = self.runs.cells(dict(zip(self.searched, numbers.T, strict=True)))
            if cells is None:
                return which[:0], np.empty((0, 0, 1))
            which, places = np.flatnonzero(cells.certain), cells.places
            values = np.ascontiguousarray(cells.values[which])
        return self._made(which, places, values, others)

    def from_states(
        self, names: Names, states: FloatArray, others: FloatArray
    ) -> tuple[NDArray[Any], FloatArray]:
        """Return the same from initial states, which the start has given; numbers stay."""
        y = self.runs.start.program.layout.y
        rows = [row for name in names for row in y.all_of(name)]
        places = [Place(row, own=False, element=INITIAL) for row in rows]
        return self._made(np.arange(len(states)), places, np.ascontiguousarray(states), others)

    def _made(
        self, which: NDArray[Any], places: Sequence[Place], values: FloatArray, others: FloatArray
    ) -> tuple[NDArray[Any], FloatArray]:
        done, table = self.run.rows(places, values, self.kept, self.slopes, others)
        return which[done], table[done]


# --------------------------------------------------------------------------- side by side
Given = TypeVar("Given")
Result = TypeVar("Result")


class ThreadPool:
    """Calls side by side in threads; results come in order, whatever ends first."""

    def __init__(self, workers: int | None = None) -> None:
        self.workers = workers or os.cpu_count() or 1
        self._threads = ThreadPoolExecutor(self.workers)
        self._limits: contextlib.AbstractContextManager[object] = contextlib.nullcontext()

    def __enter__(self) -> ThreadPool:
        self._limits = _alone()
        self._limits.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._threads.shutdown(wait=True, cancel_futures=True)
        self._limits.__exit__(None, None, None)

    def map(self, call: Callable[[Given], Result], given: Iterable[Given]) -> list[Result]:
        """Return the results of calls in the order given; after Ctrl-C none begins."""
        return list(self._threads.map(call, given))


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
