"""In a drawn chart no text overlaps another, an arrowhead, or a line; arrowheads stay apart.

The claim is checked on the geometry of the SVG: boxes around texts, from the widths of the fonts,
polygons of arrowheads, points on the lines. The picture is at most two A4 pages wide.
"""

from __future__ import annotations

import re
import shutil
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gms_fsm.charts import CHARTS, GMS_ELEMENT
from gms_fsm.charts.chart import Chart
from plots._fonts import width
from plots.render import render
from plots.statechart import statechart
from tests.plots.charts_to_draw import LONG_GUARDS, MANY_EDGES, THREE_LOOPS, any_chart
from tests.plots.test_statechart_shows_the_whole_chart import FIVE_STATES, SVG, Box, Point, _points

A4 = 595  # points
HARD = {
    "40 edges": MANY_EDGES,
    "three loops": THREE_LOOPS,
    "guards of 120 characters": LONG_GUARDS,
    "five states": FIVE_STATES,
}


class Picture:
    """Boxes and lines of a drawn chart."""

    def __init__(self, chart: Chart, folder: Path, elements: int = 1, **options: str) -> None:
        if shutil.which("dot") is None:
            pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")
        graph = statechart(chart, elements, **options)  # type: ignore[arg-type]
        self.root = ElementTree.parse(render(graph, folder / "chart.svg")).getroot()
        self.width, self.height = (
            float(self.root.get(side, "").removesuffix("pt")) for side in ("width", "height")
        )
        self.texts: list[tuple[str, Box]] = []  # with the ids of their groups
        self.heads: list[tuple[str, Box]] = []
        self.states: list[tuple[str, Box]] = []
        self.lines: list[tuple[str, list[Point]]] = []
        self.sizes: set[float] = set()
        for group in self.root.iter(SVG + "g"):
            name, kinds = group.get("id", ""), group.get("class", "").split()
            lines = [_points(path.get("d", "")) for path in group.findall(SVG + "path")]
            shapes = [_points(each.get("points", "")) for each in group.findall(SVG + "polygon")]
            self.texts += [(name, self._box(text)) for text in group.findall(SVG + "text")]
            if "edge" in kinds:
                self.heads += [(name, Box.around(points)) for points in shapes]
                self.lines += [(name, _along(points)) for points in lines]
            elif "state" in kinds:
                self.states.append((name, Box.around(lines[0])))

    def _box(self, text: ElementTree.Element) -> Box:
        x, y, size = (float(text.get(key, "")) for key in ("x", "y", "font-size"))
        mono = "Mono" in text.get("font-family", "")
        words = (text.text or "").replace("\xa0", " ")
        self.sizes.add(size)
        bold = 1.0 if mono or text.get("font-weight") == "bold" else 0.9  # an upper bound
        x += width(words[: len(words) - len(words.lstrip())], size, mono=mono)
        wide = width(words.strip(), size, mono=mono) * bold
        return Box(x, y - 0.75 * size, x + wide, y + 0.2 * size)


def _along(points: list[Point]) -> list[Point]:
    """Return points on Bezier curves, about every two points."""
    found = []
    for a, b, c, d in zip(points[:-3:3], points[1::3], points[2::3], points[3::3], strict=True):
        steps = 2 + int((abs(a[0] - d[0]) + abs(a[1] - d[1])) / 2)
        for t in (k / steps for k in range(steps + 1)):
            weights = (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3
            found.append(
                tuple(
                    sum(w * p[i] for w, p in zip(weights, (a, b, c, d), strict=True))
                    for i in (0, 1)
                )
            )
    return found  # type: ignore[return-value]


def overlaps(picture: Picture) -> list[tuple[str, str]]:
    """Return the ids of parts that overlap."""
    between = [
        (a, b) for (a, one), (b, two) in combinations(picture.texts, 2) if a != b and one.meets(two)
    ]
    between += [
        (a, b) for a, text in picture.texts for b, head in picture.heads if text.meets(head)
    ]
    between += [(a, b) for (a, one), (b, two) in combinations(picture.heads, 2) if one.meets(two)]
    between += [(a, b) for (a, one), (b, two) in combinations(picture.states, 2) if one.meets(two)]
    between += [
        (a, b)
        for a, text in picture.texts
        for b, state in picture.states
        if a != b and "state" not in a and not re.fullmatch(r"element\d+", a) and text.meets(state)
    ]
    for name, points in picture.lines:
        for a, box in picture.texts + picture.states:
            if any(_deep(box, point) for point in points):
                between.append((a, name))
    return between


def _deep(box: Box, point: Point) -> bool:
    x, y = point
    return box.left + 0.6 < x < box.right - 0.6 and box.top + 0.6 < y < box.bottom - 0.6


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["TB", "LR"])
@pytest.mark.parametrize("name", [*HARD, *CHARTS])
def test_single_charts(name: str, direction: str, tmp_path: Path) -> None:
    notation = "math" if len(name) % 2 else "stateflow"
    chart = HARD[name] if name in HARD else CHARTS[name]
    picture = Picture(chart, tmp_path, direction=direction, notation=notation)
    assert not overlaps(picture)
    assert picture.width <= 2 * A4


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["TB", "LR"])
@pytest.mark.parametrize("elements", [4, 12])
def test_banks(elements: int, direction: str, tmp_path: Path) -> None:
    """A bank is readable on 170 mm: its smallest text but an index is printed in 7 points."""
    picture = Picture(GMS_ELEMENT["published"], tmp_path, elements, direction=direction)
    assert not overlaps(picture)
    assert min(picture.sizes) * min(1.0, 170 / 25.4 * 72 / picture.width) >= 6.99


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["TB", "LR"])
@pytest.mark.parametrize("seed", range(12))
def test_random_charts(seed: int, direction: str, tmp_path: Path) -> None:
    chart = any_chart(seed)
    picture = Picture(chart, tmp_path, direction=direction)
    assert not overlaps(picture), f"seed {seed}"
    assert picture.width <= 2 * A4, f"seed {seed}"
    assert min(picture.sizes) >= 7, f"seed {seed}"


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["TB", "LR"])
@pytest.mark.parametrize("seed", [*range(6), "40 edges"])
def test_graphs_that_are_asked_for(seed: int | str, direction: str, tmp_path: Path) -> None:
    chart = MANY_EDGES if isinstance(seed, str) else any_chart(seed)
    picture = Picture(chart, tmp_path, direction=direction, form="graph")
    assert not overlaps(picture), f"seed {seed}"
    assert min(picture.sizes) >= 7, f"seed {seed}"


def test_the_check_finds_an_overlap(tmp_path: Path) -> None:
    picture = Picture(GMS_ELEMENT["signed"], tmp_path)
    (name, box), *_ = picture.texts
    picture.texts.append(("other", box))
    assert (name, "other") in overlaps(picture)
    picture.texts[-1] = ("other", picture.heads[0][1])
    assert ("other", picture.heads[0][0]) in overlaps(picture)
