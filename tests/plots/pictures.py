"""What is in a drawn graph, read from its SVG: groups by their ids, texts, boxes and lines."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import combinations
from typing import Any
from xml.etree import ElementTree

import pytest

from gms_fsm.charts.chart import Chart
from plots.charts.statechart import statechart
from plots.output.graphviz import drawn
from plots.style.fonts import width

SVG = "{http://www.w3.org/2000/svg}"

Point = tuple[float, float]


def root_of(graph: Any) -> ElementTree.Element:
    """Return the SVG of a graph, drawn with the Graphviz that is there."""
    picture = drawn(graph, "svg")
    if picture is None:
        pytest.skip("no Graphviz: neither the program dot nor pygraphviz")
    return ElementTree.fromstring(picture)


def size_of(root: ElementTree.Element) -> Point:
    wide, high = (float(root.get(side, "").removesuffix("pt")) for side in ("width", "height"))
    return wide, high


def points_of(numbers: str) -> list[Point]:
    values = [float(n) for n in re.findall(r"-?\d+(?:\.\d+)?", numbers)]
    return list(zip(values[::2], values[1::2], strict=True))


def squeezed(*texts: str) -> str:
    return "".join(texts).replace(" ", "")


@dataclass(frozen=True)
class Box:
    """The axis-aligned bounding box of some points."""

    left: float
    top: float
    right: float
    bottom: float

    @classmethod
    def around(cls, points: list[Point]) -> Box:
        xs, ys = zip(*points, strict=True)
        return cls(min(xs), min(ys), max(xs), max(ys))

    def distance(self, point: Point) -> float:
        x, y = point
        return max(self.left - x, x - self.right, self.top - y, y - self.bottom, 0.0)

    def meets(self, other: Box, room: float = 0.0) -> bool:
        """Return whether two boxes overlap; with room, also whether they are that near."""
        across = self.left < other.right + room and other.left < self.right + room
        return across and self.top < other.bottom + room and other.top < self.bottom + room

    def holds(self, other: Box) -> bool:
        across = self.left <= other.left and other.right <= self.right
        return across and self.top <= other.top and other.bottom <= self.bottom


class Group:
    """One group of the SVG: a state, a guard, an edge, a region."""

    def __init__(self, group: ElementTree.Element) -> None:
        self.element, self.id = group, group.get("id", "")
        self.classes = set(group.get("class", "").split())
        self.texts = [
            (text.text or "").replace("\xa0", " ").strip() for text in group.iter(SVG + "text")
        ]
        self.line = [p for path in group.iter(SVG + "path") for p in points_of(path.get("d", ""))]
        self.polygons = [points_of(p.get("points", "")) for p in group.iter(SVG + "polygon")]

    @property
    def ends(self) -> list[Point]:
        return [self.line[0], self.line[-1]]

    @property
    def box(self) -> Box:
        return Box.around(self.line + [p for polygon in self.polygons for p in polygon])

    def touches(self, other: Group, points: list[Point]) -> bool:
        return min(other.box.distance(p) for p in points) < 2.0  # points; a line is 1.1 wide


class Picture:
    """Groups, boxes and lines of a drawn graph."""

    def __init__(self, graph: Any) -> None:
        self.root = root_of(graph)
        self.width, self.height = size_of(self.root)
        found = [Group(group) for group in self.root.iter(SVG + "g")]
        self.groups = {group.id: group for group in found}
        assert len(self.groups) == len(found), "ids are unique"
        self.texts: list[tuple[str, Box]] = []  # with the ids of their groups
        self.heads: list[tuple[str, Box]] = []
        self.states: list[tuple[str, Box]] = []
        self.lines: list[tuple[str, list[Point]]] = []
        self.sizes: set[float] = set()
        for group in found:
            paths = group.element.findall(SVG + "path")
            lines = [points_of(path.get("d", "")) for path in paths]
            own = [(group.id, self._box(text)) for text in group.element.findall(SVG + "text")]
            self.texts += own
            if "edge" in group.classes:
                self.heads += [(group.id, Box.around(points)) for points in group.polygons]
                self.lines += [(group.id, _along(points)) for points in lines]
            elif "state" in group.classes:
                self.states.append((group.id, Box.around(lines[0])))

    def __getitem__(self, name: str) -> Group:
        return self.groups[name]

    def of_class(self, name: str) -> set[str]:
        return {group.id for group in self.groups.values() if name in group.classes}

    def legend(self) -> str:
        """Return the numbered guards below the picture, one after the other."""
        return squeezed(*(text for name in self.of_class("legend") for text in self[name].texts))

    def _box(self, text: ElementTree.Element) -> Box:
        x, y, size = (float(text.get(key, "")) for key in ("x", "y", "font-size"))
        mono = "Mono" in text.get("font-family", "")
        words = (text.text or "").replace("\xa0", " ")
        self.sizes.add(size)
        bold = 1.0 if mono or text.get("font-weight") == "bold" else 0.9  # an upper bound
        x += width(words[: len(words) - len(words.lstrip())], size, mono=mono)
        wide = width(words.strip(), size, mono=mono) * bold
        return Box(x, y - 0.75 * size, x + wide, y + 0.2 * size)


def chart_picture(chart: Chart, elements: Any = 1, **options: Any) -> Picture:
    return Picture(statechart(chart, elements, **options))


def overlaps(picture: Picture) -> list[tuple[str, str]]:
    """Return the ids of texts, arrowheads, lines and states that overlap."""
    texts, heads, states = picture.texts, picture.heads, picture.states
    found = [(a, b) for (a, one), (b, two) in combinations(texts, 2) if a != b and one.meets(two)]
    found += [(a, b) for a, text in texts for b, head in heads if text.meets(head)]
    for boxes in (heads, states):
        found += [(a, b) for (a, one), (b, two) in combinations(boxes, 2) if one.meets(two)]
    found += [
        (a, b)
        for a, text in texts
        for b, state in states
        if a != b and "state" not in a and not re.fullmatch(r"element\d+", a) and text.meets(state)
    ]
    for name, points in picture.lines:
        found += [(a, name) for a, box in texts + states if any(_deep(box, p) for p in points)]
    return found


def _deep(box: Box, point: Point) -> bool:
    x, y = point
    return box.left + 0.6 < x < box.right - 0.6 and box.top + 0.6 < y < box.bottom - 0.6


def _along(points: list[Point]) -> list[Point]:
    """Return points on Bezier curves, about every two points."""
    found = []
    for a, b, c, d in zip(points[:-3:3], points[1::3], points[2::3], points[3::3], strict=True):
        steps = 2 + int((abs(a[0] - d[0]) + abs(a[1] - d[1])) / 2)
        for t in (k / steps for k in range(steps + 1)):
            weights = (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3
            x, y = (
                sum(w * p[i] for w, p in zip(weights, (a, b, c, d), strict=True)) for i in (0, 1)
            )
            found.append((x, y))
    return found
