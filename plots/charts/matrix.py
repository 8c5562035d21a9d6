"""A chart as a matrix: a row for each source, a column for each target, guards by number."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import TYPE_CHECKING

from plots.charts.cells import Label
from plots.charts.contents import edges_by_priority
from plots.charts.drawing import Drawing, DrawnLine, Node
from plots.charts.labels import DOT, Piece, edge_id, element_id, part_id
from plots.charts.layout.layers import Point

if TYPE_CHECKING:
    from plots.charts.statechart import ChartSheet


WIDEST = 2 * 595.0 - 60.0  # points: two pages of A4, less the frame of a region
PAD = 5.0  # between a label and the lines of the table
NARROWEST = 26.0  # column
HEAD = 8  # characters of a name above a column


def matrix_drawing(sheet: ChartSheet, number: int) -> Drawing:
    """Return an element as a matrix."""
    chart, element, cells = sheet.chart, element_id(number), sheet.cells
    boxes, entries = _boxes(sheet, number), _entries(sheet, number)
    heads, wide = _heads(sheet, boxes, entries)
    tall = [max(head.height for head in heads) + 2 * PAD]
    for k, box in enumerate(boxes):
        stacks = [_height(own) for (row, _), own in entries.items() if row == k]
        tall.append(max([box.height, *stacks]) + 2 * PAD)
    xs, ys = ([0.0, *accumulate(sizes)] for sizes in (wide, tall))
    words = "from ↓   to →", f"{DOT} default state"
    corner = cells.text([[Piece(text, "note")] for text in words])
    nodes = [Node(f"{element}-corner", "head", (PAD + corner.width / 2, tall[0] / 2), corner)]
    for k, (state, head, box) in enumerate(zip(chart.states, heads, boxes, strict=True), start=1):
        at = xs[k] + wide[k] / 2, tall[0] / 2
        nodes.append(Node(f"{element}-target-{k}", "head", at, head))
        kind = "state marked" if state.name in sheet.marked else "state"
        at = PAD + box.width / 2, ys[k] + tall[k] / 2
        nodes.append(Node(part_id(element, "state", state.name), kind, at, box))
    for (row, column), own in entries.items():
        y = ys[row + 1] + (tall[row + 1] - _height(own)) / 2
        for name, kind, label in own:
            at = xs[column + 1] + wide[column + 1] / 2, y + label.height / 2
            nodes.append(Node(name, kind, at, label))
            y += label.height
    return Drawing(xs[-1], ys[-1], tuple(nodes), _rules(xs, ys, nodes[0].name, sheet.colours.pale))


Entries = dict[tuple[int, int], list[tuple[str, str, Label]]]


def _boxes(sheet: ChartSheet, number: int) -> list[Label]:
    """Return the boxes of the states, numbered; the default state has a dot."""
    boxes = []
    for k, state in enumerate(sheet.chart.states, start=1):
        (first, *rest), *rows = sheet.state_rows(state, number)
        start = f" {DOT}" if state == sheet.chart.default_state else ""
        title = [Piece(f"{k}  {first.text}{start}", "title"), *rest]
        boxes.append(sheet.cells.state([title, *rows], state.name in sheet.marked))
    return boxes


def _entries(sheet: ChartSheet, number: int) -> Entries:
    """Return id, classes and label of the edges in each cell."""
    chart, entries = sheet.chart, Entries()
    for priority, edge in edges_by_priority(chart):
        place = chart.state_index(edge.source), chart.state_index(edge.target)
        marked = edge.name in sheet.marked
        label = sheet.cells.guard(sheet.guard_rows(edge, priority, number), marked)
        name = edge_id(element_id(number), "guard", edge)
        entries.setdefault(place, []).append((name, "guard marked" if marked else "guard", label))
    return entries


def _heads(
    sheet: ChartSheet, boxes: Sequence[Label], entries: Entries
) -> tuple[list[Label], list[float]]:
    """Return what stands above the columns, and the widths of all columns.

    Without the names of the states if the matrix would be too wide with them.
    """
    names = [_parts(state.name) for state in sheet.chart.states]
    numbers: list[list[str]] = [[] for _ in names]
    for texts in (names, numbers):
        heads = [
            sheet.cells.text([[Piece(str(k), "title")], *([Piece(part, "note")] for part in parts)])
            for k, parts in enumerate(texts, start=1)
        ]
        wide = [max(box.width for box in boxes) + 2 * PAD]
        for k, head in enumerate(heads):
            own = [label.width for (_, b), each in entries.items() if b == k for *_, label in each]
            wide.append(max([head.width, NARROWEST, *own]) + 2 * PAD)
        if sum(wide) <= WIDEST:
            break
    return heads, wide


def _height(own: Sequence[tuple[str, str, Label]]) -> float:
    return sum(label.height for *_, label in own)


def _rules(
    xs: Sequence[float], ys: Sequence[float], node: str, colour: str
) -> tuple[DrawnLine, ...]:
    """Return the lines between rows and columns."""
    ends: list[tuple[Point, Point]] = [((x, 0.0), (x, ys[-1])) for x in xs]
    ends += [((0.0, y), (xs[-1], y)) for y in ys]
    look = {"class": "rule", "color": colour, "penwidth": "0.8"}
    return tuple(
        DrawnLine(f"{node}-rule{k}", (node, node), (a, a, b, b), False, look)
        for k, (a, b) in enumerate(ends)
    )


def _parts(name: str) -> list[str]:
    """Return a name in short lines, broken after underscores, or nothing if it has none."""
    parts = name.replace("_", "_ ").split()
    return parts if max(map(len, parts)) <= HEAD else []
