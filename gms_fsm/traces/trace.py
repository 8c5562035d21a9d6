"""A finished run: rows, micro-steps, the transition log, and what it was made from.

m firings at one time give m + 1 rows: micro-step 0 before, then one after each firing. Where a
slide along a surface begins or ends there is one more, at the micro-step of the row before. With
wanted times (`t_eval`) the rows are exactly those times, right-continuous; the log is always
complete.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm._extras import require
from gms_fsm._files import in_turn, leftovers, written_together, written_whole
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import (
    OutputError,
    ParameterError,
    SignalError,
    TraceFileError,
    shown,
    why,
)
from gms_fsm.lowering._compiled import observe_rows
from gms_fsm.lowering._observing import armed, observe, rate, sigmas
from gms_fsm.lowering.program import Program, lower
from gms_fsm.lowering.scales import Setting
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.traces._archives import member
from gms_fsm.traces._header import Header
from gms_fsm.traces.verdicts import Verdict
from integrators import LIVE

if TYPE_CHECKING:
    import pandas

__all__ = [
    "Rows",
    "Trace",
    "check_trace",
    "column_name",
    "dwell_times",
    "files_of",
    "interpolated",
    "log_from",
    "log_of",
    "slopes",
]


def check_trace(trace: object) -> None:
    """Raise if something that is to be drawn is no trace.

    Parameters
    ----------
    trace : object
        What was given.

    Raises
    ------
    ParameterError
        Saying what it is and how a trace is made.
    """
    if not isinstance(trace, Trace):
        raise ParameterError(
            f"trace is {shown(trace)}; it must be a Trace, from simulate(...) or Trace.load(path)"
        )


_NUMBERS = ("z", "v", "s", "F_before", "F_after")


@dataclass(frozen=True, eq=False)
class Rows:
    """Times, micro-steps, states y and modes, row by row.

    Modes are those of the elements, then for each surface whether the motion slides on it.
    """

    t: FloatArray
    microstep: NDArray[np.int64]
    y: FloatArray
    mode: NDArray[np.int64]

    def __len__(self) -> int:
        return int(self.t.size)

    def at(self, chosen: NDArray[Any] | slice) -> Rows:
        """Return some of the rows."""
        return Rows(self.t[chosen], self.microstep[chosen], self.y[chosen], self.mode[chosen])


@dataclass(frozen=True, eq=False)
class Trace:
    """What a simulation returns.

    Attributes
    ----------
    t : ndarray, shape (rows,), s
    microstep : ndarray of int, shape (rows,)
    x, v : ndarray, shape (rows,), m and m/s
    z : ndarray, shape (rows, n), m
        The chart's first variable.
    states : ndarray of str, shape (rows, n)
    s : ndarray, shape (rows, n)
        Thresholds ``w_i s(v)``, m.
    F : ndarray, shape (rows,), N
    F_elements : ndarray, shape (rows, n), N
    transitions : numpy.recarray
        Records with ``t, element`` (from 0), ``edge, source, target, z, v, s, F_before, F_after``.
    model, rig
        What ran. After `load` a generic `ChartModel`.
    settings : dict
        Method, tolerances, engine and so on.
    monitors : mapping of str to Verdict
        What the monitors of the run say, by name; empty if it had none.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> str(trace.transitions.edge[0]), round(float(trace.transitions.t[0]), 9)
    ('break_away_forward', 2.0)
    """

    rows: Rows
    stops: Rows  # both sides of every stop, kept where `rows` holds wanted times only
    transitions: Any
    model: Model
    rig: Rig
    settings: Mapping[str, Setting]
    stored: Mapping[str, FloatArray] = field(default_factory=dict, repr=False)
    monitors: Mapping[str, Verdict] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        return (
            f"<Trace: {self.model.title}; {self.rig.title}; {len(self.rows)} rows, "
            f"{len(self.transitions)} transitions>"
        )

    def __len__(self) -> int:
        return len(self.rows)

    # ------------------------------------------------------------------ columns
    @property
    def t(self) -> FloatArray:
        """Time, shape (rows,), s."""
        return self.rows.t

    @property
    def microstep(self) -> NDArray[np.int64]:
        """Micro-step of each row, shape (rows,)."""
        return self.rows.microstep

    @property
    def x(self) -> FloatArray:
        """Position, shape (rows,), m."""
        return self.rows.y[:, 0]

    @property
    def n(self) -> int:
        """Number of elements."""
        return self.model.n

    @property
    def z(self) -> FloatArray:
        """The first variable of every element (the deflection), shape (rows, n), m."""
        return self.variable(self.model.chart.variables[0])

    def variable(self, name: str) -> FloatArray:
        """Return a variable of the chart, shape (rows, n).

        Parameters
        ----------
        name : str
            One of ``model.chart.variables``.

        Returns
        -------
        ndarray, shape (rows, n)
            Its values.

        Raises
        ------
        ParameterError
            If the chart has no such variable.
        """
        variables = self.model.chart.variables
        if name not in variables:
            raise ParameterError(
                f"name is {shown(name)}; the chart has the variables {', '.join(variables)}"
            )
        start = self._first + self.model.chart.variables.index(name) * self.n
        block: FloatArray = self.rows.y[:, start : start + self.n]
        return block

    @property
    def states(self) -> NDArray[np.str_]:
        """Active state of every element, shape (rows, n)."""
        return np.array([s.name for s in self.model.chart.states])[self.modes]

    @property
    def modes(self) -> NDArray[np.int64]:
        """Index of the active state of every element, shape (rows, n)."""
        return self.rows.mode[:, : self.n]

    @property
    def v(self) -> FloatArray:
        """Velocity, shape (rows,), m/s."""
        return self._observed["v"]

    @property
    def s(self) -> FloatArray:
        """Thresholds, shape (rows, n), m; NaN where the model has no Stribeck curve."""
        return self._observed["s"]

    @property
    def F(self) -> FloatArray:
        """Friction force, shape (rows,), N."""
        return self._observed["F"]

    @property
    def F_elements(self) -> FloatArray:
        """Force of each element, shape (rows, n), N."""
        return self._observed["F_elements"]

    @property
    def dz(self) -> FloatArray:
        """Rate of the first variable under the row's states, shape (rows, n), m/s."""
        return self._observed["dz"]

    @property
    def _first(self) -> int:
        return int(self.rows.y.shape[1]) - self.n * len(self.model.chart.variables)

    @property
    def sliding(self) -> Any:
        """Stretches on which a sign is held between -1 and 1 (see `integrators.sliding`).

        Records with ``t_start, t_end`` [s], ``surface`` (what is zero there, such as ``v``) and
        ``sigma_start, sigma_end``, the sign held at both ends. From the rows, or where these are
        wanted times from the stops; a run of which only the end was kept has none.
        """
        table = _merged(self.rows, self.stops)
        found: list[tuple[Any, ...]] = []
        if len(table) < 2:
            return np.array(found, dtype=_SLIDING).view(np.recarray)
        for k, flags in enumerate(table.mode[:, self.n :].T):
            edges = np.flatnonzero(np.diff(np.concatenate([[0], flags, [0]])))
            for first, behind in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
                # The last row of the stretch itself: no firing or jump of a signal is behind it.
                last = int(np.searchsorted(table.t, table.t[behind - 1]))
                if last > first and table.t[last] in self.program.jumps:
                    last -= 1
                begun, ended = (self._sigma(table, row, k) for row in (first, max(first, last)))
                name = self.program.surface_names[k]
                end = float(table.t[min(behind, len(table) - 1)])
                found.append((float(table.t[first]), end, name, begun, ended))
        return np.array(found, dtype=_SLIDING).view(np.recarray)

    def sigma(self, row: int) -> dict[str, float]:
        """Return the signs that are held between -1 and 1 at a row.

        Parameters
        ----------
        row : int
            Row index.

        Returns
        -------
        dict of str to float
            By what is zero there, such as ``v``; empty almost everywhere.
        """
        on = np.flatnonzero(self.rows.mode[row, self.n :])
        return {self.program.surface_names[k]: self._sigma(self.rows, row, int(k)) for k in on}

    def _sigma(self, table: Rows, row: int, surface: int) -> float:
        t, y, mode = float(table.t[row]), table.y[row].tolist(), table.mode[row].tolist()
        return sigmas(self.program, t, y, mode)[surface]

    @cached_property
    def program(self) -> Program:
        """The generated program behind the run."""
        return lower(self.model, self.rig)

    @cached_property
    def _observed(self) -> Mapping[str, FloatArray]:
        # Row by row with scalar functions: the very numbers the run saw.
        if self.stored:
            return self.stored
        n, rows, program = self.n, self.rows, self.program
        if self.settings.get("engine") == "compiled":
            table = observe_rows(program, rows.t, rows.y, rows.mode)
            slid = np.flatnonzero(rows.mode[:, n:].any(axis=1))
            table[slid] = _observe_rows(program, rows.at(slid))
        else:
            table = _observe_rows(program, rows)
        _show_one_side(program, rows, table)
        return {
            "v": table[:, 0],
            "F": table[:, 1],
            "s": table[:, 2 : 2 + n],
            "F_elements": table[:, 2 + n : 2 + 2 * n],
            "dz": table[:, 2 + 2 * n : 2 + 3 * n],
        }

    # ------------------------------------------------------------------ sampling
    def sample(self, times: ArrayLike) -> Trace:
        """Return the run at other times, interpolated inside arcs and never across an event.

        Cubic Hermite between neighbouring rows, with one-sided slopes from the flow; on an event
        the value after it. For full accuracy on a dense grid ask `simulate` for it by `t_eval`.

        Parameters
        ----------
        times : array_like, shape (m,)
            s, within the run.

        Returns
        -------
        Trace
            With exactly these rows, in this order, and the same transitions.

        Raises
        ------
        ParameterError
            If a time lies outside the run.
        SignalError
            If the trace comes from a file and its signal was a Python function.
        """
        wanted = np.atleast_1d(np.asarray(times, dtype=np.float64))
        table = _merged(self.rows, self.stops)
        if wanted.ndim != 1 or wanted.size == 0:
            raise ParameterError(f"times has shape {wanted.shape}; give a flat, non-empty list")
        outside = wanted[~((wanted >= table.t[0]) & (wanted <= table.t[-1]))]
        if outside.size:
            raise ParameterError(
                f"time {shown(outside[0])} s lies outside the run, {shown(table.t[0])} to "
                f"{shown(table.t[-1])} s"
            )
        left = np.searchsorted(table.t, wanted, side="right") - 1
        y = np.array([self._between(table, int(i), t) for i, t in zip(left, wanted, strict=True)])
        rows = Rows(wanted, np.zeros(wanted.size, dtype=np.int64), y, table.mode[left])
        return Trace(
            rows,
            _merged(table, rows),
            self.transitions,
            self.model,
            self.rig,
            self.settings,
            monitors=self.monitors,
        )

    def refined(self, points: int) -> Trace:
        """Return the rows with evenly spaced samples between them, for smooth curves.

        Parameters
        ----------
        points : int
            How many samples over the whole run.

        Returns
        -------
        Trace
            All rows of this trace, micro-steps included, and the samples.
        """
        even = self.sample(np.linspace(self.t[0], self.t[-1], points)).rows
        inner = ~np.isin(even.t, self.t)
        between = Rows(*(column[inner] for column in vars(even).values()))
        rows = _merged(between, self.rows)
        return Trace(
            rows,
            rows,
            self.transitions,
            self.model,
            self.rig,
            self.settings,
            monitors=self.monitors,
        )

    def whole(self) -> Trace:
        """Return the run with both sides of every stop as rows, beside the wanted times.

        Returns
        -------
        Trace
            This one if it has them already.
        """
        table = _merged(self.rows, self.stops)
        if len(table) == len(self.rows):
            return self
        return Trace(
            table,
            table,
            self.transitions,
            self.model,
            self.rig,
            self.settings,
            monitors=self.monitors,
        )

    def _between(self, table: Rows, i: int, t: float) -> FloatArray:
        t0 = table.t[i]
        if t == t0 or i + 1 == len(table):
            return np.asarray(table.y[i])
        return interpolated(
            self.program,
            table.mode[i].tolist(),
            float(t0),
            table.y[i],
            float(table.t[i + 1]),
            table.y[i + 1],
            t,
        )

    def with_monitors(self, found: Mapping[str, Verdict]) -> Trace:
        """Return the same run with what its monitors say.

        Parameters
        ----------
        found : mapping of str to Verdict
            By name.

        Returns
        -------
        Trace
            With all that has been computed from the rows already.
        """
        trace = replace(self, monitors=found)
        vars(trace).update({**vars(self), "monitors": found})
        return trace

    # ------------------------------------------------------------------ files
    def save(self, path: str | Path) -> Path:
        """Write the trace to ``.npz``, or to ``.csv`` with the log beside it.

        The file is written whole or not at all. CSV numbers are printed so that they read back
        equal; the log goes to ``<name>.transitions.csv``.

        Parameters
        ----------
        path : str or Path
            Ends in ``.npz`` or ``.csv``.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OutputError
            If the folder cannot be written, the ending is another, or the rig is of a class of
            your own.
        """
        path = Path(path)
        if path.suffix == ".npz":
            table = _merged(self.rows, self.stops)
            arrays = {
                **{f"rows_{name}": value for name, value in vars(self.rows).items()},
                **{f"stops_{name}": value for name, value in vars(table).items()},
                **{f"observed_{name}": value for name, value in self._observed.items()},
                "transitions": np.asarray(self.transitions),
                "header": np.array(self._header().model_dump_json()),
            }
            return written_whole(path, lambda file: np.savez_compressed(file, **arrays))
        if path.suffix == ".csv":
            log = self.transitions_csv()
            rows = self._rows_csv(_stamp(log)).encode()
            # The rows name their log, so a process killed between the two leaves no mixture.
            written_together(
                {
                    path: lambda file: file.write(rows),
                    _log_path(path): lambda file: file.write(log.encode()),
                }
            )
            return path
        raise OutputError(f"{path}: a trace is saved as .npz or .csv, not {path.suffix!r}")

    @classmethod
    def load(cls, path: str | Path) -> Trace:
        """Read a trace written by `save`.

        Parameters
        ----------
        path : str or Path
            The ``.npz`` or ``.csv`` file.

        Returns
        -------
        Trace
            With equal arrays.

        Raises
        ------
        TraceFileError
            If the file is missing, damaged, or not a trace; nothing in it is executed.
        """
        path = Path(path)
        reader = {".npz": cls._load_npz, ".csv": cls._load_csv}.get(path.suffix)
        if reader is None:
            raise TraceFileError(f"{path}: a trace ends in .npz or .csv, not {path.suffix!r}")
        try:
            return reader(path)
        except TraceFileError as error:
            if str(error).startswith((f"{path}:", f"{_log_path(path)}:")):
                raise
            raise TraceFileError(f"{path}: {error}") from None
        except FileNotFoundError as error:
            raise TraceFileError(
                f"{error.filename}: no such file; check its name and the folder"
            ) from None
        except Exception as error:
            # A damaged file can fail anywhere inside zipfile, zlib, numpy, csv or pydantic, and
            # each has errors of its own; whatever it is, it is the file's fault.
            raise TraceFileError(
                f"{path}: damaged or incomplete trace file ({why(error)}); write it again"
            ) from None

    @classmethod
    def _load_npz(cls, path: Path) -> Trace:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            header = Header.model_validate_json(str(member(file, "header")))
            model = header.to_model()
            modes = lower(model, header.to_rig()).modes
            width = 8 * (modes + model.n * (2 + len(model.chart.variables)))  # bytes a row
            tables = {}
            for kind in ("rows", "stops"):
                t = member(file, f"{kind}_t")
                names = [f"{kind}_{name}" for name in ("microstep", "y", "mode")]
                tables[kind] = Rows(t, *(member(file, name, width * t.size) for name in names))
            rows = tables["rows"].t.size
            stored = {
                name: member(file, f"observed_{name}", width * rows)
                for name in ("v", "F", "s", "F_elements", "dz")
            }
            log = member(file, "transitions").view(np.recarray)
        return cls._checked(header, model, tables["rows"], tables["stops"], log, stored)

    @classmethod
    def _checked(
        cls,
        header: Header,
        model: Model,
        rows: Rows,
        stops: Rows,
        log: Any,
        stored: Mapping[str, FloatArray],
    ) -> Trace:
        n, m, rig = model.n, rows.t.size, header.to_rig()
        modes = lower(model, rig).modes
        rows, stops = (_with_slides(table, n, modes) for table in (rows, stops))
        size = (1 if header.rig.prescribed else 2) + n * len(model.chart.variables)
        for kind, table in (("rows", rows), ("stops", stops)):
            count = table.t.size
            _expect(f"{kind} t", table.t, (count,), "f")
            _expect(f"{kind} microstep", table.microstep, (count,), "i")
            _expect(f"{kind} y", table.y, (count, size), "f")
            _expect(f"{kind} mode", table.mode, (count, modes), "i")
            if not (np.diff(table.t) >= 0).all() or not np.isfinite(table.t).all():
                raise TraceFileError(f"{kind} t: times must be finite and must not go backward")
            states, slid = table.mode[:, :n], table.mode[:, n:]
            if count and not 0 <= states.min() <= states.max() < len(model.chart.states):
                raise TraceFileError(f"{kind} mode: a number is not a state of the chart")
            if slid.size and not 0 <= slid.min() <= slid.max() <= 1:
                raise TraceFileError(f"{kind} mode: a surface is slid on or not, 1 or 0")
        if m == 0:
            raise TraceFileError("rows: there are none")
        for name, value in stored.items():
            _expect(name, value, (m, n) if name in ("s", "F_elements", "dz") else (m,), "f")
        if log.ndim != 1 or log.dtype != _log_dtype(_text_width(log.dtype)):
            raise TraceFileError("the transition log has other columns than a trace has")
        if log.size and not 0 <= log.element.min() <= log.element.max() < n:
            raise TraceFileError("the transition log names an element that the model has not")
        if not (np.diff(log.t) >= 0).all() or not np.isfinite(log.t).all():
            raise TraceFileError("the transition log: times must be finite and not go backward")
        edges = {(edge.name, edge.source, edge.target) for edge in model.chart.transitions}
        if not edges >= set(zip(*(log[name].tolist() for name in _LOG_NAMES[2:5]), strict=True)):
            raise TraceFileError("the transition log names an edge that the chart has not")
        for kind, table in (("rows", rows), ("stops", stops)):
            fired = np.searchsorted(log.t, table.t, "right") - np.searchsorted(log.t, table.t)
            if not ((table.microstep >= 0) & (table.microstep <= fired)).all():
                raise TraceFileError(f"{kind} microstep: the log has other firings at a time")
        return cls(rows, stops, log, model, rig, header.settings, stored, header.monitors)

    def _header(self) -> Header:
        return Header.of(self.model, self.rig, self.settings, self.monitors)

    # ------------------------------------------------------------------ tables
    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the rows as flat columns; elements are numbered from 1 in the names.

        Returns
        -------
        dict of str to ndarray, shape (rows,)
            ``t, microstep, x, v, F, z1.., state1.., s1.., F1..``, and ``slides1..``: 1 where the
            motion slides along a surface.
        """
        table: dict[str, NDArray[Any]] = {
            "t": self.t,
            "microstep": self.microstep,
            "x": self.x,
            "v": self.v,
            "F": self.F,
        }
        variables = self.model.chart.variables
        blocks = [(name, self.variable(name)) for name in variables]
        blocks += [("state", self.states), ("s", self.s), ("F", self.F_elements)]  # type: ignore[list-item]
        blocks.append((f"d{variables[0]}", self.dz))
        slid = self.rows.mode[:, self.n :]
        table |= {f"slides{k + 1}": slid[:, k] for k in range(slid.shape[1])}
        for name, values in blocks:
            table |= {column_name(name, i): values[:, i] for i in range(self.n)}
        return table

    def to_pandas(self) -> pandas.DataFrame:
        """Return the rows as a pandas DataFrame, one column a quantity and element.

        Returns
        -------
        pandas.DataFrame
            See `columns`.

        Raises
        ------
        MissingExtraError
            If pandas is not installed.
        """
        return require("pandas", "pandas").DataFrame(self.columns())

    def transitions_csv(self) -> str:
        """Return the transition log as CSV text; elements counted from 1, as texts do.

        Returns
        -------
        str
            With a head line.
        """
        names = self.transitions.dtype.names
        rows = (
            [_cell(name, value) for name, value in zip(names, record, strict=True)]
            for record in self.transitions.tolist()
        )
        return _csv(names, rows)

    def _rows_csv(self, stamp: str) -> str:
        table = self.columns()
        rows = zip(*(column.tolist() for column in table.values()), strict=True)
        header = self._header().model_copy(update={"log": stamp})
        head = json.dumps(json.loads(header.model_dump_json()))
        return f"# {head}\n" + _csv(table, ([_cell("", v) for v in row] for row in rows))

    @classmethod
    def _load_csv(cls, path: Path) -> Trace:
        with in_turn(path.parent, shared=True):  # rows and log of one run, not one of each
            return cls._read_csv(path)

    @classmethod
    def _read_csv(cls, path: Path) -> Trace:
        with path.open(encoding="utf-8", newline="") as file:
            first = file.readline()
            if not first.startswith("# {"):
                what = "line 1 must be '# ' and the trace's header"
                if first.startswith("t,element,"):
                    what = "this is a log of transitions; give the trace itself, .npz or .csv"
                raise TraceFileError(f"{path}: {what}")
            header = Header.model_validate_json(first[2:])
            table = _read_columns(file, path, 2)
        log = _read_columns(io.StringIO(_log_text(path, header.log)), _log_path(path), 1)
        model = header.to_model()
        states = [s.name for s in model.chart.states]

        def number(name: str) -> FloatArray:
            return np.array([float(cell) for cell in table[name]])

        def block(name: str) -> FloatArray:
            return np.array([number(column_name(name, i)) for i in range(model.n)]).T

        y = [number("x")] if header.rig.prescribed else [number("x"), number("v")]
        for name in model.chart.variables:
            y += list(block(name).T)
        mode = [[states.index(c) for c in table[column_name("state", i)]] for i in range(model.n)]
        slid = sum(name.startswith("slides") and name[6:].isdigit() for name in table)
        mode += [[int(c) for c in table[f"slides{k + 1}"]] for k in range(slid)]
        rows = Rows(
            number("t"),
            np.array([int(c) for c in table["microstep"]], dtype=np.int64),
            np.array(y).T,
            np.array(mode, dtype=np.int64).T,
        )
        records = [
            (float(t), int(e) - 1, *rest[:3], *(float(c) for c in rest[3:]))
            for t, e, *rest in zip(*(log[name] for name in _LOG_NAMES), strict=True)
        ]
        observed = {
            "v": number("v"),
            "F": number("F"),
            "s": block("s"),
            "F_elements": block("F"),
            "dz": block(f"d{model.chart.variables[0]}"),
        }
        return cls._checked(header, model, rows, rows, log_of(records), observed)


# --------------------------------------------------------------------------- helpers
def dwell_times(trace: Trace) -> FloatArray:
    """Return how long each element was in each state.

    Parameters
    ----------
    trace : Trace
        A run; its transition log is complete whatever its rows are.

    Returns
    -------
    ndarray, shape (n, states), s
        Rows add up to the run's length.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> dwell_times(trace)[0].round(9).tolist()
    [2.0, 1.0]
    """
    states = [state.name for state in trace.model.chart.states]
    total = np.zeros((trace.n, len(states)))
    begin, end = trace.stops.t[0], trace.stops.t[-1]
    begin, end = min(begin, trace.t[0]), max(end, trace.t[-1])
    first = trace.stops if trace.stops.t[0] <= trace.t[0] else trace.rows
    for i in range(trace.n):
        since, state = begin, int(first.mode[0, i])
        for record in trace.transitions[trace.transitions.element == i]:
            total[i, states.index(record.source)] += record.t - since
            since, state = record.t, states.index(record.target)
        total[i, state] += end - since
    return total


def interpolated(
    program: Program,
    mode: list[int],
    t0: float,
    y0: FloatArray,
    t1: float,
    y1: FloatArray,
    t: float,
) -> FloatArray:
    """Return the state at t between two rows of one arc: cubic Hermite, slopes from the flow.

    Parameters
    ----------
    program : Program
        Of the run.
    mode : list of int
        Active states between the rows.
    t0, t1 : float
        Times of the rows, s.
    y0, y1 : ndarray, shape (m,)
        Their states.
    t : float
        s, from t0 to t1.

    Returns
    -------
    ndarray, shape (m,)
        The state.
    """
    with np.errstate(all="ignore"):  # as in a run: beyond the largest float lies inf
        at_start, at_end = slopes(program, mode, t0, y0, t1, y1)
        h = t1 - t0
        theta = (t - t0) / h
        rise = y1 - y0
        bend = h * at_start - rise
        twist = rise - h * at_end - bend
        value: FloatArray = y0 + theta * (rise + (1 - theta) * (bend + theta * twist))
    return value


def slopes(
    program: Program, mode: list[int], t0: float, y0: FloatArray, t1: float, y1: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return dy/dt at two neighbouring rows of one arc, both as seen from between them.

    Parameters
    ----------
    program, mode, t0, y0, t1, y1
        As in `interpolated`.

    Returns
    -------
    tuple of ndarray, shape (m,)
        At the first row and at the second.
    """
    # Signs as they hold inside the interval; at its ends they may just be turning.
    held = armed(program, 0.5 * (t0 + t1), (0.5 * (y0 + y1)).tolist(), mode)
    at_start, at_end = (rate(program, t, y.tolist(), mode, held) for t, y in ((t0, y0), (t1, y1)))
    return at_start, at_end


