"""Profiles of single parameters, and numbers with as many digits as they are worth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gms_fsm.charts.parameters import FloatArray

LIMIT = 3.841  # 95 % quantile of chi-squared with one degree of freedom


@dataclass(frozen=True, eq=False)
class Profile:
    """How the fit suffers as one parameter is moved and all others are searched again.

    Parameters
    ----------
    name, unit : str
        The parameter.
    values : ndarray, shape (m,)
        Increasing.
    rise : ndarray, shape (m,)
        Fall of twice the log-likelihood on effective rows; 3.84 is the limit of the 95 % interval.
    low, high : float
        The interval; an open end is -inf or inf.
    """

    name: str
    unit: str
    values: FloatArray
    rise: FloatArray
    low: float
    high: float

    @property
    def open(self) -> bool:
        """Whether an end of the interval was not found."""
        return not (math.isfinite(self.low) and math.isfinite(self.high))

    def __str__(self) -> str:
        value = float(self.values[int(np.argmin(self.rise))])
        _, interval = shown_interval(value, self.low, self.high)
        return f"{self.name}: 95 % interval {interval} {self.unit}".rstrip()


def shown_interval(value: float, low: float, high: float) -> tuple[str, str]:
    """Return a value and its interval as texts, with as many digits as the interval is worth."""
    if math.isinf(low) and math.isinf(high):
        return f"{value:.4g}", "any"
    if math.isinf(low) or math.isinf(high):
        end = f"any above {low:.4g}" if math.isinf(high) else f"any below {high:.4g}"
        return f"{value:.4g}", end
    size, width = max(abs(low), abs(high)), high - low
    digits = 4 if width <= 0.0 else math.ceil(math.log10(size / width)) + 3
    digits = min(max(digits, 3), 12)
    return f"{value:.{digits}g}", f"{low:.{digits}g} to {high:.{digits}g}"
