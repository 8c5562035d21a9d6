"""How sure a fit is: correlated residuals, intervals, and directions that are not determined.

Residuals of a model are correlated over many rows, so that rows count for less than their number:
intervals follow from sums of the slopes over blocks that are nearly independent (a sandwich), not
from rows.

References
----------
W. K. Newey, K. D. West, "A Simple, Positive Semi-Definite, Heteroskedasticity and Autocorrelation
Consistent Covariance Matrix", Econometrica 55(3), 703-708 (1987), doi:10.2307/1913610.
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
BLOCK = 10.0  # correlation times in a block of the sandwich
FEWEST_BLOCKS = 12
# A direction along which the coordinates can move this far (a factor of e**1.5, or the whole size
# of the force) within the noise is not determined at all.
LOOSE = 1.5
# A parameter whose 95 % interval is wider than this (a factor of 3 either way) cannot be told.
WIDE = math.log(3.0)
MOST_CORRELATED = 4.0  # atanh of the correlation from row to row: 0.9993
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
    """What the data say about all unknowns together, in coordinates.

    Parameters
    ----------
    covariance : ndarray, shape (p, p)
        Of the coordinates; infinite on the diagonal for those that cannot be told.
    half : ndarray, shape (p,)
        Half widths of the 95 % intervals of the coordinates.
    open : ndarray of bool, shape (p,)
        Which cannot be told.
    directions : ndarray, shape (p, p)
        Combinations of the coordinates, from the best determined to the least.
    spread : ndarray, shape (p,)
        How far each can move within the noise (one standard deviation).
    tau, effective : float
        Correlation time in rows, and the number of rows that count.
    """

    covariance: FloatArray
    half: FloatArray
    open: FloatArray
    directions: FloatArray
    spread: FloatArray
    tau: float
    effective: float


def certainty(
    slopes: FloatArray, parts: Sequence[FloatArray], logarithmic: FloatArray, size: float
) -> Certainty:
    """Return what the data say, from the slopes of the force and the residuals."""
    rows, p = slopes.shape
    residual = np.concatenate(list(parts))
    tau = correlation_time(parts)
    effective = max(rows / tau, 1.0)
    variance = float(residual @ residual) / max(rows - p, 1)
    variance = max(variance, (1e-9 * size) ** 2)
    information = slopes.T @ slopes / (variance * tau)
    strength, vectors = np.linalg.eigh(information)
    order = np.argsort(strength)[::-1]
    strength, vectors = np.maximum(strength[order], 0.0), vectors[:, order]
    with np.errstate(divide="ignore"):
        spread = 1.0 / np.sqrt(strength)
    loose = spread > LOOSE
    taking = (np.abs(vectors[:, loose]) > SHARE).any(axis=1)
    kept = vectors[:, ~loose]
    blocks = _block_sums(slopes @ kept, parts, max(1, math.ceil(BLOCK * tau)))
    count = len(blocks)
    inverse = np.diag(spread[~loose] ** 2) / (variance * tau)
    middle = blocks.T @ blocks * (count / max(count - kept.shape[1], 1))
    # With few blocks their sums are too uncertain; the information alone is then the better guess.
    if count < FEWEST_BLOCKS + kept.shape[1]:
        middle = np.linalg.pinv(inverse) * variance * tau
    covariance = kept @ inverse @ middle @ inverse @ kept.T
    # Blocks are few, and fitted residuals are smaller than the noise: never surer than rows / tau,
    # nor than noise that decays as the residuals do.
    decaying, correlation = _of_decaying_noise(slopes @ kept, parts)
    effective = max(min(effective, rows * (1.0 - correlation) / (1.0 + correlation)), 1.0)
    least = np.einsum("ij,j,ij->i", kept, spread[~loose] ** 2, kept)
    least = np.maximum(least, np.einsum("ij,jk,ik->i", kept, decaying, kept))
    present = np.maximum(np.diag(covariance), 1e-300)
    wider = np.sqrt(np.maximum(least / present, 1.0))
    covariance = covariance * np.outer(wider, wider)
    degrees = max(effective - p, 3.0)
    half = stdtrit(degrees, 0.975) * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    effect = half * np.sqrt(np.einsum("ij,ij->j", slopes, slopes) / rows) / size
    wide = (half > WIDE) & (logarithmic | (effect > NEGLIGIBLE))
    opened = taking | wide
    np.fill_diagonal(covariance, np.where(taking, np.inf, np.diag(covariance)))
    half = np.where(taking, np.inf, half)
    return Certainty(covariance, half, opened, vectors, spread, tau, effective)


def _of_decaying_noise(slopes: FloatArray, parts: Sequence[FloatArray]) -> tuple[FloatArray, float]:
    """Return the covariance of least squares under AR(1) noise, and its correlation by row.

    The correlation is that of the restricted likelihood of generalised least squares, which knows
    that a fit has taken a part of the slow noise away; that of the residuals is too small.
    """
    ends = np.cumsum([part.size for part in parts])[:-1]
    columns = np.column_stack([slopes, np.concatenate(list(parts))])
    pieces = np.split(columns, ends)
    rows, p = slopes.shape
    if not p or rows <= p + 2 or not columns[:, -1].any():
        return np.zeros((p, p)), 0.0

    def whitened(rho: float) -> FloatArray:
        root = math.sqrt(1.0 - rho * rho)
        return np.concatenate([np.vstack([root * a[:1], a[1:] - rho * a[:-1]]) for a in pieces])

    def lack(rho: float) -> tuple[float, float]:
        triangle = np.abs(np.diag(np.linalg.qr(whitened(rho), mode="r")))
        left = max(float(triangle[-1]) ** 2, 1e-300)
        fall = 2.0 * float(np.log(np.maximum(triangle[:-1], 1e-300)).sum())
        return (rows - p) * math.log(left) - len(parts) * math.log(1.0 - rho * rho) + fall, left

    found = minimize_scalar(
        lambda x: lack(math.tanh(x))[0], bounds=(0.0, MOST_CORRELATED), method="bounded"
    )
    rho = math.tanh(float(found.x))
    innovation = lack(rho)[1] / (rows - p)
    middle = np.zeros((p, p))
    for piece in pieces:
        own = piece[:, :-1]
        carried = lfilter([1.0], [1.0, -rho], own, axis=0)
        middle += own.T @ carried + carried.T @ own - own.T @ own
    inverse = np.linalg.pinv(slopes.T @ slopes)
    return inverse @ middle @ inverse * (innovation / (1.0 - rho * rho)), rho


def _block_sums(scores: FloatArray, parts: Sequence[FloatArray], length: int) -> FloatArray:
    """Return the sums of slope times residual over blocks of rows, shape (blocks, p)."""
    sums = []
    ends = np.cumsum([part.size for part in parts])[:-1]
    for part, own in zip(parts, np.split(scores, ends), strict=True):
        weighted = own * part[:, None]
        count = max(1, part.size // length)
        borders = np.linspace(0, part.size, count + 1).astype(int)[:-1]
        sums.append(np.add.reduceat(weighted, borders, axis=0))
    return np.concatenate(sums)


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
