"""From the best point of a fit to its table: values, intervals, and what cannot be told."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import WEIGHTS, FloatArray
from gms_fsm.errors import GMSError
from gms_fsm.identification.certainty.profile import Profile, shown_interval
from gms_fsm.identification.certainty.region import Region, walked
from gms_fsm.identification.certainty.statistics import (
    LOOSE,
    NEGLIGIBLE,
    WIDE,
    Certainty,
    certainty,
    correlation_time,
)
from gms_fsm.identification.problem.experiment import MASS, NUISANCE, Experiment, Point
from gms_fsm.identification.problem.runs import ThreadPool
from gms_fsm.identification.problem.task import Task, stretches
from gms_fsm.identification.problem.unknowns import Unknown
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import known_in, value_in, varied

FIRST_STEP, LEAST_STEP, MOST_STEP = 1e-3, 1e-4, 0.1
OPEN = "cannot be told"
NO_INFLUENCE = "cannot be told: no influence on this record"
NOT_KNOWN = f"{OPEN}: its interval was not computed"
AT_BOUND = "at its bound"
SMOOTHED = "depends on the smoothing of the motion"
MOST_NAMED = 4  # parameters in one direction


@dataclass(frozen=True)
class Estimate:
    """One row of the table of a fit.

    Parameters
    ----------
    name : str
        Of the parameter, with the number of its element: ``k1``.
    value : float
        The estimate, in `unit`.
    low, high : float
        The ends of its 95 % interval.
    unit : str
        SI.
    note : str
        Empty, or what is to be said of it: that it cannot be told, that it is at its bound.
    meaning : str
        What it is.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    note: str = ""
    meaning: str = ""

    @property
    def told(self) -> bool:
        """Whether the record determines it."""
        return not self.note.startswith(OPEN)

    @property
    def shown(self) -> tuple[str, str]:
        """Value and interval as texts, with as many digits as the interval is worth.

        >>> Estimate("k1", 1234.5678, 1230.01, 1239.12, "N/m").shown
        ('1234.57', '1230.01 to 1239.12')
        >>> Estimate("C", 0.00123, 0.0, math.inf, "m/s").shown
        ('0.00123', 'any above 0')
        """
        return shown_interval(self.value, self.low, self.high)


@dataclass(frozen=True, eq=False)
class Assessed:
    """What is known about the unknowns of a fit."""

    table: tuple[Estimate, ...]
    covariance: FloatArray  # (p, p) of their values, in the order of the table
    certainty: Certainty  # in coordinates
    weakest: str  # the weakest direction in words
    better: Point | None = None  # a point met on the walk that fits clearly better on few rows
    # Of the parameters that cannot be told, the least rise met on the walk: it is at most as high.
    open_profiles: tuple[Profile, ...] = ()


@dataclass(frozen=True, eq=False)
class _Entry:
    """An unknown with its value, its slopes, and the coordinate in which its interval is made."""

    name: str
    unit: str
    meaning: str
    value: float
    slopes: FloatArray  # d(force)/d(coordinate)
    kind: str  # "log", "excess", "linear"; "positive" is linear, relative to its value
    scale: float  # d(value)/d(coordinate)
    low: float
    high: float
    base: float = 0.0  # of an excess
    other: str = ""  # the name of the base, if it was found, too

    def place(self, half: float) -> tuple[float, float]:
        """Return the ends of the interval with a half width in the coordinate."""
        if not math.isfinite(half):
            return self.low, self.high
        if self.kind == "log":
            wide = min(half, 500.0)
            ends = self.value * math.exp(-wide), self.value * math.exp(wide)
        elif self.kind == "excess":
            wide, excess = min(half, 500.0), self.value - self.base
            ends = self.base + excess * math.exp(-wide), self.base + excess * math.exp(wide)
        else:
            ends = self.value - half * self.scale, self.value + half * self.scale
        return max(ends[0], self.low), min(ends[1], self.high)

    def wide(self, low: float, high: float, size: float) -> bool:
        """Return whether an interval is too wide to tell anything."""
        half = 0.5 * (high - low) / self.scale
        if self.kind == "linear":
            return half > WIDE
        if half * float(np.sqrt(np.mean(self.slopes**2))) < NEGLIGIBLE * size:
            return False
        if self.kind == "positive":
            return half > WIDE
        if self.kind == "excess":
            low, high = low - self.base, high - self.base
        return low <= 0.0 or math.log(high / low) > 2.0 * WIDE

    @property
    def at_bound(self) -> bool:
        """Whether the value is at the end of what it may be."""
        near = 1e-6 * max(abs(self.value), 1e-300)
        return abs(self.value - self.low) <= near or abs(self.value - self.high) <= near


