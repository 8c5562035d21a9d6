"""A chart as a matrix: a row for each source, a column for each target, guards by number."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plots._drawing import WIDEST, Drawing, Line, Node
from plots._labels import DOT, Piece, edge_id, element_id, part_id
from plots._layers import Point

if TYPE_CHECKING:
    from plots.statechart import Sheet

__all__ = ["matrix_drawing"]

PAD = 5.0  # between a label and the lines of the table
HEAD = 8  # characters of a name above a column


def matrix_drawing(sheet: Sheet, number: int) -> Drawing:
    """Return an element as a matrix.

    Parameters
    ----------
    sheet : Sheet
        The chart and its options, with numbers for all guards.
    number : int
        The element, from 0.

    Returns
    -------
    Drawing
        The drawing.
    """
    chart, element, cells = sheet.chart, element_id(number), sheet.cells
    states = [state.name for state in chart.states]
    boxes = []
    for k, state in enumerate(chart.states):
        (first, *rest), *rows = sheet.state_rows(state, number)
        start = f" {DOT}" if state == chart.default_state else ""
        title = [Piece(f"{k + 1}  {first.text}{start}", "title"), *rest]
        boxes.append(cells.state([title, *rows], state.name in sheet.marked))
    entries: dict[tuple[int, int], list[tuple[str, str, list[list[Piece]]]]] = {}
    for state in chart.states:
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            place = states.index(edge.source), states.index(edge.target)
            name = edge_id(chart, element, "guard", edge)
            marked = " marked" * (edge.name in sheet.marked)
            rows = sheet.guard_rows(edge, priority, number)
            entries.setdefault(place, []).append((name, f"guard{marked}", rows))
    labels = {
        place: [(name, kind, cells.guard(rows, "marked" in kind)) for name, kind, rows in own]
        for place, own in entries.items()
    }
    names = [_parts(name) for name in states]
    wide: list[float] = []
    for above in (names, [[] for _ in names]):  # without names, if they are too wide
        heads = [
            cells.text([[Piece(str(k + 1), "title")], *([Piece(part, "note")] for part in parts)])
            for k, parts in enumerate(above)
        ]
        wide = [max(box.width for box in boxes) + 2 * PAD]
        for k, head in enumerate(heads):
            own = [label.width for (_, b), found in labels.items() if b == k for *_, label in found]
            wide.append(max([head.width, 26, *own]) + 2 * PAD)
        if sum(wide) <= WIDEST:
            break
    tall = [max(head.height for head in heads) + 2 * PAD]
    for k, box in enumerate(boxes):
        stacks = [
            sum(label.height for *_, label in found) for (a, _), found in labels.items() if a == k
        ]
        tall.append(max([box.height, *stacks]) + 2 * PAD)
    xs, ys = _sums(wide), _sums(tall)
    words = "from ↓   to →", f"{DOT} default state"
    corner = cells.text([[Piece(text, "note")] for text in words])
    nodes = [Node(f"{element}-corner", "head", (PAD + corner.width / 2, tall[0] / 2), corner)]
    for k, (head, box, name) in enumerate(zip(heads, boxes, states, strict=True)):
        nodes.append(
            Node(f"{element}-target-{k + 1}", "head", (xs[k + 1] + wide[k + 1] / 2, tall[0] / 2), head)
        )
        kind = "state marked" if name in sheet.marked else "state"
        at = PAD + box.width / 2, ys[k + 1] + tall[k + 1] / 2
        nodes.append(Node(part_id(element, "state", name), kind, at, box))
    for (a, b), found in labels.items():
        y = ys[a + 1] + (tall[a + 1] - sum(label.height for *_, label in found)) / 2
        for name, kind, label in found:
            middle = xs[b + 1] + wide[b + 1] / 2, y + label.height / 2
            nodes.append(Node(name, kind, middle, label))
            y += label.height
    return Drawing(xs[-1], ys[-1], tuple(nodes), _rules(xs, ys, nodes[0].name, sheet.colours.pale))


def _rules(xs: list[float], ys: list[float], node: str, colour: str) -> tuple[Line, ...]:
    """Return the lines between rows and columns."""
    ends: list[tuple[Point, Point]] = [((x, 0.0), (x, ys[-1])) for x in xs]
    ends += [((0.0, y), (xs[-1], y)) for y in ys]
    look = {"class": "rule", "color": colour, "penwidth": "0.8"}
    return tuple(
        Line(f"{node}-rule{k}", (node, node), (a, a, b, b), False, look)
        for k, (a, b) in enumerate(ends)
    )


def _sums(sizes: list[float]) -> list[float]:
    sums = [0.0]
    for size in sizes:
        sums.append(sums[-1] + size)
    return sums


def _parts(name: str) -> list[str]:
    """Return a name in short lines, broken after underscores, or nothing if it has none."""
    parts = name.replace("_", "_ ").split()
    return parts if max(map(len, parts)) <= HEAD else []