def _with_slides(rows: Rows, n: int, modes: int) -> Rows:
    """Return rows with flags of the surfaces; files from before there were any have none."""
    if rows.mode.ndim != 2 or rows.mode.shape[1] != n or modes == n:
        return rows
    none = np.zeros((len(rows.mode), modes - n), dtype=np.int64)
    return replace(rows, mode=np.concatenate([rows.mode, none], axis=1))


def _show_one_side(program: Program, rows: Rows, table: FloatArray) -> None:
    """Observe the rows beside a slide as the arc did that they belong to.

    They lie on the surface or a rounding behind it, where the sign as it is seen is not the one
    that was held: before a slide that of the arc before, after it that of the arc that follows.
    """
    t, slid = rows.t, rows.mode[:, program.n :]
    turns = np.flatnonzero((np.diff(slid, axis=0) != 0).any(axis=1) & (np.diff(t) == 0.0))
    for first in turns.tolist():
        before, after = np.searchsorted(t, t[first]) - 1, np.searchsorted(t, t[first], "right")
        for row, other, joined in ((first, before, 1), (first + 1, after, -1)):
            changed = np.flatnonzero(np.diff(slid[first : first + 2], axis=0)[0] == joined)
            if slid[row].any() or not changed.size or not 0 <= other < len(rows):
                continue
            mode, signs = rows.mode[row].tolist(), program.live
            held = armed(program, float(t[other]), rows.y[other].tolist(), mode)
            for place in (program.surfaces.sign[k] for k in changed):
                signs[place] = held[place] or LIVE
            out = [0.0] * program.seen
            program.ieee["observe"](
                float(t[row]), rows.y[row].tolist(), mode, signs, program.p, out
            )
            table[row] = out


