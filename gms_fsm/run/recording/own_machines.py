"""The user's own machines in a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.run.machines import ElementMachines, MachineEngine
from gms_fsm.run.problem import Problem


def own_machines(given: Any, start: Problem) -> dict[str, ElementMachines]:
    """Return the user's machines by contact."""
    contacts, named = start.system.machines, start.what.named
    if not isinstance(given, Mapping):
        if len(contacts) > 1:
            raise ParameterError(
                "the system has several contacts",
                place="machines",
                value=given,
                advice="give a mapping, for example "
                f"{{{contacts[0].name!r}: ElementMachines(system.contact({contacts[0].name!r}))}}",
            )
        given = {contacts[0].name: given}
    found: dict[str, ElementMachines] = {}
    for name, each in given.items():
        contact = start.system.contact(name)
        place = f"machines[{name!r}]" if named else "machines"
        checked_kind(place, each, ElementMachines, "an ElementMachines, or left out")
        if each.model not in (contact, contact.model):
            advice = f"make them as ElementMachines(system.contact({name!r}))" if named else ""
            raise ParameterError(
                f"{place}: these ElementMachines were made for a different model", advice=advice
            )
        found[name] = each
    return found


def engine_of(start: Problem, machines: Mapping[str, ElementMachines]) -> MachineEngine:
    """Return the machines of all contacts: the user's, and new ones for the others."""
    contacts = start.system.machines
    parts = [machines.get(each.name) or ElementMachines(each) for each in contacts]
    return MachineEngine(parts, start.program, start.mode)
