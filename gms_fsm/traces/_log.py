"""The transition log as a record array, with the columns of `LogRecord`."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gms_fsm._display import displayed
from gms_fsm.lowering.log_columns import CONTACT, LOG_TEXTS, LogRecord

__all__ = ["Log", "is_log", "log_from", "log_of"]


@displayed("html")
class Log(np.recarray[Any, Any]):
    """A record array that notebooks show as a table of its first rows.

    In every other respect it is a `numpy.recarray`.

    Examples
    --------
    >>> records = np.array([(0.5, "slip"), (0.7, "stick")], dtype=[("t", "f8"), ("to", "U5")])
    >>> log = records.view(Log)
    >>> log
    <2 records of t, to>
    >>> log.to.tolist(), log[log.t > 0.6]
    (['slip', 'stick'], <1 record of t, to>)
    """

    def __repr__(self) -> str:
        names = self.dtype.names
        if names is None or self.ndim != 1:
            return repr(self.view(np.ndarray))
        return f"<{len(self)} record{'s' * (len(self) != 1)} of {', '.join(names)}>"


def log_of(records: Iterable[LogRecord]) -> Any:
    """Return firings as a record array with the columns of `Trace.transitions`."""
    rows = list(records)
    columns = {name: np.array([getattr(row, name) for row in rows]) for name in LogRecord._fields}
    if not any(row.contact for row in rows):
        del columns[CONTACT]
    return log_from(columns)


def log_from(columns: Mapping[str, Any]) -> Any:
    """Return columns, given by name, as the record array of `Trace.transitions`."""
    texts = [name for name in (*LOG_TEXTS, CONTACT) if name in columns]
    width = max([1, *(len(text) for name in texts for text in set(columns[name].tolist()))])
    log = np.empty(len(columns["t"]), dtype=_of_width(width, CONTACT in columns))
    for name in log.dtype.names:
        log[name] = columns[name]
    return log.view(Log)


def is_log(log: Any) -> bool:
    """Return whether an array from a file has the shape and columns of a log."""
    fields: Mapping[str, Any] = log.dtype.fields or {}
    width = int(fields["edge"][0].itemsize) // 4 if "edge" in fields else 1
    return bool(log.ndim == 1 and log.dtype == _of_width(width, CONTACT in fields))


@functools.cache
def _of_width(width: int, contacts: bool) -> np.dtype[Any]:
    kinds = {"t": "f8", "element": "i8", **dict.fromkeys((*LOG_TEXTS, CONTACT), f"U{width}")}
    names = [name for name in LogRecord._fields if contacts or name != CONTACT]
    return np.dtype([(name, kinds.get(name, "f8")) for name in names])
