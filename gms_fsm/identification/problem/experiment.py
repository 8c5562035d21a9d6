"""A fit as a least-squares problem: variable projection over the runs of all records.

The run gives how the elements move; what enters the force linearly (stiffnesses, dampings, the
nuisance terms) is then solved for by non-negative least squares. Only the rest is searched.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
    Driver,
    FinishedRun,
    with_numbers,
)
from gms_fsm.identification.problem.unknowns import Coordinates, Unknown, values_by_key
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import value_in, varied

# Terms of the measurement that are no part of the model, with what they are.
NUISANCE: Mapping[str, str] = {
    "offset": "constant error of the sensor",
    "drift": "error of the sensor that grows with time",
    "inertia": "mass between contact and sensor, times acceleration",
}
MASS = "inertia"  # which is not negative, and makes a force
TINY = 1e-9  # of a linear parameter's largest value: what stands for 0 where a rule says > 0


@dataclass(frozen=True, eq=False)
class Point:
    """One proposal, evaluated.

    Parameters
    ----------
    u : ndarray
        Coordinates of what was searched.
    linear : ndarray
        What was solved for: the linear parameters, then the nuisance terms.
    residual : ndarray, shape (rows,)
        Model minus measurement, at the rows that count, weighted.
    lost : GMSError or None
        Why it could not be evaluated.
    """

    u: FloatArray
    linear: FloatArray
    residual: FloatArray
    lost: GMSError | None = None

    @property
    def cost(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)


@dataclass(frozen=True, eq=False)
class Experiment:
    """What is fitted to what.

    Parameters
    ----------
    subject : Mounted
        The model with its start values.
    searched, solved : tuple of Unknown
        The unknowns that are searched, and those that are solved for.
    names : tuple of str
        All of them in the order they were asked for.
    nuisance : tuple of str
        Keys of `NUISANCE`.
    courses : tuple of Course
        The records.
    driver : Driver
        Runs them.
    measured : ComparedColumn
        What is compared.
    ran : list of int
        One number: how many runs were made.
    weights : tuple of float
        What a residual of each course counts; empty for 1.
    """

    subject: Mounted
    searched: tuple[Unknown, ...]
    solved: tuple[Unknown, ...]
    names: tuple[str, ...]
    nuisance: tuple[str, ...]
    courses: tuple[Course, ...]
    driver: Driver
    measured: ComparedColumn
    ran: list[int]
    weights: tuple[float, ...] = ()

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
        if not self.weights:
            return np.concatenate(list(parts))
        every = zip(parts, self.weights, strict=True)
        return np.concatenate([part * weight**power for part, weight in every])

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
            "inertia": course.acceleration,
        }
        columns = [known[name] for name in self.nuisance]
        return np.stack(columns, axis=1) if columns else np.empty((course.t.size, 0))

    def columns(
        self, subject: Mounted, course: Course
    ) -> tuple[FinishedRun, FloatArray, FloatArray]:
        """Run a course; return the force without its linear parts, and one column for each part.

        The columns are differences of the force between two values of a parameter: exact, because
        the force is linear in it.
        """
        self.ran[0] += 1
        ran = self.driver.run(subject, course)
        whole = self.measured.values(ran)
        columns, rest = [], whole.copy()
        for each in self.solved:
            present = value_of(subject, each)
            step = present if present != 0.0 else 1.0
            moved = varied(subject, values_by_key(subject, [each], [present + step]))
            program = with_numbers(ran.program, moved, course, self.driver)
            column = (self.measured.values(ran, program) - whole) / step
            rest -= present * column
            columns.append(column)
        own = np.stack(columns, axis=1) if columns else np.empty((whole.size, 0))
        return ran, rest, np.concatenate([own, self.nuisance_columns(course)], axis=1)

    def reference(self, numbers: FloatArray) -> Mounted:
        """Return the subject with what was searched; linear parameters keep their start values."""
        return varied(self.subject, self.coordinates.values(numbers))

    # ------------------------------------------------------------------ evaluation
    def at(self, u: FloatArray) -> Point:
        """Evaluate a proposal: run all records, and solve for the linear parameters."""
        parts, rests = [], []
        try:
            subject = self.reference(self.coordinates.numbers(u))
            for course in self.courses:
                _, rest, columns = self.columns(subject, course)
                parts.append(columns[course.rows])
                rests.append(rest[course.rows])
            basis = self.weighted(parts)
            wanted = self.target - self.weighted(rests)
            if not (np.isfinite(basis).all() and np.isfinite(wanted).all()):
                raise ArithmeticError("the force is not finite")
            linear = self._solved(basis, wanted)
        except LOST as error:
            lost = error if isinstance(error, GMSError) else GMSError(str(error))
            far = np.full(self.target.size, 10.0 * self.typical)
            return Point(u, np.zeros(self.terms), far, lost)
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
        if not basis.shape[1]:
            return np.empty(0)
        bounded = np.isfinite(self._least)
        base = np.where(bounded, self._least, 0.0)
        scale = np.sqrt(np.einsum("ij,ij->j", basis, basis))
        scale[scale == 0.0] = 1.0
        scaled = basis / scale
        # The triangle of a QR decomposition has the same least-squares problem in a few rows.
        triangle: Any = np.linalg.qr(np.column_stack([scaled, wanted - basis @ base]), mode="r")
        square, right = triangle[:, :-1], triangle[:, -1]
        free = np.flatnonzero(~bounded)
        found, _ = nnls(np.concatenate([square, -square[:, free]], axis=1), right, maxiter=1000)
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


def split_unknowns(
    unknowns: Sequence[Unknown], linear: Sequence[str]
) -> tuple[tuple[Unknown, ...], tuple[Unknown, ...]]:
    """Return what is searched and what is solved for."""
    solved = [each for each in unknowns if each.key in linear and not np.isfinite(each.high)]
    return tuple(each for each in unknowns if each not in solved), tuple(solved)