def assessed(task: Task, point: Point, pool: ThreadPool) -> Assessed:
    """Return the table of a fit."""
    experiment = task.fine
    parts = stretches(task.courses, point.residual)
    basis = _basis(experiment, point)
    steps = np.full(len(experiment.searched), FIRST_STEP)
    for _ in range(2):
        searched = _searched_slopes(experiment, point, steps, pool)
        entries = _entries(experiment, point, searched, basis)
        slopes = np.stack([each.slopes for each in entries], axis=1)
        logarithmic = np.array([each.kind != "linear" for each in entries])
        sure = certainty(slopes, parts, logarithmic, experiment.typical)
        # Second pass: secants about as long as the interval average over jumps of the cost.
        names = [each.name for each in entries]
        width = np.array([sure.half[names.index(each.name)] for each in experiment.searched])
        steps = np.clip(0.25 * np.where(np.isfinite(width), width, 0.0), LEAST_STEP, MOST_STEP)
    region = _region(task, entries, sure, pool)
    nothing = (0.0, 0.0)
    entries, halves, covariance = _in_values(entries, sure)
    table = tuple(
        _estimate(
            each,
            half,
            bool(opened),
            experiment.typical,
            nothing if region is None else region.reach(each.name),
        )
        for each, half, opened in zip(entries, halves, sure.open, strict=True)
    )
    shift = _shift_of_smoothing(task, point, slopes)
    if shift is not None:
        table = tuple(
            _smoothed(each, entry, half, move)
            for each, entry, half, move in zip(table, entries, halves, shift.tolist(), strict=True)
        )
    table = tuple(_sampled(each, experiment) if each.name == MASS else each for each in table)
    noise = float(np.sqrt(point.cost / max(point.residual.size, 1)))
    words = _in_words(table, entries, noise, task) + _beyond(sure)
    profiles: tuple[Profile, ...] = ()
    if region is not None:
        profiles = tuple(
            region.profile(each.name, each.unit)
            for each in table
            if not each.told and each.note != NO_INFLUENCE
        )
    better = None if region is None else region.better
    return Assessed(table, covariance, sure, words, better, profiles)


def _shift_of_smoothing(task: Task, point: Point, slopes: FloatArray) -> FloatArray | None:
    """Return how far each coordinate would move without the smoothing of the motion.

    Half the time constant takes 15/16 of its effect away, which grows with its fourth power.
    """
    used = [
        motion.smoothing
        for record in task.records
        if "velocity" not in record.columns
        and (motion := record.motion(task.options.smoothing)).smoothing > 0.0
    ]
    if not used:
        return None
    less = replace(task, options=replace(task.options, smoothing=0.5 * min(used)))
    force = less.fine.forces([point.u], point.linear)[0]
    if force is None:
        return None
    change = force - point.residual - task.fine.target
    moved: Any = np.linalg.lstsq(slopes, change, rcond=1e-6)[0]
    found: FloatArray = -16.0 / 15.0 * moved
    return found


def _smoothed(each: Estimate, entry: _Entry, half: float, shift: float) -> Estimate:
    """Return an estimate whose interval covers what the smoothing may have done to it."""
    if not each.told or abs(shift) <= half:
        return each
    if entry.kind == "log":
        there = each.value * math.exp(min(max(shift, -5.0), 5.0))
    else:
        there = each.value + shift * entry.scale
    width = each.high - each.low
    low = max(min(each.low, there - 0.5 * width), entry.low)
    high = min(max(each.high, there + 0.5 * width), entry.high)
    note = each.note or f"{SMOOTHED}; without it about {there:.3g}"
    return replace(each, low=low, high=high, note=note)


