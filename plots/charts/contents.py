"""What a picture of a chart shows of each state, and of the chart as a whole, in every format."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.language import Value, parse_value
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
    chart = write.chart
    actions = {
        kind: [write.assignment(name, tree) for name, tree in trees.items() if name in given]
        for kind, given in (("entry", state.entry), ("exit", state.exit))
        for trees in (chart.assignments[kind, state.name],)
    }
    flowing = {name for each in chart.states for name in each.flow} - {*_flows_below(chart)}
    flows = [name for name in chart.variables if name in flowing]
    forces = {} if _force_below(chart) else _forces(chart, state)
    return [
        ("entry", actions["entry"]),
        ("during", [write.flow(name, chart.flows[state.name, name]) for name in flows]),
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


def edge_text(write: ChartWriter, priority: int, edge: Transition) -> str:
    """Return the text of an edge: priority, guard, action."""
    actions = write.actions(write.chart.assignments["action", edge.name])
    return f"{priority} [{write.chart.guard_text(edge.name)}] {actions}".rstrip()


def ids_of(chart: Chart) -> dict[str, str]:
    """Return an identifier for each state; a bare name could be a keyword, such as end or note."""
    names = [state.name for state in chart.states]
    return {name: f"s{i}_" + re.sub(r"[^A-Za-z0-9_]", "_", name) for i, name in enumerate(names, 1)}


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
            actions = write.actions(chart.assignments["action", edge.name])
            line = f"  {priority} -> {edge.target} [{chart.guard_text(edge.name)}] {actions}"
            lines.append(line.rstrip())
    return "\n".join([*lines, *lines_of(chart_texts(write))])
