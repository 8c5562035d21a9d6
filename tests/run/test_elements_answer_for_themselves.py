"""An element's machine has its own index, parameters and values, and tests edges in order."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from gms_fsm import ChartModel, Prescribed, Stribeck, simulate
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import ChartError
from gms_fsm.language import parse_condition
from gms_fsm.run.machines import Element, ElementMachines, Guard
from tests.helpers import pulled_mass, stick_slip


def test_an_element_has_its_index_and_its_parameters_as_floats() -> None:
    machines = ElementMachines(stick_slip("signed"))
    assert [e.index for e in machines.elements] == [0, 1, 2, 3]
    k = machines.model.values["k"]
    assert [e.k for e in machines.elements] == [float(each) for each in k]
    assert {type(e.k) for e in machines.elements} == {float} == {type(machines.elements[0].v_c)}


def test_a_guard_shows_its_text_and_accepts_an_event_or_an_element() -> None:
    guard = Guard("leave", parse_condition("z >= s", "zs"))
    assert repr(guard) == "<guard z >= s>"
    for z, truth in ((0.9, False), (1.0, True)):
        element = Element()
        element.z, element.s = z, 1.0
        assert guard.holds(element) is guard(SimpleNamespace(model=element)) is truth


def _with_condition(machine: Any, *, target: bool) -> None:
    """Give an edge a condition of one's own."""
    (edge,) = machine.get_transitions("arrest", "slip", "stick")
    edge.conditions.append(type(edge.conditions[0])(lambda event: False, target=target))


def test_a_machine_that_was_changed_is_refused() -> None:
    model = stick_slip("signed")
    leaving = model.chart.leaving("stick")[0][1].name
    changes: list[Callable[[Any], Any]] = [
        lambda m: m.add_transition("arrest", "slip", "stick"),
        lambda m: m.add_transition("arrest", "slip", "slip"),
        lambda m: m.add_transition("fly", "slip", "stick"),
        lambda m: m.add_transition(
            "arrest",
            "slip",
            "stick",
            conditions=m.get_transitions("arrest", "slip")[0].conditions[0].func,
        ),
        lambda m: m.remove_transition("arrest", "slip", "stick"),
        lambda m: m.get_transitions("arrest", "slip")[0].conditions.clear(),
        lambda m: _with_condition(m, target=True),
        lambda m: _with_condition(m, target=False),
        lambda m: setattr(m.get_transitions("arrest", "slip")[0], "dest", "slip"),
        lambda m: setattr(m.get_transitions(leaving, "stick")[0], "dest", "stick"),
    ]
    for change in changes:
        machines = ElementMachines(model)
        assert [len(row) for row in machines.table(model.chart)] == [2, 1]
        change(machines.machine)
        with pytest.raises(ChartError):
            machines.table(model.chart)


@pytest.mark.parametrize("engine", ["machines", "ifelse"])
@pytest.mark.parametrize("first", ["fly", "dive"])
def test_of_two_edges_enabled_at_once_the_earlier_is_taken(engine: Any, first: str) -> None:
    edges = {name: Transition(name, "stick", name + "s", "z >= 0.1") for name in ("fly", "dive")}
    chart = Chart(
        "forked",
        inputs=("v",),
        variables=("z",),
        parameters=("k",),
        states=(State("stick", {"z": "v"}), State("flys", {"z": "v"}), State("dives", {"z": "v"})),
        transitions=(edges.pop(first), *edges.values()),
        outputs={"F": "k * z"},
    )
    model = ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.5, 0.05))
    trace = simulate(model, Prescribed("0.2"), 1.0, engine=engine)
    assert [str(edge) for edge in trace.transitions.edge] == [first]


def test_an_element_shows_the_values_of_the_present_moment() -> None:
    model, rig = pulled_mass()
    seen = []

    class Looking(Element):
        def on_enter_slip(self, event: Any) -> None:
            seen.append((self.t, self.x, self.v, self.s, self.z, self.index))

    trace = simulate(model, rig, 20.0, engine=ElementMachines(model, Looking))
    log = trace.transitions[trace.transitions.target == "slip"]
    assert len(log) >= 4
    assert {index for *_, index in seen} == {0, 1, 2, 3}
    for (t, x, v, s, z, index), row in zip(seen, log, strict=True):
        assert (t, v, s, z, index) == (row.t, row.v, row.s, row.z, row.element)
        assert x == trace.x[trace.t == t][0]


def test_an_element_shows_all_its_variables() -> None:
    chart = Chart(
        "two",
        ("v",),
        ("z", "w"),
        ("k",),
        (State("rest", {"z": "v", "w": "2*v"}), State("gone", {"z": "v", "w": "0"})),
        (Transition("leave", "rest", "gone", "z >= 0.25*k"),),
        {"F": "z"},
    )
    model = ChartModel(chart, {"k": [1.0, 2.0]}, n=2)
    seen = []

    class Looking(Element):
        def on_enter_gone(self, event: Any) -> None:
            seen.append((self.index, self.z, self.w))

    simulate(model, Prescribed("1"), 1.0, engine=ElementMachines(model, Looking))
    assert [index for index, *_ in seen] == [0, 1]
    assert [value for _, *pair in seen for value in pair] == pytest.approx([0.25, 0.5, 0.5, 1.0])
