"""What an editor shows of a row: a scope for each contact and element, and one for the system."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from gms_fsm.debugger._commands import Commands
from gms_fsm.debugger._view import view
from gms_fsm.errors import GMSError
from gms_fsm.lowering.layout import BankPlaces


class ShownValue(NamedTuple):
    """A value: what one types to print or poke it, and its text; an edge has neither."""

    name: str
    text: str
    printed: bool = True


class ShownScope(NamedTuple):
    """Values that are shown together, computed when they are asked for."""

    name: str
    values: Callable[[], Iterator[ShownValue]]


def scopes_of(commands: Commands) -> Iterator[ShownScope]:
    """Yield the scopes at the cursor."""
    session, elements = commands.session, commands.elements
    if elements.named:
        yield ShownScope("system", lambda: _printed(commands, ["t", *session.system.names]))
    for bank in elements.banks:
        yield _of_contact(commands, bank)
        for machine in range(bank.first, bank.first + bank.n):
            yield _of_element(commands, machine)


def _of_contact(commands: Commands, bank: BankPlaces) -> ShownScope:
    session, named = commands.session, commands.elements.named
    lead = f"{bank.name}." if named else ""
    inside = {*commands.elements.chart(bank.first).variables}
    for i in range(bank.n):
        inside.update(_numbered(commands, bank.first + i))
    own = [name for name in session.names if name.startswith(lead) and name not in inside]
    own = [name for name in own if name.removeprefix(lead) not in inside]
    return ShownScope(bank.name if named else "friction", lambda: _printed(commands, own))


def _of_element(commands: Commands, machine: int) -> ShownScope:
    elements = commands.elements
    bank = elements.bank(machine)
    lead = f"{bank.name}." if elements.named else ""

    def values() -> Iterator[ShownValue]:
        here = view(commands.session).elements[machine]
        yield ShownValue(f"{lead}state{machine - bank.first + 1}", here.state, printed=False)
        yield from _printed(commands, _numbered(commands, machine))
        for edge in here.edges:
            fired = "FIRED " if edge.fired else ""
            truths = " ".join("true" if holds else "false" for holds in edge.clauses)
            yield ShownValue(edge.name, f"{fired}[{edge.guard}]  {truths}", printed=False)

    return ShownScope(elements.name(machine), values)


def _numbered(commands: Commands, machine: int) -> list[str]:
    """Return the names of the values of an element, as they are typed."""
    elements = commands.elements
    bank = elements.bank(machine)
    lead = f"{bank.name}." if elements.named else ""
    known, number = commands.session.names, machine - bank.first + 1
    bases = (*elements.chart(machine).variables, "s", "F")
    return [name for base in bases if (name := f"{lead}{base}{number}") in known]


def _printed(commands: Commands, names: list[str]) -> Iterator[ShownValue]:
    for name in names:
        yield ShownValue(name, printed(commands, name))


def printed(commands: Commands, expression: str) -> str:
    """Return what `print` answers, or why it cannot be computed here."""
    try:
        return "\n".join(commands.answer("print", expression))
    except GMSError as error:
        return error.reason