def _sampled(each: Estimate, experiment: Experiment) -> Estimate:
    """Return an inertia whose interval covers what the motion may do between rows.

    Differences of neighbours would give another acceleration: where that matters, rows are few.
    """
    courses = [course for course in experiment.courses if course.t.size > 1]
    spline = np.concatenate([course.acceleration[course.rows] for course in courses])
    plain = np.concatenate([np.gradient(course.v, course.t)[course.rows] for course in courses])
    size = float(spline @ spline)
    doubt = abs(float((plain - spline) @ spline)) / size if size else 0.0
    if not each.told or doubt * each.value <= 0.5 * (each.high - each.low):
        return each
    note = each.note or f"depends on the motion between rows, by about {doubt:.1%}"
    low, high = each.low - doubt * each.value, each.high + doubt * each.value
    return replace(each, low=max(low, 0.0), high=high, note=note)


def unassessed(task: Task, point: Point) -> Assessed:
    """Return the table of a fit without intervals, for one that was interrupted or needs none."""
    experiment, count = task.fine, len(task.unknowns) + len(task.options.nuisance)
    nothing = np.zeros((point.residual.size, len(experiment.searched)))
    entries = _entries(experiment, point, nothing, _basis(experiment, point))
    table = tuple(
        Estimate(each.name, each.value, each.low, each.high, each.unit, NOT_KNOWN, each.meaning)
        for each in entries
    )
    tau = correlation_time(stretches(task.courses, point.residual))
    without = np.full(count, np.inf)
    sure = Certainty(
        np.full((count, count), np.nan),
        without,
        np.ones(count, dtype=bool),
        np.eye(count),
        without,
        np.ones(count),
        tau,
        max(point.residual.size / tau, 1.0),
    )
    return Assessed(table, sure.covariance, sure, "No interval was computed.")


def _region(
    task: Task, entries: Sequence[_Entry], sure: Certainty, pool: ThreadPool
) -> Region | None:
    """Walk through the likelihood region on few rows; None if nothing was searched."""
    experiment = task.coarse
    point = experiment.start_point()
    if point.lost is not None or not experiment.searched:
        return None
    names = [each.name for each in entries]
    places = [names.index(each.name) for each in experiment.searched]
    root = sure.directions * np.minimum(sure.spread, LOOSE)
    covariance = root @ root.T
    width = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    directions = {
        name: covariance[places, i] / width[i] for i, name in enumerate(names) if width[i] > 0.0
    }
    shares = dict(zip(names, sure.share.tolist(), strict=True))
    return walked(
        experiment, point, directions, root[places], sure.effective, shares, pool, task.options.seed
    )


def _in_values(
    entries: Sequence[_Entry], sure: Certainty
) -> tuple[list[_Entry], list[float], FloatArray]:
    """Return the covariance of the values, and half widths of the intervals in coordinates.

    Where the number that is the base of an excess was found, too, its uncertainty adds to that of
    the sum, whose interval is then relative to its value.
    """
    names = [each.name for each in entries]
    slopes = np.diag([each.scale for each in entries])
    found, halves = list(entries), sure.half.tolist()
    over = {i: names.index(each.other) for i, each in enumerate(entries) if each.other in names}
    for i, base in over.items():
        slopes[i, base] = entries[i].value / entries[base].value * entries[base].scale
    known = np.isfinite(np.diag(sure.covariance))
    covariance = slopes @ np.where(np.outer(known, known), sure.covariance, 0.0) @ slopes.T
    unknown = (np.abs(slopes) > 0.0) @ ~known
    np.fill_diagonal(covariance, np.where(unknown, np.inf, np.diag(covariance)))
    for i in over:
        deviation = math.sqrt(max(float(covariance[i, i]), 0.0))
        if math.isfinite(deviation) and sure.covariance[i, i] > 0.0:
            size = entries[i].value
            halves[i] *= deviation / math.sqrt(float(sure.covariance[i, i])) / size
            found[i] = replace(entries[i], kind="linear", scale=size)
        else:
            halves[i] = math.inf
    return found, halves, covariance


