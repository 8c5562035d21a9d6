"""A live chart shows a row of the run: active states, edges that could fire, the last firing.

The claim is checked on the SVG that is handed out, against `explain` and the log: one active state
per element, marks on the edges that leave it and on no others, the last edge of the log thick. One
layout serves all frames.
"""

from __future__ import annotations

import math
import re
import shutil
import sys
from functools import cache
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import plots.charts.live_chart
from gms_fsm import Prescribed, Stribeck, Trace, simulate
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import MissingExtraError, OutputError
from gms_fsm.foundation.quantities import scale_of, trimmed
from gms_fsm.session.explain import explain, explain_state, values_at
from gms_fsm.systems.models import ChartModel
from plots.charts.live_chart import LiveChart, live_statechart
from plots.style import CHART_THEMES
from tests.helpers import one_element, open_loop, stick_slip
from tests.plots.charts_to_draw import THREE_STATES
from tests.plots.systems_to_draw import BLOCKS, PULLED
from tests.plots.systems_to_draw import run as system_run

CURVE = Stribeck(1.0, 1.5, 0.05)

Group = ElementTree.Element


@pytest.fixture(autouse=True)
def _graphviz() -> None:
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")


@cache
def run(name: str) -> Trace:
    if name == "bank":
        return simulate(stick_slip("signed"), open_loop(), 45.0)
    if name == "pulled":  # its guards read the force
        return system_run(PULLED)
    if name == "pad2":  # one of two contacts, and the rows are also those of the other's firings
        return system_run(BLOCKS).contact("pad2")
    if name == "wanted times":
        log = run("bank").transitions
        return run("bank").sample(sorted({0.0, *log.t.tolist(), 10.0, 44.0}))
    numbers, n = {"k": 0.5, "v_c": 1e-3, "v_hi": 0.25}, 3 if name == "three states" else 1
    model = ChartModel(THREE_STATES, numbers, n=n, stribeck=CURVE)
    return simulate(model, Prescribed("0.3*sin(2*pi*t/17)"), 40.0)


def groups(svg: str) -> dict[str, Group]:
    root = ElementTree.fromstring(svg.replace(' xmlns="http://www.w3.org/2000/svg"', ""))
    return {group.get("id", ""): group for group in root.iter("g")}


def classes(group: Group) -> set[str]:
    return set(group.get("class", "").split())


def marks(guard: Group) -> list[str]:
    """Return the visible marks of an edge."""
    return [
        text.text or ""
        for text in guard.iter("text")
        if "mark" in classes(text) and text.get("visibility") != "hidden"
    ]


def just_fired(trace: Trace, row: int, element: int) -> str:
    """Replay the log from the time of the row before up to a row."""
    edge, at_once, earlier = "", 0, trace.t[trace.t < trace.t[row]]
    steps = trace.microstep[trace.t == trace.t[row]].any()
    for record in trace.transitions:
        if record.t == trace.t[row]:
            at_once += 1
            if steps and at_once > trace.microstep[row]:
                break
        if record.t > trace.t[row]:
            break
        if record.element == element and record.t > earlier.max(initial=-math.inf):
            edge = str(record.edge)
    return edge


def some_rows(trace: Trace) -> list[int]:
    """Return every row around a firing, and some between."""
    near = {
        row + step
        for row in range(len(trace))
        if trace.microstep[row]
        for step in (-1, 0, 1)
        if row + step < len(trace)
    }
    return sorted({0, len(trace) - 1, *range(0, len(trace), 25), *near})[:100]


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["bank", "three states", "wanted times", "pulled", "pad2"])
def test_the_look_agrees_with_the_log_and_the_svg_shows_it(name: str) -> None:
    trace, chart = run(name), LiveChart(run(name))
    fired_rows = 0
    for row in range(len(trace)):
        for look in chart.look(row):
            fired_rows += assert_explained(trace, row, look)
    assert fired_rows == len(trace.transitions) or name == "wanted times"
    for row in some_rows(trace):
        drawn = groups(chart.frame(row))
        for look in chart.look(row):
            assert_drawn(trace.model.chart, drawn, look)


