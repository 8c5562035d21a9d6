"""Profiles and bootstraps: intervals that do not rely on a linearised model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.foundation.arguments import checked_integer, unknown
from gms_fsm.identification.certainty.assess import Estimate
from gms_fsm.identification.certainty.profile import LIMIT, Profile
from gms_fsm.identification.certainty.region import values_of
from gms_fsm.identification.problem.experiment import Experiment, Point
from gms_fsm.identification.problem.runs import ThreadPool
from gms_fsm.identification.problem.search import Best, hops, refine
from gms_fsm.identification.problem.task import Task, at_course
from gms_fsm.identification.problem.unknowns import Unknown

__all__ = ["Bootstrap", "Profile", "bootstrapped", "profiled"]

FACTOR = 0.1  # first step of a profile, relative, where the interval is open
SHARE = 0.4  # first step as a share of the interval's half width
MOST_STEPS = 12  # to each side, each twice as long as the one before
RESTARTS = 4  # hops at each value
BLOCK = 10.0  # correlation times in a block of residuals that is drawn


@dataclass(frozen=True, eq=False)
class Bootstrap:
    """The parameters of fits to resampled residuals.

    Parameters
    ----------
    names : tuple of str
        As in the table of the fit.
    draws : ndarray, shape (draws, p)
        The values; a draw whose search failed has NaN.
    """

    names: tuple[str, ...]
    draws: FloatArray

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Return the interval between two quantiles.

        Parameters
        ----------
        name : str
            Of a parameter.
        level : float
            Share of the draws inside, between 0 and 1.

        Returns
        -------
        tuple of float
            Its ends.

        Raises
        ------
        ParameterError
            If there is no such parameter, or the level is not between 0 and 1.
        """
        if name not in self.names:
            raise unknown("parameter", name, self.names)
        checked_scalar("level", level, "> 0 and < 1")
        column = self.draws[:, self.names.index(name)]
        low, high = np.nanquantile(column, [(1.0 - level) / 2.0, (1.0 + level) / 2.0])
        return float(low), float(high)


def _searched_again(
    experiment: Experiment, start: FloatArray, pool: ThreadPool, *, restarts: bool, seed: int
) -> Point | None:
    """Refine from a start and hop from there; None if everything is lost."""
    best = Best()
    best.take([refine(experiment, start, 1e-3, pool=pool)])
    if restarts:
        hops(experiment, seed, best, pool, many=RESTARTS, spread=0)
    return best.point


def profiled(
    task: Task, point: Point, estimate: Estimate, effective: float, *, restarts: bool, seed: int
) -> Profile:
    """Return the profile of a parameter; see `gms_fsm.Fit.profile`."""
    checked_integer("seed", seed, 0)
    unknown = next(each for each in task.unknowns if each.name == estimate.name)
    centre = values_of(task.fine, point)[unknown.name]
    rows = task.coarse.target.size
    with ThreadPool() as pool:
        start = task.coarse.coordinates.start
        best = _searched_again(task.coarse, start, pool, restarts=restarts, seed=seed)
        if best is None:
            raise ParameterError("the fitted model cannot be run on few rows", place=unknown.name)
        effective_rows = min(effective, float(rows))  # few rows know no more than that
        found = {centre: best.cost}
        first = _first_step(unknown.positive, estimate)
        for side in (-1.0, 1.0):
            for k in range(MOST_STEPS):
                value = _moved(unknown, centre, side * first * 2.0**k)
                if value is None or value in found:
                    break
                try:
                    cost = _cost_at(task, unknown.name, value, pool, restarts=restarts, seed=seed)
                except GMSError:
                    break
                if cost is None:
                    break
                found[value] = cost
                if _rise(cost, min(found.values()), effective_rows) > LIMIT:
                    break
    values = np.array(sorted(found))
    lowest = min(found.values())
    rises = np.array([_rise(found[x], lowest, effective_rows) for x in values.tolist()])
    ends = [_end(unknown, values, rises, side) for side in (-1, 1)]
    return Profile(unknown.name, unknown.parameter.unit, values, rises, *ends)


