"""Measurement and model at all rows of the records of a fit, and what they repeat of themselves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.identification.certainty.statistics import phase_floor
from gms_fsm.identification.problem.experiment import Point
from gms_fsm.identification.problem.task import Task, at_all_rows, inside, training_rows
from gms_fsm.records.record import Record


@dataclass(frozen=True, eq=False)
class Residuals:
    """Measurement and model at all rows of a record.

    Parameters
    ----------
    record : Record
        The record.
    t, x, v : ndarray, shape (rows,)
        Time, s, and the motion: m, m/s.
    measured, modelled : ndarray, shape (rows,)
        What was compared; nuisance terms are in the model.
    rows, held : ndarray of bool, shape (rows,)
        The rows that were trained on, and those that were held out.
    """

    record: Record
    t: FloatArray
    x: FloatArray
    v: FloatArray
    measured: FloatArray
    modelled: FloatArray
    rows: NDArray[np.bool_]
    held: NDArray[np.bool_]


def residuals_of(task: Task, point: Point) -> Iterator[Residuals]:
    """Yield the residuals of each record."""
    test = task.options.test
    for record in task.records:
        modelled = at_all_rows(task.fine, point, task.along(record, None))
        motion = record.motion(task.options.smoothing)
        rows = record.chosen & np.isfinite(modelled)
        t, x, v = motion.time, motion.position, motion.velocity
        train = training_rows(record, task.options) & rows
        held = (inside(t, test) if test else np.zeros(len(record), bool)) & rows
        measured = record.columns[task.measured.column]
        yield Residuals(record, t, x, v, measured, modelled, train, held)


def floor_of(task: Task, period: float) -> float | None:
    """Return how far cycles are from their mean; None if none repeats."""
    squares, count = 0.0, 0
    for course in task.courses:
        rows = course.rows
        found = phase_floor(course.t[rows], course.measured[rows], period)
        if math.isfinite(found):
            squares, count = squares + found**2 * rows.sum(), count + int(rows.sum())
    return math.sqrt(squares / count) if count else None
