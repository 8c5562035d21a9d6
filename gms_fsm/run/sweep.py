"""sweep(): thousands of runs over sets of parameters."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.charts.parameters import FloatArray, Parameter
from gms_fsm.errors import GMSError, ParameterError, cut, shown
from gms_fsm.foundation.arguments import checked_kind, meant, refusing, unknown
from gms_fsm.gradients.directions import INITIAL
from gms_fsm.lowering.compiling import check_llvmlite
from gms_fsm.lowering.printing.counting import Counting, counting_of
from gms_fsm.run._swept import LOG, LONGEST, Sweep
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun
from gms_fsm.run.recording.counted import LARGE, CountTables
from gms_fsm.run.repeated.beginnings import (
    as_numbers,
    initial_size,
    periods_of,
    shown_values,
    signals_given,
    signals_of,
    with_initial,
    with_periods,
    with_signals,
)
from gms_fsm.run.repeated.block import RepeatedRun
from gms_fsm.run.repeated.collected import (
    Collected,
    ManyRuns,
    RunResult,
    RunResults,
    result_of,
)
from gms_fsm.run.repeated.numbers import RepeatedRuns
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.run.simulate import Run
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted, mounted, shifted
from gms_fsm.systems.numbers import column_name, known_in, varied
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.system import System

if TYPE_CHECKING:
    import pandas

__all__ = ["Sweep", "sweep"]

AT_ONCE = 256  # maximum number of runs per task
WORKERS = 16  # assumed, where their number is not known


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
        numbers, and ``gear.F_s`` a parameter of the contact gear. ``initial.v`` and ``initial.z2``
        are initial values, as `initial` names them; ``pid.period`` is the period of what ticks;
        ``signals.u`` is a list of signals for an input or a signal, without ``signals.`` for that
        of a rig (``v``, ``F_a``). In a DataFrame, use ``k1``, ``k2`` ... for elements.
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
    if isinstance(t_end, Mapping) and isinstance(parameters, int | float):
        raise ParameterError(
            "it gives values by name: t_end and parameters are swapped",
            place="t_end",
            value=t_end,
            advice="write sweep(model, rig, t_end, parameters)",
        )
    on, end, given = shifted("sweep(system, t_end, parameters)", model, rig, t_end, parameters)
    checked_kind("coverage", coverage, bool, "True or False")
    begin = _Common(end, t_start, initial, _chosen(settings, options), coverage)
    what = mounted(model, on, begin.settings.held_period)
    if begin.settings.engine == "compiled":
        check_llvmlite()
    signals = signals_given(what, given)
    one = {name: each[0] for name, each in signals.items()}
    first = begin.start(with_signals(what, one))  # errors common to all runs are raised here
    what, numbers = as_numbers(what, signals, (first.t_start, first.t_end))
    if numbers:
        one = {name: each for name, each in one.items() if name not in numbers}
        first = begin.start(with_signals(what, one))
    begin = begin.counting(first)
    values = _values(first, given, signals)
    runs = len(next(iter(values.values())))
    columns = {name: each for name, each in values.items() if name not in numbers}
    for each in numbers.values():
        columns |= each
    if executor is not None and not hasattr(executor, "submit"):
        raise ParameterError(
            "it must be an executor, for example ProcessPoolExecutor(4) of concurrent.futures",
            place="executor",
            value=executor,
        )
    collected = Collected(what, runs, begin.counted, begin.settings.t_eval)
    quick = executor is None and begin.settings.engine == "compiled"
    known = os.cpu_count() if quick else getattr(executor, "_max_workers", WORKERS)
    chunks = _chunks(runs, known or 1)
    # Dask treats tasks with equal arguments as one, and returns an earlier failure as their result.
    name = uuid.uuid4().hex
    with contextlib.ExitStack() as stack:
        _ready[name] = _repeated(what, begin, columns)
        stack.callback(_ready.pop, name)
        if executor is None:
            executor = stack.enter_context(_threads())
        shown = stack.enter_context(_bar(runs, progress))
        waiting: dict[Future[RunResults], range] = {}
        try:
            with _interrupts_deferred():
                for chunk in chunks:
                    part = {key: array[chunk.start : chunk.stop] for key, array in columns.items()}
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
    return collected.sweep({name: shown_values(each) for name, each in values.items()})


# --------------------------------------------------------------------------- parameters
def _values(
    start: Problem,
    parameters: Mapping[str, ArrayLike] | pandas.DataFrame,
    signals: Mapping[str, NDArray[Any]],
) -> dict[str, NDArray[Any]]:
    """Check the names and shapes of the parameters."""
    what = start.what
    if not hasattr(parameters, "keys"):
        called = "system" if what.named else "model, rig"
        raise ParameterError(
            "it must give values by name, for example {'k': [1.0, 2.0]}: "
            f"sweep({called}, t_end, parameters)",
            place="parameters",
            value=parameters,
        )
    names = {**periods_of(what), **known_in(what)}
    given = {str(name): parameters[name] for name in parameters}
    if not isinstance(parameters, Mapping):
        given = _elements_joined(given, names)
    if not given:
        raise ParameterError("parameters is empty", advice="give at least one name with its values")
    arrays: dict[str, NDArray[Any]] = {}
    for name, value in given.items():
        if name in signals:
            arrays[name] = signals[name]
            continue
        begins = name.startswith(INITIAL) and name not in names
        if not begins and name not in names:
            raise unknown("parameter", name, [*names, *signals_of(what)], place="parameters")
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise ParameterError(f"parameters[{name!r}] is not an array of numbers") from None
        n = initial_size(start, name) if begins else names[name][1]
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
@dataclass(frozen=True)
class _Common:
    """What all runs of a sweep have in common."""

    t_end: float
    t_start: float
    initial: Mapping[str, Any] | None
    settings: Settings
    coverage: bool = False
    counted: Counting | None = None  # how rows are counted, so that none is kept

    def counting(self, start: Problem) -> _Common:
        """Return the same with rows counted as they come, where that is possible.

        Functions of the user's are not called for it: they might fail.
        """
        if not self.coverage or self.settings.output != "end" or start.program.callables:
            return self
        found = counting_of(start.program.plan)
        large = found is not None and found.size > LARGE
        return self if large and start.chosen.engine != "compiled" else replace(self, counted=found)

    def start(self, what: Mounted, initial: Mapping[str, Any] | None = None) -> Problem:
        settings = self.settings
        if self.coverage and self.counted is None and settings.output == "end":
            settings = replace(settings, output="all")
        given = self.initial if initial is None else initial
        return Problem.on(what, self.t_end, settings, t_start=self.t_start, initial=given)


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
            inner = value if isinstance(value, Mapping) else {name: "[...]"}
            varied = ", ".join(f"{each!r}: [...]" for each in inner)
            raise ParameterError(
                f"a sweep takes no argument {name!r}",
                advice=meant(name, known).strip()
                or f"what varies is given by its name: parameters={{{varied}}}",
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
    sweep_name: str,
) -> RunResults:
    """Run some sets of parameters, one after the other, for one sweep."""
    tables = None if begin.counted is None else CountTables.empty(begin.counted)
    many = _many(what, begin, part, sweep_name, tables)
    left = np.full(len(next(iter(part.values()))), True)
    if many is not None:
        left[many.which] = False
        if tables is not None and left.any():  # those that failed have been counted
            tables, many, left[:] = CountTables.empty(tables.counting), None, True
    rows = np.flatnonzero(left).tolist()
    return RunResults(_each(what, begin, part, rows, tables) if rows else {}, tables, many)


def _each(
    what: Mounted,
    begin: _Common,
    part: Mapping[str, FloatArray],
    rows: Iterable[int],
    tables: CountTables | None,
) -> dict[int, RunResult]:
    """Make runs one by one: with numbers that are another program, or that may be refused."""
    results: dict[int, RunResult] = {}
    known, signals = known_in(what), signals_of(what)
    driven = [name for name in part if name in signals]
    others = [name for name in part if name not in known and name not in signals]
    periods = [name for name in others if not name.startswith(INITIAL)]
    first = None
    if len(others) > len(periods):
        first = begin.start(with_signals(what, {name: part[name][0] for name in driven}))
    for row in rows:
        values = {name: array[row] for name, array in part.items()}
        run: Run | CompiledRun | None = None
        outcome, message = "ok", ""
        try:
            its = varied(what, {name: each for name, each in values.items() if name in known})
            its = with_periods(its, {name: values[name] for name in periods})
            its = with_signals(its, {name: values[name] for name in driven})
            begun = None
            if first is not None:
                given = {name: values[name] for name in others if name not in periods}
                begun = with_initial(first, given)
            start = begin.start(its, begun)
            made = CompiledRun if begin.settings.engine == "compiled" else Run
            run = made(start, tables=tables)
            while run.advance():
                pass
        except GMSError as error:
            outcome, message = type(error).__name__, cut(str(error), LONGEST - 10)
        if isinstance(run, Run) and run.counter is not None:
            run.counter.put()
        watched = begin.coverage and tables is None
        results[row] = result_of(run, outcome, message, watched)
    return results


# What all threads of this process share for a sweep, by its name; None if it repeats no run.
_ready: dict[str, RepeatedRuns | None] = {}
_of_thread = threading.local()  # what a thread has made ready for the sweep that it works at


def _many(
    what: Mounted,
    begin: _Common,
    part: Mapping[str, FloatArray],
    sweep_name: str,
    tables: CountTables | None,
) -> ManyRuns | None:
    """Make the runs whose numbers need no look, all in machine code; None if there are none."""
    if getattr(_of_thread, "sweep_name", "") != sweep_name:
        try:
            runs = _ready[sweep_name]
        except KeyError:  # in another process
            runs = _repeated(what, begin, part)
        _of_thread.sweep_name, _of_thread.runs, _of_thread.run = sweep_name, runs, None
    cells = None if _of_thread.runs is None else _of_thread.runs.cells(part)
    if cells is None or not cells.certain.any():
        return None
    if _of_thread.run is None:
        _of_thread.run = RepeatedRun(_of_thread.runs.start, tables)
    run: RepeatedRun = _of_thread.run
    if not run.columns.block.is_whole:  # to begin anew is to copy it
        return None
    which = np.flatnonzero(cells.certain)
    found = run.many(cells.places, np.ascontiguousarray(cells.values[which]), tables)
    return ManyRuns.of(run.columns.start, which, found)


def _repeated(
    what: Mounted, begin: _Common, values: Mapping[str, NDArray[Any]]
) -> RepeatedRuns | None:
    """Return what repeats a run with the numbers of others; None if that is not possible."""
    driven = any(body.driven and what.named for body in what.system.bodies)
    if begin.settings.engine != "compiled" or driven or signals_of(what).keys() & values.keys():
        return None
    runs = RepeatedRuns(begin.start(what))
    return runs if runs.start.output == "end" and runs.known is not None else None


class _NotDelivered(Exception):
    """A task did not reach a worker: something in it cannot be pickled."""


def _results(future: Future[RunResults], count: int) -> RunResults:
    """Return the results of a task; a lost task gives rows that say so."""
    try:
        return future.result()
    except _NotDelivered as error:
        message = (
            f"the run could not be sent to a worker ({cut(str(error))}); give signals as "
            "expressions in t or as arrays, or use threads (executor=None)"
        )
        lost = RunResult("NotSent", message, None, np.empty(0, dtype=LOG), None)
        return RunResults(dict.fromkeys(range(count), lost))
    except Exception as error:  # a broken pool, a worker out of memory, or an unpicklable result
        message = (
            f"the worker failed: {type(error).__name__}: {cut(str(error), LONGEST // 2)}; run "
            "these again, or use threads (executor=None)"
        )
        lost = RunResult(type(error).__name__, message, None, np.empty(0, dtype=LOG), None)
        return RunResults(dict.fromkeys(range(count), lost))


# --------------------------------------------------------------------------- helpers
def _chunks(runs: int, workers: int) -> list[range]:
    """Return the runs of each task: ever fewer, so that no worker waits long for the last one."""
    chunks: list[range] = []
    start = 0
    while start < runs:
        size = max(1, min(AT_ONCE, max((runs - start) // (4 * workers), runs // 64)))
        chunks.append(range(start, min(start + size, runs)))
        start += size
    return chunks


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
