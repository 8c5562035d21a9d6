"""Layout of a chart in layers: states in rows, and the labels of edges in rows between them.

Every edge is one line, and its label is right of it. Lines are vertical within a row, each at a
place of its own, and curve only in the channels between two rows, where there are no boxes. So no
line crosses a box, no label touches another or an arrowhead, and no two edges end at the same point
of a state. The labels of the edges that leave a state are ordered by priority, from left to right,
unless lines would cross for it that need not.

A layout from left to right is the same with x and y exchanged, but labels are above their lines.
Lengths are points; y points down.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf

from plots.charts.layout.places import Segment, places

Point = tuple[float, float]
Size = tuple[float, float]

ARROW = 7.0  # length of an arrowhead
STUB = 3.0  # straight part of a line at a state, between an arrowhead and the curve
PORT = 13.0  # least distance of two ends at a state
WIDEST_PORT = 90.0
WIDER = 16.0  # how much a state may grow at its sides, to make lines straight
CORNER = 14.0  # of a state, where no line ends
STATES_APART, LABELS_APART, LINES_APART = 26.0, 9.0, 9.0
LINE = 2.0  # room of a line in a row
LEVELS_APART = 8.0  # height of a channel for every further line beside another one
BESIDE = 4.0  # between a line and its label
LONELY = 640.0  # width of a row of states without edges
DEFAULT, DOT = 30.0, 4.0  # from the dot to the default state; radius of the dot
LOOP_OUT, LOOP = 26.0, 8.0  # from a state to the line of its loop; half of the loop's height
SWEEPS = 12


@dataclass(frozen=True)
class LayerEdge:
    """An edge of the layout.

    Parameters
    ----------
    source, target : int
        Numbers of the states.
    size : (float, float)
        Width and height of its label.
    """

    source: int
    target: int
    size: Size


@dataclass
class Laid:
    """A finished layout, its left upper corner at the origin.

    Parameters
    ----------
    width, height : float
        Of all.
    states, labels : list of (float, float)
        Centres.
    sizes : list of (float, float)
        Of the states; at least the given ones.
    lines : list of list
        For every edge the line to the tip of the arrow: a point, then three more for each Bezier
        curve.
    dot : (float, float)
        Centre of the dot at the default state.
    """

    width: float = 0.0
    height: float = 0.0
    states: list[Point] = field(default_factory=list)
    sizes: list[Size] = field(default_factory=list)
    labels: list[Point] = field(default_factory=list)
    lines: list[list[Point]] = field(default_factory=list)
    dot: Point = (0.0, 0.0)


def layered(sizes: Sequence[Size], links: Sequence[LayerEdge], direction: str = "TB") -> Laid:
    """Lay out a chart.

    Examples
    --------
    >>> laid = layered([(80, 40), (80, 40)], [LayerEdge(0, 1, (60, 20)), LayerEdge(1, 0, (60, 20))])
    >>> [x for x, _ in laid.states], [x for x, _ in laid.labels]
    ([51.0, 51.0], [48.0, 122.0])
    """
    if direction == "TB":
        return _Layers(sizes, links, 1).laid()
    turned = [LayerEdge(each.source, each.target, _turned(each.size)) for each in links]
    laid = _Layers([_turned(size) for size in sizes], turned, -1).laid()
    return Laid(
        width=laid.height,
        height=laid.width,
        states=[_turned(each) for each in laid.states],
        sizes=[_turned(each) for each in laid.sizes],
        labels=[_turned(each) for each in laid.labels],
        lines=[[_turned(point) for point in line] for line in laid.lines],
        dot=_turned(laid.dot),
    )


def _turned(point: Point) -> Point:
    return point[1], point[0]


@dataclass(frozen=True)
class _Loop:
    """A self-loop: at which side of its state, and how far below the centre."""

    link: int
    side: int
    below: float


class _Layers:
    """The steps of a layout from top to bottom; even rows have states, odd rows labels.

    The side of labels is 1 if they are right of their lines, -1 if left.
    """

    def __init__(self, sizes: Sequence[Size], links: Sequence[LayerEdge], side: int) -> None:
        self.links, self.side = links, side
        self.crossing = [k for k, each in enumerate(links) if each.source != each.target]
        self.layer = _layer_of(sizes, [links[k] for k in self.crossing])
        self.sizes = list(sizes)
        self.loops: list[list[_Loop]] = []
        self.block: list[float] = []  # height of the loops of a state
        self.beside: list[list[float]] = []  # room for loops at the left and right of each state
        for state in range(len(sizes)):
            self._add_loops(state)
        # Items of the rows: the states, then labels and places where lines pass.
        self.row = [2 * layer for layer in self.layer]
        self.wide = [(0.0, 0.0)] * len(sizes)
        self.label: dict[int, int] = {}
        self.chain: dict[int, list[int]] = {}
        self._add_chains()
        self.segments = [
            (upper, lower) for chain in self.chain.values() for upper, lower in pairwise(chain)
        ]
        self.above: list[list[int]] = [[] for _ in self.row]
        self.below: list[list[int]] = [[] for _ in self.row]
        for upper, lower in self.segments:
            self.below[upper].append(lower)
            self.above[lower].append(upper)
        for state, (width, height) in enumerate(self.sizes):
            ends = max(len(self.above[state]), len(self.below[state]))
            width = max(width, ends * PORT + 2 * CORNER)
            self.sizes[state] = width, height
            left, right = self.beside[state]
            self.wide[state] = width / 2 + left, width / 2 + right

    # ----------------------------------------------------------------- rows
    def _add_loops(self, state: int) -> None:
        """Place the labels of loops: right of the state, or left if checked before other edges."""
        own = [k for k, each in enumerate(self.links) if each.source == state]
        others = [k for k in own if k in self.crossing]
        loops, room, tallest = [], [0.0, 0.0], 0.0
        width, height = self.sizes[state]
        for side in (-1, 1):
            here = [
                k for k in own if k not in others and (side < 0) == (k < min(others, default=-1))
            ]
            levels = [max(self.links[k].size[1] + 6, 2 * PORT) for k in here]
            at = -sum(levels) / 2
            for k, level in zip(here, levels, strict=True):
                loops.append(_Loop(k, side, at + level / 2))
                at += level
            # The lines of all loops end at the state; their labels may be higher than it.
            furthest = max((abs(each.below) for each in loops if each.side == side), default=0.0)
            height = max(height, 2 * (furthest + CORNER + LOOP) * bool(here))
            tallest = max(tallest, sum(levels))
            if here:
                room[side > 0] = LOOP_OUT + BESIDE + max(self.links[k].size[0] for k in here)
        self.sizes[state] = width, height
        self.block.append(tallest)
        self.loops.append(loops)
        self.beside.append(room)

    def _add_chains(self) -> None:
        for k in self.crossing:
            ends = self.links[k].source, self.links[k].target
            upper, lower = sorted(ends, key=lambda state: self.layer[state])
            # In the row next to the source, so that the ends at the source are ordered as well.
            gap = 2 * self.layer[ends[0]] + (1 if ends[0] == upper else -1)
            chain = [upper]
            for row in range(2 * self.layer[upper] + 1, 2 * self.layer[lower]):
                chain.append(len(self.row))
                self.row.append(row)
                label = BESIDE + self.links[k].size[0] if row == gap else LINE / 2
                right = self.side > 0
                self.wide.append((LINE / 2, label) if right else (label, LINE / 2))
                if row == gap:
                    self.label[k] = chain[-1]
            self.chain[k] = [*chain, lower]

    def _ordered_rows(self) -> list[list[int]]:
        """Order the items of every row so that few lines cross.

        The labels of a state are in the order of priority, unless only another lets no lines cross.
        """
        self.ranked = True
        rows = self._swept()
        if self._crossings(rows):
            self.ranked = False
            others = self._swept()
            if not self._crossings(others):
                return others
            self.ranked = True
        return rows

    def _swept(self) -> list[list[int]]:
        """Order the items of every row by those above and below, again and again."""
        rows: list[list[int]] = [[] for _ in range(max(self.row) + 1)]
        for item, number in enumerate(self.row):
            rows[number].append(item)
        best, fewest = rows, None
        x = [0.0] * len(self.row)
        for row in rows:
            self._pack(row, x)
        for sweep in range(SWEEPS):
            down = sweep % 2 == 0
            near = self.above if down else self.below
            order = list(enumerate(rows))
            for r, row in order if down else reversed(order):
                keys = {i: sum(x[j] for j in near[i]) / len(near[i]) for i in row if near[i]}
                if r % 2 or sweep:  # states keep the chart's order at first
                    row.sort(key=lambda i: keys.get(i, x[i]))
                if r % 2 and self.ranked:
                    self._by_priority(row)
                self._pack(row, x)
            rank = self._agreed_order(x)
            agreed = [
                sorted(row, key=rank.__getitem__) if r % 2 else list(row)
                for r, row in enumerate(rows)
            ]
            crossings = self._crossings(agreed)
            if fewest is None or crossings < fewest:
                best, fewest = agreed, crossings
        return best

    def _by_priority(self, row: list[int]) -> None:
        """Sort the labels of each state's edges into the places that they take in a row."""
        own: dict[int, list[int]] = {}
        for k, item in sorted(self.label.items()):
            if item in row:
                own.setdefault(self.links[k].source, []).append(item)
        for items in own.values():
            places = sorted(row.index(item) for item in items)
            for place, item in zip(places, items, strict=True):
                row[place] = item

    def _own_labels(self) -> list[list[int]]:
        """Return the labels of each state by priority; none if they have another order."""
        found: dict[int, list[int]] = {}
        for k in self.crossing:
            found.setdefault(self.links[k].source, []).append(self.label[k])
        return [*found.values()] if self.ranked else []

    def _agreed_order(self, x: Sequence[float]) -> dict[int, int]:
        """Return one order of all labels and lines, with the labels of each state by priority."""
        chains = self._own_labels()
        labels = {each for chain in chains for each in chain}
        lines = [[i] for i in range(len(self.sizes), len(self.row)) if i not in labels]
        heads = [(x[chain[0]], chain[0], chain[1:]) for chain in [*chains, *lines]]
        heapq.heapify(heads)
        rank: dict[int, int] = {}
        while heads:
            _, item, rest = heapq.heappop(heads)
            rank[item] = len(rank)
            if rest:
                heapq.heappush(heads, (x[rest[0]], rest[0], rest[1:]))
        return rank

    def _pack(self, row: Sequence[int], x: list[float]) -> None:
        at = 0.0
        for before, item in zip([None, *row], row, strict=False):
            at += 0.0 if before is None else self._apart(before, item)
            x[item] = at
        middle = (x[row[0]] + x[row[-1]]) / 2 if row else 0.0
        for item in row:
            x[item] -= middle

    def _apart(self, left: int, right: int) -> float:
        """Return the least distance of the centres of two neighbours."""
        if left < len(self.sizes) and right < len(self.sizes):
            gap = STATES_APART
        elif max(self.wide[left][1], self.wide[right][0]) > LINE:
            gap = LABELS_APART
        else:
            gap = LINES_APART
        return self.wide[left][1] + self.wide[right][0] + gap

    def _crossings(self, rows: Sequence[Sequence[int]]) -> int:
        place = {item: i for row in rows for i, item in enumerate(row)}
        between: dict[int, list[tuple[int, int]]] = {}
        for upper, lower in self.segments:
            between.setdefault(self.row[upper], []).append((place[upper], place[lower]))
        return sum(
            (a - c) * (b - d) < 0
            for pairs in between.values()
            for i, (a, b) in enumerate(pairs)
            for c, d in pairs[:i]
        )

    # ----------------------------------------------------------------- places
    def laid(self) -> Laid:
        """Return the layout."""
        rows = self._ordered_rows()
        place = {item: i for row in rows for i, item in enumerate(row)}
        offset: dict[Segment, float] = {}  # of the ends at a state from its centre
        for state, (width, _) in enumerate(self.sizes):
            for others, lower in ((self.above[state], False), (self.below[state], True)):
                step = min((width - 2 * CORNER) / max(len(others) - 1, 1), WIDEST_PORT)
                for i, other in enumerate(sorted(others, key=place.__getitem__)):
                    segment = (state, other) if lower else (other, state)
                    offset[segment] = (i - (len(others) - 1) / 2) * step
        apart = [(a, b, self._apart(a, b)) for row in rows for a, b in pairwise(row)]
        apart += [(a, b, 1.0) for own in self._own_labels() for a, b in pairwise(own)]
        sides = [
            (state, others)
            for state in range(len(self.sizes))
            for others in (self.above[state], self.below[state])
            if len(others) > 1
        ]
        self.x = places(self.wide, apart, self.segments, offset, sides, len(self.sizes))
        self.offset = self._straightened({row[0] for row in rows if len(row) == 1})
        self._set_rows(rows)
        return self._drawn()

    def _straightened(self, alone: set[int]) -> dict[Segment, float]:
        """Return ends at the states that make lines straight where there is room for that.

        A state that is alone in its row becomes a little wider for it.
        """
        offset: dict[Segment, float] = {}
        for state, (width, height) in enumerate(self.sizes):
            both = self.above[state], self.below[state]
            wanted = [abs(self.x[other] - self.x[state]) + CORNER for own in both for other in own]
            near = max((each for each in wanted if each <= width / 2 + WIDER), default=0.0)
            if state in alone and near > width / 2:
                left, right = self.beside[state]
                self.sizes[state] = 2 * near, height
                self.wide[state] = near + left, near + right
            room = self.sizes[state][0] / 2 - CORNER
            for others, lower in ((both[0], False), (both[1], True)):
                others = sorted(others, key=self.x.__getitem__)
                ends = _ends([self.x[other] - self.x[state] for other in others], room)
                for other, end in zip(others, ends, strict=True):
                    offset[(state, other) if lower else (other, state)] = end
        return offset

    def _set_rows(self, rows: Sequence[Sequence[int]]) -> None:
        """Set the upper and lower end of every row; channels are higher where lines are flatter."""
        heights = {self.label[k]: self.links[k].size[1] for k in self.crossing}
        heights |= {state: height for state, (_, height) in enumerate(self.sizes)}
        self.tall = heights
        room = heights | {i: max(heights[i], block) for i, block in enumerate(self.block)}
        self.span: list[tuple[float, float]] = []
        self.bend: dict[Segment, float] = {}
        at = DEFAULT + DOT
        for r, row in enumerate(rows):
            tall = max((room.get(item, 0.0) for item in row), default=0.0)
            if r == 0:  # above a default state that is lower than its row, the dot is in the row
                at -= min((tall - heights[0]) / 2, DEFAULT)
            self.span.append((at, at + tall))
            own = [each for each in self.segments if self.row[each[0]] == r]
            across = [abs(end - start) for start, end in map(self._ends_of, own)]
            curve = 22.0 + min(max(0.12 * max(across, default=0.0), 4.0), 44.0)
            curve += LEVELS_APART * self._set_bends(own)
            at += tall + (curve + STUB + ARROW if across else 24.0 * (r % 2 == 0))

    def _ends_of(self, segment: Segment) -> Point:
        """Return where a line begins and ends across a channel."""
        offset = self.offset.get(segment, 0.0)
        upper, lower = (self.x[item] for item in segment)
        return (upper + offset, lower) if segment[0] < len(self.sizes) else (upper, lower + offset)

    def _set_bends(self, own: Sequence[Segment]) -> int:
        """Set how far down in their channel lines turn; return the most beside another one.

        Of lines that lean to the same side, the one farther to that side turns first. At one height
        they would nearly touch.
        """
        most = 0
        for side in (-1, 1):
            group: list[Segment] = []
            reach = -inf
            ends = ((*self._ends_of(each), each) for each in own)
            spans = sorted((-side * end, side * start, each) for start, end, each in ends)
            for turned, start, each in spans:
                if -turned - start < LINES_APART:
                    continue
                if -turned < reach:  # beside none of the others
                    group, reach = [], inf
                group.append(each)
                reach = min(reach, start) if len(group) > 1 else start
                for i, line in enumerate(group, start=1):
                    self.bend[line] = i / (len(group) + 1)
                most = max(most, len(group) - 1)
        return most

    def _drawn(self) -> Laid:
        left = min(self.x[i] - self.wide[i][0] for i in range(len(self.x)))
        right = max(self.x[i] + self.wide[i][1] for i in range(len(self.x)))
        self.x = [x - left for x in self.x]
        laid = Laid(width=right - left, height=self.span[-1][1], sizes=self.sizes)
        middle = [sum(self.span[row]) / 2 for row in self.row]
        laid.states = [(self.x[i], middle[i]) for i in range(len(self.sizes))]
        laid.dot = self.x[0], middle[0] - self.sizes[0][1] / 2 - DEFAULT
        loops = {loop.link: loop for own in self.loops for loop in own}
        for k in range(len(self.links)):
            if k in loops:
                centre, line = self._loop(laid.states[self.links[k].source], loops[k])
            else:
                item = self.label[k]
                beside = self.side * (BESIDE + self.links[k].size[0] / 2)
                centre = self.x[item] + beside, middle[item]
                line = self._line(k)
            laid.labels.append(centre)
            laid.lines.append(line)
        return laid

    def _line(self, k: int) -> list[Point]:
        """Return the line of an edge: straight in the rows and, for a stub, at the states."""
        chain = self.chain[k]
        down = self.links[k].source == chain[0]
        stubs = (STUB, STUB + ARROW) if down else (STUB + ARROW, STUB)
        spans = []
        for i, item in enumerate(chain):
            x, (top, bottom) = self.x[item], self.span[self.row[item]]
            middle, half = (top + bottom) / 2, self.tall.get(item, 0.0) / 2
            if i == 0:
                spans.append((x + self.offset[item, chain[1]], middle + half, bottom + stubs[0]))
            elif i == len(chain) - 1:
                spans.append((x + self.offset[chain[-2], item], top - stubs[1], middle - half))
            else:
                spans.append((x, top, bottom))
        points = [(spans[0][0], spans[0][1])]
        for i, (x, top, bottom) in enumerate(spans):
            if i:
                x_before, y_before = points[-1]
                bend = y_before + self.bend.get((chain[i - 1], chain[i]), 0.5) * (top - y_before)
                points += [(x_before, bend), (x, bend), (x, top)]
            points += straight((x, top), (x, bottom))[1:]
        return points if down else points[::-1]

    def _loop(self, state: Point, loop: _Loop) -> tuple[Point, list[Point]]:
        """Return the centre of a loop's label, and its line."""
        edge = state[0] + loop.side * self.sizes[self.links[loop.link].source][0] / 2
        return loop_line((edge, state[1] + loop.below), loop.side, self.links[loop.link].size[0])


