"""The counts on a chart are those of the run: dwell times, firings, and what never happened."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.app.report import dwell_times
from gms_fsm.charts import LUGRE
from gms_fsm.errors import ParameterError
from gms_fsm.systems.models import ChartModel
from plots._labels import Tally
from plots.render import render
from plots.statechart import statechart
from tests.helpers import one_element, open_loop, stick_slip
from tests.plots.test_statechart_shows_the_whole_chart import SVG, THREE_STATES

CURVE = one_element("signed").stribeck
RUNS = {
    "bank": (stick_slip("signed"), open_loop(), 45.0),
    "bank, one way": (stick_slip("signed"), Prescribed("0.2"), 9.0),
    "one": (one_element("published"), open_loop(), 45.0),
    "three states": (
        ChartModel(THREE_STATES, {"k": 0.5, "v_c": 1e-3, "v_hi": 0.25}, n=3, stribeck=CURVE),
        Prescribed("0.3*sin(2*pi*t/17)"),
        40.0,
    ),
}


def drawn(trace: Trace, elements: object, folder: Path) -> dict[str, ElementTree.Element]:
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")
    graph = statechart(trace.model.chart, elements, counts=trace)  # type: ignore[arg-type]
    svg = ElementTree.parse(render(graph, folder / "chart.svg"))
    return {group.get("id", ""): group for group in svg.iter(SVG + "g")}


def last_text(group: ElementTree.Element) -> str:
    return (group.findall(SVG + "text")[-1].text or "").replace("\xa0", " ")


@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("direction", ["all", "the last"])
def test_counts_are_those_of_the_run(name: str, direction: str, tmp_path: Path) -> None:
    trace = simulate(*RUNS[name])
    numbers = list(range(trace.n)) if direction == "all" else [trace.n - 1]
    shown = drawn(trace, trace.n if direction == "all" else numbers, tmp_path)
    dwell, log = dwell_times(trace), trace.transitions
    for i in numbers:
        for column, state in enumerate(trace.model.chart.states):
            text = last_text(shown[f"element{i + 1}-state-{state.name}"])
            found = re.fullmatch(r"active (\S+) s \((\d+) %\)", text)
            assert found
            assert float(found[1]) == pytest.approx(dwell[i, column], rel=1e-3)
            assert float(found[2]) == pytest.approx(100 * dwell[i, column] / dwell[i].sum(), abs=1)
        for edge in trace.model.chart.transitions:
            count = int(((log.element == i) & (log.edge == edge.name)).sum())
            text = last_text(shown[f"element{i + 1}-guard-{edge.name}"])
            said = {0: "never taken", 1: "taken once"}.get(count, f"taken {count} times")
            assert text == said
            for half in (1, 2):
                (line,) = shown[f"element{i + 1}-edge-{edge.name}-{half}"].findall(SVG + "path")
                assert (line.get("stroke-dasharray") is not None) == (count == 0)


@pytest.mark.parametrize("name", RUNS)
def test_the_counts_equal_those_of_the_report(name: str) -> None:
    trace = simulate(*RUNS[name])
    np.testing.assert_allclose(Tally(trace).dwell, dwell_times(trace), rtol=1e-12, atol=1e-12)
    some = trace.sample([trace.t[-1] / 2, trace.t[-1] / 3])  # the log is complete all the same
    np.testing.assert_allclose(Tally(some).dwell, dwell_times(trace), rtol=1e-12, atol=1e-12)


def test_a_chart_without_counts_has_none() -> None:
    source = statechart(THREE_STATES, 2).source
    assert "taken" not in source
    assert "active" not in source


def test_one_of_several_elements_is_named_and_a_single_one_is_not(tmp_path: Path) -> None:
    assert "element1" in drawn(simulate(*RUNS["bank"]), 1, tmp_path)
    assert "element1" not in drawn(simulate(*RUNS["one"]), 1, tmp_path)


def test_another_chart_and_missing_elements_are_rejected() -> None:
    trace = simulate(*RUNS["bank, one way"])
    with pytest.raises(ParameterError, match="counts is a run of the chart 'GMS element, signed"):
        statechart(LUGRE, counts=trace)
    with pytest.raises(ParameterError, match=r"elements is 5; .*the run has 4, counted from 0"):
        statechart(trace.model.chart, 5, counts=trace)