def _basis(experiment: Experiment, point: Point) -> FloatArray:
    found = experiment.every([point.u])[0]
    if isinstance(found, GMSError):
        raise found
    return found[:, 1:]


def _searched_slopes(
    experiment: Experiment, point: Point, steps: FloatArray, pool: ThreadPool
) -> FloatArray:
    """Return secants of the force by each searched coordinate, linear parameters held."""
    moves = [step * unit for step, unit in zip(steps, np.eye(steps.size), strict=True)]
    places = [point.u + sign * move for sign in (1.0, -1.0) for move in moves]
    found = experiment.forces(places, point.linear, pool)
    forward, backward = found[: steps.size], found[steps.size :]
    here = point.residual + experiment.target
    slopes = np.zeros((here.size, steps.size))
    for i, (step, ahead, behind) in enumerate(zip(steps, forward, backward, strict=True)):
        if ahead is not None and behind is not None:
            slopes[:, i] = (ahead - behind) / (2.0 * step)
        elif ahead is not None:
            slopes[:, i] = (ahead - here) / step
        elif behind is not None:
            slopes[:, i] = (here - behind) / step
    return slopes


def _entries(
    experiment: Experiment, point: Point, searched: FloatArray, basis: FloatArray
) -> list[_Entry]:
    """Return all unknowns in the order they were asked for, then the nuisance terms."""
    coordinates = experiment.coordinates
    numbers, scales = coordinates.numbers(point.u), coordinates.slopes(point.u)
    by_name: dict[str, _Entry] = {}
    values = dict(zip((each.key for each in experiment.searched), numbers, strict=True))
    for i, each in enumerate(experiment.searched):
        low, high = each.low, each.high
        base = 0.0
        if each.kind == "excess":
            base = float(values.get(each.other, np.min(value_in(experiment.subject, each.other))))
            low = max(low, each.least) if each.other in values else max(low, base)
        by_name[each.name] = _Entry(
            each.name,
            each.parameter.unit,
            each.parameter.meaning,
            float(numbers[i]),
            searched[:, i],
            each.kind,
            float(scales[i]),
            max(low, each.least),
            high,
            base,
            each.other if each.other in values else "",
        )
    for i, unknown in enumerate(experiment.solved):
        value, column = float(point.linear[i]), basis[:, i]
        size = float(np.sqrt(np.mean(column**2)))
        least = unknown.low if math.isfinite(unknown.low) else unknown.least
        positive = unknown.least >= 0.0 and value * size > 1e-9 * experiment.typical
        scale = value if positive else (experiment.typical / size if size else 1.0)
        by_name[unknown.name] = _Entry(
            unknown.name,
            unknown.parameter.unit,
            unknown.parameter.meaning,
            value,
            column * scale,
            "positive" if positive else "linear",
            scale,
            least,
            math.inf,
        )
    ordered = [by_name[each.name] for each in experiment.order]
    for i, name in enumerate(experiment.nuisance, start=len(experiment.solved)):
        column = basis[:, i]
        size = float(np.sqrt(np.mean(column**2)))
        scale = experiment.typical / size if size else 1.0
        unit, meaning = experiment.unit_of(name), NUISANCE[name]
        least = experiment.least_nuisance(name)
        value = float(point.linear[i])
        slopes = column * scale
        ordered.append(_Entry(name, unit, meaning, value, slopes, "linear", scale, least, math.inf))
    return ordered


def _estimate(
    entry: _Entry, half: float, opened: bool, size: float, ends: tuple[float, float]
) -> Estimate:
    low, high = entry.place(half)
    low = max(min(low, entry.value + ends[0]), entry.low)
    high = min(max(high, entry.value + ends[1]), entry.high)
    opened |= entry.wide(low, high, size)
    influence = float(np.sqrt(np.mean(entry.slopes**2)))
    note = ""
    if influence <= 1e-9 * size:
        note, low, high = NO_INFLUENCE, entry.low, entry.high
    elif opened:
        note = OPEN
    elif entry.at_bound:
        note = AT_BOUND
    return Estimate(entry.name, entry.value, low, high, entry.unit, note, entry.meaning)


