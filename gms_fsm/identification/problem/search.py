"""Searches for the global minimum of a cost with jumps and many local minima.

*hops*: a spread of starts, then perturb the best, refine, keep the better one. The cost jumps where
a break-away near a reversal appears, so that one local search often stays in the wrong place.
*local* refines the start only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.identification.problem.experiment import Experiment, Point
from gms_fsm.identification.problem.runs import ThreadPool

SEARCHES = ("hops", "local")
SPREAD = 16  # proposals about the start
FURTHER = 0.7  # their distance from it, in coordinates (0.7 is a factor of 2)
SEEDS = 4  # the best of them that are refined
HOPS = 12
HOP = (0.15, 0.4)  # distances of hops, in turn
AT_ONCE = 4  # hops from one place; a constant, so that results do not depend on the machine
COARSE_STEP = 1e-2
MOST_EVALUATIONS = 15  # of one refinement, without those of its slopes


@dataclass(eq=False)
class Best:
    """The best point so far; kept when the search is interrupted."""

    told: Callable[[float], object] = float  # which does nothing else
    point: Point | None = None

    def take(self, points: Iterable[Point]) -> None:
        """Keep the best; at equal cost the first."""
        for point in points:
            if point.lost is None and (self.point is None or point.cost < self.point.cost):
                self.point = point


def refine(
    experiment: Experiment,
    u: FloatArray,
    step: float,
    most: int = MOST_EVALUATIONS,
    pool: ThreadPool | None = None,
    kept: Best | None = None,
) -> Point:
    """Refine a proposal by Levenberg-Marquardt steps within the bounds."""
    if not len(u):
        return experiment.at(u)
    low, high = experiment.coordinates.limits
    best = Best()
    known: dict[bytes, Point] = {}

    def at(place: FloatArray) -> Point:
        key = place.tobytes()
        if key not in known:
            known.clear()
            known[key] = experiment.at(place.copy())
            best.take([known[key]])
            if kept is not None:
                kept.take([known[key]])
        return known[key]

    def slopes(place: FloatArray) -> FloatArray:
        here = at(place)
        signs = np.where(place + step <= high, 1.0, -1.0)
        places = [
            place + step * sign * unit for sign, unit in zip(signs, np.eye(place.size), strict=True)
        ]
        there = experiment.many(places, pool)
        found = np.empty((here.residual.size, place.size))
        for i, (point, sign) in enumerate(zip(there, signs, strict=True)):
            gone = point.lost is not None
            found[:, i] = 0.0 if gone else (point.residual - here.residual) / (step * sign)
        return found

    inside = np.clip(u, low + 1e-9 * (high - low), high - 1e-9 * (high - low))

    def residual(place: FloatArray) -> FloatArray:
        return at(place).residual

    with np.errstate(all="ignore"):  # SciPy divides by slopes and steps that may be zero
        least_squares(
            residual,
            inside,
            jac=slopes,
            bounds=(low, high),
            max_nfev=most,
            xtol=1e-6,
            ftol=1e-7,
            gtol=None,
        )
    return best.point if best.point is not None else at(inside)


def hops(
    experiment: Experiment,
    seed: int,
    best: Best,
    pool: ThreadPool,
    many: int = HOPS,
    spread: int = SPREAD,
) -> None:
    """Search from a spread of starts, then by hops from the best."""
    rng = np.random.default_rng(seed)
    low, high = experiment.coordinates.limits
    start = experiment.coordinates.start
    parts = 1 + 1 + -(-many // AT_ONCE)
    best.take([experiment.at(start)])
    if not start.size:
        best.told(1.0)
        return
    if spread:
        drawn = start + FURTHER * rng.standard_normal((spread, start.size))
        about = experiment.many(list(np.clip(drawn, low, high)), pool)
        best.take(about)
        found = sorted((each for each in about if each.lost is None), key=lambda each: each.cost)
        best.told(1 / parts)
        seeds = [start, *(each.u for each in found[: SEEDS - 1])]
        best.take(pool.map(lambda u: refine(experiment, u, COARSE_STEP), seeds))
        best.told(2 / parts)
    for done in range(0, many, AT_ONCE):
        if best.point is None:
            return
        here, size = best.point.u, min(AT_ONCE, many - done)
        wide = np.resize(HOP, size)[:, None]
        moved = here + wide * rng.standard_normal((size, here.size))
        best.take(
            pool.map(
                lambda u: refine(experiment, u, COARSE_STEP),
                [np.clip(each, low, high) for each in moved],
            )
        )
        best.told((2 + done // AT_ONCE + 1) / parts)
