"""A drawn chart shows every state, edge, guard and priority, and nothing in it overlaps.

Checked by geometry: an edge counts only if it is one line from its source to an arrow at its target
that passes its guard, at a small distance. Boxes of texts are from the widths of the fonts. A
picture is at most two A4 pages wide.
"""

from __future__ import annotations

import re
from functools import cache
from itertools import chain, combinations, pairwise
from math import dist
from typing import Any

import pytest

import gms_fsm.charts.chart
from gms_fsm.charts import CHARTS, GMS_ELEMENT, LUGRE
from gms_fsm.charts.chart import Chart, State, Transition
from plots.charts.cells import SIDE
from plots.charts.graph import graph_drawing
from plots.charts.labels import edge_id, part_id
from plots.charts.layout.layers import BESIDE
from plots.charts.statechart import ChartSheet, layout, statechart
from tests.helpers import matrix
from tests.plots.charts_to_draw import (
    HOSTILE,
    LONG_GUARDS,
    MANY_EDGES,
    RING,
    THERE_AND_BACK,
    THREE_LOOPS,
    THREE_STATES,
    any_chart,
    label_of,
    texts_of,
)
from tests.plots.pictures import Box, Picture, Point, chart_picture, overlaps, squeezed

pytestmark = pytest.mark.slow

A4 = 595  # points
PLACES = {"stick": (0, 0), "creep": (320, 20), "slip": (150, 240)}
MOVED = THREE_STATES.placed(PLACES)
AXIS = {"TB": 0, "LR": 1}
# Chart, number of elements, options.
OWN: dict[str, tuple[Chart, int | range, dict[str, Any]]] = {
    "GMS signed, 4 elements": (GMS_ELEMENT["signed"], range(4), {}),
    "LuGre": (LUGRE, 1, {}),
    "3 states": (THREE_STATES, 1, {}),
    "hostile": (HOSTILE, range(2), {}),
    "ring": (RING, 1, {}),
    "ring there and back": (THERE_AND_BACK, 1, {}),
    "by hand": (MOVED, 1, {}),
}
HARD: dict[str, tuple[Chart, int | range, dict[str, Any]]] = {
    "12 elements": (GMS_ELEMENT["published"], 12, {}),
    "40 edges": (MANY_EDGES, 1, {"notation": "math"}),
    "40 edges, graph": (MANY_EDGES, 1, {"form": "graph"}),
    "loops": (THREE_LOOPS, 1, {"theme": "dark"}),
    "long guards": (LONG_GUARDS, 1, {"notation": "math"}),
    "hostile, math": (HOSTILE, 2, {"notation": "math", "theme": "dark"}),
    **{f"random {seed}": (any_chart(seed), 1, {}) for seed in range(5)},
    **{f"random {seed}": (any_chart(seed), 1, {"form": "graph"}) for seed in range(5, 9)},
}
ZOO: dict[str, tuple[Chart, int | range, dict[str, Any]]] = {
    name: (chart, 1, {"notation": ("stateflow", "math")[k % 2]})
    for k, (name, chart) in enumerate(CHARTS.items())
}
CASES = OWN | HARD | ZOO
BOTH = [(name, direction) for name in CASES for direction in ("TB", "LR")]
# Each in one direction, and of the zoo and the random ones every third.
SOME = [*OWN, *(name for name in HARD if "random" not in name)]
SOME += [*(name for name in HARD if "random" in name), *ZOO][::3]
KEPT = [(name, ("TB", "LR")[k % 2]) for k, name in enumerate(SOME)]


@cache
def picture(name: str, direction: str) -> Picture:
    chart, elements, options = CASES[name]
    return chart_picture(chart, elements, direction=direction, **options)


@pytest.mark.every(2)
@pytest.mark.parametrize(("name", "direction"), matrix(BOTH, KEPT))
def test_nothing_overlaps_and_all_texts_are_large_enough(name: str, direction: str) -> None:
    drawn, (_, elements, options) = picture(name, direction), CASES[name]
    assert not overlaps(drawn)
    assert min(drawn.sizes) >= 7
    if elements == 1 and "form" not in options:
        assert drawn.width <= 2 * A4
    if name in ("GMS signed, 4 elements", "12 elements"):  # also when printed on 170 mm
        assert min(drawn.sizes) * min(1.0, 170 / 25.4 * 72 / drawn.width) >= 6.99


