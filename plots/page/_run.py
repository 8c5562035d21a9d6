"""The data of a run in a replay page: rows, values, charts as trees, the log, the system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import TraceFileError
from gms_fsm.language import (
    Condition,
    Relation,
    awaited,
    clauses,
    names_in,
    parse_value,
    values_of,
)
from gms_fsm.systems.system import loaded
from gms_fsm.traces.scope import (
    Scope,
    clause_text,
    clause_unit,
    guard_columns,
    unit_of,
    watch_names,
)
from gms_fsm.traces.system_scope import SystemScope
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.views import steps_of
from gms_fsm.verification.prove import Report
from plots.charts.contents import edges_by_priority
from plots.page._columns import ColumnStore, packed
from plots.page._rows import PageRows
from plots.page._trees import Stored, tree_of
from plots.views.plane import Plane, linear_threshold, plane_axes

FORCE = "F"  # names of forces begin like this; they are shown, not read by guards, in seven digits


def stored_run(page: PageRows, charts: Sequence[int], reports: Sequence[Report]) -> dict[str, Any]:
    """Return the data of a run."""
    trace = page.trace
    instants = np.cumsum(np.diff(trace.t, prepend=trace.t[0]) > 0, dtype=np.int64)
    pool = ColumnStore(instants)
    views = views_of(trace)
    contacts = [
        _contact(view, pool, picture, reports) for view, picture in zip(views, charts, strict=True)
    ]
    return {
        "rows": len(trace),
        "instants": packed(instants),
        "number": packed(page.number),
        "between": packed(page.between),
        "microstep": packed(trace.microstep),
        "t": pool.add(trace.t),
        "contacts": contacts,
        "system": _system(trace, pool) if trace.subject.named else None,
        "names": (_watched_in_system if trace.subject.named else _watched)(trace, pool),
        "pool": pool.columns,
    }


def views_of(trace: Trace) -> list[Trace]:
    """Return the run as each contact and supervisor sees it; one chosen before stays alone."""
    if not trace.subject.named:
        return [trace]
    return [trace.contact(name) for name in trace.what.machines]


# ----------------------------------------------------------------- a contact or a supervisor
def _contact(
    trace: Trace, pool: ColumnStore, picture: int, reports: Sequence[Report]
) -> dict[str, Any]:
    chart, model, n = trace.model.chart, trace.model, trace.n
    stored: Stored = {}
    edges = _edges(chart, stored)
    values = _values(trace, stored, pool)
    modes = trace.modes
    rows, elements = np.nonzero(np.diff(modes, axis=0, prepend=modes[:1]))
    curve = None if loaded(model) else model.stribeck  # else s is that of the row
    return {
        "name": trace.what.whose(trace.places.name),
        "chart": picture,
        "n": n,
        "states": [state.name for state in chart.states],
        "locked": [state.locked for state in chart.states],
        "edges": edges,
        "parameters": {
            name: float(value) if np.ndim(value) == 0 else np.asarray(value).tolist()
            for name, value in model.values.items()
        },
        "values": values,
        "forces": [pool.add(column, exact=False) for column in trace.F_elements.T],
        "outputs": list(chart.force_names[: 1 if chart.velocities else None]),
        "inputs": list(chart.inputs),
        "velocity": next(iter(chart.velocities), None),
        "velocities": list(chart.velocities),
        "variables": list(chart.variables),
        "curve": None
        if curve is None
        else {
            "tree": tree_of(parse_value(curve.text, ("v", *curve.numbers))),
            "numbers": dict(curve.numbers),
            "weights": model.weights.tolist(),
        },
        "let": {name: tree_of(tree) for name, tree in chart.lets.items()},
        "flows": [
            {name: tree_of(chart.flows[state.name, name]) for name in chart.variables}
            for state in chart.states
        ],
        "plane": _plane(trace, reports),
        "units": {
            name: unit
            for name in (*chart.inputs, *chart.variables, *chart.parameter_names, *_given(chart))
            if (unit := unit_of(chart, name))
        },
        "threshold": "s" in chart.inputs and bool(chart.transitions),
        "initial": modes[0].tolist(),
        "switches": [packed(each) for each in (rows, elements, modes[rows, elements])],
        "log": _log(trace, edges),
    }


def _edges(chart: Chart, stored: Stored) -> list[dict[str, Any]]:
    """Return the edges in the order of the chart's picture."""
    return [
        {
            "name": edge.name,
            "priority": priority,
            "source": chart.state_index(edge.source),
            "target": chart.state_index(edge.target),
            "emit": list(edge.emit),
            "clauses": [_clause(chart, part, stored) for part in clauses(chart.guards[edge.name])],
            "guard": tree_of(chart.guards[edge.name], stored),
        }
        for priority, edge in edges_by_priority(chart)
    ]


