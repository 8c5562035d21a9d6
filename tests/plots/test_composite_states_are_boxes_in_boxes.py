"""A picture of nested states: each in those around it, nothing else overlaps, an edge is a line.

An edge of a composite state is drawn once, from its box; one to a state inside ends there.
"""

from __future__ import annotations

from itertools import combinations

import pytest

from gms_fsm.charts.chart import Chart
from plots.charts.labels import part_id
from plots.charts.statechart import ChartSheet
from plots.output.mermaid import mermaid
from plots.output.plantuml import plantuml
from tests.corpus import LIGHT
from tests.exporters.nested_charts import made
from tests.helpers import matrix

Box = tuple[float, float, float, float]  # left, top, right, bottom
CHARTS = {"light": LIGHT.chart} | {f"random {k}": made(k).chart for k in (1, 3, 4, 7)}


def boxes(chart: Chart, direction: str) -> dict[str, Box]:
    """Return all labels by their ids."""
    return {
        node.name: (x - w / 2, y - h / 2, x + w / 2, y + h / 2)
        for node in ChartSheet(chart, direction=direction, form="graph").fitted().drawing(0).nodes
        if node.label is not None
        for (x, y), w, h in [(node.at, node.label.width, node.label.height)]
    }


def inside(one: Box, other: Box) -> bool:
    """Return whether a box is in another one, with room around it."""
    return all(a - b > 2 for a, b in zip(one[:2], other[:2], strict=True)) and all(
        b - a > 2 for a, b in zip(one[2:], other[2:], strict=True)
    )


def apart(one: Box, other: Box) -> bool:
    """Return whether two boxes have no area in common, but for rounding."""
    return any(one[k + 2] <= other[k] + 1 or other[k + 2] <= one[k] + 1 for k in (0, 1))


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["TB", "LR"])
@pytest.mark.parametrize("name", matrix([*CHARTS], ["light", "random 7"]))
def test_states_are_in_those_around_them_and_nothing_else_overlaps(
    name: str, direction: str
) -> None:
    chart, found = CHARTS[name], boxes(CHARTS[name], direction)
    ids = {part_id("element1", "state", path): path for path in chart.nesting.levels}
    assert ids.keys() <= found.keys()
    for (a, one), (b, other) in combinations(found.items(), 2):
        first, second = ids.get(a, ""), ids.get(b, "")
        if first and second.startswith(f"{first}."):
            assert inside(other, one), (a, b)
        elif second and first.startswith(f"{second}."):
            assert inside(one, other), (a, b)
        else:
            composite = {each.path for each in chart.nesting.composite} & {first, second}
            around = inside(other, one) or inside(one, other)
            assert apart(one, other) or (composite and around), (a, b)


@pytest.mark.parametrize("name", CHARTS)
def test_an_edge_is_one_line_between_the_states_it_is_written_for(name: str) -> None:
    chart = CHARTS[name]
    drawing = ChartSheet(chart, form="graph").fitted().drawing(0)
    found = boxes(chart, "TB")
    lines = [line for line in drawing.lines if "class" not in line.look]
    assert len(lines) == sum(len(edge.sources) for edge in chart.nesting.transitions)
    assert len(drawing.lines) - len(lines) == 1 + len(chart.nesting.composite)  # of dots
    for line in lines:
        for end, (x, y) in zip(line.ends, (line.points[0], line.points[-1]), strict=True):
            left, top, right, bottom = found[end]
            assert left - 1 <= x <= right + 1, line.name
            assert top - 1 <= y <= bottom + 1, line.name
            assert min(abs(x - left), abs(x - right), abs(y - top), abs(y - bottom)) < 1, line.name


def test_texts_for_other_tools_nest_states() -> None:
    for text in (str(mermaid(LIGHT.chart)), str(plantuml(LIGHT.chart))):
        assert text.count("state s2_on {") == text.count("state s4_on_go {") == 1
        assert text.count("[*] --> ") == 3
        assert text.count("s2_on --> s1_off") == 1
    assert "on.go.green" not in str(mermaid(LIGHT.chart))
