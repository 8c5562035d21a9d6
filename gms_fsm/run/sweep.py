"""sweep(): thousands of runs over sets of parameters."""

from __future__ import annotations

import contextlib
import math
import os
import signal
import threading
import uuid
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm._extras import require
from gms_fsm._files import written_whole
from gms_fsm.charts.parameters import QUANTITIES, WEIGHTS, FloatArray
from gms_fsm.errors import (
    GMSError,
    OutputError,
    ParameterError,
    TraceFileError,
    cut,
    shown,
    why,
)
from gms_fsm.lowering._compiled import check_numba
from gms_fsm.lowering.layout import LOG_NUMBERS
from gms_fsm.run._compiled_run import CompiledRun
from gms_fsm.run._recording import scope_of
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.run.simulate import Run
from gms_fsm.run.start import Start
from gms_fsm.systems.models import Model, parameter_names, with_values
from gms_fsm.systems.rigs import Rig, with_numbers
from gms_fsm.traces._archives import member
from gms_fsm.traces.rows import column_name

if TYPE_CHECKING:
    import pandas
    import xarray

__all__ = ["Sweep", "sweep"]

AT_ONCE = 64  # runs a task, at most
_LOG = np.dtype(
    [
        ("run", "i8"),
        ("t", "f8"),
        ("element", "i8"),
        ("edge", "i8"),
        *((name, "f8") for name in LOG_NUMBERS),
    ]
)


