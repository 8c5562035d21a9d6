"""One fit, from its arguments to the best point: coarse rows first, then all of them."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.identification.problem.experiment import Experiment, Point, split_unknowns
from gms_fsm.identification.problem.linear import linear_names
from gms_fsm.identification.problem.runs import (
    BEGINS,
    MOVING,
    ComparedColumn,
    Course,
    ThreadPool,
    courses_of,
    driver_of,
)
from gms_fsm.identification.problem.search import Best, hops, refine
from gms_fsm.identification.problem.unknowns import Unknown, unknowns_of, values_by_key
from gms_fsm.records.record import Record
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import varied

Window = tuple[float, float]
Place = tuple[int, int]  # the number of a record, and that of a stretch of it
COARSE_ROWS, FEWEST_ROWS = 3000, 300  # of all records together, and of each
COARSE_RTOL, FINE_RTOL = 1e-6, 1e-9
FINE_STEPS = (1e-3, 1e-4)
# What ran in the search must run with all rows and the small tolerance, too: these runs are few,
# and may take more steps.
FINE_BUDGETS = 10
WEIGHTS = ("rows", "records")
UNEVEN = 3.0  # the longest record over the shortest, from which on records count alike
DISTANT = 0.02  # relative: how much better the other beginning must be


@dataclass(frozen=True, kw_only=True, eq=False)
class FitOptions:
    """The arguments of a fit, checked."""

    free: tuple[str, ...]
    tied: tuple[str, ...] = ()
    nuisance: tuple[str, ...] = ("offset",)
    linear: tuple[str, ...] = ()
    measured: str = "F"
    drive: str | None = None
    train: Window | None = None
    test: Window | None = None
    cycles: float | None = None
    search: str = "hops"
    bounds: Mapping[str, Window] = field(default_factory=dict)
    seed: int = 0
    most_steps: int | None = None
    smoothing: float | None = None
    begin: str | None = None
    weight: str | None = None


@dataclass(frozen=True, eq=False)
class Task:
    """A model, records and options: everything that a fit depends on."""

    subject: Mounted  # with the start values
    records: tuple[Record, ...]  # the records
    options: FitOptions  # the arguments
    begin: str = MOVING  # what is before the first row of a record
    starts: Mapping[Place, Mapping[str, FloatArray]] = field(default_factory=dict)
    ran: list[int] = field(default_factory=lambda: [0])  # one number: how many runs were made

    @cached_property
    def measured(self) -> ComparedColumn:
        """What is compared."""
        return ComparedColumn.of(self.options.measured, self.subject)

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """What is found."""
        given = self.options
        return unknowns_of(self.subject, given.free, given.tied, given.bounds)

    @cached_property
    def placed(self) -> Mapping[Place, Course]:
        """The stretches of records with rows to train on, up to the last of them."""
        found: dict[Place, Course] = {}
        for i, record in enumerate(self.records):
            along = self.along(record, training_rows(record, self.options))
            found |= {(i, j): each.ended() for j, each in enumerate(along) if each.rows.any()}
        return found

    @cached_property
    def courses(self) -> tuple[Course, ...]:
        """The same without their places."""
        return tuple(self.placed.values())

    def along(self, record: Record, rows: NDArray[np.bool_] | None) -> list[Course]:
        """Return what a record makes the model do, with the rows that count (None: all)."""
        given, seen = self.options, None
        own = next((i for i, each in enumerate(self.records) if record is each), None)
        if own is not None:  # its run-in was that of training rows
            known = np.flatnonzero(training_rows(record, given) & record.chosen)
            seen = int(known[-1]) + 1 if known.size else None
        found = courses_of(
            record,
            self.measured.column,
            rows=rows,
            smoothing=given.smoothing,
            begin=self.begin,
            most_steps=given.most_steps,
            seen=seen,
            inputs=self.bound,
        )
        if own is None:
            return found
        starts = [self.starts.get((own, j)) for j in range(len(found))]
        return [
            each if start is None else each.begun(start)
            for each, start in zip(found, starts, strict=True)
        ]

    @property
    def bound(self) -> tuple[str, ...]:
        """The inputs of the records that the model reads."""
        given = {name for record in self.records for name in record.inputs}
        return tuple(name for name in self.subject.bindable if name in given)

    # ------------------------------------------------------------------ as least squares
    @cached_property
    def fine(self) -> Experiment:
        """With all rows."""
        return self._experiment(self.courses, FINE_RTOL, FINE_BUDGETS)

    @cached_property
    def coarse(self) -> Experiment:
        """With a few thousand rows, for searching."""
        return self.measured_as(self.courses)

    def measured_as(self, courses: tuple[Course, ...]) -> Experiment:
        """Return the experiment with few rows of some courses, which may have other values."""
        many = max(FEWEST_ROWS, COARSE_ROWS // len(courses))
        few = [each.thinned(max(1, int(each.rows.sum()) // many)) for each in courses]
        return self._experiment(tuple(few), COARSE_RTOL, 1)

    def _experiment(self, courses: tuple[Course, ...], rtol: float, budgets: int) -> Experiment:
        given = self.options
        linear = (*given.linear, *(linear_names(self.subject) if self.measured.contact else ()))
        searched, solved = split_unknowns(self.unknowns, linear)
        driver = driver_of(self.subject, given.drive, rtol, budgets)
        names = tuple(each.name for each in self.unknowns)
        return Experiment(
            self.subject,
            searched,
            solved,
            names,
            given.nuisance,
            courses,
            driver,
            self.measured,
            self.ran,
            self._weights(courses),
        )

    def _weights(self, courses: Sequence[Course]) -> tuple[float, ...]:
        """Return what a residual of each course counts, so that records count alike if asked."""
        rows: dict[int, int] = {}
        for course in courses:
            rows[id(course.record)] = rows.get(id(course.record), 0) + int(course.rows.sum())
        counts = list(rows.values())
        equal = self.options.weight == "records"
        if self.options.weight is None:
            equal = max(counts) > UNEVEN * min(counts)
        if not equal or len(counts) < 2:
            return ()
        mean = sum(counts) / len(counts)
        return tuple(math.sqrt(mean / rows[id(course.record)]) for course in courses)

    def beginning(self, begin: str) -> Task:
        """Return the same task with another beginning."""
        return replace(self, begin=begin)

    def without(self, name: str, value: float) -> Task:
        """Return the same task with one of its unknowns held at a value."""
        gone = next(each for each in self.unknowns if each.name == name)
        kept = [each for each in self.unknowns if each.name != name]
        subject = varied(self.subject, values_by_key(self.subject, [gone], [value]))
        tied = tuple(key for key in self.options.tied if any(e.key == key for e in kept))
        names = {*(each.name for each in kept), *(each.key for each in kept)}
        bounds = {key: pair for key, pair in self.options.bounds.items() if key in names}
        options = replace(
            self.options, free=tuple(each.name for each in kept), tied=tied, bounds=bounds
        )
        return replace(self, subject=subject, options=options)

    # ------------------------------------------------------------------ searching
    def coarse_search(self, best: Best, pool: ThreadPool) -> Task:
        """Search on few rows; return the task with the beginning that suits the data."""
        given = self.options
        (_local if given.search == "local" else hops)(self.coarse, given.seed, best, pool)
        return self.settled(best)

    def settled(self, best: Best) -> Task:
        """Return the task with the beginning that fits better, if the user did not say."""
        if self.options.begin is not None or best.point is None:
            return self
        found = self
        for begin in BEGINS:
            other = self.beginning(begin)
            pairs = zip(other.courses, self.courses, strict=True)
            if all(one.lead[0].size == own.lead[0].size for one, own in pairs):
                continue  # the same runs
            there = other.coarse.at(best.point.u)
            if there.lost is None and there.cost < (1.0 - DISTANT) * best.point.cost:
                best.point, found = there, other
        return found

    def polish(self, u: FloatArray, best: Best, pool: ThreadPool) -> None:
        """Refine on all rows, with smaller and smaller steps."""
        for step in FINE_STEPS:
            found = refine(self.fine, u, step, pool=pool, kept=best)
            u = found.u if found.lost is None else u


def training_rows(record: Record, options: FitOptions) -> NDArray[np.bool_]:
    """Return which rows of a record may be trained on: without `train`, all but those of `test`."""
    time = record.columns["time"]
    if options.train is not None:
        return inside(time, options.train)
    return ~inside(time, options.test) if options.test is not None else np.ones(time.size, bool)


def inside(time: FloatArray, window: Window) -> NDArray[np.bool_]:
    """Return which times are in a window, its end excluded."""
    found: NDArray[np.bool_] = (time >= window[0]) & (time < window[1])
    return found


def _local(experiment: Experiment, _: int, best: Best, pool: ThreadPool) -> None:
    best.take([experiment.start_point()])
    refine(experiment, experiment.coordinates.start, 1e-2, 30, pool, best)


@contextlib.contextmanager
def bar(text: str, progress: bool | None) -> Iterator[Callable[[float], None]]:
    """Show a progress bar on standard error."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not (console.is_terminal if progress is None else progress):
        yield lambda _: None
        return
    columns = text, BarColumn(), TaskProgressColumn(), TimeElapsedColumn()
    with Progress(*columns, console=console) as shown:
        task = shown.add_task(text, total=1.0)
        yield lambda share: shown.update(task, completed=share)


def stretches(courses: Sequence[Course], residual: FloatArray) -> list[FloatArray]:
    """Return residuals by unbroken stretches of rows."""
    places = [np.flatnonzero(course.rows) for course in courses]
    ends = np.cumsum([where.size for where in places])[:-1]
    found = list[FloatArray]()
    for where, own in zip(places, np.split(residual, ends), strict=True):
        found += np.split(own, np.flatnonzero(np.diff(where) > 1) + 1)
    return [each for each in found if each.size]


def at_course(experiment: Experiment, point: Point, course: Course) -> FloatArray:
    """Return the modelled values at the rows of a course, nuisance terms included."""
    modelled = experiment.modelled_once(point.u, course)
    found: FloatArray = modelled[:, 0] + modelled[:, 1:] @ point.linear
    return found


def at_all_rows(experiment: Experiment, point: Point, courses: Sequence[Course]) -> FloatArray:
    """Return the modelled values at all rows of a record; NaN where a row is part of no course."""
    time = courses[0].record.columns["time"]
    found = np.full(time.size, np.nan)
    for course in courses:
        place = int(np.searchsorted(time, course.t[0]))
        found[place : place + course.t.size] = at_course(experiment, point, course)
    return found
