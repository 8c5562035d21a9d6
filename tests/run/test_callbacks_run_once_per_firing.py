"""User callbacks run exactly once per firing, with access to the values at that instant.

Nothing is called between firings; the machines end in the states of the last row; and the chart
remains the only source of switching: a machine with other edges or conditions is refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from gms_fsm import GMS, Element, ElementMachines, Prescribed, Trace, simulate
from gms_fsm.errors import ChartError, ParameterError
from gms_fsm.traces.failures import CallbackError
from tests.helpers import open_loop, pulled_mass, same_bits, stick_slip

Call = tuple[str, float, int, str, float, float, float]
T_END = 61.0


def _note(kind: str, calls: list[Call]) -> Any:
    def callback(event: Any) -> None:
        e = event.model
        calls.append((kind, e.t, e.index, event.event.name, e.z, e.v, e.s))

    return callback


def _logged(trace: Trace, kind: str, *, target: str = "", source: str = "") -> list[Call]:
    return [
        (kind, float(r.t), int(r.element), str(r.edge), float(r.z), float(r.v), float(r.s))
        for r in trace.transitions
        if target in ("", r.target) and source in ("", r.source)
    ]


@pytest.fixture(params=["machines", "compiled"])
def engine(request: pytest.FixtureRequest) -> str:
    """Both that call them; machine code replays its log through the machines."""
    if request.param == "compiled":
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    return str(request.param)


@pytest.fixture(scope="module")
def model() -> GMS:
    return stick_slip("signed")


@pytest.mark.parametrize(
    ("register", "selection"),
    [
        ("on_enter_slip", {"target": "slip"}),
        ("on_enter_stick", {"target": "stick"}),
        ("on_exit_stick", {"source": "stick"}),
        ("on_exit_slip", {"source": "slip"}),
    ],
)
def test_entering_and_leaving_a_state_calls_once(
    model: GMS, engine: str, register: str, selection: dict[str, str]
) -> None:
    machines, calls = ElementMachines(model), []
    getattr(machines.machine, register)(_note(register, calls))
    trace = simulate(model, open_loop(), T_END, engine=engine, machines=machines)
    assert len(calls) == 24
    assert calls == _logged(trace, register, **selection)


@pytest.mark.parametrize(
    "place", ["prepare_event", "before_state_change", "after_state_change", "finalize_event"]
)
def test_machine_wide_callbacks_run_once_per_firing(model: GMS, engine: str, place: str) -> None:
    machines, calls = ElementMachines(model), []
    setattr(machines.machine, place, [_note(place, calls)])
    trace = simulate(model, open_loop(), T_END, engine=engine, machines=machines)
    assert len(trace.transitions) == 48
    assert calls == _logged(trace, place)


@pytest.mark.parametrize("place", ["prepare", "before", "after"])
def test_callbacks_of_an_edge_run_only_when_it_fires(model: GMS, engine: str, place: str) -> None:
    machines, calls = ElementMachines(model), []
    (edge,) = machines.machine.get_transitions("arrest", "slip", "stick")
    edge.add_callback(place, _note(place, calls))
    trace = simulate(model, open_loop(), T_END, engine=engine, machines=machines)
    arrests = [call for call in _logged(trace, place) if call[3] == "arrest"]
    assert 0 < len(arrests) < len(trace.transitions)
    assert calls == arrests


def test_the_order_at_one_firing_is_that_of_transitions(model: GMS, engine: str) -> None:
    machines, order = ElementMachines(model), []
    machine = machines.machine
    for edge in machine.get_transitions():
        edge.add_callback("before", lambda event: order.append(("before", event.model.state)))
        edge.add_callback("after", lambda event: order.append(("after", event.model.state)))
    for state in ("stick", "slip"):
        for kind in ("exit", "enter"):
            getattr(machine, f"on_{kind}_{state}")(
                lambda event, kind=kind: order.append((kind, event.model.state))
            )
    simulate(model, Prescribed("0.2"), 3.0, engine=engine, machines=machines)
    one = [("before", "stick"), ("exit", "stick"), ("enter", "slip"), ("after", "slip")]
    assert order == one * 4


def test_methods_of_an_element_class_are_called_by_name(model: GMS, engine: str) -> None:
    calls: list[Call] = []

    class Noisy(Element):
        def on_enter_slip(self, event: Any) -> None:
            _note("enter", calls)(event)
            assert event.model is self
            assert self.state == "slip"

        def on_exit_slip(self, event: Any) -> None:
            _note("exit", calls)(event)

    machines = ElementMachines(model, Noisy)
    assert all(type(e) is Noisy for e in machines.elements)
    trace = simulate(model, open_loop(), T_END, engine=engine, machines=machines)
    for kind, selection in (("enter", {"target": "slip"}), ("exit", {"source": "slip"})):
        assert [c for c in calls if c[0] == kind] == _logged(trace, kind, **selection)


def test_elements_keep_what_their_class_adds_and_know_their_parameters(engine: str) -> None:
    class Counting(Element):
        def __init__(self) -> None:
            self.hits = 0

        def on_enter_slip(self, event: Any) -> None:
            self.hits += 1

    model, rig = pulled_mass()
    machines = ElementMachines(model, Counting)
    trace = simulate(model, rig, 20.0, engine=engine, machines=machines)
    for i, element in enumerate(machines.elements):
        wanted = np.sum((trace.transitions.element == i) & (trace.transitions.target == "slip"))
        assert element.hits == wanted > 0  # type: ignore[attr-defined]
        assert element.index == i
        for name, values in model.values.items():
            assert getattr(element, name) == (values if np.ndim(values) == 0 else values[i])


def test_an_element_class_that_compares_by_value_is_refused(model: GMS) -> None:
    """Transitions registers equal models once only."""

    @dataclass
    class Equal(Element):
        hits: int = 0

    with pytest.raises(ParameterError, match=r"Equal compares by value.*eq=False"):
        ElementMachines(model, Equal)


def test_an_element_class_may_be_a_dataclass(model: GMS, engine: str) -> None:
    @dataclass(eq=False)
    class Counting(Element):
        hits: int = 0

        def on_enter_slip(self, event: Any) -> None:
            self.hits += 1

    machines = ElementMachines(model, Counting)
    simulate(model, Prescribed("0.2"), 3.0, engine=engine, machines=machines)
    assert [element.hits for element in machines.elements] == [1, 1, 1, 1]  # type: ignore[attr-defined]


def test_a_run_without_firings_calls_nothing(model: GMS, engine: str) -> None:
    machines, calls = ElementMachines(model), []
    for place in ("prepare_event", "before_state_change", "after_state_change", "finalize_event"):
        setattr(machines.machine, place, [_note(place, calls)])
    trace = simulate(model, Prescribed("0.01*sin(t)"), 20.0, engine=engine, machines=machines)
    assert len(trace.transitions) == 0
    assert calls == []


def test_callbacks_run_before_later_rows_are_computed(model: GMS, engine: str) -> None:
    machines, times = ElementMachines(model), []
    machines.machine.on_enter_slip(lambda event: times.append(event.model.t))
    trace = simulate(
        model, open_loop(), T_END, engine=engine, machines=machines, t_eval=[0.0, T_END]
    )
    slips = trace.transitions.target == "slip"
    assert times == trace.transitions.t[slips].tolist()


def test_machines_end_in_the_states_of_the_last_row_and_restart_cleanly(
    model: GMS, engine: str
) -> None:
    machines = ElementMachines(model)
    for t_end in (7.0, 3.0, T_END):
        trace = simulate(model, open_loop(), t_end, engine=engine, machines=machines)
        assert [e.state for e in machines.elements] == trace.states[-1].tolist()
        same_bits(trace, simulate(model, open_loop(), t_end))


def test_every_element_starts_in_its_own_state(model: GMS, engine: str) -> None:
    machines, calls = ElementMachines(model), []
    for register in ("on_enter_slip", "on_exit_slip", "on_enter_stick", "on_exit_stick"):
        getattr(machines.machine, register)(_note(register, calls))
    states = ["stick", "slip", "slip", "stick"]
    trace = simulate(
        model,
        Prescribed("0.1"),
        0.5,
        engine=engine,
        machines=machines,
        initial={"states": states, "z": [0.0, 0.1, 0.2, 0.3]},
    )
    assert trace.states[0].tolist() == states
    assert trace.z[0].tolist() == [0.0, 0.1, 0.2, 0.3]
    assert calls == [], "setting the initial state is not a firing"


# --------------------------------------------------------------------------- the chart decides


def test_a_user_edge_is_refused(model: GMS, engine: str) -> None:
    """Other changes are in test_elements_answer_for_themselves.py."""
    machines = ElementMachines(model)
    machines.machine.add_transition("panic", "slip", "stick")
    with pytest.raises(ChartError, match="panic"):
        simulate(model, open_loop(), 20.0, engine=engine, machines=machines)


def test_a_callback_that_changes_the_values_before_the_guard_is_refused(
    model: GMS, engine: str
) -> None:
    machines = ElementMachines(model)

    def stop(event: Any) -> None:
        event.model.v = 0.0

    machines.machine.prepare_event = [stop]
    said = r"element 1, edge 'break_away_forward' at t = .*changed the element's values.*only read"
    with pytest.raises(CallbackError, match=said) as caught:
        simulate(model, open_loop(), 20.0, engine=engine, machines=machines)
    assert len(caught.value.trace) > 1


def test_values_written_by_a_callback_after_the_guard_do_not_affect_the_run(
    model: GMS, engine: str
) -> None:
    machines = ElementMachines(model)

    def scribble(event: Any) -> None:
        event.model.z, event.model.v, event.model.t = 1e9, 1e9, 1e9

    machines.machine.on_enter_slip(scribble)
    same_bits(
        simulate(model, open_loop(), T_END, engine=engine, machines=machines),
        simulate(model, open_loop(), T_END),
    )


@pytest.mark.parametrize("kind", [dict, Element(), "Element", None])
def test_a_class_that_is_not_an_element_is_refused(model: GMS, kind: Any) -> None:
    with pytest.raises(ParameterError, match="class derived from Element"):
        ElementMachines(model, kind)
