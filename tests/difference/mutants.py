"""Mutants of the guards of a chart, one small change at a time; whether motions tell them apart.

An operator or its strictness, a negation, ``and`` for ``or``, a clause left out, a constant or a
sign: what somebody could get wrong who writes a guard.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from gms_fsm import Chart
from gms_fsm.charts.files.tables import ChartTable
from gms_fsm.generation.generate import Generated, GeneratedRun
from gms_fsm.generation.search import TakenAt, firings_of
from gms_fsm.generation.stand import CONTACT
from gms_fsm.language import (
    Binary,
    Both,
    Condition,
    Either,
    Name,
    Negative,
    Not,
    Number,
    Relation,
    Value,
    spell,
)
from gms_fsm.language.tree import rebuilt
from gms_fsm.traces.failures import SimulationError
from gms_fsm.verification.sameness.same import sameness

OPERATORS = ("<", "<=", ">", ">=")
CLOSE = 1e-9  # share of a run within which two firings are at the same time
LARGER = 1.1  # a changed constant


@dataclass(frozen=True, eq=False)
class GuardMutant:
    """A chart with one guard changed."""

    chart: Chart
    edge: str
    guard: str
    how: str


def guard_mutants(chart: Chart) -> Iterator[GuardMutant]:
    """Yield all mutants of all guards, each once."""
    seen = set[tuple[str, str]]()
    for edge in chart.nesting.transitions:
        tree = chart.guards[edge.name]
        for how, changed in _changes(tree, {*chart.parameter_names}):
            guard = spell(changed)
            if guard != spell(tree) and (edge.name, guard) not in seen:
                seen.add((edge.name, guard))
                yield GuardMutant(with_guard(chart, edge.name, guard), edge.name, guard, how)


def with_guard(chart: Chart, edge: str, guard: str) -> Chart:
    """Return a chart in which an edge has another guard."""
    table = ChartTable.of(chart)
    edges = [
        each.model_copy(update={"guard": guard}) if each.name == edge else each
        for each in table.transitions
    ]
    return table.model_copy(update={"transitions": edges}).build(Chart)


def _changes(tree: Condition, constants: set[str]) -> Iterator[tuple[str, Condition]]:
    match tree:
        case Relation(op, left, right):
            for other in OPERATORS:
                kind = "strictness" if other[0] == op[0] else "operator"
                yield kind, Relation(other, left, right)
            yield "negated", Not(tree)
            for how, value in _values(left, constants):
                yield how, Relation(op, value, right)
            for how, value in _values(right, constants):
                yield how, Relation(op, left, value)
            if right != Number(0.0):
                yield "sign", Relation(op, left, _minus(right))
            yield "sign", Relation(op, _minus(left), right)
        case Not(operand):
            yield "negated", operand
            for how, inner in _changes(operand, constants):
                yield how, Not(inner)
        case Both(parts) | Either(parts):
            kind = type(tree)
            if parts:
                yield "and, or", (Either if kind is Both else Both)(parts)
            for i, part in enumerate(parts):
                rest = (*parts[:i], *parts[i + 1 :])
                yield "dropped", kind(rest) if len(rest) > 1 else rest[0]
                for how, inner in _changes(part, constants):
                    yield how, kind((*parts[:i], inner, *parts[i + 1 :]))


def _values(tree: Value, constants: set[str]) -> Iterator[tuple[str, Value]]:
    """Yield a value with one of its constants changed; 0 becomes 1."""
    match tree:
        case Number(value):
            yield "constant", Number(LARGER * value if value else 1.0)
            if value:
                yield "constant", Number(value / LARGER)
        case Name(name) if name in constants:
            yield "constant", Binary("*", Number(LARGER), tree)
            yield "constant", Binary("/", tree, Number(LARGER))
        case _:
            for i, part in enumerate(tree.parts):
                for how, inner in _values(part, constants):
                    numbered = iter(range(len(tree.parts)))
                    yield (
                        how,
                        rebuilt(tree, lambda p, n=numbered, i=i, u=inner: u if next(n) == i else p),
                    )


def _minus(tree: Value) -> Value:
    return tree.operand if isinstance(tree, Negative) else Negative(tree)


# --------------------------------------------------------------------------- telling them apart
def _log(run: GeneratedRun, chart: Chart) -> tuple[list[TakenAt], str]:
    try:
        return [*firings_of(run.again(chart))], ""
    except SimulationError as error:
        return [*firings_of(error.trace.contact(CONTACT))], type(error).__name__


def killed(run: GeneratedRun, mutant: Chart) -> bool:
    """Return whether a motion shows another log: elements, edges, or times."""
    mine, (its, end) = firings_of(run.trace), _log(run, mutant)
    if end or [each[1:] for each in mine] != [each[1:] for each in its]:
        return True
    least = CLOSE * (run.t_end - run.t_start)
    return any(
        abs(a.t - b.t) > least or (a.t == run.t_start) != (b.t == run.t_start)
        for a, b in zip(mine, its, strict=True)
    )


def judged(found: Generated, chart: Chart) -> Mapping[str, Sequence[GuardMutant]]:
    """Return the mutants of a chart that were killed, that do the same, and the others."""
    sorted_: dict[str, list[GuardMutant]] = {"killed": [], "same": [], "left": []}
    for each in guard_mutants(chart):
        sorted_[_verdict(found, chart, each)].append(each)
    return sorted_


def _verdict(found: Generated, chart: Chart, mutant: GuardMutant) -> str:
    likely = sorted(found.runs, key=lambda run: mutant.edge not in run.title)
    if any(killed(run, mutant.chart) for run in likely):
        return "killed"
    return "same" if sameness(chart, mutant.chart)[0].verdict == "equivalent" else "left"
