"""A chart written as SCXML, or for transitions, and read again is equal to the chart.

Documents and machines of other people are read with the texts given beside them; what has no
counterpart in a chart is in tests/refusals.py.
"""

from __future__ import annotations

import enum
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from transitions import Machine
from transitions import State as MachineState
from transitions.extensions import HierarchicalMachine, LockedMachine
from transitions.extensions.markup import MarkupMachine
from transitions.extensions.states import Timeout, add_state_features

from gms_fsm import Chart, ChartModel, Prescribed, State, Transition, export, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.charts.files.from_scxml import _read_back
from gms_fsm.errors import ChartError
from tests.corpus import LIGHT
from tests.exporters.charts_to_export import (
    FOREIGN,
    MODELS,
    TEXTS,
    edited_export,
    foreign,
    imported,
    model,
    of_states,
    one_edge,
    rebuilt,
    small,
)
from tests.exporters.nested_charts import made
from tests.strategies import charts


def back(chart: Chart, form: str, folder: Path) -> Chart:
    """Return what is read from a file."""
    path, *_ = export(chart, form, folder, name="file")
    if form == "scxml":
        return Chart.from_scxml(path)
    file = imported(path)
    return rebuilt(file, file.machine_of([]))


@pytest.mark.slow
@pytest.mark.parametrize("form", ["scxml", "transitions"])
def test_every_included_chart(form: str, tmp_path: Path) -> None:
    for name in MODELS:
        if form == "transitions" or name != "backlash":  # its guards read F
            again = back(CHARTS[name], form, tmp_path / name)
            assert again == CHARTS[name], name
            assert again.guards == CHARTS[name].guards, name


@pytest.mark.slow
@given(chart=charts(locks=False, forces=(), plain=True))
@settings(max_examples=25, deadline=None)
def test_any_chart_from_scxml(chart: Chart, tmp_path_factory: pytest.TempPathFactory) -> None:
    assert back(chart, "scxml", tmp_path_factory.mktemp("chart")) == chart


@pytest.mark.slow
@given(chart=charts(locks=False))
@settings(max_examples=25, deadline=None)
def test_any_chart_from_transitions(chart: Chart, tmp_path_factory: pytest.TempPathFactory) -> None:
    assert back(chart, "transitions", tmp_path_factory.mktemp("chart")) == chart


@pytest.mark.slow
@given(chart=charts())
@settings(max_examples=25, deadline=None)
def test_any_machine_also_with_locks(chart: Chart) -> None:
    """A machine with the states and edges of any chart, without conditions."""
    edges = {edge.name: [edge.name, [*edge.sources], edge.target] for edge in chart.transitions}
    machine = Machine(
        states=[state.name for state in chart.states],
        transitions=[*edges.values()],
        initial=chart.default_state.name,
    )
    names = ("name", "reference", "inputs", "velocities", "parameters", "let", "outputs")
    again = Chart.from_transitions(
        machine,
        **{name: getattr(chart, name) for name in (*names, "contact_outputs")},
        variables=[name for name in chart.variables if name != "age"],
        flows={state.name: state.flow for state in chart.states},
        entry={state.name: state.entry for state in chart.states},
        exit={state.name: state.exit for state in chart.states},
        state_outputs={state.name: state.outputs for state in chart.states},
        locked=[state.name for state in chart.states if state.locked],
        initial=chart.initial,
        impulses=[edge.name for edge in chart.transitions if edge.impulse],
        guards={edge.name: edge.guard for edge in chart.transitions},
        actions={edge.name: edge.actions for edge in chart.transitions},
    )
    assert again == chart


def test_the_documents_of_a_models_elements(tmp_path: Path) -> None:
    paths = export(model("gms-signed"), "scxml", tmp_path, name="gms")
    assert [path.name for path in paths[:4]] == [f"gms_{i}.scxml" for i in (1, 2, 3, 4)]
    assert all(Chart.from_scxml(path) == CHARTS["gms-signed"] for path in paths[:4])
    assert '<data id="sigma" expr="0.6" />' in paths[3].read_text(encoding="utf-8")


# --------------------------------------------------------------------------- SCXML of others
def test_a_document_of_another_tool(tmp_path: Path) -> None:
    assert foreign(folder=tmp_path) == Chart(
        "own",
        variables=("z",),
        states=(State("stick", flow={"z": "v"}), State("slip", entry={"z": "min(z, 1)"})),
        transitions=(
            Transition("slips", "stick", "slip", "z > 1 and sgn(v) > 0", {"z": "-abs(z)"}),
            Transition("stick_slip", "stick", "slip", "z < -1"),
            Transition("stick_slip_2", "stick", "slip", "True"),
            Transition("sticks", "slip", "stick", "not (v >= 1 or z > 9)"),
        ),
        outputs={"F": "z"},
    )


