"""A branch of a session: a run computed row by row, with a cursor, or whole.

Computed rows are kept, so going back and forward shows the same bits. A run that cannot continue
is not an exception here but an outcome of its branch.
"""

from __future__ import annotations

import functools
import math
import signal
import threading
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gms_fsm.errors import SessionError
from gms_fsm.foundation.quantities import Scale, scale_of
from gms_fsm.lowering.log_columns import LogRecord
from gms_fsm.lowering.observing import sigmas
from gms_fsm.lowering.program import Program
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun
from gms_fsm.run.simulate import Run
from gms_fsm.session.results import Fired
from gms_fsm.session.tree.poking import Edits
from gms_fsm.traces.between import interpolated
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.scope import Scope, unit_of
from gms_fsm.traces.system_scope import SystemScope
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.views import steps_of
from integrators import Firing, Stop

SCALED = ("x", "v", "F")


class BranchRow(NamedTuple):
    """A row of a branch, or a point between two rows (then with micro-step 0)."""

    t: float
    microstep: int
    y: list[float]
    mode: tuple[int, ...]


class Continuation(NamedTuple):
    """How a branch runs: from a start, after the rows that it shares with its past.

    Parameters
    ----------
    start : Problem
        The run, from the start of the branch.
    past : Branch or None
        The branch that was poked.
    fork : int
        Row of the past that was poked; rows 0 to fork are shared.
    begin : BranchRow or None
        The point of the poke, if it was between two rows; it is a row of this branch.
    """

    start: Problem
    past: Branch | None = None
    fork: int = -1
    begin: BranchRow | None = None


class WholeBranch(NamedTuple):
    """A branch computed to its end, and why it could not reach it, if it could not."""

    trace: Trace
    failure: SimulationError | None


