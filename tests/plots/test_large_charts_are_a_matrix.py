"""A chart with many edges is drawn as a matrix of sources and targets, with numbered guards."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gms_fsm import SimulationError, Stribeck, simulate
from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.systems.models import ChartModel
from gms_fsm.systems.rigs import Prescribed
from plots import LiveChart
from plots._labels import edge_id
from plots.page._chart import chart_svg
from plots.render import render
from plots.statechart import MOST_EDGES, Sheet, statechart
from tests.plots.charts_to_draw import LONG_GUARDS, MANY_EDGES, random_chart
from tests.plots.test_statechart_shows_the_whole_chart import (
    FIVE_STATES,
    SVG,
    Drawn,
    legend,
    of_class,
    squeezed,
)


def drawn(graph: object, folder: Path) -> dict[str, Drawn]:
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")
    svg = ElementTree.parse(render(graph, folder / "chart.svg"))  # type: ignore[arg-type]
    return {group.get("id", ""): Drawn(group) for group in svg.iter(SVG + "g")}


@pytest.mark.parametrize(
    ("chart", "form", "matrix"),
    [
        (random_chart(1, 5, MOST_EDGES), "auto", False),
        (random_chart(1, 5, MOST_EDGES + 1), "auto", True),
        (MANY_EDGES, "auto", True),
        (MANY_EDGES, "graph", False),
        (FIVE_STATES, "auto", False),
        (FIVE_STATES, "matrix", True),
    ],
)
def test_when(chart: Chart, form: str, matrix: bool) -> None:
    assert (Sheet(chart, form=form).fitted().form == "matrix") == matrix
    source = statechart(chart, form=form).source
    assert ("element1-target-1" in source) == matrix
    assert ("element1-default" in source) == (not matrix)


def test_a_wide_graph_becomes_a_matrix() -> None:
    """A ring of twelve states would be wider than two pages from left to right."""
    names = [f"state_{i}" for i in range(12)]
    chart = Chart(
        "ring",
        inputs=("v",),
        states=tuple(State(name) for name in names),
        transitions=tuple(
            Transition(f"next_{i}", name, names[i - 11], guard="v > 0.1 and v < 0.2")
            for i, name in enumerate(names)
        ),
        outputs={"F": "v"},
    )
    assert Sheet(chart, direction="TB").fitted().form == "graph"
    assert Sheet(chart, direction="LR").fitted().form == "matrix"
    assert Sheet(chart, direction="LR", form="graph").fitted().form == "graph"


@pytest.mark.slow
def test_every_edge_is_in_the_cell_of_its_source_and_target(tmp_path: Path) -> None:
    chart = MANY_EDGES
    found = drawn(statechart(chart), tmp_path)
    rules = [found[name].line for name in found if "-rule" in name]
    xs = sorted({line[0][0] for line in rules if line[0][0] == line[-1][0]})
    ys = sorted({line[0][1] for line in rules if line[0][1] == line[-1][1]})
    names = [state.name for state in chart.states]
    assert (len(xs), len(ys)) == (len(names) + 2, len(names) + 2)
    guards = legend(found)
    for state in chart.states:
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            shown = found[edge_id(chart, "element1", "guard", edge)]
            number = re.fullmatch(rf"{priority}\[(g\d+)\]", squeezed(*shown.texts))
            assert number
            assert squeezed(f"{number[1]} = {chart.guard_text(edge.name)}") in guards
            row, column = names.index(edge.source) + 1, names.index(edge.target) + 1
            box = shown.box
            assert xs[column] <= box.left
            assert box.right <= xs[column + 1]
            assert ys[row] <= box.top
            assert box.bottom <= ys[row + 1]
    assert len(of_class(found, "guard")) == len(chart.transitions)


def test_states_show_their_actions_and_the_default_state_is_marked(tmp_path: Path) -> None:
    found = drawn(statechart(FIVE_STATES, form="matrix"), tmp_path)
    titles = [found[f"element1-state-{state.name}"].texts[0] for state in FIVE_STATES.states]
    assert titles[0] == "1  rest ●"
    assert not [title for title in titles[1:] if "●" in title]
    for state in FIVE_STATES.states:
        assert "during:" in found[f"element1-state-{state.name}"].texts


def test_elements_of_a_matrix_are_drawn_once(tmp_path: Path) -> None:
    found = drawn(statechart(MANY_EDGES, 3), tmp_path)
    assert of_class(found, "region") == {"element1"}
    assert found["element1"].texts[:2] == ["Elements 1 to 3", "× 3"]


def test_a_long_guard_is_numbered_and_the_others_are_not(tmp_path: Path) -> None:
    """Guards of 120 characters stand on the edges if they have at most six lines."""
    for direction in ("TB", "LR"):
        found = drawn(statechart(LONG_GUARDS, direction=direction), tmp_path)
        numbered = set(re.findall(r"g\d+(?==)", legend(found)))
        for edge in LONG_GUARDS.transitions:
            texts = found[edge_id(LONG_GUARDS, "element1", "guard", edge)].texts
            number = re.search(r"\[(g\d+)\]", squeezed(*texts))
            assert not number or number[1] in numbered
            assert max(map(len, texts)) <= 36


def test_edges_with_the_same_guard_share_a_number() -> None:
    sheet = Sheet(GMS_ELEMENT["signed"], form="matrix").fitted()
    assert list(sheet.numbered.values()) == [1, 2, 3]
    many = Sheet(MANY_EDGES).fitted()
    texts = {many.legend_text(edge) for edge in MANY_EDGES.transitions}
    assert len(set(many.numbered.values())) == len(texts) < len(MANY_EDGES.transitions)


@pytest.mark.slow
def test_a_live_chart_and_a_page_are_always_graphs() -> None:
    """The marks of the clauses of a numbered guard follow its number."""
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")
    chart = MANY_EDGES
    numbers = {"k": 0.5, "v_c": 1e-3, "v_hi": 0.25}
    model = ChartModel(chart, numbers, n=1, stribeck=Stribeck(1.0, 1.5, 0.05))
    with pytest.raises(SimulationError) as failed:  # random guards: the chart switches for ever
        simulate(model, Prescribed("0.01"), 1e-3)
    shown = LiveChart(failed.value.trace)
    look = shown.look(0)[0]
    svg = shown.frame(0)
    assert look.leaving
    assert f'id="element1-edge-{look.leaving[0]}-2"' in svg
    assert svg.count('class="mark ') == sum(map(len, look.marks.values()))
    assert 'data-edge="39"' in chart_svg(chart, 1)
