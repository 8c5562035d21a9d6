"""Where blocks and wires of a system's diagram are: columns of blocks, wires at right angles.

Columns stand next to each other with a channel to the right of each. A wire leaves a block on its
right side and enters the next column on the left. Between blocks of one column it enters on the
right side too; to an earlier column it goes back below all blocks, over a column it goes above
them. Each upright piece has a track of its own, and no two wires share a height in one channel, so
that none covers another one.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

Point = tuple[float, float]

GAP = 34.0  # between blocks of a column
PORT = 20.0  # between wires at one side of a block: room for a text above each
CORNER = 16.0  # from the end of a side to a wire: corners may be round
TRACK = 13.0  # between upright pieces
LEAD = 16.0  # from the last track to the next column: room for an arrowhead
NARROWEST = 46.0  # of a channel: room for two arrowheads and a line between them
LANE = 18.0  # between wires above or below all blocks
ROOM = 6.2  # width of a character of a wire's text
STEP, NEAR = 5.0, 4.0  # by what a wire moves out of another one's way, and what is too close


@dataclass
class Box:
    """A block.

    Parameters
    ----------
    id : str
        Its name in the picture.
    width, height : float
        Points.
    column : int
        Counted from the left.
    x, y : float
        Of its middle.
    """

    id: str
    width: float
    height: float
    column: int
    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True)
class Join:
    """A wire.

    Parameters
    ----------
    id : str
        Its name in the picture.
    source, target : str
        Blocks.
    text : str
        What stands at its beginning.
    """

    id: str
    source: str
    target: str
    text: str = ""


@dataclass
class DiagramSheet:
    """A diagram as places.

    Parameters
    ----------
    boxes : dict of str to Box
        Blocks.
    paths : dict of str to list of (float, float)
        Of each wire: its ends and its corners.
    """

    boxes: dict[str, Box]
    paths: dict[str, list[Point]] = field(default_factory=dict)

    @property
    def left(self) -> float:
        """Left side of everything."""
        corners = (x for path in self.paths.values() for x, _ in path)
        return min([*(each.x - 0.5 * each.width for each in self.boxes.values()), *corners])

    @property
    def top(self) -> float:
        """Upper side of everything."""
        corners = (y for path in self.paths.values() for _, y in path)
        return max([*(each.y + 0.5 * each.height for each in self.boxes.values()), *corners])


@dataclass
class _Wire:
    """A wire while it is routed: heights of its ends, and which sides they are on."""

    join: Join
    start: int  # channels of its first and its last upright piece
    end: int
    way: str  # next, same, over, back
    out: float = 0.0
    into: float = 0.0
    tracks: tuple[float, float] = (0.0, 0.0)
    lane: float = 0.0


def routed(boxes: Sequence[Box], joins: Sequence[Join]) -> DiagramSheet:
    """Return places for blocks and wires.

    Examples
    --------
    >>> sheet = routed([Box("a", 50, 30, 0), Box("b", 50, 30, 1)], [Join("w", "a", "b", "u")])
    >>> [len(path) for path in sheet.paths.values()]
    [2]
    """
    sheet = DiagramSheet({each.id: each for each in boxes})
    wires = [_wire(sheet.boxes, join) for join in joins]
    ports = _ports(wires)
    for (name, _), found in ports.items():
        box = sheet.boxes[name]
        box.height = max(box.height, PORT * (len(found) - 1) + 2 * CORNER)
    _stack(boxes, joins)
    _heights(sheet.boxes, ports)
    _align(boxes, wires)
    _across(boxes, wires)
    for wire in wires:
        sheet.paths[wire.join.id] = _path(sheet.boxes, wire)
    return sheet


def _wire(boxes: Mapping[str, Box], join: Join) -> _Wire:
    start, end = boxes[join.source].column, boxes[join.target].column
    if end == start:
        return _Wire(join, start, start, "same")
    if end == start + 1:
        return _Wire(join, start, start, "next")
    return _Wire(join, start, end - 1, "over" if end > start else "back")


Ports = dict[tuple[str, str], list[_Wire]]


def _ports(wires: Iterable[_Wire]) -> Ports:
    """Return the wires at each side of each block."""
    ports: Ports = defaultdict(list)
    for wire in wires:
        ports[wire.join.source, "right"].append(wire)
        ports[wire.join.target, "right" if wire.way == "same" else "left"].append(wire)
    return ports


def _stack(boxes: Sequence[Box], joins: Iterable[Join]) -> None:
    """Set the heights of the blocks: each near those that it is joined to."""
    near: dict[str, list[str]] = defaultdict(list)
    for join in joins:
        near[join.source].append(join.target)
        near[join.target].append(join.source)
    columns: dict[int, list[Box]] = defaultdict(list)
    for box in boxes:
        columns[box.column].append(box)
    tallest = max(columns, key=lambda each: sum(box.height + GAP for box in columns[each]))
    placed: dict[str, Box] = {}
    for column in sorted(columns, key=lambda each: (each != tallest, abs(each - tallest))):
        wanted = {}
        for k, box in enumerate(columns[column]):
            others = [placed[name].y for name in near[box.id] if name in placed]
            wanted[box.id] = sum(others) / len(others) if others else -float(k)
        order = columns[column]
        if column != tallest:
            order = sorted(order, key=lambda box: -wanted[box.id])
        top = float("inf")
        for box in order:
            box.y = (
                min(wanted[box.id], top - 0.5 * box.height)
                if column != tallest
                else (0.0 if top == float("inf") else top - 0.5 * box.height)
            )
            top = box.y - 0.5 * box.height - GAP
        # What was pushed down goes back by half of it.
        push = sum(wanted[box.id] - box.y for box in order) / len(order)
        for box in order:
            box.y = round(box.y + (push if column != tallest else 0.0))
            placed[box.id] = box


def _heights(boxes: Mapping[str, Box], ports: Ports) -> None:
    """Set the heights of the wires' ends: right sides first, so that the next column meets them."""
    taken: dict[int, list[tuple[float, _Wire]]] = defaultdict(list)
    for name, side in sorted(ports, key=lambda each: (each[1] == "left", boxes[each[0]].column)):
        box, found = boxes[name], ports[name, side]
        channel = box.column if side == "right" else box.column - 1
        aims = {id(wire): _aim(boxes, wire, name, side) for wire in found}
        order = sorted(found, key=lambda wire: aims[id(wire)], reverse=True)
        low, high = box.y - 0.5 * box.height + CORNER, box.y + 0.5 * box.height - CORNER
        last = high + PORT
        for k, wire in enumerate(order):
            under = len(order) - 1 - k
            even = 0.5 * (low + high) + PORT * (under - 0.5 * (len(order) - 1))
            best = aims[id(wire)] if side == "left" and wire.way == "next" else even
            last = max(low + PORT * under, min(best, last - PORT))
            y = _free(last, taken[channel], wire, low - 3.0, high + 3.0)
            taken[channel].append((y, wire))
            if wire.join.source == name:
                wire.out = y
            else:
                wire.into = y


