"""Measured records: from text tables, arrays and data frames, in SI units.

Every row used must be complete and in time order; what was left out or filled is noted.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.errors import ParameterError, RecordError, cut, shown
from gms_fsm.foundation.arguments import checked_kind, checked_path, meant, refusing
from gms_fsm.records._columns import (
    QUANTITIES,
    RENAME,
    Column,
    ColumnLike,
    checked_inputs,
    columns_of,
    mixed,
)
from gms_fsm.records._selection import FEWEST, Origin, selected
from gms_fsm.records._table import TextFormat, Words, number, read_cells
from gms_fsm.records._written import write_csv
from gms_fsm.records.motion import Motion, motion_of
from gms_fsm.records.parts import some_rows

__all__ = ["Column", "Record"]

Missing = Literal["error", "drop", "interpolate"]


@refusing()
@dataclass(frozen=True, eq=False, repr=False)
class Record:
    """A measured record in SI units, made by `from_csv`, `from_arrays` or `from_dataframe`.

    Parameters
    ----------
    name : str
        For tables and messages; of a file its name without the ending.
    columns : mapping of str to ndarray, shape (rows,)
        ``time`` and any of ``position``, ``velocity``, ``force``, ``normal``, and the inputs by
        their names; read-only.
    chosen : ndarray of bool, shape (rows,)
        The selected rows; the motion runs from the first to the last of them.
    rows : ndarray of int, shape (rows,)
        Number of each row: in a file the first line is 1, in arrays the first index is 0.
    notes : tuple of str
        Notes for the user: gaps, rows left out, cells filled.
    path : Path, optional
        The file.
    licence : str, optional
        Under which the data may be used, and whose they are.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(0.0, 10.0, 0.01)
    >>> record = Record.from_arrays(time=t, position=1e-3 * np.sin(t), force=np.cos(t), name="rig")
    >>> record
    <Record 'rig': 1000 rows, 9.99 s, position, force>
    >>> record.between(0.0, 5.0)
    <Record 'rig': 500 rows, 4.99 s, position, force>
    >>> round(float(record.motion().velocity.max()), 6)
    0.001
    """

    name: str
    columns: Mapping[str, FloatArray]
    chosen: NDArray[np.bool_]
    rows: NDArray[np.int64]
    notes: tuple[str, ...] = ()
    path: Path | None = None
    licence: str = ""

    def __len__(self) -> int:
        return int(self.columns["time"].size)

    def __repr__(self) -> str:
        time = self.columns["time"]
        count = int(self.chosen.sum())
        chosen = f" ({count} selected)" if count < len(self) else ""
        names = [*QUANTITIES, *self.inputs]
        held = ", ".join(name for name in names if name in self.columns and name != "time")
        return (
            f"<Record {cut(repr(self.name))}: {len(self)} rows{chosen}, "
            f"{float(np.ptp(time)):.6g} s, {held}>"
        )

    @property
    def place(self) -> str:
        """Where it comes from, for messages: the file, or its name."""
        return f"record {shown(self.name)}" if self.path is None else str(self.path)

    @property
    def inputs(self) -> Mapping[str, FloatArray]:
        """What the record gives to inputs of charts, by their names."""
        return {name: value for name, value in self.columns.items() if name not in QUANTITIES}

    @cached_property
    def _motions(self) -> dict[float | None, Motion]:
        """The motions made so far: a fit asks for the same one in each of its runs."""
        return {}

    def motion(self, smoothing: float | None = None) -> Motion:
        """Return the motion, from positions by a smoothing spline; computed once.

        Parameters
        ----------
        smoothing : float, optional
            As in `gms_fsm.records.motion.motion_of`, s.

        Returns
        -------
        Motion
            Time, velocity and position at the rows of the record.

        Raises
        ------
        RecordError
            If there is neither position nor velocity, or the smoothing does not suit the record.
        """
        if smoothing is not None:
            smoothing = checked_scalar("smoothing", smoothing, "finite")
        if smoothing not in self._motions:
            self._motions[smoothing] = motion_of(self, smoothing)
        return self._motions[smoothing]

    def between(self, t0: float | None = None, t1: float | None = None) -> Record:
        """Return the rows with ``t0 <= time < t1``; parts side by side have no row in common.

        Parameters
        ----------
        t0, t1 : float, optional
            Times of the record, s; by default its start, and its end with the last row.

        Returns
        -------
        Record
            With the same name and notes.

        Raises
        ------
        RecordError
            If fewer than 5 rows are left, or none that is selected.
        """
        time = self.columns["time"]
        start = -np.inf if t0 is None else checked_scalar("t0", t0, "finite")
        end = np.inf if t1 is None else checked_scalar("t1", t1, "finite")
        kept = (time >= start) & (time < end)
        if kept.sum() < FEWEST or not (kept & self.chosen).any():
            asked = f"from {'its start' if t0 is None else f'{start:g} s'} to "
            asked += "its end" if t1 is None else f"{end:g} s"
            raise RecordError(
                f"{int((kept & self.chosen).sum())} selected row(s) of {int(kept.sum())} {asked}",
                place=self.place,
                advice=f"at least {FEWEST} are needed; the record is from {time.min():g} s to "
                f"{time.max():g} s",
            )
        return some_rows(self, kept)

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write the record to a CSV file in SI units, for a rig or another program.

        The columns are ``t_s`` and those there are of ``x_m``, ``v_m_s``, ``F_N`` and ``N_N``.
        Numbers read back equal; a missing force is an empty cell. All rows are written, and the
        file does not say which of them are selected.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OutputError
            If it cannot be written, or exists and is not as gms-fsm wrote it.

        Examples
        --------
        >>> import tempfile
        >>> record = Record.from_arrays(time=[0, 1, 2, 3, 4], position=[0, 1, 3, 2, 0])
        >>> path = record.to_csv(Path(tempfile.mkdtemp()) / "motion.csv")
        >>> path.read_text().split()[:3]
        ['t_s,x_m', '0.0,0.0', '1.0,1.0']
        >>> Record.from_csv(path, position=("x_m", "m"), force=None)
        <Record 'motion': 5 rows, 4 s, position>
        """
        return write_csv(self.columns, path)

    # ----------------------------------------------------------------------- sources
    @classmethod
    def from_csv(
        cls,
        path: str | os.PathLike[str],
        *,
        time: ColumnLike = "t_s",
        position: ColumnLike | None = ("x_mm", "mm"),
        velocity: ColumnLike | None = None,
        force: ColumnLike | None = ("F_N", "N"),
        normal: ColumnLike | None = None,
        inputs: Mapping[str, ColumnLike] | None = None,
        where: str = "",
        missing: Missing = "error",
        sort: bool = False,
        duplicates: Literal["error", "mean"] = "error",
        delimiter: str | None = None,
        decimal: Literal[".", ","] = ".",
        thousands: str | None = None,
        comment: str | Sequence[str] = ("#", "%"),
        header: int | None = None,
        columns: Sequence[str] | None = None,
        encoding: str | None = None,
        name: str | None = None,
    ) -> Record:
        r"""Read a CSV or TSV table.

        Parameters
        ----------
        path : str or Path
            The file.
        time, position, velocity, force, normal : str, tuple or Column, optional
            The column of each quantity: its name (the unit is that of SI, or stands in brackets at
            the end of the name), ``(name, unit)`` or ``(name, unit, sign)`` with a sign of -1 to
            reverse it. None if there is no such column.
        inputs : mapping of str to (str, tuple or Column), optional
            Columns for inputs of charts, by their names: ``{"N": ("load", "kN")}``.
        where : str, optional
            Condition on the quantities that selects rows, for example ``"normal > 4.5 N"``. It is
            evaluated first: a cell in a row that is not selected need not be a number.
        missing : {"error", "drop", "interpolate"}
            What to do where a cell is empty, NaN or a word such as OVR in a row that is used:
            refuse it, leave the row out, or interpolate in time. With the last two a row without
            a force keeps its motion and is not compared; nor is one whose motion was interpolated.
        sort : bool
            Whether to sort the rows by time.
        duplicates : {"error", "mean"}
            What to do with rows of the same time: refuse them, or use their means.
        delimiter : str, optional
            One character; by default tab, semicolon, comma, bar or space, whichever gives the named
            columns.
        decimal : {".", ","}
            The decimal separator.
        thousands : {",", ".", " ", "'"}, optional
            The separator of thousands.
        comment : str or sequence of str
            What comment lines begin with.
        header : int, optional
            The row of the column names, the first line of the file being 1; by default the first
            row that has those of all quantities. Rows above it are not read. A line of units below
            it is compared with the units given.
        columns : sequence of str, optional
            The names of the columns of a table without a header.
        encoding : str, optional
            By default UTF-8, or UTF-16 if the file says so by a byte order mark.
        name : str, optional
            By default the name of the file without its ending.

        Returns
        -------
        Record
            The record in SI units, from the first to the last selected row, without unselected rows
            that have no time or no position.

        Raises
        ------
        RecordError
            If the file is missing or not text, a column is missing, a cell is not a finite number,
            time decreases, or no row is selected. The message names file, row, column and what to
            do.
        UnitError
            If a unit is unknown or belongs to another quantity.

        Examples
        --------
        >>> import tempfile
        >>> path = Path(tempfile.mkdtemp()) / "rig.csv"
        >>> rows = [f"{0.01 * i:.2f};{0.5 * i}".replace(".", ",") for i in range(5)]
        >>> _ = path.write_text("\n".join(["Rig 4", "Zeit;Weg", "[s];[mm]", *rows]))
        >>> record = Record.from_csv(
        ...     path, time="Zeit", position=("Weg", "mm"), force=None, decimal=","
        ... )
        >>> record.columns["position"].tolist()
        [0.0, 0.0005, 0.001, 0.0015, 0.002]
        >>> for note in record.notes:
        ...     print(note)
        the header is row 2; the rows above are not read
        row 3 is a line of units: s, mm
        """
        if hasattr(path, "columns"):
            advice = "Record.from_dataframe(frame, time=..., position=..., force=...) reads it"
            raise ParameterError("it is no file", place="path", value=path, advice=advice)
        file = checked_path("path", path)
        given = {"time": time, "position": position, "velocity": velocity}
        found = columns_of(str(file), given | {"force": force, "normal": normal}, inputs)
        form = TextFormat.of(delimiter, decimal, comment, header, encoding, thousands, columns)
        cells = read_cells(file, found, form)
        origin = Origin(str(file), {quantity: each.name for quantity, each in found.items()})
        values = {
            quantity: column.in_si(quantity, cells.numbers[quantity])
            for quantity, column in found.items()
        }
        options: Any = {"sort": sort, "duplicates": duplicates}
        part = selected(origin, values, cells.rows, cells.words, where, missing, **options)
        notes = (*cells.notes, *_noted_units(found), *part.notes)
        called = file.stem if name is None else checked_kind("name", name, str, "a text")
        return cls(called, part.columns, part.chosen, part.rows, notes, file)

    @classmethod
    def from_arrays(
        cls,
        *,
        time: ArrayLike,
        position: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        force: ArrayLike | None = None,
        normal: ArrayLike | None = None,
        inputs: Mapping[str, ArrayLike] | None = None,
        missing: Missing = "error",
        sort: bool = False,
        duplicates: Literal["error", "mean"] = "error",
        name: str = "arrays",
    ) -> Record:
        """Make a record from arrays in SI units.

        Parameters
        ----------
        time : array_like, shape (rows,)
            Increasing, s.
        position, velocity : array_like, shape (rows,), optional
            m and m/s; at least one of them is needed.
        force, normal : array_like, shape (rows,), optional
            Measured friction and normal force, N.
        inputs : mapping of str to array_like, optional
            What inputs of charts are, by their names: ``{"N": load}``.
        missing, sort, duplicates
            As in `from_csv`.
        name : str
            For tables and messages.

        Returns
        -------
        Record
            With copies of the arrays.

        Raises
        ------
        RecordError
            If an array has another length, an entry is not finite, time does not increase, or there
            are fewer than 5 rows; the message names array and index.

        Examples
        --------
        >>> Record.from_arrays(time=[0, 1, 2, 3, 3], position=[0, 1, 2, 3, 4])
        Traceback (most recent call last):
        gms_fsm.errors.RecordError: record 'arrays': time does not increase after index 3 (index 3: 3.0 s, next: 3.0 s); sort the rows and remove duplicates, or give sort = true, duplicates = "mean"
        """  # noqa: E501 (a message is one line)
        given = {"time": time, "position": position, "velocity": velocity}
        given |= {"force": force, "normal": normal}
        checked_kind("name", name, str, "a text")
        place = f"record {shown(name)}"
        if position is None and velocity is None:
            raise RecordError(
                "neither position nor velocity is given", place=place, advice="give one of them"
            )
        given |= checked_inputs(inputs)
        values = {
            quantity: _numbers(place, quantity, each)
            for quantity, each in given.items()
            if each is not None or quantity == "time"
        }
        origin = Origin(place, {quantity: quantity for quantity in values}, "arrays")
        options = {"missing": missing, "sort": sort, "duplicates": duplicates}
        return cls._from_numbers(origin, values, {}, name, options)

    @classmethod
    def from_dataframe(
        cls,
        frame: Any,
        *,
        time: ColumnLike = "t_s",
        position: ColumnLike | None = ("x_mm", "mm"),
        velocity: ColumnLike | None = None,
        force: ColumnLike | None = ("F_N", "N"),
        normal: ColumnLike | None = None,
        inputs: Mapping[str, ColumnLike] | None = None,
        where: str = "",
        missing: Missing = "error",
        sort: bool = False,
        duplicates: Literal["error", "mean"] = "error",
        name: str = "frame",
    ) -> Record:
        """Make a record from a pandas DataFrame.

        Parameters
        ----------
        frame : pandas.DataFrame
            Or another table with ``columns`` and ``frame[name]``.
        time, position, velocity, force, normal, inputs, where, missing, sort, duplicates
            As in `from_csv`.
        name : str
            For tables and messages.

        Returns
        -------
        Record
            In SI units.

        Raises
        ------
        RecordError
            As in `from_csv`; rows count from 0.
        """
        checked_kind("name", name, str, "a text")
        place = f"record {shown(name)}"
        given = {"time": time, "position": position, "velocity": velocity}
        columns = columns_of(place, given | {"force": force, "normal": normal}, inputs)
        words: Words = {}
        values = {
            quantity: column.in_si(quantity, _frame_column(place, frame, quantity, column, words))
            for quantity, column in columns.items()
        }
        names = {quantity: column.name for quantity, column in columns.items()}
        origin = Origin(place, names, "frame")
        options = {"where": where, "missing": missing, "sort": sort, "duplicates": duplicates}
        found = cls._from_numbers(origin, values, words, name, options)
        return replace(found, notes=(*_noted_units(columns), *found.notes))

    @classmethod
    def _from_numbers(
        cls,
        origin: Origin,
        values: dict[str, FloatArray],
        words: Words,
        name: str,
        options: Mapping[str, Any],
    ) -> Record:
        size = values["time"].size
        for quantity, value in values.items():
            if value.size != size:
                raise RecordError(
                    f"{quantity} has {value.size} entries, but time has {size}",
                    place=origin.place,
                    advice="give arrays of one length",
                )
        if not size:
            raise RecordError("time is empty", place=origin.place, advice="give some rows")
        part = selected(origin, values, np.arange(size), words, **options)
        return cls(name, part.columns, part.chosen, part.rows, tuple(part.notes))


