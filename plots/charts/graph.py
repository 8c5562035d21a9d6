"""One element as a graph: boxes, in boxes where states have states inside.

What is in a box is laid out as a chart of its own. An edge is drawn where the two states are that
it leads between, or the boxes around them; from there a line goes on to a state inside. An edge of
a composite state is drawn once, from its box.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import hypot
from typing import TYPE_CHECKING

from gms_fsm.charts.chart import Transition
from plots.charts.contents import edges_by_priority, written_edges
from plots.charts.drawing import Drawing, DrawnLine, Node, default_line, edge_look
from plots.charts.labels import Row, edge_id, element_id, part_id
from plots.charts.layout.layers import CORNER, LayerEdge, Point, Size, layered, straight
from plots.charts.layout.placed import placed, ring

if TYPE_CHECKING:
    from plots.charts.statechart import ChartSheet

PAD = 16.0  # between the border of a composite state and what is inside
LANES = (8.0, 4.5, 11.5)  # from the border to lines along it
ROUND = 8.0  # radius of a corner of a line
SAMPLES = 12  # points on a part of a line, for finding what hides it

Box = tuple[Point, Size]  # centre and size


@dataclass
class _Drawn:
    """What is inside a composite state, its left upper corner at the origin."""

    width: float = 0.0
    height: float = 0.0
    nodes: list[Node] = field(default_factory=list)
    lines: list[DrawnLine] = field(default_factory=list)
    boxes: dict[str, Box] = field(default_factory=dict)  # of all states inside, by path
    inward: dict[str, int] = field(default_factory=dict)  # lines into each composite state

    def add(self, other: _Drawn, corner: Point) -> None:
        """Add another drawing at a place."""
        for node in other.nodes:
            self.nodes.append(replace(node, at=_moved(node.at, corner)))
        for line in other.lines:
            points = tuple(_moved(point, corner) for point in line.points)
            self.lines.append(replace(line, points=points))
        for path, (at, size) in other.boxes.items():
            self.boxes[path] = _moved(at, corner), size


@dataclass(frozen=True)
class _Outline:
    """The states that are drawn, by path, and the edges between them."""

    chains: Mapping[str, tuple[str, ...]]  # the states around each, the outermost first, and itself
    inside: Mapping[str, Sequence[str]]  # what is in each composite state, and in the chart
    rows: Callable[[str], list[Row]]  # the text in a box
    edges: Sequence[tuple[int, Transition]]
    places: Mapping[str, Point] | None = None  # chosen by hand


def graph_drawing(sheet: ChartSheet, number: int, *, nested: bool) -> Drawing:
    """Return an element as states in states, or as its innermost states alone."""
    drawn = _inside(sheet, number, "", (_nested if nested else _flat)(sheet, number))
    return Drawing(drawn.width, drawn.height, tuple(drawn.nodes), tuple(drawn.lines))


def _nested(sheet: ChartSheet, number: int) -> _Outline:
    del number
    nesting = sheet.chart.nesting
    inside = {path: each.inside() for path, each in nesting.levels.items() if each.state.states}
    return _Outline(
        {path: each.chain for path, each in nesting.levels.items()},
        {"": [state.name for state in nesting.states], **inside},
        lambda path: sheet.level_rows(nesting.levels[path]),
        [*written_edges(sheet.chart)],
    )


def _flat(sheet: ChartSheet, number: int) -> _Outline:
    states = {state.name: state for state in sheet.chart.states}
    return _Outline(
        {name: (name,) for name in states},
        {"": [*states]},
        lambda name: sheet.state_rows(states[name], number),
        [*edges_by_priority(sheet.chart)],
        sheet.chart.layout or None,
    )


def _inside(sheet: ChartSheet, number: int, path: str, outline: _Outline) -> _Drawn:
    """Draw what is inside a composite state, or the whole chart."""
    element, cells, chains = element_id(number), sheet.cells, outline.chains
    depth, names = len(chains[path]) if path else 0, outline.inside[path]
    inner = {
        name: _inside(sheet, number, name, outline) for name in names if name in outline.inside
    }
    rows = {name: outline.rows(name) for name in names}
    heads = [cells.state(rows[name], name in sheet.marked) for name in names]
    sizes = [
        (
            max(float(head.width), inner[name].width + 2 * PAD),
            head.height + inner[name].height + 2 * PAD,
        )
        if name in inner
        else (float(head.width), float(head.height))
        for name, head in zip(names, heads, strict=True)
    ]
    edges = [each for each in outline.edges if _scope(chains, each[1]) == path]
    labels = [
        cells.guard(sheet.guard_rows(edge, priority, number), edge.name in sheet.marked)
        for priority, edge in edges
    ]
    links = [
        LayerEdge(
            names.index(chains[edge.source][depth]),
            names.index(chains[edge.target][depth]),
            (label.width, label.height),
        )
        for (_, edge), label in zip(edges, labels, strict=True)
    ]
    centres = [outline.places[name] for name in names] if outline.places else ring(sizes, links)
    laid = (
        layered(sizes, links, sheet.direction)
        if centres is None
        else placed(sizes, links, centres, sheet.direction)
    )
    ids = {name: part_id(element, "state", name) for name in chains}
    start = f"{part_id(element, 'state', path)}-default" if path else f"{element}-default"
    drawn = _Drawn(laid.width, laid.height, [Node(start, "default", laid.dot)])
    for name, head, at, size in zip(names, heads, laid.states, laid.sizes, strict=True):
        marked = name in sheet.marked
        kind = "state composite" if name in inner else "state"
        label = cells.state(rows[name], marked, size, inside=name in inner)
        drawn.boxes[name] = at, size
        drawn.nodes.append(Node(ids[name], f"{kind} marked" if marked else kind, at, label))
        if name in inner:
            left = at[0] - inner[name].width / 2
            drawn.add(inner[name], (left, at[1] - size[1] / 2 + head.height + PAD / 2))
    ends = start, ids[names[0]]
    drawn.lines.append(default_line(*ends, laid.dot, laid.states[0], laid.sizes[0]))
    for (_, edge), label, at, line in zip(edges, labels, laid.labels, laid.lines, strict=True):
        guard, name = (edge_id(element, kind, edge) for kind in ("guard", "edge"))
        marked = edge.name in sheet.marked
        drawn.nodes.append(Node(guard, "guard marked" if marked else "guard", at, label))
        points = list(line)
        for end, place in ((edge.target, -1), (edge.source, 0)):
            if end not in names:
                own = chains[end][depth]
                blocks = _blocks(drawn, [ids[each] for each in chains[end]])
                below = float(heads[names.index(own)].height)
                lane = LANES[drawn.inward.get(own, 0) % len(LANES)]
                drawn.inward[own] = drawn.inward.get(own, 0) + 1
                outer = _Outer(*drawn.boxes[own], below, lane)
                more = _onward(points[place], drawn.boxes[end], outer, blocks)
                points = points + more[1:] if place else more[:0:-1] + points
        look = edge_look(sheet, number, edge)
        drawn.lines.append(
            DrawnLine(name, (ids[edge.source], ids[edge.target]), tuple(points), True, look)
        )
    return drawn


@dataclass(frozen=True)
class _Outer:
    """A composite state into which a line leads: its box, the height of its texts, a lane."""

    at: Point
    size: Size
    head: float
    lane: float  # from the border


def _blocks(drawn: _Drawn, around: list[str]) -> list[Box]:
    """Return the boxes and labels that a line to a state inside should not pass."""
    return [
        (node.at, (node.label.width, node.label.height))
        for node in drawn.nodes
        if node.label is not None and node.name not in around
    ]


def _scope(chains: Mapping[str, tuple[str, ...]], edge: Transition) -> str:
    """Return the innermost state around both ends of an edge, or an empty text."""
    around = chains[edge.target][:-1]
    return next((each for each in reversed(chains[edge.source][:-1]) if each in around), "")


def _onward(point: Point, box: Box, outer: _Outer, blocks: list[Box]) -> list[Point]:
    """Return a line from the border of a composite state to a state inside.

    It is straight, or along the border, whichever hides least behind what else is inside.
    """
    if not abs(abs(point[1] - outer.at[1]) - outer.size[1] / 2) < 1.0:  # from the left or the right
        turned = replace(outer, at=outer.at[::-1], size=outer.size[::-1], head=0.0)
        found = _ways(point[::-1], _turned(box), turned, [*map(_turned, blocks)], (1.0,))
        return [(x, y) for y, x in found]
    above = point[1] < outer.at[1]
    return _ways(point, box, outer if above else replace(outer, head=0.0), blocks, (1.0, -1.0))


def _ways(
    point: Point, box: Box, outer: _Outer, blocks: list[Box], sides: tuple[float, ...]
) -> list[Point]:
    """Return the best line from the upper or lower border: straight, or along one of the sides."""
    (x, y), ((middle, centre), (width, height)) = point, box
    down = 1.0 if y < centre else -1.0
    aim = min(max(x, middle - width / 2 + CORNER), middle + width / 2 - CORNER)
    end = aim, centre - down * height / 2
    half = (end[1] - y) / 2
    direct = [point, (x, y + half), (aim, end[1] - half), end]
    found = [straight(point, end) if aim == x else direct]
    level = y + down * (outer.head + outer.lane)
    for side in sides:
        gutter = outer.at[0] + side * (outer.size[0] / 2 - outer.lane)
        corners = [point, (x, level), (gutter, level), (gutter, centre)]
        found.append(_rounded([*corners, (middle + side * width / 2, centre)]))
    return min(found, key=lambda line: _hidden(line, blocks))


def _rounded(corners: Sequence[Point]) -> list[Point]:
    """Return a line along corners, which it rounds."""
    found = [corners[0]]
    for before, corner, after in zip(corners, corners[1:], corners[2:], strict=False):
        start, end = (_toward(corner, each) for each in (before, after))
        found += [*straight(found[-1], start)[1:], corner, corner, end]
    return [*found, *straight(found[-1], corners[-1])[1:]]


def _toward(corner: Point, other: Point) -> Point:
    x, y = other[0] - corner[0], other[1] - corner[1]
    part = min(ROUND / (hypot(x, y) or 1.0), 0.5)
    return corner[0] + part * x, corner[1] + part * y


def _hidden(line: Sequence[Point], blocks: list[Box]) -> int:
    """Return how many points of a line are behind something."""
    count = 0
    for k in range(0, len(line) - 1, 3):
        a, d = line[k], line[k + 3]
        for step in range(SAMPLES):
            part = step / SAMPLES
            x, y = (begin + (end - begin) * part for begin, end in zip(a, d, strict=True))
            count += any(
                abs(x - at[0]) < size[0] / 2 and abs(y - at[1]) < size[1] / 2 for at, size in blocks
            )
    return count


def _turned(box: Box) -> Box:
    (x, y), (width, height) = box
    return (y, x), (height, width)


def _moved(point: Point, corner: Point) -> Point:
    return round(point[0] + corner[0], 1), round(point[1] + corner[1], 1)