@dataclass(frozen=True, eq=False)
class Sweep:
    """The results of many runs, one row a run, in the order of the parameters.

    Attributes
    ----------
    parameters : mapping of str to ndarray, shape (runs,) or (runs, n)
        What was varied.
    outcome : ndarray of str, shape (runs,)
        ``"ok"``, or the name of the error that ended the run.
    message : ndarray of str, shape (runs,)
        The error's text, else empty.
    t, x, v, F : ndarray, shape (runs,)
        The end of each run: s, m, m/s, N. NaN for a run that could not start.
    z : ndarray, shape (runs, n), m
        Deflections at the end.
    states : ndarray of str, shape (runs, n)
        Active states at the end.
    transitions : numpy.recarray
        All firings: ``run, t, element, edge, z, v, s, F_before, F_after``; run and element count
        from 0, ``edge`` is an index into `edges`.
    edges : tuple of str
        Names of the chart's edges.
    times : ndarray, shape (rows,)
        With ``output="t_eval"`` the times of the rows, else empty.
    rows : mapping of str to ndarray
        With ``output="t_eval"``: ``x, v, F`` of shape (runs, rows), ``z`` of shape (runs, rows, n).
    """

    parameters: Mapping[str, FloatArray]
    outcome: NDArray[np.str_]
    message: NDArray[np.str_]
    t: FloatArray
    x: FloatArray
    v: FloatArray
    F: FloatArray
    z: FloatArray
    states: NDArray[np.str_]
    transitions: Any
    edges: tuple[str, ...]
    times: FloatArray
    rows: Mapping[str, FloatArray]

    def __len__(self) -> int:
        return int(self.t.size)

    def __repr__(self) -> str:
        bad = int((self.outcome != "ok").sum())
        return (
            f"<Sweep: {len(self)} runs over {', '.join(self.parameters)}; {bad} failed, "
            f"{len(self.transitions)} transitions>"
        )

    @property
    def transition_count(self) -> NDArray[np.int64]:
        """How often an edge fired in each run, shape (runs,)."""
        return np.bincount(self.transitions["run"], minlength=len(self))

    def sequence(self, run: int) -> list[tuple[int, str]]:
        """Return which element took which edge in a run, in order.

        Parameters
        ----------
        run : int
            From 0.

        Returns
        -------
        list of (int, str)
            Elements count from 0.
        """
        log = self.transitions[self.transitions["run"] == run]
        return [(int(i), self.edges[edge]) for i, edge in zip(log.element, log.edge, strict=True)]

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per run, by column.

        Returns
        -------
        dict of str to ndarray, shape (runs,)
            Parameters, outcome, end of the run; columns of elements are numbered from 1. A
            parameter with the name of a result is called ``parameter_<name>``.

        Examples
        --------
        >>> from gms_fsm import GMS, GMSParameters, Prescribed
        >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
        >>> result = sweep(model, Prescribed("0.2"), 1.0, {"F_s": [1.5]}, engine="machines")
        >>> list(result.columns())[:8]
        ['F_s', 'outcome', 'message', 't', 'x', 'v', 'F', 'z1']
        """
        results: dict[str, NDArray[Any]] = {
            "outcome": self.outcome,
            "message": self.message,
            "t": self.t,
            "x": self.x,
            "v": self.v,
            "F": self.F,
        }
        results |= _numbered("z", self.z) | _numbered("state", self.states)
        results |= {"transitions": self.transition_count}
        parameters = {
            _apart(column, results): numbers
            for name, values in self.parameters.items()
            for column, numbers in _numbered(name, values).items()
        }
        return parameters | results

    def to_dataframe(self) -> pandas.DataFrame:
        """Return one row per run as a pandas DataFrame (extra ``pandas``).

        Returns
        -------
        DataFrame
            What `columns` gives.
        """
        pandas = require("pandas", "pandas")
        return pandas.DataFrame(self.columns(), index=pandas.RangeIndex(len(self), name="run"))

    def to_xarray(self) -> xarray.Dataset:
        """Return the results as an xarray Dataset (extra ``sweep``).

        Returns
        -------
        Dataset
            Dimensions ``run``, ``element`` (from 1) and, with rows, ``time``; units as attributes.
        """
        xarray = require("xarray", "sweep")
        units = {name: QUANTITIES[name].unit for name in ("t", "x", "v", "F", "z")}
        data: dict[str, Any] = {}
        for name in ("outcome", "message", "t", "x", "v", "F"):
            data[f"{name}_end" if name in units else name] = ("run", getattr(self, name))
        data["z_end"] = (("run", "element"), self.z)
        data["state_end"] = (("run", "element"), self.states)
        data["transitions"] = ("run", self.transition_count)
        for name, values in self.rows.items():
            data[name] = (("run", "time", "element")[: values.ndim], values)
        coordinates = {"run": np.arange(len(self)), "element": np.arange(1, self.z.shape[1] + 1)}
        if self.times.size:
            coordinates["time"] = self.times
        taken = {*data, *coordinates}
        parameters = {
            _apart(name, taken): (("run", "element")[: values.ndim], values)
            for name, values in self.parameters.items()
        }
        dataset = xarray.Dataset(parameters | data, coordinates)
        for name, variable in dataset.variables.items():
            if unit := units.get(str(name).removesuffix("_end")):
                variable.attrs["units"] = unit
        return dataset

    def save(self, path: str | Path) -> Path:
        """Write the sweep to ``.npz`` (everything) or ``.parquet`` (one row a run).

        With Parquet the transitions lie beside it in ``<name>.transitions.parquet``.

        Parameters
        ----------
        path : str or Path
            Where to.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OutputError
            If the folder cannot be written or the ending is another.
        """
        path = Path(path)
        if path.suffix == ".npz":
            from gms_fsm._version import __version__

            arrays: dict[str, Any] = {"format": np.array(_FORMAT), "program": __version__}
            arrays |= {f"parameter_{name}": values for name, values in self.parameters.items()}
            arrays |= {f"rows_{name}": values for name, values in self.rows.items()}
            arrays |= {name: getattr(self, name) for name in _SAVED}
            arrays |= {"transitions": np.asarray(self.transitions), "elements": self.z.shape[1]}
            arrays["edges"] = np.array(self.edges, dtype=np.str_)
            return written_whole(path, lambda file: np.savez_compressed(file, **arrays))
        if path.suffix == ".parquet":
            pandas = require("pandas", "sweep")
            require("pyarrow", "sweep")
            log = pandas.DataFrame(
                {name: self.transitions[name] for name in _LOG.names or ()}
                | {"edge": np.array(self.edges, dtype=object)[self.transitions["edge"]]}
            )
            beside = path.with_name(f"{path.stem}.transitions.parquet")
            written_whole(beside, log.to_parquet)
            return written_whole(path, self.to_dataframe().to_parquet)
        raise OutputError(f"{path}: a sweep is saved as .npz or .parquet, not {path.suffix!r}")

    @classmethod
    def load(cls, path: str | Path) -> Sweep:
        """Read a sweep written to ``.npz``.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Sweep
            With equal arrays.

        Raises
        ------
        TraceFileError
            If the file is missing, damaged, or not a sweep of this format; nothing in it is
            executed.
        """
        try:
            # Opened here: np.load leaves a damaged file open.
            with Path(path).open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                return _read(file)
        except FileNotFoundError:
            raise TraceFileError(
                f"{path}: there is no such file; check its name and the folder"
            ) from None
        except Exception as error:  # numpy and zipfile raise many kinds over damaged files
            raise TraceFileError(
                f"{path}: not a sweep, or damaged ({why(error)}); run it again"
            ) from None


# --------------------------------------------------------------------------- files
_FORMAT = "gms-fsm sweep 1"
_SAVED = ("outcome", "message", "t", "x", "v", "F", "z", "states", "times")
_LONGEST = 1000  # characters of a text


def _read(file: Any) -> Sweep:
    """Read an open archive: no array larger than that of a sweep of so many runs, all checked."""
    stamp = str(member(file, "format"))
    if stamp != _FORMAT:
        program = cut(str(member(file, "program")))
        raise ValueError(f"format {shown(stamp)} of gms-fsm {program}, not {_FORMAT!r}")
    t, times, edges = (member(file, name) for name in ("t", "times", "edges"))
    runs, rows, n = t.size, times.size, int(member(file, "elements", 8))
    texts = {"outcome": (runs,), "message": (runs,), "states": (runs, n)}
    floats: dict[str, tuple[int, ...]] = dict.fromkeys(("x", "v", "F"), (runs,))
    floats["z"] = (runs, n)
    if rows:
        floats |= {f"rows_{name}": (runs, rows) for name in ("x", "v", "F")}
        floats["rows_z"] = (runs, rows, n)
    own = [name for name in file.files if name.startswith("parameter_")]
    found = {name: member(file, name, 8 * runs * n) for name in own}
    floats |= {name: (runs, n)[: array.ndim] for name, array in found.items()}
    for shapes, width in ((texts, 4 * _LONGEST), (floats, 8)):
        for name in [name for name in shapes if name not in found]:
            found[name] = member(file, name, width * math.prod(shapes[name]))
    found |= {"t": t, "times": times, "edges": edges}
    floats |= {"t": (runs,), "times": (rows,)}
    texts["edges"] = (len(edges),)
    for name, array in found.items():
        shape, kind = (texts[name], "U") if name in texts else (floats[name], "f")
        if array.shape != shape or array.dtype.kind != kind:
            raise ValueError(f"{name} is {array.dtype} {array.shape}; a sweep has {kind} {shape}")
    log = member(file, "transitions")
    if log.ndim != 1 or log.dtype != _LOG:
        raise ValueError("the transition log has other columns than a sweep has")
    for name, count in (("run", runs), ("element", n), ("edge", len(edges))):
        if log.size and not 0 <= log[name].min() <= log[name].max() < count:
            raise ValueError(f"the transition log: {name} must be within 0 to {count - 1}")
    if not (own and runs and n and (np.diff(log["run"]) >= 0).all()):
        raise ValueError("no run, no parameter, or runs not in order")
    groups = {
        group: {name.removeprefix(group): found[name] for name in found if name.startswith(group)}
        for group in ("parameter_", "rows_")
    }
    return Sweep(
        parameters=groups["parameter_"],
        rows=groups["rows_"],
        edges=tuple(edges.tolist()),
        transitions=log.view(np.recarray),
        **{name: found[name] for name in _SAVED},
    )


def sweep(
    model: Model,
    rig: Rig,
    t_end: float,
    parameters: Mapping[str, ArrayLike] | pandas.DataFrame,
    *,
    executor: Executor | None = None,
    t_start: float = 0.0,
    initial: Mapping[str, Any] | None = None,
    settings: Settings | None = None,
    progress: bool | None = None,
    **options: Unpack[SettingOptions],
) -> Sweep:
    """Run a model on a rig once for each set of parameters.

    Parameters
    ----------
    model, rig, t_end
        As in `simulate`; every run starts from these.
    parameters : mapping of str to array_like, or DataFrame
        By name, the first axis is the run: shape (runs,) for a number or the same number in all
        elements, (runs, n) for one an element. Names are the chart's parameters (``k``, ``sigma``,
        ``C``, ``v_c``), ``weights``, ``sigma_2``, ``F_c``, ``F_s``, ``v_s``, and the rig's numbers
        (``mass``, ``stiffness``, ``speed``). In a DataFrame ``k1``, ``k2`` ... are the elements'.
    executor : concurrent.futures.Executor, optional
        Where to run: a process pool, or the executor of a Dask ``Client`` (extra ``cluster``).
        Threads on this machine when left out; compiled runs do not hold the interpreter.
    t_start, initial
        As in `simulate`.
    settings : Settings, optional
        How to integrate and what to keep: the end of each run (also where it says ``"all"``: runs
        have different steps), or rows at ``t_eval``. When left out, ``engine="compiled"``, which
        needs the extra ``fast``.
    progress : bool, optional
        Show a progress bar on standard error; by default where that is a terminal.
    **options
        Fields of `Settings` by name, in place of those of `settings`.

    Returns
    -------
    Sweep
        A run that fails is a row with its error; it ends no other.

    Raises
    ------
    ParameterError
        If a name is unknown, or lengths differ. A value that breaks its rule is the outcome of
        that run.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> result = sweep(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0,
    ...                {"F_s": [1.5, 1.8]}, engine="machines")
    >>> result.outcome.tolist(), result.transition_count.tolist()
    (['ok', 'ok'], [4, 4])
    """
    begin = _Begin(t_end, t_start, initial, _chosen(settings, options))
    if begin.settings.engine == "compiled":
        check_numba()
    begin.start(model, rig)  # what is wrong for all is said once, here
    values = _values(model, rig, parameters)
    runs = len(next(iter(values.values())))
    collected = _Collected(model, runs, begin.settings.t_eval)
    size = max(1, min(AT_ONCE, runs // AT_ONCE))
    chunks = [range(start, min(start + size, runs)) for start in range(0, runs, size)]
    # Dask takes tasks with equal arguments for one, and a failure of before for its result.
    name = uuid.uuid4().hex
    with contextlib.ExitStack() as stack:
        if executor is None:
            executor = stack.enter_context(_threads())
        shown = stack.enter_context(_bar(runs, progress))
        waiting: dict[Future[list[_Result]], range] = {}
        try:
            with _undisturbed():
                for chunk in chunks:
                    part = {key: array[chunk.start : chunk.stop] for key, array in values.items()}
                    try:
                        task = executor.submit(_run_chunk, model, rig, begin, part, name)
                    except Exception as error:
                        if not isinstance(error, BrokenExecutor):  # by a task before this one
                            error = _NotSent(f"{type(error).__name__}: {error}")
                        task = Future()
                        task.set_exception(error)
                    waiting[task] = chunk
            for future in as_completed(list(waiting)):
                chunk = waiting.pop(future)
                collected.take(chunk, _results(future, len(chunk)))
                shown(len(chunk))
        finally:  # also on Ctrl-C: what has not begun is not begun
            for future in waiting:
                future.cancel()
    return collected.sweep(values)


# --------------------------------------------------------------------------- what is varied
def _values(
    model: Model, rig: Rig, parameters: Mapping[str, ArrayLike] | pandas.DataFrame
) -> dict[str, FloatArray]:
    """Check names and shapes."""
    if not hasattr(parameters, "keys"):
        raise ParameterError(
            f"parameters is {shown(parameters)}; it must give values by name, for example "
            "{'k': [1.0, 2.0]}: sweep(model, rig, t_end, parameters)"
        )
    known = (*parameter_names(model), *rig.numbers)
    given = {str(name): parameters[name] for name in parameters}
    if not isinstance(parameters, Mapping):
        given = _elements_joined(given, known, model.n)
    if not given:
        raise ParameterError("parameters is empty; give at least one name with its values")
    arrays: dict[str, FloatArray] = {}
    for name, value in given.items():
        if name not in known:
            raise ParameterError(f"parameters has {name!r}; known here are {', '.join(known)}")
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise ParameterError(f"parameters[{name!r}] is not an array of numbers") from None
        wide = name == WEIGHTS.name or np.ndim(model.values.get(name, 0.0)) > 0
        if array.shape[1:] not in (((), (model.n,)) if wide else ((),)) or array.ndim == 0:
            wanted = f"(runs,) or (runs, {model.n})" if wide else "(runs,)"
            raise ParameterError(
                f"parameters[{name!r}] has shape {array.shape}; it must be {wanted}"
            )
        arrays[name] = array
    lengths = {name: len(array) for name, array in arrays.items()}
    if len(set(lengths.values())) > 1 or 0 in lengths.values():
        raise ParameterError(
            "parameters must have one entry a run, at least one; these have "
            + ", ".join(f"{name}: {length}" for name, length in lengths.items())
        )
    return arrays


def _elements_joined(columns: Mapping[str, Any], known: Sequence[str], n: int) -> dict[str, Any]:
    """Join the columns k1, k2 ... of a DataFrame to an array of shape (runs, n)."""
    joined: dict[str, Any] = {}
    for name in known:
        parts = [column_name(name, i) for i in range(n)]
        if any(part in columns for part in parts) and name not in columns:
            missing = [part for part in parts if part not in columns]
            if missing:
                raise ParameterError(
                    f"parameters has columns of {name!r} for some elements, but not "
                    f"{', '.join(missing)}"
                )
            joined[name] = np.stack([np.asarray(columns[part]) for part in parts], axis=1)
    taken = {column_name(name, i) for name in joined for i in range(n)}
    return {name: value for name, value in columns.items() if name not in taken} | joined


# --------------------------------------------------------------------------- running
@dataclass(frozen=True, eq=False)
class _Result:
    """One run, as it comes back from wherever it ran."""

    outcome: str
    message: str
    end: Mapping[str, Any] | None  # t, x, v, F, z, mode
    log: NDArray[Any]
    rows: Mapping[str, FloatArray] | None


@dataclass(frozen=True)
class _Begin:
    """What all runs of a sweep share."""

    t_end: float
    t_start: float
    initial: Mapping[str, Any] | None
    settings: Settings

    def start(self, model: Model, rig: Rig) -> Start:
        return Start.of(
            model, rig, self.t_end, self.settings, t_start=self.t_start, initial=self.initial
        )


def _chosen(settings: Settings | None, options: SettingOptions) -> Settings:
    """Return the settings of each run: a sweep keeps ends, if not rows at wanted times."""
    whole = settings is None or settings.output == "all"
    if whole and options.get("t_eval") is None and options.get("output") is None:
        options = {**options, "output": "end"}
    if settings is None:
        options = {"engine": "compiled", **options}
    chosen = Settings.of(settings, "a sweep", **options)
    if chosen.output == "all":
        raise ParameterError(
            "output is 'all'; a sweep keeps 'end' or 't_eval' (runs have different steps)"
        )
    return chosen


def _run_chunk(
    model: Model,
    rig: Rig,
    begin: _Begin,
    part: Mapping[str, FloatArray],
    _sweep: str,
) -> list[_Result]:
    """Run some sets of parameters, one after the other, for one sweep."""
    results = []
    compiled: CompiledRun | None = None
    for row in range(len(next(iter(part.values())))):
        values = {name: array[row] for name, array in part.items()}
        run: Run | CompiledRun | None = None
        outcome, message = "ok", ""
        try:
            its_model, its_rig = with_values(model, values), with_numbers(rig, values)
            if compiled is not None:  # the same buffers and machine code, other numbers
                compiled.begin_again(its_model, its_rig)
                run = compiled
            elif begin.settings.engine == "compiled":
                run = compiled = CompiledRun(begin.start(its_model, its_rig))
            else:
                run = Run(begin.start(its_model, its_rig))
            while run.advance():
                pass
        except GMSError as error:
            outcome, message = type(error).__name__, cut(str(error), _LONGEST - 10)
        results.append(_result(run, outcome, message))
    return results


def _result(run: Run | CompiledRun | None, outcome: str, message: str) -> _Result:
    if run is None:
        return _Result(outcome, message, None, np.empty(0, dtype=_LOG), None)
    recorder, trace = run.recorder, run.recorder.trace()
    edges = {edge.name: index for index, edge in enumerate(trace.model.chart.transitions)}
    log = np.empty(len(trace.transitions), dtype=_LOG)
    for name in (_LOG.names or ())[1:]:
        log[name] = (
            trace.transitions[name]
            if name != "edge"
            else [edges[edge] for edge in trace.transitions.edge.tolist()]
        )
    rows = None
    if recorder.start.output == "t_eval":
        rows = {name: getattr(trace, name) for name in ("x", "v", "F", "z")}
    here = scope_of(recorder)
    end = {name: getattr(here, name) for name in ("t", "x", "v", "F", "z")}
    end["mode"] = here.mode[here.layout.elements]
    return _Result(outcome, message, end, log, rows)


class _NotSent(Exception):
    """A task has not come as far as a worker: something in it cannot be pickled."""


def _results(future: Future[list[_Result]], count: int) -> list[_Result]:
    """Return what a task brought; one that was lost makes rows that say so."""
    try:
        return future.result()
    except _NotSent as error:
        message = (
            f"the run could not be sent to a worker ({cut(str(error))}); give signals as "
            "expressions of t or as arrays, or use threads (executor=None)"
        )
        lost = _Result("NotSent", message, None, np.empty(0, dtype=_LOG), None)
        return [lost] * count
    except Exception as error:  # a broken pool, a worker out of memory, what cannot be pickled
        message = (
            f"the worker failed: {type(error).__name__}: {cut(str(error), _LONGEST // 2)}; run "
            "these again, or use threads (executor=None)"
        )
        lost = _Result(type(error).__name__, message, None, np.empty(0, dtype=_LOG), None)
        return [lost] * count


class _Collected:
    """Preallocated columns, filled in any order."""

    def __init__(self, model: Model, runs: int, t_eval: ArrayLike | None) -> None:
        self.model = model
        self.times = np.array([] if t_eval is None else t_eval, dtype=np.float64)
        self.outcome, self.message = ["lost"] * runs, [""] * runs
        self.ends = np.full((runs, 4), np.nan)  # t, x, v, F
        self.z = np.full((runs, model.n), np.nan)
        self.mode = np.full((runs, model.n), -1, dtype=np.int64)
        self.logs: list[NDArray[Any]] = [np.empty(0, dtype=_LOG)] * runs
        rows = runs, self.times.size
        self.rows: dict[str, FloatArray] = {}
        if t_eval is not None:
            self.rows = {name: np.full(rows, np.nan) for name in ("x", "v", "F")}
            self.rows["z"] = np.full((*rows, model.n), np.nan)

    def take(self, chunk: range, results: Sequence[_Result]) -> None:
        """Put results in their rows."""
        for run, result in zip(chunk, results, strict=True):
            self.outcome[run], self.message[run] = result.outcome, result.message
            result.log["run"] = run
            self.logs[run] = result.log
            if result.end is not None:
                end = result.end
                self.ends[run] = end["t"], end["x"], end["v"], end["F"]
                self.z[run], self.mode[run] = end["z"], end["mode"]
            for name, values in (result.rows or {}).items():
                self.rows[name][run, : len(values)] = values

    def sweep(self, parameters: Mapping[str, FloatArray]) -> Sweep:
        """Return all of it."""
        chart = self.model.chart
        names = np.array([*(state.name for state in chart.states), ""])
        t, x, v, F = self.ends.T
        return Sweep(
            parameters,
            np.array(self.outcome),
            np.array(self.message),
            t,
            x,
            v,
            F,
            self.z,
            names[self.mode],
            np.concatenate(self.logs).view(np.recarray),
            tuple(edge.name for edge in chart.transitions),
            self.times,
            self.rows,
        )


# --------------------------------------------------------------------------- helpers
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(os.cpu_count() or 1)


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Put Ctrl-C off: in the middle of `submit` it would leave the executor's lock locked."""
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
    """Show how many runs are done."""
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


def _numbered(name: str, values: NDArray[Any]) -> dict[str, Any]:
    """Return columns for a DataFrame: name, or name1, name2 ... for the elements."""
    if values.ndim == 1:
        return {name: values}
    return {column_name(name, i): values[:, i] for i in range(values.shape[1])}


def _apart(name: str, taken: Collection[str]) -> str:
    """Return a parameter's column name that is not one of the results'."""
    return f"parameter_{name}" if name in taken else name