def _ends(wanted: Sequence[float], room: float) -> list[float]:
    """Return places of lines at a state, from its centre: as wanted, or else evenly spread.

    Examples
    --------
    >>> _ends([-90.0, -70.0, 10.0, 30.0], 60.0)
    [-60.0, -25.0, 10.0, 30.0]
    """
    before = sum(each < -room for each in wanted)
    after = sum(each > room for each in wanted)
    ends = list(wanted[before : len(wanted) - after])
    low, high = -room + before * PORT, room - after * PORT
    for i, end in enumerate(ends):
        ends[i] = max(end, ends[i - 1] + PORT if i else low)
    for i in reversed(range(len(ends))):
        ends[i] = min(ends[i], ends[i + 1] - PORT if i + 1 < len(ends) else high)
    if not ends:
        step = 2 * room / max(before + after - 1, 1)
        return [-room + i * step for i in range(before + after)]
    left = [-room + i * (ends[0] + room) / before for i in range(before)]
    right = [room - i * (room - ends[-1]) / after for i in range(after)]
    return [*left, *ends, *reversed(right)]


def loop_line(at: Point, side: int, width: float) -> tuple[Point, list[Point]]:
    """Return the centre of a label, and the line of its loop at a place on the side of a state."""
    (edge, y), corner = at, at[0] + side * LOOP_OUT
    leaves, enters = y - LOOP, y + LOOP
    stub = edge + side * (ARROW + STUB)
    out = [(edge, leaves), (corner, leaves), (corner, leaves), (corner, y)]
    back = [(corner, enters), (corner, enters), (stub, enters)]
    label = corner + side * (BESIDE + width / 2), y
    return label, out + back + straight((stub, enters), (edge, enters))[1:]


