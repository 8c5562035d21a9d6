"""The data of a run in a replay page: rows, values, truth of every guard and clause, the log."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import SignalError, TraceFileError
from gms_fsm.inspection.explain import explain_state
from gms_fsm.language import MATLAB_LIKE, Relation, clauses, spell
from gms_fsm.traces._views import picked, steps_of
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.scope import Scope, watch_names
from gms_fsm.traces.trace import Trace

__all__ = ["common_frames", "frames_of_run", "page_rows", "stored_run"]

MOST_ROWS, FEWEST_ROWS = 4000, 200  # rows without a transition, divided by elements + 1


def stored_run(trace: Trace, between: NDArray[np.bool_], frame_of: Sequence[int]) -> dict[str, Any]:
    """Return the data of a run; `frame_of` gives the frames of its rows on the common time."""
    chart, n, pool = trace.model.chart, trace.n, _Pool()
    values = Scope.over(trace).watches()
    edges = _edges(chart)
    inner, inner_title, threshold = _inner(trace)
    sides, truth, holds = _explained(trace, edges, pool)
    log = _log(trace, edges)
    for entry in log:
        entry["frame"] = frame_of[entry["row"]]
    mode = trace.modes.T.tolist()
    return {
        "states": [state.name for state in chart.states],
        "edges": edges,
        "names": {
            # 17 digits distinguish all times
            name: pool.add(values[name], digits=17 if name == "t" else 7)
            for name in watch_names(trace.model)
        },
        "inner": {
            "title": inner_title,
            "bounds": [1, -1] if threshold else [],
            "columns": [] if inner is None else [pool.add(inner[:, i]) for i in range(n)],
        },
        "mode": mode,
        "pieces": [_pieces(trace.t.tolist(), mode[i]) for i in range(n)],
        "microstep": trace.microstep.tolist(),
        "between": between.astype(int).tolist(),
        "sides": sides,
        "truth": truth,
        "stops": [
            [
                [
                    frame_of[row]
                    for row in _stops(
                        mode[i],
                        holds[i][k],
                        edge["source"],
                        [
                            entry["row"]
                            for entry in log
                            if not entry["made"] and (entry["element"], entry["edge"]) == (i, k)
                        ],
                    )
                ]
                for k, edge in enumerate(edges)
            ]
            for i in range(n)
        ],
        "log": log,
        "fired": {e["row"]: [e["element"], e["edge"]] for e in log if e["made"]},
        "pool": pool.columns,
    }


def _inner(trace: Trace) -> tuple[NDArray[np.float64] | None, str, bool]:
    """Return what is drawn of each element, its title, and whether there are thresholds at ±1."""
    chart = trace.model.chart
    if not trace.places.variables:
        return None, "", False
    first = trace.places.variables[0]
    if chart.transitions and "s" in chart.inputs:  # without edges (LuGre) s is no threshold
        with np.errstate(all="ignore"):
            return trace.z / trace.s, f"{first} / s(v), lines at ±1", True
    return trace.z, "z [m]" if first == "z" else first, False


def _edges(chart: Chart) -> list[dict[str, Any]]:
    """Return the edges in the order of the chart's picture."""
    found = []
    for state in chart.states:
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            parts = clauses(chart.guards[edge.name])
            found.append(
                {
                    "name": edge.name,
                    "priority": priority,
                    "source": chart.state_index(edge.source),
                    "target": chart.state_index(edge.target),
                    "clauses": [spell(part, MATLAB_LIKE) for part in parts],
                    "compound": [not isinstance(part, Relation) for part in parts],
                }
            )
    return found


def _pieces(times: Sequence[float], mode: Sequence[int]) -> list[tuple[int, float, float]]:
    """Return the intervals of constant state: the state, begin, end."""
    starts = [row for row in range(len(mode)) if row == 0 or mode[row] != mode[row - 1]]
    ends = [*(times[row] for row in starts[1:]), times[-1]]
    return [(mode[row], times[row], end) for row, end in zip(starts, ends, strict=True)]


def _stops(mode: Sequence[int], holds: str, source: int, logged: Sequence[int]) -> list[int]:
    """Return the rows where a guard becomes true while its state is active.

    Such a row comes before every firing, except where only requested times were stored; there the
    row that shows the firing is used.
    """
    valid = [state == source and whole == "1" for state, whole in zip(mode, holds, strict=True)]
    rows = [row for row, now in enumerate(valid) if now and not (row and valid[row - 1])]
    return sorted({*rows, *logged})


