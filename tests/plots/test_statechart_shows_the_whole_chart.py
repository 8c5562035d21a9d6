"""The picture of a chart shows every state, edge, guard, priority, default dot and region.

The claim is checked on the drawn SVG, by geometry: an edge counts only if its first half
begins at its source, its second half ends with an arrow at its target, and both meet its guard.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import pytest

import gms_fsm.charts.chart
from gms_fsm.charts import GMS_ELEMENT, LUGRE
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import ParameterError
from gms_fsm.language import MATLAB_LIKE, clauses, spell
from plots.render import render
from plots.statechart import statechart

SVG = "{http://www.w3.org/2000/svg}"

THREE_STATES = Chart(
    name="three states, a self loop, entry, exit and actions",
    inputs=("v", "s"),
    variables=("z",),
    parameters=("k", "v_c", "v_hi"),
    states=(
        State("stick", flow={"z": "v"}, entry={"z": "0"}),
        State("creep", flow={"z": "v - k * abs(v) * z / s"}),
        State("slip", flow={"z": "0"}, exit={"z": "z / 2"}),
    ),
    transitions=(
        Transition("go", "stick", "creep", guard="abs(z) > 0.5 * s"),
        Transition(
            "tear", "creep", "slip", guard="abs(z) >= s and v > v_c", actions={"z": "s * sgn(v)"}
        ),
        Transition("back", "creep", "stick", guard="not v > v_c"),
        Transition(
            "arrest", "slip", "stick", guard="abs(v) <= v_c and (z > 0 or v > 0) and z < 2 * s"
        ),
        Transition("again", "slip", "slip", guard="v > v_hi and z < s", actions={"z": "s"}),
        Transition("jump", "stick", "slip", guard="v_hi < v < 2 * v_hi"),
    ),
    outputs={"F": "k * z"},
)

FIVE_STATES = Chart(
    name="five states, two variables",
    inputs=("v", "s"),
    variables=("z", "w"),
    parameters=("k", "v_c", "v_hi"),
    states=(
        State("rest", flow={"z": "v", "w": "0"}),
        State("creep_forward", flow={"z": "v - k * abs(v) * z / s", "w": "v"}),
        State("creep_backward", flow={"z": "v - k * abs(v) * z / s", "w": "-v"}),
        State("slip_forward", flow={"z": "0", "w": "v - w"}, entry={"z": "s", "w": "0"}),
        State("slip_backward", flow={"z": "0", "w": "-v - w"}),
    ),
    transitions=(
        Transition("up", "rest", "creep_forward", guard="z > 0.5 * s and v > v_c"),
        Transition("down", "rest", "creep_backward", guard="z < -0.5 * s and v < -v_c"),
        Transition("tear_up", "creep_forward", "slip_forward", guard="z >= s and v > v_c"),
        Transition("tear_down", "creep_backward", "slip_backward", guard="z <= -s and v < -v_c"),
        Transition("stop_up", "slip_forward", "rest", guard="z < s and v <= v_c or v < -v_hi"),
        Transition("stop_down", "slip_backward", "rest", guard="abs(v) <= v_c"),
        Transition("calm_up", "creep_forward", "rest", guard="v < 0"),
        Transition("calm_down", "creep_backward", "rest", guard="v > 0"),
        Transition("turn_down", "slip_forward", "slip_backward", guard="v < -v_hi"),
        Transition("turn_up", "slip_backward", "slip_forward", guard="v > v_hi"),
    ),
    outputs={"F": "k * z"},
)

CASES = [
    pytest.param(GMS_ELEMENT["published"], 1, id="GMS published"),
    pytest.param(GMS_ELEMENT["signed"], 4, id="GMS signed, 4 elements"),
    pytest.param(LUGRE, 1, id="LuGre"),
    pytest.param(THREE_STATES, 1, id="3 states"),
    pytest.param(THREE_STATES, 5, id="3 states, 5 elements"),
    pytest.param(FIVE_STATES, 1, id="5 states"),
]

Point = tuple[float, float]


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
        dx = max(self.left - x, 0.0, x - self.right)
        dy = max(self.top - y, 0.0, y - self.bottom)
        return max(dx, dy)

    def meets(self, other: Box) -> bool:
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )

    def holds(self, other: Box) -> bool:
        return (
            self.left <= other.left
            and self.top <= other.top
            and other.right <= self.right
            and other.bottom <= self.bottom
        )


class Drawn:
    """One group of the SVG: a state, a guard, half an edge, a region."""

    def __init__(self, group: ElementTree.Element) -> None:
        self.id = group.get("id", "")
        self.classes = set(group.get("class", "").split())
        self.texts = [
            (text.text or "").replace("\xa0", " ").strip() for text in group.iter(SVG + "text")
        ]
        self.line = [p for path in group.iter(SVG + "path") for p in _points(path.get("d", ""))]
        self.polygons = [_points(p.get("points", "")) for p in group.iter(SVG + "polygon")]

    @property
    def ends(self) -> list[Point]:
        return [self.line[0], self.line[-1]]

    @property
    def box(self) -> Box:
        return Box.around(self.line + [p for polygon in self.polygons for p in polygon])

    def touches(self, other: Drawn, points: list[Point]) -> bool:
        return min(other.box.distance(p) for p in points) < 2.0  # points; a line is 1.1 wide


def _points(numbers: str) -> list[Point]:
    values = [float(n) for n in re.findall(r"-?\d+(?:\.\d+)?", numbers)]
    return list(zip(values[::2], values[1::2], strict=True))


Draw = Callable[[Chart, int], dict[str, Drawn]]


@pytest.fixture(params=["TB", "LR"])
def draw(tmp_path: Path, request: pytest.FixtureRequest) -> Draw:
    """Draw a chart and return what is in the SVG, by id."""
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")

    def drawn(chart: Chart, elements: int) -> dict[str, Drawn]:
        svg = render(statechart(chart, elements, direction=request.param), tmp_path / "chart.svg")
        groups = [Drawn(g) for g in ElementTree.parse(svg).iter(SVG + "g")]
        by_id = {group.id: group for group in groups}
        assert len(by_id) == len(groups), "ids are unique"
        return by_id

    return drawn


def squeezed(*texts: str) -> str:
    return "".join(texts).replace(" ", "")


def of_class(drawn: dict[str, Drawn], name: str) -> set[str]:
    return {group.id for group in drawn.values() if name in group.classes}


def legend(drawn: dict[str, Drawn]) -> str:
    """Return the numbered guards below the picture, and a mark after the last one."""
    return squeezed(*(text for name in of_class(drawn, "legend") for text in drawn[name].texts))


@pytest.mark.parametrize(("chart", "elements"), CASES)
def test_every_state_shows_its_flow_and_its_force(chart: Chart, elements: int, draw: Draw) -> None:
    drawn = draw(chart, elements)
    names, below = chart.force_names, len(chart.states) > 2
    expected = set()
    for element in range(1, elements + 1):
        for state in chart.states:
            expected.add(f"element{element}-state-{state.name}")
            flow = {f"d{v}": chart.flows[state.name, v] for v in chart.variables}
            lines = [state.name]
            for kind, trees in (
                ("entry", chart.assignments["entry", state.name]),
                ("during", flow),
                ("force", {} if below else {f: chart.forces[state.name, f] for f in names}),
                ("exit", chart.assignments["exit", state.name]),
            ):
                lines += [f"{kind}:"] if trees else []
                lines += [f"{name} = {spell(tree, MATLAB_LIKE)};" for name, tree in trees.items()]
            shown = drawn[f"element{element}-state-{state.name}"]
            assert squeezed(*shown.texts) == squeezed(*lines)
    assert of_class(drawn, "state") == expected


@pytest.mark.parametrize(("chart", "elements"), CASES)
def test_every_guard_is_complete(chart: Chart, elements: int, draw: Draw) -> None:
    drawn = draw(chart, elements)
    expected = set()
    for element in range(1, elements + 1):
        for state in chart.states:
            for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
                expected.add(f"element{element}-guard-{edge.name}")
                shown = drawn[f"element{element}-guard-{edge.name}"]
                actions = [
                    f"{name} = {spell(tree, MATLAB_LIKE)};"
                    for name, tree in chart.assignments["action", edge.name].items()
                ]
                action = "{" + "".join(actions) + "}" if actions else ""
                guard = chart.guard_text(edge.name)
                number = re.fullmatch(rf"{priority}\[(g\d+)\]", squeezed(*shown.texts))
                if number:  # the guard is below the picture
                    assert squeezed(f"{number[1]} = {guard}{action}") in legend(drawn)
                    continue
                assert squeezed(*shown.texts) == squeezed(f"{priority}[{guard}]{action}")
                for clause in clauses(chart.guards[edge.name]):
                    text = spell(clause, MATLAB_LIKE)
                    assert text in guard
                    assert squeezed(text) in squeezed(*shown.texts)
    assert of_class(drawn, "guard") == expected


@pytest.mark.parametrize(("chart", "elements"), CASES)
def test_every_edge_runs_from_source_through_guard_to_target(
    chart: Chart, elements: int, draw: Draw
) -> None:
    drawn = draw(chart, elements)
    expected = {f"element{element}-default-edge" for element in range(1, elements + 1)}
    for element in range(1, elements + 1):
        for edge in chart.transitions:
            source, target = (
                drawn[f"element{element}-state-{name}"] for name in (edge.source, edge.target)
            )
            guard = drawn[f"element{element}-guard-{edge.name}"]
            first, second = (drawn[f"element{element}-edge-{edge.name}-{half}"] for half in (1, 2))
            assert not first.polygons, "no arrow before the guard"
            assert first.touches(source, first.ends)
            assert first.touches(guard, first.ends)
            (arrow,) = second.polygons
            assert second.touches(target, arrow)
            assert second.touches(guard, second.ends)
            assert not second.touches(guard, arrow)
            expected |= {first.id, second.id}
    assert of_class(drawn, "edge") == expected


@pytest.mark.parametrize(("chart", "elements"), CASES)
def test_every_element_has_a_default_dot(chart: Chart, elements: int, draw: Draw) -> None:
    drawn = draw(chart, elements)
    for element in range(1, elements + 1):
        assert "default" in drawn[f"element{element}-default"].classes
        edge = drawn[f"element{element}-default-edge"]
        (arrow,) = edge.polygons
        assert edge.touches(drawn[f"element{element}-state-{chart.default_state.name}"], arrow)
    assert len(of_class(drawn, "default")) == 2 * elements


@pytest.mark.parametrize(("chart", "elements"), CASES)
def test_nothing_overlaps(chart: Chart, elements: int, draw: Draw) -> None:
    drawn = draw(chart, elements)
    solid = [drawn[name] for name in of_class(drawn, "state") | of_class(drawn, "guard")]
    assert not [(a.id, b.id) for a, b in combinations(solid, 2) if a.box.meets(b.box)]


@pytest.mark.parametrize(
    ("elements", "rows"),
    [(2, {"TB": 1, "LR": 2}), (4, {"TB": 2, "LR": 4}), (5, {"TB": 3, "LR": 5})],
)
def test_several_elements_are_a_grid_of_parallel_regions(
    elements: int, rows: dict[str, int], draw: Draw, request: pytest.FixtureRequest
) -> None:
    """The grid is as wide as a printed page, with type of at least 7 points."""
    drawn = draw(GMS_ELEMENT["signed"], elements)
    regions = [drawn[f"element{element}"] for element in range(1, elements + 1)]
    assert of_class(drawn, "region") == {region.id for region in regions}
    for element, region in enumerate(regions, start=1):
        assert region.texts == [f"Element {element}", f"AND {element}"]
        inside = [group for name, group in drawn.items() if name.startswith(f"element{element}-")]
        assert all(region.box.holds(group.box) for group in inside if group.line)
    assert not [1 for a, b in combinations(regions, 2) if a.box.meets(b.box)]
    reading_order = [(round(region.box.top), round(region.box.left)) for region in regions]
    assert reading_order == sorted(reading_order)
    direction = "TB" if "TB" in request.node.name else "LR"
    assert len({top for top, _ in reading_order}) == rows[direction]
    assert Box.around([p for r in regions for p in r.line]).right < 482 * 10 / 7  # 170 mm


def test_many_elements_that_are_alike_are_drawn_once(draw: Draw) -> None:
    drawn = draw(GMS_ELEMENT["signed"], 12)
    assert of_class(drawn, "region") == {"element1"}
    assert drawn["element1"].texts[:2] == ["Elements 1 to 12", "× 12"]


def test_one_element_has_no_region_and_lugre_no_edges(draw: Draw) -> None:
    drawn = draw(LUGRE, 1)
    assert of_class(drawn, "region") == of_class(drawn, "guard") == set()
    assert of_class(drawn, "edge") == {"element1-default-edge"}


def test_hostile_names_are_shown_literally(draw: Draw, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gms_fsm.charts.chart, "_check_name", lambda *_: None)  # let them through
    bad_state = 'slip</B></TD></TR></TABLE>>]; "evil:n" [label=<<B>\\N" & \x01[x] \\'
    bad_edge = 'a"]; evil -> evil [x="'
    bad_variable = "z<I>\\G</I>"
    chart = Chart(
        name='<x>"]; evil [label=<<B>x</B>>]; "\\\n\0>',
        inputs=("v",),
        variables=(bad_variable,),
        parameters=(),
        states=(
            State("stick", flow={bad_variable: "v"}),
            State(bad_state, flow={bad_variable: "0"}),
        ),
        transitions=(Transition(bad_edge, "stick", bad_state, guard="v > 0"),),
        outputs={"F": "v"},
    )
    drawn = draw(chart, 1)
    assert len(of_class(drawn, "node")) == 4
    assert len(of_class(drawn, "edge")) == 3
    (shown,) = (drawn[name] for name in of_class(drawn, "state") if "slip" in name)
    assert squeezed(shown.texts[0]) == squeezed(bad_state.replace("\x01", ""))
    assert shown.texts[2] == f"d{bad_variable} = 0;"


@pytest.mark.parametrize("elements", [0, -3, 1.5])
def test_a_chart_without_elements_is_rejected(elements: int) -> None:
    with pytest.raises(ParameterError, match=f"elements is {elements}.*at least 1"):
        statechart(LUGRE, elements)
