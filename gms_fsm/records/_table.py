"""Text tables as instruments and spreadsheets write them: where the header is, what the cells hold.

A file is read once, line by line, and no line can fill the memory. What was found (a header further
down, a line of units) is noted.
"""

from __future__ import annotations

import codecs
import csv
import datetime
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ParameterError, RecordError, cut, shown
from gms_fsm.foundation.arguments import meant, no_file
from gms_fsm.foundation.quantities import COLUMN_UNITS, plain
from gms_fsm.records._columns import RENAME, Column

LONGEST_LINE = 100_000  # characters
LONGEST_FILE = 5_000_000  # rows
SEARCHED = 200  # lines in which a header is looked for
DELIMITERS = "\t;,| "
THOUSANDS = ",. '’"
# By its first bytes; other encodings have to be given.
MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}

Words: TypeAlias = dict[tuple[int, str], str]  # cells that are not numbers, by row and quantity
Lines: TypeAlias = Iterator[tuple[int, str]]  # with their numbers; the first is 1


@dataclass(frozen=True)
class TextFormat:
    """How a text table is written.

    Parameters
    ----------
    delimiter : str, optional
        One character between the columns; by default the one that gives the named columns.
    decimal : str
        ``"."`` or ``","``.
    comment : tuple of str
        What a comment line begins with.
    header : int, optional
        The row of the column names; by default the first that has those asked for.
    encoding : str, optional
        By default UTF-8, or UTF-16 if the file begins with a byte order mark.
    thousands : str, optional
        What separates thousands.
    columns : tuple of str, optional
        The names of the columns of a table without a header.
    """

    delimiter: str | None = None
    decimal: str = "."
    comment: tuple[str, ...] = ("#", "%")
    header: int | None = None
    encoding: str | None = None
    thousands: str | None = None
    columns: tuple[str, ...] | None = None

    @classmethod
    def of(
        cls,
        delimiter: Any,
        decimal: Any,
        comment: Any,
        header: Any,
        encoding: Any,
        thousands: Any = None,
        columns: Any = None,
    ) -> TextFormat:
        """Return the format with these options, checked."""
        named = isinstance(columns, Iterable) and not isinstance(columns, str)
        names: tuple[Any, ...] = tuple(columns) if named else ()
        marks = (comment,) if isinstance(comment, str) else comment
        try:
            marks = tuple(marks)
        except TypeError:
            marks = (None,)
        row = isinstance(header, int) and not isinstance(header, bool) and header > 0
        wanted = {
            "delimiter": (
                delimiter is None or (isinstance(delimiter, str) and _divides(delimiter)),
                "one character that can stand between columns",
            ),
            "decimal": (decimal in (".", ","), "'.' or ','"),
            "comment": (
                all(isinstance(mark, str) and mark for mark in marks),
                "a text that comment lines begin with, or several",
            ),
            "header": (header is None or row, "the number of a row, 1 or more"),
            "encoding": (
                encoding is None or _is_encoding(encoding),
                "an encoding of text, for example 'cp1252', 'latin-1' or 'utf-16'",
            ),
            "thousands": (
                thousands is None or (thousands in tuple(THOUSANDS) and thousands != decimal),
                "a comma, a point, a blank or an apostrophe, and not the decimal separator",
            ),
            "columns": (
                columns is None or (bool(names) and all(isinstance(each, str) for each in names)),
                "the names of all columns, for example ['t', 'x', 'F']",
            ),
        }
        given = {"delimiter": delimiter, "decimal": decimal, "comment": comment}
        given |= {"header": header, "encoding": encoding}
        given |= {"thousands": thousands, "columns": columns}
        for name, (fits, what) in wanted.items():
            if not fits:
                raise ParameterError(f"it must be {what}", place=name, value=given[name])
        return cls(delimiter, decimal, marks, header, encoding, thousands, names or None)

    def number(self, text: str) -> float:
        """Return the number of a cell; raise a `ValueError` for a word."""
        if self.thousands:
            every = r"[\s\u00a0\u202f]" if self.thousands == " " else f"[{self.thousands}]"
            if re.search(every, text.strip()):
                whole, _, _rest = text.strip().partition(self.decimal)
                if not re.fullmatch(rf"[-+]?\d{{1,3}}({every}\d{{3}})+", whole):
                    raise ValueError
                text = re.sub(every, "", whole) + text.strip()[len(whole) :]
        return number(text, self.decimal)

    def cells(self, lines: Iterable[str], delimiter: str) -> Iterator[list[str]]:
        """Return the cells of lines."""
        if delimiter == " ":  # any number of them
            lines = (line.strip() for line in lines)
        return csv.reader(lines, delimiter=delimiter, skipinitialspace=delimiter == " ")

    def commented(self, line: str) -> bool:
        """Return whether a line is a comment."""
        return line.lstrip().startswith(self.comment)


