"""Elements of a chart in one picture: alone, as parallel regions in a grid, or one for all.

Drawings have y pointing down; Graphviz gets it pointing up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, hypot, sqrt
from typing import TYPE_CHECKING

import graphviz

from plots.charts.cells import Label
from plots.charts.drawing import DOT_SIZE, Drawing, DrawnLine, Node
from plots.charts.labels import Piece, Row, element_id
from plots.charts.layout.layers import ARROW, Point, straight

if TYPE_CHECKING:
    from plots.charts.statechart import ChartSheet


MARGIN = 10.0  # around what is in a region
APART = 10.0  # between regions
# Type of 10 points is at least 7 points high if this width is printed on 170 mm.
PRINTED = 688.0
SHOWN = 1200.0  # the same of a live chart, on a screen


def arrange(
    graph: graphviz.Digraph,
    sheet: ChartSheet,
    numbers: Sequence[int],
    values: Sequence[Row],
    below: Sequence[Row],
    *,
    bare: bool,
    folded: bool,
) -> None:
    """Draw elements into a graph; folded, elements that are all alike are drawn as one."""
    alike = folded or (sheet.form == "matrix" and sheet.tally is None)
    shared = alike and len(numbers) > 1
    shown = [numbers[0]] if shared else list(numbers)
    titles = [None if bare else _title(sheet, numbers, n, shared, values) for n in shown]
    regions = [_Region(sheet.drawing(n), title) for n, title in zip(shown, titles, strict=True)]
    grid = _Grid.of(regions, SHOWN if sheet.live else PRINTED)
    legend = _legend(sheet, grid.width, grid.height)
    foot = sheet.cells.text(below) if below else None
    bottom = max([grid.height, *(node.at[1] + label.height / 2 for node, label in legend)])
    paper = _Paper(graph, bottom + (foot.height + APART / 2 if foot else 0.0))
    widths = [grid.width, *(node.at[0] + label.width / 2 for node, label in legend)]
    if foot:
        widths.append(foot.width)
        at = foot.width / 2, bottom + APART / 2 + foot.height / 2
        graph.attr(label=foot.html, lp=paper.at(at))
    graph.attr(bb=f"0,0,{max(widths):.1f},{paper.height:.1f}")
    for place, (number, region) in enumerate(zip(shown, regions, strict=True)):
        corner = grid.corner(place)
        inside = corner[0] + (grid.cell[0] - region.drawing.width) / 2, corner[1] + region.above
        if region.title is None:
            paper.draw(graph, region.drawing, inside)
            continue
        with graph.subgraph(name=f"cluster_{place + 1}") as cluster:
            look = {"id": element_id(number), "class": "region", "style": "dashed,rounded"}
            cluster.attr(**look, color=sheet.colours.line)
            paper.frame(cluster, corner, grid.cell, region.title)
            paper.draw(cluster, region.drawing, inside)
    for node, _ in legend:
        paper.node(graph, node, (0.0, 0.0))


@dataclass(frozen=True)
class _Grid:
    """Cells of one size, row by row."""

    cell: tuple[float, float]
    columns: int
    lines: int

    @classmethod
    def of(cls, regions: Sequence[_Region], widest: float) -> _Grid:
        width, height = max(r.width for r in regions), max(r.height for r in regions)
        most = int((widest + APART) // (width + APART))
        columns = max(1, min(ceil(sqrt(len(regions))), most))
        return cls((width, height), columns, ceil(len(regions) / columns))

    @property
    def width(self) -> float:
        return self.columns * (self.cell[0] + APART) - APART

    @property
    def height(self) -> float:
        return self.lines * (self.cell[1] + APART) - APART

    def corner(self, place: int) -> Point:
        line, column = divmod(place, self.columns)
        return column * (self.cell[0] + APART), line * (self.cell[1] + APART)


@dataclass(frozen=True)
class _Region:
    """A drawing and the title above it."""

    drawing: Drawing
    title: Label | None

    @property
    def above(self) -> float:
        return 0.0 if self.title is None else self.title.height + MARGIN

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
    sheet: ChartSheet, numbers: Sequence[int], number: int, shared: bool, values: Sequence[Row]
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


def _legend(sheet: ChartSheet, whole: float, bottom: float) -> list[tuple[Node, Label]]:
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
        found.append((Node(f"legend{column + 1}", "legend", at, label), label))
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
        self, cluster: graphviz.Digraph, corner: Point, size: tuple[float, float], title: Label
    ) -> None:
        low, high = self.at((0.0, size[1]), corner), self.at((size[0], 0.0), corner)
        middle = (MARGIN + title.width / 2, MARGIN / 2 + title.height / 2)
        cluster.attr(bb=f"{low},{high}", label=title.html, lp=self.at(middle, corner))

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

    def line(self, graph: graphviz.Digraph, line: DrawnLine, corner: Point) -> None:
        points, tip = line.points, ""
        look = dict(line.look)
        if line.arrow:
            (x, y), (from_x, from_y) = points[-1], points[-4]
            part = ARROW / max(hypot(x - from_x, y - from_y), ARROW)
            end = x + (from_x - x) * part, y + (from_y - y) * part
            points = (*points[:-4], *straight(points[-4], end))
            tip = f"e,{self.at((x, y), corner)} "
        else:
            look["dir"] = "none"
        path = tip + " ".join(self.at(point, corner) for point in points)
        graph.edge(*line.ends, id=line.name, pos=path, **look)
