"""The path of a finished run as its program sees it: margins at the rows, and the flow near one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.lowering.layout import BankPlaces
from gms_fsm.lowering.observing import armed, rate
from gms_fsm.lowering.program import Program
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.trace import Trace
from integrators import FOR_A_GUARD

BLOCK = 4096  # rows


@dataclass(frozen=True)
class Track:
    """All rows of a run, and the functions of its program.

    Parameters
    ----------
    trace : Trace
        The run, with both sides of every stop.
    """

    trace: Trace

    @property
    def program(self) -> Program:
        """The program of the run."""
        return self.trace.program

    @property
    def rows(self) -> Rows:
        """All rows."""
        return self.trace.rows

    @property
    def located(self) -> bool:
        """Whether switches were located, and the tolerances are those of error control."""
        return self.trace.settings.get("events") == "located"

    @cached_property
    def tolerance(self) -> FloatArray:
        """What each component may be wrong by at each row, shape (rows, size)."""
        y, settings = np.abs(self.rows.y), self.trace.settings
        layout, floor = self.program.layout.y, np.zeros(self.rows.y.shape[1])
        given, keys = settings.get("atol"), self.program.layout.keys
        if isinstance(given, Mapping):
            for name, value in given.items():
                floor[layout.all_of(keys.get(name, name))] = value
        elif isinstance(given, float):
            floor[:] = given
        relative = settings.get("rtol")
        nearby = y.copy()  # the error of a step is measured against both its ends
        nearby[1:], nearby[:-1] = np.maximum(nearby[1:], y[:-1]), np.maximum(nearby[:-1], y[1:])
        part = relative if isinstance(relative, float) else 1e-6
        return floor + part * nearby

    def at(self, row: int) -> tuple[float, list[float], list[int]]:
        """Return time, state and modes of a row."""
        rows = self.rows
        return float(rows.t[row]), rows.y[row].tolist(), rows.mode[row].tolist()

    def every(self) -> Iterator[tuple[float, list[float], list[int]]]:
        """Yield time, state and modes of all rows."""
        t, y, mode = self.rows.t, self.rows.y, self.rows.mode
        for begin in range(0, len(t), BLOCK):  # at once they would take much memory
            part = slice(begin, begin + BLOCK)
            yield from zip(t[part].tolist(), y[part].tolist(), mode[part].tolist(), strict=True)

    @cached_property
    def margins(self) -> FloatArray:
        """The margin of every comparison at every row, shape (rows, comparisons)."""
        program, number = self.program, len(self.program.strict)
        margins, p, asked = program.ieee["margins"], program.p, [FOR_A_GUARD] * number
        found = np.empty((len(self.rows), number))
        for row, (t, y, mode) in enumerate(self.every()):
            out = [0.0] * number
            margins(t, y, mode, p, asked, out)
            found[row] = out
        return found

    @cached_property
    def crossed(self) -> NDArray[np.bool_]:
        """Which margins have changed their sign since the row before, shape (rows, comparisons)."""
        m, found = self.margins, np.zeros(self.margins.shape, dtype=np.bool_)
        truth = np.where(np.array(self.program.strict, dtype=np.bool_), m > 0.0, m >= 0.0)
        found[1:] = truth[1:] != truth[:-1]
        return found

    def margins_at(self, t: float, y: list[float], mode: list[int]) -> list[float]:
        """Return the margin of every comparison."""
        number = len(self.program.strict)
        out = [0.0] * number
        self.program.ieee["margins"](t, y, mode, self.program.p, [FOR_A_GUARD] * number, out)
        return out

    @cached_property
    def watched(self) -> NDArray[np.bool_]:
        """Which comparisons keep a guard false at each row, shape (rows, comparisons)."""
        program, number = self.program, len(self.program.strict)
        arm, p = program.ieee["arm"], program.p
        found = np.zeros((len(self.rows), number), dtype=np.int64)
        for row, (t, y, mode) in enumerate(self.every()):
            held, watch = [0.0] * program.held, [0] * number
            arm(t, y, mode, p, held, watch)
            found[row] = watch
        return (found & FOR_A_GUARD).astype(np.bool_)

    def enabled(self, t: float, y: list[float], mode: Sequence[int]) -> list[int]:
        """Return the edge of each machine that would be taken, or -1."""
        program = self.program
        found = [-1] * program.layout.n
        program.ieee["switch"](t, y, mode, program.p, program.calm, found)
        return found

    def moved(self, row: int, h: float) -> tuple[float, list[float]]:
        """Return time and state after h [s] of the flow of a row, whatever fires meanwhile."""
        t, start, mode = self.at(row)
        held, y, f = armed(self.program, t, start, mode), np.array(start), self.program
        with np.errstate(all="ignore"):
            a = rate(f, t, start, mode, held)
            b = rate(f, t + 0.5 * h, (y + 0.5 * h * a).tolist(), mode, held)
            c = rate(f, t + 0.5 * h, (y + 0.5 * h * b).tolist(), mode, held)
            d = rate(f, t + h, (y + h * c).tolist(), mode, held)
            return float(t + h), (y + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)).tolist()

    def uncertainty(self, row: int, chosen: Sequence[int]) -> FloatArray:
        """Return how far some margins may be wrong at a row: by the tolerances of the state."""
        t, y, mode = self.at(row)
        here, found = np.array(self.margins_at(t, y, mode)), np.zeros(len(self.program.strict))
        for j, by in enumerate(self.tolerance[row].tolist()):
            if by > 0.0:
                there = np.array(self.margins_at(t, shifted(y, j, by), mode))
                with np.errstate(all="ignore"):
                    found += np.abs(there - here)
        return found[list(chosen)]

    def bank(self, machine: int) -> tuple[BankPlaces, int]:
        """Return the contact of a machine, and its number there."""
        bank = self.program.layout.bank(machine)
        return bank, machine - bank.first

    def who(self, machine: int) -> str:
        """Return what an element is called in text."""
        bank, i = self.bank(machine)
        return self.trace.what.element(bank.name, i)

    def edge(self, number: int) -> str:
        """Return the name of an edge by its number among those of all contacts."""
        return self.program.layout.edges[number][0]

    def whose(self, machine: int) -> str:
        """Return the contact of a machine if its user named it, else an empty text."""
        return self.trace.what.whose(self.program.layout.bank(machine).name)


def shifted(y: list[float], place: int, by: float) -> list[float]:
    """Return a state with one component moved."""
    moved = list(y)
    moved[place] += by
    return moved
