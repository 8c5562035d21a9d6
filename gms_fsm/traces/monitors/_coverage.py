"""The coverage monitor: the verdict on what one run has tried of a chart."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from gms_fsm.charts.chart import Transition
from gms_fsm.language import Condition
from gms_fsm.traces.coverage.counting import of_view
from gms_fsm.traces.coverage.decisions import Decision
from gms_fsm.traces.scope import clause_text
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import ClauseSeen, CoverageVerdict


def coverage(trace: Trace) -> CoverageVerdict:
    part = of_view(trace)
    states = {each.name: each.seen for each in part.states}
    edges, seen = dict[str, tuple[int, ...]](), list[ClauseSeen]()
    for edge, each in zip(part.chart.transitions, part.edges, strict=True):
        edges[_called(edge)] = each.taken
        decision = part.decisions[edge.name]
        for tree in decision.clauses:
            sides = (_ever(each.asked, decision, tree, side, part.n) for side in (True, False))
            seen.append(ClauseSeen(_called(edge), clause_text(part.chart, tree), *sides))
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


def _ever(
    asked: Mapping[str, tuple[int, ...]], decision: Decision, clause: Condition, side: bool, n: int
) -> tuple[bool, ...]:
    """Return for each element whether a clause was ever true, or ever false."""
    rows = [u for vector, u in asked.items() if decision.holds(vector, clause) == side]
    return tuple(any(each) for each in zip(*rows, strict=True)) if rows else (False,) * n


def _called(edge: Transition) -> str:
    """Return the name of an edge; of one that leaves several states also which one it leaves."""
    return edge.name if len(edge.sources) == 1 else f"{edge.name} from {edge.source}"


def _count(found: Iterable[Iterable[object]]) -> str:
    seen = [any(by_element) for by_element in found]
    return f"{sum(seen)} of {len(seen)}"
