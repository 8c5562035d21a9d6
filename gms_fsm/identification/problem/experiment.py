"""A fit as a least-squares problem: variable projection over the runs of all records.

The run gives how the elements move; what enters the force linearly (stiffnesses, dampings, the
nuisance terms) is then solved for by non-negative least squares. Only the rest is searched.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import nnls

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import GMSError
from gms_fsm.foundation.quantities import per_second
from gms_fsm.identification.problem.runs import (
    LOST,
    ComparedColumn,
    Course,
    CourseRuns,
    Driver,
    ThreadPool,
)
from gms_fsm.identification.problem.unknowns import Coordinates, Unknown, values_by_key
from gms_fsm.lowering.program import arguments
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import known_in, value_in, varied

# The values at the rows of a course without their linear parts, then one column for each of these.
Modelled = FloatArray | GMSError

# Terms of the measurement that are no part of the model, with what they are.
NUISANCE: Mapping[str, str] = {
    "offset": "constant error of the sensor",
    "drift": "error of the sensor that grows with time",
    "inertia": "mass between contact and sensor, times acceleration",
}
MASS = "inertia"  # which is not negative, and makes a force
AT_ONCE = 4_000_000  # numbers in the tables of runs that are made together
TINY = 1e-9  # of a linear parameter's largest value: what stands for 0 where a rule says > 0


@dataclass(frozen=True, eq=False)
class Point:
    """One proposal, evaluated."""

    u: FloatArray  # coordinates of what was searched
    linear: FloatArray  # what was solved for: the linear parameters, then the nuisance terms
    residual: FloatArray  # (rows,) model minus measurement, at the rows that count, weighted
    lost: GMSError | None = None  # why it could not be evaluated

    @property
    def cost(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)


@dataclass(frozen=True, eq=False)
class Experiment:
    """What is fitted to what."""

    subject: Mounted  # the model with its start values
    searched: tuple[Unknown, ...]
    solved: tuple[Unknown, ...]
    names: tuple[str, ...]  # all of them in the order they were asked for
    nuisance: tuple[str, ...]  # keys of `NUISANCE`
    courses: tuple[Course, ...]  # the records
    driver: Driver  # runs them
    measured: ComparedColumn  # what is compared
    ran: list[int]  # one number: how many runs were made
    weights: tuple[float, ...] = ()  # what a residual of each course counts; empty for 1
    _own: threading.local = field(default_factory=threading.local, init=False, repr=False)

    @property
    def order(self) -> tuple[Unknown, ...]:
        """All unknowns in the order they were asked for."""
        every = {each.name: each for each in (*self.searched, *self.solved)}
        return tuple(every[name] for name in self.names)

    @cached_property
    def coordinates(self) -> Coordinates:
        """Of what is searched."""
        return Coordinates(self.subject, self.searched)

    @cached_property
    def target(self) -> FloatArray:
        """The measured values at the rows that count, weighted."""
        return self.weighted([each.measured[each.rows] for each in self.courses])

    def weighted(self, parts: Sequence[FloatArray], power: float = 1.0) -> FloatArray:
        """Return the values at the rows of all courses, times their weights."""
        if self.weights:
            every = zip(parts, self.weights, strict=True)
            parts = [part * weight**power for part, weight in every]
        return np.concatenate(list(parts)) if len(parts) > 1 else parts[0]

    def unweighted(self, values: FloatArray) -> FloatArray:
        """Return values without their weights."""
        ends = np.cumsum([int(each.rows.sum()) for each in self.courses])[:-1]
        return self.weighted(np.split(values, ends), -1.0)

    @cached_property
    def typical(self) -> float:
        """Root mean square of the measured values about their mean, or their size if constant."""
        return float(np.std(self.target)) or float(np.abs(self.target).max()) or 1.0

    # ------------------------------------------------------------------ columns
    def nuisance_columns(self, course: Course) -> FloatArray:
        """Return the nuisance terms of a record for one unit of each, shape (rows, terms)."""
        known = {
            "offset": np.ones(course.t.size),
            "drift": course.t - course.t[0],
            "inertia": course.acceleration if MASS in self.nuisance else None,
        }
        columns = [known[name] for name in self.nuisance]
        return np.stack(columns, axis=1) if columns else np.empty((course.t.size, 0))

    def _runs(self, course: Course) -> tuple[CourseRuns, FloatArray]:
        """Return the runs of a course in this thread, and its nuisance columns."""
        known: dict[int, Any] = vars(self._own).setdefault("runs", {})
        if id(course) in known:
            _, runs, nuisance = known[id(course)]
            return runs, nuisance
        start = self.driver.start(self.subject, course)
        names = [[_called(self.subject, each) for each in u] for u in (self.searched, self.solved)]
        made = CourseRuns(start, self.measured, *names), self.nuisance_columns(course)
        if any(course is each for each in self.courses):
            known[id(course)] = (course, *made)
        return made

    def modelled(self, places: Sequence[FloatArray], course: Course) -> list[Modelled]:
        """Run a course with each of some proposals; return the error of one that is lost."""
        self.ran[0] += len(places)
        try:
            runs, nuisance = self._runs(course)
        except LOST as error:
            return [_as_error(error)] * len(places)
        found: dict[int, Modelled] = {}
        numbers = np.full((len(places), len(self.searched)), np.nan)  # which no run takes
        for i, u in enumerate(places):
            try:
                numbers[i] = self.coordinates.numbers(u)
            except ArithmeticError as error:
                found[i] = _as_error(error)
        if runs.known:
            present = [value_of(self.subject, each) for each in self.solved]
            which, tables = runs.tables(numbers, nuisance)
            tables[:, :, 0] -= tables[:, :, 1 : 1 + len(present)] @ np.array(present)
            found |= dict(zip(which.tolist(), tables, strict=True))
        return [
            found[i] if i in found else self._alone(own, course, nuisance)
            for i, own in enumerate(numbers)
        ]

    def modelled_once(self, u: FloatArray, course: Course) -> FloatArray:
        """Run a course with one proposal; a `GMSError` if it is lost."""
        found = self.modelled([u], course)[0]
        if isinstance(found, GMSError):
            raise found
        return found

    def _alone(self, numbers: FloatArray, course: Course, nuisance: FloatArray) -> Modelled:
        """Run a course from new, as a simulation does; slopes are differences, as above."""
        try:
            subject = self.reference(numbers)
            trace = self.driver.run(subject, course)
            whole = self.measured.values(trace)
            columns, rest = list[FloatArray](), whole.copy()
            for each in self.solved:
                present = value_of(subject, each)
                step = present if present != 0.0 else 1.0
                moved = varied(subject, values_by_key(subject, [each], [present + step]))
                p = arguments(self.driver.driven(moved, course).system)
                program = replace(trace.program, p=p)
                columns.append((self.measured.values(trace, program) - whole) / step)
                rest -= present * columns[-1]
        except LOST as error:
            return _as_error(error)
        return np.column_stack([rest, *columns, nuisance])

    def reference(self, numbers: FloatArray) -> Mounted:
        """Return the subject with what was searched; linear parameters keep their start values."""
        return varied(self.subject, self.coordinates.values(numbers))

    # ------------------------------------------------------------------ evaluation
    def every(self, places: Sequence[FloatArray], pool: ThreadPool | None = None) -> list[Modelled]:
        """Return what is modelled with each of some proposals at the rows that count, weighted."""
        if pool is not None and len(places) > 1:
            count = -(-len(places) // pool.workers)
            some = [places[i : i + count] for i in range(0, len(places), count)]
            return [each for found in pool.map(self.every, some) for each in found]
        most = max(1, AT_ONCE // (sum(each.t.size for each in self.courses) * (1 + self.terms)))
        if len(places) > most:
            return self.every(places[:most]) + self.every(places[most:])
        lost: dict[int, GMSError] = {}
        parts: list[list[FloatArray]] = [[] for _ in places]
        for course in self.courses:
            left = [i for i in range(len(places)) if i not in lost]
            whole = bool(course.rows.all())
            modelled = self.modelled([places[i] for i in left], course) if left else []
            for i, own in zip(left, modelled, strict=True):
                if isinstance(own, GMSError):
                    lost[i] = own
                else:
                    parts[i].append(own if whole else own[course.rows])
        return [lost[i] if i in lost else self.weighted(each) for i, each in enumerate(parts)]

    def forces(
        self, places: Sequence[FloatArray], linear: FloatArray, pool: ThreadPool | None = None
    ) -> list[FloatArray | None]:
        """Return what is modelled with given linear parameters; None where a proposal is lost."""
        return [
            None if isinstance(each, GMSError) else each[:, 0] + each[:, 1:] @ linear
            for each in self.every(places, pool)
        ]

    def many(self, places: Sequence[FloatArray], pool: ThreadPool | None = None) -> list[Point]:
        """Evaluate proposals: run all records, and solve for the linear parameters."""
        return [
            self._point(u, each) for u, each in zip(places, self.every(places, pool), strict=True)
        ]

    def at(self, u: FloatArray) -> Point:
        """Evaluate one proposal; where nothing is searched there is only one."""
        return self.many([u])[0] if self.searched else self._only

    @cached_property
    def _only(self) -> Point:
        return self.many([np.empty(0)])[0]

    def _point(self, u: FloatArray, found: Modelled) -> Point:
        try:
            if isinstance(found, GMSError):
                raise found
            basis, wanted = found[:, 1:], self.target - found[:, 0]
            linear = self._solved(basis, wanted)
        except LOST as error:
            far = np.full(self.target.size, 10.0 * self.typical)
            return Point(u, np.zeros(self.terms), far, _as_error(error))
        return Point(u, linear, basis @ linear - wanted)

    @property
    def terms(self) -> int:
        """How many numbers are solved for."""
        return len(self.solved) + len(self.nuisance)

    @cached_property
    def _least(self) -> FloatArray:
        """The lower bounds of what is solved for."""
        own = [each.low if np.isfinite(each.low) else each.least for each in self.solved]
        return np.array([*own, *map(self.least_nuisance, self.nuisance)])

    def least_nuisance(self, name: str) -> float:
        """Return the least value of a nuisance term."""
        return 0.0 if name == MASS else -np.inf

    def unit_of(self, name: str) -> str:
        """Return the unit of a nuisance term."""
        unit = self.measured.unit
        mass = "kg" if self.measured.length == "m" else "kg m^2"
        return {"offset": unit, "drift": per_second(unit), MASS: mass}[name]

    def _solved(self, basis: FloatArray, wanted: FloatArray) -> FloatArray:
        """Solve for the linear parameters, each at least its lower bound.

        A parameter without a bound is the difference of two that are not negative.
        """
        if not self.terms:  # SciPy's own would write where it must not
            if not np.isfinite(wanted).all():
                raise ArithmeticError("the force is not finite")
            return np.empty(0)
        # The triangle of a QR decomposition has the same least-squares problem in a few rows.
        triangle: Any = np.linalg.qr(np.column_stack([basis, wanted]), mode="r")
        if not np.isfinite(triangle).all():
            raise ArithmeticError("the force is not finite")
        square, bounded = triangle[:, :-1], np.isfinite(self._least)
        base = np.where(bounded, self._least, 0.0)
        scale = np.sqrt(np.einsum("ij,ij->j", square, square))
        scale[scale == 0.0] = 1.0
        scaled, free = square / scale, np.flatnonzero(~bounded)
        right = triangle[:, -1] - square @ base
        found, _ = nnls(np.concatenate([scaled, -scaled[:, free]], axis=1), right, maxiter=1000)
        count = basis.shape[1]
        found[free] -= found[count:]
        solved: FloatArray = base + found[:count] / scale
        return solved

    # ------------------------------------------------------------------ results
    def fitted(self, point: Point) -> Mounted:
        """Return the subject with all numbers found."""
        subject = self.reference(self.coordinates.numbers(point.u))
        if not self.solved:
            return subject
        own = point.linear[: len(self.solved)]
        largest = np.abs(own).max() or 1.0
        values = [
            max(value, TINY * largest) if each.parameter.rule.startswith("> 0") else value
            for each, value in zip(self.solved, own, strict=True)
        ]
        return varied(subject, values_by_key(subject, self.solved, values))

    def start_point(self) -> Point:
        """Evaluate the start values."""
        return self.at(self.coordinates.start)


def value_of(subject: Mounted, unknown: Unknown) -> float:
    """Return the present value of an unknown."""
    value = np.asarray(value_in(subject, unknown.key), dtype=float)
    if unknown.element is None or value.ndim == 0:
        return float(value.flat[0])
    return float(value[unknown.element])


def _called(subject: Mounted, unknown: Unknown) -> str:
    """Return what a repeated run calls it: a single element has no number of its own."""
    several = unknown.element is not None and known_in(subject)[unknown.key][1] > 1
    return unknown.name if several else unknown.key


def _as_error(error: Exception) -> GMSError:
    return error if isinstance(error, GMSError) else GMSError(str(error))


def split_unknowns(
    unknowns: Sequence[Unknown], linear: Sequence[str]
) -> tuple[tuple[Unknown, ...], tuple[Unknown, ...]]:
    """Return what is searched and what is solved for."""
    solved = [each for each in unknowns if each.key in linear and not np.isfinite(each.high)]
    return tuple(each for each in unknowns if each not in solved), tuple(solved)
