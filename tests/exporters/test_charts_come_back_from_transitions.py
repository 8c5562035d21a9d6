"""A chart written as a transitions file, and imported from its machine, is equal to the chart.

What a machine has beyond a chart is refused by name.
"""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from transitions import Machine, State
from transitions.extensions import HierarchicalMachine
from transitions.extensions.asyncio import AsyncMachine
from transitions.extensions.states import Timeout, add_state_features

from gms_fsm import Chart, export
from gms_fsm.charts import CHARTS
from gms_fsm.errors import ChartError, ExpressionError
from tests.exporters.charts_to_export import MODELS, imported, rebuilt
from tests.strategies import charts


@pytest.mark.parametrize("name", MODELS)
def test_every_included_chart(name: str, tmp_path: Path) -> None:
    path, *_ = export(CHARTS[name], "transitions", tmp_path, name="file")
    file = imported(path)
    again = rebuilt(file, file.machine_of([]))
    assert again == CHARTS[name]
    assert again.guards == CHARTS[name].guards


@pytest.mark.slow
@given(chart=charts(locks=False))
@settings(max_examples=25, deadline=None)
def test_any_chart(chart: Chart, tmp_path_factory: pytest.TempPathFactory) -> None:
    path, *_ = export(chart, "transitions", tmp_path_factory.mktemp("chart"), name="file")
    file = imported(path)
    assert rebuilt(file, file.machine_of([])) == chart


def machine_like(chart: Chart) -> Machine:
    """Return a machine with the states and edges of any chart, without conditions."""
    edges = {edge.name: edge for edge in chart.transitions}
    return Machine(
        states=[state.name for state in chart.states],
        transitions=[[edge.name, [*edge.sources], edge.target] for edge in edges.values()],
        initial=chart.default_state.name,
    )


def texts_of(chart: Chart) -> dict[str, Any]:
    """Return what `Chart.from_transitions` takes beside the machine."""
    names = ("name", "reference", "inputs", "velocities", "parameters", "let", "outputs")
    return {
        **{name: getattr(chart, name) for name in (*names, "contact_outputs")},
        "variables": [name for name in chart.variables if name != "age"],
        "flows": {state.name: state.flow for state in chart.states},
        "entry": {state.name: state.entry for state in chart.states},
        "exit": {state.name: state.exit for state in chart.states},
        "state_outputs": {state.name: state.outputs for state in chart.states},
        "locked": [state.name for state in chart.states if state.locked],
        "impulses": [edge.name for edge in chart.transitions if edge.impulse],
        "guards": {edge.name: edge.guard for edge in chart.transitions},
        "actions": {edge.name: edge.actions for edge in chart.transitions},
    }


@pytest.mark.parametrize("name", CHARTS)
def test_machines_built_by_hand_also_with_locks(name: str) -> None:
    chart = CHARTS[name]
    assert Chart.from_transitions(machine_like(chart), **texts_of(chart)) == chart


@pytest.mark.slow
@given(chart=charts())
@settings(max_examples=25, deadline=None)
def test_any_machine_also_with_locks(chart: Chart) -> None:
    assert Chart.from_transitions(machine_like(chart), **texts_of(chart)) == chart


# --------------------------------------------------------------------------- machines of users
def small(**more: Any) -> Machine:
    given: dict[str, Any] = {
        "states": ["stick", "slip"],
        "initial": "stick",
        "transitions": [["slips", "stick", "slip"], ["sticks", "slip", "stick"]],
    }
    return Machine(**{**given, **more})


TEXTS: dict[str, Any] = {"outputs": {"F": "v"}, "guards": {"slips": "v > 1", "sticks": "v < 1"}}


def test_the_initial_state_comes_first_and_names_are_found() -> None:
    chart = Chart.from_transitions(small(initial="slip", name="own"), **TEXTS)
    assert [state.name for state in chart.states] == ["slip", "stick"]
    assert chart.name == "imported chart"
    assert [edge.name for edge in chart.transitions] == ["slips", "sticks"]


def test_states_of_an_enumeration_and_wildcards() -> None:
    class Own(enum.Enum):
        stick = 1
        slip = 2

    machine = Machine(
        states=Own,
        initial=Own.stick,
        transitions=[["slips", "*", Own.slip], ["sticks", Own.slip, Own.stick]],
    )
    chart = Chart.from_transitions(machine, **TEXTS)
    assert chart.transitions[0].sources == ("stick", "slip")


