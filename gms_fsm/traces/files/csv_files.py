"""Traces as text (``.csv``): header and rows in one file, the transition log next to it.

Numbers are printed so that they read back equal. The header stores a hash of the log, so a
process killed between writing the two files cannot leave a mismatched pair.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import TraceFileError
from gms_fsm.foundation.files import folder_lock, leftovers, write_together
from gms_fsm.foundation.text import encoded
from gms_fsm.lowering.log_columns import CONTACT, LOG_NUMBERS, LOG_TEXTS
from gms_fsm.systems.numbers import column_name
from gms_fsm.traces.files.columns import column_title
from gms_fsm.traces.files.header import Header
from gms_fsm.traces.files.parts import Parts, RunDescription
from gms_fsm.traces.firings import Firings
from gms_fsm.traces.rows import Rows

AT_ONCE = 4096  # rows in memory as text or as Python numbers


class Kind(NamedTuple):
    """How the cells of a column are read."""

    convert: Callable[[str], Any]
    dtype: np.dtype[Any]


NUMBER = Kind(float, np.dtype(np.float64))
INTEGER = Kind(int, np.dtype(np.int64))
TEXT = Kind(str, np.dtype(np.str_))


def log_path(path: Path) -> Path:
    """Return the path of the transition log of a trace."""
    return path.with_name(f"{path.stem}.transitions.csv")


def log_texts(firings: Firings) -> Iterator[str]:
    """Return a transition log as CSV text in parts, with elements numbered from 1."""
    for start in range(0, max(1, len(firings)), AT_ONCE):
        log = firings.at(slice(start, start + AT_ONCE)).records
        columns = {name: log[name] for name in log.dtype.names}
        columns["element"] = columns["element"] + 1
        text = io.StringIO()
        _put(text, columns, head=start == 0)
        yield text.getvalue()


def write(
    path: Path, header: Header, parts: Iterable[Mapping[str, NDArray[Any]]], firings: Firings
) -> Path:
    """Write a trace and its log, both completely or neither."""
    stamp = _stamp(log_texts(firings))
    head = json.loads(header.model_copy(update={"log": stamp}).model_dump_json())

    def put_rows(file: IO[bytes]) -> None:
        text = io.TextIOWrapper(file, encoding="utf-8", newline="")
        text.write(f"# {json.dumps(head)}\n")
        for number, columns in enumerate(parts):
            _put(text, columns, head=number == 0)
        text.detach()

    def put_log(file: IO[bytes]) -> None:
        file.writelines(encoded(part) for part in log_texts(firings))

    write_together({path: put_rows, log_path(path): put_log})
    return path


def read(path: Path) -> Parts:
    """Read a trace and its log."""
    with folder_lock(path.parent, shared=True):  # rows and log must come from the same run
        with path.open(encoding="utf-8", newline="") as file:
            header = _header(path, file.readline())
            ran = RunDescription(header.to_mounted())
            table = _read_columns(file, path, 2, lambda head: _kinds(ran, head))
        text = io.StringIO(_log_of(path, header.log))
        log = _read_columns(text, log_path(path), 1, _log_kinds)
    layout, short = ran.layout, not ran.what.named
    rows = _rows(table, ran)
    observed = {}
    for name in ran.names.values():
        title = column_title(layout, name, short=short)
        observed[name] = (
            _block(table, title, len(layout.observed.all_of(name)))
            if name in layout.observed.own
            else table[title]
        )
    log["element"] -= 1
    firings = Firings.coded(log, layout, of_system=ran.what.named)
    return Parts(header, ran, rows, rows, firings, observed)


def _header(path: Path, line: str) -> Header:
    if not line.startswith("# {"):
        reason = "line 1 must be '# ' followed by the trace header"
        advice = "a table of measurements is no trace; name it in the [record] of a scenario"
        if line.startswith("t,element,"):
            reason, advice = "this is a transition log", "pass the trace itself (.npz or .csv)"
        raise TraceFileError(reason, advice=advice).inside(path)
    return Header.model_validate_json(line[2:])


def _kinds(ran: RunDescription, head: Sequence[str]) -> dict[str, Kind]:
    """Return the columns of a trace that are read."""
    layout, short = ran.layout, not ran.what.named
    kinds: dict[str, Kind] = {"t": NUMBER, "microstep": INTEGER}
    for name, i in layout.y:
        title = column_title(layout, name, short=short)
        kinds[title if i is None else column_name(title, i)] = NUMBER
    for name in ran.names.values():
        title = column_title(layout, name, short=short)
        if name in layout.observed.own:
            count = len(layout.observed.all_of(name))
            kinds |= {column_name(title, i): NUMBER for i in range(count)}
        else:
            kinds[title] = NUMBER
    for bank, contact in zip(layout.banks, ran.what.system.machines, strict=True):
        states = {state.name: k for k, state in enumerate(contact.chart.states)}
        title = column_title(layout, bank.of("state"), short=short)
        kind = Kind(states.__getitem__, np.dtype(np.int64))
        kinds |= {column_name(title, i): kind for i in range(bank.n)}
    return kinds | dict.fromkeys(_slides(head), INTEGER)


def _slides(head: Iterable[str]) -> list[str]:
    """Return the columns of the surfaces' flags, which files of older versions lack."""
    count = sum(name.startswith("slides") and name[6:].isdigit() for name in head)
    return [column_name("slides", k) for k in range(count)]


