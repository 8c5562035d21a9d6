"""The observed quantities at all rows of a run, identical to those seen by the run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import SignalError
from gms_fsm.lowering.compiling import observe_rows
from gms_fsm.lowering.observing import on_surfaces
from gms_fsm.lowering.program import Program
from gms_fsm.traces.rows import Rows
from integrators.runners.observing import is_turn, observe_beside, observe_row

FEW = 8  # rows that are observed without machine code
BESIDE = 2  # rows on either side that a row beside a slide depends on
AT_ONCE = 1_000_000  # numbers in rows that are whole at the same time


class Observed(Mapping[str, FloatArray]):
    """The observed quantities by their names in the layout, elements on the second axis.

    They are computed when one of them is first asked for; with machine code those with one value
    per row apart from those of elements, which take much more memory.

    Parameters
    ----------
    program : Program
        Program of the run.
    rows : Rows
        All rows of the run.
    compiled : bool
        Whether to use machine code; the numbers are the same.
    """

    def __init__(self, program: Program, rows: Rows, *, compiled: bool) -> None:
        # Machine code has to be made once, and entering it takes as long as a few rows.
        self._program, self._rows, self._compiled = program, rows, compiled and len(rows) > FEW
        self._places = program.layout.observed
        self._tables: dict[range, FloatArray] = {}  # by the places in them

    def __getitem__(self, name: str) -> FloatArray:
        if name not in self:
            raise KeyError(name)
        shared, where = len(self._places.shared), self._places.all_of(name)
        kept = range(self._places.size)
        if self._compiled:
            kept = kept[:shared] if where.start < shared else kept[shared:]
        if kept not in self._tables:
            self._tables[kept] = _observed_rows(
                self._program, self._rows, kept, compiled=self._compiled
            )
        column = self._tables[kept][:, where.start - kept.start : where.stop - kept.start]
        return column[:, 0] if where.start < shared else column

    def __contains__(self, name: object) -> bool:
        return name in self._places.shared or name in self._places.own

    def __iter__(self) -> Iterator[str]:
        return iter((*self._places.shared, *self._places.own))

    def __len__(self) -> int:
        return len(self._places.shared) + len(self._places.own)


def _observed_rows(program: Program, rows: Rows, kept: range, *, compiled: bool) -> FloatArray:
    """Return the observed quantities at some places at all rows, shape (rows, kept)."""
    if compiled:
        try:
            return _in_blocks(program, rows, kept)
        except SignalError:  # a Python function failed at some row
            pass
    return _one_by_one(program, rows, kept)


def _in_blocks(program: Program, rows: Rows, kept: range) -> FloatArray:
    """Return the same by machine code, which needs whole rows: of some at a time."""
    count = max(FEW, AT_ONCE // (program.layout.y.size + program.layout.modes))
    if len(rows) <= count:
        return observe_rows(program, rows.t, rows.y, rows.mode, kept)
    table = np.empty((len(rows), len(kept)))
    for row in range(0, len(rows), count):
        start = max(0, row - BESIDE)
        part = rows.at(slice(start, row + count + BESIDE))
        own = observe_rows(program, part.t, part.y, part.mode, kept)[row - start :][:count]
        table[row:][:count] = own
    return table


def _one_by_one(program: Program, rows: Rows, kept: range) -> FloatArray:
    # With scalar functions, as in the run itself.
    table, seen = np.empty((len(rows), len(kept))), [0.0] * program.layout.observed.size
    t, y, mode = rows.t.tolist(), rows.y.tolist(), rows.mode.tolist()
    on, observe = on_surfaces(program, program.ieee, program.p), program.ieee["observe"]
    for row in range(len(rows)):
        try:
            observe_row(observe, on, t[row], y[row], mode[row], seen)
            table[row] = seen[kept.start : kept.stop]
        except SignalError:  # a Python function failed at this row
            table[row] = np.nan
            on = on_surfaces(program, program.ieee, program.p)  # it may be in the midst of a slide
    if rows.mode[:, program.layout.slides].any():
        rows_of: Any = table
        for row in range(len(rows) - 1):
            if is_turn(on.sliding, t, mode, row):
                for each, side in ((row, 1), (row + 1, -1)):
                    observe_beside(
                        observe, on, t, y, mode, len(rows), each, side, seen, rows_of, kept.start
                    )
    return table
