"""The results of the runs of a sweep: of one, of many at once, and of all that have come back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.arguments import later
from gms_fsm.foundation.display import Log
from gms_fsm.lowering.log_columns import LOG_NUMBERS
from gms_fsm.lowering.observing import observe
from gms_fsm.lowering.printing.counting import Counting
from gms_fsm.lowering.program import Program
from gms_fsm.run._swept import LOG, Sweep, row_name
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun
from gms_fsm.run.recording.counted import CountTables
from gms_fsm.run.repeated.block import Ends
from gms_fsm.run.simulate import Run
from gms_fsm.systems.mounted import Mounted
from gms_fsm.traces.coverage.counting import FiredEdges, LogCounts, of_log, of_tables, of_trace
from gms_fsm.traces.coverage.total import Coverage
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.trace import Trace
from integrators import loop


@dataclass(frozen=True, eq=False)
class RunResult:
    """One run, as returned by a worker."""

    outcome: str
    message: str
    end: Mapping[str, Any] | None  # t, x, v, F, z, mode
    log: NDArray[Any]
    rows: Mapping[str, FloatArray] | None
    ends: Mapping[str, float] = field(default_factory=dict)  # of bodies, states, sampled values
    coverage: Coverage | None = None  # if it was asked for, and counted from rows


@dataclass(frozen=True, eq=False)
class RunResults:
    """Some runs, and the tables in which all of them counted their rows."""

    runs: Mapping[int, RunResult]  # by number
    tables: CountTables | None = None
    many: ManyRuns | None = None  # further ones


@dataclass(frozen=True, eq=False)
class ManyRuns:
    """Runs that have reached their end, as columns."""

    which: NDArray[np.int64]  # their numbers
    t: FloatArray
    mode: NDArray[np.int64]
    end: Mapping[str, FloatArray]  # x, v, F, z
    ends: Mapping[str, FloatArray]
    log: NDArray[Any]

    @classmethod
    def of(cls, start: Problem, which: NDArray[np.int64], found: Ends) -> ManyRuns:
        """Return those of some runs that have reached their end."""
        layout, done = start.program.layout, found.counts[:, 0] == loop.DONE
        t, y, seen = np.split(found.end[done], [1, 1 + layout.y.size], axis=1)

        def column(name: str) -> FloatArray:
            return (
                seen[:, layout.observed.where(name)]
                if name in observed
                else y[:, layout.y.where(name)]
            )

        observed = {*layout.observed.shared, *layout.observed.own}
        none = np.full(len(t), np.nan)
        end: dict[str, Any] = {}
        for name in ("x", "v", "F"):
            own = [
                column({"x": bank.position, "v": bank.of(bank.velocity), "F": bank.of("F")}[name])
                if bank.velocity
                else none
                for bank in layout.banks
            ]
            end[name] = own[0] if len(own) == 1 else np.stack(own, axis=1)
        deflections = [
            column(bank.of(bank.variables[0]))
            if bank.variables
            else np.full((len(t), bank.n), np.nan)
            for bank in layout.banks
        ]
        end["z"] = np.concatenate(deflections, axis=1)
        ends = {}
        for name in start.what.values:
            body, _, axis = name.rpartition(".")
            ends[name] = column(getattr(start.system.body(body), axis) if body else name)
        of = np.repeat(np.arange(len(which)), found.counts[:, 1])
        kept = done[of]
        log = _log_of(which[of], *found.log)[kept]
        return cls(which[done], t[:, 0], found.mode[done][:, layout.elements], end, ends, log)


def result_of(
    run: Run | CompiledRun | None, outcome: str, message: str, watched: bool = False
) -> RunResult:
    """Return values of each contact, and of everything else that the user has named."""
    if run is None:
        return RunResult(outcome, message, None, np.empty(0, dtype=LOG), None)
    start, trace = run.start, run.recorder.trace()
    t, y, mode = run.recorder.latest
    ends: dict[str, float] = {}
    if start.what.values:
        now = Rows(np.array([t]), np.zeros(1, dtype=np.int64), np.array([y]), np.array([mode]))
        last = start.trace(now, now, trace.firings)
        ends = {name: float(values[0]) for name, values in _of_parts(last).items()}
    rows = None
    if start.output == "t_eval":
        rows = {row_name(name): values for name, values in _of_parts(trace).items()}
        rows |= _of_contacts(trace)
    end = _end_of_contacts(start.program, t, y, mode)
    counts = of_trace(trace) if watched else None
    fired = trace.firings
    log = _log_of(np.zeros(len(fired)), fired.t, fired.machine, fired.edge, fired.numbers)
    return RunResult(outcome, message, end, log, rows, ends, counts)


def _end_of_contacts(
    program: Program, t: float, y: list[float], mode: tuple[int, ...]
) -> dict[str, Any]:
    """Return the state reached, as `_of_contacts`, with its time and modes."""
    layout = program.layout
    seen = layout.y.named(y) | layout.observed.named(observe(program, t, y, mode))
    found: dict[str, Any] = {"t": t, "mode": mode[layout.elements], "z": []}
    for bank in layout.banks:
        own = seen[bank.of(bank.variables[0])] if bank.variables else [np.nan] * bank.n
        found["z"] += own
    places = [
        {"x": bank.position, "v": bank.of(bank.velocity), "F": bank.of("F")}
        if bank.velocity
        else {}
        for bank in layout.banks
    ]
    for name in ("x", "v", "F"):
        # A supervisor has none of them.
        values = [seen[place[name]] if place else np.nan for place in places]
        found[name] = values if len(values) > 1 else values[0]
    return found


def _log_of(run: Any, t: Any, element: Any, edge: Any, numbers: Any) -> NDArray[Any]:
    """Return the log of some runs, of which each firing names its own."""
    log = np.empty(len(t), dtype=LOG)
    log["run"], log["t"], log["element"], log["edge"] = run, t, element, edge
    for name, column in zip(LOG_NUMBERS, numbers.T, strict=True):
        log[name] = column
    return log


def _of_contacts(trace: Trace) -> dict[str, FloatArray]:
    """Return the columns of the contacts side by side; x, v and F of a single one as they are."""
    parts = [trace.contact(each.name) for each in trace.what.system.machines]
    none, found = np.full(len(trace.t), np.nan), {}
    for name in ("x", "v", "F"):
        own = [getattr(part, name) if part.model.chart.velocities else none for part in parts]
        columns = np.stack(own, axis=1)
        found[name] = columns[:, 0] if len(parts) == 1 else columns
    return found | {"z": np.concatenate([part.z for part in parts], axis=1)}


def _of_parts(trace: Trace) -> dict[str, FloatArray]:
    """Return the columns of the bodies, and the further states and sampled values."""
    found: dict[str, FloatArray] = {}
    for name in trace.what.values:
        body, _, which = name.rpartition(".")
        found[name] = getattr(trace.body(body), which) if body else trace.value(name)
    return found


class Collected:
    """Preallocated columns, filled in any order."""

    def __init__(
        self, what: Mounted, runs: int, counted: Counting | None, t_eval: ArrayLike | None
    ) -> None:
        self.what, self.counted = what, counted
        n, several = sum(each.n for each in what.system.machines), len(what.system.machines)
        columns = (several,) if several > 1 else ()
        self.times = np.array([] if t_eval is None else t_eval, dtype=np.float64)
        self.outcome, self.message = np.full(runs, "lost", dtype=object), [""] * runs
        self.t = np.full(runs, np.nan)
        self.end = {name: np.full((runs, *columns), np.nan) for name in ("x", "v", "F")}
        self.end["z"] = np.full((runs, n), np.nan)
        self.ends = {name: np.full(runs, np.nan) for name in what.values}
        self.mode = np.full((runs, n), -1, dtype=np.int64)
        self.logs: dict[int, NDArray[Any]] = {}  # by the first run of a chunk
        rows = runs, self.times.size
        self.covered: Coverage | None = None  # so far, from rows
        self.uncovered: list[range] = []  # chunks that only their logs cover
        self.tables = None if self.counted is None else CountTables.empty(self.counted)
        self.rows: dict[str, FloatArray] = {}
        if t_eval is not None:
            self.rows = {name: np.full((*rows, *columns), np.nan) for name in ("x", "v", "F")}
            self.rows["z"] = np.full((*rows, n), np.nan)
            self.rows |= {row_name(name): np.full(rows, np.nan) for name in what.values}

    def take(self, chunk: range, results: RunResults) -> None:
        """Store results in their rows."""
        logs = [each.log for each in results.runs.values()]
        for number, result in results.runs.items():
            run = chunk[number]
            self.outcome[run], self.message[run] = result.outcome, result.message
            result.log["run"] = run
            if result.end is not None:
                self.t[run], self.mode[run] = result.end["t"], result.end["mode"]
                for name, values in self.end.items():
                    values[run] = result.end[name]
            for name, value in result.ends.items():
                self.ends[name][run] = value
            for name, values in (result.rows or {}).items():
                self.rows[name][run, : len(values)] = values
        if (many := results.many) is not None:
            which = chunk.start + many.which
            self.outcome[which] = "ok"
            self.t[which], self.mode[which] = many.t, many.mode
            for mine, its in ((self.end, many.end), (self.ends, many.ends)):
                for name, values in its.items():
                    mine[name][which] = values
            many.log["run"] += chunk.start
            logs.append(many.log)
        log = np.concatenate(logs)
        self.logs[chunk.start] = log[np.argsort(log["run"], kind="stable")] if logs[1:] else log
        found = [each.coverage for each in results.runs.values() if each.coverage is not None]
        if found:
            self.covered = Coverage.merged([*filter(None, [self.covered]), *found])
            return
        if self.tables is not None and results.tables is not None:
            self.tables.add(results.tables)
        self.uncovered.append(chunk)

    def _fired(self, chunk: range, *log: NDArray[Any]) -> list[LogCounts]:
        """Return what the log of some runs shows of each chart: runs, elements, and edges."""
        run, owner, which = log
        found, element, edge = list[LogCounts](), 0, 0
        for each in self.what.system.machines:
            end = element + each.n
            mine = (owner >= element) & (owner < end)
            last = self.mode[chunk.start : chunk.stop, element:end]
            fired = FiredEdges(
                run[mine] - chunk.start, owner[mine] - element, which[mine] - edge, last
            )
            found.append(LogCounts.of(each.chart, fired))
            element, edge = end, edge + len(each.chart.transitions)
        return found

    def coverage(self, *log: NDArray[Any]) -> Coverage:
        """Return what all runs have tried; their log is that of `_fired`."""
        contacts = self.what.system.machines
        names = [each.name if self.what.named else "" for each in contacts]
        fired: list[LogCounts] = []
        for chunk in self.uncovered:  # those of all runs at once would take memory
            begin, end = np.searchsorted(log[0], (chunk.start, chunk.stop))
            more = self._fired(chunk, *(column[begin:end] for column in log))
            fired = [a + b for a, b in zip(fired, more, strict=True)] if fired else more
        if not fired:
            assert self.covered is not None
            return self.covered
        parts = [of_log(each.chart, counts) for each, counts in zip(contacts, fired, strict=True)]
        if self.tables is not None:
            tables = zip(contacts, fired, self.tables.parts(), strict=True)
            parts = [of_tables(each.chart, counts, *part) for each, counts, part in tables]
        own = Coverage(dict(zip(names, parts, strict=True)))
        return own if self.covered is None else self.covered + own

    def sweep(self, parameters: Mapping[str, FloatArray]) -> Sweep:
        """Return the sweep with all results."""
        contacts, states, edges, owners = self.what.system.machines, [], list[str](), list[str]()
        borders = np.cumsum([each.n for each in contacts])[:-1]
        for each, modes in zip(contacts, np.split(self.mode, borders, axis=1), strict=True):
            names = np.array([*(state.name for state in each.chart.states), ""])
            states.append(names[modes])
            owners += [each.name] * each.n
            lead = f"{each.name}." if len(contacts) > 1 else ""
            edges += [f"{lead}{edge.name}" for edge in each.chart.transitions]
        log = np.concatenate([self.logs[k] for k in sorted(self.logs)])
        self.logs.clear()
        counted = [log[name].copy() for name in ("run", "element", "edge")]  # it may be changed
        return Sweep(
            parameters,
            self.outcome.astype(np.str_),
            np.array(self.message),
            self.t,
            **self.end,
            states=np.concatenate(states, axis=1),
            transitions=log.view(Log),
            edges=tuple(edges),
            times=self.times,
            rows=self.rows,
            ends=self.ends,
            owners=np.array(owners if self.what.named else [], dtype=np.str_),
            coverage=later(Coverage, lambda: self.coverage(*counted)),
        )
