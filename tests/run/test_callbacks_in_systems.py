"""In a system each contact may have the user's own machines, whose callbacks run as in a rig."""

from __future__ import annotations

from typing import Any

import pytest

from gms_fsm import ElementMachines, ParameterError, simulate
from gms_fsm.traces.failures import CallbackError
from tests.helpers import FASTEST
from tests.systems_cases import gear_box, servo, two_blocks

ENGINES = ["machines", *({FASTEST} - {"ifelse"})]  # the others call no callbacks


@pytest.mark.parametrize("engine", ENGINES)
def test_each_firing_of_a_contact_calls_its_own_callback_once(engine: str) -> None:
    case, seen = two_blocks(), list[tuple[str, str]]()
    mine = {name: ElementMachines(case.system.contact(name)) for name in ("pad2", "pad1")}
    for name, each in mine.items():
        each.machine.after_state_change = lambda event, name=name: seen.append(
            (name, event.transition.source)
        )
    trace = simulate(case.system, 20.0, initial=case.initial, engine=engine, machines=mine)
    log = trace.transitions
    assert {*log.contact} == {"pad1", "pad2"}
    assert seen == list(zip(log.contact, log.source, strict=True))
    for name, each in mine.items():
        assert [each.elements[0].state] == trace.contact(name).states[-1].tolist()


@pytest.mark.parametrize("engine", ENGINES)
def test_machines_of_one_contact_are_enough(engine: str) -> None:
    case, seen = servo(), list[str]()
    mine = ElementMachines(case.system.contact("gear"))
    mine.machine.on_enter_right(lambda event: seen.append(event.model.state))
    trace = simulate(case.system, 1.0, engine=engine, machines={"gear": mine})
    gear = trace.contact("gear").transitions
    assert seen == ["right"] * int((gear.target == "right").sum()) != []


@pytest.mark.parametrize("engine", ENGINES)
def test_a_callback_that_interferes_is_named_with_its_contact(engine: str) -> None:
    case = two_blocks()
    mine = ElementMachines(case.system.contact("pad2"))

    def meddle(event: Any) -> None:
        event.model.state = "backward"

    mine.machine.after_state_change = meddle
    said = r"contact 'pad2', element 1, edge .*: a callback put contact 'pad2', element 1 into"
    with pytest.raises(CallbackError, match=said):
        simulate(case.system, 20.0, initial=case.initial, engine=engine, machines={"pad2": mine})


def test_machines_of_something_else_are_refused() -> None:
    case, other = two_blocks(), gear_box()
    pad, foreign = case.system.contact("pad1"), other.system.contacts[0]
    wrong: tuple[tuple[Any, str], ...] = (
        ({"pad3": ElementMachines(pad)}, "no contact 'pad3'"),
        ({"pad2": ElementMachines(pad)}, r"machines\['pad2'\]: these .* different model"),
        ({"pad1": ElementMachines(foreign)}, r"system\.contact\('pad1'\)"),
        ({"pad1": pad}, r"machines\['pad1'\] is <Contact 'pad1'.*; it must be an ElementMachines"),
        (ElementMachines(pad), "give a mapping, for example {'pad1': "),
        (pad, "several contacts"),
    )
    for given, said in wrong:
        with pytest.raises(ParameterError, match=said):
            simulate(case.system, 1.0, initial=case.initial, machines=given)
