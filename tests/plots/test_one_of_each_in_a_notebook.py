"""One of each object shows itself as the last line of a cell; its text is short.

Neither `plots` is imported before, nor ``%matplotlib inline`` run.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from plots._graphviz import available

SVG, PNG, HTML, TEXT = "image/svg+xml", "image/png", "text/html", "text/plain"

BEGIN = """
import sys
from gms_fsm import (GMS, ChartModel, GMSParameters, LuGre, Prescribed, Record, Session, Slider,
                     Stribeck, fit, prove, simulate)
from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.systems.system import system_of
chart = GMS_ELEMENT["signed"]
model = GMS(GMSParameters.paper("stick-slip"), law="signed")
rig = Prescribed("0.15*sin(2*pi*t/25)")
trace = simulate(model, rig, 100.0, monitors=["coverage"])
session = Session(model, rig, 20.0)
here = session.next_transition()
report = prove(GMS_ELEMENT["published"])
rows = trace.sample([0.1 * i for i in range(300)])
record = Record.from_arrays(time=rows.t, velocity=rows.v, force=rows.F)
found = fit(record, model, free=["k"], search="local", progress=False)
assert "plots" not in sys.modules and "matplotlib" not in sys.modules
"""
FIGURE = (
    "from matplotlib.figure import Figure; f = Figure(figsize=(4, 3)); f.subplots().plot([1]); f"
)
SHOWN = {
    "chart": SVG,
    "model": SVG,
    "LuGre(sigma_0=1e3, sigma_1=30.0, sigma_2=0.4, stribeck=Stribeck(1.0, 1.5, 1e-3))": SVG,
    "system_of(model, rig)": SVG,
    "system_of(model, rig).contacts[0]": SVG,
    "model.parameters": HTML,
    "trace": PNG,
    "trace.transitions": HTML,
    "trace.transitions[:2]": HTML,
    "trace.monitors['coverage']": HTML,
    "session": HTML,
    "here": HTML,
    "session.why(0)": HTML,
    "session.why(0)[0]": HTML,
    "report": HTML,
    "found": HTML,
    "report.refuted[0]": HTML,
    FIGURE: PNG,
    "import plots; plots.LiveChart(trace, 1)": SVG,
    "plots.live_statechart(trace, row=40)": SVG,
    "plots.statechart(chart, 4)": SVG,
    "plots.block_diagram(2)": SVG,
    "plots.block_diagram(system_of(model, rig))": SVG,
    "plots.overview(trace)": PNG,
    "plots.mermaid(chart)": "text/markdown",
    "plots.replay(trace)": HTML,
    "rig": TEXT,
    "Prescribed(lambda t: 0.1 * t)": TEXT,
    "Slider(1.0, [(i, 0.1) for i in range(10000)])": TEXT,
    "GMSParameters(*[[1.0] * 1000] * 3, sigma_2=0, stribeck=Stribeck(1, 1, 1), v_c=1)": HTML,
    "trace.rows": TEXT,
    "trace.settings": TEXT,
    "session.branches": TEXT,
    "chart.transitions": TEXT,
}
WITHOUT_GRAPHVIZ = 'import os, sys; os.environ["PATH"] = ""; sys.modules["pygraphviz"] = None\n'


def executed(begin: str, shown: Iterable[str], folder: Path) -> dict[str, Any]:
    """Run each text as the last line of a cell, and return its output by mime type."""
    nbclient = pytest.importorskip("nbclient", reason="running a notebook needs nbclient")
    pytest.importorskip("ipykernel", reason="running a notebook needs ipykernel")
    for module in ("matplotlib", "uplot", "z3"):
        pytest.importorskip(module, reason="one of each needs the extra 'all'")
    import nbformat

    cells = [nbformat.v4.new_code_cell(text) for text in (begin, *shown)]
    book = nbformat.v4.new_notebook(cells=cells)
    place = {"metadata": {"path": str(folder)}}
    nbclient.NotebookClient(book, timeout=300, kernel_name="python3", resources=place).execute()
    first, *others = book.cells
    assert first.outputs == []
    for cell in others:
        assert [each.output_type for each in cell.outputs] == ["execute_result"], cell.outputs
    return {cell.source: cell.outputs[0].data for cell in others}


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    if not available():
        pytest.skip("no Graphviz: neither the program dot nor pygraphviz")
    return executed(BEGIN, SHOWN, tmp_path_factory.mktemp("notebook"))


@pytest.mark.slow
@pytest.mark.parametrize("shown", SHOWN)
def test_each_shows_itself(shown: str, outputs: dict[str, Any]) -> None:
    data = outputs[shown]
    assert set(data) == {SHOWN[shown], TEXT} | ({HTML} if SHOWN[shown] == SVG else set())
    assert_short(data[TEXT])
    if SHOWN[shown] == SVG:
        root = ElementTree.fromstring(data[SVG])
        assert root.tag.endswith("svg")
        assert len(data[SVG]) < 100_000
        assert data[HTML].startswith('<img style="max-width:100%" alt="')
    if SHOWN[shown] == HTML:
        assert re.search(r"<(table|pre|p|iframe)\b", data[HTML])
        assert " at 0x" not in data[HTML]
        most = 1_000_000 if "replay" in shown else 300_000 if "base64" in data[HTML] else 100_000
        assert len(data[HTML]) < most


@pytest.mark.slow
def test_without_graphviz_drawings_are_text(tmp_path: Path) -> None:
    drawn = [shown for shown, form in SHOWN.items() if form == SVG and "ive" not in shown]
    for shown, data in executed(
        f"{WITHOUT_GRAPHVIZ}{BEGIN}import plots", [*drawn, "session"], tmp_path
    ).items():
        assert SVG not in data
        assert_short(data[TEXT])
        text = data.get(HTML, data[TEXT])
        if shown in ("chart", "model", "plots.statechart(chart, 4)"):
            assert "1 -> slip [z" in text.replace("&gt;", ">")
        if "system_of(model, rig)" in shown and "contacts" not in shown:
            assert "v = 0.15*sin(2*pi*t/25)" in text


def assert_short(text: str) -> None:
    assert " at 0x" not in text
    assert len(text) < 2000
