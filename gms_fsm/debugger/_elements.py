"""How a person writes elements, and values to poke: ``2``, ``gear 1``, ``gear.z1=0.2``."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from gms_fsm.charts.chart import Chart
from gms_fsm.debugger._help import help_of
from gms_fsm.errors import SessionError
from gms_fsm.foundation.arguments import there_are
from gms_fsm.lowering.layout import BankPlaces
from gms_fsm.session.elements import chart_of, element_name
from gms_fsm.session.session import Session
from gms_fsm.session.tree.poking import Edits, pokeable
from gms_fsm.systems.models import parameter_names
from gms_fsm.traces.system_scope import in_si


@dataclass(frozen=True)
class Elements:
    """The elements of a session, as they are written.

    Parameters
    ----------
    session : Session
        The session.
    chosen : int
        The chosen element, counted over all contacts from 0; a number alone is one of its contact.
    """

    session: Session
    chosen: int

    @property
    def banks(self) -> tuple[BankPlaces, ...]:
        """The contacts; those of a system have names that a person can write."""
        return self.session.start.program.layout.banks

    @property
    def named(self) -> dict[str, BankPlaces]:
        """The contacts of a system by name; none for a model on a rig."""
        return {bank.name: bank for bank in self.banks} if self.session.start.what.named else {}

    @property
    def pattern(self) -> str:
        """Regular expression of an element, a contact, or ``all``."""
        names = "".join(rf"|(?i:{re.escape(name)})(?:\s+\d+|\s+all)?" for name in self.named)
        return rf"\d+|all{names}"

    def bank(self, machine: int) -> BankPlaces:
        """Return the contact of an element."""
        return self.session.start.program.layout.bank(machine)

    def chart(self, machine: int) -> Chart:
        """Return the chart of an element."""
        return chart_of(self.session.start, self.bank(machine))

    def name(self, machine: int) -> str:
        """Return what an element is called: ``element 2``, ``gear 1``."""
        return element_name(self.session.start, machine)

    def short(self, machine: int) -> str:
        """Return how a command takes an element: ``2``, with several contacts ``gear 1``."""
        return self.name(machine) if len(self.banks) > 1 else str(machine + 1)

    def address(self, machine: int) -> int | str:
        """Return what methods of a session take for an element."""
        return self.name(machine) if self.named else machine

    def address_of(self, command: str, text: str) -> int | str:
        """Return what methods of a session take for a text: an element, or a whole contact."""
        words = text.split()
        contact = spelled(words[0], self.named)
        if contact in self.named and words[1:] in ([], ["all"]):
            return contact
        return self.address(self.taken(command, words))

    def taken(self, command: str, words: list[str], *, needed: bool = False) -> int:
        """Take the words that name an element; return the chosen one if there are none."""
        bank, named = self.bank(self.chosen), False
        if words and (contact := spelled(words[0], self.named)) in self.named:
            bank, named = self.named[contact], True
            words.pop(0)
        if words[:1] == ["element"] and words[1:2] and words[1].isdigit():  # as break takes it
            words.pop(0)
        if words and (words[0].isdigit() or (needed and not named)):
            number = integer(words.pop(0), help_of(command, self.session).usage)
            if not 1 <= number <= bank.n:
                whose = f" of {bank.name}" if len(self.named) > 1 else ""
                raise SessionError(f"no element {number}{whose}", advice=f"there are 1 to {bank.n}")
            return bank.first + number - 1
        if needed and not named:
            integer("", help_of(command, self.session).usage)
        return bank.first if named else self.chosen


def completions(session: Session) -> tuple[list[str], list[str], list[str]]:
    """Return how elements, their states in conditions, and values to poke are written."""
    start, elements = session.start, Elements(session, 0)
    layout = start.program.layout
    words, states, values = [], [], []
    for bank in layout.banks:
        lead = f"{bank.name}." if elements.named else ""
        words += [elements.short(bank.first + i) for i in range(bank.n)]
        states += [f"{lead}state({i + 1})" for i in range(bank.n)]
        values += [f"{lead}state{i + 1}" for i in range(bank.n)]
    for name in pokeable(start):
        if name in layout.y.own:
            plain = name if elements.named else name.split(".", 1)[-1]
            values += [f"{plain}{i + 1}" for i in range(len(layout.y.all_of(name)))]
        elif elements.named or name == "v":
            values.append(name)
    return words, states, values


def read_edits(session: Session, arg: str, usage: str, states: Iterable[str]) -> Edits:
    """Read the changes that a person asks for."""
    variables: dict[str, Any] = {}
    named: dict[int | str, str] = {}
    v: float | None = None
    elements = Elements(session, 0)
    for part in filter(None, re.split(r"[,\s]\s*(?=[\w.]+=)", re.sub(r"\s*=\s*", "=", arg))):
        name, _, value = part.partition("=")
        state = re.fullmatch(r"(?:(\w+)\.)?state(\d*)", name)
        if not value:
            raise SessionError(f"{part!r} gets no value", advice=usage)
        if state:
            named[_whose(elements, name, state[1], state[2])] = spelled(value, states)
        elif elements.named:
            variables[name] = session.watch(in_si(session.start.what, value, name))
        elif name == "v":
            v = session.watch(in_si(session.start.what, value, name))
        else:
            variable, i = _variable(session, name, usage)
            variables.setdefault(variable, {})[i] = session.watch(
                in_si(session.start.what, value, name)
            )
    return Edits(variables, v, named)


def _whose(elements: Elements, name: str, contact: str | None, number: str) -> int | str:
    """Return the element whose state is to be changed."""
    if contact is not None and contact not in elements.named:
        known = ", ".join(elements.named) or "none"
        raise SessionError(f"no contact {contact!r}", advice=f"the contacts are {known}")
    if contact is None and len(elements.banks) > 1:
        some = elements.banks[0].name
        raise SessionError(
            f"{name!r} names no contact", advice=f"write, for example, {some}.state1"
        )
    bank = elements.named[contact] if contact else elements.banks[0]
    if not number and bank.n > 1:
        raise SessionError(f"{name!r} cannot be poked", advice=f"for element 1 write {name}1")
    return elements.address(Elements(elements.session, bank.first).taken("poke", [number or "1"]))


def _variable(session: Session, name: str, usage: str) -> tuple[str, int]:
    """Return variable and element of a name of a model on a rig."""
    known = session.model.chart.variables
    form = re.fullmatch(rf"({'|'.join(map(re.escape, known))})(\d*)", name) if known else None
    if form is None:
        if name in parameter_names(session.model) or name in session.start.system.numbers:
            raise SessionError(
                f"{name} is a parameter, which stays in a run",
                advice="leave with quit and give the scenario another value (--set)",
            )
        values = completions(session)[2]
        raise SessionError(
            f"{name!r} cannot be poked", advice=f"{there_are(name, values)}; {usage}"
        )
    if not form[2] and session.model.n > 1 and form[1] not in session.model.chart.hidden:
        raise SessionError(f"{name!r} cannot be poked", advice=f"for element 1 write {name}1")
    return form[1], Elements(session, 0).taken("poke", [form[2] or "1"])


def integer(text: str, usage: str) -> int:
    """Return an integer that a person wrote; raise `SessionError` for any other text."""
    if not re.fullmatch(r"\d{1,9}", text):
        reason = f"{text!r} is not a whole number below 1e9" if text else "a number is missing"
        raise SessionError(reason, advice=f"usage: {usage}")
    return int(text)


def spelled(name: str, known: Iterable[str]) -> str:
    """Return the known name that differs only in case; the name itself unless there is one."""
    same = [each for each in known if each.casefold() == name.casefold()]
    return same[0] if len(same) == 1 else name
