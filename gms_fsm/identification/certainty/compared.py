"""Models side by side: scores, comparisons, and how one was chosen."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ParameterError, shown


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
    why : str
        Why it was not chosen.
    by_amplitude, by_speed : float
        RMSE when all records of one amplitude, or of one speed, are left out at a time; NaN where
        the records have only one.
    """

    name: str
    reason: str
    free: int
    rmse: float
    r2: float
    bic: float
    seconds: float
    note: str = ""
    why: str = ""
    by_amplitude: float = math.nan
    by_speed: float = math.nan


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


def compared(every: Mapping[str, Any], first: Any) -> FitComparison:
    """Return fits side by side; refuse those that were made from other rows than the first."""
    for name, each in every.items():
        if not np.array_equal(each.task.fine.target, first.task.fine.target):
            raise ParameterError(
                f"fit {shown(name)} was made from other rows",
                place="others",
                advice="compare fits to the same records, with the same train",
            )
        if None not in (each.test, first.test) and each.test != first.test:
            raise ParameterError(
                f"other rows were held out of fit {shown(name)}",
                place="others",
                advice="compare fits with the same test",
            )
    # One number of rows for all, that of the best: else the order would depend on units.
    effective = min(every.values(), key=lambda each: each.point.cost).effective_rows
    rows = []
    for name, each in every.items():
        score = each.held_out or each.training
        note = "" if each.held_out else "training rows: no test was given"
        own = score["rmse"], score["r2"], each.bic(effective), each.seconds, note
        rows.append(ChoiceRow(name, "", len(each.table), *own))
    return FitComparison(tuple(sorted(rows, key=lambda row: (bool(row.note), row.rmse))))


def lines_of(fit: Any) -> list[str]:
    """Return a fit as lines: its table, its scores, what cannot be told, how it was chosen."""
    lines = [f"{'parameter':14s} {'value':>12s}   {'95 % interval':28s} unit"]
    for each in fit.table:
        value, interval = each.shown
        note = f"  {each.note}" if each.note else ""
        lines.append(f"{each.name:14s} {value:>12s}   {interval:28s} {each.unit}{note}".rstrip())
    unit = fit.task.measured.unit
    lines.append(_scored("training", fit.training, unit))
    if fit.held_out is not None:
        lines.append(_scored("held out", fit.held_out, unit))
    lines.append(fit.weakest)
    if fit.choice is not None:
        lines.append(f"chosen among {len(fit.choice.rows)} candidates: {fit.choice.chosen}")
        for row in fit.choice.rows:
            if row.name != fit.choice.chosen:
                lost = f" failed: {row.note}" if row.note else f": {row.why}"
                lines.append(f"{row.name}{lost}")
    return [*lines, fit.stopped] if fit.stopped else lines


def _scored(name: str, score: Mapping[str, float], unit: str) -> str:
    rows = int(score["rows"])
    return f"{name}: RMSE {score['rmse']:.4g} {unit}, R2 {score['r2']:.5f} ({rows} rows)"
