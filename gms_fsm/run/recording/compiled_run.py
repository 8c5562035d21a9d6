"""A run by the compiled engine: the outer loop itself is machine code that fills columns."""

from __future__ import annotations

import functools
import weakref
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import SignalError
from gms_fsm.gradients.directions import Directions
from gms_fsm.gradients.sensitivities import Sensitivities
from gms_fsm.lowering import compiling as compiled
from gms_fsm.lowering.log_columns import LOG_NUMBERS, LogRecord
from gms_fsm.lowering.program import equations
from gms_fsm.run.machines import Interference, MachineEngine
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.counted import CountTables, of_every_step
from gms_fsm.run.recording.moment import Place, Recording
from gms_fsm.run.recording.pace import LATER, PATIENCE, check_pace
from gms_fsm.run.recording.ready_code import ready_code, tangents_of
from gms_fsm.run.recording.recording import check_end, explained, interference_error
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.firings import Firings
from gms_fsm.traces.rows import Rows, joined, packed
from gms_fsm.traces.trace import Trace
from integrators import hybrid, loop
from integrators.loop import Memory
from integrators.machine_code.records import arrays_of
from integrators.runners import states
from integrators.runners.columns import LogColumns, RowTally
from integrators.sliding import Sliding
from integrators.steps import Now

if TYPE_CHECKING:
    from integrators.runners.compiled import RecordArguments

WORTH_A_LOOK = 500_000  # steps: machine code takes fewer in less time than it takes to look ahead
LARGE = 4_000_000  # bytes of the columns of rows at the beginning, at most
WIDE = 256  # states and modes from which on rows are packed when their columns are full
COUNTED_AT_ONCE = 64  # rows: few, so that they stay near the processor
STEPS_AT_ONCE = 20_000  # between two checks for Ctrl-C and two calls of progress


class CompiledRun:
    """A simulation in progress, chunk by chunk; same interface as `gms_fsm.run.simulate.Run`.

    Parameters
    ----------
    start : Problem
        The run to perform.
    machines : MachineEngine, optional
        With the user's own machines: each firing is replayed through them.
    tables : CountTables, optional
        Where every step's row is counted; such a run keeps only its end.
    wanted : Directions, optional
        By what it is differentiated while it runs.
    """

    def __init__(
        self,
        start: Problem,
        machines: MachineEngine | None = None,
        tables: CountTables | None = None,
        wanted: Directions | None = None,
    ) -> None:
        self.start = start
        self.columns = Columns(start, tables=tables, wanted=wanted)
        self.recorder: Recording = self.columns
        self.engine = machines
        self.next_look = PATIENCE

    @property
    def buffers(self) -> hybrid.Buffers:
        """The buffers in which the loop keeps its state."""
        return self.columns.buffers

    @property
    def rows_wait(self) -> bool:
        """The columns have all rows."""
        return False

    def kept(self) -> dict[str, Any]:
        """Return the columns for a checkpoint."""
        return self.columns.state()

    def restore(self, kept: dict[str, Any]) -> None:
        """Restore what `kept` returned; the buffers are already filled."""
        self.columns.restore(kept)
        memory = self.buffers.memory
        t, y, mode = self.columns.latest
        if self.engine is not None:
            self.engine.restore(t, y, mode[self.start.program.layout.elements])
            if memory.phase == loop.FIRE:  # its callbacks have run, the loop has yet to fire
                _, edge = self.start.edge(memory.machine, memory.edge)
                self.engine.set_state(memory.machine, edge.target)

    def advance(self) -> bool:
        """Run until a chunk of steps is complete."""
        columns = self.columns
        columns.make_room()
        b, start, before = columns.buffers, columns.start, columns.latest
        try:
            event = columns.run(STEPS_AT_ONCE, pause=self.engine is not None)
        except SignalError as error:
            columns.interrupted(before)
            raise SimulationError(
                error.reason, columns.trace(), place=error.place, advice=error.advice
            ) from None
        except KeyboardInterrupt:  # in a Python function
            columns.interrupted(before)
            raise
        if event == loop.DONE:
            check_end(columns)
            return False
        if event == loop.ROWS:
            steps = b.out.steps
            if steps >= self.next_look and start.options.max_steps - steps >= WORTH_A_LOOK:
                self.next_look = LATER * steps
                check_pace(columns, columns.as_lists())
        elif event == loop.FIRING:
            self._replay(self.engine)
        else:
            failed = hybrid.failure(event, columns.as_lists(), start.program.relations)
            raise explained(failed, columns) from None
        return True

    def _replay(self, engine: MachineEngine | None) -> None:
        """Fire the user's machine just before the compiled loop fires."""
        assert engine is not None
        memory, (t, y, mode) = self.columns.buffers.memory, self.columns.latest
        start = self.columns.start
        if not memory.fired_one:  # the values when the guards were evaluated
            jolt: Any = memory.jolt
            engine.show(t, y, list(mode[start.program.layout.elements]), jolt.tolist())
        try:
            engine.trigger(memory.edge, memory.machine, t)
        except Interference as error:
            raise interference_error(error, self.columns) from error.__cause__


