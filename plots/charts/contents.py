"""What a picture of a chart shows of each state, and of the chart as a whole, in every format."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.nesting import AGE, Level, written_guard
from gms_fsm.charts.reader import called
from gms_fsm.language import MATLAB_LIKE, Condition, Name, Value, parse_value, renamed, spell
from gms_fsm.language.normal import renamed_in
from plots.charts.notation import ChartWriter

SAID_ONCE = 3  # states: what so many have alike, forces and flows, is said once for all of them

Texts = list[tuple[str, list[str]]]  # kinds, such as during, each with its texts


def state_texts(write: ChartWriter, state: State) -> Texts:
    """Return what a picture shows in a state.

    Not shown are a variable that flows in no state and the timer behind ``after(T)``; nor, where
    there are three states or more, forces and flows that are the same in all of them: `chart_texts`
    has them.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT
    >>> write = ChartWriter(GMS_ELEMENT["signed"], "stateflow")
    >>> [(kind, texts) for kind, texts in state_texts(write, write.chart.states[0]) if texts]
    [('during', ['dz = v;']), ('force', ['F = k * z + sigma * dz;'])]
    """
    return _texts(write, state, state.name, lambda *_: state.name)


def level_texts(write: ChartWriter, level: Level) -> Texts:
    """Return what a picture of nested states shows in one of them: not what it inherits."""
    nesting = write.chart.nesting

    def leaf_of(kind: str, name: str) -> str | None:
        for leaf in nesting.leaves_of(level.path):
            giver = nesting.giver(kind, leaf, name)
            if giver is level or (giver is None and not level.state.states):
                return leaf
        return None

    return _texts(write, level.state, level.path, leaf_of, {level.age: Name(AGE)})


def _texts(
    write: ChartWriter,
    state: State,
    path: str,
    leaf_of: Callable[[str, str], str | None],
    called: Mapping[str, Value] = MappingProxyType({}),
) -> Texts:
    """Return texts; flows and forces are those of a leaf, or are not shown here."""
    chart = write.chart
    actions = {
        kind: [
            write.assignment(name, renamed(tree, called))
            for name, tree in trees.items()
            if name in given
        ]
        for kind, given in (("entry", state.entry), ("exit", state.exit))
        for trees in (chart.assignments[kind, path],)
    }
    flowing = {name for each in chart.states for name in each.flow} - {*_flows_below(chart)}
    flows = [
        write.flow(name, renamed(chart.flows[leaf, name], called))
        for name in chart.variables
        if name in flowing and (leaf := leaf_of("flow", name)) is not None
    ]
    forces = {
        name: renamed(tree, called)
        for name in (() if _force_below(chart) else chart.force_names)
        if (leaf := leaf_of("outputs", name)) is not None
        and (tree := chart.forces[leaf, name]) is not None
    }
    return [
        ("entry", actions["entry"]),
        ("during", flows),
        (_given(chart), _equations(write, forces)),
        ("locked", [write.held()] if state.locked else []),
        ("exit", actions["exit"]),
    ]


def chart_texts(write: ChartWriter) -> Texts:
    """Return what a picture shows of the whole chart."""
    chart = write.chart
    shared = _forces(chart, chart.default_state) if _force_below(chart) else {}
    return [
        ("at the start", [write.assignment(*each) for each in _starts(chart)]),
        ("let", _equations(write, chart.lets)),
        (
            "during in all states",
            [write.flow(name, tree) for name, tree in _flows_below(chart).items()],
        ),
        (f"{_given(chart)} in all states", _equations(write, shared)),
        (
            "force of the contact",
            [write.total(name, tree) for name, tree in chart.totals.items()],
        ),
    ]


def _given(chart: Chart) -> str:
    """Return what a state gives out: the force of a contact, or an output of a supervisor."""
    return "force" if chart.velocities else "output"


def _starts(chart: Chart) -> Iterator[tuple[str, Value]]:
    """Yield the variables that start with a value of their chart."""
    for name, value in chart.initial.items():
        yield name, parse_value(repr(value), [])


def _equations(write: ChartWriter, trees: Mapping[str, Value]) -> list[str]:
    return [write.equation(name, tree) for name, tree in trees.items()]


def _force_below(chart: Chart) -> bool:
    """Return whether one force of many states is said once, below them."""
    own = any(state.outputs or state.locked for state in chart.states)
    return len(chart.states) >= SAID_ONCE and not own


def _flows_below(chart: Chart) -> dict[str, Value]:
    """Return the flows that all of many states share."""
    shared = {}
    for name in chart.variables if len(chart.states) >= SAID_ONCE else ():
        first, *others = (chart.flows[state.name, name] for state in chart.states)
        given = any(name in state.flow for state in chart.states)
        if given and all(each == first for each in others):
            shared[name] = first
    return shared


def _forces(chart: Chart, state: State) -> dict[str, Value]:
    """Return the forces that a state gives, by name; none if it is locked."""
    forces = {name: chart.forces[state.name, name] for name in chart.force_names}
    return {name: tree for name, tree in forces.items() if tree is not None}


def lines_of(texts: Texts) -> list[str]:
    """Return texts as lines, each with its kind."""
    return [f"{kind}: {text}" for kind, own in texts for text in own]


def edges_by_priority(chart: Chart) -> Iterator[tuple[int, Transition]]:
    """Yield all edges, state by state, each with its priority among those that leave its state."""
    for state in chart.states:
        yield from enumerate((edge for _, edge in chart.leaving(state.name)), start=1)


def written_edges(chart: Chart) -> Iterator[tuple[int, Transition]]:
    """Yield the edges as they are written, those of composite states once, with priorities."""
    for path in chart.nesting.levels:
        own = [edge for edge in chart.nesting.transitions if path in edge.sources]
        yield from enumerate((edge.leaving(path) for edge in own), start=1)


def guard_of(chart: Chart, edge: Transition) -> Condition:
    """Return the guard of an edge, or of an edge as it is written."""
    guard = chart.guards[edge.name]
    if edge.performs:  # of a leaf
        return guard
    guard = written_guard(guard, chart.nesting, edge)
    return renamed_in(
        guard, {**called(chart.durations), chart.nesting.levels[edge.source].age: Name(AGE)}
    )


def edge_text(write: ChartWriter, priority: int, edge: Transition) -> str:
    """Return the text of an edge: priority, guard, action."""
    actions = write.actions(edge)
    guard = spell(guard_of(write.chart, edge), MATLAB_LIKE)
    return f"{priority} [{guard}] {actions}".rstrip()


def ids_of(chart: Chart) -> dict[str, str]:
    """Return an identifier for each state; a bare name could be a keyword, such as end or note."""
    names = chart.nesting.levels
    return {name: f"s{i}_" + re.sub(r"[^A-Za-z0-9_]", "_", name) for i, name in enumerate(names, 1)}


def state_lines(
    write: ChartWriter, ids: Mapping[str, str], escape: Callable[[str], str], path: str = ""
) -> Iterator[str]:
    """Yield the states of a chart, or those in a state, as PlantUML and Mermaid write them."""
    levels = write.chart.nesting.levels
    inside = levels[path].inside() if path else [each.name for each in write.chart.nesting.states]
    yield f"[*] --> {ids[inside[0]]}"
    for level in map(levels.__getitem__, inside):
        own, lines = ids[level.path], lines_of(level_texts(write, level))
        if level.state.states:  # below the title Mermaid takes no texts
            lines = [level.state.name, *(["history"] if level.state.history else []), *lines]
            yield f'state "{escape(" | ".join(lines))}" as {own}'
            yield f"state {own} {{"
            yield from (f"    {line}" for line in state_lines(write, ids, escape, level.path))
            yield "}"
        else:
            yield f'state "{escape(level.state.name)}" as {own}'
            # The space after the colon is needed: Mermaid would read ":#58;" as a style.
            yield from (f"{own} : {escape(line)}" for line in lines)


def chart_in_words(chart: Chart) -> str:
    """Return a chart as text for people: shown where no picture can be drawn.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT
    >>> print(chart_in_words(GMS_ELEMENT["signed"]))
    GMS element, signed law
    stick (default)
      during: dz = v;
      force: F = k * z + sigma * dz;
      1 -> slip [z >= s && v > v_c]
      2 -> slip [z <= -s && v < -v_c]
    slip
      during: dz = C * (sgn(v) - z / s);
      force: F = k * z + sigma * dz;
      1 -> stick [|v| <= v_c && |z| < s]
    """
    write, lines = ChartWriter(chart, "stateflow"), [chart.name]
    for state in chart.states:
        lines.append(f"{state.name}{' (default)' * (state == chart.default_state)}")
        lines += [f"  {line}" for line in lines_of(state_texts(write, state))]
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            actions = write.actions(edge)
            line = f"  {priority} -> {edge.target} [{chart.guard_text(edge.name)}] {actions}"
            lines.append(line.rstrip())
    return "\n".join([*lines, *lines_of(chart_texts(write))])
