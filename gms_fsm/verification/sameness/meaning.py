"""What a chart says, with named expressions written out: flows, forces, and what edges do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.language import EVENT, Condition, Name, Value, renamed
from gms_fsm.language.normal import renamed_in


@dataclass(frozen=True)
class EdgeMeaning:
    """An edge that leaves one state.

    Parameters
    ----------
    edge : Transition
        As the chart has it.
    guard : Condition
        When it is taken.
    values : mapping of str to Value
        What variables and velocities are after it.
    emits : frozenset of str
        The events that it emits, as trees call them.
    arrests : bool
        Whether it locks the contact only where the velocity passes 0.
    """

    edge: Transition
    guard: Condition
    values: Mapping[str, Value]
    emits: frozenset[str]
    arrests: bool


@dataclass(frozen=True)
class ChartMeaning:
    """A chart without named expressions, in names that may be those of another chart.

    Parameters
    ----------
    chart : Chart
        As it is.
    flows : mapping of (str, str) to Value
        By state and variable.
    forces : mapping of (str, str) to Value or None
        By state and force; None where the contact is locked.
    totals : mapping of str to Value
        The force of the contact, given the sum of those of its elements.
    edges : mapping of str to tuple of EdgeMeaning
        By the state they leave, in their order.
    start : mapping of str to Value
        What the start of a run assigns.
    durations : mapping of str to Condition
        How long conditions have held.
    """

    chart: Chart
    flows: Mapping[tuple[str, str], Value]
    forces: Mapping[tuple[str, str], Value | None]
    totals: Mapping[str, Value]
    edges: Mapping[str, tuple[EdgeMeaning, ...]]
    start: Mapping[str, Value]
    durations: Mapping[str, Condition]

    def texts(self) -> Iterator[tuple[tuple[str, ...], Value | Condition]]:
        """Yield every tree with its place: its kind, then the states and names that it is for."""
        for (state, variable), flow in self.flows.items():
            yield ("flow", state, variable), flow
        for (state, force), tree in self.forces.items():
            if tree is not None:
                yield ("force", state, force), tree
        for force, tree in self.totals.items():
            yield ("total", force), tree
        for name, tree in self.start.items():
            yield ("start", name), tree
        for state, edges in self.edges.items():
            for each in edges:
                yield ("guard", state, each.edge.target), each.guard
                for name, tree in each.values.items():
                    yield ("action", state, each.edge.target, name), tree


def meaning_of(chart: Chart, names: Mapping[str, str] | None = None) -> ChartMeaning:
    """Return what a chart says, with other names for its variables, parameters and forces.

    Examples
    --------
    >>> from gms_fsm.charts import CHARTS
    >>> from gms_fsm.language import spell
    >>> said = meaning_of(CHARTS["lugre"], {"sigma_0": "k"})
    >>> {spell(tree) for (_, force), tree in said.forces.items()}
    {'k * z + sigma_1 * (v - k * abs(v) * z / s)'}
    """
    new = {old: Name(name) for old, name in (names or {}).items()}
    lets: dict[str, Value] = {}
    for name, tree in chart.lets.items():
        lets[name] = renamed(tree, lets)

    def value(tree: Value, more: Mapping[str, Value] | None = None) -> Value:
        plain = renamed(tree, {**lets, **(more or {})})
        return renamed(plain, new)

    def condition(tree: Condition) -> Condition:
        return renamed_in(renamed_in(tree, lets), new)

    def called(name: str) -> str:
        return new[name].id if name in new else name

    def after(edge: Transition | None) -> dict[str, Value]:
        found: dict[str, Value] = {}
        for name, tree in chart.assigned(edge):
            found[name] = renamed(renamed(tree, lets), found)
        return {called(name): renamed(tree, new) for name, tree in found.items()}

    edges: dict[str, tuple[EdgeMeaning, ...]] = {}
    for state in chart.states:
        leaving = []
        for number, edge in chart.leaving(state.name):
            values = after(edge)
            emitted = frozenset(name for name in values if name.startswith(EVENT))
            kept = {name: tree for name, tree in values.items() if name not in emitted}
            guard = condition(chart.guards[edge.name])
            leaving.append(EdgeMeaning(edge, guard, kept, emitted, number in chart.arrests))
        edges[state.name] = tuple(leaving)
    flows = {key: renamed(tree, lets) for key, tree in chart.flows.items()}
    forces: dict[tuple[str, str], Value | None] = {}
    for (state_name, force), given in chart.forces.items():
        rates = {f"d{name}": flows[state_name, name] for name in chart.variables}
        plain = None if given is None else renamed(renamed(given, lets), rates)
        forces[state_name, called(force)] = None if plain is None else renamed(plain, new)
    return ChartMeaning(
        chart,
        {(state, called(name)): renamed(tree, new) for (state, name), tree in flows.items()},
        forces,
        {called(force): value(tree) for force, tree in chart.totals.items()},
        edges,
        after(None),
        {called(name): condition(tree) for name, tree in chart.durations.items()},
    )