# --------------------------------------------------------------------------- in words
def _in_words(
    table: Sequence[Estimate],
    entries: Sequence[_Entry],
    noise: float,
    task: Task,
) -> str:
    """Return what is determined, what is open, and the weakest direction."""
    told = [each.name for each in table if each.told]
    opened = [each.name for each in table if not each.told]
    if not opened:
        first = "All parameters are determined."
    elif told:
        first = f"Only {_and(told)} {_are(told)} determined; {_and(opened)} cannot be told."
    else:
        first = "No parameter is determined by this record."
    silent = {each.name for each in table if each.note == NO_INFLUENCE}
    taking = [i for i, each in enumerate(table) if each.name not in silent]
    if not taking:
        return first
    # The least determined combination of those that have an influence.
    slopes = np.stack([entries[i].slopes for i in taking], axis=1)
    _, strengths, vectors = np.linalg.svd(slopes, full_matrices=False)
    weakest = vectors[-1]
    largest = np.argsort(-np.abs(weakest))[:MOST_NAMED]
    chosen = [j for j in largest if abs(weakest[j]) > 0.25 * abs(weakest[largest[0]])]
    step = math.log(2.0) / abs(weakest[largest[0]])
    change = float(strengths[-1]) * step / math.sqrt(slopes.shape[0])
    sign = math.copysign(1.0, weakest[largest[0]])
    moves = [_move(entries[taking[j]], sign * step * weakest[j]) for j in chosen]
    unit = task.measured.unit
    return (
        f"{first} The weakest direction: {_and(moves)} "
        f"{'together change' if len(moves) > 1 else 'changes'} the {task.measured.column} by "
        f"{change:.2g} {unit}; the residual is {noise:.2g} {unit} (root mean square)."
    )


def _beyond(sure: Certainty) -> str:
    """Warn of residuals that follow each other longer than the noise that intervals assume."""
    if sure.beyond <= 1.0:
        return ""
    return (
        " The residuals follow each other longer than noise that decays evenly: the model lacks "
        f"something, and intervals may be {math.sqrt(sure.beyond):.1f} times too short."
    )


def _move(entry: _Entry, by: float) -> str:
    """Return a move along a coordinate in words."""
    if entry.kind == "linear":
        return f"{entry.name} by {by * entry.scale:+.2g} {entry.unit}".rstrip()
    name = f"{entry.name}'s excess" if entry.kind == "excess" else entry.name
    return f"{name} {'times' if by >= 0 else 'divided by'} {math.exp(abs(by)):.2g}"


def _and(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _are(names: Sequence[str]) -> str:
    return "is" if len(names) == 1 else "are"


# --------------------------------------------------------------------------- order of elements
def sorted_elements(
    subject: Mounted, unknowns: Sequence[Unknown], bounded: Collection[str]
) -> Mounted:
    """Return a bank with its elements in the order of their thresholds.

    Elements that may change places in a search are named from the first to slip to the last; all
    that belongs to an element moves with it.
    """
    if subject.named:
        return subject
    wide = {key: n for key, (_, n) in known_in(subject).items() if n > 1}
    own = [each for each in unknowns if each.element is not None]
    whole = [key for key, n in wide.items() if sum(each.key == key for each in own) == n]
    if len(own) != sum(wide[key] for key in whole) or {each.name for each in own} & {*bounded}:
        return subject
    lengths = [key for key in wide if known_in(subject)[key][0].unit in ("m", "rad")]
    by = [key for key in (WEIGHTS.name, *lengths) if key in whole]
    if not by:
        return subject
    order = np.argsort(np.asarray(value_in(subject, by[0])), kind="stable")
    if (np.diff(order) > 0).all():
        return subject
    return varied(subject, {key: _each(subject, key, n)[order] for key, n in wide.items()})


def _each(subject: Mounted, key: str, n: int) -> FloatArray:
    return np.broadcast_to(np.asarray(value_in(subject, key), dtype=float), n).copy()
