"""A compiled run that begins anew in its own block: other numbers are other words there."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gms_fsm.gradients.directions import Directions, scales_of
from gms_fsm.lowering.compiling import put_numbers, with_more
from gms_fsm.lowering.program import Arguments
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import STEPS_AT_ONCE, WORTH_A_LOOK, Columns
from gms_fsm.run.recording.counted import CountTables
from gms_fsm.run.recording.pace import LATER, PATIENCE, check_pace
from gms_fsm.traces.firings import Firings
from gms_fsm.traces.rows import Rows
from integrators import loop

INITIAL = -2  # as machine code knows it
ROWS = "buffers.out.rows_t", "log.rows_microstep", "buffers.out.rows_y", "log.rows_mode"


class Place(NamedTuple):
    """Where a number is: alone, or a row of one for each element, or one of these."""

    row: int
    own: bool  # of the elements
    element: Any = None  # an index; None for all elements; `INITIAL` for a row of the state


class Slope(NamedTuple):
    """By what number something is differentiated."""

    number: int  # of the slope, from 1
    places: Sequence[Place]  # one, or those of several elements, which are equal
    kept: int  # the place of what says it: the value itself, or the part that is of one element


class Ends(NamedTuple):
    """How many runs have ended."""

    end: NDArray[np.float64]  # (runs, values): the time, the state, what is observed
    mode: NDArray[np.int64]  # (runs, modes)
    counts: NDArray[np.int64]  # (runs, 2): the last event, and how often an edge fired
    log: tuple[Any, ...]  # times, machines, edges and numbers of all firings, run by run


STEPS = 100_000  # of one run between two others


class RepeatedRun:
    """A run whose columns, machine code and plan serve again and again, in one thread at a time."""

    def __init__(
        self,
        start: Problem,
        tables: CountTables | None = None,
        wanted: Directions | None = None,
    ) -> None:
        self.columns = columns = Columns(start, tables=tables, wanted=wanted)
        run, layout = columns.run_of, columns.block.layout
        more: Any = run.more.adapting
        more.chosen[:] = start.chosen_tolerances()
        more.y[:], more.given[:] = start.before_entry()
        more.span[:] = start.t_start, start.last
        run.more.repeats.scale[0] = layout.offset("buffers.plan.control.time_scale")
        columns.write()
        self.shared, self.own = columns.numbers[:2]
        self.scale = layout.offset("buffers.plan.control.time_scale")
        self.floats = columns.block.words.view(float)
        self.first = columns.block.copy()
        call = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p)
        library = with_more(columns.engine, alone=wanted is not None)
        self._adapt: Any = call(library.address("adapt"))
        if wanted is None:
            several = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, *[ctypes.c_int64] * 3)
            self._repeat: Any = several(library.address("repeat"))

    def put(self, numbers: Iterable[tuple[Place, Any]]) -> None:
        """Return to the start, with some other numbers."""
        self.columns.block.restore(self.first)
        self.columns.packed = ()
        for (row, own, element), value in numbers:
            if not own:
                self.shared[row] = value
            elif element is None:
                self.own[row, : len(value) if np.ndim(value) else None] = value
            else:
                self.own[row, element] = value

    def put_all(self, p: Arguments) -> None:
        """Return to the start, with all numbers of a system of the same text."""
        self.put(())
        put_numbers(p, self.shared, self.own)

    @property
    def size(self) -> int:
        """Bytes of the columns of states."""
        rows: Any = self.columns.buffers.out.rows_y
        return int(rows.nbytes)

    def value(self, place: Place) -> Any:
        """Return a number that was put, or those of all elements."""
        row, own, element = place
        return (
            self.shared[row] if not own else self.own[row, element if element is not None else ...]
        )

    def follow(self) -> None:
        """Let everything follow from the numbers."""
        columns = self.columns
        self.floats[self.scale] = self._adapt(columns.block.address)
        if len(columns.log.stops_t):
            columns.log.stops_y[0] = columns.buffers.now.y
        if columns.tangents is not None:
            moved = columns.tangents.directions
            columns.begin_tangents(scales_of(moved, columns.numbers, columns.buffers.now.y))

    def run(self, start: Callable[[], Problem]) -> bool:
        """Run to the end; False if it stops before, for a reason that a run of its own gives.

        `start` returns the problem with the present numbers.
        """
        columns = self.columns
        out, most, next_look = columns.buffers.out, columns.start.options.max_steps, PATIENCE
        while (event := columns.engine(columns.block, STEPS_AT_ONCE, False)) == loop.ROWS:
            if out.steps >= next_look and most - out.steps >= WORTH_A_LOOK:
                next_look = LATER * out.steps
                columns.start = start()
                check_pace(columns, columns.as_lists())
            self._make_room()
        return event == loop.DONE

    def many(
        self,
        places: Sequence[Place],
        values: NDArray[np.float64],
        tables: CountTables | None = None,
    ) -> Ends:
        """Make one run after the other, each with a row of values; output must be ``"end"``."""
        columns: Any = self.columns
        columns.tables = tables
        found = self._repeating(places, values)
        made, counted, runs = 0, tables and tables.copy(), len(values)
        while (made := self._repeat(columns.block.address, made, runs, STEPS)) < runs:
            fired = columns.log.firings
            columns.make_room_for_firings()
            self._write()
            columns.log.firings = fired
            if tables is not None and counted is not None:  # it has counted a part of this run
                tables.become(counted)
                made = columns.log.firings = 0
        log, count = columns.log, columns.log.firings
        switches = log.t[:count], log.machine[:count], log.edge[:count], log.numbers[:count]
        return found._replace(log=tuple(each.copy() for each in switches))

    def rows(
        self,
        places: Sequence[Place],
        values: NDArray[np.float64],
        kept: int,
        slopes: Sequence[Sequence[Slope]],
        others: NDArray[np.float64],
    ) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
        """Return which runs reached their end, and for each row one value, its slopes, and others.

        `kept` counts the state, then what is observed. Numbers that the value is linear in are
        moved together, group by group. Output must be ``"t_eval"``, of which no stops stay.
        """
        log: Any = self.columns.log
        log.stops_t = np.empty(0)
        rows, every = len(others), [each for group in slopes for each in group]
        before = 1 + len(every)
        table = np.empty((len(values), rows, before + others.shape[1]))
        table[:, :, before:] = others
        cells, passes = list[tuple[int, int, int]](), [0]
        for group in slopes:
            for each in group:
                says = [each.number, *[0] * (len(each.places) - 1)]
                parts = zip(each.places, says, strict=True)
                cells += [(place.row, _column(place.element), j) for place, j in parts]
            passes.append(len(cells))
        said = {each.number: each.kept for each in every}
        more = {
            "kept": np.array([kept, *(said[j] for j in sorted(said))]),
            "cells": np.array(cells, dtype=np.int64).reshape(-1, 3),
            "passes": np.array(passes),
            "steps": np.empty(len(cells)),
            "table": table.reshape(-1, table.shape[2]),
        }
        found = self._repeating(places, values, **more)
        most = self.columns.start.options.max_steps + 1
        made, runs = 0, len(values)
        while (made := self._repeat(self.columns.block.address, made, runs, most)) < runs:
            self.columns.make_room_for_firings()
            self._write()
            log.firings = 0
        return found.counts[:, 0] == loop.DONE, table

    def _repeating(self, places: Sequence[Place], values: NDArray[np.float64], **kept: Any) -> Ends:
        """Say what is repeated with which numbers, and return what its results are put into."""
        columns: Any = self.columns
        program, runs = columns.start.program, len(values)
        width = 1 + program.layout.y.size + program.layout.observed.size
        found = Ends(
            np.empty((runs, width)),
            np.empty((runs, program.layout.modes), dtype=np.int64),
            np.empty((runs, 2), dtype=np.int64),
            (),
        )
        more = columns.run_of.more
        repeats = more.repeats._replace(
            words=columns.block.words,
            floats=self.floats,
            first=self.first[0],
            rows=np.array([each.row for each in places], dtype=np.int64),
            columns=np.array([_column(each.element) for each in places], dtype=np.int64),
            values=values,
            end=found.end,
            mode=found.mode,
            counts=found.counts,
            **kept,
        )
        columns.run_of = columns.run_of._replace(more=more._replace(repeats=repeats))
        self._write()
        columns.block.restore(self.first)
        return found

    def _make_room(self) -> None:
        """Double the columns that are full; from now on they are as long from the start."""
        self.columns.make_room()
        self._write()

    def _write(self) -> None:
        """Say where the columns are, now and whenever a run begins."""
        self._keep(self.columns.place_columns())

    def _keep(self, words: Iterable[slice]) -> None:
        """Let a run begin with words as they are now."""
        first, now = self.first[0], self.columns.block.words
        for each in words:
            first[each] = now[each]

    def taken(self) -> Callable[[], tuple[Rows, Rows, Firings]]:
        """Copy rows, stops and log; what is returned makes the objects of them."""
        columns: Any = self.columns
        if columns.start.output != "all" or columns.packed:
            found = columns.contents()
            if columns.handed_out:
                columns.replace_rows()
                self._keep(map(columns.block.place, ROWS, columns.rows))
            return lambda: found
        out, log = columns.buffers.out, columns.log
        count, fired = out.row, log.firings
        t, microstep, y, mode = (
            out.rows_t[:count].copy(),
            log.rows_microstep[:count].copy(),
            out.rows_y[:count].copy(),
            log.rows_mode[:count].copy(),
        )
        switches = log.t[:fired], log.machine[:fired], log.edge[:fired], log.numbers[:fired]
        copies = [each.copy() for each in switches]

        def made() -> tuple[Rows, Rows, Firings]:
            rows = Rows(t, microstep, y, mode)
            return rows, rows, columns.start.fired(*copies)

        return made


def _column(element: Any) -> int:
    """Return where machine code finds a number: that of an element, or -1."""
    return -1 if element is None else int(element)
