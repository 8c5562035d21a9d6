"""What is left out in turn: records, stretches of them, or all of one amplitude or speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ParameterError, RecordError
from gms_fsm.foundation.arguments import one_of
from gms_fsm.identification.problem.task import FitOptions
from gms_fsm.records.parts import only
from gms_fsm.records.record import Record

__all__ = ["Folds", "Parts", "folds_of", "period_of"]

FOLDS = ("record", "cycles", "amplitude", "speed")
APART = 1.25  # ratio of amplitudes, or of speeds, that are not the same
BLOCKS = 4  # of time, where a record is folded by its cycles
REPEATS = 0.5  # least autocorrelation of a motion that repeats
NEARLY = 0.1  # of a cycle may be missing at the end

Parts: TypeAlias = tuple[tuple[tuple[Record, ...], tuple[Record, ...]], ...]


@dataclass(frozen=True, eq=False)
class Folds:
    """What is fitted to and what is left out, in few rows."""

    all: tuple[Record, ...]  # everything
    parts: Parts  # fitted to, and left out
    # By amplitude and by speed, where records differ in them.
    others: Mapping[str, Parts] = field(default_factory=dict)


def _apart(records: tuple[Record, ...], group: NDArray[np.intp]) -> Parts:
    """Return folds that leave out one group of records at a time."""
    pairs = list(zip(records, group.tolist(), strict=True))
    return tuple(
        (tuple(each for each, own in pairs if own != i), tuple(e for e, own in pairs if own == i))
        for i in range(int(group.max()) + 1)
    )


def _grouped(records: tuple[Record, ...], by: str) -> Parts:
    """Return folds that leave out all records of about one amplitude, or of about one speed."""
    moved = [record.motion(None) for record in records]
    sizes = [
        float(np.ptp(each.position) if by == "amplitude" else np.abs(each.velocity).max())
        for each in moved
    ]
    order = np.argsort(sizes)
    new = np.append(False, np.diff(np.log(np.maximum(sizes, 1e-300))[order]) > math.log(APART))
    group = np.empty(order.size, dtype=int)
    group[order] = np.cumsum(new)
    return _apart(records, group) if group.any() else ()


def folds_of(records: Sequence[Record], fold: Any, options: FitOptions) -> Folds:
    """Return what is left out in turn, as asked for."""
    if fold is None:
        fold = FOLDS[0] if len(records) > 1 else FOLDS[1]
    one_of("fold", fold, FOLDS)
    every = tuple(records)
    if fold == "record":
        if len(every) < 2:
            raise ParameterError(
                "there is only one record",
                place="fold",
                value=fold,
                advice="give several, or fold='cycles'",
            )
        others = {by: found for by in FOLDS[2:] if (found := _grouped(every, by))}
        return Folds(every, _apart(every, np.arange(len(every))), others)
    if fold in FOLDS[2:]:
        groups = _grouped(every, fold)
        if not groups:
            raise ParameterError(
                f"all records have about the same {fold}",
                place="fold",
                value=fold,
                advice="give records that differ in it, or fold='record'",
            )
        return Folds(every, groups)
    blocks = [_blocks(record, options.cycles) for record in every]
    count = min(int(block.max()) + 1 for block in blocks)

    def rows(i: int, *, left: bool) -> tuple[Record, ...]:
        pairs = zip(every, blocks, strict=True)
        return tuple(only(record, (block % count == i) == left) for record, block in pairs)

    return Folds(every, tuple((rows(i, left=False), rows(i, left=True)) for i in range(count)))


def _blocks(record: Record, cycles: float | None) -> Any:
    """Return for each row the number of its block, from 0; blocks begin where cycles do."""
    t = record.columns["time"]
    period = cycles or period_of(t[record.chosen], record.columns["position"][record.chosen])
    if period is None:
        raise RecordError(
            "its motion does not repeat",
            place=record.place,
            advice="give cycles=period (s), or several records and fold='record'",
        )
    first, last = t[record.chosen][[0, -1]]
    whole = int((last - first) / period + NEARLY)
    if whole < 2:
        raise RecordError(
            f"its training rows last {last - first:.4g} s, less than two cycles of {period:.4g} s",
            place=record.place,
            advice="give a longer record or train, a shorter cycles=..., or several records and "
            "fold='record'",
        )
    count = min(BLOCKS, whole)
    borders = first + period * np.round(np.arange(1, count) * whole / count)
    return np.searchsorted(borders, t, side="right")


def period_of(t: FloatArray, x: FloatArray) -> float | None:
    """Return the period of a motion, from the autocorrelation of its position.

    Parameters
    ----------
    t : ndarray, shape (rows,)
        Times, s.
    x : ndarray, shape (rows,)
        Positions, m.

    Returns
    -------
    float or None
        s; None if it does not repeat within the record.

    Examples
    --------
    >>> t = np.arange(0.0, 30.0, 0.01)
    >>> round(period_of(t, np.sin(2 * np.pi * t / 4.0)), 3)
    4.0
    """
    even = np.linspace(t[0], t[-1], t.size)
    values = np.interp(even, t, x)
    values = values - values.mean()
    size = 1 << (2 * values.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(values, size)) ** 2
    lags = np.arange(values.size // 2 + 1)
    similar = np.fft.irfft(spectrum, size)[lags] / (values.size - lags)
    if similar[0] <= 0.0:
        return None
    similar /= similar[0]
    below = np.flatnonzero(similar < 0.0)
    if not below.size:
        return None
    after = similar[below[0] :]
    best = int(np.argmax(after))
    if after[best] < REPEATS:
        return None
    # The first of the peaks that are as high: later ones are multiples of the period.
    high = int(np.argmax(after > after[best] - 0.5 * (1.0 - REPEATS)))
    falls = np.flatnonzero(np.diff(after[high:]) < 0.0)
    peak = float(below[0] + high + (int(falls[0]) if falls.size else 0))
    # The ends of a short record shift the peak; a distance of many cycles does not depend on them.
    many = 1
    while many * peak < 0.5 * values.size:
        reach = max(2.0, 0.1 * peak)
        near = np.arange(round(many * peak - reach), round(many * peak + reach) + 1)
        near = near[(near > 0) & (near < values.size)]
        apart = [float(np.mean((values[lag:] - values[:-lag]) ** 2)) for lag in near]
        peak, many = float(near[int(np.argmin(apart))]) / many, 2 * many
    return float(peak * (even[1] - even[0]))
