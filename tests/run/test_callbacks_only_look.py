"""A callback that changes a parameter or a state is refused, by both engines that call it.

The run integrates with the model's parameters and follows the chart's edges; other changes by a
callback would not be located, or would make the machines and the rows disagree.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from gms_fsm import GMS, Element, ElementMachines, Prescribed, Trace, simulate
from gms_fsm.errors import ParameterError
from gms_fsm.traces.failures import CallbackError
from tests.helpers import open_loop, same_bits, stick_slip

ENGINES = ["machines", "compiled"]


@pytest.fixture(scope="module")
def model() -> GMS:
    return stick_slip("signed")


def _run(machines: ElementMachines, engine: str) -> Trace:
    if engine == "compiled":
        pytest.importorskip("llvmlite")
    return simulate(machines.model, open_loop(), 20.0, engine=engine, machines=machines)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["k", "sigma", "C", "v_c", "index"])
def test_parameters_of_an_element_are_read_only(model: GMS, engine: str, name: str) -> None:
    machines = ElementMachines(model)

    def soften(event: Any) -> None:
        setattr(event.model, name, 0.0)

    machines.machine.on_enter_slip(soften)
    said = rf"element 1: {name} is set to 0.0, .* read-only.*with_values.*variable of the chart"
    with pytest.raises(ParameterError, match=said):
        _run(machines, engine)
    assert getattr(machines.elements[0], name) == (0 if name == "index" else _value(model, name))


def _value(model: GMS, name: str) -> float:
    value: Any = model.values[name]
    return float(value if isinstance(value, float) else value[0])


def test_parameters_are_read_only_before_a_run_too(model: GMS) -> None:
    machines = ElementMachines(model)
    with pytest.raises(ParameterError, match="element 2: v_c is set to 1"):
        machines.elements[1].v_c = 1.0  # type: ignore[attr-defined]


def test_an_element_class_may_define_a_parameter_but_the_model_decides(model: GMS) -> None:
    class Own(Element):
        def __init__(self) -> None:
            self.k = -1.0
            self.hits = 0

        def on_enter_slip(self, event: Any) -> None:
            self.hits += 1

    machines = ElementMachines(model, Own)
    trace = _run(machines, "machines")
    assert [element.k for element in machines.elements] == model.parameters.k.tolist()  # type: ignore[attr-defined]
    assert sum(element.hits for element in machines.elements) == 8  # type: ignore[attr-defined]
    same_bits(trace, simulate(model, open_loop(), 20.0))


# --------------------------------------------------------------------------- states
def _own_state(event: Any) -> None:
    event.model.state = "stick"


def _by_the_machine(event: Any) -> None:
    event.machine.set_state("stick", event.model)


def _other_state(event: Any) -> None:
    other = event.machine.models[3]
    other.state = "slip"


def _no_state(event: Any) -> None:
    event.model.state = "nowhere"


def _nested_trigger(event: Any) -> None:
    event.model.break_away_forward()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("force", "said"),
    [
        (_own_state, "put element 1 into state 'stick', but the chart has it in 'slip'"),
        (_by_the_machine, "put element 1 into state 'stick', but the chart has it in 'slip'"),
        (_other_state, "put element 4 into state 'slip', but the chart has it in 'stick'"),
        (_no_state, "put element 1 into state 'nowhere', but the chart has it in 'slip'"),
        (_nested_trigger, "a callback changed a state .*break_away_forward from state slip"),
    ],
)
def test_a_forced_state_is_an_error_that_keeps_the_run_so_far(
    model: GMS, engine: str, force: Callable[[Any], None], said: str
) -> None:
    whole = simulate(model, open_loop(), 20.0)
    first = whole.transitions[0]
    machines = ElementMachines(model)
    machines.machine.on_enter_slip(force)
    with pytest.raises(CallbackError, match=said) as caught:
        _run(machines, engine)
    text = str(caught.value)
    assert f"element 1, edge 'break_away_forward' at t = {float(first.t)!r} s" in text
    assert text.endswith("an edge with a guard; the run so far is kept in .trace")
    trace = caught.value.trace
    assert trace.t[-1] == first.t
    assert len(trace.transitions) == 0, "the edge was not taken"
    assert trace.t.tolist() == whole.t[: len(trace)].tolist()


def test_a_state_forced_between_firings_is_detected_at_the_next_one(model: GMS) -> None:
    machines = ElementMachines(model)

    def meddle(_: object) -> None:
        machines.elements[0].state = "slip"

    with pytest.raises(
        CallbackError, match=r"changed a state .*break_away_forward from state slip"
    ):
        simulate(model, Prescribed("0.2"), 9.0, engine=machines, progress=meddle)
