"""Draw a friction chart in the manner of Stateflow.

Everything in the picture is read from the chart: states with what they do, edges with priority,
guard and action. A long guard is a node on its edge's path, because Graphviz places nodes without
overlaps but labels of edges badly. Ids and classes are stable, so that the SVG can be restyled
without a new layout: class ``state``, ``guard``, ``edge``, ``default`` and ``region``, and ids such
as ``element1-state-slip``.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Mapping
from math import ceil, sqrt

import graphviz

from gms_fsm.chart import Chart, State, Transition
from gms_fsm.errors import ParameterError
from gms_fsm.expression import MATLAB_LIKE, Both, Condition, Either, Value, spell
from plots.style import INK, LINE_GREY, MONO, PAPER, SANS, TEXT_GREY

__all__ = ["statechart"]

# Points of a state's width for every edge that begins or ends there. In a narrower box the edges
# would leave through the sides and run into each other.
ROOM_PER_EDGE = 45


def statechart(chart: Chart, elements: int = 1) -> graphviz.Digraph:
    """Draw a chart: one element, or a bank of elements as parallel states.

    Parameters
    ----------
    chart : Chart
        The chart; nothing else decides what is shown.
    elements : int, optional
        How many elements. More than one are drawn as parallel (AND) regions in a grid, counted
        from 1.

    Returns
    -------
    graphviz.Digraph
        The picture as a Graphviz graph; `plots.render.render` writes it to a file.

    Raises
    ------
    ParameterError
        If `elements` is not a whole number of at least 1.

    Examples
    --------
    >>> from gms_fsm.charts import LUGRE
    >>> sum("class=state" in line for line in statechart(LUGRE).body)
    1
    """
    if elements < 1 or elements % 1 != 0:
        raise ParameterError(
            f"elements is {elements!r}; a chart has a whole number of elements, at least 1"
        )
    graph = graphviz.Digraph(
        name=graphviz.escape(_printable(chart.name)),
        graph_attr={
            "fontname": SANS,
            "bgcolor": PAPER,
            "pad": "0.15",
            "nodesep": "0.16",
            "ranksep": "0.3",
            "outputorder": "edgesfirst",
        },
        node_attr={"fontname": SANS, "shape": "plain"},
        edge_attr={"color": INK, "arrowsize": "0.7", "penwidth": "1.1"},
    )
    if elements == 1:
        _draw_element(graph, chart, "element1")
        return graph
    # Regions do not touch each other: each is laid out alone, hence all alike, and set in a grid.
    graph.attr(pack="12", packmode=f"array_i{ceil(sqrt(elements))}")
    for number in range(1, elements + 1):
        with graph.subgraph(name=f"cluster_{number}") as region:
            region.attr(
                id=f"element{number}",
                **{"class": "region"},
                label=f"<{_text(f'Element{number}', 13, INK, bold=True)}"
                f"{_text(f'  AND {number}', 10, TEXT_GREY)}>",
                labeljust="l",
                style="dashed,rounded",
                color=LINE_GREY,
                margin="12",
            )
            _draw_element(region, chart, f"element{number}")
    return graph


def _draw_element(graph: graphviz.Digraph, chart: Chart, element: str) -> None:
    dot = f"{element}-default"
    graph.node(
        dot,
        "",
        id=dot,
        **{"class": "default"},
        shape="circle",
        style="filled",
        fillcolor=INK,
        color=INK,
        width="0.11",
        fixedsize="true",
    )
    for state in chart.states:
        name = _id(element, "state", state.name)
        graph.node(name, f"<{_state_box(chart, state)}>", id=name, **{"class": "state"})
    graph.edge(
        dot,
        _id(element, "state", chart.default_state.name),
        id=f"{element}-default-edge",
        **{"class": "default"},
    )
    for state in chart.states:
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            _draw_edge(graph, chart, element, edge, priority)


def _draw_edge(
    graph: graphviz.Digraph, chart: Chart, element: str, edge: Transition, priority: int
) -> None:
    source = _id(element, "state", edge.source)
    target = _id(element, "state", edge.target)
    guard = _id(element, "guard", edge.name)
    name = _id(element, "edge", edge.name)
    graph.node(guard, f"<{_guard_box(chart, edge, priority)}>", id=guard, **{"class": "guard"})
    if edge.source == edge.target:
        graph.edge(source, f"{guard}:w", id=f"{name}-1", dir="none")
        graph.edge(source, f"{guard}:e", id=f"{name}-2", dir="back")
    elif chart.state_index(edge.source) < chart.state_index(edge.target):
        graph.edge(source, f"{guard}:n", id=f"{name}-1", dir="none")
        graph.edge(f"{guard}:s", target, id=f"{name}-2")
    else:  # against the layout's direction: drawn from target to source, with the arrow at the tail
        graph.edge(target, f"{guard}:n", id=f"{name}-2", dir="back")
        graph.edge(f"{guard}:s", source, id=f"{name}-1", dir="none")


# --------------------------------------------------------------------------- labels
def _state_box(chart: Chart, state: State) -> str:
    flow = {f"d{variable}": chart.flows[state.name, variable] for variable in chart.variables}
    lines = [
        *_assignment_lines("entry", chart.assignments["entry", state.name]),
        *_assignment_lines("during", flow),
        *_assignment_lines("exit", chart.assignments["exit", state.name]),
    ]
    ends = sum((edge.source, edge.target).count(state.name) for edge in chart.transitions)
    title = _text(state.name[:1].upper() + state.name[1:], 12, INK, bold=True)
    return (
        f'<TABLE BORDER="1" COLOR="{INK}" BGCOLOR="{PAPER}" STYLE="ROUNDED" CELLBORDER="0" '
        f'CELLSPACING="0" CELLPADDING="3"><TR><TD ALIGN="LEFT" WIDTH="{ends * ROOM_PER_EDGE}">'
        f"{title}</TD></TR><HR/>"
        + "".join(f'<TR><TD ALIGN="LEFT">{line}</TD></TR>' for line in lines)
        + "</TABLE>"
    )


def _assignment_lines(kind: str, trees: Mapping[str, Value]) -> Iterable[str]:
    head = f"{kind}: "
    for name, tree in trees.items():
        yield _code(head, TEXT_GREY) + _code(f"{name} = {spell(tree, MATLAB_LIKE)};")
        head = " " * len(head)


def _guard_box(chart: Chart, edge: Transition, priority: int) -> str:
    clauses, word = _clauses(chart.guards[edge.name])
    heads = ["["] + [" "] * (len(clauses) - 1)
    tails = [f" {word}"] * (len(clauses) - 1) + ["]"]
    # Every clause is a text of its own, so that it can be found in the SVG.
    lines = [
        _code(head) + _code(clause) + _code(tail)
        for head, clause, tail in zip(heads, clauses, tails, strict=True)
    ]
    actions = chart.assignments["action", edge.name]
    if actions:
        texts = (f"{name} = {spell(tree, MATLAB_LIKE)};" for name, tree in actions.items())
        lines.append(_code("{") + _code(" ".join(texts)) + _code("}"))
    numbers = [str(priority)] + [" "] * (len(lines) - 1)
    rows = (
        f'<TR><TD ALIGN="LEFT">{_code(number, bold=True)}</TD><TD ALIGN="LEFT">{line}</TD></TR>'
        for number, line in zip(numbers, lines, strict=True)
    )
    return (
        f'<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="1" BGCOLOR="{PAPER}">'
        + "".join(rows)
        + "</TABLE>"
    )


def _clauses(guard: Condition) -> tuple[list[str], str]:
    """Return the lines of a guard, and the word between them."""
    if not isinstance(guard, Both | Either):
        return [spell(guard, MATLAB_LIKE)], ""
    lines = []
    for operand in guard.operands:
        text = spell(operand, MATLAB_LIKE)
        # The brackets that the guard has as one text: && binds tighter than ||.
        lines.append(f"({text})" if isinstance(operand, (Either, type(guard))) else text)
    return lines, "&&" if isinstance(guard, Both) else "||"


def _text(text: str, size: int, colour: str, face: str = SANS, bold: bool = False) -> str:
    words = f"<B>{_escape(text)}</B>" if bold else _escape(text)
    return f'<FONT FACE="{face}" POINT-SIZE="{size}" COLOR="{colour}">{words}</FONT>'


def _code(text: str, colour: str = INK, bold: bool = False) -> str:
    return _text(text, 10, colour, MONO, bold)


def _escape(text: str) -> str:
    """Write a text for an HTML label: nothing in it is markup, and an indent stays."""
    words = html.escape(_printable(text.lstrip(" ")))
    # Graphviz 2.43 refuses a bare ] in a label; one backslash would begin an escape sequence.
    words = words.replace("[", "&#91;").replace("]", "&#93;").replace("\\", "&#92;" * 2)
    return "&#160;" * (len(text) - len(text.lstrip(" "))) + words


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


def _id(element: str, kind: str, name: str) -> str:
    # Names of a chart are identifiers; whatever else came in here could be read as a port or DOT.
    return f"{element}-{kind}-" + re.sub(r"\W", "_", name)
