"""Traces as NumPy archives (``.npz``): arrays for the rows and the log, and the header as JSON.

Since format 2 the log has codes in place of names, integers are as small as they can be, and the
stops are left out where they are the rows.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gms_fsm.errors import TraceFileError
from gms_fsm.foundation.files import write_whole
from gms_fsm.lowering.layout import SystemLayout
from gms_fsm.lowering.log_columns import CONTACT, LOG_NUMBERS, LOG_TEXTS, LogRecord
from gms_fsm.traces.files.archives import member, write_arrays
from gms_fsm.traces.files.header import FORMATS, Header
from gms_fsm.traces.files.parts import Parts, RunDescription
from gms_fsm.traces.files.unreadable import part_of_a_file
from gms_fsm.traces.firings import Firings
from gms_fsm.traces.rows import Rows

Member = Callable[..., Any]  # name of an array and, optionally, its largest size in bytes


def write(path: Path, parts: Parts) -> Path:
    """Write a trace, completely or not at all."""
    tables = {"rows": parts.rows}
    if parts.stops is not parts.rows:
        tables["stops"] = parts.stops
    header = parts.header.model_copy(update={"format": FORMATS[-1]})
    log = parts.firings
    arrays = {
        **{
            f"{kind}_{name}": _small(value)
            for kind, table in tables.items()
            for name, value in vars(table).items()
        },
        **{f"observed_{name}": parts.stored[place] for name, place in parts.ran.names.items()},
        "log_t": log.t,
        "log_machine": _small(log.machine),
        "log_edge": _small(log.edge),
        "log_numbers": log.numbers,
        "header": np.array(header.model_dump_json()),
    }
    return write_whole(path, lambda file: write_arrays(file, arrays))


def read(path: Path) -> Parts:
    """Read a trace; an array larger than the number of rows allows is rejected."""
    with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
        array = partial(member, file)
        text = str(array("header"))
        with part_of_a_file("header"):
            header = Header.model_validate_json(text)
            ran = RunDescription(header.to_mounted())
        layout = ran.layout
        rows = _table(array, "rows", layout)
        stops = _table(array, "stops", layout) if "stops_t" in file.files else rows
        most = _width(layout) * len(rows)
        stored = {place: array(f"observed_{name}", most) for name, place in ran.names.items()}
        if header.format == FORMATS[0]:
            stops = rows if _equal(rows, stops) else stops
            firings = _coded(array("transitions"), ran)
        else:
            firings = _firings(array, ran)
    return Parts(header, ran, rows, stops, firings, stored)


def _table(array: Member, kind: str, layout: SystemLayout) -> Rows:
    t = array(f"{kind}_t")
    names = [f"{kind}_{name}" for name in ("microstep", "y", "mode")]
    return Rows(t, *(array(name, _width(layout) * t.size) for name in names))


def _width(layout: SystemLayout) -> int:
    """Return the largest number of bytes of an array per row."""
    return 8 * max(layout.y.size, layout.observed.size, layout.modes)


def _firings(array: Member, ran: RunDescription) -> Firings:
    t = array("log_t")
    machine, edge = (array(f"log_{name}", 8 * t.size) for name in ("machine", "edge"))
    numbers = array("log_numbers", 8 * len(LOG_NUMBERS) * t.size)
    return Firings(t, machine, edge, numbers, ran.layout, ran.what.named and t.size > 0)


def _coded(log: Any, ran: RunDescription) -> Firings:
    """Return the firings in the log of a file of format 1, whose names are texts of one width."""
    fields = log.dtype.fields or {}
    width = fields["edge"][0].itemsize // 4 if "edge" in fields else 1
    kinds = {"t": "f8", "element": "i8", **dict.fromkeys((*LOG_TEXTS, CONTACT), f"U{width}")}
    names = [name for name in LogRecord._fields if name in fields or name != CONTACT]
    if log.ndim != 1 or log.dtype != np.dtype([(name, kinds.get(name, "f8")) for name in names]):
        raise TraceFileError("the transition log does not have the columns of a trace")
    columns = {name: log[name].tolist() for name in names}
    return Firings.coded(columns, ran.layout, of_system=ran.what.named)


def _small(array: Any) -> Any:
    """Return integers in as few bytes as they need, and other arrays unchanged."""
    if array.dtype.kind != "i":
        return array
    return array.astype(np.min_scalar_type(array.max(initial=0)))


def _equal(one: Rows, other: Rows) -> bool:
    """Return whether two tables of a file of format 1 are one, bit for bit."""
    pairs = zip(vars(one).values(), vars(other).values(), strict=True)
    return all(a.dtype == b.dtype and a.tobytes() == b.tobytes() for a, b in pairs)