class Branch:
    """A run computed row by row, which follows a part of another, with a cursor.

    Parameters
    ----------
    course : Continuation
        How it runs.
    parent : int or None
        Number of the branch that it comes from.
    edits : Edits or None
        The values that were poked to make it.
    """

    def __init__(
        self, course: Continuation, parent: int | None = None, edits: Edits | None = None
    ) -> None:
        self.start, self.past, self.fork, self.begin = course
        self.parent, self.edits = parent, edits
        self.ended = False  # whether the last row is that of t_end
        self.failure: SimulationError | None = None  # why it cannot continue
        self.offset = self.fork + 1 + (self.begin is not None)
        self.cursor = 0 if self.past is None else self.offset
        self.between: BranchRow | None = None  # a located point after the cursor row
        self.stops: set[int] = set()  # rows at which the guards were evaluated
        self.firings: list[int] = []  # rows made by firings in this branch
        self.largest: dict[tuple[str, str], float] = {}  # of x, v and F of each contact so far
        self.on_row: Callable[[], object] = _nothing  # called at each row of a move; may interrupt

    def __repr__(self) -> str:
        fork = "" if self.parent is None else f", from row {self.fork} of branch {self.parent}"
        return f"<Branch: {len(self)} rows, cursor at row {self.cursor}{fork}>"

    # ------------------------------------------------------------------ rows
    @functools.cached_property
    def run(self) -> Run:
        """The run that makes the rows; its first row is computed."""
        run = Run(self.start)
        self._advance(run)
        return run

    def __len__(self) -> int:
        return self.offset + len(self.run.recorder.rows.t)

    def pull(self) -> bool:
        """Compute at least one more row, and return whether there was one."""
        self.on_row()
        before = len(self)
        self._advance(self.run)
        return len(self) > before

    def _advance(self, run: Run) -> None:
        rows = run.recorder.rows.t
        before = len(rows)
        with _unbroken():
            while not (self.ended or self.failure) and len(rows) == before:
                try:
                    if not run.advance():
                        self.ended = True
                    elif isinstance(run.event, Stop):
                        self.stops.add(self.offset + len(rows) - 1)
                    elif isinstance(run.event, Firing):
                        self.firings.append(self.offset + len(rows) - 1)
                except SimulationError as error:
                    self.failure = error.with_traceback(None)
        for i in range(before, len(rows)):
            recorded = run.recorder.rows
            row = BranchRow(rows[i], recorded.microstep[i], recorded.y[i], recorded.mode[i])
            for contact, scope in self.system_scope(row).contacts.items():
                for name in SCALED:
                    size = abs(getattr(scope, name))
                    if size > self.largest.get((contact, name), 0.0):
                        self.largest[contact, name] = size

    def scales(self, contact: str) -> dict[str, Scale]:
        """Return how x, v and F of a contact are written: as suits the largest so far."""
        past = {} if self.past is None else self._shared().largest
        chart = self.start.system.contact(contact).chart
        return {
            name: scale_of(
                (past.get((contact, name), 0.0), self.largest.get((contact, name), 0.0)),
                unit_of(chart, name),
            )
            for name in SCALED
        }

    def complete(self) -> None:
        """Compute all rows to the end, or until the run cannot continue."""
        while self.pull():
            pass

    def _shared(self) -> Branch:
        """Return the past, computed up to the poke."""
        assert self.past is not None
        while len(self.past) <= self.fork and self.past.pull():
            pass
        return self.past

    def raw(self, row: int) -> BranchRow:
        """Return time, micro-step, state and modes of a row."""
        if row <= self.fork:
            return self._shared().raw(row)
        if row < self.offset:
            assert self.begin is not None
            return self.begin
        rows, i = self.run.recorder.rows, row - self.offset
        return BranchRow(rows.t[i], rows.microstep[i], rows.y[i], rows.mode[i])

    @property
    def last(self) -> BranchRow:
        """The last row computed so far."""
        return self.raw(len(self) - 1)

    @property
    def here(self) -> BranchRow:
        """The row or point at the cursor."""
        return self.place(self.cursor)

    def place(self, row: int) -> BranchRow:
        """Return a row, or for the cursor row the located point after it, if there is one."""
        if row == self.cursor and self.between is not None:
            return self.between
        return self.raw(row)

    def row_at(self, t: float) -> int:
        """Return the last computed row at or before a time; -1 if it is before all of them."""
        return bisect_right(range(len(self)), t, key=lambda row: self.raw(row).t) - 1

    def behind(self, row: int) -> Callable[[float], BranchRow]:
        """Return a function of time that gives points between a row and the next."""
        return _between(self.start.program, self.raw(row), self.raw(row + 1))

    def counted(self, row: int) -> int:
        """Return the micro-step of a row as a trace counts it: on, after a poke."""
        here = self.raw(row)
        if row < self.offset or self.past is None or here.t != self.past.raw(self.fork).t:
            return here.microstep
        return here.microstep + self.past.counted(self.fork)

    def scope(self, row: BranchRow, contact: str = "") -> Scope:
        """Return the values of a contact at a row or point; without a name of the only one."""
        start = self.start
        name = start.program.layout.contact(contact).name
        model = start.system.contact(name) if start.what.named else start.model
        return Scope.of(model, start.program, row.t, row.y, row.mode, name)

    def system_scope(self, row: BranchRow) -> SystemScope:
        """Return all values at a row or point, by name."""
        start = self.start
        return SystemScope.of(start.system, start.program, row.t, row.y, row.mode)

    def watches(self, row: BranchRow) -> dict[str, Any]:
        """Return the values at a row or point of the names allowed in conditions."""
        named = self.start.what.named
        return self.system_scope(row).watches() if named else self.scope(row).watches()

    def state(self, row: BranchRow, machine: int) -> str:
        """Return the active state of an element, counted over all contacts, at a row."""
        start = self.start
        active = row.mode[start.program.layout.elements][machine]
        bank = start.program.layout.bank(machine)
        return start.system.contact(bank.name).chart.states[active].name

    def sigma(self, row: BranchRow) -> dict[str, float]:
        """Return the signs held between -1 and 1 at a row, keyed by the quantity that is zero."""
        program = self.start.program
        found = zip(program.surface_names, sigmas(program, row.t, row.y, row.mode), strict=True)
        return {name: sigma for name, sigma in found if not math.isnan(sigma)}

    # ------------------------------------------------------------------ ticks
    def asked(self, row: int, machine: int) -> bool:
        """Return whether the guards of an element are evaluated at a row, as far as ticks allow."""
        bit = self.start.program.discrete[machine]
        if bit == 0:
            return True
        here = self.raw(row)
        first = here.microstep == 0 and (row == 0 or self.raw(row - 1).t < here.t)
        return first and bool(self.start.program.ticks.at(here.t) & bit)

    def next_tick(self, machine: int) -> float | None:
        """Return when the guards of an element are evaluated next, if not at the cursor."""
        t, bit = self.here.t, self.start.program.discrete[machine]
        if bit == 0 or (self.between is None and self.asked(self.cursor, machine)):
            return None
        found = self.tick_after(t, bit.bit_length() - 1)
        return math.inf if found is None else found

    def tick_after(self, t: float, clock: int) -> float | None:
        """Return the next tick of a clock: the samplers, then the contacts with a period."""
        return self.start.program.ticks.after(t, 1 << clock)

    # ------------------------------------------------------------------ firings
    def log(self) -> list[LogRecord]:
        """Return all firings so far, including those of the shared part."""
        before: list[LogRecord] = []
        if self.past is not None:
            past = self._shared()
            before = [past.record(row) for row in past.firing_rows(self.fork + 1)]
        return before + self.run.recorder.log

    def firing_rows(self, end: int) -> list[int]:
        """Return the rows before `end` that were made by firings."""
        before = [] if self.past is None else self._shared().firing_rows(min(end, self.fork + 1))
        return before + self.firings[: bisect_left(self.firings, end)]

    def record(self, row: int) -> LogRecord:
        """Return the log record of the firing that made a row."""
        if row <= self.fork:
            return self._shared().record(row)
        return self.run.recorder.log[bisect_left(self.firings, row)]

    def fired(self, row: int) -> Fired | None:
        """Return the firing that made a row, or None."""
        if row not in self.firing_rows(row + 1)[-1:]:
            return None
        record = self.record(row)
        return Fired(record.element, record.edge, record.source, record.target, record.contact)

    # ------------------------------------------------------------------ traces
    def trace(self) -> Trace:
        """Return the branch so far as a trace."""
        before = None if self.past is None else self._shared().trace()
        return self._joined(before, self.run.recorder.trace())

    @functools.cached_property
    def whole(self) -> WholeBranch:
        """The branch to its end, or until it cannot continue, by the engine of its settings."""
        if self.start.chosen.engine != "compiled":
            self.complete()
            return WholeBranch(self.trace(), self.failure)
        before = None if self.past is None else self.past.whole.trace
        run, failure = CompiledRun(self.start), None
        try:
            while run.advance():
                pass
            own = run.recorder.trace()
        except SimulationError as error:
            failure, own = error.with_traceback(None), error.trace
        return WholeBranch(self._joined(before, own), failure)

    def _joined(self, before: Trace | None, own: Trace) -> Trace:
        """Return the trace of the past up to the poke, and what follows it."""
        if before is None:
            return own
        made = _rows_made(before) <= self.fork
        shared, new = before.rows.at(slice(self.fork + 1)), own.rows
        if self.begin is not None:
            shared = _followed(shared, Rows(*(np.array([each]) for each in self.begin)))
        # Micro-steps count the firings at one time, also those before the poke.
        more = np.where(new.t == shared.t[-1], shared.microstep[-1], 0)
        rows = _followed(shared, replace(new, microstep=new.microstep + more))
        firings = before.firings.at(made).followed_by(own.firings)
        return self.start.trace(rows, rows, firings)

    def found(self, t: float, microstep: int | None) -> tuple[int, BranchRow, bool]:
        """Find the place of a time in the whole run.

        Parameters
        ----------
        t : float
            Time, s.
        microstep : int or None
            Of the row at this time, as a trace counts; the last one if there is none.

        Returns
        -------
        (int, BranchRow, bool)
            The last row before it; the point there; whether it is between two rows.

        Raises
        ------
        SessionError
            If the run ends before.
        """
        rows = self.whole.trace.rows
        if t > rows.t[-1]:
            raise SessionError(
                f"the run ends at t = {rows.t[-1]:g} s, before the poke", advice="poke it earlier"
            )
        last = int(np.searchsorted(rows.t, t, side="right")) - 1
        if rows.t[last] != t:
            ends = _row(rows, last), _row(rows, last + 1)
            return last, _between(self.start.program, *ends)(t), True
        same = np.flatnonzero((rows.t == t) & (rows.microstep == microstep))
        at = int(same[-1]) if same.size else last
        return at, _row(rows, at), False


