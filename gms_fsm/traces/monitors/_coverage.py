"""The coverage monitor: states, edges and guard clauses that a run has exercised."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.chart import Transition
from gms_fsm.language import MATLAB_LIKE, Condition, clauses, names_in, spell, truths
from gms_fsm.traces.scope import guard_columns
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import ClauseSeen, CoverageVerdict


def coverage(trace: Trace) -> CoverageVerdict:
    chart, log, mode = trace.model.chart, trace.transitions, trace.modes.T
    inside = {state.name: mode == m for m, state in enumerate(chart.states)}
    states = {name: _each(places) for name, places in inside.items()}
    edges = {
        _called(edge): tuple(
            np.bincount(
                log["element"][(log["edge"] == edge.name) & (log["source"] == edge.source)],
                minlength=trace.n,
            ).tolist()
        )
        for edge in chart.transitions
    }
    columns = guard_columns(trace, frozenset[str]().union(*map(names_in, chart.guards.values())))
    known: dict[Condition, NDArray[np.bool_]] = {}
    seen = []
    for edge in chart.transitions:
        for part in clauses(chart.guards[edge.name]):
            if part not in known:
                values = {name: columns[name] for name in names_in(part)}
                known[part] = truths(part, values, mode.shape)
            truth, here = known[part], inside[edge.source]
            sides = _each(truth & here), _each(here & ~truth)
            seen.append(ClauseSeen(_called(edge), spell(part, MATLAB_LIKE), *sides))
    never = [f"state {name}" for name, been in states.items() if not any(been)]
    never += [f"edge {name}" for name, taken in edges.items() if not any(taken)]
    for clause in seen:
        never += [
            f"{clause.text} of {clause.edge} {side}"
            for side, been in (("true", clause.true), ("false", clause.false))
            if not any(been)
        ]
    text = f"states {_count(states.values())}"
    if edges:
        text += f", edges {_count(edges.values())}"
        text += f", clauses true {_count(clause.true for clause in seen)}"
        text += f", clauses false {_count(clause.false for clause in seen)}"
    if never:
        text += (
            f"; never: {', '.join(never)}; a longer run, motion in both directions or other "
            "initial values would show more"
        )
    return CoverageVerdict(not never, text, states, edges, tuple(seen), tuple(never))


def _called(edge: Transition) -> str:
    """Return the name of an edge; of one that leaves several states also which one it leaves."""
    return edge.name if len(edge.sources) == 1 else f"{edge.name} from {edge.source}"


def _count(found: Iterable[Iterable[object]]) -> str:
    seen = [any(by_element) for by_element in found]
    return f"{sum(seen)} of {len(seen)}"


def _each(places: NDArray[np.bool_]) -> tuple[bool, ...]:
    """Return for each element whether a condition holds at any row."""
    return tuple(bool(found) for found in np.any(places, axis=1))
