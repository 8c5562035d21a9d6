"""Parts of what a trace shows, beside its columns."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.charts.parameters import FloatArray, as_numbers
from gms_fsm.errors import OutputError, ParameterError, SignalError, TraceFileError, shown
from gms_fsm.foundation.arguments import copied, no_file, some_of
from gms_fsm.foundation.display import Log, short_repr
from gms_fsm.language import evaluate
from gms_fsm.lowering.observing import armed, rate, sigmas
from gms_fsm.lowering.program import Program
from gms_fsm.systems.signals import Corners, Function, piecewise_linear
from gms_fsm.systems.system import Body, System
from gms_fsm.traces.between import between
from gms_fsm.traces.files.parts import Parts, RunDescription, checked
from gms_fsm.traces.files.unreadable import kind_of_file, unreadable
from gms_fsm.traces.rows import Rows, merged

if TYPE_CHECKING:
    from gms_fsm.traces.trace import Trace


@short_repr
@dataclass(frozen=True, eq=False)
class BodyTrace:
    """The motion of a body.

    Parameters
    ----------
    name : str
        The body's.
    x, v : ndarray, shape (rows,)
        Position [m] and velocity [m/s].
    """

    name: str
    x: FloatArray
    v: FloatArray


def contact_seen(trace: Trace, name: str) -> Trace:
    """Return a run as one contact sees it, with all that has been generated and observed."""
    every = trace.firings if trace.every is None else trace.every
    kept = {k: u for k, u in vars(trace).items() if k in ("program", "seen")}
    own = every.of_contact(name)
    seen: Trace = copied(trace, firings=own, which=name, every=every, **kept)
    return seen


def range_of_force(trace: Trace) -> tuple[float, float]:
    """Return the least and the largest friction force over what lasts."""
    lasting = trace.F[trace.rows.lasting]
    return float(lasting.min()), float(lasting.max())


def driven_velocity(trace: Trace, body: Body) -> FloatArray:
    """Return the velocity of a driven body at all rows: the rate of its position."""
    program, found = trace.program, []
    place = program.layout.y.index(body.x)
    rows = zip(trace.t.tolist(), trace.rows.y.tolist(), trace.rows.mode.tolist(), strict=True)
    for t, y, mode in rows:
        found.append(rate(program, t, y, mode, armed(program, t, y, mode))[place])
    return np.array(found)


def given_values(system: System, t: float) -> dict[str, float]:
    """Return the values at a time of what is given: signals, and velocities of driven bodies."""
    wanted = {*system.signals, *(body.v for body in system.bodies if body.driven)}
    values: dict[str, float] = {"t": t, **system.numbers}
    found: dict[str, float] = {}
    for each in system.assembly.definitions:
        if each.name not in wanted:
            continue
        try:
            if isinstance(each.signal, Corners):
                record: Any = each.signal.times, each.signal.values
                value = float(piecewise_linear(t, *record))
            elif isinstance(each.signal, Function):
                value = float(each.signal.call(t))
            else:
                assert each.tree is not None
                value = float(evaluate(each.tree, values))
        except (ArithmeticError, ValueError, TypeError, SignalError):
            value = math.nan
        values[each.name] = found[each.name] = value
    return found


def steps_of(trace: Trace) -> NDArray[np.int64]:
    """Return the micro-step of the row that each entry of the log made."""
    log = trace.firings if trace.every is None else trace.every
    counted: NDArray[np.int64] = np.arange(len(log)) - np.searchsorted(log.t, log.t) + 1
    return counted if trace.every is None else counted[log.within(trace.places.name)]


def picked(trace: Trace, keep: NDArray[Any] | slice) -> Trace:
    """Return some of the rows, with what was observed there, and the whole log."""
    rows = trace.rows.at(keep)
    stored = {name: column[keep] for name, column in trace.stored.items()}
    part = replace(trace, rows=rows, stops=rows, stored=stored)
    seen = {name: column[keep] for name, column in trace.seen.items()}
    vars(part).update({"program": trace.program, "seen": seen})
    return part


def sampled(trace: Trace, times: ArrayLike) -> Trace:
    """Return a run at other times; see `Trace.sample`."""
    wanted = np.atleast_1d(as_numbers("times", times))
    table = merged(trace.rows, trace.stops)
    if wanted.ndim != 1 or wanted.size == 0:
        raise ParameterError(
            f"times has shape {wanted.shape}", advice="give a flat, non-empty list"
        )
    outside = wanted[~((wanted >= table.t[0]) & (wanted <= table.t[-1]))]
    if outside.size:
        raise ParameterError(
            f"time {shown(outside[0])} s is outside the run, {shown(table.t[0])} to "
            f"{shown(table.t[-1])} s"
        )
    left = np.searchsorted(table.t, wanted, side="right") - 1
    y = between(trace.program, table, left, wanted)
    rows = Rows(wanted, np.zeros(wanted.size, dtype=np.int64), y, table.mode[left])
    return replace(trace, rows=rows, stops=merged(table, rows), stored={})


def sensitivity_of(trace: Trace, of: str, to: str) -> FloatArray:
    """Return the derivative of a quantity at all rows by a number or an initial value.

    It is exact through every switch, to the tolerances of the run. At the row of a switch it is
    taken at a fixed time, so it jumps there where the quantity itself bends.

    Parameters
    ----------
    of : str
        What is asked for: ``"F"``, ``"v"``, ``"z"``, ``"x"``; of a system ``"gear.F"``,
        ``"load.v"``; a further state by its name; or ``"transitions"``, the times of the log.
    to : str
        One of the names given as ``sensitivities`` of `gms_fsm.simulate`.

    Returns
    -------
    ndarray, shape (rows,), (rows, n) or (transitions,)
        Per element, if the quantity is; NaN behind a switch that grazes.

    Raises
    ------
    ParameterError
        If the run has no such sensitivities, or the rows are not those of the run.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0, sensitivities=("F_c", "initial.z"))
    >>> trace.sensitivity("transitions", "F_c").round(6).tolist()
    [5.0, 5.0, 5.0, 5.0]
    >>> trace.sensitivity("z", "initial.z").shape == trace.z.shape
    True
    """
    if trace.derived is None:
        raise ParameterError(
            "the run was made without sensitivities",
            place="sensitivity",
            advice=f"simulate(..., sensitivities=({to!r},))",
        )
    if of == "transitions":
        times = trace.derived.times(to)
        return times if trace.every is None else times[trace.every.within(trace.which)]
    if not np.array_equal(trace.t, trace.derived.followed.t):
        raise ParameterError(
            "the rows are not those of the run",
            place="sensitivity",
            advice="ask the trace that simulate returned",
        )
    return trace.derived.at_rows(trace.program, trace.rows, of, to, trace.which)


def dwell_times(trace: Trace) -> FloatArray:
    """Return the time each element spent in each state.

    Parameters
    ----------
    trace : Trace
        A run; its transition log is complete, whatever its rows are.

    Returns
    -------
    ndarray, shape (n, states), s
        Each row adds up to the duration of the run.

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
    elements = trace.places.elements
    for i in range(trace.n):
        since, state = begin, int(first.mode[0, elements][i])
        for record in trace.transitions[trace.transitions.element == i]:
            total[i, states.index(record.source)] += record.t - since
            since, state = record.t, states.index(record.target)
        total[i, state] += end - since
    return total


