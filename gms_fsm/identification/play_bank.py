"""A bank of slipping springs with play, both flanks apart: a candidate without a search.

Thresholds and gaps stand on a grid, so that all of the force is linear in the stiffnesses: those at
rest and those at speed, forward and backward, follow by non-negative least squares in seconds. What
hardly helps is then taken away, term by term.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import FloatArray, Parameter
from gms_fsm.charts.zoo.bristles.maxwell_slip import MAXWELL_SLIP
from gms_fsm.errors import RecordError
from gms_fsm.identification.bank import stop_operators
from gms_fsm.records.motion import Motion, usual_speed
from gms_fsm.records.record import Record

__all__ = ["SPRING_WITH_PLAY", "PlayBank", "play_bank"]

ROWS, FEWEST_ROWS = 5_000, 300  # of all records together, and of each
# Shares of half the travel: thresholds, of which the largest never slips, and half gaps.
THRESHOLDS = np.array([0.2, 0.5, 1, 2, 4, 6, 8, 10, 12, 15, 20, 30, 60]) / 60
GAPS = np.array([0, 0.2, 0.5, 1, 2, 3, 4, 5, 6, 8, 10]) / 60
SPEEDS = (1.0, 2.0, 4.0)  # v_s as multiples of the median speed in motion
RISE = 0.02  # of the sum of squares, for which terms may be taken away altogether: 1 % of the error
TERMS = ("k_f", "k_b", "d_f", "d_b")
# Shares of half the travel. A spring that hardly ever slips, and friction without a gap in the
# midst of gaps, predict most where least was measured: they are used only if the rest does not do.
FURTHEST, SHORTEST = 0.99, 0.1

SPRING_WITH_PLAY = Chart(
    name="Slipping spring with play, each flank of its own",
    variables=MAXWELL_SLIP.variables,
    parameters=(
        Parameter("k_f", "N/m", ">= 0", meaning="stiffness forward"),
        Parameter("k_b", "N/m", ">= 0", meaning="stiffness backward"),
        Parameter("d_f", "N/m", ">= 0", meaning="what is added forward at low speed"),
        Parameter("d_b", "N/m", ">= 0", meaning="what is added backward at low speed"),
        Parameter("g", "m", ">= 0", meaning="half of the gap"),
        Parameter("z_c", "m", "> 0", meaning="threshold, the half gap included"),
        Parameter("v_s", "m/s", "> 0", per_element=False, meaning="speed that counts as low"),
    ),
    let={"dip": "exp(-(v / v_s)**2)"},
    states=MAXWELL_SLIP.states,
    transitions=MAXWELL_SLIP.transitions,
    outputs={"F": "(k_f + d_f * dip) * max(0, z - g) + (k_b + d_b * dip) * min(0, z + g)"},
    reference="chosen by us",
)


@dataclass(frozen=True, eq=False)
class PlayBank:
    """What least squares on the grid found.

    Parameters
    ----------
    z_c, g : ndarray, shape (n,)
        Thresholds and half gaps, m.
    stiffness : ndarray, shape (n, 4)
        In the order of `TERMS`, N/m; 0 where a term is not used.
    v_s : float
        m/s.
    sigma_2 : float
        Viscous friction, Ns/m.
    """

    z_c: FloatArray
    g: FloatArray
    stiffness: FloatArray
    v_s: float
    sigma_2: float

    @property
    def values(self) -> dict[str, float | FloatArray]:
        """The parameters of the chart."""
        own = {name: self.stiffness[:, i] for i, name in enumerate(TERMS)}
        return {**own, "g": self.g, "z_c": self.z_c, "v_s": self.v_s}

    @property
    def used(self) -> tuple[str, ...]:
        """The names of the terms that are not 0."""
        several = len(self.z_c) > 1
        found = [
            f"{name}{i + 1}" if several else name
            for i, row in enumerate(self.stiffness)
            for name, value in zip(TERMS, row, strict=True)
            if value > 0.0
        ]
        return (*found, "sigma_2") if self.sigma_2 > 0.0 else tuple(found)


def play_bank(records: Sequence[Record], smoothing: float | None) -> PlayBank:
    """Return the bank that fits the force best, with as few terms as do nearly as well."""
    parts = [(record, record.motion(smoothing)) for record in records]
    most = max(ROWS // len(records), FEWEST_ROWS)
    travel = max(float(np.ptp(motion.position)) for _, motion in parts)
    v = np.concatenate([m.velocity[:: max(1, len(m.time) // most)] for _, m in parts])
    if travel == 0.0 or np.quantile(np.abs(v), 0.99) == 0.0:
        raise RecordError("the motion does not change", place=records[0].place, advice="move it")
    middle = usual_speed(v)
    pairs = np.array([(s, g) for s in THRESHOLDS for g in GAPS if g < s]) * 0.5 * travel
    solved = list[tuple[float, float, FloatArray]]()
    for v_s in (share * middle for share in SPEEDS):
        gram = np.sum([_gram(*part, most, pairs, v_s) for part in parts], axis=0)
        solved.append((_solved(gram, np.arange(gram.shape[0] - 1))[1], v_s, gram))
    squares, v_s, gram = min(solved, key=lambda each: each[0])
    limit = squares * (1.0 + RISE)
    z_c, g = pairs.T
    near = (z_c < FURTHEST * z_c.max()) & ((g > 0.0) | (z_c > SHORTEST * z_c.max()))
    kept = np.flatnonzero(np.append(np.tile(near, len(TERMS)), np.ones(3, dtype=bool)))
    if _solved(gram, kept)[1] > limit:
        kept = np.arange(gram.shape[0] - 1)
    kept = _fewest(gram, kept, limit)
    shares, _ = _solved(gram, kept)
    stiffness = shares[: 4 * len(pairs)].reshape(4, -1).T
    own = stiffness.any(axis=1)
    if not own.any():
        raise RecordError(
            "the force does not oppose the motion",
            place=records[0].place,
            advice="if its sign is reversed, give force=(name, unit, -1) or -force",
        )
    return PlayBank(pairs[own, 0], pairs[own, 1], stiffness[own], v_s, float(shares[-3]))


def _gram(record: Record, motion: Motion, most: int, pairs: FloatArray, v_s: float) -> FloatArray:
    """Return the inner products of all terms and the force over about so many rows of a record.

    The motion is passed twice: what was before is not known, and forgotten the second time.
    """
    every = slice(None, None, max(1, len(record) // most))
    rows, x, v = record.chosen[every], motion.position[every], motion.velocity[every]
    force = np.where(rows, record.columns["force"][every], 0.0)
    thresholds, which = np.unique(pairs[:, 0], return_inverse=True)
    z = stop_operators(np.concatenate([x, x]), thresholds)[-x.size :, which]
    forward, backward = np.maximum(0.0, z - pairs[:, 1]), np.minimum(0.0, z + pairs[:, 1])
    dip, one = np.exp(-((v / v_s) ** 2))[:, None], np.ones((x.size, 1))
    others = [v[:, None], one, -one, force[:, None]]
    columns = np.hstack([forward, backward, forward * dip, backward * dip, *others])[rows]
    found: FloatArray = record.chosen.sum() / max(int(rows.sum()), 1) * (columns.T @ columns)
    return found


def _solved(gram: FloatArray, kept: NDArray[np.intp]) -> tuple[FloatArray, float]:
    """Return the non-negative least squares of some terms, and their sum of squares."""
    places = np.append(kept, gram.shape[0] - 1)
    part = gram[np.ix_(places, places)]
    scale = np.sqrt(np.diag(part)) + 1e-300
    strength, vectors = np.linalg.eigh(part / scale / scale[:, None])
    root = (vectors * np.sqrt(np.maximum(strength, 0.0))).T
    shares, left = nnls(root[:, :-1], root[:, -1], maxiter=100 * len(places))
    found = np.zeros(gram.shape[0] - 1)
    found[kept] = shares * scale[-1] / scale[:-1]
    return found, float((left * scale[-1]) ** 2)


def _fewest(gram: FloatArray, kept: NDArray[np.intp], most: float) -> NDArray[np.intp]:
    """Return the terms that are left when all that hardly help are taken away, one by one."""
    offset = gram.shape[0] - 3  # both signs of it stay
    while True:
        shares, _ = _solved(gram, kept)
        own = kept[shares[kept] > 0.0]
        scale = np.sqrt(np.diag(gram)[own])
        inverse = np.linalg.pinv(gram[np.ix_(own, own)] / scale / scale[:, None])
        # What the sum of squares rises by without a term, if all others may have any sign.
        rises = (shares[own] * scale) ** 2 / np.maximum(np.diag(inverse), 1e-300)
        terms = np.flatnonzero(own < offset)
        if terms.size < 2:
            return own
        fewer = np.delete(own, terms[np.argmin(rises[terms])])
        if _solved(gram, fewer)[1] > most:
            return own
        kept = fewer
