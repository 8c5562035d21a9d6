"""The program dot and the package pygraphviz draw the same texts at the same places and sizes."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gms_fsm.charts import CHARTS, GMS_ELEMENT
from plots.render import render
from plots.statechart import statechart
from tests.plots.charts_to_draw import LONG_GUARDS, MANY_EDGES, THREE_LOOPS
from tests.plots.test_statechart_shows_the_whole_chart import FIVE_STATES, SVG

CASES = {
    **{name: (chart, 1, "math") for name, chart in CHARTS.items() if len(chart.transitions) > 1},
    "published": (GMS_ELEMENT["published"], 1, "stateflow"),
    "bank": (GMS_ELEMENT["published"], 4, "math"),
    "twelve": (GMS_ELEMENT["published"], 12, "math"),
    "40 edges": (MANY_EDGES, 1, "stateflow"),
    "loops": (THREE_LOOPS, 1, "math"),
    "long": (LONG_GUARDS, 1, "stateflow"),
}


def drawn(path: Path) -> tuple[list[float], list[tuple[str, float, float]]]:
    root = ElementTree.parse(path).getroot()
    size = [float(root.get(side, "").removesuffix("pt")) for side in ("width", "height")]
    return size, [
        (each.text or "", float(each.get("x", "")), float(each.get("y", "")))
        for each in root.iter(SVG + "text")
    ]


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["TB", "LR"])
@pytest.mark.parametrize("case", CASES)
def test_program_and_package(
    case: str, direction: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if shutil.which("dot") is None:
        pytest.skip("needs the program dot on PATH")
    pytest.importorskip("pygraphviz", reason="pygraphviz is the optional extra 'render'")
    chart, elements, notation = CASES[case]
    graph = statechart(chart, elements, notation=notation, direction=direction)
    size, texts = drawn(render(graph, tmp_path / "program.svg"))
    monkeypatch.setenv("PATH", "")
    other_size, other_texts = drawn(render(graph, tmp_path / "package.svg"))
    assert other_size == pytest.approx(size, rel=0.02)
    assert [text for text, *_ in other_texts] == [text for text, *_ in texts]
    for (_, x, y), (_, other_x, other_y) in zip(texts, other_texts, strict=True):
        assert other_x == pytest.approx(x, abs=1.0)
        assert other_y == pytest.approx(y, abs=2.5)


@pytest.mark.parametrize("direction", ["TB", "LR"])
def test_sizes_of_texts_are_whole_points(direction: str) -> None:
    """Graphviz cuts off the rest, and the text would be narrower than its cell."""
    for chart in (MANY_EDGES, THREE_LOOPS, FIVE_STATES):
        graph = statechart(chart, direction=direction, notation="math", form="graph")
        sizes = set(re.findall(r'POINT-SIZE="([^"]*)"', graph.source))
        assert sizes
        assert all(size.isdigit() for size in sizes)
