"""The transition log as a record array, with the columns of `LogRecord`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gms_fsm.lowering.layout import LOG_TEXTS, LogRecord

__all__ = ["is_log", "log_from", "log_of"]


def log_of(records: Iterable[LogRecord]) -> Any:
    """Return firings as a record array with the columns of `Trace.transitions`."""
    rows = list(records)
    texts = {text for row in rows for text in (row.edge, row.source, row.target)}
    return np.array(rows, dtype=_dtype(texts)).view(np.recarray)


def log_from(columns: Mapping[str, Any]) -> Any:
    """Return columns, given by name, as the record array of `Trace.transitions`."""
    texts = {text for name in LOG_TEXTS for text in set(columns[name].tolist())}
    log = np.empty(len(columns["t"]), dtype=_dtype(texts))
    for name in LogRecord._fields:
        log[name] = columns[name]
    return log.view(np.recarray)


def is_log(log: Any) -> bool:
    """Return whether an array from a file has the shape and columns of a log."""
    fields: Mapping[str, Any] = log.dtype.fields or {}
    width = int(fields["edge"][0].itemsize) // 4 if "edge" in fields else 1
    return bool(log.ndim == 1 and log.dtype == _of_width(width))


def _dtype(texts: Iterable[str]) -> np.dtype[Any]:
    return _of_width(max([1, *map(len, texts)]))


def _of_width(width: int) -> np.dtype[Any]:
    kinds = {"t": "f8", "element": "i8", **dict.fromkeys(LOG_TEXTS, f"U{width}")}
    return np.dtype([(name, kinds.get(name, "f8")) for name in LogRecord._fields])