def straight(a: Point, b: Point) -> list[Point]:
    """Return a straight line as a Bezier curve.

    Examples
    --------
    >>> straight((0.0, 0.0), (3.0, 6.0))
    [(0.0, 0.0), (1.0, 2.0), (2.0, 4.0), (3.0, 6.0)]
    """
    return [(a[0] + (b[0] - a[0]) * t / 3, a[1] + (b[1] - a[1]) * t / 3) for t in range(4)]


def _layer_of(sizes: Sequence[Size], links: Sequence[LayerEdge]) -> list[int]:
    """Return the layers of the states: states of an edge are in two layers, in their order."""
    n = len(sizes)
    pairs = {(min(each.source, each.target), max(each.source, each.target)) for each in links}
    before: list[list[int]] = [[a for a, b in sorted(pairs) if b == i] for i in range(n)]
    after: list[list[int]] = [[b for a, b in sorted(pairs) if a == i] for i in range(n)]
    layer = [0] * n
    for i in range(n):
        layer[i] = max((layer[j] + 1 for j in before[i]), default=0)
    for i in reversed(range(1, n)):
        if after[i] and not before[i]:
            layer[i] = min(layer[j] for j in after[i]) - 1
    # States without edges fill rows of their own below the others.
    lonely = [i for i in range(1, n) if not before[i] and not after[i]]
    linked = n > len(lonely) + 1
    row, room = max(layer) + linked, LONELY - (0 if linked else sizes[0][0])
    for i in lonely:
        if sizes[i][0] > room and room < LONELY:
            row, room = row + 1, LONELY
        layer[i] = row
        room -= sizes[i][0] + STATES_APART
    return layer
