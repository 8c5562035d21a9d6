"""Charts as drawings, whose labels and lines have positions: one element as a graph.

Lengths are points; y points down.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from plots.charts.cells import Label
from plots.charts.contents import edges_by_priority
from plots.charts.labels import edge_id, element_id, part_id
from plots.charts.layout.layers import LayerEdge, Point, layered, straight
from plots.charts.layout.placed import placed, ring

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Transition
    from plots.charts.statechart import ChartSheet


MARKED = "2.6"  # points; width of highlighted lines
DOT_SIZE = 8.0  # diameter of the dot at the default state


@dataclass(frozen=True)
class Node:
    """A label at a place.

    Parameters
    ----------
    name : str
        Its id.
    kind : str
        Its classes.
    at : (float, float)
        Its centre.
    label : Label, optional
        Its text; without one it is the dot of the default state.
    """

    name: str
    kind: str
    at: Point
    label: Label | None = None


@dataclass(frozen=True)
class DrawnLine:
    """A line between two nodes.

    Parameters
    ----------
    name : str
        Its id.
    ends : (str, str)
        Names of the nodes.
    points : tuple of (float, float)
        A point, then three for each Bezier curve.
    arrow : bool
        Whether the last point is the tip of an arrow.
    look : dict of str to str
        Further attributes.
    """

    name: str
    ends: tuple[str, str]
    points: tuple[Point, ...]
    arrow: bool
    look: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Drawing:
    """Labels and lines, with the left upper corner at the origin.

    Parameters
    ----------
    width, height : float
        Points.
    nodes, lines : tuple
        What is drawn.
    """

    width: float
    height: float
    nodes: tuple[Node, ...]
    lines: tuple[DrawnLine, ...]


def graph_drawing(sheet: ChartSheet, number: int) -> Drawing:
    """Return an element as states and arrows."""
    chart, element, cells = sheet.chart, element_id(number), sheet.cells
    edges = [(edge, priority) for priority, edge in edges_by_priority(chart)]
    boxes = [
        cells.guard(sheet.guard_rows(edge, priority, number), edge.name in sheet.marked)
        for edge, priority in edges
    ]
    rows = [sheet.state_rows(state, number) for state in chart.states]
    plain = [
        cells.state(own, state.name in sheet.marked)
        for own, state in zip(rows, chart.states, strict=True)
    ]
    links = [
        LayerEdge(
            chart.state_index(edge.source), chart.state_index(edge.target), (box.width, box.height)
        )
        for (edge, _), box in zip(edges, boxes, strict=True)
    ]
    sizes = [(float(box.width), float(box.height)) for box in plain]
    centres = [chart.layout[each.name] for each in chart.states] if chart.layout else None
    centres = centres or ring(sizes, links)
    if centres is None:
        laid = layered(sizes, links, sheet.direction)
    else:
        laid = placed(sizes, links, centres, sheet.direction)
    names = [part_id(element, "state", state.name) for state in chart.states]
    dot = f"{element}-default"
    nodes = [Node(dot, "default", laid.dot)]
    for state, name, at, size, own in zip(
        chart.states, names, laid.states, laid.sizes, rows, strict=True
    ):
        marked = state.name in sheet.marked
        kind = "state marked" if marked else "state"
        nodes.append(Node(name, kind, at, cells.state(own, marked, size)))
    lines = [default_line(dot, names[0], laid.dot, laid.states[0], laid.sizes[0], sheet.direction)]
    for (edge, _), box, link, at, line in zip(
        edges, boxes, links, laid.labels, laid.lines, strict=True
    ):
        guard = edge_id(element, "guard", edge)
        name = edge_id(element, "edge", edge)
        look, marked = edge_look(sheet, number, edge), edge.name in sheet.marked
        nodes.append(Node(guard, "guard marked" if marked else "guard", at, box))
        ends = names[link.source], names[link.target]
        lines.append(DrawnLine(name, ends, tuple(line), True, look))
    return Drawing(laid.width, laid.height, tuple(nodes), tuple(lines))


def edge_look(sheet: ChartSheet, number: int, edge: Transition) -> dict[str, str]:
    """Return the attributes of an edge's line: never taken or removed is dashed, marked is wide."""
    look = {"style": "dashed"} if edge.name in sheet.removed else {}
    if sheet.tally is not None:
        if not sheet.tally.times(number, edge):
            look = {"style": "dashed"}
        elif width := sheet.tally.width(number, edge):
            look = {"penwidth": f"{width:.2f}"}
    if edge.name in sheet.marked:
        look |= {"class": "marked", "penwidth": MARKED}
    return look


def default_line(
    dot: str, state: str, at: Point, centre: Point, size: tuple[float, float], direction: str
) -> DrawnLine:
    """Return the arrow from the dot to the default state."""
    (x, y), (to_x, to_y) = at, centre
    if direction == "TB":
        start, end = (x, y + DOT_SIZE / 2), (x, to_y - size[1] / 2)
    else:
        start, end = (x + DOT_SIZE / 2, y), (to_x - size[0] / 2, y)
    name = f"{dot}-edge"
    return DrawnLine(name, (dot, state), tuple(straight(start, end)), True, {"class": "default"})
