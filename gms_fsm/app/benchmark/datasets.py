"""The data sets of the benchmark, and what of each is held out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import RecordError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.identification.certainty.compared import score_of
from gms_fsm.records import damper, tribometer
from gms_fsm.records.parts import only
from gms_fsm.records.record import Record

TRAIN = (20.0, 100.0)  # s; the rows from 100 s on are held out


@dataclass(frozen=True, eq=False)
class Split:
    """What is trained on, and what is predicted."""

    training: tuple[Record, ...]  # with the training rows selected
    held: tuple[Record, ...]  # with the held-out rows selected


@dataclass(frozen=True)
class DataSet:
    """Public records with a rule of what is held out."""

    name: str  # for files
    title: str  # for tables
    held_out: str  # the rule, in words
    smoothing: float | None  # time constant of the motion, s
    splits: Callable[[Path], tuple[Split, ...]]  # reads a folder
    published: Mapping[str, Mapping[str, float]]  # of others: model, record, N


def _tribometer(folder: Path) -> tuple[Split, ...]:
    record = tribometer(folder)
    t = record.columns["time"]
    return (
        Split((only(record, (t >= TRAIN[0]) & (t < TRAIN[1])),), (only(record, t >= TRAIN[1]),)),
    )


def _damper(folder: Path) -> tuple[Split, ...]:
    every = tuple(damper(folder / "damper" if (folder / "damper").is_dir() else folder))
    return tuple(Split(every[:i] + every[i + 1 :], (each,)) for i, each in enumerate(every))


# RMSE of the predictions that the authors stored with their data, on the full rate.
LUGRE = (3380, 3013, 3085, 3256, 4225, 3355, 2951, 2698, 2638, 2488, 2531, 2787, 3469)
DATA_SETS = (
    DataSet(
        "tribometer",
        "Reciprocating tribometer, 50 cycles of 4 s, 5 N",
        "trained on 20 to 100 s, held out from 100 s on",
        0.02,
        _tribometer,
        {},
    ),
    DataSet(
        "damper",
        "Banded rotary friction damper with backlash, 13 harmonic tests",
        "each test in turn",
        None,
        _damper,
        {
            "LuGre, stored with the data": {
                f"test{number:02d}": float(rmse) for number, rmse in enumerate(LUGRE)
            }
        },
    ),
)


def data_set(name: object) -> DataSet:
    """Return a data set by name.

    Examples
    --------
    >>> data_set("damper").held_out
    'each test in turn'
    """
    for each in DATA_SETS:
        if each.name == name:
            return each
    raise unknown("data set", name, (each.name for each in DATA_SETS), place="dataset")


def held_rows(splits: tuple[Split, ...]) -> dict[str, Record]:
    """Return the records with held-out rows, by name."""
    return {record.name: record for split in splits for record in split.held}


def score(held: Mapping[str, Record], forces: Mapping[str, FloatArray]) -> dict[str, object]:
    """Return how well forces reproduce what was held out."""
    modelled, measured, by_record = [], [], {}
    for name, force in forces.items():
        target = held[name].columns["force"][held[name].chosen]
        if force.shape != target.shape:
            raise RecordError(
                f"{force.size} forces for {target.size} held-out rows", place=held[name].place
            )
        modelled.append(force)
        measured.append(target)
        by_record[name] = score_of(target, force)["rmse"]
    whole = score_of(np.concatenate(measured), np.concatenate(modelled))
    return {**whole, "by_record": by_record}