def _observe_rows(program: Program, rows: Rows) -> FloatArray:
    table = np.empty((len(rows), program.seen))
    modes = rows.mode.tolist()
    for row, (t, y) in enumerate(zip(rows.t.tolist(), rows.y.tolist(), strict=True)):
        try:
            table[row] = observe(program, t, y, modes[row])
        except SignalError:  # the row at which a Python function failed
            table[row] = np.nan
    return table


_SLIDING = np.dtype(
    [
        ("t_start", "f8"),
        ("t_end", "f8"),
        ("surface", "U64"),
        ("sigma_start", "f8"),
        ("sigma_end", "f8"),
    ]
)
_LOG_NAMES = ("t", "element", "edge", "source", "target", *_NUMBERS)


def _log_dtype(width: int) -> np.dtype[Any]:
    kinds = {"t": "f8", "element": "i8", **dict.fromkeys(("edge", "source", "target"), f"U{width}")}
    return np.dtype([(name, kinds.get(name, "f8")) for name in _LOG_NAMES])


def _text_width(dtype: np.dtype[Any]) -> int:
    fields: Mapping[str, Any] = dtype.fields or {}
    return int(fields["edge"][0].itemsize) // 4 if "edge" in fields else 1


def _expect(name: str, array: Any, shape: tuple[int, ...], kind: str) -> None:
    """Refuse an array from a file that is not what a trace holds."""
    if not isinstance(array, np.ndarray) or array.shape != shape or array.dtype.kind != kind:
        found = getattr(array, "shape", None), str(getattr(array, "dtype", type(array).__name__))
        wanted = shape, {"f": "float", "i": "integer"}[kind]
        raise TraceFileError(f"{name} is {found}, a trace has {wanted}")