def assert_explained(trace: Trace, row: int, look: Any) -> int:
    """Compare a look with the log and the explanation; return whether it shows a firing."""
    i, edges = look.element, {edge.name: edge for edge in trace.model.chart.transitions}
    assert look.active == trace.states[row, i]
    assert look.fired == just_fired(trace, row, i)
    assert not look.fired or edges[look.fired].target == look.active
    here = explain_state(trace.model.chart, look.active, values_at(trace, row, i))
    expected = {e.edge.name: tuple(c.holds for c in e.clauses) for e in here}
    assert look.leaving == tuple(expected)
    then = explain(trace, row, i)
    taken = [e for e in then if e.fired]
    if not taken:
        assert expected == {e.edge.name: tuple(c.holds for c in e.clauses) for e in then}
    for e in taken:
        assert e.edge.name == look.fired
        assert e.holds
        expected[look.fired] = tuple(c.holds for c in e.clauses)
    assert look.marks == expected
    return len(taken)


def assert_drawn(chart: Chart, drawn: dict[str, Group], look: Any) -> None:
    """Compare a look with the groups of the picture."""
    colours, element = CHART_THEMES["light"], f"element{look.element + 1}"
    for state in chart.states:
        group = drawn[f"{element}-state-{state.name}"]
        active = state.name == look.active
        assert ("active" in classes(group)) == active
        borders = [s.get("stroke-width") for s in group.iter() if s.get("fill") == "none"]
        assert borders == ["3" if active else "1"]
        (dot,) = (text for text in group.iter("text") if "●" in (text.text or ""))
        assert (dot.get("visibility") == "visible") == active
    for edge in chart.transitions:
        guard = drawn[f"{element}-guard-{edge.name}"]
        line = drawn[f"{element}-edge-{edge.name}"]
        expected = [{True: "✓", False: "✗"}[m] for m in look.marks.get(edge.name, ())]
        assert marks(guard) == expected
        fired, leaving = edge.name == look.fired, edge.name in look.leaving
        pale = not fired and not leaving
        for group in (guard, line):
            assert ("fired" in classes(group)) == fired
            assert ("leaving" in classes(group)) == leaving
        colour = colours.fired if fired else colours.ink if leaving else colours.line
        lines = [shape for shape in line.iter() if shape.get("stroke-width")]
        assert {s.get("stroke") for s in lines} == {colour}
        assert {s.get("stroke-width") for s in lines} == {"2.6" if fired else "1.1"}
        shown = [t for t in guard.iter("text") if t.get("visibility") != "hidden"]
        assert pale == ({t.get("fill") for t in shown} == {colours.soft})


@pytest.mark.slow
def test_one_layout_serves_all_frames_which_depend_on_their_row_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = []
    real = plots.charts.live_chart.picture
    monkeypatch.setattr(
        plots.charts.live_chart, "picture", lambda *each: calls.append(each) or real(*each)
    )
    chart, trace = LiveChart(run("three states")), run("three states")
    rows = range(0, len(trace), 5)
    forward = [chart.frame(row) for row in rows]
    assert forward == [chart.frame(row) for row in reversed(rows)][::-1]
    assert chart.frame(-1) == chart.frame(len(trace) - 1)
    places = {
        tuple((t.get("x"), t.get("y")) for t in groups(svg)["graph0"].iter("text"))
        for svg in forward
    }
    assert len(calls) == len(places) == 1  # texts do not move