def test_a_text_stands_for_a_condition() -> None:
    machine = small(transitions=[{"trigger": "slips", "source": "stick", "dest": "slip",
                                  "conditions": "is_fast"}])  # fmt: skip
    chart = Chart.from_transitions(machine, outputs={"F": "v"}, guards={"slips": "v > 1"})
    assert chart.guard_text("slips") == "v > 1"
    with pytest.raises(ChartError, match=r"trigger 'slips': no guard is given for it; give one"):
        Chart.from_transitions(machine, outputs={"F": "v"})


def row(**more: Any) -> list[Any]:
    return [{"trigger": "slips", "source": "stick", "dest": "slip", **more}]


@add_state_features(Timeout)
class Timed(Machine):  # type: ignore[misc]
    """A machine whose states can end by themselves."""


class Watching:
    """A model whose method transitions calls by its name."""

    def on_enter_slip(self) -> None:
        """Do nothing."""


@pytest.mark.parametrize(
    ("machine", "said"),
    [
        ("a machine", "machine is 'a machine'; it must be a transitions.Machine"),
        (
            HierarchicalMachine(states=["a"], initial="a"),
            "a HierarchicalMachine has no counterpart",
        ),
        (AsyncMachine(states=["a"], initial="a"), "an? AsyncMachine has no counterpart"),
        (small(queued=True), "queued=True has no counterpart"),
        *(
            (small(**{each: "look"}), f"its callback {each} 'look'")
            for each in (
                "before_state_change",
                "after_state_change",
                "prepare_event",
                "finalize_event",
                "on_exception",
                "on_final",
            )
        ),
        (small(initial=None, model=None), "it has no initial state"),
        *(
            (
                small(states=["stick", State("slip", **{f"on_{each}": "look"})]),
                f"state 'slip': its callback on_{each} 'look'",
            )
            for each in ("enter", "exit")
        ),
        (small(model=Watching()), "state 'slip': its callback on_enter 'on_enter_slip'"),
        (small(states=["stick", State("slip", final=True)]), "state 'slip': a final state"),
        (
            Timed(states=["a", {"name": "b", "timeout": 2, "on_timeout": "x"}], initial="a"),
            r"state 'b': its timeout of 2 s has no counterpart.*after\(T\)",
        ),
        (small(transitions=row(unless="is_slow")), "trigger 'slips': unless has no counterpart"),
        *(
            (small(transitions=row(**{e: "look"})), f"trigger 'slips': its callback {e} 'look'")
            for e in ("before", "after", "prepare")
        ),
        (small(transitions=row(dest=None)), "its internal transition in 'stick'"),
        (
            small(transitions=[["go", "stick", "slip"], ["go", "slip", "stick"]]),
            r"trigger 'go': it stands for several edges \(stick -> slip, slip -> stick\)",
        ),
        (
            small(transitions=[["go", "stick", "slip"], ["go", "stick", "slip"]]),
            "trigger 'go': it stands for several edges",
        ),
    ],
    ids=lambda each: None if isinstance(each, str) else type(each).__name__,
)
def test_what_has_no_counterpart_is_named(machine: Any, said: str) -> None:
    with pytest.raises(ChartError, match=said):
        Chart.from_transitions(machine, **TEXTS)


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        ({"gards": {}}, "there is no argument 'gards'; there are name, reference"),
        ({"guards": {"slip": "v > 1"}}, "guards: there is no edge 'slip'; there are 'slips'"),
        ({"guards": "v > 1"}, "guards is 'v > 1'; it gives a text for each name"),
        ({"actions": {"x": {}}}, "actions: there is no edge 'x'"),
        ({"actions": [1]}, r"actions is \[1\]; it gives texts for each edge"),
        ({"flows": {"stuck": {}}}, "flows: there is no state 'stuck'; there are 'stick', 'slip'"),
        ({"entry": 3}, "entry is 3; it gives texts for each state"),
        ({"locked": "stick"}, "locked is 'stick'; give a tuple"),
        ({"locked": ["stuck"]}, "locked: there is no state 'stuck'"),
        ({"parameters": "k"}, "parameters is 'k'; give a tuple"),
        ({"parameters": [{"unit": "N"}]}, "a parameter has no name"),
        ({"parameters": [{"name": "k", "size": 1}]}, "a parameter has unknown fields size"),
        ({"outputs": {}}, "no output 'F'"),
    ],
)
def test_wrong_texts_are_named(texts: dict[str, Any], said: str) -> None:
    with pytest.raises(ChartError, match=said):
        Chart.from_transitions(small(), **{**TEXTS, **texts})


def test_texts_are_parsed_as_those_of_any_chart() -> None:
    with pytest.raises(ExpressionError, match="edge 'slips', guard"):
        Chart.from_transitions(
            small(), outputs={"F": "v"}, guards={"slips": "w > 1", "sticks": "True"}
        )