def log_of(records: Iterable[tuple[Any, ...]]) -> Any:
    """Return firings as a record array with the columns of `Trace.transitions`."""
    rows = list(records)
    width = max([1, *(len(text) for row in rows for text in row[2:5])])
    return np.array(rows, dtype=_log_dtype(width)).view(np.recarray)


def log_from(columns: Sequence[Any]) -> Any:
    """Return columns of arrays as the record array of `Trace.transitions`."""
    width = max([1, *(len(text) for column in columns[2:5] for text in set(column.tolist()))])
    log = np.empty(len(columns[0]), dtype=_log_dtype(width))
    for name, column in zip(_LOG_NAMES, columns, strict=True):
        log[name] = column
    return log.view(np.recarray)


def _merged(rows: Rows, stops: Rows) -> Rows:
    """Merge two tables in time order; rows that both have are kept once."""
    if rows is stops or not len(stops):
        return rows
    once = ~_found_in(rows, stops)
    rows = Rows(*(column[once] for column in vars(rows).values()))
    t = np.concatenate([rows.t, stops.t])
    microstep = np.concatenate([rows.microstep, stops.microstep])
    # A wanted row on an event holds the values after it: sort it behind the micro-steps.
    rank = np.concatenate([np.ones(len(rows)), np.zeros(len(stops))])
    order = np.lexsort((microstep, rank, t))
    return Rows(
        t[order],
        microstep[order],
        np.concatenate([rows.y, stops.y])[order],
        np.concatenate([rows.mode, stops.mode])[order],
    )