def test_texts_beside_go_before_those_of_the_document(tmp_path: Path) -> None:
    texts: Any = {"guards": {"slips": "z > 3"}, "actions": {"slips": {}}}
    chart = foreign(folder=tmp_path, name="mine", entry={"slip": {"z": "2"}}, **texts)
    assert chart.name == "mine"
    assert chart.guard_text("slips") == "z > 3"
    assert chart.guard_text("sticks") == "!(v >= 1 || z > 9)"
    assert not chart.transitions[0].actions
    assert chart.states[1].entry == {"z": "2"}
    given = '<data id="z" expr="Math.random()"/>'
    assert foreign('<data id="z" expr="0"/>', given, tmp_path, initial={"z": 2.0}).initial == {
        "z": 2
    }


def test_one_event_for_one_edge_that_leaves_several_states(tmp_path: Path) -> None:
    edge = '<transition event="slips" cond="v &lt; 9" target="stick"/>'
    text = re.sub(r'<transition event="slips".*?</transition>', edge, FOREIGN, flags=re.DOTALL)
    (tmp_path / "a.scxml").write_text(text.replace("</onentry>", f"</onentry>{edge}"))
    chart = Chart.from_scxml(tmp_path / "a.scxml", variables=("z",), outputs={"F": "z"})
    assert {edge.name: edge.sources for edge in chart.transitions}["slips"] == ("stick", "slip")


ORDINARY = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" initial="lamp.red" datamodel="ecmascript">
  <datamodel>
    <data id="count" expr="3"/><data id="limit" expr="2 * count"/><data id="share">0.5</data>
  </datamodel>
  <state id="lamp.red">
    <onentry><log label="red" expr="count"/></onentry>
    <transition event="timer.fast timer.slow" target="lamp-green"/>
    <transition event="tick" cond="count &lt; limit &amp;&amp; v &gt; share">
      <assign location="count" expr="count + 1"/>
    </transition>
  </state>
  <state id="lamp-green"><transition event="off.*" target="end"/></state>
  <final id="end"/>
