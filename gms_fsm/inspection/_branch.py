"""A branch of a session: a run computed row by row, with a cursor.

Computed rows are kept, so going back and forward shows the same bits. A run that cannot continue
is not an exception here but an outcome of its branch.
"""

from __future__ import annotations

import math
import signal
import threading
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from gms_fsm.inspection._poking import Edits
from gms_fsm.inspection._results import Fired
from gms_fsm.lowering._observing import sigmas
from gms_fsm.lowering.log_columns import LogRecord
from gms_fsm.run.simulate import Run
from gms_fsm.traces._between import interpolated
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.scope import Scope
from gms_fsm.traces.system_scope import SystemScope
from gms_fsm.traces.trace import Trace
from integrators import Firing, Stop

__all__ = ["Branch", "Row"]


class Row(NamedTuple):
    """A row of a branch, or a point between two rows (then with micro-step 0)."""

    t: float
    microstep: int
    y: list[float]
    mode: tuple[int, ...]


class Branch:
    """A run computed row by row, which follows an unchanged part of its parent.

    Parameters
    ----------
    run : Run
        The run, from the start of the branch.
    parent : int or None
        Number of the branch in which the poke was made.
    fork : int
        Row under the parent's cursor at that time; rows 0 to fork are shared.
    shared : Branch or None
        The parent branch.
    edits : Edits or None
        The changed values; None for the original run.
    begin : Row or None
        The point of the poke, if it was between two rows; it is a row of this branch.
    """

    def __init__(
        self,
        run: Run,
        parent: int | None = None,
        fork: int = -1,
        shared: Branch | None = None,
        edits: Edits | None = None,
        begin: Row | None = None,
    ) -> None:
        self.run, self.parent, self.fork, self.shared = run, parent, fork, shared
        self.edits, self.begin = edits, begin
        self.ended = False  # whether the last row is that of t_end
        self.failure: SimulationError | None = None  # why it cannot continue
        self.cursor = 0
        self.between: Row | None = None  # a located point after the cursor row
        self.offset = fork + 1 + (begin is not None)
        self.stops: set[int] = set()  # rows at which the guards were evaluated
        self.firings: list[int] = []  # rows made by firings in this branch
        self.on_row: Callable[[], object] = _nothing  # called at each row of a move; may interrupt
        self.pull()

    def __repr__(self) -> str:
        fork = "" if self.parent is None else f", from row {self.fork} of branch {self.parent}"
        return f"<Branch: {len(self)} rows, cursor at row {self.cursor}{fork}>"

    # ------------------------------------------------------------------ rows
    def __len__(self) -> int:
        return self.offset + len(self.run.recorder.rows.t)

    def pull(self) -> bool:
        """Compute at least one more row, and return whether there was one."""
        self.on_row()
        before = len(self)
        with _unbroken():
            while not (self.ended or self.failure) and len(self) == before:
                try:
                    if not self.run.advance():
                        self.ended = True
                    elif isinstance(self.run.event, Stop):
                        self.stops.add(len(self) - 1)
                    elif isinstance(self.run.event, Firing):
                        self.firings.append(len(self) - 1)
                except SimulationError as error:
                    self.failure = error.with_traceback(None)
        return len(self) > before

    def complete(self) -> None:
        """Compute all rows to the end, or until the run cannot continue."""
        while self.pull():
            pass

    def raw(self, row: int) -> Row:
        """Return time, micro-step, state and modes of a row."""
        if row <= self.fork:
            assert self.shared is not None
            return self.shared.raw(row)
        if row < self.offset:
            assert self.begin is not None
            return self.begin
        rows, i = self.run.recorder.rows, row - self.offset
        return Row(rows.t[i], rows.microstep[i], rows.y[i], rows.mode[i])

    @property
    def last(self) -> Row:
        """The last row computed so far."""
        return self.raw(len(self) - 1)

    @property
    def here(self) -> Row:
        """The row or point at the cursor."""
        return self.place(self.cursor)

    def place(self, row: int) -> Row:
        """Return a row, or for the cursor row the located point after it, if there is one."""
        if row == self.cursor and self.between is not None:
            return self.between
        return self.raw(row)

    def row_at(self, t: float) -> int:
        """Return the last computed row at or before a time; -1 if it is before all of them."""
        return bisect_right(range(len(self)), t, key=lambda row: self.raw(row).t) - 1

    def behind(self, row: int) -> Callable[[float], Row]:
        """Return a function of time that gives points between a row and the next."""
        before, after = self.raw(row), self.raw(row + 1)
        program, mode = self.run.start.program, list(before.mode)
        ends = before.t, np.array(before.y), after.t, np.array(after.y)

        def place(t: float) -> Row:
            return Row(t, 0, interpolated(program, mode, *ends, t).tolist(), before.mode)

        return place

    def scope(self, row: Row, contact: str = "") -> Scope:
        """Return the values of a contact at a row or point; without a name of the only one."""
        start = self.run.start
        name = start.program.layout.contact(contact).name
        model = start.model if start.given is None else start.system.contact(name)
        return Scope.of(model, start.program, row.t, row.y, row.mode, name)

    def system_scope(self, row: Row) -> SystemScope:
        """Return all values at a row or point, by name."""
        start = self.run.start
        return SystemScope.of(start.system, start.program, row.t, row.y, row.mode)

    def watches(self, row: Row) -> dict[str, Any]:
        """Return the values at a row or point of the names allowed in conditions."""
        if self.run.start.given is None:
            return self.scope(row).watches()
        return self.system_scope(row).watches()

    def state(self, row: Row, machine: int) -> str:
        """Return the active state of an element, counted over all contacts, at a row."""
        start = self.run.start
        active = row.mode[start.program.layout.elements][machine]
        bank = start.program.layout.bank(machine)
        return start.system.contact(bank.name).chart.states[active].name

    def sigma(self, row: Row) -> dict[str, float]:
        """Return the signs held between -1 and 1 at a row, keyed by the quantity that is zero."""
        program = self.run.start.program
        found = zip(program.surface_names, sigmas(program, row.t, row.y, row.mode), strict=True)
        return {name: sigma for name, sigma in found if not math.isnan(sigma)}

    # ------------------------------------------------------------------ ticks
    def asked(self, row: int, machine: int) -> bool:
        """Return whether the guards of an element are evaluated at a row, as far as ticks allow."""
        bit = self.run.start.program.discrete[machine]
        if bit == 0:
            return True
        here = self.raw(row)
        first = here.microstep == 0 and (row == 0 or self.raw(row - 1).t < here.t)
        return first and bool(self.run.start.program.ticks.at(here.t) & bit)

    def next_tick(self, machine: int) -> float | None:
        """Return when the guards of an element are evaluated next, if not at the cursor."""
        t, bit = self.here.t, self.run.start.program.discrete[machine]
        if bit == 0 or (self.between is None and self.asked(self.cursor, machine)):
            return None
        found = self.tick_after(t, bit.bit_length() - 1)
        return math.inf if found is None else found

    def tick_after(self, t: float, clock: int) -> float | None:
        """Return the next tick of a clock: the samplers, then the contacts with a period."""
        return self.run.start.program.ticks.after(t, 1 << clock)

    # ------------------------------------------------------------------ firings
    def log(self) -> list[LogRecord]:
        """Return all firings so far, including those of the shared part."""
        before: list[LogRecord] = []
        if self.shared is not None:
            before = [self.shared.record(row) for row in self.shared.firing_rows(self.fork + 1)]
        return before + self.run.recorder.log

    def firing_rows(self, end: int) -> list[int]:
        """Return the rows before `end` that were made by firings."""
        before = [] if self.shared is None else self.shared.firing_rows(min(end, self.fork + 1))
        return before + self.firings[: bisect_left(self.firings, end)]

    def record(self, row: int) -> LogRecord:
        """Return the log record of the firing that made a row."""
        if row <= self.fork:
            assert self.shared is not None
            return self.shared.record(row)
        return self.run.recorder.log[bisect_left(self.firings, row)]

    def fired(self, row: int) -> Fired | None:
        """Return the firing that made a row, or None."""
        if row not in self.firing_rows(row + 1)[-1:]:
            return None
        record = self.record(row)
        return Fired(record.element, record.edge, record.source, record.target, record.contact)

    def trace(self) -> Trace:
        """Return the branch so far as a trace."""
        raw = [self.raw(row) for row in range(len(self))]
        start = self.run.start
        t = np.array([row.t for row in raw])
        steps = np.array([row.microstep for row in raw], dtype=np.int64)
        if (
            self.shared is not None
        ):  # they count the firings at one time, also those before the fork
            own = np.arange(len(raw)) > self.fork
            steps[own & (t == t[self.fork])] += steps[self.fork]
        rows = Rows(
            t,
            steps,
            np.array([row.y for row in raw]),
            np.array([row.mode for row in raw], dtype=np.int64).reshape(
                len(raw), start.program.layout.modes
            ),
        )
        return start.trace(rows, rows, start.firings(self.log()))


def _nothing() -> None:
    """Do nothing at a row."""


@contextmanager
def _unbroken() -> Iterator[None]:
    """Delay Ctrl-C until the row is complete, since an interrupted run cannot continue."""
    usual = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(usual):
        yield
        return
    pressed: list[tuple[int, Any]] = []
    signal.signal(signal.SIGINT, lambda *event: pressed.append(event))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
    if pressed:
        usual(*pressed[0])
