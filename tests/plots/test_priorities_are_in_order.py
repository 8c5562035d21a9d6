"""Edges that leave a state are drawn by priority, from left to right or from top to bottom.

The claim is checked on the geometry, for the labels and for the ends at the state, in single charts
and in every region of a bank. Self-loops are beside their state; those are in order too.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from gms_fsm.charts import CHARTS, GMS_ELEMENT
from gms_fsm.charts.chart import Chart
from plots._labels import edge_id, part_id
from plots.render import render
from plots.statechart import statechart
from tests.plots.charts_to_draw import THREE_LOOPS, any_chart
from tests.plots.test_labels_never_overlap import Picture
from tests.plots.test_statechart_shows_the_whole_chart import FIVE_STATES, THREE_STATES

AXIS = {"TB": 0, "LR": 1}
SEVERAL = [name for name, chart in CHARTS.items() if len(chart.transitions) > 2]


def places(picture: Picture, chart: Chart, element: str, direction: str) -> dict[str, list[float]]:
    """Return the places of labels and of ends, by source and side, in the order of priority."""
    side = ("left", "right") if direction == "TB" else ("top", "bottom")
    boxes = dict(picture.states)
    found: dict[str, list[float]] = {}
    for state in chart.states:
        box = boxes[part_id(element, "state", state.name)]
        for _, edge in chart.leaving(state.name):
            guard = edge_id(chart, element, "guard", edge)
            texts = [box for name, box in picture.texts if name == guard]
            ends = [
                min(getattr(b, side[0]) for b in texts),
                max(getattr(b, side[1]) for b in texts),
            ]
            (line,) = (p for n, p in picture.lines if n == guard.replace("guard", "edge", 1) + "-1")
            x, y = line[0]
            below = (
                y > (box.top + box.bottom) / 2
                if direction == "TB"
                else x > (box.left + box.right) / 2
            )
            if edge.source == edge.target:
                continue
            found.setdefault(f"{state.name} labels", []).append(sum(ends) / 2)
            found.setdefault(f"{state.name} ends {below}", []).append(line[0][AXIS[direction]])
    return found


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["TB", "LR"])
@pytest.mark.parametrize("name", [*SEVERAL, "three", "five", *range(8)])
def test_single_charts(name: str | int, direction: str, tmp_path: Path) -> None:
    own = {"three": THREE_STATES, "five": FIVE_STATES}
    chart = any_chart(name) if isinstance(name, int) else own.get(name) or CHARTS[name]
    picture = Picture(chart, tmp_path, direction=direction, form="graph")
    for what, given in places(picture, chart, "element1", direction).items():
        assert all(a < b for a, b in pairwise(given)), what


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["TB", "LR"])
@pytest.mark.parametrize("chart", [GMS_ELEMENT["published"], FIVE_STATES], ids=["gms", "five"])
def test_every_region_of_a_bank_is_like_the_single_chart(
    chart: Chart, direction: str, tmp_path: Path
) -> None:
    single = places(Picture(chart, tmp_path, direction=direction), chart, "element1", direction)
    bank = Picture(chart, tmp_path, 4, direction=direction)
    for element in range(1, 5):
        region = places(bank, chart, f"element{element}", direction)
        for what, given in region.items():
            shift = given[0] - single[what][0]
            assert given == pytest.approx([x + shift for x in single[what]], abs=0.05)


@pytest.mark.parametrize("direction", ["TB", "LR"])
def test_self_loops(direction: str, tmp_path: Path) -> None:
    """Each has a level of its own: from top to bottom, or from left to right."""
    chart = THREE_LOOPS
    picture = Picture(chart, tmp_path, direction=direction)
    tops, ends = [], []
    for _, edge in chart.leaving("state_3"):
        if edge.source == edge.target:
            name = edge_id(chart, "element1", "guard", edge)
            boxes = [box for own, box in picture.texts if own == name]
            (line,) = (p for n, p in picture.lines if n == name.replace("guard", "edge", 1) + "-1")
            tops.append(min(b.top if direction == "TB" else b.left for b in boxes))
            ends.append(line[0][1 - AXIS[direction]])
    assert len(tops) >= 3
    assert tops == sorted(tops)
    assert ends == sorted(ends)


def test_order_numbers_agree_between_single_chart_and_bank(tmp_path: Path) -> None:
    from xml.etree import ElementTree

    chart = GMS_ELEMENT["published"]

    def numbers(elements: int, element: int) -> dict[str, str]:
        root = ElementTree.parse(render(statechart(chart, elements), tmp_path / "a.svg"))
        groups = {
            group.get("id", ""): group for group in root.iter("{http://www.w3.org/2000/svg}g")
        }
        ids = {edge.name: f"element{element}-guard-{edge.name}" for edge in chart.transitions}
        return {
            edge: str(groups[name][1 if groups[name][1].text else 2].text)
            for edge, name in ids.items()
        }

    single = numbers(1, 1)
    assert all(numbers(4, element) == single for element in range(1, 5))