</scxml>
"""


def test_a_log_is_named_once_and_names_may_come_from_a_generator(tmp_path: Path) -> None:
    inside = '<state id="held"><onentry><log/></onentry></state>'
    given = {"inputs": iter("v"), "parameters": iter("k"), "outputs": {"F": "k * v"}}
    with pytest.warns(UserWarning, match="a chart writes nothing: state 'held', onentry$"):
        chart = of_states(f'<state id="out">{inside}</state>', tmp_path, **given)
    assert (chart.inputs, chart.parameter_names) == (("v",), ("k",))


def test_an_ordinary_document(tmp_path: Path) -> None:
    """Several events, dotted names, data, a final state, a log, a transition without target."""
    (tmp_path / "own.scxml").write_text(ORDINARY, encoding="utf-8")
    guards = {"timer__fast": "v > 4", "timer__slow": "v > 3", "off": "v < 0"}
    with pytest.warns(UserWarning, match="<log> is left out.*: state 'lamp.red', onentry"):
        chart = Chart.from_scxml(tmp_path / "own.scxml", outputs={"F": "0"}, guards=guards)
    assert chart == Chart(
        "imported chart",
        variables=("count",),
        states=(State("lamp__red"), State("lamp_green"), State("end")),
        transitions=(
            Transition("timer__fast", "lamp__red", "lamp_green", "v > 4"),
            Transition("timer__slow", "lamp__red", "lamp_green", "v > 3"),
            Transition(
                "tick",
                "lamp__red",
                "lamp__red",
                "count < limit and v > share",
                {"count": "count + 1"},
            ),
            Transition("off", "lamp_green", "end", "v < 0"),
        ),
        outputs={"F": "0"},
        let={"limit": "6.0", "share": "0.5"},
        initial={"count": 3.0},
    )


def test_a_state_that_is_done_is_left_from_its_final_state(tmp_path: Path) -> None:
    states = """<state id="work">
      <state id="work.busy"><transition cond="v &gt; 1" target="work.idle"/></state>
      <final id="work.idle"/>
      <transition event="done.state.work" target="rest"/></state><state id="rest"/>"""
    chart = of_states(states, tmp_path)
    edges = {(edge.source, edge.target, edge.guard) for edge in chart.transitions}
    assert edges == {("work.busy", "work.idle", "v > 1"), ("work.idle", "rest", "True")}


def test_an_event_that_a_state_sends_itself_later_is_the_time_in_it(tmp_path: Path) -> None:
    def state(name: str, delay: str, target: str, more: str = "") -> str:
        sent = f'<onentry><send event="timeout" delay="{delay}"/></onentry>'
        edge = f'<transition event="timeout" target="{target}"/>'
        return f'<state id="{name}">{sent}{edge}{more}</state>'

    stopped = '<onexit><cancel sendid="timeout"/></onexit><transition cond="v>9" target="green"/>'
    states = state("green", "30s", "yellow") + state("yellow", "500ms", "red")
    states += state("red", "1.5s", "green", stopped)
    chart = of_states(states, tmp_path)
    edges = [(edge.source, edge.target, edge.guard) for edge in chart.transitions]
    assert edges == [
        ("green", "yellow", "after(30)"),
        ("yellow", "red", "after(0.5)"),
        ("red", "green", "after(1.5)"),
        ("red", "green", "v>9"),
    ]


def test_what_outer_states_assign_at_the_start_are_initial_values(tmp_path: Path) -> None:
    outer = '<onentry><assign location="n" expr="n + 1"/></onentry>'
    inner = '<onentry><assign location="n" expr="2 * n"/></onentry>'
    text = f"""<datamodel><data id="n" expr="3"/></datamodel>
      <state id="a">{outer}<state id="b">{inner}</state></state>"""
    chart = of_states(text, tmp_path, outputs={"F": "n"})
    assert simulate(ChartModel(chart, {}), Prescribed("0"), 0.1).F[0] == 8
    text = text.replace("n + 1", "v")
    chart = of_states(text, tmp_path, outputs={"F": "n"})
    assert simulate(ChartModel(chart, {}), Prescribed("2"), 0.1).F[0] == 4
    internal = '<transition type="internal" cond="v &gt; 5" target="b"/><state id="b">'
    text = text.replace('<state id="b">', internal)  # which makes the states flat
    with pytest.raises(ChartError, match="at the start its entry assigns 'v' to 'n', which is no"):
        of_states(text, tmp_path, outputs={"F": "n"})


def test_words_of_ecmascript() -> None:
    assert _read_back("v > 1 || Math.PI === v && n !== 2") == "v > 1 or pi == v and n != 2"


def test_one_event_is_two_edges_where_one_would_change_the_priority(tmp_path: Path) -> None:
    go = '<transition event="go" cond="v > 1" target="c"/>'
    turn = '<transition event="turn" cond="v > 2" target="d"/>'
    rest = '<state id="c"/><state id="d"/>'
    text = f'<state id="a">{go}{turn}</state><state id="b">{turn}{go}</state>{rest}'
    chart = of_states(text, tmp_path)
    first = {state: chart.leaving(state)[0][1].target for state in ("a", "b")}
    assert first == {"a": "c", "b": "d"}
    assert {edge.name for edge in chart.transitions} == {"turn", "a_c", "b_c"}


def test_a_change_on_purpose(tmp_path: Path) -> None:
    path = edited_export('cond="v &lt; 0.0"', 'cond="v &lt; -1.0"', tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(re.sub(r' gms:guard="v &lt; 0"', "", text), encoding="utf-8")
    assert Chart.from_scxml(path).guard_text("arrest_forward") == "v < -1"
    again = Chart.from_scxml(path, guards={"arrest_forward": "v < -2"})
    assert again.guard_text("arrest_forward") == "v < -2"


# --------------------------------------------------------------------------- machines of others
def test_the_initial_state_comes_first_and_names_are_found() -> None:
    chart = Chart.from_transitions(small(initial="slip", name="own"), **TEXTS)
    assert [state.name for state in chart.states] == ["slip", "stick"]
    assert chart.name == "imported chart"
    assert [edge.name for edge in chart.transitions] == ["slips", "sticks"]


def test_states_of_an_enumeration_and_wildcards() -> None:
    Own = enum.Enum("Own", ["stick", "slip"])
    edges = [["slips", "*", Own.slip], ["sticks", Own.slip, Own.stick]]
    chart = Chart.from_transitions(
        Machine(states=Own, initial=Own.stick, transitions=edges), **TEXTS
    )
    assert chart.transitions[0].sources == ("stick", "slip")


def test_a_text_stands_for_a_condition() -> None:
    machine = one_edge(conditions="is_fast")
    chart = Chart.from_transitions(machine, outputs={"F": "v"}, guards={"slips": "v > 1"})
    assert chart.guard_text("slips") == "v > 1"


def test_one_trigger_with_several_edges_whose_conditions_decide_in_order() -> None:
    machine = Machine(states=["a", "b", "c"], initial="a", auto_transitions=False)
    machine.add_transition("go", "a", "b", conditions=["is_hot", "is_big"], unless="is_still")
    machine.add_transition("go", "a", "c", after="count")
    machine.add_transition("go", ["b", "c"], "=", before="count")
    callbacks: Any = {"is_hot": "T > 80", "is_big": "n > 3 or n < -3", "is_still": "v < 1"}
    chart = Chart.from_transitions(
        machine,
        inputs=("v", "T"),
        variables=("n",),
        outputs={"F": "0"},
        guards={"go": "v > 2", "c_c": "v > 3"},
        callbacks={**callbacks, "count": {"n": "n + 1"}},
    )
    hot = "v > 2 and (T > 80 and (n > 3 or n < -3) and not (v < 1))"
    assert chart.transitions == (
        Transition("a_b", "a", "b", hot),
        Transition("a_c", "a", "c", "v > 2", {"n": "n + 1"}),
        Transition("b_b", "b", "b", "v > 2", {"n": "n + 1"}),
        Transition("c_c", "c", "c", "v > 3", {"n": "n + 1"}),
    )


@pytest.mark.parametrize("kind", [Machine, LockedMachine, MarkupMachine, HierarchicalMachine])
def test_ordered_transitions_of_any_class_of_machines(kind: Any) -> None:
    machine = kind(states=["green", "yellow", "red"], initial="green", queued=True)
    machine.add_ordered_transitions()
    chart = Chart.from_transitions(machine, outputs={"F": "0"}, guards={"next_state": "after(3)"})
    edges = [(edge.source, edge.target, edge.guard) for edge in chart.transitions]
    assert edges == [(*ends, "after(3)") for ends in
                     (("green", "yellow"), ("yellow", "red"), ("red", "green"))]  # fmt: skip


@pytest.mark.parametrize(("place", "way"), [("before", "on_exit"), ("after", "on_enter")])
def test_actions_around_those_of_the_states_are_refused(place: str, way: str) -> None:
    states = [MachineState("a", **{way: "move"}), MachineState("b", **{way: "move"})]
    edge = {"trigger": "go", "source": "a", "dest": "b", place: "count"}
    machine = Machine(states=states, initial="a", transitions=[edge])
    texts: Any = {"variables": ("m", "n"), "outputs": {"F": "0"}, "guards": {"go": "v > 1"}}
    texts["callbacks"] = {"move": {"m": "1"}, "count": {"n": "n + 1"}}
    with pytest.raises(ChartError, match=f"what it assigns {place} the states change cannot be"):
        Chart.from_transitions(machine, **texts)
    texts["callbacks"] |= {"move": {}}
    assert Chart.from_transitions(machine, **texts).transitions[0].actions == {"n": "n + 1"}


def test_conditions_that_differ_are_not_one_guard() -> None:
    machine = Machine(states=["a", "b"], initial="a", auto_transitions=False)
    machine.add_transition("go", "a", "b", conditions="is_hot")
    machine.add_transition("go", "b", "b", conditions="is_big")
    with pytest.raises(ChartError, match=r"condition 'is_hot'; .*and for 'b_b'"):
        Chart.from_transitions(machine, outputs={"F": "0"}, guards={"go": "v > 1"})


def test_the_time_in_a_state_with_states_inside_goes_on_or_is_refused() -> None:
    slip = {"name": "slip", "children": ["b", "c"], "initial": "b"}
    edges = [["slips", "stick", "slip"], ["sticks", "slip", "stick"]]
    machine = HierarchicalMachine(states=["stick", slip], initial="stick", transitions=edges)
    texts: Any = {"outputs": {"F": "0"}, "guards": {"slips": "after(1)", "sticks": "v < 1"}}
    assert "age" in Chart.from_transitions(machine, **texts).variables
    texts["guards"] |= {"sticks": "after(2)"}
    assert "slip__age" in Chart.from_transitions(machine, **texts).variables
    edges.append(["again", "slip", "slip_b"])  # does not leave slip, which makes the states flat
    machine = HierarchicalMachine(states=["stick", slip], initial="stick", transitions=edges)
    texts["guards"] |= {"again": "v > 2"}
    with pytest.raises(ChartError, match="'sticks': its guard reads the time in 'slip', which has"):
        Chart.from_transitions(machine, **texts)


@add_state_features(Timeout)
class Timed(Machine):  # type: ignore[misc]
    """A machine whose states can end by themselves."""


def test_a_timeout_that_triggers_an_edge_is_the_time_in_its_state() -> None:
    states = ["off", {"name": "on", "timeout": 2.5, "on_timeout": "expire"}]
    machine = Timed(states=states, initial="off", auto_transitions=False)
    machine.add_transition("start", "off", "on")
    machine.add_transition("expire", "on", "off")
    chart = Chart.from_transitions(machine, outputs={"F": "0"}, guards={"start": "v > 1"})
    edges = [(edge.name, edge.source, edge.guard) for edge in chart.transitions]
    assert edges == [("start", "off", "v > 1"), ("expire", "on", "after(2.5)")]


def test_callbacks_are_a_table_of_actions() -> None:
    states = [MachineState("a", on_exit="leave"), MachineState("b", on_enter=["enter", print])]
    machine = Machine(
        states=states,
        initial="a",
        transitions=[["go", "a", "b"], {"trigger": "again", "source": "b", "dest": None,
                                        "after": "count"}],
        prepare_event="look",
    )  # fmt: skip
    callbacks: Any = {"leave": {"n": "0"}, "enter": {"m": "1"}, "print": {}, "look": {}}
    texts: Any = {"variables": ("n", "m"), "outputs": {"F": "0"}}
    texts["guards"] = {"go": "v > 1", "again": "v > 2"}
    with pytest.raises(ChartError, match="'again': it leaves nothing, but a chart performs exit"):
        Chart.from_transitions(machine, callbacks={**callbacks, "count": {"n": "n + 1"}}, **texts)
    machine.states["b"].on_enter.clear()
    left = {name: callbacks[name] for name in ("leave", "look")}
    chart = Chart.from_transitions(machine, callbacks={**left, "count": {"n": "n + 1"}}, **texts)
    assert chart.states[0].exit == {"n": "0"}
    assert chart.transitions[1] == Transition("again", "b", "b", "v > 2", {"n": "n + 1"})


def test_states_in_states_stay_nested_with_texts_by_names_of_two_underscores() -> None:
    slip = {"name": "slip", "children": ["forward", "backward"], "initial": "forward",
            "on_enter": "begin", "on_exit": "end"}  # fmt: skip
    edges = [["slips", "stick", "slip"], ["turns", "slip_forward", "slip_backward"],
             ["sticks", "slip", "stick"]]  # fmt: skip
    machine = HierarchicalMachine(states=["stick", slip], initial="stick", transitions=edges)
    chart = Chart.from_transitions(
        machine,
        variables=("n", "z"),
        outputs={"F": "z"},
        flows={"slip": {"z": "v", "n": "1"}, "slip__backward": {"z": "-v"}},
        guards={"slips": "v > 1", "turns": "v < 0", "sticks": "n > 3"},
        callbacks={"begin": {"n": "0"}, "end": {"z": "0"}},
    )
    inside = (State("forward"), State("backward", flow={"z": "-v"}))
    outer: Any = {"flow": {"z": "v", "n": "1"}, "entry": {"n": "0"}, "exit": {"z": "0"}}
    assert chart == Chart(
        "imported chart",
        variables=("n", "z"),
        states=(State("stick"), State("slip", **outer, states=inside)),
        transitions=(
            Transition("slips", "stick", "slip", "v > 1"),
            Transition("turns", "slip.forward", "slip.backward", "v < 0"),
            Transition("sticks", "slip", "stick", "n > 3"),
        ),
        outputs={"F": "z"},
    )


def test_nested_charts_come_back_from_scxml_with_their_histories(tmp_path: Path) -> None:
    for k, chart in enumerate([LIGHT.chart, *(made(seed).chart for seed in range(12))]):
        assert back(chart, "scxml", tmp_path / str(k)) == chart, chart.name


def test_a_nested_chart_comes_back_from_transitions(tmp_path: Path) -> None:
    inside = State("stick"), State("slip", {"z": "0"}, entry={"z": "z / 2"})
    chart = Chart(
        "brake",
        variables=("z",),
        states=(State("open"), State("closed", {"z": "v"}, exit={"z": "0"}, states=inside)),
        transitions=(
            Transition("close", "open", "closed", "v > 0"),
            Transition("release", "closed", "open", "after(2) or v < -1"),
            Transition("slips", "closed.stick", "closed.slip", "abs(z) > 1"),
            Transition("sticks", "closed.slip", "closed.stick", "z * v < 0"),
        ),
        outputs={"F": "z"},
    )
    assert back(chart, "transitions", tmp_path) == chart
