"""Traces as text (``.csv``): header and rows in one file, the transition log next to it.

Numbers are printed so that they read back equal. The header stores a hash of the log, so a
process killed between writing the two files cannot leave a mismatched pair.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm._files import folder_lock, leftovers, write_together
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import TraceFileError
from gms_fsm.lowering.log_columns import CONTACT, LOG_NUMBERS, LOG_TEXTS
from gms_fsm.traces._columns import column_title
from gms_fsm.traces._header import Header
from gms_fsm.traces._log import log_from
from gms_fsm.traces._parts import Parts, Ran
from gms_fsm.traces.rows import Rows, column_name

__all__ = ["log_path", "log_text", "read", "write"]


def log_path(path: Path) -> Path:
    """Return the path of the transition log of a trace."""
    return path.with_name(f"{path.stem}.transitions.csv")


def log_text(log: Any) -> str:
    """Return a transition log as CSV text, with elements numbered from 1."""
    names = log.dtype.names
    rows = (
        [_cell(name, value) for name, value in zip(names, record, strict=True)]
        for record in log.tolist()
    )
    return _text(names, rows)


def write(path: Path, header: Header, columns: Mapping[str, NDArray[Any]], log: Any) -> Path:
    """Write a trace and its log, both completely or neither."""
    its_log = log_text(log)
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    head = json.loads(header.model_copy(update={"log": _stamp(its_log)}).model_dump_json())
    cells = ([_cell("", value) for value in row] for row in rows)
    text = f"# {json.dumps(head)}\n" + _text(columns, cells)
    write_together(
        {
            path: lambda file: file.write(text.encode()),
            log_path(path): lambda file: file.write(its_log.encode()),
        }
    )
    return path


def read(path: Path) -> Parts:
    """Read a trace and its log."""
    with folder_lock(path.parent, shared=True):  # rows and log must come from the same run
        with path.open(encoding="utf-8", newline="") as file:
            header = _header(path, file.readline())
            table = _read_columns(file, path, 2)
        log = _read_columns(io.StringIO(_log_of(path, header.log)), log_path(path), 1)
    ran = Ran.of(header)
    layout, short = ran.layout, ran.system is None
    rows = _rows(table, ran)
    observed = {}
    for name in ran.names.values():
        title = column_title(layout, name, short=short)
        observed[name] = (
            _block(table, title, len(layout.observed.all_of(name)))
            if name in layout.observed.own
            else _numbers(table, title)
        )
    return Parts(header, ran, rows, rows, _log(log), observed)


def _header(path: Path, line: str) -> Header:
    if not line.startswith("# {"):
        reason = "line 1 must be '# ' followed by the trace header"
        if line.startswith("t,element,"):
            reason = "this is a transition log; pass the trace itself (.npz or .csv)"
        raise TraceFileError(reason).inside(path)
    return Header.model_validate_json(line[2:])


def _rows(table: Mapping[str, list[str]], ran: Ran) -> Rows:
    layout, short = ran.layout, ran.system is None
    titles = {name: column_title(layout, name, short=short) for name, _ in layout.y}
    y = [
        _numbers(table, titles[name] if i is None else column_name(titles[name], i))
        for name, i in layout.y
    ]
    mode = []
    for bank, contact in zip(layout.banks, ran.whole.contacts, strict=True):
        states = {state.name: k for k, state in enumerate(contact.chart.states)}
        title = column_title(layout, bank.of("state"), short=short)
        mode += [[states[cell] for cell in table[column_name(title, i)]] for i in range(bank.n)]
    slid = sum(name.startswith("slides") and name[6:].isdigit() for name in table)
    mode += [[int(c) for c in table[column_name("slides", k)]] for k in range(slid)]
    return Rows(
        _numbers(table, "t"),
        np.array([int(c) for c in table["microstep"]], dtype=np.int64),
        np.array(y).T,
        np.array(mode, dtype=np.int64).T,
    )


def _numbers(table: Mapping[str, list[str]], name: str) -> FloatArray:
    return np.array([float(cell) for cell in table[name]])


def _block(table: Mapping[str, list[str]], name: str, n: int) -> FloatArray:
    return np.array([_numbers(table, column_name(name, i)) for i in range(n)]).T


def _log(table: Mapping[str, list[str]]) -> Any:
    columns: dict[str, NDArray[Any]] = {name: _numbers(table, name) for name in ("t", *LOG_NUMBERS)}
    columns["element"] = np.array([int(cell) - 1 for cell in table["element"]])
    texts = [name for name in (*LOG_TEXTS, CONTACT) if name in table]
    columns |= {name: np.array(table[name], dtype=np.str_) for name in texts}
    return log_from(columns)


def _stamp(text: str) -> str:
    """Return a short hash of a text, independent of its line endings."""
    return hashlib.sha256("\n".join(text.splitlines()).encode()).hexdigest()[:16]


def _log_of(path: Path, stamp: str) -> str:
    """Read the text of the transition log that belongs to a trace.

    If the process was killed after the rows were renamed and before the log was, the complete log
    is still there under its temporary name.
    """
    log = log_path(path)
    for place in (log, *leftovers(log)):
        with place.open(encoding="utf-8", newline="") as file:
            text = file.read()
        if stamp in ("", _stamp(text)):
            return text
    raise TraceFileError(
        f"it belongs to a different run than {path.name}, or it was changed",
        advice="keep the two files together",
    ).inside(log)


def _cell(name: str, value: Any) -> str:
    if name == "element":
        return str(value + 1)
    return repr(value) if isinstance(value, float) else str(value)


def _text(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return text.getvalue()


def _read_columns(file: IO[str], path: Path, line: int) -> dict[str, list[str]]:
    reader = csv.reader(file)
    head = next(reader, None)
    if not head:
        raise TraceFileError("it must contain the column names", place=f"line {line}").inside(path)
    rows = list(reader)
    for number, row in enumerate(rows, start=line + 1):
        if len(row) != len(head):
            raise TraceFileError(
                f"it has {len(row)} cells, but the header has {len(head)}", place=f"line {number}"
            ).inside(path)
    return {name: [row[j] for row in rows] for j, name in enumerate(head)}
