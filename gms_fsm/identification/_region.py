"""How far each parameter can go while the fit is as good: the edge of the likelihood region.

The cost of a friction model has corners and valleys that bend, in which a linearised interval is
much too short. So the region in which twice the log-likelihood on effective rows falls by less than
3.84 is walked to its ends, one parameter after the other: the ends are those of all profiles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.identification._experiment import Experiment, Point
from gms_fsm.identification._runs import Pool

__all__ = ["LIMIT", "ends_of_region", "values_of"]

LIMIT = 3.841  # 95 % quantile of chi-squared with one degree of freedom
ROUNDS = 14  # of one step outward for each end of each parameter
GROWTH, SHRINK = 1.6, 0.5  # of a step that stayed in the region, or left it
ASIDE = 0.35  # of the step: a random part, by which the walk follows bends


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


def ends_of_region(
    experiment: Experiment,
    point: Point,
    directions: dict[str, FloatArray],
    shape: FloatArray,
    effective: float,
    pool: Pool,
    seed: int,
) -> dict[str, tuple[float, float]]:
    """Return the lowest and the highest value of each parameter in the likelihood region.

    Parameters
    ----------
    experiment : Experiment
        With few rows, because many points are evaluated.
    point : Point
        The best point.
    directions : dict of str to ndarray
        For each parameter the step of the searched coordinates that changes it by one standard
        deviation, all else following as the linearised model says.
    shape : ndarray, shape (searched, m)
        A square root of the covariance of the searched coordinates.
    effective : float
        Effective rows of the whole fit.
    pool : Pool
        To evaluate points side by side.
    seed : int
        Of the random parts.

    Returns
    -------
    dict of str to (float, float)
        By name; both the best value where nothing better was found.
    """
    rows = min(effective, float(experiment.target.size))
    best = values_of(experiment, point)
    if not len(experiment.searched):
        return {name: (value, value) for name, value in best.items()}
    low, high = experiment.coordinates.limits
    rng = np.random.default_rng(seed)
    walks = [
        _Walk(name, side, side * direction, point.u, best[name])
        for name, direction in directions.items()
        for side in (-1.0, 1.0)
        if np.isfinite(direction).all()
    ]
    lowest = point.cost
    for _ in range(ROUNDS):
        moves = [
            walk.step * (walk.direction + ASIDE * shape @ rng.standard_normal(shape.shape[1]))
            for walk in walks
        ]
        places = [
            np.clip(walk.place + move, low, high) for walk, move in zip(walks, moves, strict=True)
        ]
        points = pool.map(experiment.at, places)
        inside = [_inside(each, lowest, rows) for each in points]
        for walk, fine in zip(walks, inside, strict=True):
            walk.step = min(walk.step * (GROWTH if fine else SHRINK), 8.0)
        for each in (each for each, fine in zip(points, inside, strict=True) if fine):
            values = values_of(experiment, each)
            for walk in walks:  # a point found for one end may be further out for another
                if walk.side * (values[walk.name] - walk.value) > 0.0:
                    walk.place, walk.value = each.u, values[walk.name]
    ends = {name: [value, value] for name, value in best.items()}
    for walk in walks:
        ends[walk.name][0 if walk.side < 0.0 else 1] = walk.value
    return {name: (pair[0], pair[1]) for name, pair in ends.items()}


def _inside(point: Point, lowest: float, rows: float) -> bool:
    """Return whether a point fits as well as the best within the noise."""
    if point.lost is not None or lowest <= 0.0:
        return False
    return rows * math.log(max(point.cost, 1e-300) / lowest) < LIMIT