def _clause(chart: Chart, part: Condition, stored: Stored) -> dict[str, Any]:
    return {
        "text": clause_text(chart, part),
        "tree": tree_of(part, stored),
        "event": awaited(part),
        "compares": isinstance(part, Relation) and not awaited(part),
        "unit": clause_unit(chart, part),
    }


def _values(trace: Trace, stored: Stored, pool: ColumnStore) -> dict[str, Any]:
    """Return the columns of what guards read and plots show, by name: one, or one per element."""
    chart, n = trace.model.chart, trace.n
    read = _read(chart)
    read -= {*chart.parameter_names, *chart.variables, "t"}
    found: dict[str, Any] = {"t": {"all": pool.add(trace.t)}}
    if chart.velocities:
        read -= {"x", "v", "s"}
        found |= {
            "x": {"all": pool.add(trace.x)},
            "F": {"all": pool.add(trace.F, exact="F" in read)},
            chart.velocities[0]: {"all": pool.add(trace.v)},
        }
    else:
        given = {name: trace.seen[trace.places.of(name)] for name in chart.force_names}
        found |= {name: {"all": pool.add(column)} for name, column in given.items()}
    if thresholds := _thresholds(trace, pool):
        found["s"] = {"by": thresholds}
    columns = dict(guard_columns(trace, read)) if read else {}
    if stored:
        known = {"t": trace.t, "x": trace.x, "v": trace.v, "s": trace.s.T} | columns
        known |= {name: trace.variable(name).T for name in chart.variables}
        known |= {
            name: np.asarray(value)[:, np.newaxis] if np.ndim(value) else value
            for name, value in trace.model.values.items()
        }
        columns |= {
            name: values_of(tree, {each: known[each] for each in names_in(tree)})
            for name, tree in stored.items()
        }
    columns |= {name: trace.variable(name).T for name in chart.variables}
    for name, column in columns.items():
        table = np.asarray(column)
        if table.ndim == 2:
            rows = [table[i if len(table) > 1 else 0] for i in range(n)]
            found[name] = {"by": [pool.add(row) for row in rows]}
        else:
            found[name] = {"all": pool.add(table)}
    return found


def _given(chart: Chart) -> tuple[str, ...]:
    """Return the names that a chart does not declare."""
    return ("t", "x", *chart.rate_names, *chart.velocities, *chart.force_names)


def _read(chart: Chart) -> set[str]:
    """Return the names that guards read, and what flows and named expressions read besides."""
    read = {name for tree in chart.guards.values() for name in names_in(tree)}
    # At other points than those of the run, the page computes named expressions itself.
    inner = (*chart.lets.values(), *chart.flows.values())
    return read | {name for tree in inner for name in names_in(tree)} - chart.lets.keys()


def _thresholds(trace: Trace, pool: ColumnStore) -> list[Any]:
    """Return the columns of s of each element: its weight times the curve, if that is exact."""
    curve, weights = trace.model.stribeck, trace.model.weights.tolist()
    if curve is None:
        return []
    base = curve(trace.v)
    if all(
        np.array_equal(w * base, s, equal_nan=True) for w, s in zip(weights, trace.s.T, strict=True)
    ):
        column = pool.add(base)
        return [[column, weight] for weight in weights]
    return [pool.add(s) for s in trace.s.T]