def _log_kinds(head: Sequence[str]) -> dict[str, Kind]:
    """Return the columns of a log."""
    kinds = dict.fromkeys(("t", *LOG_NUMBERS), NUMBER) | {"element": INTEGER}
    return kinds | {name: TEXT for name in (*LOG_TEXTS, CONTACT) if name != CONTACT or name in head}


def _rows(table: Mapping[str, NDArray[Any]], ran: RunDescription) -> Rows:
    layout, short = ran.layout, not ran.what.named
    titles = {name: column_title(layout, name, short=short) for name, _ in layout.y}
    y = [table[titles[name] if i is None else column_name(titles[name], i)] for name, i in layout.y]
    mode = []
    for bank in layout.banks:
        title = column_title(layout, bank.of("state"), short=short)
        mode += [table[column_name(title, i)] for i in range(bank.n)]
    mode += [table[name] for name in _slides(table)]
    return Rows(table["t"], table["microstep"], np.array(y).T, np.array(mode, dtype=np.int64).T)


def _block(table: Mapping[str, NDArray[Any]], name: str, n: int) -> FloatArray:
    return np.array([table[column_name(name, i)] for i in range(n)]).T


def _stamp(parts: Iterable[str]) -> str:
    """Return a short hash of a text in parts that end with a line, independent of line endings."""
    found = hashlib.sha256()
    for number, part in enumerate(parts):
        found.update(("\n" * (number > 0) + "\n".join(part.splitlines())).encode())
    return found.hexdigest()[:16]


def _log_of(path: Path, stamp: str) -> str:
    """Read the text of the transition log that belongs to a trace.

    If the process was killed after the rows were renamed and before the log was, the complete log
    is still there under its temporary name.
    """
    log = log_path(path)
    for place in (log, *leftovers(log)):
        with place.open(encoding="utf-8", newline="") as file:
            text = file.read()
        if stamp in ("", _stamp([text])):
            return text
    raise TraceFileError(
        f"it belongs to a different run than {path.name}, or it was changed",
        advice="keep the two files together",
    ).inside(log)


def _put(text: IO[str], columns: Mapping[str, NDArray[Any]], *, head: bool) -> None:
    writer = csv.writer(text, lineterminator="\n")
    if head:
        writer.writerow(columns)
    # Numbers are printed by the writer, as `repr` does.
    writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def _read_columns(
    file: IO[str], path: Path, line: int, kinds_of: Callable[[Sequence[str]], Mapping[str, Kind]]
) -> dict[str, NDArray[Any]]:
    """Read the columns that `kinds_of` names; they must be there."""
    reader = csv.reader(file)
    head = next(reader, None)
    if not head:
        raise TraceFileError("it must contain the column names", place=f"line {line}").inside(path)
    kinds = kinds_of(head)
    places = {name: k for k, name in enumerate(head)}
    parts: dict[str, list[NDArray[Any]]] = {
        name: [np.empty(0, kind.dtype)] for name, kind in kinds.items()
    }
    while rows := list(islice(reader, AT_ONCE)):
        for row in rows:
            line += 1
            if len(row) != len(head):
                raise TraceFileError(
                    f"it has {len(row)} cells, but the header has {len(head)}", place=f"line {line}"
                ).inside(path)
        cells = list(zip(*rows, strict=True))
        for name, (convert, dtype) in kinds.items():
            try:
                parts[name].append(np.array([convert(cell) for cell in cells[places[name]]], dtype))
            except (ValueError, OverflowError):
                what = "whole number" if dtype.kind == "i" else "number"
                raise TraceFileError(f"a cell is not a {what}", place=f"column {name}") from None
    return {name: np.concatenate(blocks) for name, blocks in parts.items()}