def _divides(delimiter: str) -> bool:
    return len(delimiter) == 1 and delimiter not in '\r\n"'


def _is_encoding(name: Any) -> bool:
    try:
        " ".encode(name)
    except (LookupError, TypeError, ValueError):  # unknown or of bytes, no text, a null in it
        return False
    return True


def _is_utf_8(encoding: str) -> bool:
    """Return whether it is the usual encoding, which may begin with a mark all the same."""
    return codecs.lookup(encoding).name == "utf-8"


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of the columns asked for.

    Parameters
    ----------
    numbers : mapping of str to ndarray, shape (rows,)
        By quantity; NaN where the cell is not a number.
    rows : ndarray of int, shape (rows,)
        The number of each row in the file.
    words : dict
        Cells that are not numbers, by row and quantity.
    notes : tuple of str
        What was found in the file.
    """

    numbers: Mapping[str, FloatArray]
    rows: NDArray[np.int64]
    words: Words
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Head:
    """A line that may be the header."""

    row: int
    names: list[str]
    delimiter: str

    def found(self, columns: Mapping[str, Column]) -> int:
        """Return how many of the columns it has."""
        return sum(column.name in self.names for column in columns.values())


def read_cells(path: Path, columns: Mapping[str, Column], form: TextFormat) -> Cells:
    """Read the named columns of a text table."""
    lines = _lines(path, form.encoding)
    if form.columns is None:
        head = _head(path, lines, columns, form)
    else:
        head, lines = _given_head(path, lines, form)
    places = _places(path, head, columns)
    notes = [f"the header is row {head.row}; the rows above are not read"] if head.row > 1 else []
    rows = _rows(path, lines, head, form)
    first = next(rows, None)
    if first is not None and (said := _units(path, first, columns, places)):
        notes.append(said)
    elif first is not None:
        rows = chain([first], rows)
    numbers: list[int] = []
    found: dict[str, list[float]] = {quantity: [] for quantity in columns}
    words: Words = {}
    clock = _Clock()
    for at, row in rows:
        numbers.append(at)
        for quantity, place in places.items():
            try:
                found[quantity].append(form.number(row[place]))
            except ValueError:
                seconds = clock.seconds(row[place]) if quantity == "time" else math.nan
                found[quantity].append(seconds)
                if math.isnan(seconds):
                    words[at, quantity] = cut(row[place])
    if clock.first is not None:
        if columns["time"].unit != "s" or clock.count < len(numbers) - len(words):
            raise RecordError(
                f"column {shown(columns['time'].name)} has times of a clock"
                + (" and numbers" if columns["time"].unit == "s" else ""),
                place=str(path),
                advice="write one kind of times; those of a clock are read without a unit",
                key=("time",),
            )
        notes.append("the times are those of a clock; they count from the first row")
    if len(numbers) < 2:
        raise RecordError(
            f"{len(numbers)} row(s) of data", place=str(path), advice="at least 2 are needed"
        )
    values = {quantity: np.array(each) for quantity, each in found.items()}
    return Cells(values, np.array(numbers), words, tuple(notes))


class _Clock:
    """Times of a clock, ISO 8601 or hh:mm:ss, as seconds since the first."""

    def __init__(self) -> None:
        self.first: datetime.datetime | None = None
        self.count = 0

    def seconds(self, text: str) -> float:
        """Return the seconds since the first time; NaN for what is no time."""
        text = text.strip().replace(",", ".")
        if text.count(":") < 1:
            return math.nan
        if re.fullmatch(r"\d{1,2}:\d\d(:\d\d(\.\d*)?)?", text):
            text = f"2000-01-01T{text.zfill(len(text) + (text.index(':') < 2))}"
        try:
            now = datetime.datetime.fromisoformat(text)
            self.first = now if self.first is None else self.first
            found = (now - self.first).total_seconds()
        except (ValueError, TypeError):  # no time, or one with a zone and one without
            return math.nan
        self.count += 1
        return found


# --------------------------------------------------------------------------- lines
def _lines(path: Path, encoding: str | None) -> Lines:
    """Yield lines of bounded length, so that a single line cannot fill the memory."""
    found, number = _encoding_of(path), 0
    known = found if encoding is None or _is_utf_8(encoding) else encoding
    try:
        # Bytes that are no text become surrogates, so that the line they are in can be named.
        with path.open(encoding=known, errors="surrogateescape") as text:
            while line := text.readline(LONGEST_LINE + 1):
                number += 1
                _check_line(path, number, line, known)
                yield number, line
    except OSError as error:
        raise RecordError(f"cannot be read ({error.strerror})", place=str(path)) from None
    except UnicodeError:  # of an encoding with several bytes to a character
        raise _no_text(path, f"a line after line {number}", known) from None


def _encoding_of(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return MARKS.get(file.read(2), "utf-8-sig")
    except FileNotFoundError:
        raise no_file(path, RecordError) from None
    except OSError as error:
        raise RecordError(f"cannot be read ({error.strerror})", place=str(path)) from None
    except ValueError:  # it has a null in it
        raise RecordError("this is not a file name", place=shown(str(path))) from None


def _check_line(path: Path, number: int, line: str, encoding: str) -> None:
    if len(line) > LONGEST_LINE:
        raise RecordError(
            f"line {number} is longer than {LONGEST_LINE} characters",
            place=str(path),
            advice="this is not a table with one row per line",
        )
    if number > LONGEST_FILE:
        raise RecordError(
            f"more than {LONGEST_FILE} rows",
            place=str(path),
            advice="reduce the number of rows first",
        )
    if "\0" in line:
        raise RecordError(
            f"line {number} contains binary data",
            place=str(path),
            advice="save it as a text table (CSV, TSV); if it is UTF-16 without a byte order mark, "
            'give encoding = "utf-16-le"',
        )
    if not line.isascii() and any("\udc80" <= each <= "\udcff" for each in line):
        raise _no_text(path, f"line {number}", encoding)


def _no_text(path: Path, where: str, encoding: str) -> RecordError:
    name = "UTF-8" if encoding == "utf-8-sig" else encoding
    return RecordError(
        f"{where} is not {name} text",
        place=str(path),
        advice='save the table as UTF-8 CSV, or give its encoding, for example encoding = "cp1252" '
        '(Windows) or encoding = "latin-1"',
    )


# --------------------------------------------------------------------------- the header
def _head(path: Path, lines: Lines, columns: Mapping[str, Column], form: TextFormat) -> _Head:
    """Return the header; if there is none, the line that has most of the columns."""
    best: _Head | None = None
    for number, line in lines:
        if form.header is not None and number < form.header:
            continue
        for head in _readings(number, line, form):
            if best is None or head.found(columns) > best.found(columns):
                best = head
            if head.found(columns) == len(columns):
                return head
        if number in (SEARCHED, form.header):
            break
    if best is None:
        what = "the file is empty" if form.header is None else f"there is no row {form.header}"
        raise RecordError(what, place=str(path), advice="a row must contain the column names")
    return best


def _given_head(path: Path, lines: Lines, form: TextFormat) -> tuple[_Head, Lines]:
    """Return a header of given names, and the lines below it with the first row of numbers."""
    assert form.columns is not None
    for number, line in lines:
        if number <= (form.header or 0) or not line.strip() or form.commented(line):
            continue
        for head in _readings(number, line, form):
            if len(head.names) == len(form.columns):
                given = _Head(number - 1, list(form.columns), head.delimiter)
                return given, chain([(number, line)], lines)
        counts = sorted({len(head.names) for head in _readings(number, line, form)})
        raise RecordError(
            f"row {number} has {' or '.join(map(str, counts))} cells, and columns names "
            f"{len(form.columns)}",
            place=str(path),
            advice="name every column, or give their separator: delimiter = ...",
        )
    raise RecordError("the file is empty", place=str(path), advice="it must have rows of numbers")


def _readings(number: int, line: str, form: TextFormat) -> Iterator[_Head]:
    """Yield the ways to read a line as a header; that of a program may be a comment."""
    if not line.strip():
        return
    texts = [line]
    if form.commented(line):
        mark = max((m for m in form.comment if line.lstrip().startswith(m)), key=len)
        texts.insert(0, line.lstrip().removeprefix(mark))
    for text in texts:
        likely = sorted(DELIMITERS, key=lambda each: each == " " or -text.count(each))
        if any(each in text for each in likely if each != " "):
            likely.remove(" ")  # it is in the names, as in "x [mm]"
        for delimiter in [form.delimiter] if form.delimiter else likely:
            names = [name.strip() for name in next(form.cells([text], delimiter), [])]
            while names and not names[-1]:  # a separator at the end
                names.pop()
            yield _Head(number, names, delimiter)


def _places(path: Path, head: _Head, columns: Mapping[str, Column]) -> dict[str, int]:
    for quantity, column in columns.items():
        if head.names.count(column.name) != 1:
            what = "no column" if column.name not in head.names else "several columns"
            or_none = "" if quantity == "time" else " or None"
            advice = (
                f"name the right one: {quantity} = {{ column = ..., unit = ... }} in a scenario, "
                f"{quantity}=(name, unit){or_none} in Python"
            )
            if column.name in head.names:
                advice = RENAME
            else:
                advice = meant(column.name, head.names) + advice
            if not any(each.isalpha() for each in "".join(head.names) if each not in "eE"):
                advice = "the table has no names: give them, columns = ['t', 'x', ...]"
            elif len(head.names) == 1:
                advice = "if these are several columns, give their separator: delimiter = ..."
            if not head.found(columns):
                advice += "; if the names are in another row, give its number: header = ..."
            raise RecordError(
                f"{what} {shown(column.name)} (for {quantity})",
                place=str(path),
                advice=f"columns in row {head.row}: "
                f"{cut(', '.join(map(repr, head.names)), 1000)}; {advice}",
                key=(quantity,),
            )
    return {quantity: head.names.index(column.name) for quantity, column in columns.items()}


# --------------------------------------------------------------------------- rows
def _rows(
    path: Path, lines: Lines, head: _Head, form: TextFormat
) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows below the header with their numbers."""
    taken: list[int] = []  # lines of the row that is being read: a quoted cell may span several

    def counted() -> Iterator[str]:
        for number, line in lines:
            if not form.commented(line):
                taken.append(number)
                yield line

    rows = form.cells(counted(), head.delimiter)
    last = empty = 0  # the last row with cells, and the first empty one below it
    while True:
        taken.clear()
        try:
            row = next(rows, None)
        except csv.Error as error:
            raise RecordError(
                f"row {min(taken)} cannot be read ({error})", place=str(path)
            ) from None
        if row is None:
            return
        number = min(taken)
        if not any(cell.strip() for cell in row):
            empty = empty or number
            continue
        if empty and last:  # the table may end here, and another one begin
            raise RecordError(f"row {empty} is empty", place=str(path), advice="remove it")
        last, empty = number, 0
        columns = len(head.names)
        if len(row) < columns or any(cell.strip() for cell in row[columns:]):
            raise RecordError(
                f"row {number} has {len(row)} cells, but the header has {columns}",
                place=str(path),
                advice="make them equal, or give the separator of the columns: delimiter = ...; "
                'numbers with a decimal comma need another separator, and decimal = ","',
            )
        yield number, row


