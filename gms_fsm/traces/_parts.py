"""The contents of a trace file, and checks that they are consistent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import TraceFileError
from gms_fsm.lowering.layout import LOG_TEXTS, Layout
from gms_fsm.lowering.program import lower
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.traces._header import Header
from gms_fsm.traces._log import is_log
from gms_fsm.traces.rows import Rows

__all__ = ["BY_ELEMENT", "OBSERVED", "Parts", "checked"]

BY_ELEMENT = ("s", "F_elements", "dz")  # dz is the rate of the chart's first variable
OBSERVED = ("v", "F", *BY_ELEMENT)  # the observed quantities stored in files


@dataclass(frozen=True, eq=False)
class Parts:
    """A run as stored in a file.

    Parameters
    ----------
    header : Header
        Description of the model, the rig and the settings.
    model, rig
        The simulated system.
    rows, stops : Rows
        The rows, and both sides of every stop.
    log : recarray
        The log, as in ``Trace.transitions``.
    stored : mapping of str to ndarray
        Observed quantities, by the names in `OBSERVED`.
    """

    header: Header
    model: Model
    rig: Rig
    rows: Rows
    stops: Rows
    log: Any
    stored: Mapping[str, FloatArray]


def checked(parts: Parts) -> Parts:
    """Check the parts of a file and return them, completed.

    Parameters
    ----------
    parts : Parts
        The parts as read.

    Returns
    -------
    Parts
        With slide flags for the surfaces, which files of older versions lack.

    Raises
    ------
    TraceFileError
        If they are inconsistent.
    """
    layout, states = lower(parts.model, parts.rig).layout, len(parts.model.chart.states)
    rows, stops = (_with_slides(table, layout) for table in (parts.rows, parts.stops))
    for kind, table in (("rows", rows), ("stops", stops)):
        _check_table(kind, table, layout, states)
    if not len(rows):
        raise TraceFileError("the file has no rows")
    for name, value in parts.stored.items():
        _expect(name, value, (len(rows), layout.n)[: 1 + (name in BY_ELEMENT)], "f")
    _check_log(parts.log, parts.model)
    for kind, table in (("rows", rows), ("stops", stops)):
        times = parts.log.t
        fired = np.searchsorted(times, table.t, "right") - np.searchsorted(times, table.t)
        if not ((table.microstep >= 0) & (table.microstep <= fired)).all():
            raise TraceFileError(
                f"{kind} microstep: the micro-steps do not match the firings in the log"
            )
    return replace(parts, rows=rows, stops=stops)


def _check_table(kind: str, table: Rows, layout: Layout, states: int) -> None:
    count = table.t.size
    _expect(f"{kind} t", table.t, (count,), "f")
    _expect(f"{kind} microstep", table.microstep, (count,), "i")
    _expect(f"{kind} y", table.y, (count, layout.y.size), "f")
    _expect(f"{kind} mode", table.mode, (count, layout.modes), "i")
    if not (np.diff(table.t) >= 0).all() or not np.isfinite(table.t).all():
        raise TraceFileError(f"{kind} t: times must be finite and must not decrease")
    active, slid = table.mode[:, layout.elements], table.mode[:, layout.slides]
    if count and not 0 <= active.min() <= active.max() < states:
        raise TraceFileError(f"{kind} mode: it contains a number that is not a state of the chart")
    if slid.size and not 0 <= slid.min() <= slid.max() <= 1:
        raise TraceFileError(f"{kind} mode: a slide flag must be 0 or 1")


def _check_log(log: Any, model: Model) -> None:
    if not is_log(log):
        raise TraceFileError("the transition log does not have the columns of a trace")
    if log.size and not 0 <= log.element.min() <= log.element.max() < model.n:
        raise TraceFileError("the transition log names an element that the model does not have")
    if not (np.diff(log.t) >= 0).all() or not np.isfinite(log.t).all():
        raise TraceFileError("the transition log: times must be finite and must not decrease")
    edges = {(edge.name, edge.source, edge.target) for edge in model.chart.transitions}
    if not edges >= set(zip(*(log[name].tolist() for name in LOG_TEXTS), strict=True)):
        raise TraceFileError("the transition log names an edge that the chart does not have")


def _with_slides(rows: Rows, layout: Layout) -> Rows:
    """Return rows with slide flags for the surfaces, which files of older versions lack."""
    if rows.mode.ndim != 2 or rows.mode.shape[1] != layout.n or not layout.surfaces:
        return rows
    none = np.zeros((len(rows.mode), layout.surfaces), dtype=np.int64)
    return replace(rows, mode=np.concatenate([rows.mode, none], axis=1))


def _expect(name: str, array: Any, shape: tuple[int, ...], kind: str) -> None:
    """Raise unless an array from a file has the expected shape and type."""
    if not isinstance(array, np.ndarray) or array.shape != shape or array.dtype.kind != kind:
        found = getattr(array, "shape", None), str(getattr(array, "dtype", type(array).__name__))
        wanted = shape, {"f": "float", "i": "integer"}[kind]
        raise TraceFileError(f"{name} is {found}, expected {wanted}")