def test_values_are_those_of_the_row_and_elements_may_be_chosen() -> None:
    trace = run("bank")
    for row in (50, len(trace) - 1):
        svg = live_statechart(
            trace, row=row, elements=[2, 0], notation="math", theme="dark", values=True
        )
        drawn = groups(svg)
        assert "element2" not in drawn
        assert CHART_THEMES["dark"].active in svg
        for i in (0, 2):
            texts = [t.text or "" for t in drawn[f"element{i + 1}"].findall("text")]
            shown = dict(re.findall(r"(\w+) = (\S+ \S+)", texts[2].replace("\xa0", " ")))
            place, speed = scale_of(np.ravel(trace.z).tolist(), "m"), scale_of(trace.v, "m/s")
            for name, column, scale in (
                ("z", trace.z[:, i], place),
                ("v", trace.v, speed),
                ("s", trace.s[:, i], place),
            ):
                assert shown[name] == trimmed(scale.text(float(column[row]))).replace("-", "−")
        (foot,) = drawn["graph0"].findall("text")
        assert foot.text == f"t = {trace.t[row]:.6g} s"
    one = groups(LiveChart(run("one"), values=True).frame(3))
    texts = [t.text or "" for t in one["graph0"].findall("text")]
    assert [text.split()[0] for text in texts] == ["force", "F", "z", "t"]  # F; z v s, t


def test_at_is_the_last_row_at_or_before_a_time() -> None:
    trace = run("bank")
    chart = LiveChart(trace)
    for row in range(0, len(trace), 3):
        found = chart.at(float(trace.t[row]))
        assert found >= row
        assert trace.t[found] == trace.t[row]
        assert chart.at(min(float(trace.t[row]) + 1e-9, float(trace.t[-1]))) >= found
    assert live_statechart(trace, t=20.0) == live_statechart(trace, row=chart.at(20.0))
    assert LiveChart(trace.sample([30.0, 10.0, 20.0])).at(25.0) == 2


def test_without_graphviz_or_with_unexpected_output_of_it_the_reason_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    real, trace = plots.charts.live_chart.picture, simulate(one_element("signed"), open_loop(), 1.0)

    def other(graph: object, form: str) -> bytes:
        return real(graph, form).replace(b"<text", b"<tspan", 1).replace(b"</text", b"</tspan", 1)

    with monkeypatch.context() as patch:
        patch.setattr(plots.charts.live_chart, "picture", other)
        with pytest.raises(OutputError, match="cannot be used for live charts"):
            LiveChart(trace)
    monkeypatch.setattr(sys.modules["plots.output.graphviz"], "drawn", lambda *_: None)
    with pytest.raises(
        MissingExtraError, match=r"Graphviz, .* pip install .*\[render\].* program dot"
    ):
        LiveChart(trace)


def test_a_guard_that_cannot_be_computed_is_marked() -> None:
    chart = Chart(
        "division",
        inputs=("v",),
        variables=("z",),
        states=(State("a", flow={"z": "1"}), State("b", flow={"z": "0"})),
        transitions=(Transition("ab", "a", "b", guard="z > 9 and 1 / v > 2"),),
        outputs={"F": "z"},
    )
    trace = simulate(ChartModel(chart, {}, n=1, stribeck=CURVE), Prescribed("1"), 1.0)
    shown = LiveChart(trace)
    assert shown.look(0)[0].marks == {"ab": (False, False)}
    trace.__dict__["seen"] = {**trace.seen, "friction.v": 0.0 * trace.v}  # a cached property
    assert shown.look(0)[0].marks == {"ab": (False, None)}
    assert marks(groups(shown.frame(0))["element1-guard-ab"]) == ["✗", "?"]


def test_a_still_picture_keeps_no_room_for_marks_that_are_not_shown() -> None:
    trace = run("bank")
    texts = groups(live_statechart(trace, t=20.0, elements=[0]))["element1-guard-arrest"]
    for line in {each.get("y") for each in texts.findall("text")}:
        every = [each for each in texts.findall("text") if each.get("y") == line]
        shown = [each for each in every if each.get("visibility") != "hidden"]
        for one, other in pairwise(shown):
            wide = 6.0 * len(one.text or "")  # a cell of the monospaced font at 10 points
            apart = float(other.get("x", 0)) - float(one.get("x", 0))
            assert apart == pytest.approx(wide, abs=1.0)
