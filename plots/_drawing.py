"""Charts as drawings with given positions: one element as a graph, and elements side by side.

A drawing has labels and lines at points; y points down. Graphviz gets them with y pointing up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import ceil, hypot, sqrt
from typing import TYPE_CHECKING

import graphviz

from plots._cells import Label
from plots._labels import Piece, Row, edge_id, element_id, part_id
from plots._layers import ARROW, Link, Point, layered

if TYPE_CHECKING:
    from plots.statechart import Sheet

__all__ = ["Drawing", "Line", "Node", "arrange", "graph_drawing"]

MARKED = "2.6"  # points; width of highlighted lines
DOT_SIZE = 8.0
MARGIN = 12.0  # around what is in a region
APART = 12.0  # between regions
# Type of 10 points is at least 7 points high if this width is printed on 170 mm.
PRINTED = 688.0
WIDEST = 2 * 595.0 - 60.0  # two pages of A4, less the frame of a region
MOST_ALIKE = 6  # regions; more that are all alike are drawn as one


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
class Line:
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
    lines: tuple[Line, ...]


def graph_drawing(sheet: Sheet, number: int) -> Drawing:
    """Return an element as states and arrows.

    Parameters
    ----------
    sheet : Sheet
        The chart and its options.
    number : int
        The element, from 0.

    Returns
    -------
    Drawing
        The drawing.
    """
    chart, element, cells = sheet.chart, element_id(number), sheet.cells
    edges = [
        (edge, priority)
        for state in chart.states
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1)
    ]
    boxes = [
        cells.guard(sheet.guard_rows(edge, priority, number), edge.name in sheet.marked)
        for edge, priority in edges
    ]
    rows = [sheet.state_rows(state, number) for state in chart.states]
    plain = [cells.state(each) for each in rows]
    links = [
        Link(*map(chart.state_index, (edge.source, edge.target)), _roomy(box))
        for (edge, _), box in zip(edges, boxes, strict=True)
    ]
    laid = layered([(box.width, box.height) for box in plain], links, sheet.direction)
    names = [part_id(element, "state", state.name) for state in chart.states]
    dot = f"{element}-default"
    nodes = [Node(dot, "default", laid.dot)]
    for state, name, at, size, own in zip(
        chart.states, names, laid.states, laid.sizes, rows, strict=True
    ):
        marked = state.name in sheet.marked
        kind = "state marked" if marked else "state"
        nodes.append(Node(name, kind, at, cells.state(own, marked, size)))
    lines = [_default_line(dot, names[0], laid.dot, laid.states[0], laid.sizes[0], sheet.direction)]
    for (edge, _), box, link, at, (into, out) in zip(
        edges, boxes, links, laid.labels, laid.lines, strict=True
    ):
        guard = edge_id(chart, element, "guard", edge)
        name = edge_id(chart, element, "edge", edge)
        look = {}
        if sheet.tally is not None and not sheet.tally.times(number, edge):
            look = {"style": "dashed"}
        marked = edge.name in sheet.marked
        if marked:
            look |= {"class": "marked", "penwidth": MARKED}
        nodes.append(Node(guard, "guard marked" if marked else "guard", at, box))
        lines.append(Line(f"{name}-1", (names[link.source], guard), tuple(into), False, look))
        lines.append(Line(f"{name}-2", (guard, names[link.target]), tuple(out), True, look))
    return Drawing(laid.width, laid.height, tuple(nodes), tuple(lines))


def _roomy(box: Label) -> tuple[float, float]:
    """Return the size of a label with the gaps to its lines."""
    return box.width + 6.0, box.height + 2.0


def _default_line(
    dot: str, state: str, at: Point, centre: Point, size: tuple[float, float], direction: str
) -> Line:
    (x, y), (to_x, to_y) = at, centre
    if direction == "TB":
        start, end = (x, y + DOT_SIZE / 2), (x, to_y - size[1] / 2)
    else:
        start, end = (x + DOT_SIZE / 2, y), (to_x - size[0] / 2, y)
    name = f"{dot}-edge"
    return Line(name, (dot, state), (start, *_thirds(start, end)), True, {"class": "default"})


def _thirds(a: Point, b: Point) -> tuple[Point, ...]:
    return tuple((a[0] + (b[0] - a[0]) * t / 3, a[1] + (b[1] - a[1]) * t / 3) for t in (1, 2, 3))


# --------------------------------------------------------------------------- elements side by side
def arrange(
    graph: graphviz.Digraph,
    sheet: Sheet,
    numbers: Sequence[int],
    values: Sequence[Row],
    below: Sequence[Row],
    *,
    bare: bool,
) -> None:
    """Draw elements into a graph: alone, or as parallel regions in a grid.

    Parameters
    ----------
    graph : graphviz.Digraph
        Empty.
    sheet : Sheet
        A fitted sheet.
    numbers : sequence of int
        The elements, from 0.
    values, below : sequence of Row
        Written below the title of each region, and below the picture.
    bare : bool
        Draw the only element without its region.
    """
    from plots._matrix import matrix_drawing

    draw = matrix_drawing if sheet.form == "matrix" else graph_drawing
    alike = sheet.tally is None and not sheet.live
    shared = alike and len(numbers) > (1 if sheet.form == "matrix" else MOST_ALIKE)
    shown = [numbers[0]] if shared else list(numbers)
    regions = [_Region(draw(sheet, n), _title(sheet, numbers, n, shared, values)) for n in shown]
    if bare:
        regions = [_Region(regions[0].drawing, None)]
    width, height = (max(getattr(each, side) for each in regions) for side in ("width", "height"))
    columns = max(1, min(ceil(sqrt(len(shown))), int((PRINTED + APART) // (width + APART))))
    lines = ceil(len(shown) / columns)
    whole = columns * (width + APART) - APART
    bottom = lines * (height + APART) - APART
    notes = _notes(sheet, whole, bottom)
    bottom = max([bottom, *(y + label.height / 2 for _, (_, y), label in notes)])
    foot = sheet.cells.text(below) if below else None
    top = bottom + (foot.height + APART / 2 if foot else 0)
    sheet_of = _Paper(graph, top)
    whole = max([whole, foot.width if foot else 0, *(x + n.width / 2 for _, (x, _), n in notes)])
    graph.attr(bb=f"0,0,{whole:.1f},{top:.1f}")
    if foot:
        at = sheet_of.at((foot.width / 2, bottom + APART / 2 + foot.height / 2))
        graph.attr(label=foot.html, lp=at)
    for place, (number, region) in enumerate(zip(shown, regions, strict=True)):
        corner = (place % columns * (width + APART), place // columns * (height + APART))
        if bare:
            sheet_of.draw(graph, region.drawing, corner)
            continue
        name = element_id(number)
        with graph.subgraph(name=f"cluster_{place + 1}") as cluster:
            sheet_of.frame(cluster, corner, width, height, region.title)
            cluster.attr(
                id=name,
                **{"class": "region"},
                style="dashed,rounded",
                color=sheet.colours.line,
            )
            inside = corner[0] + MARGIN, corner[1] + region.above
            sheet_of.draw(cluster, region.drawing, inside)
    for name, at, label in notes:
        sheet_of.node(graph, Node(name, "legend", at, label), (0.0, 0.0))


@dataclass(frozen=True)
class _Region:
    """A drawing and the title above it."""

    drawing: Drawing
    title: Label | None

    @property
    def above(self) -> float:
        return 0.0 if self.title is None else self.title.height + 2 + MARGIN / 2

    @property
    def width(self) -> float:
        if self.title is None:
            return self.drawing.width
        return max(self.drawing.width, self.title.width) + 2 * MARGIN

    @property
    def height(self) -> float:
        if self.title is None:
            return self.drawing.height
        return self.drawing.height + self.above + MARGIN


def _title(
    sheet: Sheet, numbers: Sequence[int], number: int, shared: bool, values: Sequence[Row]
) -> Label:
    if not shared:
        row = [Piece(f"Element {number + 1}  ", "region"), Piece(f"AND {number + 1}", "note")]
        return sheet.cells.text([row, *values])
    whole = list(numbers) == list(range(numbers[0], numbers[-1] + 1))
    counted = [str(each + 1) for each in numbers]
    which = f"{counted[0]} to {counted[-1]}" if whole else ", ".join(counted)
    row = [Piece(f"Elements {which}  ", "region"), Piece(f"× {len(numbers)}", "note")]
    note = [Piece("each element has this chart, in parallel (AND)", "note")]
    return sheet.cells.text([row, note])


def _notes(sheet: Sheet, whole: float, bottom: float) -> list[tuple[str, Point, Label]]:
    """Return the legend of guards, in as many columns as the picture is wide."""
    rows = sheet.legend()
    if not rows:
        return []
    wide = sheet.cells.text(rows).width + 2 * APART
    columns = max(1, int((whole + 2 * APART) // wide))
    each = ceil(len(rows) / columns)
    starts = [0]
    while starts[-1] + each < len(rows):  # a guard stays in its column
        end = starts[-1] + each
        while end < len(rows) and not rows[end][0].text.strip():
            end += 1
        starts.append(end)
    found = []
    for column, (start, end) in enumerate(pairwise([*starts, len(rows)])):
        if start == end:
            continue
        label = sheet.cells.text(rows[start:end])
        at = (column * wide + label.width / 2, bottom + APART + label.height / 2)
        found.append((f"legend{column + 1}", at, label))
    return found


class _Paper:
    """Writes nodes and lines with y pointing up.

    Parameters
    ----------
    graph : graphviz.Digraph
        The whole picture.
    height : float
        Of the picture.
    """

    def __init__(self, graph: graphviz.Digraph, height: float) -> None:
        self.graph, self.height = graph, height

    def at(self, point: Point, corner: Point = (0.0, 0.0)) -> str:
        x, y = point[0] + corner[0], self.height - point[1] - corner[1]
        return f"{x:.2f},{y:.2f}"

    def frame(
        self, cluster: graphviz.Digraph, corner: Point, width: float, height: float, title: Label | None
    ) -> None:
        low = self.at((0, height), corner)
        cluster.attr(bb=f"{low},{self.at((width, 0), corner)}")
        if title is not None:
            middle = (MARGIN / 2 + title.width / 2, 3 + title.height / 2)
            cluster.attr(label=title.html, lp=self.at(middle, corner))

    def draw(self, graph: graphviz.Digraph, drawing: Drawing, corner: Point) -> None:
        for node in drawing.nodes:
            self.node(graph, node, corner)
        for line in drawing.lines:
            self.line(graph, line, corner)

    def node(self, graph: graphviz.Digraph, node: Node, corner: Point) -> None:
        look = {"id": node.name, "class": node.kind, "pos": self.at(node.at, corner)}
        if node.label is not None:
            graph.node(node.name, node.label.html, **look)
            return
        ink = graph.edge_attr.get("color") or self.graph.edge_attr["color"]
        size = f"{DOT_SIZE / 72:.3f}"
        look |= {"shape": "circle", "style": "filled", "fillcolor": ink, "color": ink}
        graph.node(node.name, "", width=size, height=size, fixedsize="true", **look)

    def line(self, graph: graphviz.Digraph, line: Line, corner: Point) -> None:
        points, tip = line.points, ""
        look = dict(line.look)
        if line.arrow:
            (x, y), (from_x, from_y) = points[-1], points[-4]
            part = ARROW / max(hypot(x - from_x, y - from_y), ARROW)
            end = x + (from_x - x) * part, y + (from_y - y) * part
            points = (*points[:-3], *_thirds(points[-4], end))
            tip = f"e,{self.at((x, y), corner)} "
        else:
            look["dir"] = "none"
        path = tip + " ".join(self.at(point, corner) for point in points)
        graph.edge(*line.ends, id=line.name, pos=path, **look)