def _row(rows: Rows, row: int) -> BranchRow:
    t, microstep, y, mode = (each[row].tolist() for each in vars(rows).values())
    return BranchRow(t, microstep, y, tuple(mode))


def _between(program: Program, before: BranchRow, after: BranchRow) -> Callable[[float], BranchRow]:
    """Return a function of time that gives points between two rows."""
    mode = list(before.mode)
    ends = before.t, np.array(before.y), after.t, np.array(after.y)

    def place(t: float) -> BranchRow:
        return BranchRow(t, 0, interpolated(program, mode, *ends, t).tolist(), before.mode)

    return place


def _followed(first: Rows, second: Rows) -> Rows:
    pairs = zip(vars(first).values(), vars(second).values(), strict=True)
    return Rows(*(np.concatenate(pair) for pair in pairs))


def _rows_made(trace: Trace) -> np.ndarray:
    """Return the number of the row that each firing of a run made."""
    low = np.searchsorted(trace.t, trace.firings.t, side="left")
    high = np.searchsorted(trace.t, trace.firings.t, side="right")
    spans = zip(low.tolist(), high.tolist(), steps_of(trace).tolist(), strict=True)
    rows = [a + int(np.searchsorted(trace.microstep[a:b], step)) for a, b, step in spans]
    return np.array(rows, dtype=np.int64)


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