def _log(trace: Trace, edges: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return each firing, the row that shows it, and whether the firing made that row."""
    times, steps = trace.t.tolist(), trace.microstep.tolist()
    made = {(t, step): row for row, (t, step) in enumerate(zip(times, steps, strict=True)) if step}
    states = [state.name for state in trace.model.chart.states]
    names = [(edge["name"], states[edge["source"]]) for edge in edges]
    found: list[dict[str, Any]] = []
    for record, step in zip(trace.transitions, steps_of(trace).tolist(), strict=True):
        t, name, source = float(record.t), str(record.edge), str(record.source)
        if (name, source) not in names:
            raise TraceFileError(
                f"the transition log names an edge {name!r} from {source!r} that is not in the "
                "chart"
            )
        row = made.get((t, step))
        after = min(int(np.searchsorted(trace.t, t, side="left")), len(times) - 1)
        text = f"element {int(record.element) + 1} {record.source} → {record.target} ({name})"
        found.append(
            {
                "t": t,
                "row": after if row is None else row,
                "made": row is not None,
                "element": int(record.element),
                "edge": names.index((name, source)),
                "text": text,
            }
        )
    return found


def common_frames(runs: Sequence[Sequence[float]]) -> dict[str, list[Any]]:
    """Put the rows of one or two runs on a common time.

    Rows of one instant are distinguished by their order, so that micro-steps match micro-steps.
    """
    keys: list[list[tuple[float, int]]] = []
    for times in runs:
        own: list[tuple[float, int]] = []
        for t in times:
            own.append((t, own[-1][1] + 1 if own and own[-1][0] == t else 0))
        keys.append(own)
    common = sorted(set().union(*keys))
    return {
        "t": [t for t, _ in common],
        "rows": [[max(bisect_right(own, key) - 1, 0) for key in common] for own in keys],
        "own": [[int(key in known) for key in common] for known in map(set, keys)],
    }


def frames_of_run(frames: Mapping[str, list[Any]], run: int) -> list[int]:
    """Return the frame of each row of a run."""
    return [frame for frame, own in enumerate(frames["own"][run]) if own]


class _Pool:
    """Columns of numbers, each stored once: most sides of clauses are values shown anyway."""

    def __init__(self) -> None:
        self.columns: list[list[float | str]] = []
        self._known: dict[tuple[float | str, ...], int] = {}

    def add(self, values: Iterable[float], digits: int = 7) -> int:
        """Store a column and return its number; a constant one is stored as one number."""
        column = tuple(_rounded(float(value), digits) for value in values)
        if len(set(column)) == 1:
            column = column[:1]
        if column not in self._known:
            self._known[column] = len(self.columns)
            self.columns.append(list(column))
        return self._known[column]


def _rounded(value: float, digits: int) -> float | str:
    # JSON cannot express these; the page's Number() reads them.
    if value != value:
        return "NaN"
    if value in (np.inf, -np.inf):
        return "Infinity" if value > 0 else "-Infinity"
    value = float(f"{value:.{digits}g}")
    return int(value) if value == int(value) and abs(value) < 1e6 else value


def page_rows(trace: Trace) -> tuple[Trace, NDArray[np.bool_]]:
    """Return the run with the page's rows, and which of them lie between rows of the run.

    All rows at instants with transitions and their neighbours are kept. The others are thinned or,
    if there are few, samples are added between them, so that curves look smooth.
    """
    trace = _with_microsteps(trace)
    wanted = max(FEWEST_ROWS, MOST_ROWS // (trace.n + 1))
    between = np.zeros(len(trace), dtype=bool)
    if len(trace) < wanted and trace.t[-1] > trace.t[0]:
        try:
            refined = trace.refined(wanted - len(trace) + 2)
        except (SignalError, ArithmeticError, ValueError):
            pass  # a signal that is not in the file, or a last row that cannot be computed
        else:
            new = ~np.isin(refined.t, trace.t)
            # Recomputed rows should equal those of the file; otherwise the file takes precedence.
            if np.allclose(refined.F[~new], trace.F, rtol=1e-9, equal_nan=True):
                between, trace = new, refined
    instants = np.isin(trace.t, trace.t[trace.microstep > 0])
    kept = instants.copy()
    kept[1:] |= instants[:-1]
    kept[:-1] |= instants[1:]
    kept[[0, -1]] = True
    others = np.flatnonzero(~kept)
    if others.size > wanted:
        others = others[np.linspace(0, others.size - 1, wanted).astype(int)]
    kept[others] = True
    return picked(trace, kept), between[kept]


def _with_microsteps(trace: Trace) -> Trace:
    """Return the run with both sides of every stop, even if only requested times were stored."""
    stops = trace.stops
    if (trace.microstep > 0).any() or not (stops.microstep > 0).any():
        return trace
    rows = trace.rows
    new = ~np.isin(rows.t, stops.t)  # the rows of a stop contain more
    pairs = zip(vars(stops).values(), vars(rows.at(new)).values(), strict=True)
    table = Rows(*(np.concatenate(pair) for pair in pairs))
    table = table.at(np.argsort(table.t, kind="stable"))
    return replace(trace, rows=table, stops=table, stored={})


def _explained(
    trace: Trace, edges: Sequence[Mapping[str, Any]], pool: _Pool
) -> tuple[list[Any], list[Any], list[Any]]:
    """Return sides and truth of every clause, and truth of every guard, by element and edge."""
    sides: list[Any] = [[] for _ in range(trace.n)]
    truth: list[Any] = [[] for _ in range(trace.n)]
    holds: list[Any] = [[] for _ in range(trace.n)]
    scopes = [Scope.at(trace, row) for row in range(len(trace))]
    for i in range(trace.n):
        told = [_row_truths(trace.model.chart, scope.guards(i)) for scope in scopes]
        for edge in edges:
            own = [line[edge["name"]] for line in told]
            parts = list(zip(*(of_clauses for _, of_clauses in own), strict=True))
            holds[i].append("".join(whole for whole, _ in own))
            truth[i].append(["".join(found[0] for found in part) for part in parts])
            sides[i].append(
                [[pool.add([found[k] for found in part]) for k in (1, 2, 3)] for part in parts]
            )
    return sides, truth, holds


def _row_truths(chart: Chart, values: Mapping[str, float]) -> dict[str, Any]:
    """Return every guard's truth, and truth, left, right and margin of its clauses."""
    found: dict[str, Any] = {}
    for state in chart.states:
        try:
            for told in explain_state(chart, state.name, values):
                parts = [("01"[c.holds], c.left, c.right, c.margin) for c in told.clauses]
                found[told.edge.name] = ("01"[told.holds], parts)
        except (ArithmeticError, ValueError):  # the last row of a failed run
            for _, edge in chart.leaving(state.name):
                count = len(clauses(chart.guards[edge.name]))
                found[edge.name] = ("?", [("?", np.nan, np.nan, np.nan)] * count)
    return found
