"""From numbers to a record: rows are selected, gaps are filled or left out, the rest is checked.

The same rules hold for files, arrays and data frames; an `Origin` says where a number came from.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ExpressionError, ParameterError, RecordError, UnitError, keyed, shown
from gms_fsm.foundation.arguments import checked_kind, one_of
from gms_fsm.foundation.quantities import convert_numbers
from gms_fsm.language import evaluate, names_in, parse_condition
from gms_fsm.records._columns import LOADS, QUANTITIES
from gms_fsm.records._table import Words
from gms_fsm.records.motion import GAP

FEWEST = 5  # rows of a record
MISSING = ("error", "drop", "interpolate")
DUPLICATES = ("error", "mean")
# What instruments and spreadsheets write where they have no number: its letters, in lower case.
GAP_WORDS = frozenset(
    ["nan", "na", "nv", "div", "null", "none", "nil", "missing", "qnan", "snan", "ind", "inf"]
    + ["ovr", "ovl", "ovld", "ol", "over", "overflow", "overrange", "outofrange", "invalid"]
)
Rows: TypeAlias = NDArray[np.int64]
Chosen: TypeAlias = NDArray[np.bool_]
THOUSANDS = re.compile(r"\s*[-+]?\d{1,3}([ .,'’\u00a0\u202f]\d{3})+([.,]\d*)?\s*")
DECIMAL = re.compile(r"\s*[-+]?\d*([.,])\d+([eE][-+]?\d+)?\s*")


@dataclass(frozen=True)
class Origin:
    """Where numbers come from, in the words of messages.

    Parameters
    ----------
    place : str
        File, or name of the record.
    names : mapping of str to str
        The column of each quantity.
    kind : {"file", "frame", "arrays"}
        Rows of a file count from its first line, those of arrays and frames from 0.
    """

    place: str
    names: Mapping[str, str]
    kind: Literal["file", "frame", "arrays"] = "file"

    def rows(self, numbers: Rows) -> str:
        """Return ``"row 5"``, ``"rows 5, 6"`` or ``"index 5"``."""
        some = ", ".join(str(n) for n in numbers[:5])
        more = f" and {numbers.size - 5} more" if numbers.size > 5 else ""
        if self.kind == "arrays":
            return f"{'indices' if numbers.size > 1 else 'index'} {some}{more}"
        return f"row{'s' if numbers.size > 1 else ''} {some}{more}"

    def cells(self, quantity: str, numbers: Rows) -> str:
        """Return ``"row 5, column 'x'"`` or ``"position, index 5"``."""
        if self.kind == "arrays":
            return f"{quantity}, {self.rows(numbers)}"
        return f"{self.rows(numbers)}, column {shown(self.names[quantity])}"

    def error(self, reason: str, advice: str) -> RecordError:
        """Return an error with this place."""
        return RecordError(reason, place=self.place, advice=advice)


@dataclass(frozen=True, eq=False)
class RecordRows:
    """The rows of a record.

    Parameters
    ----------
    columns : dict of str to ndarray, shape (rows,)
        In SI units.
    chosen : ndarray of bool, shape (rows,)
        The selected rows.
    rows : ndarray of int, shape (rows,)
        Their numbers.
    notes : list of str
        What was left out or filled, and gaps.
    """

    columns: dict[str, FloatArray]
    chosen: Chosen
    rows: Rows
    notes: list[str]

    def only(self, kept: Chosen) -> RecordRows:
        """Return some of the rows."""
        columns = {name: value[kept] for name, value in self.columns.items()}
        return RecordRows(columns, self.chosen[kept], self.rows[kept], self.notes)

    def needed(self, quantity: str) -> Chosen:
        """Return the rows in which a quantity is needed.

        The motion needs every row between the first and the last; forces only in selected rows.
        """
        return self.chosen if quantity in LOADS else np.ones(self.chosen.size, dtype=bool)


@np.errstate(all="ignore")  # overflow is reported as an error
def selected(
    origin: Origin,
    values: dict[str, FloatArray],
    rows: Rows,
    words: Words,
    where: Any = "",
    missing: Any = "error",
    *,
    sort: Any = False,
    duplicates: Any = "error",
) -> RecordRows:
    """Select rows, treat gaps as asked, and check the result."""
    if not isinstance(where, str):
        raise ParameterError("it must be a condition, as a text", place="where", value=where)
    one_of("missing", missing, MISSING)
    one_of("duplicates", duplicates, DUPLICATES)
    checked_kind("sort", sort, bool, "True or False")
    notes: list[str] = []
    if sort:
        values, rows = _sorted(values, rows, notes)
    if duplicates == "mean":
        values, rows = _averaged(values, rows, notes)
    with keyed("where"):
        chosen = _chosen(origin, values, where, rows.size)
    if not chosen.any():
        if words:
            _check_separator(origin, words)
        with keyed("where"):
            raise origin.error(
                f"no row satisfies where = {shown(where)}", "choose another condition"
            )
    part = _from_first_to_last(origin, RecordRows(values, chosen, rows, notes), words, where)
    part = _without_gaps(origin, part, words, missing)
    _check_finite(origin, part, tuple(values))
    _check_size(origin, part)
    part.notes.extend(gaps_in(origin, part.columns["time"], part.rows))
    for array in (*part.columns.values(), part.chosen, part.rows):
        array.flags.writeable = False  # motions of a record are kept
    return part


def _sorted(
    values: dict[str, FloatArray], rows: Rows, notes: list[str]
) -> tuple[dict[str, FloatArray], Rows]:
    """Return the rows in the order of their times, those without one last."""
    order = np.argsort(values["time"], kind="stable")
    moved = int((order != np.arange(rows.size)).sum())
    if moved:
        notes.append(f"{moved} row(s) were sorted by time")
    return {name: value[order] for name, value in values.items()}, rows[order]


def _averaged(
    values: dict[str, FloatArray], rows: Rows, notes: list[str]
) -> tuple[dict[str, FloatArray], Rows]:
    """Return one row for each run of equal times, with the means of what they have."""
    time = values["time"]
    first = np.flatnonzero(np.append(True, np.diff(time) != 0.0))
    if first.size == rows.size:
        return values, rows
    notes.append(f"{rows.size - first.size} row(s) have the time of the one before: means are used")
    found = {}
    for name, value in values.items():
        known = np.isfinite(value)
        sums = np.add.reduceat(np.where(known, value, 0.0), first)
        counts = np.add.reduceat(known.astype(float), first)
        found[name] = np.where(counts > 0.0, sums / np.maximum(counts, 1.0), value[first])
    return found | {"time": time[first].copy()}, rows[first]


def _chosen(origin: Origin, values: Mapping[str, FloatArray], where: str, rows: int) -> Chosen:
    if not where.strip():
        return np.ones(rows, dtype=bool)
    try:
        own = [name for name in values if name not in QUANTITIES]
        condition = parse_condition(convert_numbers(where), (*QUANTITIES, *own))
    except ExpressionError as error:
        in_place = ExpressionError(error.reason, where, error.column, error.allowed)
        raise RecordError(
            f"record.where = {shown(where)}, {in_place}", place=origin.place
        ) from None
    except UnitError as error:
        wrong = RecordError.of(error).inside(f"record.where = {shown(where)}")
        raise wrong.inside(origin.place) from None
    names = sorted(names_in(condition))
    for name in names:
        if name not in values:
            raise origin.error(
                f"where = {shown(where)} uses {name!r}, for which no column is given",
                f"give its column, {name} = {{ column = ..., unit = ... }}, or remove {name}",
            )
    table = zip(*(values[name].tolist() for name in names), strict=True)
    try:
        return np.array(
            [evaluate(condition, dict(zip(names, row, strict=True))) for row in table], dtype=bool
        )
    except (ArithmeticError, ValueError) as error:
        raise origin.error(
            f"where = {shown(where)} cannot be computed in every row ({error})",
            "change it so that it can",
        ) from None


def _from_first_to_last(origin: Origin, part: RecordRows, words: Words, where: str) -> RecordRows:
    """Return the rows between the first and the last selected one that have a motion."""
    first, last = np.flatnonzero(part.chosen)[[0, -1]]
    moving = [value for quantity, value in part.columns.items() if quantity not in LOADS]
    kept = part.chosen | np.isfinite(moving).all(axis=0)
    kept[:first] = kept[last + 1 :] = False
    count = int(part.chosen.sum())
    if count < part.chosen.size:
        part.notes.append(
            f"{count} of {part.chosen.size} rows are selected (where = {shown(where)}); the motion "
            f"uses rows {part.rows[first]} to {part.rows[last]}"
        )
        unused = set(part.rows[~part.chosen].tolist())
        outside = sorted((place for place in words if place[0] in unused), key=lambda at: at[0])
        for number, quantity in outside[:1]:
            part.notes.append(
                f"{len(outside)} cell(s) in rows that are not selected are not numbers, the first "
                f"in row {number}, column {shown(origin.names[quantity])}: "
                f"{shown(words[number, quantity])}"
            )
    without = int(last - first + 1 - kept.sum())
    if without:
        part.notes.append(f"{without} row(s) without time or position are left out")
    return part.only(kept)


# --------------------------------------------------------------------------- gaps
def _without_gaps(origin: Origin, part: RecordRows, words: Words, missing: str) -> RecordRows:
    """Return the rows without empty cells and NaN, as asked.

    Where a force is missing the motion goes on, and nothing is compared; nor is it where the motion
    was filled in.
    """
    _check_words(origin, part, words, missing)
    gaps = {name: np.isnan(value) & part.needed(name) for name, value in part.columns.items()}
    gaps = {name: gap for name, gap in gaps.items() if gap.any()}
    if missing == "error" or not gaps:
        _check_finite(origin, part, ("time",))
        _check_order(origin, part)
        return part
    none = np.zeros(part.rows.size, dtype=bool)
    moving = [gap for name, gap in gaps.items() if name not in LOADS]
    lost = np.logical_or.reduce([none, *moving])
    unmeasured = np.logical_or.reduce([none, *(g for n, g in gaps.items() if n in LOADS)]) & ~lost
    if unmeasured.any():
        part.notes.append(
            f"{int(unmeasured.sum())} row(s) without a force are not compared, "
            f"{origin.rows(part.rows[unmeasured])}"
        )
    part = RecordRows(part.columns, part.chosen & ~unmeasured, part.rows, part.notes)
    if missing == "drop" and lost.any():
        numbers = part.rows[lost]
        part = part.only(~lost)
        part.notes.append(
            f"{numbers.size} row(s) with an empty cell or NaN are left out, {origin.rows(numbers)}"
        )
    if not part.chosen.any():
        raise origin.error("no row is complete", "give a record with some complete rows")
    _check_finite(origin, part, ("time",))
    _check_order(origin, part)
    if missing == "interpolate" and lost.any():
        for quantity, gap in gaps.items():
            if quantity not in LOADS:
                _fill(origin, part, quantity, gap)
        part.notes.append(
            f"{sum(map(int, (gap.sum() for gap in moving)))} empty cell(s) or NaN of the motion "
            f"are interpolated in time and not compared, {origin.rows(part.rows[lost])}"
        )
        part = RecordRows(part.columns, part.chosen & ~lost, part.rows, part.notes)
    return part


def _fill(origin: Origin, part: RecordRows, quantity: str, gap: Chosen) -> None:
    time, value = part.columns["time"], part.columns[quantity]
    good = np.isfinite(value)
    inside = np.logical_or.accumulate(good) & np.logical_or.accumulate(good[::-1])[::-1]
    outside = np.flatnonzero(gap & ~inside)
    if outside.size:
        raise origin.error(
            f"{origin.cells(quantity, part.rows[outside])}: empty or NaN at an end of the record, "
            "where nothing can be interpolated",
            'exclude these rows with where = ..., or give missing = "drop"',
        )
    part.columns[quantity][gap] = np.interp(time[gap], time[good], value[good])


# --------------------------------------------------------------------------- checks
def _check_words(origin: Origin, part: RecordRows, words: Words, missing: str) -> None:
    """Refuse cells that are not numbers in rows where they are needed."""
    if not words:
        return
    needed = {name: set(part.rows[part.needed(name)].tolist()) for name in part.columns}
    wrong = {place: text for place, text in words.items() if place[0] in needed[place[1]]}
    if missing != "error":
        wrong = {place: text for place, text in wrong.items() if not is_gap(text)}
    if not wrong:
        return
    _check_separator(origin, wrong)
    row, quantity = min(wrong, key=lambda place: place[0])
    text = wrong[row, quantity]
    advice = "correct it, or exclude the row with where = ..., a condition that is false there"
    if quantity == "time" and ":" in text:
        advice = "give times in s, for example since the first row"
    if is_gap(text):
        advice += ', or give missing = "drop" or "interpolate"'
    elif THOUSANDS.fullmatch(text):
        advice = "if it is written with a separator of thousands, give it: thousands = ..."
    if origin.kind == "frame" and row == 0:
        advice += (
            "; if it is a line of units, leave it out (pandas.read_csv(..., skiprows=[1])), or let "
            "Record.from_csv read the file"
        )
    raise origin.error(
        f"{origin.cells(quantity, np.array([row]))}: {shown(text)} is not a number", advice
    )


def is_gap(text: str) -> bool:
    """Return whether a cell says that there is no number."""
    letters = re.sub(r"[\W\d_]", "", text).lower()
    return letters in GAP_WORDS or not (letters or any(each.isdigit() for each in text))


def _check_separator(origin: Origin, words: Words) -> None:
    """Refuse a first word that is a number with the other decimal separator."""
    row, quantity = min(words, key=lambda place: place[0])
    found = DECIMAL.fullmatch(words[row, quantity])
    if found is not None:
        what, advice = "a decimal comma", 'give decimal = ","'
        if found.group(1) == ".":
            what, advice = 'a decimal point, but decimal = ","', "leave that option out"
        if origin.kind == "frame":
            advice = 'read the table with decimal = ","'
        if THOUSANDS.fullmatch(words[row, quantity]):
            advice += "; if it separates thousands, thousands = " + shown(found.group(1))
        raise origin.error(
            f"{origin.cells(quantity, np.array([row]))}: {shown(words[row, quantity])} has {what}",
            advice,
        )


def _check_finite(origin: Origin, part: RecordRows, quantities: tuple[str, ...]) -> None:
    for quantity in quantities:
        value = part.columns[quantity]
        bad = np.flatnonzero(~np.isfinite(value) & part.needed(quantity))
        if bad.size:
            advice = (
                "remove the rows, or exclude them with where = ..., a condition that is false there"
                if origin.kind != "arrays"
                else "remove it from all arrays"
            )
            if np.isnan(value[bad]).all():
                advice += ', or give missing = "drop" or "interpolate"'
            raise origin.error(
                f"{origin.cells(quantity, part.rows[bad])}: not a finite number", advice
            )


def _check_order(origin: Origin, part: RecordRows) -> None:
    time = part.columns["time"]
    back = np.flatnonzero(np.diff(time) <= 0)
    for i in back[:1].tolist():
        raise origin.error(
            f"time does not increase after {origin.rows(part.rows[back])} "
            f"({origin.rows(part.rows[[i]])}: {float(time[i])!r} s, next: "
            f"{float(time[i + 1])!r} s)",
            'sort the rows and remove duplicates, or give sort = true, duplicates = "mean"',
        )


def _check_size(origin: Origin, part: RecordRows) -> None:
    if part.rows.size < FEWEST:
        raise origin.error(
            f"only {part.rows.size} rows are used",
            f"at least {FEWEST} are needed (rows are selected with where = ... and missing = ...)",
        )


def gaps_in(origin: Origin, time: FloatArray, numbers: Rows) -> list[str]:
    """Return a note on gaps in time, if there are any."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP * usual)
    if not gaps.size:
        return []
    return [
        f"{gaps.size} gap(s) in time, longer than {GAP:g} median intervals of {usual:.6g} s, after "
        f"{origin.rows(numbers[gaps])} (the longest {steps.max():.6g} s): a fit begins anew behind "
        "each, a run interpolates the motion"
    ]