class Columns:
    """The arrays that a compiled run fills; they grow as needed.

    Parameters
    ----------
    start : Problem
        The run.
    p : tuple of ndarray, optional
        Parameters that replace the program's own.
    tables : CountTables, optional
        Where rows are counted.
    wanted : Directions, optional
        By what the run is differentiated.
    """

    def __init__(
        self,
        start: Problem,
        p: compiled.Packed | None = None,
        tables: CountTables | None = None,
        wanted: Directions | None = None,
    ) -> None:
        start = start if tables is None else of_every_step(start)
        self.tangents = None if wanted is None else tangents_of(start, wanted)
        self.start, self.tables = start, tables
        layout = start.program.layout
        size, modes = layout.y.size, layout.modes
        self.prepared = ready_code(
            start, None if tables is None else tables.counting, self.tangents
        )
        self.engine, self.block = self.prepared.engine, self.prepared.block()
        # A method __del__ would run while the interpreter ends, too, where modules are emptied.
        weakref.finalize(self, self.prepared.take_back, self.block).atexit = False
        self.run_of: RecordArguments = self.block.contents
        self.p = compiled.packed(start.program.p) if p is None else p
        few = max(16, min(1024, LARGE // (8 * (size + modes))))  # initial number of rows
        rows = {"all": few, "t_eval": 0, "end": 0}[start.output]
        if start.options.times is not None:
            rows = len(start.options.times)
        elif tables is not None:
            rows = COUNTED_AT_ONCE
        stops = few if start.output == "t_eval" else 0
        floats: Any = np.zeros  # the columns' fields are typed as lists; compiled code uses arrays
        ints: Any = functools.partial(np.zeros, dtype=np.int64)
        rows_t, rows_microstep, rows_y, rows_mode = _empty_rows(rows, size, modes)
        stops_t, stops_microstep, stops_y, stops_mode = _empty_rows(stops, size, modes)
        b = self.run_of.buffers
        plan = hybrid.plan_of(
            equations(start.program), start.t_start, start.last, start.options, len(start.mode)
        )
        self.buffers: hybrid.Buffers = b._replace(plan=compiled.plan_in_block(plan, b.plan))
        out: Any = b.out  # arrays
        out.every_step = start.options.times is None
        out.times = np.asarray(() if out.every_step else start.options.times, float)
        out.rows_t, out.rows_y = rows_t, rows_y
        log: Any = self.run_of.log
        self.log: LogColumns = log
        log.t, log.machine, log.edge = floats(256), ints(256), ints(256)
        log.numbers = floats((256, len(LOG_NUMBERS)))
        log.rows_microstep, log.rows_mode = rows_microstep, rows_mode
        log.stops_t, log.stops_microstep = stops_t, stops_microstep
        log.stops_y, log.stops_mode = stops_y, stops_mode
        if self.tangents:
            self.tangents.place(self._traced)
        self.packed: tuple[Rows, ...] = ()  # those before the rows in the columns
        self.handed_out = False  # whether a trace has the columns of rows, and not a copy
        self._begin()
        self._make_room_for_tangents()
        if stops:
            self.log.stops_t[0], self.log.stops_y[0] = start.t_start, self.buffers.now.y
            self.log.stops_mode[0] = list(layout.not_sliding(start.mode))
            self.log.stops_microstep[0] = 0
            self.log.stops = 1

    def run(self, most_steps: int, *, pause: bool) -> int:
        """Run the machine code; see `integrators.runners.columns.record`."""
        self.write()
        return self.engine(self.block, most_steps, pause)

    def write(self) -> None:
        """Write everything that machine code reads into the block."""
        places = self.numbers
        places[0][...], places[1][...] = self.p[:2]
        self.place()

    @property
    def numbers(self) -> Any:
        """Where the numbers of the system are in the block."""
        return self._traced.functions.p if self.tangents else self.run_of.functions.p

    @property
    def _traced(self) -> Any:
        """What functions with tangents have as parameters."""
        return self.run_of.functions.p

    def place(self) -> None:
        """Write where the columns are, and all numbers except those of the system."""
        self.block.update(self._filled())

    def place_columns(self) -> list[slice]:
        """Write where the columns are; return the words that have changed."""
        return self.block.update_columns(self._filled())

    def _filled(self) -> RecordArguments:
        """Return what the block is to contain, except for the numbers of the system."""
        functions, p = self.run_of.functions, (*self.numbers[:2], self.p[2])
        if self.tangents:
            p = self._traced._replace(functions=self._traced.functions._replace(p=p))
        return self.run_of._replace(
            functions=functions._replace(p=p),
            buffers=self.buffers,
            tally=self._tally(),
        )

    def _tally(self) -> RowTally:
        """Return the tables of counts, if there are any."""
        tally = self.run_of.tally
        if self.tables is None:
            return tally
        counts: Any = self.tables.counts  # arrays
        near: Any = self.tables.near
        return tally._replace(counts=counts, near=near)

    def _begin(self) -> None:
        """Write the start into the buffers, which are otherwise as they were at the beginning."""
        start = self.start
        floor = start.options.floor or start.options.atol
        states.begin(self.buffers, start.t_start, start.y, start.mode, start.last, floor)
        if self.tangents:
            self.begin_tangents(self.tangents.directions.scales)

    def begin_tangents(self, scales: FloatArray) -> None:
        """Put tangents at the start, where the state is."""
        assert self.tangents is not None
        start, y = self.start, self.buffers.now.y
        self.tangents.begin(self._traced.course, start.t_start, y, start.last, scales)

    def derived(self) -> Sensitivities | None:
        """Return the derivatives of a run that has reached its end."""
        if self.tangents is None:
            return None
        return Sensitivities(self.tangents.directions, self.tangents.followed(self._traced.course))

    def replace_rows(self) -> None:
        """Leave the columns of rows to the trace that has them."""
        out: Any = self.buffers.out
        layout = self.start.program.layout
        t, microstep, y, mode = _empty_rows(len(out.rows_t), layout.y.size, layout.modes)
        out.rows_t, out.rows_y = t, y
        self.log.rows_microstep, self.log.rows_mode = microstep, mode
        self.handed_out = False

    def state(self) -> dict[str, Any]:
        """Return the contents as arrays, for a checkpoint; 0 where nothing has been written."""
        self._unpack()
        out, log = self.buffers.out, self.log
        found: dict[str, Any] = {name: getattr(log, name) for name in arrays_of(LogColumns)}
        found |= {"rows_t": out.rows_t, "rows_y": out.rows_y}
        taken = self.buffers.memory.taken  # the modes of further rows come later
        filled = dict.fromkeys(("rows_mode", "rows_microstep"), taken)
        filled |= dict.fromkeys(("rows_t", "rows_y"), out.row)
        filled |= {name: log.stops for name in found if name.startswith("stops")}
        for name, count in filled.items():
            found[name][count:] = 0
        return {"counts": [log.firings, log.stops], **found}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned."""
        out: Any = self.buffers.out
        log: Any = self.log
        log.firings, log.stops = map(int, state["counts"])
        log.seen[...] = state["seen"]  # a place in the block
        for name in arrays_of(LogColumns):
            if name != "seen":
                setattr(log, name, state[name])
        out.rows_t, out.rows_y = state["rows_t"], state["rows_y"]

    def make_room(self) -> None:
        """Double the columns that are full."""
        out, log = self.buffers.out, self.log
        if out.every_step and out.row + 1 >= len(out.rows_t):
            layout = self.start.program.layout
            if layout.y.size + layout.modes >= WIDE and self.buffers.memory.taken:
                self._pack()
            else:
                _double(out, "rows_t", "rows_y")
                _double(log, "rows_microstep", "rows_mode")
        if log.firings >= len(log.t):
            self.make_room_for_firings()
        if 0 < len(log.stops_t) <= log.stops:
            _double(log, "stops_t", "stops_microstep", "stops_y", "stops_mode")
        self._make_room_for_tangents()

    def _make_room_for_tangents(self) -> None:
        """Lengthen the columns of tangents: as many rows and firings as in those of the run."""
        if self.tangents:
            out, log = self.buffers.out, self.log
            rows, firings = len(out.rows_t) - out.row, len(log.t) - log.firings
            self.tangents.make_room(self._traced.course, rows + 1, firings)

    def make_room_for_firings(self) -> None:
        """Double the columns of the log."""
        _double(self.log, "t", "machine", "edge", "numbers")

    @property
    def rows(self) -> tuple[Any, ...]:
        """The columns of rows."""
        out, log = self.buffers.out, self.log
        return out.rows_t, log.rows_microstep, out.rows_y, log.rows_mode

    def _pack(self) -> None:
        """Take the rows that are complete out of their columns."""
        b = self.buffers
        taken, count = int(b.memory.taken), int(b.out.row)
        rest = [column[taken:count].copy() for column in self.rows]
        self.packed += (packed(_rows(taken, *self.rows)),)
        if self.handed_out:
            self.replace_rows()
        for column, rows in zip(self.rows, rest, strict=True):
            column[: count - taken] = rows
        b.memory.taken, b.out.row = 0, count - taken

    def _unpack(self) -> None:
        """Put all rows back into the columns."""
        if not self.packed:
            return
        out: Any = self.buffers.out
        log: Any = self.log
        whole = [
            np.concatenate([*(getattr(each, name) for each in self.packed), column])
            for name, column in zip(("t", "microstep", "y", "mode"), self.rows, strict=True)
        ]
        count = sum(map(len, self.packed))
        out.rows_t, log.rows_microstep, out.rows_y, log.rows_mode = whole
        self.buffers.memory.taken += count
        out.row += count
        self.packed, self.handed_out = (), False

    def interrupted(self, before: tuple[float, list[float], tuple[int, ...]]) -> None:
        """Recover from machine code that was interrupted by an error in a user's function.

        The rows are complete except for their modes; only the previous time and state are certain.
        """
        self._complete()
        now: Any = self.buffers.now  # arrays
        t, y, mode = before
        now.t, now.y[:], now.mode[:] = t, y, mode[: len(now.mode)]

    def _complete(self) -> None:
        """Write the modes of the last rows, which the loop would write with the next event."""
        b: Any = self.buffers
        log: Any = self.log
        if b.memory.taken == b.out.row:
            return
        fresh = slice(int(b.memory.taken), int(b.out.row))
        modes = [*b.now.mode.tolist(), *b.sliding.flags.tolist()]
        log.rows_microstep[fresh], log.rows_mode[fresh] = 0, modes
        b.memory.taken = b.out.row

    @property
    def latest(self) -> tuple[float, list[float], tuple[int, ...]]:
        """Time, state and modes reached."""
        b: Any = self.buffers
        modes = (*b.now.mode.tolist(), *b.sliding.flags.tolist())
        return b.now.t, b.now.y.tolist(), modes

    def around(self, t: float) -> tuple[Place, Place | None]:
        """Return the last row at or before a time, and the next one."""
        start, count = self.start, self.buffers.out.row
        parts = [*self.packed, Rows(*(column[:count] for column in self.rows))]
        times = np.concatenate([each.t for each in parts])
        row = int(np.searchsorted(times, t, "right")) - 1
        places = [_place(parts, i) for i in (row, row + 1) if 0 <= i < times.size]
        if row < 0:
            mode = start.program.layout.not_sliding(start.mode)
            places.insert(0, (start.t_start, list(start.y), mode))
        return places[0], (*places, None)[1]

    def firings(self, after: int) -> list[LogRecord]:
        """Return the records of the log from a number on."""
        return [LogRecord(*each) for each in self.fired().at(slice(after, None)).records.tolist()]

    def as_lists(self) -> hybrid.Buffers:
        """Return the buffers with time, state and modes as Python numbers, for messages."""
        b = self.buffers
        return b._replace(
            now=_with_lists(Now, b.now),
            memory=_with_lists(Memory, b.memory),
            sliding=_with_lists(Sliding, b.sliding),
        )

    def fired(self) -> Firings:
        """Return the firings so far."""
        count, log = self.log.firings, self.log
        columns: Any = (log.t, log.machine, log.edge, log.numbers)
        t, machine, edge, numbers = (each[:count] for each in columns)
        return self.start.fired(t.copy(), machine, edge, numbers.copy())

    def trace(self) -> Trace:
        """Return the trace of all recorded data."""
        return self.start.trace(*self.contents())

    def contents(self) -> tuple[Rows, Rows, Firings]:
        """Return the rows, both sides of every stop, and the log."""
        start, log = self.start, self.log
        if start.output == "end":
            t, y, mode = self.latest
            rows = Rows(np.array([t]), np.zeros(1, dtype=np.int64), np.array([y]), np.array([mode]))
        else:
            self._complete()
            count, columns = self.buffers.out.row, self.rows
            self.handed_out = not self.packed and count == len(columns[0])
            if self.packed:
                last = [packed(_rows(count, *columns))] if count else []
                rows = joined([*self.packed, *last])
            else:
                rows = Rows(*columns) if self.handed_out else _rows(count, *columns)
        stops = rows
        if start.output == "t_eval":
            stops = _rows(
                log.stops,
                log.stops_t,
                log.stops_microstep,
                log.stops_y,
                log.stops_mode,
            )
        return rows, stops, self.fired()


def _empty_rows(rows: int, size: int, modes: int) -> tuple[Any, Any, Any, Any]:
    """Return columns for times, micro-steps, states and modes, in one piece of memory.

    In several pieces they would be given back to the system after each run and fetched again for
    the next one, which takes longer than filling them.
    """
    numbers = np.empty(rows * (2 + size + modes))
    whole = numbers.view(np.int64)
    start, end = 2 * rows, (2 + size) * rows  # of the states
    y, mode = numbers[start:end].reshape(rows, size), whole[end:].reshape(rows, modes)
    return numbers[:rows], whole[rows:start], y, mode


def _with_lists(kind: Any, record: Any) -> Any:
    """Return a copy of a record in a block, with lists instead of arrays."""
    parts = (getattr(record, name) for name in kind.__match_args__)
    return kind(*(part.tolist() if isinstance(part, np.ndarray) else part for part in parts))


def _double(record: Any, *names: str) -> None:
    for name in names:
        column = getattr(record, name)
        setattr(record, name, np.concatenate([column, np.zeros_like(column)]))


def _place(parts: Sequence[Rows], row: int) -> Place:
    """Return a row of several tables that follow each other."""
    for rows in parts:
        if row < len(rows):
            break
        row -= len(rows)
    return float(rows.t[row]), rows.y[row].tolist(), tuple(rows.mode[row].tolist())


def _rows(count: int, *columns: Any) -> Rows:
    """Return the filled part of four columns."""
    return Rows(*(column[:count].copy() for column in columns))
