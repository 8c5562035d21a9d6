"""sweep(): thousands of runs over sets of parameters."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.charts.parameters import FloatArray, Parameter
from gms_fsm.errors import GMSError, ParameterError, cut, shown
from gms_fsm.foundation.arguments import checked_kind, meant, refusing, unknown
from gms_fsm.foundation.display import Log
from gms_fsm.lowering.compiling import check_llvmlite
from gms_fsm.lowering.log_columns import LOG_NUMBERS
from gms_fsm.lowering.observing import observe
from gms_fsm.lowering.printing.counting import Counting, counting_of
from gms_fsm.lowering.program import Program, same_text
from gms_fsm.run._swept import LOG, LONGEST, Sweep, row_name
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun, CountTables
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.run.simulate import Run
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted, mounted, shifted
from gms_fsm.systems.numbers import column_name, known_in, varied
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.system import System
from gms_fsm.traces.coverage.counting import FiredEdges, LogCounts, of_log, of_tables, of_trace
from gms_fsm.traces.coverage.total import Coverage
from gms_fsm.traces.firings import Firings
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.trace import Trace

if TYPE_CHECKING:
    import pandas

__all__ = ["Sweep", "sweep"]

AT_ONCE = 64  # maximum number of runs per task


@refusing()
def sweep(
    model: Model | System,
    rig: Rig | float,
    t_end: float | Mapping[str, ArrayLike] | pandas.DataFrame,
    parameters: Mapping[str, ArrayLike] | pandas.DataFrame | None = None,
    *,
    executor: Executor | None = None,
    t_start: float = 0.0,
    initial: Mapping[str, Any] | None = None,
    settings: Settings | None = None,
    progress: bool | None = None,
    coverage: bool = False,
    **options: Unpack[SettingOptions],
) -> Sweep:
    """Run a model on a rig once for each set of parameters, or a system.

    ``sweep(model, rig, t_end, parameters)``, or ``sweep(system, t_end, parameters)``.

    Parameters
    ----------
    model, rig, t_end
        As in `simulate`; every run starts with these.
    parameters : mapping of str to array_like, or DataFrame
        By name; the first axis is the run: shape (runs,) for one number or the same number in all
        elements, (runs, n) for one per element. Names are the chart's parameters (``k``, ``sigma``,
        ``C``, ``v_c``), ``weights``, ``sigma_2``, ``F_c``, ``F_s``, ``v_s``, ``delta``, and the
        rig's numbers (``mass``, ``stiffness``, ``speed``). Of a system, ``numbers.m`` is one of its
        numbers, and ``gear.F_s`` a parameter of the contact gear. In a DataFrame, use ``k1``,
        ``k2`` ... for elements.
    executor : concurrent.futures.Executor, optional
        Where to run: a process pool, or the executor of a Dask ``Client`` (extra ``cluster``).
        Threads on this machine if omitted; compiled runs release the interpreter lock.
    t_start, initial
        As in `simulate`.
    settings : Settings, optional
        How to integrate and what to record: the end of each run (also for ``"all"``, because runs
        have different steps), or rows at ``t_eval``. If omitted, ``engine="compiled"``, which needs
        the extra ``fast``.
    progress : bool, optional
        Show a progress bar on standard error; by default if that is a terminal.
    coverage : bool
        Whether `Sweep.coverage` counts the clauses of guards, too.
    **options
        Fields of `Settings` by name, which override those of `settings`.

    Returns
    -------
    Sweep
        A run that fails gives a row with its error; the other runs continue.

    Raises
    ------
    ParameterError
        If a name is unknown, or lengths differ. A value that violates its rule is the outcome of
        its run.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> result = sweep(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0,
    ...                {"F_s": [1.5, 1.8]}, engine="machines")
    >>> result.outcome.tolist(), result.transition_count.tolist()
    (['ok', 'ok'], [4, 4])
    """
    on, end, given = shifted("sweep(system, t_end, parameters)", model, rig, t_end, parameters)
    checked_kind("coverage", coverage, bool, "True or False")
    begin = _Common(end, t_start, initial, _chosen(settings, options), coverage)
    what = mounted(model, on, begin.settings.held_period)
    if begin.settings.engine == "compiled":
        check_llvmlite()
    begin = begin.counting(begin.start(what))  # errors common to all runs are raised once, here
    values = _values(what, given)
    runs = len(next(iter(values.values())))
    if executor is not None and not hasattr(executor, "submit"):
        raise ParameterError(
            "it must be an executor, for example ProcessPoolExecutor(4) of concurrent.futures",
            place="executor",
            value=executor,
        )
    collected = _Collected(what, runs, begin)
    size = max(1, min(AT_ONCE, runs // AT_ONCE))
    chunks = [range(start, min(start + size, runs)) for start in range(0, runs, size)]
    # Dask treats tasks with equal arguments as one, and returns an earlier failure as their result.
    name = uuid.uuid4().hex
    with contextlib.ExitStack() as stack:
        if executor is None:
            executor = stack.enter_context(_threads())
        shown = stack.enter_context(_bar(runs, progress))
        waiting: dict[Future[_Results], range] = {}
        try:
            with _interrupts_deferred():
                for chunk in chunks:
                    part = {key: array[chunk.start : chunk.stop] for key, array in values.items()}
                    try:
                        task = executor.submit(_run_chunk, what, begin, part, name)
                    except Exception as error:
                        if not isinstance(error, BrokenExecutor):  # broken by an earlier task
                            error = _NotDelivered(f"{type(error).__name__}: {error}")
                        task = Future()
                        task.set_exception(error)
                    waiting[task] = chunk
            for future in as_completed(list(waiting)):
                chunk = waiting.pop(future)
                collected.take(chunk, _results(future, len(chunk)))
                shown(len(chunk))
        finally:  # also on Ctrl-C: pending tasks are not started
            for future in waiting:
                future.cancel()
    return collected.sweep(values)


# --------------------------------------------------------------------------- parameters
def _values(
    what: Mounted, parameters: Mapping[str, ArrayLike] | pandas.DataFrame
) -> dict[str, FloatArray]:
    """Check the names and shapes of the parameters."""
    if not hasattr(parameters, "keys"):
        called = "system" if what.named else "model, rig"
        raise ParameterError(
            "it must give values by name, for example {'k': [1.0, 2.0]}: "
            f"sweep({called}, t_end, parameters)",
            place="parameters",
            value=parameters,
        )
    names = known_in(what)
    given = {str(name): parameters[name] for name in parameters}
    if not isinstance(parameters, Mapping):
        given = _elements_joined(given, names)
    if not given:
        raise ParameterError("parameters is empty", advice="give at least one name with its values")
    arrays: dict[str, FloatArray] = {}
    for name, value in given.items():
        if name not in names:
            raise unknown("parameter", name, names, place="parameters")
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise ParameterError(f"parameters[{name!r}] is not an array of numbers") from None
        _, n = names[name]
        if array.shape[1:] not in (((), (n,)) if n else ((),)) or array.ndim == 0:
            if array.ndim == 0 and value is not None:
                raise ParameterError(
                    "it must be a list, one value for each run",
                    place=f"parameters[{name!r}]",
                    value=value,
                    advice=f"write [{shown(value)}]",
                )
            wanted = f"(runs,) or (runs, {n})" if n else "(runs,)"
            raise ParameterError(
                f"parameters[{name!r}] has shape {array.shape}", advice=f"it must be {wanted}"
            )
        arrays[name] = array
    lengths = {name: len(array) for name, array in arrays.items()}
    if len(set(lengths.values())) > 1 or 0 in lengths.values():
        raise ParameterError(
            "parameters must have one entry per run, at least one; these have "
            + ", ".join(f"{name}: {length}" for name, length in lengths.items())
        )
    return arrays


def _elements_joined(
    columns: Mapping[str, Any], names: Mapping[str, tuple[Parameter, int]]
) -> dict[str, Any]:
    """Join the columns k1, k2 ... of a DataFrame into an array of shape (runs, n)."""
    joined: dict[str, Any] = {}
    for name, (_, n) in names.items():
        parts = [column_name(name, i) for i in range(n)]
        if any(part in columns for part in parts) and name not in columns:
            missing = [part for part in parts if part not in columns]
            if missing:
                raise ParameterError(
                    f"parameters has columns of {name!r} for some elements, but not "
                    f"{', '.join(missing)}"
                )
            joined[name] = np.stack([np.asarray(columns[part]) for part in parts], axis=1)
    taken = {column_name(name, i) for name in joined for i in range(names[name][1])}
    return {name: value for name, value in columns.items() if name not in taken} | joined


# --------------------------------------------------------------------------- running
@dataclass(frozen=True, eq=False)
class _Result:
    """One run, as returned by a worker."""

    outcome: str
    message: str
    end: Mapping[str, Any] | None  # t, x, v, F, z, mode
    log: NDArray[Any]
    rows: Mapping[str, FloatArray] | None
    ends: Mapping[str, float] = field(default_factory=dict)  # of bodies, states, sampled values
    coverage: Coverage | None = None  # if it was asked for, and counted from rows


@dataclass(frozen=True, eq=False)
class _Results:
    """Some runs, and the tables in which all of them counted their rows."""

    runs: list[_Result]
    tables: CountTables | None = None


@dataclass(frozen=True)
class _Common:
    """What all runs of a sweep have in common."""

    t_end: float
    t_start: float
    initial: Mapping[str, Any] | None
    settings: Settings
    coverage: bool = False
    counted: Counting | None = None  # how machine code counts rows, so that none is kept

    def counting(self, start: Problem) -> _Common:
        """Return the same with rows counted as they come, where that is possible.

        Functions of the user's are not called for it: they might fail.
        """
        program, own = start.program, self.settings.output == "end"
        if self.coverage and own and start.chosen.engine == "compiled" and not program.callables:
            return replace(self, counted=counting_of(program.plan))
        return self

    def start(self, what: Mounted) -> Problem:
        settings = self.settings
        if self.coverage and self.counted is None and settings.output == "end":
            settings = replace(settings, output="all")
        return Problem.on(what, self.t_end, settings, t_start=self.t_start, initial=self.initial)


def _chosen(settings: Settings | None, options: SettingOptions) -> Settings:
    """Return the settings of each run: a sweep records ends unless rows are requested."""
    if settings is not None:
        checked_kind("settings", settings, Settings, "a Settings, for example Settings(rtol=1e-8)")
    whole = settings is None or settings.output == "all"
    if whole and options.get("t_eval") is None and options.get("output") is None:
        options = {**options, "output": "end"}
    if settings is None:
        options = {"engine": "compiled", **options}
    known = [each.name for each in fields(Settings)]
    for name, value in options.items():
        if name not in known and isinstance(value, Iterable) and not isinstance(value, str):
            raise ParameterError(
                f"a sweep takes no argument {name!r}",
                advice=meant(name, known).strip()
                or f"what varies is given by its name: parameters={{{name!r}: [...]}}",
            )
    chosen = Settings.of(settings, "a sweep", **options)
    if chosen.output == "all":
        raise ParameterError(
            "output is 'all'", advice="use 'end' or 't_eval', because runs have different steps"
        )
    return chosen


def _run_chunk(
    what: Mounted,
    begin: _Common,
    part: Mapping[str, FloatArray],
    _sweep: str,
) -> _Results:
    """Run some sets of parameters, one after the other, for one sweep."""
    results = []
    compiled: CompiledRun | None = None
    tables = None if begin.counted is None else CountTables.empty(begin.counted)
    for row in range(len(next(iter(part.values())))):
        values = {name: array[row] for name, array in part.items()}
        run: Run | CompiledRun | None = None
        outcome, message = "ok", ""
        try:
            its = varied(what, values)
            if compiled is not None and same_text(compiled.start.system, its.system):
                compiled.reset(its)  # the same buffers and machine code
                run = compiled
            elif begin.settings.engine == "compiled":
                run = compiled = CompiledRun(begin.start(its), tables=tables)
            else:
                run = Run(begin.start(its))
            while run.advance():
                pass
        except GMSError as error:
            outcome, message = type(error).__name__, cut(str(error), LONGEST - 10)
        watched = begin.coverage and tables is None
        results.append(_result(run, outcome, message, watched))
    return _Results(results, tables)


def _result(
    run: Run | CompiledRun | None, outcome: str, message: str, watched: bool = False
) -> _Result:
    """Return values of each contact, and of everything else that the user has named."""
    if run is None:
        return _Result(outcome, message, None, np.empty(0, dtype=LOG), None)
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
    return _Result(outcome, message, end, _log_of(trace.firings), rows, ends, counts)


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


def _log_of(firings: Firings) -> NDArray[Any]:
    log = np.empty(len(firings), dtype=LOG)
    log["t"], log["element"], log["edge"] = firings.t, firings.machine, firings.edge
    for name, column in zip(LOG_NUMBERS, firings.numbers.T, strict=True):
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


class _NotDelivered(Exception):
    """A task did not reach a worker: something in it cannot be pickled."""


def _results(future: Future[_Results], count: int) -> _Results:
    """Return the results of a task; a lost task gives rows that say so."""
    try:
        return future.result()
    except _NotDelivered as error:
        message = (
            f"the run could not be sent to a worker ({cut(str(error))}); give signals as "
            "expressions in t or as arrays, or use threads (executor=None)"
        )
        lost = _Result("NotSent", message, None, np.empty(0, dtype=LOG), None)
        return _Results([lost] * count)
    except Exception as error:  # a broken pool, a worker out of memory, or an unpicklable result
        message = (
            f"the worker failed: {type(error).__name__}: {cut(str(error), LONGEST // 2)}; run "
            "these again, or use threads (executor=None)"
        )
        lost = _Result(type(error).__name__, message, None, np.empty(0, dtype=LOG), None)
        return _Results([lost] * count)


class _Collected:
    """Preallocated columns, filled in any order."""

    def __init__(self, what: Mounted, runs: int, begin: _Common) -> None:
        self.what, self.counted, t_eval = what, begin.counted, begin.settings.t_eval
        n, several = sum(each.n for each in what.system.machines), len(what.system.machines)
        columns = (several,) if several > 1 else ()
        self.times = np.array([] if t_eval is None else t_eval, dtype=np.float64)
        self.outcome, self.message = ["lost"] * runs, [""] * runs
        self.t = np.full(runs, np.nan)
        self.end = {name: np.full((runs, *columns), np.nan) for name in ("x", "v", "F")}
        self.end["z"] = np.full((runs, n), np.nan)
        self.ends = {name: np.full(runs, np.nan) for name in what.values}
        self.mode = np.full((runs, n), -1, dtype=np.int64)
        self.logs: list[NDArray[Any]] = [np.empty(0, dtype=LOG)] * runs
        rows = runs, self.times.size
        self.covered: Coverage | None = None  # so far, from rows
        self.fired: list[LogCounts] = []  # so far: logs of all runs at once would take memory
        self.tables = None if self.counted is None else CountTables.empty(self.counted)
        self.rows: dict[str, FloatArray] = {}
        if t_eval is not None:
            self.rows = {name: np.full((*rows, *columns), np.nan) for name in ("x", "v", "F")}
            self.rows["z"] = np.full((*rows, n), np.nan)
            self.rows |= {row_name(name): np.full(rows, np.nan) for name in what.values}

    def take(self, chunk: range, results: _Results) -> None:
        """Store results in their rows."""
        for run, result in zip(chunk, results.runs, strict=True):
            self.outcome[run], self.message[run] = result.outcome, result.message
            result.log["run"] = run
            self.logs[run] = result.log
            if result.end is not None:
                self.t[run], self.mode[run] = result.end["t"], result.end["mode"]
                for name, values in self.end.items():
                    values[run] = result.end[name]
            for name, value in result.ends.items():
                self.ends[name][run] = value
            for name, values in (result.rows or {}).items():
                self.rows[name][run, : len(values)] = values
        found = [each.coverage for each in results.runs if each.coverage is not None]
        if found:
            self.covered = Coverage.merged([*filter(None, [self.covered]), *found])
            return
        if self.tables is not None and results.tables is not None:
            self.tables.add(results.tables)
        fired = self._fired(chunk)
        pairs = zip(self.fired, fired, strict=True)
        self.fired = [a + b for a, b in pairs] if self.fired else fired

    def _fired(self, chunk: range) -> list[LogCounts]:
        """Return what the logs of some runs show of each chart."""
        logs = self.logs[chunk.start : chunk.stop]
        # Column by column: numpy compares the names of all columns at each step.
        run, owner, which = (
            np.concatenate([log[name] for log in logs]) for name in ("run", "element", "edge")
        )
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

    def coverage(self) -> Coverage:
        """Return what all runs have tried."""
        contacts = self.what.system.machines
        names = [each.name if self.what.named else "" for each in contacts]
        if not self.fired:
            assert self.covered is not None
            return self.covered
        parts = [of_log(each.chart, log) for each, log in zip(contacts, self.fired, strict=True)]
        if self.tables is not None:
            tables = zip(contacts, self.fired, self.tables.parts(), strict=True)
            parts = [of_tables(each.chart, log, *part) for each, log, part in tables]
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
        return Sweep(
            parameters,
            np.array(self.outcome),
            np.array(self.message),
            self.t,
            **self.end,
            states=np.concatenate(states, axis=1),
            transitions=np.concatenate(self.logs).view(Log),
            edges=tuple(edges),
            times=self.times,
            rows=self.rows,
            ends=self.ends,
            owners=np.array(owners if self.what.named else [], dtype=np.str_),
            coverage=self.coverage(),
        )


# --------------------------------------------------------------------------- helpers
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(os.cpu_count() or 1)


@contextlib.contextmanager
def _interrupts_deferred() -> Iterator[None]:
    """Defer Ctrl-C: in the middle of `submit` it would leave the executor's lock locked."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed:
        raise KeyboardInterrupt


@contextlib.contextmanager
def _bar(runs: int, progress: bool | None) -> Iterator[Callable[[int], None]]:
    """Show how many runs are complete."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    console = Console(stderr=True)
    if not (console.is_terminal if progress is None else progress):
        yield lambda _: None
        return
    columns = "runs", BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("runs", total=runs)
        yield lambda done: bar.advance(task, done)
