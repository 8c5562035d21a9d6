"""The user's own machines in a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gms_fsm._arguments import checked_kind
from gms_fsm.errors import ParameterError
from gms_fsm.run.machines import ElementMachines, MachineEngine
from gms_fsm.run.start import Start
from gms_fsm.systems.system import Contact

__all__ = ["engine_of", "own_machines"]


def own_machines(given: Any, start: Start) -> dict[str, ElementMachines]:
    """Return the user's machines by contact.

    Parameters
    ----------
    given : ElementMachines or mapping of str to ElementMachines
        As passed to `simulate`.
    start : Start
        The run.

    Returns
    -------
    dict of str to ElementMachines
        For some or all contacts.

    Raises
    ------
    ParameterError
        If there is no such contact, or machines were made for something else.
    """
    contacts, of_system = start.system.contacts, start.given is not None
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
        place = f"machines[{name!r}]" if of_system else "machines"
        checked_kind(place, each, ElementMachines, "an ElementMachines, or left out")
        if all(each.model is not mine for mine in _models(start, contact)):
            raise ParameterError(
                f"{place}: these ElementMachines were made for a different model",
                advice=f"make them as ElementMachines(system.contact({name!r}))"
                if of_system
                else "",
            )
        found[name] = each
    return found


def _models(start: Start, contact: Contact) -> tuple[object, ...]:
    """Return what machines of a contact can be made for."""
    return (start.model,) if start.given is None else (contact, contact.model)


def engine_of(start: Start, machines: Mapping[str, ElementMachines]) -> MachineEngine:
    """Return the machines of all contacts: the user's, and new ones for the others."""
    model = [start.model] if start.given is None else [*start.system.contacts]
    pairs = zip(start.system.contacts, model, strict=True)
    parts = [machines.get(one.name) or ElementMachines(each) for one, each in pairs]
    return MachineEngine(parts, start.program, start.mode)
