"""Training and scoring every method on every data set."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gms_fsm._version import __version__
from gms_fsm.app.benchmark.datasets import DATA_SETS, DataSet, held_rows, score
from gms_fsm.app.benchmark.methods import METHODS, Method, Predictor
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import GMSError
from gms_fsm.phenomena.measure import Progress


@dataclass(frozen=True)
class Row:
    """One model on one data set."""

    model: str  # name
    free: int | None = None  # number of unknowns; None where it is not known
    train_rmse: float | None = None  # on training rows, N
    rmse: float | None = None  # on what was held out, N
    r2: float | None = None  # on what was held out
    seconds: float | None = None  # of processor time, for all splits
    by_record: dict[str, float] = field(default_factory=dict)  # RMSE of each held-out record, N
    note: str = ""  # what to know, or why it failed


@dataclass(frozen=True)
class Section:
    """All models on one data set."""

    name: str  # of the data set, as all of these
    title: str
    held_out: str
    licence: str
    rows: tuple[Row, ...]  # in the order in which they were made


@dataclass(frozen=True)
class Card:
    """A benchmark."""

    sections: tuple[Section, ...]  # one per data set
    machine: str  # on which it was made
    complete: bool = True  # false if it was interrupted

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data, for JSON."""
        return asdict(self)


def make(
    folder: Path,
    *,
    only: Sequence[str] = (),
    data: Sequence[DataSet] = DATA_SETS,
    methods: Sequence[Method] = METHODS,
    progress: Progress | None = None,
) -> Card:
    """Train and score the methods; Ctrl-C ends it with what is complete."""
    chosen = [each for each in data if not only or each.name in only]
    read = [(each, each.splits(folder)) for each in chosen]  # so that missing data are said first
    sections, complete, done = [], True, 0
    total = sum(
        len(splits) for each, splits in read for method in methods if each.name in method.on
    )
    for each, splits in read:
        held = held_rows(splits)
        rows: list[Row] = []
        for model, errors in each.published.items():
            pooled = float(np.sqrt(np.mean(np.square(list(errors.values())))))
            note = "published errors, full rate; mean over tests"
            rows.append(Row(model, rmse=pooled, by_record=dict(errors), note=note))
        mine = [method for method in methods if each.name in method.on]
        try:
            for method in mine:
                rows.append(_row(method, each, splits, progress, done / total, total))
                done += len(splits)
        except KeyboardInterrupt:
            complete = False
        licence = next(iter(held.values())).licence
        sections.append(Section(each.name, each.title, each.held_out, licence, tuple(rows)))
        if not complete:
            break
    return Card(tuple(sections), _machine(), complete)


def _row(
    method: Method,
    data: DataSet,
    splits: Sequence[Any],
    progress: Progress | None,
    done: float,
    total: int,
) -> Row:
    began = time.process_time()
    forces: dict[str, FloatArray] = {}
    squares, count = 0.0, 0
    predictor: Predictor | None = None
    try:
        for k, split in enumerate(splits):
            of = f", {k + 1} of {len(splits)}" * (len(splits) > 1)
            if progress is not None:
                progress(f"{data.name}: {method.name}{of}", done + k / total)
            predictor = method.train(split.training, data.smoothing, predictor)
            for record in split.held:
                forces[record.name] = predictor.predict(record)[record.chosen]
            for record in split.training:
                error = (predictor.predict(record) - record.columns["force"])[record.chosen]
                squares, count = squares + float(error @ error), count + error.size
    except GMSError as error:
        return Row(method.name, seconds=time.process_time() - began, note=str(error))
    assert predictor is not None
    scores: Any = score(held_rows(tuple(splits)), forces)
    return Row(
        method.name,
        predictor.free,
        float(np.sqrt(squares / count)),
        scores["rmse"],
        scores["r2"],
        time.process_time() - began,
        scores["by_record"],
        predictor.note,
    )


def _machine() -> str:
    return (
        f"gms-fsm {__version__}, Python {platform.python_version()}, {platform.system()} "
        f"{platform.machine()}, {os.cpu_count()} cores"
    )