def test_the_check_finds_an_overlap() -> None:
    drawn = chart_picture(GMS_ELEMENT["signed"])
    (name, box), *_ = drawn.texts
    drawn.texts.append(("other", box))
    assert (name, "other") in overlaps(drawn)
    drawn.texts[-1] = ("other", drawn.heads[0][1])
    assert ("other", drawn.heads[0][0]) in overlaps(drawn)


# --------------------------------------------------------------------------- complete
@pytest.mark.parametrize(("name", "direction"), [each for each in KEPT if each[0] in OWN])
def test_every_state_guard_edge_and_default_dot_is_there(name: str, direction: str) -> None:
    drawn, (chart, elements, _) = picture(name, direction), OWN[name]
    count = elements if isinstance(elements, int) else len(elements)
    for element in (f"element{k}" for k in range(1, count + 1)):
        for state in chart.states:
            shown = drawn[f"{element}-state-{state.name}"]
            assert squeezed(*shown.texts) == squeezed(*state_lines(chart, state.name))
            for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
                assert_guard(chart, drawn, f"{element}-guard-{edge.name}", priority, edge.name)
                assert_line(drawn, element, edge)
        assert "default" in drawn[f"{element}-default"].classes
        start = drawn[f"{element}-default-edge"]
        (arrow,) = start.polygons
        assert start.touches(drawn[f"{element}-state-{chart.default_state.name}"], arrow)
    assert len(drawn.of_class("state")) == count * len(chart.states)
    assert len(drawn.of_class("guard")) == count * len(chart.transitions)
    assert len(drawn.of_class("edge")) == count * (len(chart.transitions) + 1)
    assert len(drawn.of_class("default")) == 2 * count


def state_lines(chart: Chart, name: str) -> list[str]:
    texts = ([f"{kind}:", *each] for kind, each in texts_of(chart, name).items() if each)
    return [name, *chain(*texts)]


def assert_guard(chart: Chart, drawn: Picture, name: str, priority: int, edge: str) -> None:
    shown = squeezed(*drawn[name].texts)
    number = re.fullmatch(rf"{priority}\[(g\d+)\]", shown)
    if number:  # the guard is below the picture
        assert squeezed(label_of(chart, edge, f"{number[1]} = %s")) in drawn.legend()
    else:
        assert shown == squeezed(label_of(chart, edge, f"{priority} [%s]"))


def assert_line(drawn: Picture, element: str, edge: Transition) -> None:
    source, target = (drawn[f"{element}-state-{name}"] for name in (edge.source, edge.target))
    guard = drawn[f"{element}-guard-{edge.name}"]
    name = f"{element}-edge-{edge.name}"
    line = drawn[name]
    (arrow,) = line.polygons
    assert line.touches(source, line.line[:1])
    assert line.touches(target, arrow)
    assert not line.touches(guard, arrow)
    (points,) = (points for each, points in drawn.lines if each == name)
    distances = [guard.box.distance(point) for point in points]
    assert 1.0 < min(distances) < BESIDE + 1.0, "beside the guard, and not through it"
    assert guard.box.distance(line.line[0]) > min(distances)


@pytest.mark.parametrize("notation", ["stateflow", "math"])
def test_invalid_names_are_shown_literally(notation: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gms_fsm.charts.chart, "check_name", lambda *_: None)  # let them through
    bad = 'slip</B></TD></TR></TABLE>>]; "evil:n" [label=<<B>\\N" & \x01[x] \\'
    chart = Chart(
        name='<x>"]; evil [label=<<B>x</B>>]; "\\\n\0>',
        inputs=("v",),
        variables=("z<I>\\G</I>",),
        states=(State(bad, flow={"z<I>\\G</I>": "v"}),),
        transitions=(Transition('a"]; evil -> evil [x="', bad, bad, guard="v > 0"),),
        outputs={"F": "v"},
    )
    drawn = chart_picture(chart, notation=notation)
    assert (len(drawn.of_class("node")), len(drawn.of_class("edge"))) == (3, 2)
    (state,) = drawn.of_class("state")
    assert squeezed(drawn[state].texts[0]) == squeezed(bad.replace("\x01", "\\u0001"))
    if notation == "stateflow":
        assert "dz<I>\\G</I> = v;" in drawn[state].texts


