"""Builds a chart from states and edges that come from another program, and texts given beside."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, TypedDict

from gms_fsm.charts.files.routes import (
    Assigned,
    FlatEdge,
    ImportedEdge,
    ImportedState,
    Route,
    flat_states,
    flattened,
    nests,
    routes,
    spelled,
    tree,
    written,
)
from gms_fsm.charts.nesting import AGE
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.parts import Transition, texts_of
from gms_fsm.errors import ChartError, ExpressionError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.language import Value, evaluate, names_in, parse_value

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Chart


@dataclass(frozen=True, kw_only=True)
class Texts:
    """What is given beside states and edges; the fields are those of `Chart.from_transitions`."""

    name: str = "imported chart"
    reference: str = ""
    inputs: Iterable[str] = ("v",)
    velocities: Iterable[str] = ("v",)
    variables: Iterable[str] = ()
    parameters: Iterable[Parameter | str | Mapping[str, Any]] = ()
    let: Mapping[str, str] = field(default_factory=dict)
    flows: Mapping[str, Assigned] = field(default_factory=dict)
    guards: Mapping[str, str] = field(default_factory=dict)
    entry: Mapping[str, Assigned] = field(default_factory=dict)
    exit: Mapping[str, Assigned] = field(default_factory=dict)
    actions: Mapping[str, Assigned] = field(default_factory=dict)
    callbacks: Mapping[str, str | Assigned] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)
    state_outputs: Mapping[str, Assigned] = field(default_factory=dict)
    contact_outputs: Mapping[str, str] = field(default_factory=dict)
    initial: Mapping[str, float] = field(default_factory=dict)
    locked: Iterable[str] = ()
    impulses: Iterable[str] = ()

    @classmethod
    def of(cls, given: Mapping[str, Any], here: str) -> Texts:
        """Refuse unknown names."""
        known = [each.name for each in fields(cls)]
        for name in given:
            if name not in known:
                raise unknown("argument", name, known, ChartError, place=here)
        several = {"inputs", "velocities", "variables", "parameters", "locked", "impulses"}
        given = {**given} | {
            name: _several(given[name], f"{here}: {name}") for name in given.keys() & several
        }
        for name in given.keys() & {"let", "initial"}:
            texts_of(given[name], f"{here}: {name}")
        return cls(**given)


class GivenTexts(TypedDict, total=False):
    """The same as keyword arguments."""

    name: str
    reference: str
    inputs: Iterable[str]
    velocities: Iterable[str]
    variables: Iterable[str]
    parameters: Iterable[Parameter | str | Mapping[str, Any]]
    let: Mapping[str, str]
    flows: Mapping[str, Assigned]
    guards: Mapping[str, str]
    entry: Mapping[str, Assigned]
    exit: Mapping[str, Assigned]
    actions: Mapping[str, Assigned]
    callbacks: Mapping[str, str | Assigned]
    outputs: Mapping[str, str]
    state_outputs: Mapping[str, Assigned]
    contact_outputs: Mapping[str, str]
    initial: Mapping[str, float]
    locked: Iterable[str]
    impulses: Iterable[str]


# --------------------------------------------------------------------------- the chart
def built(
    kind: type[Chart],
    states: list[ImportedState],
    first: Route,
    edges: list[ImportedEdge],
    given: Texts,
    here: str,
) -> tuple[Chart, list[FlatEdge]]:
    """Return the chart, and its edges with the numbers of those they are made from."""
    texts = {
        part: _known(
            getattr(given, part), [*map(spelled, routes(states))], "state", f"{here}: {part}"
        )
        for part in ("flows", "entry", "exit", "state_outputs")
    }
    states = [
        replace(
            each,
            entry=texts["entry"].get(spelled(each.route), each.entry),
            exit=texts["exit"].get(spelled(each.route), each.exit),
        )
        for each in states
    ]
    nested = nests(states, edges)
    leaves, flat, outer = (
        (states, written(edges), list[ImportedState]())
        if nested
        else flattened(states, first, edges)
    )
    start = _started(outer, dict.fromkeys(given.variables, 0.0) | {**given.initial})
    names = [spelled(each.route) for each in leaves]
    used = [*given.inputs, *given.velocities, *given.variables, *given.let]
    flat = named(flat, edges, [*names, *used])
    known = [*dict.fromkeys([each.name for each in flat] + [each.trigger for each in edges])]
    actions = _known(given.actions, known, "edge", f"{here}: actions")
    guards = texts_of(given.guards, f"{here}: guards")
    _check_known(guards, known, "edge", f"{here}: guards")
    conditions = _guards(flat, edges, guards)
    locked = dict.fromkeys(map(str, given.locked))
    _check_known(locked, [*map(spelled, routes(states))], "state", f"{here}: locked")
    impulses = dict.fromkeys(map(str, given.impulses))
    _check_known(impulses, known, "edge", f"{here}: impulses")
    parts = {spelled(each.route): each for each in leaves}
    paths = {name: ".".join(each.route) for name, each in parts.items()} if nested else {}
    chart = kind(
        given.name,
        given.inputs,
        given.variables,
        tuple(_parameter(each, here) for each in given.parameters),
        tree(states, first, (), texts, locked) if nested else flat_states(leaves, texts, locked),
        tuple(
            Transition(
                each.name,
                [paths.get(source, source) for source in each.sources],
                paths.get(each.target, each.target),
                conditions[each.name],
                _actions(each, edges[each.number], actions, parts),
                impulse=each.name in impulses or edges[each.number].trigger in impulses,
            )
            for each in flat
        ),
        given.outputs,
        given.reference,
        let=given.let,
        velocities=given.velocities,
        contact_outputs=given.contact_outputs,
        initial=start,
    )
    for each in [] if nested else flat:
        _check_time(chart, each, edges[each.number], parts)
    return chart, flat


def _check_time(
    chart: Chart, each: FlatEdge, edge: ImportedEdge, leaves: Mapping[str, ImportedState]
) -> None:
    """Refuse an edge for which the time in a state would mean something else."""
    if AGE in names_in(chart.guards[each.name]) and spelled(edge.source) not in leaves:
        raise ChartError(
            f"its guard reads the time in {spelled(edge.source)!r}, which has states inside: a "
            "chart knows the time in these",
            place=edge.place,
            advice="count the time in a variable with the flow '1'",
        )
    if edge.target is None and AGE in chart.variables:
        raise ChartError(
            "it leaves nothing, and the chart reads the time in a state, which an edge from a "
            "state to itself starts again",
            place=edge.place,
            advice="count the time in a variable with the flow '1'",
        )


def _guards(
    flat: list[FlatEdge], edges: list[ImportedEdge], given: Mapping[str, str]
) -> dict[str, str]:
    """Return the guard of each edge: what is given by its name, or by that of its trigger.

    What is given for a trigger with several kinds of edges is joined to their own conditions.
    """
    found: dict[str, str] = {}
    lacking: dict[str, ImportedEdge] = {}
    for each in flat:
        edge = edges[each.number]
        alike = {one.kind for one in edges if one.trigger == edge.trigger}
        shared = given.get(edge.trigger)
        whole = given.get(each.name, shared if len(alike) == 1 else None)
        parts = [shared, edge.guard] if whole is None else [whole]
        texts = [text for text in (*parts, edge.also) if text is not None]
        if not texts or (whole is None and edge.missing):
            lacking.setdefault(each.name if edge.missing else edge.trigger, edge)
        else:
            found[each.name] = all_of(texts)
    if lacking:
        (name, edge), *others = lacking.items()
        more = f", and for {', '.join(repr(each) for each, _ in others)}" if others else ""
        told = f", nor a text for its condition {edge.missing!r}" if edge.missing else ""
        either = f", or callbacks={{{edge.missing!r}: 'z > s'}}" if edge.missing else ""
        raise ChartError(
            f"no guard is given for it{told}",
            place=edge.place,
            advice=f"give one as text, guards={{{name!r}: 'z > s'}}{either}{more}; 'True' for "
            "always",
        )
    return found


def _actions(
    each: FlatEdge,
    edge: ImportedEdge,
    given: Mapping[str, Assigned],
    leaves: Mapping[str, ImportedState],
) -> Assigned:
    """Return what an edge assigns, which a chart does between exit and entry."""
    own = given.get(each.name, given.get(edge.trigger, edge.actions))
    left, entered = each.around
    whole = edge.target is not None
    for texts, part, other in (
        (edge.before, "before", any(leaves[one].exit for one in each.sources)),
        (edge.after, "after", leaves[each.target].entry),
    ):
        if texts and other and whole:
            raise ChartError(
                f"what it assigns {part} the states change cannot be kept: a chart assigns in the "
                "order exit, action, entry",
                place=edge.place,
                advice="assign it in the transition itself, or leave exit and entry out",
            )
    if not whole and any(leaves[one].exit or leaves[one].entry for one in each.sources):
        raise ChartError(
            f"it leaves nothing, but a chart performs exit and entry of {each.target!r}",
            place=edge.place,
            advice="move what they assign to the edges that enter and leave it",
        )
    return joined((edge.before, *left, own, *entered, edge.after), edge.place)


def all_of(conditions: Iterable[str]) -> str:
    """Return conditions as one."""
    several = [*conditions]
    if len(several) == 1:
        return several[0]
    return " and ".join(f"({each})" if " or " in each else each for each in several)


def joined(texts: Iterable[Assigned], place: str) -> dict[str, str]:
    """Return assignments one after the other as one; none may be there twice."""
    found: dict[str, str] = {}
    for each in texts:
        for name, text in each.items():
            if name in found:
                raise ChartError(
                    f"{name!r} is assigned twice in a row, {found[name]!r} and {text!r}",
                    place=place,
                    advice="a chart assigns one expression to a variable",
                )
            found[name] = text
    return found


def _started(outer: list[ImportedState], values: dict[str, float]) -> dict[str, float]:
    """Return the values at the start, after the entries of outer states; zeros are left out."""
    for each in outer:
        for name, text in each.entry.items():
            try:
                values[name] = number_of(parse_value(text, values), values)
            except ExpressionError:
                raise ChartError(
                    f"at the start its entry assigns {text!r} to {name!r}, which is no number yet",
                    place=each.place,
                    advice="assign it in the state that is entered inside of it",
                ) from None
    return {name: value for name, value in values.items() if value}


def number_of(tree: Value, values: Mapping[str, float]) -> float:
    """Return the value of an expression at the start; NaN, which a chart refuses, without one."""
    try:
        return float(evaluate(tree, values))
    except (ArithmeticError, ValueError):
        return math.nan


# --------------------------------------------------------------------------- names
def named(rows: list[FlatEdge], edges: list[ImportedEdge], taken: list[str]) -> list[FlatEdge]:
    """Give every row the name of its edge; rows that differ in their source only are one.

    An edge has the name of its trigger if no other has the same, or else ``source_target``.
    """
    groups: dict[str, list[FlatEdge]] = {}
    for row in rows:
        groups.setdefault(edges[row.number].trigger, []).append(row)

    def alike(group: list[FlatEdge]) -> bool:
        kinds = {
            repr((row.target, edge.kind, edge.actions, edge.before, edge.after, row.around))
            for row in group
            for edge in [edges[row.number]]
        }
        return len(kinds) == 1 and len({row.sources for row in group}) == len(group)

    whole = {name for name, group in groups.items() if name and name not in taken and alike(group)}
    while True:
        called = _called(rows, edges, whole, [*taken, *whole])
        places = {name: k for k, name in reversed([*enumerate(called)])}
        last: dict[str, int] = {}
        wrong = set()
        for row, name in zip(rows, called, strict=True):
            if places[name] < last.get(row.sources[0], -1):  # one edge would change the priority
                wrong.add(name)
            last[row.sources[0]] = places[name]
        if not wrong & whole:
            break
        whole -= wrong
    found: dict[str, FlatEdge] = {}
    for row, name in zip(rows, called, strict=True):
        before = found[name].sources if name in found else ()
        found[name] = replace(found.get(name, row), name=name, sources=(*before, *row.sources))
    return [*found.values()]


def _called(
    rows: list[FlatEdge], edges: list[ImportedEdge], whole: set[str], taken: list[str]
) -> list[str]:
    used, found = {*taken}, list[str]()
    for row in rows:
        name = edges[row.number].trigger
        if name not in whole:
            made = name = f"{row.sources[0]}_{row.target}"
            for k in itertools.count(2):
                if name not in used:
                    break
                name = f"{made}_{k}"
            used.add(name)
        found.append(name)
    return found


# --------------------------------------------------------------------------- what is given
def _known(
    given: Mapping[str, Mapping[str, str]], names: list[str], kind: str, place: str
) -> Mapping[str, Mapping[str, str]]:
    if not isinstance(given, Mapping):
        raise ChartError(
            f"it gives texts for each {kind}, for example {{'slip': {{'z': 'v'}}}}",
            place=place,
            value=given,
        )
    _check_known(given, names, kind, place)
    return given


def _check_known(given: Mapping[str, object], names: list[str], kind: str, place: str) -> None:
    for name in given:
        if name not in names:
            raise unknown(kind, name, names, ChartError, place=place)


def _several(given: object, place: str) -> tuple[Any, ...]:
    if isinstance(given, str | Mapping) or not isinstance(given, Iterable):
        raise ChartError("give a tuple", place=place, value=given)
    return tuple(given)


def _parameter(given: object, here: str) -> Any:
    """Return a parameter; mappings are as an exported file has them."""
    if not isinstance(given, Mapping):
        return given  # the chart checks it
    known = [each.name for each in fields(Parameter)]
    if "name" not in given or (unknown := sorted({*map(str, given)} - {*known})):
        said = "no name" if "name" not in given else f"unknown fields {', '.join(unknown)}"
        raise ChartError(
            f"a parameter has {said}",
            place=f"{here}: parameters",
            value=dict(given),
            advice=f"a Parameter has {', '.join(known)}",
        )
    return Parameter(**given)
