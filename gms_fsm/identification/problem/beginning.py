"""The state in which a record begins, where nothing that is known leads to it.

The first stretch of the force tells it as far as it can; a prior, the range of states in training,
decides what it cannot tell: in the middle of a play every deflection gives the same force.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import RecordError
from gms_fsm.identification.problem.experiment import Experiment, Point
from gms_fsm.identification.problem.runs import COVERED, LOST, Course
from gms_fsm.identification.problem.task import Task

ALIKE = 13  # first guesses: all elements alike, or all pulled by the same way
ALONE = 3  # values of one element at a time
ANYHOW = 20  # first guesses at random, times the number of values
PASSES = 1
MOST_ROWS = 400
ROUNDS = 2  # of states and parameters in turn

State = Mapping[str, FloatArray]


def state_ranges(experiment: Experiment, point: Point) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return the lowest and highest values of each state variable in training, by its name."""
    subject, found = experiment.fitted(point), dict[str, tuple[FloatArray, FloatArray]]()
    for course in experiment.courses:
        ran = experiment.driver.run(subject, course)
        layout = ran.program.layout
        for bank in layout.banks:
            for variable in bank.variables:
                name = bank.of(variable)
                values = np.asarray(ran.trace.rows.y[:, layout.y.where(name)])
                values = values.reshape(len(values), -1)
                low, high = values.min(axis=0), values.max(axis=0)
                label = layout.label(name)
                if label in found:
                    low = np.minimum(low, found[label][0])
                    high = np.maximum(high, found[label][1])
                found[label] = low, high
    return found


def estimated(
    experiment: Experiment, point: Point, course: Course, lead: float, tau: float
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
    subject, ranges = experiment.fitted(point), state_ranges(experiment, point)
    if not ranges:  # a force without a memory
        return {}
    terms = point.linear[len(experiment.solved) :]
    low, high = (np.concatenate([each[i] for each in ranges.values()]) for i in (0, 1))
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1e-300)
    ends = np.cumsum([each[0].size for each in ranges.values()])[:-1]
    noise = max(point.cost / max(point.residual.size, 1), (1e-6 * experiment.typical) ** 2)
    count = max(float(short.rows.sum()) / tau, 1.0)

    def state(q: FloatArray) -> dict[str, FloatArray]:
        values = np.split(middle + np.clip(q, -1.0, 1.0) * half, ends)
        return dict(zip(ranges, values, strict=True))

    def cost(q: FloatArray) -> float:
        begun = short.begun(state(q))
        try:
            ran = experiment.driver.run(subject, begun)
        except LOST:
            return np.inf
        model = experiment.measured.values(ran) + experiment.nuisance_columns(begun) @ terms
        error = (model - begun.measured)[begun.rows]
        return count * float(error @ error) / error.size / noise + float(q @ q)

    pulled = np.linspace(low.min(), high.max(), ALIKE)
    guesses = [np.full(low.size, share) for share in np.linspace(-1.0, 1.0, ALIKE)]
    guesses += [np.clip((each - middle) / half, -1.0, 1.0) for each in pulled]
    # Elements share a force: each by itself cannot leave the sum that fits at the start.
    guesses += [*np.random.default_rng(0).uniform(-1.0, 1.0, (ANYHOW * low.size, low.size))]
    least, best = min(((cost(q), i) for i, q in enumerate(guesses)))
    found = guesses[best]
    for _ in range(PASSES):
        for i in range(found.size):
            for share in np.linspace(-1.0, 1.0, ALONE):
                other = found.copy()
                other[i] = share
                if (there := cost(other)) < least:
                    least, found = there, other
    bounds = [(-1.0, 1.0)] * found.size
    options: Any = {"maxfev": 25 * found.size, "xtol": 1e-3, "ftol": 1e-3}
    polished = minimize(cost, found, method="Powell", bounds=bounds, options=options)
    return state(polished.x if polished.fun < least else found)


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
        starts[place] = estimated(task.fine, point, course, lead, tau)
    return replace(task, starts=starts)