def _noted_units(columns: Mapping[str, Column]) -> tuple[str, ...]:
    """Return a note if angles stand beside lengths."""
    odd = mixed({quantity: column.unit for quantity, column in columns.items()})
    return (f"{odd}: their product is no power",) if odd else ()


def _numbers(place: str, quantity: str, given: Any) -> FloatArray:
    """Return a copy as floats; masked entries become NaN."""
    try:
        found = np.asarray(given)
        if found.dtype.kind not in "iufO":  # dates would silently become nanoseconds
            raise TypeError(f"its entries are of type {found.dtype}")
        values: FloatArray = np.array(found, dtype=float)
        if np.ma.isMaskedArray(given):
            values[np.ma.getmaskarray(given)] = np.nan
    except (TypeError, ValueError, OverflowError) as error:
        raise RecordError(
            f"{quantity} is not an array of numbers ({cut(str(error))})",
            place=place,
            advice="give real numbers in SI units, of time seconds since its start",
        ) from None
    if values.ndim != 1:
        raise RecordError(
            f"{quantity} has the shape {values.shape}",
            place=place,
            advice="give one number for each row, shape (rows,)",
        )
    return values


def _frame_column(
    place: str, frame: Any, quantity: str, column: Column, words: Words
) -> FloatArray:
    """Return a column of a frame as floats; NaN where there is a word, which is noted."""
    try:
        names = list(frame.columns)
        found = frame[column.name] if names.count(column.name) == 1 else None
    except (AttributeError, TypeError, KeyError, ValueError):
        raise RecordError(
            f"a {type(frame).__name__} is not a table of columns",
            place=place,
            advice="give a pandas DataFrame; Record.from_csv takes a file, from_arrays arrays",
        ) from None
    if found is None:
        what = "several columns" if column.name in names else "no column"
        right = f"{meant(column.name, map(str, names))}name the right one: {quantity}=(name, unit)"
        right += ", or None" * (quantity != "time")
        raise RecordError(
            f"{what} {shown(column.name)} (for {quantity})",
            place=place,
            advice=f"columns: {cut(', '.join(map(repr, names)), 1000)}; "
            f"{RENAME if column.name in names else right}",
        )
    if getattr(getattr(found, "dtype", None), "na_value", None) is not None:  # a nullable column
        found = found.to_numpy(dtype=object, na_value=np.nan)
    cells = np.asarray(found)
    if cells.dtype.kind in "OU" and cells.ndim == 1 and not np.ma.isMaskedArray(found):
        found = cells.astype(object)
        for row, cell in enumerate(cells):
            if isinstance(cell, str):
                try:
                    found[row] = number(cell, ".")
                except ValueError:
                    found[row], words[row, quantity] = np.nan, cut(cell)
    return _numbers(place, f"column {shown(column.name)}", found)
