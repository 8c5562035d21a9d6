"""How far each parameter can go while the fit is as good: the edge of the likelihood region.

The cost of a friction model has corners and valleys that bend, in which a linearised interval is
much too short. So the region in which twice the log-likelihood on effective rows falls by less than
3.84 is walked to its ends, one parameter after the other: the ends are those of all profiles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.identification.certainty.profile import LIMIT, Profile
from gms_fsm.identification.problem.experiment import Experiment, Point
from gms_fsm.identification.problem.runs import ThreadPool

POINTS = 10  # of a profile on each side
BETTER = 1.0  # fall of the rise below that of the best point
HIGHEST = 4.0 * LIMIT  # rises shown in a profile
ROUNDS = 14  # of one step outward for each end of each parameter
GROWTH, SHRINK = 1.6, 0.5  # of a step that stayed in the region, or left it
ASIDE = 0.35  # of the step: a random part, by which the walk follows bends
# A search can end on an edge, beyond which a parameter has no influence, and its slope on the near
# side then says that it is sure. So each coordinate is moved alone, too, this far either way.
ALONE = (0.05, 0.2, 0.5, 1.5, 5.0)


def values_of(experiment: Experiment, point: Point) -> dict[str, float]:
    """Return all values of a point by name, nuisance terms included."""
    numbers = experiment.coordinates.numbers(point.u)
    found = {e.name: float(x) for e, x in zip(experiment.searched, numbers, strict=True)}
    solved = [*(each.name for each in experiment.solved), *experiment.nuisance]
    return found | {name: float(x) for name, x in zip(solved, point.linear, strict=True)}


@dataclass(eq=False)
class _Walk:
    """The walk towards one end of one parameter."""

    name: str
    side: float
    direction: FloatArray  # of the searched coordinates
    place: FloatArray
    value: float
    step: float = 1.0


@dataclass(frozen=True, eq=False)
class Region:
    """What was met on a walk through the likelihood region."""

    best: dict[str, float]  # the values of the best point, by name
    met: dict[str, FloatArray]  # (points,) those of all points met, the best one first
    rise: FloatArray  # (points,) fall of twice the log-likelihood at each
    lowest: Point  # the point with the lowest cost
    # Of the highest rise inside the region: correlated noise moves what acts fast less than what
    # acts slowly, on which all effective rows count.
    shares: dict[str, float]

    @property
    def better(self) -> Point | None:
        """A point that fits clearly better than the best one, if the walk met one."""
        return self.lowest if float(self.rise.min()) < -BETTER else None

    def reach(self, name: str) -> tuple[float, float]:
        """Return how far a parameter goes below and above its best value inside the region."""
        inside = self.met[name][self.rise < LIMIT * self.shares[name]]
        best = self.best[name]
        return min(float(inside.min()) - best, 0.0), max(float(inside.max()) - best, 0.0)

    def profile(self, name: str, unit: str) -> Profile:
        """Return the least rises met, by values of a parameter; a profile is at most as high.

        Left out are points above others that are further away: looser bounds than these.
        """
        shown = self.rise < HIGHEST
        values, rise = self.met[name][shown], self.rise[shown]
        best = int(np.argmin(rise))
        kept = [best]
        for side in (-1.0, 1.0):
            away = side * (values - values[best])
            outward = np.lexsort((rise, -away))  # the farthest first, at one place the lowest
            outward = outward[away[outward] > 0.0]
            falls = rise[outward] < np.minimum.accumulate(np.append(np.inf, rise[outward]))[:-1]
            inward = outward[falls]
            chosen = np.linspace(0, inward.size - 1, min(POINTS, inward.size)).round().astype(int)
            kept += inward[chosen].tolist()
        order = np.array(kept)[np.argsort(values[kept])]
        low, high = self.reach(name)
        value = self.best[name]
        return Profile(name, unit, values[order], rise[order], value + low, value + high)


def walked(
    experiment: Experiment,
    point: Point,
    directions: dict[str, FloatArray],
    shape: FloatArray,
    effective: float,
    shares: dict[str, float],
    pool: ThreadPool,
    seed: int,
) -> Region:
    """Walk through the likelihood region, towards both ends of each parameter."""
    rows = min(effective, float(experiment.target.size))
    best = values_of(experiment, point)
    low, high = experiment.coordinates.limits
    rng = np.random.default_rng(seed)
    walks = [
        _Walk(name, side, side * direction, point.u, best[name])
        for name, direction in directions.items()
        for side in (-1.0, 1.0)
        if np.isfinite(direction).all()
    ]
    met, rises, lowest = [best], [0.0], [point]

    def take(points: Sequence[Point], new: Sequence[float]) -> None:
        lowest.append(min([lowest[-1], *points], key=lambda each: each.cost))
        for each, rise in zip(points, new, strict=True):
            if not math.isfinite(rise):
                continue
            values = values_of(experiment, each)
            met.append(values)
            rises.append(rise)
            for walk in walks:  # a point found for one end may be further out for another
                if (
                    rise < LIMIT * shares[walk.name]
                    and walk.side * (values[walk.name] - walk.value) > 0.0
                ):
                    walk.place, walk.value = each.u, values[walk.name]

    alone = [
        np.clip(point.u + side * far * unit, low, high)
        for unit in np.eye(low.size)
        for far in ALONE
        for side in (-1.0, 1.0)
    ]
    points = experiment.many(alone, pool)
    take(points, [_rise(each, point.cost, rows) for each in points])
    for _ in range(ROUNDS):
        moves = [
            walk.step * (walk.direction + ASIDE * shape @ rng.standard_normal(shape.shape[1]))
            for walk in walks
        ]
        places = [
            np.clip(walk.place + move, low, high) for walk, move in zip(walks, moves, strict=True)
        ]
        points = experiment.many(places, pool)
        new = [_rise(each, point.cost, rows) for each in points]
        for walk, rise in zip(walks, new, strict=True):
            inside = rise < LIMIT * shares[walk.name]
            walk.step = min(walk.step * (GROWTH if inside else SHRINK), 8.0)
        take(points, new)
    columns = {name: np.array([values[name] for values in met]) for name in best}
    return Region(best, columns, np.array(rises), lowest[-1], shares)


def _rise(point: Point, lowest: float, rows: float) -> float:
    """Return the fall of twice the log-likelihood from the best point; inf if it was lost."""
    if point.lost is not None or lowest <= 0.0:
        return math.inf
    return rows * math.log(max(point.cost, 1e-300) / lowest)