def _rise(cost: float, lowest: float, rows: float) -> float:
    return rows * math.log(max(cost, 1e-300) / max(lowest, 1e-300))


def _end(unknown: Unknown, values: FloatArray, rises: FloatArray, side: int) -> float:
    """Return where the rise reaches its limit on one side; the bound if that is reached before."""
    best = int(np.argmin(rises))
    way = slice(best, None) if side > 0 else slice(best, None, -1)
    own, up = values[way], np.maximum(rises[way], 0.0)
    above = np.flatnonzero(up > LIMIT)
    if not above.size:
        bound = unknown.high if side > 0 else max(unknown.low, unknown.least)
        return bound if own[-1] == bound else side * math.inf
    after = int(above[0])
    # The rise is nearly a parabola: its root is nearly straight.
    roots = np.sqrt(up[after - 1 : after + 1])
    share = (math.sqrt(LIMIT) - float(roots[0])) / float(np.ptp(roots))
    return float(own[after - 1] + share * (own[after] - own[after - 1]))


def _first_step(positive: bool, estimate: Estimate) -> float:
    """Return the first step of a profile: a part of the interval, which it makes better."""
    low, high, value = estimate.low, estimate.high, estimate.value
    if not (math.isfinite(low) and math.isfinite(high)) or high <= low:
        return FACTOR
    if positive and low > 0.0:
        return min(SHARE * 0.5 * math.log(high / low), 10.0 * FACTOR)
    return SHARE * 0.5 * (high - low) / (abs(value) or 1.0)


def _moved(unknown: Unknown, centre: float, by: float) -> float | None:
    """Return a value beside another one, within the bounds; None where none is left."""
    if unknown.positive and centre > 0.0:
        value = centre * math.exp(by) if abs(by) < 50.0 else None
    else:
        value = centre + by * (abs(centre) or 1.0)
    if value is None or (value < unknown.least and unknown.positive):
        return None
    return min(max(value, unknown.low, unknown.least), unknown.high)


def _cost_at(
    task: Task, name: str, value: float, pool: ThreadPool, *, restarts: bool, seed: int
) -> float | None:
    """Return the least cost with one parameter at a value."""
    held = task.without(name, value)
    start = held.coarse.coordinates.start
    point = _searched_again(held.coarse, start, pool, restarts=restarts, seed=seed)
    return None if point is None else point.cost


def bootstrapped(
    task: Task,
    point: Point,
    names: Sequence[str],
    block: float | None,
    tau: float,
    *,
    draws: int,
    restarts: bool,
    seed: int,
) -> Bootstrap:
    """Return the fits to resampled residuals; see `gms_fsm.Fit.bootstrap`."""
    if block is not None:
        block = checked_scalar("block", block, "> 0")
    rng = np.random.default_rng(seed)
    modelled = [at_course(task.fine, point, course) for course in task.courses]
    found = np.full((draws, len(names)), np.nan)
    with ThreadPool() as pool:
        for draw in range(draws):
            replaced = []
            for course, model in zip(task.courses, modelled, strict=True):
                step = float(np.median(np.diff(course.t)))
                length = max(1, round(BLOCK * tau if block is None else block / step))
                left = (course.measured - model)[course.rows]
                drawn = model.copy()
                drawn[course.rows] += _resampled(left, min(length, left.size), rng)
                replaced.append(drawn)
            courses = tuple(
                replace(course, measured=values)
                for course, values in zip(task.courses, replaced, strict=True)
            )
            again = task.measured_as(courses)
            start = again.coordinates.start
            best = _searched_again(again, start, pool, restarts=restarts, seed=seed + draw)
            if best is not None:
                values = values_of(again, best)
                found[draw] = [values[name] for name in names]
    return Bootstrap(tuple(names), found)


def _resampled(residual: FloatArray, length: int, rng: np.random.Generator) -> FloatArray:
    """Return residuals put together from blocks that begin anywhere, around the end as well."""
    count = -(-residual.size // length)
    starts = rng.integers(0, residual.size, count)
    places = (starts[:, None] + np.arange(length)).ravel()[: residual.size] % residual.size
    drawn: FloatArray = residual[places] - residual.mean()
    return drawn
