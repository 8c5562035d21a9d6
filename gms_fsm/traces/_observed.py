"""The observed quantities at all rows of a run, identical to those seen by the run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import SignalError
from gms_fsm.lowering._compiled import observe_rows
from gms_fsm.lowering._observing import armed, observe
from gms_fsm.lowering.program import Program
from gms_fsm.traces.rows import Rows
from integrators import LIVE

__all__ = ["Observed"]

FEW = 8  # rows that are observed without machine code


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
            table = observe_rows(program, rows.t, rows.y, rows.mode, kept)
        except SignalError:  # a Python function failed at some row
            return _observed_rows(program, rows, kept, compiled=False)
    else:
        table = _one_by_one(program, rows, kept)
    slides = rows.mode[:, program.layout.slides]
    if slides.any():
        if compiled:
            slid = np.flatnonzero(slides.any(axis=1))
            table[slid] = _one_by_one(program, rows.at(slid), kept)
        _show_one_side(program, rows, kept, table)
    return table


def _one_by_one(program: Program, rows: Rows, kept: range) -> FloatArray:
    # With scalar functions, as in the run itself.
    table = np.empty((len(rows), len(kept)))
    modes = rows.mode.tolist()
    for row, (t, y) in enumerate(zip(rows.t.tolist(), rows.y.tolist(), strict=True)):
        try:
            table[row] = observe(program, t, y, modes[row])[kept.start : kept.stop]
        except SignalError:  # a Python function failed at this row
            table[row] = np.nan
    return table


def _show_one_side(program: Program, rows: Rows, kept: range, table: FloatArray) -> None:
    """Observe the rows next to a slide with the signs held by the arc they belong to.

    These rows lie on the surface or a rounding error past it, so the sign computed from the state
    is not the held one: before a slide it is that of the preceding arc, after it that of the
    following arc. Where an edge fires at the same time, the row next to the slide belongs to no
    arc, and is what the log has for that edge.
    """
    t, slid = rows.t, rows.mode[:, program.layout.slides]
    of_signs = np.array(program.surfaces.machine) < 0  # of machines the modes say it
    turns = np.flatnonzero((np.diff(slid, axis=0) != 0).any(axis=1) & (np.diff(t) == 0.0))
    for turn in turns.tolist():
        before, after = np.searchsorted(t, t[turn]) - 1, np.searchsorted(t, t[turn], "right")
        change = np.diff(slid[turn : turn + 2], axis=0)[0]
        for row, other, joined in ((turn, before, 1), (turn + 1, after, -1)):
            changed = np.flatnonzero((change == joined) & of_signs)
            of_an_arc = abs(other - row) == 1 and 0 <= other < len(rows)
            if slid[row].any() or not changed.size or not of_an_arc:
                continue
            mode, signs = rows.mode[row].tolist(), program.live
            held = armed(program, float(t[other]), rows.y[other].tolist(), mode)
            for place in (program.surfaces.sign[k] for k in changed):
                signs[place] = held[place] or LIVE
            out = [0.0] * program.layout.observed.size
            program.ieee["observe"](
                float(t[row]), rows.y[row].tolist(), mode, signs, program.p, out
            )
            table[row] = out[kept.start : kept.stop]