# --------------------------------------------------------------------------- in order
def places(drawn: Picture, chart: Chart, element: str, direction: str) -> dict[str, list[float]]:
    """Return the places of labels and of ends, by source and side, in the order of priority."""
    side = "left" if direction == "TB" else "bottom"  # of a label, where its line is
    boxes, found = dict(drawn.states), dict[str, list[float]]()
    for state in chart.states:
        box = boxes[part_id(element, "state", state.name)]
        middle = (box.left + box.right) / 2, (box.top + box.bottom) / 2
        for _, edge in chart.leaving(state.name):
            if edge.source == edge.target:
                continue
            guard = edge_id(element, "guard", edge)
            texts = [box for name, box in drawn.texts if name == guard]
            (line,) = (p for n, p in drawn.lines if n == guard.replace("guard", "edge", 1))
            beyond = line[0][1 - AXIS[direction]] > middle[1 - AXIS[direction]]
            found.setdefault(f"{state.name} labels", []).append(
                (min if direction == "TB" else max)(getattr(box, side) for box in texts)
            )
            found.setdefault(f"{state.name} ends {beyond}", []).append(line[0][AXIS[direction]])
    return found


def crossings(drawn: Picture) -> int:
    """Return how often the lines of edges cross."""
    lines = [line for name, line in drawn.lines if "-edge-" in name]
    pieces = [(k, *piece) for k, line in enumerate(lines) for piece in pairwise(line)]

    def side(a: Point, b: Point, c: Point) -> bool:
        return (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])

    return sum(
        side(a, b, c) != side(a, b, d) and side(c, d, a) != side(c, d, b)
        for (k, a, b), (other, c, d) in combinations(pieces, 2)
        if k != other
    )


PLACED = ("ring", "ring there and back", *(name for name in CASES if CASES[name][0].layout))
GRAPHS = [name for name in CASES if name not in ("40 edges", "12 elements", *PLACED, *ZOO)]
GRAPHS = [name for name in GRAPHS if "random" not in name or "form" in CASES[name][2]]
GRAPHS += [name for name in ZOO if len(CHARTS[name].transitions) > 2]


@pytest.mark.parametrize(
    ("name", "direction"),
    matrix(
        [each for each in BOTH if each[0] not in PLACED],
        [each for each in KEPT if each[0] in GRAPHS],
    ),
)
def test_edges_that_leave_a_state_are_in_the_order_of_priority(name: str, direction: str) -> None:
    """From left to right or from top to bottom, or else no lines cross.

    Numbered graphs have no labels to compare.
    """
    drawn, chart = picture(name, direction), CASES[name][0]
    if "element1-target-1" in drawn.groups:  # a matrix has its own test
        drawn = chart_picture(chart, direction=direction, form="graph")
    for element in drawn.of_class("region") or {"element1"}:
        for what, given in places(drawn, chart, element, direction).items():
            assert all(a < b for a, b in pairwise(given)) or not crossings(drawn), what


# --------------------------------------------------------------------------- places of states
@pytest.mark.parametrize("name", ["karnopp", "stiction"])
def test_lines_that_do_not_cross_are_not_mistaken_for_one(name: str) -> None:
    lines = chart_picture(CHARTS[name]).lines
    for (a, one), (b, other) in combinations(lines, 2):
        assert min(dist(p, q) for p in one for q in other) > 6.0, (a, b)


def test_a_long_ring_goes_around_a_rectangle() -> None:
    for name in ("ring", "ring there and back"):
        for direction in ("TB", "LR"):
            drawn = picture(name, direction)
            assert max(drawn.width, drawn.height) < 850
            assert not drawn.of_class("legend")


def test_states_are_where_the_layout_of_the_chart_says() -> None:
    for direction in ("TB", "LR"):
        drawn = picture("by hand", direction)
        found = {
            name.rpartition("-")[2]: ((box.left + box.right) / 2, (box.top + box.bottom) / 2)
            for name, box in drawn.states
        }
        left, top = (found["stick"][k] - PLACES["stick"][k] for k in (0, 1))
        for state, (x, y) in PLACES.items():
            assert found[state] == pytest.approx((x + left, y + top), abs=1.0)
    live = ChartSheet(MOVED, live=True).fitted()
    assert live.form == "graph"
    nodes = {n.name: n for n in graph_drawing(live, 0, nested=False).nodes if "state" in n.kind}
    first, second, *_ = nodes.values()
    assert first.at[0] < second.at[0] - 300


