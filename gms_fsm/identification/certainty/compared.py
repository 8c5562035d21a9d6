"""Models side by side: scores, comparisons, and how one was chosen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gms_fsm.charts.parameters import FloatArray


@dataclass(frozen=True)
class ChoiceRow:
    """A candidate of `choose`.

    Parameters
    ----------
    name, reason : str
        The candidate, and why it is one.
    free : int
        Number of unknowns, nuisance terms included.
    rmse, r2 : float
        On the rows left out in turn.
    bic : float
        Bayesian information criterion on effective rows.
    seconds : float
        What its fits took.
    note : str
        Why it failed, if it did.
    """

    name: str
    reason: str
    free: int
    rmse: float
    r2: float
    bic: float
    seconds: float
    note: str = ""


@dataclass(frozen=True)
class Choice:
    """How a model was chosen.

    Parameters
    ----------
    rows : tuple of ChoiceRow
        The candidates.
    chosen : str
        The one fitted to all rows.
    """

    rows: tuple[ChoiceRow, ...]
    chosen: str


@dataclass(frozen=True)
class FitComparison:
    """Fits side by side, the best on held-out rows first.

    Parameters
    ----------
    rows : tuple of ChoiceRow
        Name, number of unknowns, held-out RMSE and R2 (of training rows where there are no others,
        as the note says), BIC on effective rows.
    """

    rows: tuple[ChoiceRow, ...]

    def __str__(self) -> str:
        lines = [f"{'model':32s} {'free':>4s} {'RMSE':>10s} {'R2':>8s} {'BIC':>10s}"]
        lines += [
            f"{row.name[:32]:32s} {row.free:4d} {row.rmse:10.4g} {row.r2:8.5f} {row.bic:10.1f}"
            + (f"  {row.note}" if row.note else "")
            for row in self.rows
        ]
        return "\n".join(lines)


def score_of(measured: FloatArray, modelled: FloatArray) -> dict[str, float]:
    """Return how well a model reproduces a measurement.

    Parameters
    ----------
    measured, modelled : ndarray, shape (rows,)
        At the same rows.

    Returns
    -------
    dict
        ``rmse`` in the unit of the measurement, ``r2`` (share of the variance that is explained),
        and the number of ``rows``.
    """
    left = modelled - measured
    about = measured - measured.mean()
    whole = float(about @ about)
    return {
        "rmse": float(np.sqrt(np.mean(left**2))),
        "r2": 1.0 - float(left @ left) / whole if whole else math.nan,
        "rows": float(measured.size),
    }
