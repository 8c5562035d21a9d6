"""The models of the benchmark, from a static curve to what `choose` finds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import nnls

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.identification.bank import stop_operators, thresholds
from gms_fsm.identification.candidates import Build, FitStart, gms
from gms_fsm.identification.choose import choose
from gms_fsm.identification.fit import fitted, task_of
from gms_fsm.identification.joints import JOINTS
from gms_fsm.identification.problem.task import FitOptions
from gms_fsm.identification.result import Fit
from gms_fsm.records.parts import thinned
from gms_fsm.records.record import Record

FEW = 1500  # rows of each of several records that a fit is made with; all are predicted


@dataclass(frozen=True, eq=False)
class Predictor:
    """A trained model."""

    free: int  # number of unknowns
    predict: Callable[[Record], FloatArray]
    note: str = ""  # what it is, if the name of the method does not say
    fit: Fit | None = None  # where it came from, to start the next one


Train = Callable[[Sequence[Record], float | None, Predictor | None], Predictor]


@dataclass(frozen=True)
class Method:
    """A kind of model, and on which data sets it is tried."""

    name: str  # for tables
    train: Train
    on: tuple[str, ...] = ("tribometer",)  # names of data sets


# --------------------------------------------------------------------------- Maxwell-slip
def _maxwell(n: int) -> Train:
    """Stop operators on a grid of thresholds, viscous friction and offset, by NNLS."""

    def columns(record: Record, smoothing: float | None, r: FloatArray) -> FloatArray:
        motion = record.motion(smoothing)
        one = np.ones((motion.time.size, 1))
        z = stop_operators(motion.position, r)
        found: FloatArray = np.hstack([z / r, motion.velocity[:, None], one, -one])
        return found

    def train(records: Sequence[Record], smoothing: float | None, _: Any) -> Predictor:
        travel = max(float(np.ptp(each.motion(smoothing).position)) for each in records)
        r = np.quantile(thresholds(travel), np.linspace(0.0, 1.0, n))
        basis = np.concatenate([columns(each, smoothing, r)[each.chosen] for each in records])
        force = np.concatenate([each.columns["force"][each.chosen] for each in records])
        scale = np.linalg.norm(basis, axis=0)
        triangle: Any = np.linalg.qr(np.column_stack([basis / scale, force]), mode="r")
        shares, _residual = nnls(triangle[:, :-1], triangle[:, -1], maxiter=1000)
        weights = shares / scale
        return Predictor(n + 2, lambda record: columns(record, smoothing, r) @ weights)

    return train


# --------------------------------------------------------------------------- fits
def _gms(n: int) -> Build:
    return lambda records, smoothing: gms(records, smoothing, n=n)


def _fitted(build: Build) -> Train:
    """Fit by hops; later splits are refined from the previous one."""

    def train(
        records: Sequence[Record], smoothing: float | None, before: Predictor | None
    ) -> Predictor:
        few = _few(records)
        if before is not None and before.fit is not None:
            return _refined(few, smoothing, before.fit)
        start = build(few, smoothing)
        return _predictor(_fit(few, start, smoothing, "hops", None))

    return train


def _chosen(
    records: Sequence[Record], smoothing: float | None, before: Predictor | None
) -> Predictor:
    """Choose among the candidates; later splits refine what the first one chose."""
    few = _few(records)
    if before is not None and before.fit is not None:
        return replace(_refined(few, smoothing, before.fit), note=before.note)
    found = choose(few, smoothing=smoothing)
    assert found.choice is not None
    return replace(_predictor(found), note=found.choice.chosen)


def _refined(records: Sequence[Record], smoothing: float | None, before: Fit) -> Predictor:
    given = before.task.options
    start = FitStart(before.model, given.free, given.tied, given.bounds)
    return _predictor(_fit(records, start, smoothing, "local", before.task.begin))


def _fit(
    records: Sequence[Record],
    start: FitStart,
    smoothing: float | None,
    search: str,
    begin: str | None,
) -> Fit:
    """Fit without intervals, which predictions do not need."""
    options = FitOptions(
        free=start.free,
        tied=start.tied,
        bounds=start.bounds,
        smoothing=smoothing,
        search=search,
        begin=begin,
    )
    return fitted(task_of(records, start.model, {}, options), intervals=False)


def _predictor(found: Fit) -> Predictor:
    if found.stopped:  # a fit keeps its best on Ctrl-C; a row of the card is complete or not there
        raise KeyboardInterrupt
    return Predictor(len(found.table), found.predict, fit=found)


def _few(records: Sequence[Record]) -> list[Record]:
    """Return several records in fewer rows; one record as it is."""
    if len(records) == 1:
        return list(records)
    return [thinned(record, FEW) for record in records]


BOTH = ("tribometer", "damper")
_OF_JOINTS = {each.name: _fitted(each.build) for each in JOINTS}
METHODS = (
    Method("static curve", _OF_JOINTS["static"], BOTH),
    Method("Dahl", _OF_JOINTS["Dahl"]),
    Method("LuGre", _OF_JOINTS["LuGre"]),
    Method("Bouc-Wen", _OF_JOINTS["Bouc-Wen"]),
    Method("Maxwell-slip, NNLS, 15", _maxwell(15)),
    Method("Maxwell-slip, NNLS, 24", _maxwell(24), ("damper",)),
    Method("GMS 1", _fitted(_gms(1))),
    Method("GMS 2", _fitted(_gms(2)), BOTH),
    Method("GMS 4", _fitted(_gms(4))),
    Method("GMS 8", _fitted(_gms(8))),
    Method("choose", _chosen, BOTH),
)
