"""A bank of GMS elements to start a fit from: non-negative least squares on stop operators.

The plastic limit of a GMS bank (F_s = F_c, C without bound) is a sum of stop operators, the
Maxwell-slip model. For given thresholds its force is linear in the stiffnesses, so that thresholds
on a grid and non-negative least squares give a bank without any search or start value.

References
----------
F. Al-Bender, V. Lampaert, J. Swevers, "The Generalized Maxwell-Slip Model: A Novel Model for
Friction Simulation and Compensation", IEEE Trans. Automatic Control 50(11), 1883-1887 (2005),
doi:10.1109/TAC.2005.858676: the shares alpha_i.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ParameterError, RecordError
from gms_fsm.foundation.arguments import checked_integer, refusing
from gms_fsm.identification.problem.arguments import checked_records, column_of, window_of
from gms_fsm.records.motion import Motion, usual_speed
from gms_fsm.records.record import Record
from gms_fsm.systems.gms_parameters import GMSParameters
from gms_fsm.systems.models import GMS

__all__ = ["initial_bank", "stop_operators", "thresholds"]

MOST_ELEMENTS = 60
GRID = 60  # thresholds
FINEST = 1 / 300  # smallest threshold, as a share of the largest
FEWEST_ROWS = 20
USED_ROWS, LEAST_ROWS = 4000, 1000  # of all records together, and of each of many
COVERED = 0.9  # share of the travel after which the unknown initial state is forgotten
PASSES, HALVINGS = 8, 4  # of the refinement of the thresholds, and of one of its steps
APART = 0.05  # thresholds of the two halves of an element differ by this share from its own
SLIGHT = 1e-9  # an element with a smaller share of the plateau force is left out

STICTION = 1.05  # F_s / F_c
DIP = 0.5  # v_s as a share of the median speed, where the curve is then flat again
ARREST = 1e-3  # v_c as a share of the median speed, of records without standstill
FASTEST_ARREST = 0.1  # ... and at most: an element that moves slower cannot break away


@refusing()
def initial_bank(
    records: Record | Sequence[Record],
    n: int,
    *,
    train: tuple[float, float] | None = None,
    smoothing: float | None = None,
) -> GMS:
    """Return a bank of GMS elements, signed law, to start a fit from.

    Stiffnesses and thresholds r_i come from the records: non-negative least squares on stop
    operators with 60 thresholds and a force offset, neighbours merged to n elements (total
    stiffness and plateau force are kept), and a short local search for the n thresholds. Where
    fewer elements are found, those with the largest force are split.

    The rest is chosen, not measured, and only a start for a fit: F_c is the plateau force
    ``sum(k_i r_i)``; F_s = 1.05 F_c; v_s is half the median speed in motion, so that the curve is
    flat again at that speed; ``C_i = alpha_i C / k_i`` with C = sum(k_i) times the median speed, so
    that the bank follows the curve within about the time it takes to move over a threshold; v_c is
    what the quietest standstill of the records can resolve, at most a tenth of the median speed, or
    without a standstill a thousandth of it; damping and viscous friction are zero.

    Parameters
    ----------
    records : Record or sequence of Record
        With a force; all of one device, with one offset.
    n : int
        Number of elements, 1 to 60.
    train : tuple of float, optional
        Rows with ``train[0] <= time < train[1]`` are used, s; by default all. The motion before
        them is followed; no other force is read.
    smoothing : float, optional
        As in `gms_fsm.records.motion.motion_of`, s.

    Returns
    -------
    GMS
        With exactly n elements, thresholds increasing: ``weights[i] * F_c = r_i``.

    Raises
    ------
    ParameterError
        If n or train is not as described.
    RecordError
        If there is no force, motion or force do not change, fewer than 20 training rows are left
        after the motion has first covered 90 % of its travel, or the force does not oppose the
        motion.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.01)
    >>> x = 1e-3 * np.sin(t)
    >>> force = stop_operators(x, [1e-4, 3e-4]) @ [2e4, 1e4]
    >>> record = Record.from_arrays(time=t, position=x, force=force)
    >>> model = initial_bank(record, 2, smoothing=0.0)
    >>> model.parameters.k.round(3).tolist()
    [20000.0, 10000.0]
    >>> (model.stribeck.F_c * model.weights).round(9).tolist()
    [0.0001, 0.0003]
    """
    count = checked_integer("n", n, 1)
    if count > MOST_ELEMENTS:
        raise ParameterError(
            f"it must be at most {MOST_ELEMENTS}",
            place="n",
            value=n,
            advice="a record hardly tells more than 8 elements apart",
        )
    rows = window_of("train", train) or (-np.inf, np.inf)
    data = _training(checked_records(records), rows, smoothing)
    grid = data.fitted(thresholds(data.travel))
    bank = _split(_refined(data, _merged(grid, count)), count)
    return _model(bank, data)


def stop_operators(x: ArrayLike, r: ArrayLike) -> FloatArray:
    """Return the deflections of stop operators: springs that slip at their threshold.

    ``z_i <- min(r_i, max(-r_i, z_i + dx))``, z = 0 at the first row.

    Parameters
    ----------
    x : array_like, shape (rows,)
        Position, m.
    r : array_like, shape (n,)
        Thresholds, m.

    Returns
    -------
    ndarray, shape (rows, n)
        Deflections, m.

    Examples
    --------
    >>> stop_operators([0.0, 3.0, 2.0, -2.0], [1.0, 2.0])
    array([[ 0.,  0.],
           [ 1.,  2.],
           [ 0.,  1.],
           [-1., -2.]])
    """
    position, upper = np.asarray(x, dtype=np.float64), np.asarray(r, dtype=np.float64)
    lower, found = -upper, np.zeros((position.size, upper.size))
    for before, after, step in zip(found, found[1:], np.diff(position).tolist(), strict=False):
        np.add(before, step, out=after)
        np.maximum(lower, after, out=after)
        np.minimum(upper, after, out=after)
    return found


def thresholds(travel: float) -> FloatArray:
    """Return the grid of thresholds for a travel: half of them even, half of them geometric.

    The largest is half the travel: such an element never slips, and is the spring that a record
    which only pre-slides needs.

    Parameters
    ----------
    travel : float
        From the lowest position to the highest, m.

    Returns
    -------
    ndarray, shape (60,)
        Increasing, m.

    Examples
    --------
    >>> grid = thresholds(2.0)
    >>> len(grid), float(grid[-1])
    (60, 1.0)
    """
    half = GRID // 2
    fine = np.geomspace(FINEST, 1.0, half, endpoint=False)
    even = np.arange(1, half + 1) / half
    grid: FloatArray = 0.5 * travel * np.union1d(fine, even)
    return grid


# --------------------------------------------------------------------------- the rows
@dataclass(frozen=True, eq=False)
class _Part:
    """The motion of one record up to its last training row, and the rows that are used."""

    position: FloatArray  # m
    used: NDArray[np.bool_]

    def operators(self, r: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return z, and its derivative with respect to the thresholds, at the rows used."""
        z = stop_operators(self.position, r)
        # The derivative is the side of the last slip: while it sticks, z moves with x alone.
        slipping = np.where(np.abs(z) >= r, np.arange(len(z))[:, None], 0)
        last = np.maximum.accumulate(slipping, axis=0)
        return z[self.used], np.sign(np.take_along_axis(z, last, axis=0))[self.used]