def _aim(boxes: Mapping[str, Box], wire: _Wire, name: str, side: str) -> float:
    """Return where the other end of a wire is."""
    if wire.way in ("over", "back"):
        return 1e6 if wire.way == "over" else -1e6
    if side == "left":
        return wire.out
    return boxes[wire.join.target if wire.join.source == name else wire.join.source].y


def _free(
    height: float, taken: Sequence[tuple[float, _Wire]], wire: _Wire, low: float, high: float
) -> float:
    """Return the next height at which no other wire is in the channel."""
    for k in range(9):
        y = min(max(height + STEP * ((k + 1) // 2) * (1 if k % 2 else -1), low), high)
        if all(abs(at - y) > NEAR or (other is wire and at == y) for at, other in taken):
            return y
    return height


def _align(boxes: Sequence[Box], wires: Sequence[_Wire]) -> None:
    """Move blocks with a single wire so that it is straight, where there is room."""
    for box in boxes:
        own = [wire for wire in wires if box.id in (wire.join.source, wire.join.target)]
        if len(own) != 1 or own[0].way != "next":
            continue
        (wire,) = own
        goal = wire.into if wire.join.source == box.id else wire.out
        y = box.y + goal - (wire.out if wire.join.source == box.id else wire.into)
        beside = [each for each in boxes if each.column == box.column and each is not box]
        if any(abs(each.y - y) < 0.5 * (each.height + box.height) + 14.0 for each in beside):
            continue
        others = [each for each in wires if each is not wire]
        heights = [each.out for each in others if each.start == wire.start]
        heights += [each.into for each in others if each.end == wire.start]
        if all(abs(each - goal) > NEAR for each in heights):
            box.y, wire.out, wire.into = y, goal, goal


def _across(boxes: Sequence[Box], wires: Sequence[_Wire]) -> None:
    """Set the columns' places, the tracks and the lanes."""
    last = max(box.column for box in boxes)
    bottom = min(box.y - 0.5 * box.height for box in boxes)
    top = max(box.y + 0.5 * box.height for box in boxes)
    for way, edge, sign in (("back", bottom, -1), ("over", top, 1)):
        lanes = [wire for wire in wires if wire.way == way]
        lanes.sort(key=lambda wire: abs(wire.start - wire.end))
        for k, wire in enumerate(lanes, start=1):
            wire.lane = edge + sign * LANE * k
    x = 0.0
    tracks: dict[tuple[int, int], float] = {}
    for channel in range(-1, last + 1):
        column = [box for box in boxes if box.column == channel]
        if column:
            wide = max(box.width for box in column)
            for box in column:
                box.x = x + 0.5 * wide
                box.width = wide
            x += wide
        own = [wire for wire in wires if channel in (wire.start, wire.end) and not _straight(wire)]
        texts = [wire.join.text for wire in wires if wire.start == channel and wire.join.text]
        room = ROOM * max(map(len, texts), default=0) + 8.0 if own or texts else 0.0
        for k, wire in enumerate(sorted(own, key=lambda each: _order(each, channel))):
            tracks[id(wire), channel] = x + room + TRACK * (k + 0.5)
        entered = any(wire.end == channel for wire in wires)
        wide = room + TRACK * len(own) + (LEAD if entered or own else 0.0)
        x += max(wide, NARROWEST) if entered else wide
    for wire in wires:
        first = tracks.get((id(wire), wire.start), 0.0)
        wire.tracks = (first, tracks.get((id(wire), wire.end), first))


def _straight(wire: _Wire) -> bool:
    return wire.way == "next" and wire.out == wire.into


def _order(wire: _Wire, channel: int) -> tuple[int, float]:
    """Return what sorts the tracks of a channel from the left, so that few wires cross."""
    if wire.way == "same":
        return 0, abs(wire.out - wire.into)
    if wire.way == "next":
        return 1, wire.out if wire.into < wire.out else -wire.out
    leaving = wire.start == channel
    return (0 if leaving else 2), 1e3 + (-wire.out if leaving else wire.into)


def _path(boxes: Mapping[str, Box], wire: _Wire) -> list[Point]:
    source, target = boxes[wire.join.source], boxes[wire.join.target]
    start = (source.x + 0.5 * source.width, wire.out)
    side = 0.5 if wire.way == "same" else -0.5
    end = (target.x + side * target.width, wire.into)
    if _straight(wire):
        return [start, end]
    first, last = wire.tracks
    if wire.way in ("same", "next"):
        return [start, (first, wire.out), (first, wire.into), end]
    return [
        start,
        (first, wire.out),
        (first, wire.lane),
        (last, wire.lane),
        (last, wire.into),
        end,
    ]