_SLIDING = np.dtype(
    [
        ("t_start", "f8"),
        ("t_end", "f8"),
        ("surface", "U128"),
        ("sigma_start", "f8"),
        ("sigma_end", "f8"),
    ]
)


def sliding_of(trace: Trace) -> Any:
    """Return the intervals of a run in which the motion slides on a surface."""
    table = merged(trace.rows, trace.stops)
    found: list[tuple[Any, ...]] = []
    if len(table) < 2:
        return np.array(found, dtype=_SLIDING).view(Log)
    for k, flags in enumerate(table.mode[:, trace.program.layout.slides].T):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], flags, [0]])))
        for first, behind in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            # The last row of the interval itself, before any firing or jump of a signal.
            last = int(np.searchsorted(table.t, table.t[behind - 1]))
            if last > first and table.t[last] in trace.program.jumps:
                last -= 1
            begun, ended = (
                sigma_at(trace.program, table, row, k) for row in (first, max(first, last))
            )
            name = trace.program.surface_names[k]
            end = float(table.t[min(behind, len(table) - 1)])
            found.append((float(table.t[first]), end, name, begun, ended))
    return np.array(found, dtype=_SLIDING).view(Log)


def sigma_at(program: Program, table: Rows, row: int, surface: int) -> float:
    """Return the sign held on a surface at a row."""
    t, y, mode = float(table.t[row]), table.y[row].tolist(), table.mode[row].tolist()
    return sigmas(program, t, y, mode)[surface]