def _found_in(rows: Rows, stops: Rows) -> NDArray[np.bool_]:
    """Tell which rows the stops have too, to the bit."""
    found = np.isin(rows.t, stops.t)
    if not found.any():
        return found

    def texts(table: Rows, chosen: NDArray[np.bool_]) -> list[bytes]:
        columns = table.t, table.microstep, table.y, table.mode
        both = np.column_stack([np.asarray(column[chosen], np.float64) for column in columns])
        return [row.tobytes() for row in both]

    known = set(texts(stops, np.ones(len(stops), dtype=np.bool_)))
    found[found] = [text in known for text in texts(rows, found)]
    return found


def column_name(name: str, i: int) -> str:
    """Return the column's name of element i: z1, but z1_1 for a variable that is called z1."""
    return f"{name}{'_' if name[-1].isdigit() or name[-1] == '_' else ''}{i + 1}"


def files_of(path: Path) -> list[Path]:
    """Return the files that a trace lies in: one, or for ``.csv`` the log beside it too."""
    return [path, _log_path(path)] if path.suffix == ".csv" else [path]


def _log_path(path: Path) -> Path:
    return path.with_name(f"{path.stem}.transitions.csv")


def _stamp(text: str) -> str:
    """Return what tells one text from another; how its lines end does not count."""
    return hashlib.sha256("\n".join(text.splitlines()).encode()).hexdigest()[:16]


def _log_text(path: Path, stamp: str) -> str:
    """Read the transition log that belongs to a CSV trace.

    Where the process was killed after the rows took their place and before the log did, the log is
    complete under its temporary name.
    """
    log = _log_path(path)
    for place in (log, *leftovers(log)):
        with place.open(encoding="utf-8", newline="") as file:
            text = file.read()
        if stamp in ("", _stamp(text)):
            return text
    raise TraceFileError(
        f"{log}: belongs to another run than {path.name}, or was changed; keep the two together"
    )


def _cell(name: str, value: Any) -> str:
    if name == "element":
        return str(value + 1)
    return repr(value) if isinstance(value, float) else str(value)


def _csv(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return text.getvalue()


def _read_columns(file: IO[str], path: Path, line: int) -> dict[str, list[str]]:
    reader = csv.reader(file)
    head = next(reader, None)
    if not head:
        raise TraceFileError(f"{path}: line {line} must name the columns")
    rows = list(reader)
    for number, row in enumerate(rows, start=line + 1):
        if len(row) != len(head):
            raise TraceFileError(
                f"{path}: line {number} has {len(row)} cells, the head line has {len(head)}"
            )
    return {name: [row[j] for row in rows] for j, name in enumerate(head)}
