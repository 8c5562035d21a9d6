"""The state in which a record begins, where nothing that is known leads to it.

The first stretch of the force tells it as far as it can, against the errors that the model has
where about the same force was measured: in the midst of a play they are small. What it cannot tell
is as by default, or as in training: a state that the elements had there together, rather where the
motion was nearly the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import RecordError
from gms_fsm.identification.problem.experiment import Experiment, Point
from gms_fsm.identification.problem.runs import COVERED, LOST, Course, CourseRuns
from gms_fsm.identification.problem.task import Task
from gms_fsm.run.problem import Problem
from gms_fsm.systems.mounted import Mounted

FROM_TRAINING, ANYHOW = 200, 100  # first guesses: states of training rows, and others
NEAR = 0.3  # of the travel and of the highest speed: how far a row in training may be
STRAY = 0.5  # of half the range of a variable: how far it may be from the state in training
SEEDS, STEPS = 3, 8  # the best of the guesses, which are refined, and how often
STEP, LENGTHS = 1e-3, (1.0, 0.5, 0.2, 0.05)  # of differences, of half the range; parts of a step
MOST_ROWS = 400
LEVELS = 20  # of what is measured, each with a noise of its own
ROUNDS = 2  # of states and parameters in turn

State = Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class _Starts:
    """The runs along the beginning of a course, from any states; those of training beside.

    A state is a row of numbers, one for each element of each variable in `widths`.
    """

    experiment: Experiment
    subject: Mounted
    course: Course
    terms: FloatArray  # of the nuisance terms
    start: Problem
    runs: CourseRuns
    widths: Mapping[str, int]
    seen: FloatArray  # states in training, shape (rows, values), those of nearest rows first
    apart: FloatArray  # how far these rows are

    def named(self, state: FloatArray) -> dict[str, FloatArray]:
        """Return a state by the names of its variables."""
        parts = np.split(state, np.cumsum([*self.widths.values()])[:-1])
        return dict(zip(self.widths, parts, strict=True))

    def forces(self, states: FloatArray) -> FloatArray:
        """Return the force at the rows from each of some states; NaN where a run fails."""
        course, experiment = self.course, self.experiment
        others = experiment.nuisance_columns(course)
        found = np.full((len(states), course.t.size), np.nan)
        if self.runs.known:
            keys = self.start.program.layout.keys
            names = [keys[name] for name in self.widths]
            which, tables = self.runs.from_states(names, states, others)
            found[which] = tables[:, :, 0]
        else:
            for i, state in enumerate(states):
                try:
                    trace = experiment.driver.run(self.subject, course.begun(self.named(state)))
                except LOST:
                    continue
                found[i] = experiment.measured.values(trace)
        return found + others @ self.terms


def _begun(task: Task, point: Point, course: Course) -> _Starts | None:
    """Return the runs of a course; None where the force has no memory."""
    coarse, fine = task.coarse, task.fine
    subject = fine.fitted(point)
    seen, near, widths = list[FloatArray](), list[FloatArray](), dict[str, int]()
    fastest = max(float(np.abs(each.v).max()) for each in coarse.courses) or 1.0
    travel = max(float(np.ptp(each.x)) for each in coarse.courses) or 1.0
    for each in (course, *coarse.courses):
        trace = coarse.driver.run(subject, each)
        layout = trace.program.layout
        names = [bank.of(variable) for bank in layout.banks for variable in bank.variables]
        widths = {layout.label(name): len(layout.y.all_of(name)) for name in names}
        parts = [trace.rows.y[:, layout.y.where(name)].reshape(len(each.t), -1) for name in names]
        apart = np.hypot((each.x - course.x[0]) / travel, (each.v - course.v[0]) / fastest)
        taken = slice(1 if each is course else None)  # of the course itself its default state
        seen.append(np.hstack([np.empty((len(each.t), 0)), *parts])[taken])
        near.append(apart[taken])
    if not widths:
        return None
    states, apart = np.concatenate(seen), np.concatenate(near)
    order = np.argsort(apart, kind="stable")
    begun = course.begun({name: np.zeros(n) for name, n in widths.items()})
    start = fine.driver.start(subject, begun)
    runs = CourseRuns(start, fine.measured, (), ())
    terms = point.linear[len(fine.solved) :]
    there = states[order], apart[order]
    return _Starts(fine, subject, course, terms, start, runs, widths, *there)


def _noise(task: Task, point: Point, measured: FloatArray) -> FloatArray:
    """Return the mean square of residuals in training where about the same was measured."""
    fine = task.fine
    values, squares = fine.unweighted(fine.target), fine.unweighted(point.residual) ** 2
    order = np.argsort(values, kind="stable")
    several = max(1, values.size // LEVELS)
    edges = np.arange(0, values.size, several)
    counts = np.diff(np.append(edges, values.size))
    level = np.add.reduceat(values[order], edges) / counts
    found: FloatArray = np.interp(measured, level, np.add.reduceat(squares[order], edges) / counts)
    return found


def estimated(
    task: Task, point: Point, course: Course, lead: float, tau: float
) -> dict[str, FloatArray]:
    """Return the state at the first row of a course, from the force of its first seconds."""
    first = course.t <= course.t[0] + lead
    short = replace(course, rows=course.rows & first & np.isfinite(course.measured))
    if not short.rows.any():
        raise RecordError(
            f"it has no force in its first {lead:g} s",
            place=course.record.place,
            advice="give initial={...} instead of 'estimate', or a longer lead",
        )
    short = short.ended()
    short = short.thinned(max(1, short.t.size // MOST_ROWS))
    starts = _begun(task, point, short)
    if starts is None:
        return {}
    seen, experiment = starts.seen, starts.experiment
    half = np.maximum(0.5 * np.ptp(seen, axis=0), 1e-300)
    between = float(np.median(np.diff(task.courses[0].t)))  # the rows that tau counts
    count = max(float(short.t[-1] - short.t[0]) / (between * tau), 1.0)
    noise = np.maximum(_noise(task, point, short.measured), (1e-6 * experiment.typical) ** 2)
    share = np.sqrt(count / short.rows.sum() / noise)

    def errors(states: FloatArray) -> FloatArray:
        found: FloatArray = share * (starts.forces(states) - short.measured)[:, short.rows]
        return found

    few = FROM_TRAINING // 2
    some = np.append(
        np.arange(min(few, len(seen))), np.arange(few, len(seen), 1 + len(seen) // few)
    )
    known, far = seen[some] / half, starts.apart[some] / NEAR
    middle = 0.5 * (known.min(axis=0) + known.max(axis=0))
    drawn = middle + np.random.default_rng(0).uniform(-1.0, 1.0, (ANYHOW, half.size))
    strays = ((drawn[:, None] - known) ** 2).sum(axis=2) / STRAY**2 + far**2
    anchors = np.append(np.arange(some.size), strays.argmin(axis=1))
    guesses = np.concatenate([known, drawn])
    prior = np.append(far**2, strays.min(axis=1))

    def costs(found: FloatArray) -> FloatArray:
        sums: FloatArray = np.nan_to_num((found**2).sum(axis=1), nan=np.inf)
        return sums

    every = costs(errors(guesses * half)) + prior
    best, least = guesses[every.argmin()], float(every.min())
    for i in np.argsort(every, kind="stable")[:SEEDS]:
        q, anchor, cost = guesses[i], known[anchors[i]], float(every[i])
        for _ in range(STEPS):
            nearby = np.concatenate([q[None], q + STEP * np.eye(q.size)])
            here, *moved = errors(nearby * half)
            slopes = np.nan_to_num((np.array(moved) - here) / STEP)
            pull = (q - anchor) / STRAY**2
            step = np.linalg.solve(
                slopes @ slopes.T + np.eye(q.size) / STRAY**2, -(slopes @ here + pull)
            )
            tries = q + np.outer(LENGTHS, step)
            stray = ((tries - anchor) ** 2).sum(axis=1) / STRAY**2 + far[anchors[i]] ** 2
            there = costs(errors(tries * half)) + stray
            if not there.min() < cost * (1.0 - 1e-3):
                break
            q, cost = tries[there.argmin()], float(there.min())
        if cost < least:
            best, least = q, cost
    return starts.named(best * half)


def with_states(task: Task, point: Point, tau: float) -> Task:
    """Return the task with the states of courses that begin in an unknown one; itself if none."""
    unknown = {place: each for place, each in task.placed.items() if not each.known}
    if not unknown or task.options.begin is not None:
        return task
    starts = {}
    for place, course in unknown.items():
        covered = np.maximum.accumulate(course.x) - np.minimum.accumulate(course.x)
        until = int(np.argmax(covered >= COVERED * covered[-1]))  # then the state is forgotten
        lead = float(course.t[max(until, min(MOST_ROWS, course.t.size - 1))] - course.t[0])
        starts[place] = estimated(task, point, course, lead, tau)
    return replace(task, starts=starts)