def write_trace(trace: Trace, path: Path) -> Path:
    """Write a trace; see `Trace.save`."""
    if path.suffix not in (".npz", ".csv"):
        raise OutputError(
            f"the name of a trace file must end in .npz or .csv, not {path.suffix!r}",
            place=str(path),
        )
    if trace.which:
        raise OutputError(
            f"this is what the contact {trace.which!r} sees of a run",
            place=str(path),
            advice="save the trace of the whole run",
        )
    from gms_fsm.traces.files import csv_files, npz_files
    from gms_fsm.traces.files.header import Header

    header = Header.of(trace.what, trace.settings, trace.monitors, trace.heading)
    if path.suffix == ".csv":
        starts = range(0, len(trace), csv_files.AT_ONCE)
        parts = (picked(trace, slice(start, start + csv_files.AT_ONCE)) for start in starts)
        return csv_files.write(path, header, (part.columns() for part in parts), trace.firings)
    stored = dict(trace.seen)
    for name in trace.what.bodies:
        if trace.what.system.body(name).driven:
            stored[trace.what.system.body(name).v] = trace.body(name).v
    return npz_files.write(
        path,
        Parts(header, RunDescription(trace.what), trace.rows, trace.stops, trace.firings, stored),
    )


def files_of(path: Path) -> list[Path]:
    """Return the files of a trace: one, or for ``.csv`` also that of its log."""
    from gms_fsm.traces.files.csv_files import log_path

    return [path, log_path(path)] if path.suffix == ".csv" else [path]


def read_parts(path: Path) -> Parts:
    """Return the parts of a trace file, checked."""
    from gms_fsm.traces.files import csv_files, npz_files

    reader = {".npz": npz_files.read, ".csv": csv_files.read}.get(path.suffix)
    if path.is_dir():
        inside = sorted(path.glob("**/trace.npz"), key=lambda each: len(each.parts))
        raise TraceFileError(
            "it is a folder",
            place=str(path),
            advice=f"give {some_of(map(str, inside))}" if inside else "give a .npz or .csv file",
        )
    if reader is None:
        if path.exists() and kind_of_file(path) not in ("", "trace"):
            raise unreadable(path, "trace", ValueError())
        raise TraceFileError(
            f"the name of a trace file must end in .npz or .csv, not {path.suffix!r}",
            place=str(path),
            advice="give a file that Trace.save or gms-fsm run has written",
        )
    try:
        return checked(reader(path))
    except TraceFileError as error:
        if error.outer and not error.advice:
            raise error.replaced(advice="write it again") from None
        if error.advice and kind_of_file(path) in ("", "trace", "table"):
            raise (error if error.outer else error.inside(path)) from None
        raise unreadable(path, "trace", error) from None
    except FileNotFoundError as error:
        raise no_file(error.filename, TraceFileError) from None
    except Exception as error:
        # A damaged file can fail anywhere inside zipfile, zlib, numpy, csv or pydantic, each
        # with its own errors; in every case the file is at fault.
        raise unreadable(path, "trace", error) from None


CALLED = {  # what other programs have, and what it is here
    "time": "trace.t",
    "position": "trace.x",
    "velocity": "trace.v",
    "force": "trace.F",
    "deflection": "trace.z",
    "state": "trace.states",
    "events": "trace.transitions",
    "plot": "plots.overview(trace)",
    "at": "trace.sample([t])",
    "to_csv": "trace.save('run.csv')",
}