def test_the_layout_of_a_picture_is_a_layout_to_begin_with() -> None:
    found = layout(THREE_STATES)
    assert [*found] == [state.name for state in THREE_STATES.states]
    again = layout(THREE_STATES.placed(found))
    (x, y), (to_x, to_y) = found["stick"], again["stick"]
    for state, at in found.items():
        assert again[state] == pytest.approx((at[0] - x + to_x, at[1] - y + to_y), abs=0.2)


# --------------------------------------------------------------------------- several elements
@pytest.mark.parametrize(
    ("elements", "direction", "rows"),
    [(2, "LR", 2), (5, "TB", 3)],
)
def test_several_elements_are_a_grid_of_parallel_regions(
    elements: int, direction: str, rows: int
) -> None:
    """The grid is as wide as a printed page, with type of at least 7 points."""
    drawn = chart_picture(GMS_ELEMENT["signed"], range(elements), direction=direction)
    regions = [drawn[f"element{element}"] for element in range(1, elements + 1)]
    assert drawn.of_class("region") == {region.id for region in regions}
    for element, region in enumerate(regions, start=1):
        assert region.texts == [f"Element {element}", f"AND {element}"]
        own = [group for name, group in drawn.groups.items() if name.startswith(f"{region.id}-")]
        assert all(region.box.holds(group.box) for group in own if group.line)
    assert not [1 for a, b in combinations(regions, 2) if a.box.meets(b.box)]
    reading_order = [(round(region.box.top), round(region.box.left)) for region in regions]
    assert reading_order == sorted(reading_order)
    assert len({top for top, _ in reading_order}) == rows
    assert Box.around([p for r in regions for p in r.line]).right < 482 * 10 / 7  # 170 mm


def test_a_number_of_elements_that_are_alike_is_one_region() -> None:
    for elements, region in ((4, "Elements 1 to 4"), (range(4), "Element 1")):
        drawn = chart_picture(GMS_ELEMENT["signed"], elements)
        assert drawn["element1"].texts[0] == region
        assert len(drawn.of_class("region")) == (1 if elements == 4 else 4)


@pytest.mark.parametrize("direction", ["TB", "LR"])
def test_the_text_of_a_state_begins_at_the_left_in_the_middle_of_its_height(direction: str) -> None:
    """Also where the box is larger than its text, because many edges end there."""
    drawn = chart_picture(CHARTS["karnopp"].placed({}), direction=direction)
    larger = 0
    for name, box in drawn.states:
        (rule,) = drawn[name].polygons  # under the title
        own = [text for group, text in drawn.texts if group == name]
        rows = [text for text in own if text.top > rule[0][1]]
        above = min(text.top for text in rows) - Box.around(rule).bottom
        below = box.bottom - max(text.bottom for text in rows)
        assert above == pytest.approx(below, abs=4.0)
        assert min(text.left for text in own) - box.left == pytest.approx(SIDE, abs=3.0)
        larger += above > 10
    assert larger or direction == "TB"


def test_elements_are_chosen_from_0_and_shown_from_1() -> None:
    signed = GMS_ELEMENT["signed"]
    drawn = chart_picture(signed, [3, 0])
    assert drawn.of_class("region") == {"element4", "element1"}
    assert drawn["element4"].texts == ["Element 4", "AND 4"]
    assert drawn["element4"].box.left < drawn["element1"].box.left
    assert drawn["element4-state-slip"]
    assert chart_picture(signed, range(2)).of_class("region") == {"element1", "element2"}
    one = chart_picture(signed, [2])  # the element must be named
    assert one["element3"].texts == ["Element 3", "AND 3"]


def test_sizes_of_texts_are_whole_points() -> None:
    """Graphviz cuts off the rest, and the text would be narrower than its cell."""
    for chart in (MANY_EDGES, THREE_LOOPS):
        graph = statechart(chart, notation="math", form="graph")
        sizes = set(re.findall(r'POINT-SIZE="([^"]*)"', graph.source))
        assert sizes
        assert all(size.isdigit() for size in sizes)
