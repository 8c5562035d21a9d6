"""Measured records: text tables, read into SI arrays by column and unit.

Every row used must be complete and in time order, gaps are reported by row, and a velocity derived
from positions comes with a note on its smoothing.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_smoothing_spline

from gms_fsm.app.units import convert_numbers, factor
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ExpressionError, RecordError, UnitError, cut, shown
from gms_fsm.language import evaluate, names_in, parse_condition

__all__ = ["Column", "Motion", "Record", "motion_of", "read_record"]

QUANTITIES = ("time", "position", "velocity", "force", "normal")
LONGEST_LINE = 100_000  # characters
LONGEST_FILE = 5_000_000  # rows
STRETCH = 40  # rows per interval when searching for standstill
GAP = 5.0  # time steps longer than this many median steps are reported


LOADS = ("force", "normal")  # needed only in selected rows; motion is needed in between too
Words: TypeAlias = dict[tuple[int, str], str]  # cells that are not numbers, by row and quantity


@dataclass(frozen=True)
class Column:
    """The column of a quantity in a table.

    Parameters
    ----------
    name : str
        Name in the header line.
    unit : str
        Unit, for example ``"mm"``.
    sign : int
        -1 to reverse the sign of the quantity.
    """

    name: str
    unit: str
    sign: int = 1


@dataclass(frozen=True, eq=False)
class Record:
    """A measured record in SI units.

    Parameters
    ----------
    path : Path
        The file.
    columns : mapping of str to ndarray, shape (rows,)
        ``time`` and any of ``position``, ``velocity``, ``force``, ``normal``.
    chosen : ndarray of bool, shape (rows,)
        The selected rows; the motion runs from the first to the last of them.
    first_row : int
        Number of the first row in the file (the header line is row 1).
    notes : tuple of str
        Notes for the user: gaps, rows left out.
    """

    path: Path
    columns: Mapping[str, FloatArray]
    chosen: NDArray[np.bool_]
    first_row: int
    notes: tuple[str, ...]

    def __len__(self) -> int:
        return int(self.columns["time"].size)


@np.errstate(all="ignore")  # overflow is reported as an error
def read_record(
    path: str | Path, columns: Mapping[str, Column], where: str = "", delimiter: str | None = None
) -> Record:
    """Read a CSV or TSV table.

    Parameters
    ----------
    path : str or Path
        The file; its first line has the column names.
    columns : mapping of str to Column
        For ``time`` and any of ``position``, ``velocity``, ``force``, ``normal``.
    where : str, optional
        Condition on the quantities that selects rows, for example ``"normal > 4.5 N"``. It is
        evaluated first: a cell in a row that is not selected need not be a number.
    delimiter : str, optional
        One character; by default tab, semicolon or comma is detected.

    Returns
    -------
    Record
        The record in SI units, from the first to the last selected row, without unselected rows
        that have no time or no position.

    Raises
    ------
    RecordError
        If the file is missing or not text, a column is missing, a cell is not a finite number, time
        decreases, or no row is selected. The message names file, row, column and what to do.
    """
    path = Path(path)
    if "time" not in columns:
        raise RecordError("no column is given for 'time'", place=str(path))
    cells, words = _read_cells(path, columns, delimiter)
    values = {
        quantity: column.sign * factor(quantity, column.unit) * cells[quantity]
        for quantity, column in columns.items()
    }
    rows = next(iter(values.values())).size
    chosen = _chosen(path, values, where, rows)
    if not chosen.any():
        raise RecordError(
            f"no row satisfies where = {shown(where)}",
            place=str(path),
            advice="choose another condition",
        )
    first, last = np.flatnonzero(chosen)[[0, -1]]
    moving = [value for quantity, value in values.items() if quantity not in LOADS]
    kept = chosen | np.isfinite(moving).all(axis=0)
    kept[:first] = kept[last + 1 :] = False
    numbers = np.flatnonzero(kept) + 2
    part = {quantity: value[kept] for quantity, value in values.items()}
    selected, chosen = chosen, chosen[kept]
    _check(path, columns, part, chosen, numbers, words)
    notes = []
    if not selected.all():
        notes.append(
            f"{int(chosen.sum())} of {rows} rows are selected (where = {shown(where)}); the motion "
            f"uses rows {first + 2} to {last + 2}"
        )
    if words:
        row, quantity = min(words, key=lambda place: place[0])
        notes.append(
            f"{len(words)} cell(s) in rows that are not selected are not numbers, the first in row "
            f"{row}, column {shown(columns[quantity].name)}: {shown(words[row, quantity])}"
        )
    if last - first + 1 > numbers.size:
        notes.append(
            f"{last - first + 1 - numbers.size} row(s) without time or position are left out"
        )
    notes += _gaps(part["time"], numbers)
    return Record(path, part, chosen, int(first) + 2, tuple(notes))


# --------------------------------------------------------------------------- reading
def _lines(path: Path) -> Iterator[str]:
    """Yield lines of bounded length, so that a single line cannot fill the memory."""
    try:
        with path.open("rb") as file:
            number = 0
            while line := file.readline(LONGEST_LINE + 1):
                number += 1
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
                if b"\0" in line:
                    raise RecordError(
                        f"line {number} contains binary data",
                        place=str(path),
                        advice="give a text table (CSV or TSV)",
                    )
                try:
                    yield line.decode("utf-8-sig" if number == 1 else "utf-8")
                except UnicodeDecodeError:
                    raise RecordError(
                        f"line {number} is not UTF-8 text",
                        place=str(path),
                        advice="save the table as UTF-8 CSV",
                    ) from None
    except FileNotFoundError:
        raise RecordError(
            "no such file", place=str(path), advice="check the name and the folder"
        ) from None
    except OSError as error:
        raise RecordError(f"cannot be read ({error.strerror})", place=str(path)) from None


def _read_cells(
    path: Path, columns: Mapping[str, Column], delimiter: str | None
) -> tuple[dict[str, FloatArray], Words]:
    """Return the numbers, with NaN for other cells, and the texts of those cells."""
    lines = _lines(path)
    head_line = next(lines, "")
    if not head_line.strip():
        raise RecordError(
            "line 1 is empty", place=str(path), advice="it must contain the column names"
        )
    if delimiter is None:
        delimiter = max("\t;,", key=head_line.count)
    head = [name.strip() for name in next(csv.reader([head_line], delimiter=delimiter))]
    places = {}
    for quantity, column in columns.items():
        if head.count(column.name) != 1:
            what = "no column" if column.name not in head else "several columns"
            advice = f"name the right one: {quantity} = {{ column = ... }}"
            if len(head) == 1:
                advice = "if these are several columns, give their separator: delimiter = ..."
            raise RecordError(
                f"{what} {shown(column.name)} (for {quantity})",
                place=str(path),
                advice=f"columns: {cut(', '.join(map(repr, head)), 1000)}; {advice}",
            )
        places[quantity] = head.index(column.name)
    found: dict[str, list[float]] = {quantity: [] for quantity in columns}
    words: Words = {}
    number = 1
    try:
        for row in csv.reader(lines, delimiter=delimiter):
            number += 1
            if not any(cell.strip() for cell in row):
                raise RecordError(f"row {number} is empty", place=str(path), advice="remove it")
            if len(row) != len(head):
                raise RecordError(
                    f"row {number} has {len(row)} cells, but the header has {len(head)}",
                    place=str(path),
                    advice="make them equal, or give the separator of the columns: delimiter = "
                    "... (a decimal comma is not supported; use a point)",
                )
            for quantity, place in places.items():
                try:
                    if "_" in row[place]:  # 0.0_3 is a number in Python, but not in a record
                        raise ValueError
                    found[quantity].append(float(row[place]))
                except ValueError:
                    found[quantity].append(math.nan)
                    words[number, quantity] = cut(row[place])
    except csv.Error as error:
        raise RecordError(f"row {number + 1} cannot be read ({error})", place=str(path)) from None
    if number < 3:
        raise RecordError(
            f"{number - 1} row(s) of data", place=str(path), advice="at least 2 are needed"
        )
    return {quantity: np.array(values) for quantity, values in found.items()}, words


def _chosen(
    path: Path, values: Mapping[str, FloatArray], where: str, rows: int
) -> NDArray[np.bool_]:
    if not where.strip():
        return np.ones(rows, dtype=bool)
    try:
        condition = parse_condition(convert_numbers(where), QUANTITIES)
    except ExpressionError as error:
        in_place = ExpressionError(error.reason, where, error.column, error.allowed)
        raise RecordError(f"record.where = {shown(where)}, {in_place}", place=str(path)) from None
    except UnitError as error:
        raise RecordError.of(error).inside(f"record.where = {shown(where)}").inside(path) from None
    names = sorted(names_in(condition))
    for name in names:
        if name not in values:
            raise RecordError(
                f"where = {shown(where)} uses {name!r}, for which no column is given",
                place=str(path),
                advice=f"give its column, {name} = {{ column = ..., unit = ... }}, or remove "
                f"{name}",
            )
    table = zip(*(values[name].tolist() for name in names), strict=True)
    try:
        return np.array(
            [evaluate(condition, dict(zip(names, row, strict=True))) for row in table], dtype=bool
        )
    except (ArithmeticError, ValueError) as error:
        raise RecordError(
            f"where = {shown(where)} cannot be computed in every row ({error})",
            place=str(path),
            advice="change it so that it can",
        ) from None


def _check(
    path: Path,
    columns: Mapping[str, Column],
    part: Mapping[str, FloatArray],
    chosen: NDArray[np.bool_],
    numbers: NDArray[np.int64],
    words: Words,
) -> None:
    # The motion needs every row between the first and the last; forces only in selected rows.
    needed = {
        quantity: set(numbers[chosen if quantity in LOADS else slice(None)].tolist())
        for quantity in (part if words else ())
    }
    wrong = [place for place in words if place[0] in needed[place[1]]]
    if wrong:
        row, quantity = min(wrong, key=lambda place: place[0])
        raise RecordError(
            f"row {row}, column {shown(columns[quantity].name)}: "
            f"{shown(words[row, quantity])} is not a number (a decimal point is a "
            "point)",
            place=str(path),
            advice="correct it, or exclude the row with where = ..., a condition that is "
            "false there",
        )
    for quantity, value in part.items():
        bad = np.flatnonzero(~np.isfinite(value) & (chosen | (quantity not in LOADS)))
        if bad.size:
            raise RecordError(
                f"{_rows(numbers[bad])}, column {shown(columns[quantity].name)}: not a "
                "finite number",
                place=str(path),
                advice="remove the rows, or exclude them with where = ..., a condition that "
                "is false there",
            )
    time = part["time"]
    back = np.flatnonzero(np.diff(time) <= 0)
    if back.size:
        i = int(back[0])
        raise RecordError(
            f"time does not increase after {_rows(numbers[back])} (row {numbers[i]}: "
            f"{float(time[i])!r} s, next: {float(time[i + 1])!r} s)",
            place=str(path),
            advice="sort the rows and remove duplicates",
        )
    if time.size < 5:
        raise RecordError(
            f"only {time.size} rows are selected",
            place=str(path),
            advice="at least 5 are needed (rows are selected with where = ...)",
        )


def _gaps(time: FloatArray, numbers: NDArray[np.int64]) -> list[str]:
    steps = np.diff(time)
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP * usual)
    if not gaps.size:
        return []
    return [
        f"{gaps.size} gap(s) in time, longer than {GAP:g} median intervals of {usual:.6g} s, after "
        f"{_rows(numbers[gaps])} (the longest {steps.max():.6g} s): the motion is interpolated"
    ]


def _rows(numbers: NDArray[np.int64]) -> str:
    shown = ", ".join(str(n) for n in numbers[:5])
    more = f" and {numbers.size - 5} more" if numbers.size > 5 else ""
    return f"row{'s' if numbers.size > 1 else ''} {shown}{more}"


# --------------------------------------------------------------------------- motion
@dataclass(frozen=True, eq=False)
class Motion:
    """The motion of a record, ready to prescribe.

    Parameters
    ----------
    time, velocity, position : ndarray, shape (rows,)
        Time, s; velocity, m/s; position, m.
    smoothing : float
        Time constant of the smoothing spline, s; 0 for a measured velocity used unchanged.
    standstill : float
        Velocity noise at standstill, m/s (standard deviation); 0 if there is no standstill.
    notes : tuple of str
        How the velocity was obtained.
    """

    time: FloatArray
    velocity: FloatArray
    position: FloatArray
    smoothing: float
    standstill: float
    notes: tuple[str, ...] = field(default=())

    def fitting_v_c(self) -> float:
        """Return a v_c [m/s] that this record can resolve: three times its noise at standstill."""
        if self.standstill <= 0.0:
            return 0.0
        digit = 10.0 ** math.floor(math.log10(3.0 * self.standstill))
        return float(f"{math.ceil(3.0 * self.standstill / digit) * digit:.1g}")


@np.errstate(all="ignore")  # overflow is reported as an error
def motion_of(record: Record, smoothing: float | None = None) -> Motion:
    """Return the motion of a record, from positions by a smoothing spline.

    The spline minimises ``sum (x_j - f(t_j))**2 + lambda * integral f''**2`` with ``lambda =
    smoothing**4 / dt``: motion slower than the time constant is kept, faster noise is removed
    (half amplitude at the angular frequency 1 / smoothing).

    Parameters
    ----------
    record : Record
        A record with a column for position or velocity.
    smoothing : float, optional
        Time constant, s; by default four median time steps (0 for a measured velocity).

    Returns
    -------
    Motion
        Time, velocity and position at the rows of the record.

    Raises
    ------
    RecordError
        If there is neither position nor velocity, or the smoothing is negative.
    """
    time = record.columns["time"]
    if smoothing is not None and not smoothing >= 0.0:
        raise RecordError(
            f"smoothing is {shown(smoothing)} s", place=str(record.path), advice="it must be >= 0"
        )
    interval = float(np.median(np.diff(time)))
    if smoothing is not None and smoothing > time[-1] - time[0]:
        raise RecordError(
            f"smoothing is {shown(smoothing)} s, longer than the record ({time[-1] - time[0]:.6g} "
            "s)",
            place=str(record.path),
            advice="use a smaller value",
        )
    if "velocity" in record.columns:
        raw, given = record.columns["velocity"], "velocity"
        tau = 0.0 if smoothing is None else smoothing
    elif "position" in record.columns:
        raw, given = record.columns["position"], "position"
        tau = 4.0 * interval if smoothing is None else smoothing
    else:
        raise RecordError(
            "neither a position nor a velocity column is given",
            place=str(record.path),
            advice="give one of them: position = { column = ..., unit = ... }",
        )
    # The spline does not depend on the origin; subtracting the offset avoids cancellation.
    shift = float(raw[0])
    try:
        spline = make_smoothing_spline(time, raw - shift, lam=tau**4 / interval)
    except (ArithmeticError, ValueError) as error:  # LinAlgError is a ValueError
        raise RecordError(
            f"no smoothing spline fits the {given} column ({cut(str(error))})",
            place=str(record.path),
            advice="look for outliers in values or times and exclude their rows with "
            "where = ..., or change smoothing = ... (s)",
        ) from None
    smooth = spline(time) + shift
    if given == "position":
        velocity, position = spline.derivative()(time), smooth
        rest = float(np.std(raw - smooth))
        notes = [
            f"velocity: derivative of a smoothing spline through the positions, time constant "
            f"{tau:.4g} s (half amplitude at {1 / (2 * np.pi * tau) if tau else math.inf:.3g} Hz); "
            f"the residual of the positions is {rest:.2g} m (standard deviation)"
        ]
    else:
        velocity = smooth if tau else raw
        steps = np.diff(time) * 0.5 * (velocity[1:] + velocity[:-1])
        position = np.concatenate([[0.0], np.cumsum(steps)])
        notes = [
            "velocity: as measured"
            + (f", smoothed with a time constant of {tau:.4g} s" if tau else "")
        ]
    if not np.isfinite([velocity, position]).all():
        raise RecordError(
            f"the {given} column has values too large for a motion, up to "
            f"{float(np.abs(raw).max()):.3g} (SI)",
            place=str(record.path),
            advice="look for outliers, and exclude their rows with where = ...",
        )
    return Motion(time, velocity, position, tau, _standstill(velocity), tuple(notes))


def _standstill(velocity: FloatArray) -> float:
    """Return the scatter of v about a line in intervals with almost no mean motion."""
    fastest = float(np.quantile(np.abs(velocity), 0.99))
    count = velocity.size // STRETCH
    if count == 0 or fastest == 0.0:
        return 0.0
    stretches = velocity[: count * STRETCH].reshape(count, STRETCH)
    # About a line, so that a slow reversal is not mistaken for noise.
    place = np.linspace(-1.0, 1.0, STRETCH)
    slope = stretches @ place / (place @ place)
    mean = stretches.mean(axis=1)
    quiet = (np.abs(mean) < 0.05 * fastest) & (np.abs(slope) < 0.1 * fastest)
    if not quiet.any():
        return 0.0
    scatter = (stretches - mean[:, None] - slope[:, None] * place)[quiet]
    # The median interval, because in some of them the motion starts or ends.
    return float(np.sqrt(np.median((scatter**2).sum(axis=1)) / (STRETCH - 2)))