def _plane(trace: Trace, reports: Sequence[Report]) -> dict[str, Any] | None:
    """Return the names of the plane of the guards, where its axis is linear, and the pins."""
    chart = trace.model.chart
    names = plane_axes(chart)
    if names is None:
        return None
    speeds = np.abs(trace.v[np.isfinite(trace.v)])
    threshold = linear_threshold(Plane.of(trace, 0, 0), float(speeds.max(initial=0.0)))
    return {"names": names, "threshold": threshold, "pins": _pins(chart, names, reports)}


def _pins(chart: Chart, plane: tuple[str, str], reports: Sequence[Report]) -> list[dict[str, Any]]:
    """Return the counterexamples that have a place in the plane of the chart."""
    return [
        {
            "at": [each.counterexample[name] for name in plane],
            "text": each.text,
            "status": each.status,
            "where": list(each.where),
        }
        for report in reports
        if report.chart == chart
        for each in report.findings
        if all(name in each.counterexample for name in plane)
    ]


def _log(trace: Trace, edges: Sequence[Mapping[str, Any]]) -> list[Any]:
    """Return row, element and edge of each firing, and whether the firing made that row."""
    first, last = float(trace.t[0]), float(trace.t[-1])
    log, steps = trace.transitions, steps_of(trace)
    inside = (log.t >= first) & (log.t <= last)
    log, steps = log[inside], steps[inside]
    states = [state.name for state in trace.model.chart.states]
    known = {(edge["name"], states[edge["source"]]): k for k, edge in enumerate(edges)}
    numbers = []
    for name, source in zip(log.edge.tolist(), log.source.tolist(), strict=True):
        if (name, source) not in known:
            raise TraceFileError(
                f"the transition log names an edge {name!r} from {source!r} that is not in the "
                "chart"
            )
        numbers.append(known[name, source])
    t, microstep = trace.t, trace.microstep
    before = np.searchsorted(t, log.t, side="left")
    # Micro-steps count the rows of an instant, but a slide begins or ends in one more row.
    rows = before.copy()
    after = np.searchsorted(t, log.t, side="right")
    for i, (low, high, step) in enumerate(
        zip(before.tolist(), after.tolist(), steps.tolist(), strict=True)
    ):
        made = low + np.searchsorted(microstep[low:high], step)
        rows[i] = made if made < high and microstep[made] == step else -1
    made = rows >= 0
    shown = np.where(made, rows, np.minimum(before, len(t) - 1))
    return [packed(each) for each in (shown, log.element, numbers, made)] + [log.t[~made].tolist()]


# --------------------------------------------------------------------------- names for `until`
def _watched(trace: Trace, pool: ColumnStore) -> dict[str, Any]:
    values = Scope.over(trace).watches()
    found = {}
    thresholds = _thresholds(trace, pool)
    for name in watch_names(trace.model):
        number = name.removeprefix("s")
        if name.startswith("s") and number.isdigit() and thresholds:
            found[name] = thresholds[int(number) - 1]
        else:
            found[name] = pool.add(values[name], exact=not name.startswith(FORCE))
    return found


def _watched_in_system(trace: Trace, pool: ColumnStore) -> dict[str, Any]:
    values = SystemScope.over(trace).watches()
    return {
        name: pool.add(column, exact=not name.rpartition(".")[2].startswith(FORCE))
        for name, column in values.items()
        if not name.startswith("state(")
    }


# --------------------------------------------------------------------------- a system
def _system(trace: Trace, pool: ColumnStore) -> dict[str, Any]:
    """Return the motion of bodies, further states, sampled values and signals."""
    system, bodies = trace.what.system, []
    for body in system.bodies:
        motion = trace.body(body.name)
        columns = {"x": pool.add(motion.x), "v": pool.add(motion.v)}
        bodies.append({"name": body.name, "unit": body.unit, **columns})
    sampled = {name: each.name for each in system.sampled for name in each.updates}
    given = [name for name in SystemScope.over(trace).given if name in system.signals]
    values = SystemScope.over(trace)
    return {
        "name": system.name,
        "bodies": bodies,
        "values": [
            {"name": name, "column": pool.add(values.value(name)), "kind": kind}
            for name, kind in (
                *((name, "signal") for name in given),
                *((name, "state") for name in system.flow),
                *((name, sampled[name]) for name in sampled),
            )
        ],
    }
