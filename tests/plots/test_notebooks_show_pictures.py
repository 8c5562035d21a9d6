"""What notebooks show of charts, models, systems and runs, and what without Graphviz."""

from __future__ import annotations

import html
import io
import pickle
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import plots
from gms_fsm import Chart, ChartModel, Prescribed, Session, State, Stribeck, simulate
from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.errors import OutputError
from plots.output import drawings, notebook
from plots.output.graphviz import available
from tests.helpers import ROOT, stick_slip
from tests.plots.systems_to_draw import BLOCKS, SERVO, run

SVG, PNG, HTML, TEXT = "image/svg+xml", "image/png", "text/html", "text/plain"

BEGIN = """
import sys
from gms_fsm import (GMS, GMSParameters, Prescribed, Record, Session, Slider, Stribeck, fit,
                     prove, simulate)
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
    "system_of(model, rig)": SVG,
    "model.parameters": HTML,
    "trace": PNG,
    "trace.transitions": HTML,
    "trace.monitors['coverage']": HTML,
    "__import__('gms_fsm').coverage(trace)": HTML,
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
    "plots.block_diagram(system_of(model, rig))": SVG,
    "plots.overview(trace)": PNG,
    "plots.mermaid(chart)": "text/markdown",
    "plots.replay(trace)": HTML,
    "rig": TEXT,
    "Slider(1.0, [(i, 0.1) for i in range(10000)])": TEXT,
    "GMSParameters(*[[1.0] * 1000] * 3, sigma_2=0, stribeck=Stribeck(1, 1, 1), v_c=1)": HTML,
    "trace.rows": TEXT,
    "trace.settings": TEXT,
    "session.branches": TEXT,
    "chart.transitions": TEXT,
}


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


@pytest.mark.matrix
@pytest.mark.slow
def test_one_of_each_shows_itself_as_the_last_line_of_a_cell(tmp_path: Path) -> None:
    """Its text is short; `plots` is not imported before, nor ``%matplotlib inline`` run."""
    if not available():
        pytest.skip("no Graphviz: neither the program dot nor pygraphviz")
    for shown, data in executed(BEGIN, SHOWN, tmp_path).items():
        form = SHOWN[shown]
        assert set(data) == {form, TEXT} | ({HTML} if form == SVG else set()), shown
        assert " at 0x" not in data[TEXT], shown
        assert len(data[TEXT]) < 2000, shown
        if form == SVG:
            assert ElementTree.fromstring(data[SVG]).tag.endswith("svg"), shown
            assert len(data[SVG]) < 100_000, shown
            assert data[HTML].startswith('<img style="max-width:100%" alt="'), shown
        if form == HTML:
            assert re.search(r"<(table|pre|p|iframe)\b", data[HTML]), shown
            assert " at 0x" not in data[HTML], shown
            most = 300_000 if "base64" in data[HTML] else 100_000
            assert len(data[HTML]) < (1_000_000 if "replay" in shown else most), shown


@pytest.mark.slow
def test_charts_models_systems_and_contacts_are_svg_and_text_without_graphviz(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if not available():
        pytest.skip("no Graphviz: neither the program dot nor pygraphviz")
    values = {"k": 1.0, "sigma": 0.0, "C": 1.0, "v_c": 1e-6}
    curve, chart = Stribeck(1.0, 1.5, 1e-3), GMS_ELEMENT["signed"]
    for shown, kind, count in (
        (chart, "region", 0),
        (stick_slip("signed"), "region", 1),  # all alike
        (ChartModel(chart, values, n=9, stribeck=curve), "region", 1),
        (SERVO, "body", 2),
        (SERVO.contact("gear"), "state", 3),
    ):
        root = ElementTree.fromstring(shown._repr_svg_())  # type: ignore[attr-defined]
        found = [g for g in root.iter() if kind in g.get("class", "").split()]
        assert len(found) == count, shown

    def broken(graph: object, form: str) -> bytes:
        raise OutputError("Graphviz cannot draw this graph")

    with monkeypatch.context() as patch:
        patch.setattr(drawings, "drawn", broken)  # a graph that Graphviz refuses
        assert plots.block_diagram(2)._repr_mimebundle_().keys() == {"text/plain"}
        assert stick_slip("signed")._repr_html_().startswith("<pre")  # type: ignore[attr-defined]
    monkeypatch.setattr(drawings, "drawn", lambda graph, form: None)
    for shown in (chart, stick_slip("signed"), SERVO.contact("bearing")):
        assert shown._repr_svg_() is None  # type: ignore[attr-defined]
        assert " -> " in html.unescape(shown._repr_html_())  # type: ignore[attr-defined]
    assert "1 -> slip [z" in html.unescape(stick_slip("signed")._repr_html_())  # type: ignore[attr-defined]
    assert "J_m*dw_m/dt" in SERVO._repr_html_().replace(" ", "")  # type: ignore[attr-defined]


@pytest.mark.slow
def test_importing_gms_fsm_imports_no_pictures() -> None:
    """Classes have the methods; `plots` is imported when a notebook calls one of them."""
    code = (
        "import sys, gms_fsm as g; assert hasattr(g.Chart, '_repr_svg_'); g.Trace, g.Session; "
        "assert not {'plots', 'matplotlib', 'IPython', 'graphviz'} & set(sys.modules); "
        "from gms_fsm.charts import LUGRE; assert LUGRE._repr_html_() != ''; "
        "assert 'plots' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


@pytest.mark.slow
def test_a_run_of_several_contacts_is_a_table_and_one_of_them_a_picture() -> None:
    shown = run(BLOCKS)._repr_html_()  # type: ignore[attr-defined]
    assert shown.count("<tr>") == 3
    assert "pad1: " in shown
    assert "trace.contact(&#x27;pad1&#x27;)" in shown
    figure = pytest.importorskip("matplotlib.figure", reason="needs the extra 'plots'")
    assert run(BLOCKS)._repr_png_() is None  # type: ignore[attr-defined]
    assert run(BLOCKS).contact("pad1")._repr_png_() is not None  # type: ignore[attr-defined]
    made = figure.Figure(figsize=(3, 2))  # sharp on a dense screen
    made.subplots().plot([1, 2])
    png, size = notebook.figure_png(made)
    assert png.startswith(b"\x89PNG")
    assert int.from_bytes(png[16:20]) // 2 == size["width"]


def test_a_log_shows_its_first_records_and_is_a_record_array_for_everybody_else() -> None:
    log = simulate(stick_slip("signed"), Prescribed("0.15*sin(2*pi*t/25)"), 100.0).transitions
    shown = log._repr_html_()
    assert shown.count("<tr>") == 11
    assert f"and {len(log) - 10} more" in shown
    assert "<p>3 records</p>" in log[:3]._repr_html_()
    assert isinstance(log, np.recarray)
    assert type(log.t) is type(log["t"]) is np.ndarray
    assert isinstance(log[0], np.record)
    assert set(log[log.element == 1].edge) == {
        "break_away_forward",
        "break_away_backward",
        "arrest",
    }
    again = pickle.loads(pickle.dumps(log))
    assert again.dtype == log.dtype
    assert again.tobytes() == log.tobytes() == np.asarray(log).tobytes()
    files = io.BytesIO(), io.BytesIO()
    np.save(files[0], log)
    np.save(files[1], log.view(np.recarray))
    assert files[0].getvalue() == files[1].getvalue()


def test_what_a_user_wrote_stays_text() -> None:
    state = State("a", flow={"z": "v"}, outputs={"F": "z"})
    chart = Chart("<script>", variables=("z",), states=(state,))
    assert "<script>" not in chart._repr_html_()
    assert "<script>" not in notebook.table(["<script>"], [["<script>"]], caption="<script>")


def test_charts_of_one_name_and_size_are_not_mixed_up() -> None:
    """The short repr of a chart does not identify it: the program is that of its texts."""
    charts = [
        Chart(
            "one name",
            variables=("z",),
            states=(State("a", flow={"z": text}),),
            outputs={"F": "z"},
        )
        for text in ("v", "2 * v")
    ]
    assert repr(charts[0]) == repr(charts[1])
    ends = [
        simulate(ChartModel(chart, {}), Prescribed("0.2"), 1.0).variable("z")[-1]
        for chart in charts
    ]
    assert ends == pytest.approx([0.2, 0.4])


def test_a_column_of_a_log_is_no_table_and_branches_are_one() -> None:
    session = Session(stick_slip("signed"), Prescribed("0.2"), 3.0)
    session.next_transition()
    session.poke({"z": {0: 0.1}})
    assert "branch 1 of 2" in session._repr_html_()
    log = simulate(stick_slip("signed"), Prescribed("0.2"), 3.0).transitions
    assert notebook.log_html(log) is not None
    assert notebook.log_html(log["t"]) is None


def test_without_matplotlib_there_is_no_picture_of_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    trace = simulate(stick_slip("signed"), Prescribed("0.2"), 1.0)
    for name in [*sys.modules]:
        if name.startswith(("plots.figures", "plots.style.matplotlib")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert notebook.trace_png(trace) is None
    assert notebook.fit_png(None) is None  # type: ignore[arg-type]
