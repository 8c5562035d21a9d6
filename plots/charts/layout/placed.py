"""A layout in which the states have places: lines between them, labels where there is room.

Edges between the same two states are side by side: one of them, if their number is odd, is
straight, and the others bow around its label. Lengths are points; y points down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

from plots.charts.layout.layers import (
    ARROW,
    BESIDE,
    DEFAULT,
    DOT,
    LABELS_APART,
    PORT,
    STUB,
    Laid,
    LayerEdge,
    Point,
    Size,
    loop_line,
    straight,
)

LEAST = 7  # states of a ring; fewer are in layers
STEPS = 24  # points on a line, for finding room for labels
# Where on its line a label may be, the best first.
ALONG = (0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74)

Box = tuple[Point, Size]


@dataclass(frozen=True)
class _Line:
    """An edge between two states: its curve, and on which side of it the label is at best."""

    points: list[Point]
    side: int

    def along(self) -> list[Point]:
        """Return points on the curve."""
        return [self.at(i / STEPS)[0] for i in range(STEPS + 1)]

    def at(self, t: float) -> tuple[Point, Point]:
        """Return a point of the curve, and the unit vector across."""
        a, b, c, d = self.points[:4]
        u = 1 - t
        point, ahead = (
            tuple(
                sum(w * each[k] for w, each in zip(weights, (a, b, c, d), strict=True))
                for k in (0, 1)
            )
            for weights in (
                (u**3, 3 * u * u * t, 3 * u * t * t, t**3),
                (-u * u, u * u - 2 * u * t, 2 * u * t - t * t, t * t),
            )
        )
        long = hypot(*ahead) or 1.0
        return (point[0], point[1]), (-ahead[1] / long, ahead[0] / long)


def placed(
    sizes: Sequence[Size], links: Sequence[LayerEdge], centres: Sequence[Point], direction: str
) -> Laid:
    """Lay out a chart whose states have places.

    Examples
    --------
    >>> laid = placed([(80, 40)] * 2, [LayerEdge(0, 1, (60, 20))], [(0, 0), (0, 100)], "TB")
    >>> laid.labels[0], laid.lines[0][0], laid.lines[0][-1]
    ((74.0, 102.8), (40.0, 74.0), (40.0, 134.0))
    """
    middle = [sum(each[k] for each in centres) / len(centres) for k in (0, 1)]
    laid = Laid(sizes=list(sizes), states=list(centres))
    laid.dot = _dot(list(zip(centres, sizes, strict=True)), direction)
    pairs: dict[tuple[int, int], list[int]] = {}
    for k, link in enumerate(links):
        pairs.setdefault((link.source, link.target), []).append(k)
    lines: dict[int, _Line] = {}
    loops: dict[int, tuple[Point, list[Point]]] = {}
    for a, b in sorted({(min(pair), max(pair)) for pair in pairs}):
        if a == b:
            loops |= _loops(pairs[a, a], links, centres[a], sizes[a], middle[0])
        else:
            own = [*pairs.get((a, b), []), *pairs.get((b, a), [])]
            lines |= _bundle(own, links, (a, b), centres, sizes, (middle[0], middle[1]))
    boxes = [*zip(centres, sizes, strict=True), (laid.dot, (2 * DOT, 2 * DOT))]
    boxes += [(at, links[k].size) for k, (at, _) in loops.items()]
    labels = _labels(lines, links, boxes)
    laid.labels = [labels[k] if k in labels else loops[k][0] for k in range(len(links))]
    laid.lines = [lines[k].points if k in lines else loops[k][1] for k in range(len(links))]
    drawn = [point for line in lines.values() for point in line.along()]
    drawn += [point for _, line in loops.values() for point in line]
    return _moved(laid, links, drawn)


def _dot(boxes: Sequence[Box], direction: str) -> Point:
    """Return the place of the dot: above the first state or left of it, where no other is."""
    (x, y), (width, height) = boxes[0]
    above, left = (
        any(
            abs(at[k] - (x, y)[k]) < (size[k] + boxes[0][1][k]) / 2 and at[1 - k] < (x, y)[1 - k]
            for at, size in boxes[1:]
        )
        for k in (0, 1)
    )
    if not above and (direction == "TB" or left):
        return x, y - height / 2 - DEFAULT
    return x - width / 2 - DEFAULT, y


def _bundle(
    own: Sequence[int],
    links: Sequence[LayerEdge],
    ends: tuple[int, int],
    centres: Sequence[Point],
    sizes: Sequence[Size],
    middle: Point,
) -> dict[int, _Line]:
    """Return the lines of the edges between two states."""
    (ax, ay), (bx, by) = (centres[end] for end in ends)
    long = hypot(bx - ax, by - ay)
    along = ((bx - ax) / long, (by - ay) / long) if long else (1.0, 0.0)
    # Across the lines, away from the middle of the chart; else to the right, or up.
    across = -along[1], along[0]
    out = ((ax + bx) / 2 - middle[0]) * across[0] + ((ay + by) / 2 - middle[1]) * across[1]
    outward = 1 if (out if abs(out) > 1.0 else across[0] - across[1]) > 0 else -1
    across = across[0] * outward, across[1] * outward
    odd = len(own) % 2
    used = {1: 0.0 if odd else PORT / 2, -1: PORT / 2 + LABELS_APART / 2 * odd}
    found = {}
    for place, k in enumerate(own):
        side = 1 if place % 2 == 0 else -1
        shift = side * used[side]
        port = max(-PORT, min(PORT, shift))
        width, height = links[k].size
        used[side] += BESIDE + abs(across[0]) * width + abs(across[1]) * height + LABELS_APART
        bow = (shift - port) * 4 / 3
        aims = [along, (-along[0], -along[1])]
        for _ in (0, 1):  # a bow leaves the box in another direction than a straight line
            start, end = (
                _border(centres[i], sizes[i], aim, across, port)
                for i, aim in zip(ends, aims, strict=True)
            )
            third = max(hypot(end[0] - start[0], end[1] - start[1]) / 3, 1.0)
            aims = [_at((0.0, 0.0), along, sign * third, across, bow) for sign in (1, -1)]
        line = [start, _sum(start, aims[0]), _sum(end, aims[1]), end]
        back = links[k].source != ends[0]
        # In the direction of the line the other side is on its left.
        found[k] = _Line(
            _headed(line[::-1] if back else line), side * outward * (-1 if back else 1)
        )
    return found


def _headed(line: Sequence[Point]) -> list[Point]:
    """Return a curve that ends straight, for the head of the arrow."""
    start, one, two, end = line
    x, y = end[0] - two[0], end[1] - two[1]
    part = min((STUB + ARROW) / (hypot(x, y) or 1.0), 0.9)
    neck = end[0] - part * x, end[1] - part * y
    return [start, one, two, *straight(neck, end)]


def _at(point: Point, along: Point, far: float, across: Point, aside: float) -> Point:
    x = point[0] + along[0] * far + across[0] * aside
    return x, point[1] + along[1] * far + across[1] * aside


def _sum(one: Point, other: Point) -> Point:
    return one[0] + other[0], one[1] + other[1]


def _border(centre: Point, size: Size, aim: Point, across: Point, port: float) -> Point:
    """Return where a line that starts beside the centre of a box leaves the box."""
    x, y = centre[0] + across[0] * port, centre[1] + across[1] * port
    ways = [
        ((half if step > 0 else -half) - (at - middle)) / step
        for step, at, middle, half in (
            (aim[0], x, centre[0], size[0] / 2),
            (aim[1], y, centre[1], size[1] / 2),
        )
        if step
    ]
    far = max(min(ways), 0.0)
    return x + aim[0] * far, y + aim[1] * far


def _loops(
    own: Sequence[int], links: Sequence[LayerEdge], centre: Point, size: Size, middle: float
) -> dict[int, tuple[Point, list[Point]]]:
    """Return label and line of the loops at a state, on the side away from the middle."""
    side = -1 if centre[0] < middle - 1.0 else 1
    levels = [max(links[k].size[1] + 6, 2 * PORT) for k in own]
    y, found = centre[1] - sum(levels) / 2, {}
    for k, level in zip(own, levels, strict=True):
        at = centre[0] + side * size[0] / 2, y + level / 2
        found[k] = loop_line(at, side, links[k].size[0])
        y += level
    return found


def _labels(
    lines: dict[int, _Line], links: Sequence[LayerEdge], boxes: Sequence[Box]
) -> dict[int, Point]:
    """Return the centres of labels beside their lines, where they cover least of all else."""
    taken = list(boxes)
    on = {k: line.along() for k, line in lines.items()}
    found: dict[int, Point] = {}
    for k, line in lines.items():
        width, height = links[k].size
        others = [point for other, points in on.items() if other != k for point in points]
        best = None
        for side in (line.side, -line.side):
            for t in ALONG:
                (x, y), across = line.at(t)
                far = side * (BESIDE + (abs(across[0]) * width + abs(across[1]) * height) / 2)
                box = (x + far * across[0], y + far * across[1]), (width, height)
                covered = sum(_shared(box, each) for each in taken)
                covered += 40.0 * sum(_shared(box, (point, (4.0, 4.0))) > 0 for point in others)
                if best is None or covered < best[0]:
                    best = covered, box
        assert best is not None
        found[k] = best[1][0]
        taken.append(best[1])
    return found


def _shared(one: Box, other: Box) -> float:
    """Return the area that two boxes share."""
    sides = [(one[1][k] + other[1][k]) / 2 - abs(one[0][k] - other[0][k]) for k in (0, 1)]
    return max(sides[0], 0.0) * max(sides[1], 0.0)


def _moved(laid: Laid, links: Sequence[LayerEdge], drawn: Sequence[Point]) -> Laid:
    """Move a layout so that its left upper corner is the origin, and measure it."""
    boxes = [
        *zip(laid.states, laid.sizes, strict=True),
        *zip(laid.labels, (link.size for link in links), strict=True),
        (laid.dot, (2 * DOT, 2 * DOT)),
        *((point, (0.0, 0.0)) for point in drawn),
    ]
    left, top = (min(at[k] - size[k] / 2 for at, size in boxes) for k in (0, 1))
    right, bottom = (max(at[k] + size[k] / 2 for at, size in boxes) for k in (0, 1))

    def moved(points: Sequence[Point]) -> list[Point]:
        return [(round(x - left, 1), round(y - top, 1)) for x, y in points]

    (dot,) = moved([laid.dot])
    return Laid(
        width=right - left,
        height=bottom - top,
        states=moved(laid.states),
        sizes=laid.sizes,
        labels=moved(laid.labels),
        lines=[moved(line) for line in laid.lines],
        dot=dot,
    )


def ring(sizes: Sequence[Size], links: Sequence[LayerEdge]) -> list[Point] | None:
    """Return places around a rectangle for states that follow each other in a ring or a chain.

    None for other charts, for those with loops, and for a few states.

    Examples
    --------
    >>> links = [LayerEdge(i, (i + 1) % 8, (50.0, 20.0)) for i in range(8)]
    >>> [round(x) for x, _ in ring([(80.0, 40.0)] * 8, links)]
    [0, 150, 150, 150, 150, 0, 0, 0]
    """
    near: list[set[int]] = [set() for _ in sizes]
    for link in links:
        near[link.source].add(link.target)
        near[link.target].add(link.source)
    if len(sizes) < LEAST or any(i in own or not 0 < len(own) <= 2 for i, own in enumerate(near)):
        return None
    order = [next((i for i, own in enumerate(near) if len(own) == 1), 0)]
    while following := [i for i in sorted(near[order[-1]]) if i not in order]:
        order.append(following[0])
    if len(order) < len(sizes):
        return None
    width, height = (max(size[k] for size in sizes) for k in (0, 1))
    wide, high = (max(link.size[k] for link in links) for k in (0, 1))
    two = len(links) > len(sizes)  # labels on both sides of the lines
    least, around = 2 + two, -(-(len(sizes) + 4) // 2)
    step = width + wide + 2 * (STUB + ARROW), height + high + 4 * (STUB + ARROW)
    if two:
        step = step[0], max(step[1], 2 * (high + BESIDE + STUB + ARROW) + PORT)
    columns = min(
        range(least, around - least + 1),
        key=lambda count: max(count * step[0], (around - count) * step[1]),
    )
    rows = around - columns
    right = [(k, 0) for k in range(columns)]
    below = [(columns - 1, k) for k in range(1, rows)]
    left = [(k, rows - 1) for k in range(columns - 2, -1, -1)]
    up = [(0, k) for k in range(rows - 2, 0, -1)]
    cells = dict(zip(order, [*right, *below, *left, *up], strict=False))
    return [(cells[i][0] * step[0], cells[i][1] * step[1]) for i in range(len(sizes))]
