"""How sure a fit is: correlated residuals, intervals, and directions that are not determined.

Residuals of a model are correlated over many rows, so that rows count for less than their number.
The intervals are those of least squares under noise whose correlation decays by the same factor
from row to row, AR(1), estimated by restricted likelihood. Residuals that follow each other longer
than such noise are measured, so that a fit can warn of them; its intervals are not made wider.

References
----------
A. Sokal, "Monte Carlo Methods in Statistical Mechanics" (1997), for the window of the correlation
time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter
from scipy.special import stdtrit

from gms_fsm.charts.parameters import FloatArray

WINDOW = 5.0  # correlation times over which the autocorrelation is summed
ROUNDING = 1e-14  # of the strongest direction: what is below has no influence
# A direction along which the coordinates can move this far (a factor of e**1.5, or the whole size
# of the force) within the noise is not determined at all.
LOOSE = 1.5
# A parameter whose 95 % interval is wider than this (a factor of 3 either way) cannot be told.
WIDE = math.log(3.0)
MOST_CORRELATED = 4.0  # atanh of the correlation from row to row: 0.9993
LONGER = 1.5  # correlation time of what is left, from which it matters
CHANCE = 14.0  # times 1/sqrt(rows): three deviations of a correlation time of 1
LEAST_SHARE = 1e-3  # of the variance that a slow parameter would have
SHARE = 0.3  # of a direction: what makes a parameter take part in it
NEGLIGIBLE = 0.02  # of the force: an interval whose whole effect is below this tells "nearly zero"


def correlation_time(parts: Sequence[FloatArray]) -> float:
    """Return the integrated autocorrelation time of residuals, in rows.

    ``tau = 1 + 2 * sum(rho_l)`` over lags up to 5 tau; n rows count for n / tau.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(0).standard_normal(4000)
    >>> round(correlation_time([noise]), 1), round(correlation_time([np.repeat(noise, 20)]))
    (1.0, 20)
    """
    longest = max(part.size for part in parts)
    total = np.zeros(longest)
    for part in parts:
        size = 1 << (2 * part.size - 1).bit_length()
        spectrum = np.abs(np.fft.rfft(part, size)) ** 2
        total[: part.size] += np.fft.irfft(spectrum, size)[: part.size]
    if total[0] <= 0.0:
        return 1.0
    tau = 1.0 + 2.0 * np.cumsum(total[1:] / total[0])
    lags = np.arange(1, longest)
    inside = np.flatnonzero(lags >= WINDOW * tau)
    found = tau[inside[0]] if inside.size else (tau[-1] if tau.size else 1.0)
    return float(min(max(found, 1.0), longest / 2))


@dataclass(frozen=True, eq=False)
class Certainty:
    """What the data say about all unknowns together, in coordinates."""

    covariance: FloatArray  # (p, p) of the coordinates; infinite on the diagonal if untold
    half: FloatArray  # (p,) half widths of the 95 % intervals of the coordinates
    open: FloatArray  # (p,) which cannot be told
    directions: FloatArray  # (p, p) combinations of coordinates, the best determined first
    spread: FloatArray  # (p,) how far each can move within the noise: one standard deviation
    share: FloatArray  # (p,) variance of each over that of a slow one, for which rows / tau count
    tau: float  # correlation time of the noise, rows
    effective: float  # the number of rows that count
    beyond: float = 1.0  # that of what is left without that noise, rows; 1 if it may be chance


def certainty(
    slopes: FloatArray, parts: Sequence[FloatArray], logarithmic: FloatArray, size: float
) -> Certainty:
    """Return what the data say, from the slopes of the force and the residuals."""
    rows, p = slopes.shape
    strength, vectors = np.linalg.eigh(slopes.T @ slopes)
    order = np.argsort(strength)[::-1]
    strength, vectors = np.maximum(strength[order], 0.0), vectors[:, order]
    solid = strength > ROUNDING * strength[:1]
    own = slopes @ vectors[:, solid]
    ends = np.cumsum([part.size for part in parts])[:-1]
    pieces = np.split(np.column_stack([own, np.concatenate(list(parts))]), ends)
    rho, variance = _decaying_noise(pieces)
    variance = max(variance, (1e-9 * size) ** 2)
    tau = (1.0 + rho) / (1.0 - rho)
    effective = max(rows / tau, 1.0)
    along = _products(pieces, rho) * variance / np.outer(strength[solid], strength[solid])
    spread = np.full(p, np.inf)
    spread[solid] = np.sqrt(np.diag(along))
    loose = spread > LOOSE
    taking = (np.abs(vectors[:, loose]) > SHARE).any(axis=1)
    kept = vectors[:, solid] * ~loose[solid]
    covariance = kept @ along @ kept.T
    slow = np.einsum("ij,j,ij->i", kept, variance * tau / strength[solid], kept)
    share = np.clip(np.diag(covariance) / np.maximum(slow, 1e-300), LEAST_SHARE, 1.0)
    degrees = max(effective - p, 3.0)
    half = stdtrit(degrees, 0.975) * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    effect = half * np.sqrt(np.einsum("ij,ij->j", slopes, slopes) / rows) / size
    wide = (half > WIDE) & (logarithmic | (effect > NEGLIGIBLE))
    opened = taking | wide
    np.fill_diagonal(covariance, np.where(taking, np.inf, np.diag(covariance)))
    half = np.where(taking, np.inf, half)
    left = [part[1:] - rho * part[:-1] for part in parts if part.size > 1]
    beyond = correlation_time(left) if left else 1.0
    if beyond <= max(LONGER, 1.0 + CHANCE / math.sqrt(rows)):
        beyond = 1.0
    return Certainty(
        covariance,
        half,
        opened,
        vectors,
        spread,
        np.where(taking, 1.0, share),
        tau,
        effective,
        beyond,
    )


def _decaying_noise(pieces: Sequence[FloatArray]) -> tuple[float, float]:
    """Return the correlation by row of AR(1) noise, and its variance; residuals are last columns.

    The correlation is that of the restricted likelihood of generalised least squares, which knows
    that a fit has taken a part of the slow noise away; that of the residuals is too small.
    """
    rows, p = sum(len(piece) for piece in pieces), pieces[0].shape[1] - 1
    squares = sum(float(piece[:, -1] @ piece[:, -1]) for piece in pieces)
    if rows <= p + 2 or squares == 0.0:
        return 0.0, squares / max(rows - p, 1)

    def whitened(rho: float) -> FloatArray:
        root = math.sqrt(1.0 - rho * rho)
        return np.concatenate([np.vstack([root * a[:1], a[1:] - rho * a[:-1]]) for a in pieces])

    def lack(rho: float) -> tuple[float, float]:
        triangle = np.abs(np.diag(np.linalg.qr(whitened(rho), mode="r")))
        left = max(float(triangle[-1]) ** 2, 1e-300)
        fall = 2.0 * float(np.log(np.maximum(triangle[:-1], 1e-300)).sum())
        return (rows - p) * math.log(left) - len(pieces) * math.log(1.0 - rho * rho) + fall, left

    found = minimize_scalar(
        lambda x: lack(math.tanh(x))[0], bounds=(0.0, MOST_CORRELATED), method="bounded"
    )
    rho = math.tanh(float(found.x))
    return rho, lack(rho)[1] / (rows - p) / (1.0 - rho * rho)


def _products(pieces: Sequence[FloatArray], rho: float) -> FloatArray:
    """Return the sum of slope times slope over all pairs of rows, each times their correlation."""
    middle = np.zeros((pieces[0].shape[1] - 1,) * 2)
    for piece in pieces:
        own = piece[:, :-1]
        carried = lfilter([1.0], [1.0, -rho], own, axis=0)
        middle += own.T @ carried + carried.T @ own - own.T @ own
    return middle


def phase_floor(t: FloatArray, values: FloatArray, period: float) -> float:
    """Return how far single cycles are from their mean: what no model of the motion can beat."""
    step = float(np.median(np.diff(t)))
    bins = max(1, round(period / step))
    place = np.rint((t - t[0]) / period * bins).astype(int) % bins
    many = np.bincount(place, minlength=bins)
    mean = np.bincount(place, values, minlength=bins) / np.maximum(many, 1)
    left = (values - mean[place]) ** 2
    several = many[place] > 1
    if not several.any():
        return math.nan
    factor = many[place][several] / (many[place][several] - 1.0)
    return float(np.sqrt(np.mean(left[several] * factor)))
