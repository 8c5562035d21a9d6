"""What an editor shows of a row: a scope for each contact and element, and one for the system."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from gms_fsm.debugger._commands import Commands
from gms_fsm.debugger._view import element_view
from gms_fsm.errors import GMSError


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
    known = dict.fromkeys(session.names)
    if elements.named:
        yield _scope(commands, "system", ["t", *session.system.names])
    for bank in elements.banks:
        lead = f"{bank.name}." if elements.named else ""
        variables = elements.chart(bank.first).variables
        inside = {f"{lead}{name}" for name in variables}  # of a single element, without its number
        own = {}
        machines = range(bank.elements.start, bank.elements.stop)
        for number, machine in enumerate(machines, start=1):
            numbered = [f"{lead}{name}{number}" for name in (*variables, "s", "F")]
            own[machine] = [name for name in numbered if name in known]
            inside.update(own[machine])
        names = [name for name in known if name.startswith(lead) and name not in inside]
        yield _scope(commands, bank.name if elements.named else "friction", names)
        for machine, names in own.items():
            state = f"{lead}state{machine - bank.first + 1}"
            yield _of_element(commands, machine, state, names)


def _scope(commands: Commands, title: str, names: list[str]) -> ShownScope:
    return ShownScope(title, lambda: _printed(commands, names))


def _of_element(commands: Commands, machine: int, state: str, names: list[str]) -> ShownScope:
    def values() -> Iterator[ShownValue]:
        here = element_view(commands.session, machine)
        yield ShownValue(state, here.state, printed=False)
        yield from _printed(commands, names)
        for edge in here.edges:
            fired = "FIRED " if edge.fired else ""
            truths = " ".join("true" if holds else "false" for holds in edge.clauses)
            yield ShownValue(edge.name, f"{fired}[{edge.guard}]  {truths}", printed=False)

    return ShownScope(commands.elements.name(machine), values)


def _printed(commands: Commands, names: list[str]) -> Iterator[ShownValue]:
    """Yield values as `print` answers, or why they cannot be computed here."""
    for name in names:
        try:
            text = "\n".join(commands.answer("print", name))
        except GMSError as error:
            text = error.reason
        yield ShownValue(name, text)