def number(text: str, decimal: str) -> float:
    """Return the number of a cell; raise a `ValueError` for a word."""
    if "_" in text:  # 0.0_3 is a number in Python, but not in a record
        raise ValueError
    if decimal == ",":
        if "." in text:  # 1.234,5 or a point after all: not to be guessed
            raise ValueError
        text = text.replace(",", ".")
    return float(text)


def _units(
    path: Path,
    first: tuple[int, list[str]],
    columns: Mapping[str, Column],
    places: Mapping[str, int],
) -> str:
    """Return a note if the first row below the header holds units; empty if it does not."""
    number, row = first
    cells = {
        quantity: row[place].strip().strip("[]()").strip() for quantity, place in places.items()
    }
    known = {unit for units in COLUMN_UNITS.values() for unit in units}
    if not any(plain(cell) in known for cell in cells.values()) or any(
        map(_is_number, cells.values())
    ):
        return ""
    for quantity, cell in cells.items():
        column = columns[quantity]
        other = plain(cell) in known and plain(cell) != plain(column.unit)
        if other:
            raise RecordError(
                f"row {number} gives the unit {shown(cell)} for column {shown(column.name)}, but "
                f"{quantity} is read in {shown(column.unit)}",
                place=str(path),
                advice="give the right unit, or correct the row",
                key=(quantity,),
            )
    return f"row {number} is a line of units: {', '.join(cells.values())}"


def _is_number(text: str) -> bool:
    try:
        number(text.replace(",", "."), ".")
    except ValueError:
        return False
    return True
