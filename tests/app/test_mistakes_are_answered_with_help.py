"""Formats are told from one table, no bar stands before an error, and numbers are plain."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import graphviz
import numpy as np
import pytest
from rich.console import Console

from gms_fsm import Prescribed, Session, Trace, simulate
from gms_fsm.app.live import LiveView
from gms_fsm.charts import LUGRE, gms_element
from gms_fsm.errors import OutputError, ParameterError, shown
from gms_fsm.run.simulate import Moment
from plots import block_diagram, mermaid, render, statechart
from plots.output.formats import of
from tests.helpers import pulled_mass, stick_slip
from tests.scenario_files import CommandLine

# --------------------------------------------------------------------------- formats
FORMATS = {each.name: each for each in of("graph", "chart")}


def test_mermaid_text_is_the_charts(tmp_path: Path) -> None:
    chart = gms_element("signed")
    written = render(statechart(chart, 4, names=True), tmp_path / "chart.MMD")
    assert written.read_text(encoding="utf-8") == mermaid(chart)


def test_the_formats_are_named_from_one_table(tmp_path: Path, gms_fsm: CommandLine) -> None:
    with pytest.raises(ParameterError) as caught:
        render(statechart(LUGRE), tmp_path / "x.tex")
    for suffix, each in FORMATS.items():
        assert suffix in str(caught.value)
        assert each.kind in str(caught.value)
    done = gms_fsm("chart", "lugre", "-o", "x.tex")
    assert done.code == 2
    assert ".mmd for Mermaid text" in done.message
    assert all(suffix in gms_fsm("chart", "--help").out for suffix in FORMATS)


@pytest.mark.parametrize(
    "graph", [block_diagram(2), graphviz.Digraph("own")], ids=["blocks", "own"]
)
def test_only_a_chart_is_mermaid_text(graph: graphviz.Digraph, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"must end in \.svg.*\.gv for DOT text$"):
        render(graph, tmp_path / "x.mmd")


# --------------------------------------------------------------------------- the command line


@pytest.mark.parametrize(
    "arguments",
    [
        ("paper", "--force", "sin(", "-o", "p"),
        ("paper", "--velocity", "1 +", "-o", "p"),
        ("animate", "run.npz", "--frames", "1"),
        ("animate", "run.npz", "-o", "film.avi"),
        ("animate", "run.npz", "--start", "9"),
    ],
)
def test_no_bar_before_an_error(arguments: tuple[str, ...], gms_fsm: CommandLine) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    simulate(stick_slip("signed"), Prescribed("0.2"), 1.0).save("run.npz")
    done = gms_fsm(*arguments)
    assert done.code == 2
    assert done.err.startswith("error: "), done.err
    assert done.out == ""


def test_no_bar_of_a_run_that_does_not_begin() -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=80)
    with pytest.raises(OutputError), LiveView(console, 0.0, 1.0, detail=False):
        raise OutputError("cannot make the folder")
    assert screen.getvalue() == ""
    model, rig = pulled_mass()
    with LiveView(console, 0.0, 1.0, detail=False) as view:
        simulate(model, rig, 1.0, progress=view)
    assert "t = 1.0000 s" in screen.getvalue()


# --------------------------------------------------------------------------- values in messages
@pytest.mark.parametrize(
    ("value", "text"),
    [
        (np.float64(20.0), "20.0"),
        (np.int64(3), "3"),
        (np.bool_(True), "True"),
        (np.str_("a"), "'a'"),
        ((np.float64(1.0), 2), "(1.0, 2)"),
        ([np.float32(0.5), (np.float64(1.0),)], "[0.5, (1.0,)]"),
        ({np.str_("k"): np.float64(1.0)}, "{'k': 1.0}"),
        (np.array(2.0), "2.0"),
        (np.array([1.0]), "array([1.])"),
    ],
    ids=repr,
)
def test_numbers_are_shown_as_plain_numbers(value: object, text: str) -> None:
    assert shown(value) == text


def test_messages_of_calls_show_plain_numbers() -> None:
    model = stick_slip("signed")
    trace = simulate(model, Prescribed("0.2"), 3.0)
    late: Any = np.float64(20.0)
    with pytest.raises(ParameterError, match=r"^time 20\.0 s is outside the run, 0\.0 to 3\.0 s$"):
        trace.sample([late])
    for said, call in _calls(trace, late).items():
        with pytest.raises(ValueError, match=said) as caught:
            call()
        assert "np." not in str(caught.value)


def _calls(trace: Trace, late: Any) -> dict[str, Any]:
    session = Session(trace.model, trace.rig, 3.0)
    calls: dict[str, Any] = {
        "frames|t_start is 20.0": lambda: _animate(trace, late),
        "t = -20.0 s is before": lambda: session.goto(-late),
        "name is 20.0": lambda: trace.variable(late),
        "elements is 20.0": lambda: statechart(LUGRE, late),
    }
    try:
        import matplotlib as _  # noqa: F401
    except ImportError:
        del calls["frames|t_start is 20.0"]
        return calls
    from plots import figures, panels

    calls[r"window is \(20.0, 1\)"] = lambda: figures.overview(trace, window=(late, 1))
    calls["around is 20.0"] = lambda: panels.cascade_window(trace, late)
    return calls


def _animate(trace: Trace, late: Any) -> None:
    import plots

    plots.animate(trace, "film.gif", t_start=late)


def test_a_moment_knows_where_the_slider_is() -> None:
    model, rig = pulled_mass()
    moments: list[tuple[float, Any]] = []

    def note(moment: Moment) -> None:
        moments.append((moment.t, moment.values["x"]))

    trace = simulate(model, rig, 10.0, progress=note)
    assert moments
    for t, x in moments:
        assert x in trace.x[trace.t == t].tolist()
    assert moments[-1][1] > 0.0