@dataclass(frozen=True, eq=False)
class _Training:
    """What the least squares see of all records."""

    parts: tuple[_Part, ...]
    force: FloatArray  # N, shape (rows,)
    travel: float  # m
    speed: float  # median speed in motion, m/s
    v_c: float  # start value, m/s
    place: str

    def operators(self, r: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return z and its derivative, each of shape (rows, n), of all records."""
        z, slope = zip(*(part.operators(r) for part in self.parts), strict=True)
        return np.concatenate(z), np.concatenate(slope)

    def fitted(self, r: FloatArray) -> _Bank:
        """Return the bank with these thresholds that fits best."""
        z, slope = self.operators(r)
        scale = float(np.abs(self.force).max())
        ones = np.ones((self.force.size, 1))
        shares, _ = nnls(
            np.hstack([z / r, ones, -ones]), self.force / scale, maxiter=100 * (r.size + 2)
        )
        k, offset = scale * shares[: r.size] / r, scale * float(shares[-2] - shares[-1])
        kept = shares[: r.size] > SLIGHT * shares[: r.size].sum()
        if not kept.any():
            raise RecordError(
                "the force does not oppose the motion",
                place=self.place,
                advice="if its sign is reversed, give force=(name, unit, -1) or -force",
            )
        residual = self.force - z[:, kept] @ k[kept] - offset
        return _Bank(r[kept], k[kept], z[:, kept], slope[:, kept], residual)


class _Bank(NamedTuple):
    """Stop operators in parallel, and their fit."""

    r: FloatArray  # m, shape (n,)
    k: FloatArray  # N/m, shape (n,)
    z: FloatArray  # m, shape (rows, n)
    slope: FloatArray  # dz/dr, shape (rows, n)
    residual: FloatArray  # N, shape (rows,)

    @property
    def squares(self) -> float:
        """Sum of the squared residuals, N**2."""
        return float(self.residual @ self.residual)


def _training(
    records: list[Record], train: tuple[float, float], smoothing: float | None
) -> _Training:
    place = ", ".join(record.place for record in records)
    most = max(USED_ROWS // len(records), LEAST_ROWS)
    motions = [record.motion(smoothing) for record in records]
    parts, forces, moved = list[_Part](), list[FloatArray](), list[FloatArray]()
    for record, motion in zip(records, motions, strict=True):
        part, rows = _part(record, motion, train, most)
        parts.append(part)
        forces.append(column_of(record, "force")[rows])
        moved.append(motion.velocity[motion.time < train[1]])
    force = np.concatenate(forces)
    travel = max((float(np.ptp(part.position)) for part in parts if part.position.size), default=0)
    if force.size < FEWEST_ROWS:
        raise RecordError(
            f"{force.size} training row(s) after the motion has first covered {COVERED:.0%} of its "
            "travel",
            place=place,
            advice=f"at least {FEWEST_ROWS} are needed, because the state at the start is unknown; "
            "use a record that moves to and fro, or a longer train",
        )
    for name, changes in (("motion", travel > 0.0), ("force", np.ptp(force) > 0.0)):
        if not changes:
            raise RecordError(
                f"the {name} does not change in the training rows",
                place=place,
                advice="check the columns, and train",
            )
    median = usual_speed(np.concatenate(moved))
    resolved = [v_c for motion in motions if (v_c := motion.fitting_v_c()) > 0.0]
    v_c = min([*resolved, FASTEST_ARREST * median]) if resolved else ARREST * median
    return _Training(tuple(parts), force, travel, median, v_c, place)


def _part(
    record: Record, motion: Motion, train: tuple[float, float], most: int
) -> tuple[_Part, NDArray[np.int64]]:
    """Return the part of a record, and the rows of the record that it uses."""
    before = int(np.searchsorted(motion.time, train[1]))
    rows = _thinned(motion.position[:before], most)
    x = motion.position[rows]
    covered = np.maximum.accumulate(x) - np.minimum.accumulate(x)
    used = record.chosen[rows] & (motion.time[rows] >= train[0])
    used &= covered >= COVERED * covered.max(initial=0.0)
    return _Part(x, used), rows[used]


def _thinned(x: FloatArray, most: int) -> NDArray[np.int64]:
    """Return at most so many rows, among them every reversal but the smallest.

    Within a block of rows only the lowest and the highest position remain: between them a stop
    operator has no memory of its own.
    """
    rows = np.arange(x.size)
    size = -(-2 * x.size // max(most, 2))
    if x.size <= most or size < 2:
        return rows
    starts = np.arange(0, x.size, size)
    blocks = np.append(x, np.full(starts.size * size - x.size, x[-1])).reshape(-1, size)
    ends = np.concatenate([starts + blocks.argmin(axis=1), starts + blocks.argmax(axis=1)])
    return np.unique(np.minimum(ends, x.size - 1))


# --------------------------------------------------------------------------- n elements
def _merged(bank: _Bank, n: int) -> FloatArray:
    """Return at most n thresholds; of the neighbours, those that differ least are merged first.

    A merged element has the sum of the stiffnesses and of the plateau forces.
    """
    r, k = bank.r, bank.k
    while r.size > n:
        # Ward's criterion: the growth of the scatter sum(k (r - mean)**2), without units.
        share = k / k.sum()
        growth = share[:-1] * share[1:] / (share[:-1] + share[1:]) * np.diff(r / r[-1]) ** 2
        i = int(growth.argmin())
        pair = slice(i, i + 2)
        stiffness = k[pair].sum()
        mean = k[pair] @ r[pair] / stiffness
        r, k = (np.r_[a[:i], b, a[i + 2 :]] for a, b in ((r, mean), (k, stiffness)))
    return r


def _refined(data: _Training, r: FloatArray) -> _Bank:
    """Return the bank after a few Gauss-Newton steps of all thresholds.

    The stiffnesses follow by least squares; a step that does not help is halved.
    """
    limits = 0.5 * data.travel * FINEST, 0.5 * data.travel
    best = data.fitted(r)
    for _ in range(PASSES):
        plateau = best.k @ best.r  # all columns in N, so that units do not matter
        ones = np.full((best.residual.size, 1), plateau)
        jacobian = np.hstack([best.k * best.slope * best.r, plateau * best.z / best.r, ones])
        step = np.linalg.lstsq(jacobian, best.residual)[0][: best.r.size]
        step = best.r * np.clip(step, -0.5, 0.5)
        trial = best
        for halving in range(HALVINGS):
            nearby = np.unique(np.clip(best.r + 0.5**halving * step, *limits))
            trial = data.fitted(nearby)
            if trial.squares < best.squares:
                break
        if not trial.squares < best.squares:
            return best
        small = trial.squares > (1.0 - 1e-4) * best.squares
        best = trial
        if small:
            return best
    return best


def _split(bank: _Bank, n: int) -> tuple[FloatArray, FloatArray]:
    """Return thresholds and stiffnesses of n elements; halves keep the sums of both."""
    r, k = bank.r, bank.k
    while r.size < n:
        most = int((k * r).argmax())
        halves = r[most] * np.array([1.0 - APART, 1.0 + APART])
        r = np.r_[np.delete(r, most), halves]
        k = np.r_[np.delete(k, most), np.full(2, 0.5 * k[most])]
    order = np.argsort(r, kind="stable")
    return r[order], k[order]


def _model(bank: tuple[FloatArray, FloatArray], data: _Training) -> GMS:
    r, k = bank
    F_c = float(k @ r)
    return GMS(
        GMSParameters.from_shares(
            k * r / F_c,
            k,
            C=float(k.sum()) * data.speed,
            stribeck=Stribeck(F_c, STICTION * F_c, DIP * data.speed),
            v_c=data.v_c,
        ),
        law="signed",
    )
