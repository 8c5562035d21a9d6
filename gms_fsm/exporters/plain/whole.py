"""A whole system as text formats need it: equations of motion around the frictions of its contacts.

The equations are those that the engines run (`gms_fsm.systems.reading`); each contact is a friction
of its own, exported as one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from gms_fsm.errors import ParameterError
from gms_fsm.exporters._names import identifier
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.element import NamedFriction
from gms_fsm.language import Binary, Name, Number, Value, names_in, renamed
from gms_fsm.systems.parts import Sampled
from gms_fsm.systems.reading.assembly import Assembly, Bank, of
from gms_fsm.systems.signals import Corners

__all__ = ["ContactPart", "WholeSystem", "safe_name"]


@dataclass(frozen=True, eq=False)
class ContactPart:
    """A contact of a system."""

    name: str
    friction: Subject
    inputs: tuple[tuple[str, Value], ...]  # the velocity first; over the names of the system

    @property
    def force(self) -> str:
        """What its force is called in the trees."""
        return of(self.name, "F")


@dataclass(frozen=True, eq=False)
class WholeSystem:
    """A system of bodies, springs, samplers and contacts."""

    subject: Subject
    numbers: Mapping[str, float]
    inputs: tuple[str, ...]  # signals that are records
    definitions: tuple[tuple[str, Value], ...]  # each after those it needs
    rates: Mapping[str, tuple[Value, Value]]  # of each state: factor times derivative is the other
    start: Mapping[str, float]  # of states, and of what samplers give out
    contacts: tuple[ContactPart, ...]
    samplers: tuple[Sampled, ...]
    updates: Mapping[str, Mapping[str, Value]]  # by sampler

    @classmethod
    def of(cls, subject: Subject, words: Iterable[str]) -> WholeSystem:
        """Read a system, or refuse what a text format cannot express."""
        system, start = subject.system, subject.start
        read: Assembly = system.assembly
        for bank in read.banks:
            _refuse(bank, system.events)
        contacts = tuple(_part(subject, bank) for bank in read.banks)
        own = tuple(f"{bank.name}." for bank in read.banks)
        inputs = [name for name, each in start.system.signals.items() if isinstance(each, Corners)]
        definitions = [
            (each.name, each.tree)
            for each in read.definitions
            if each.tree is not None and not each.name.startswith(own)
        ]
        rates: dict[str, tuple[Value, Value]] = {}
        one = Number(1.0)
        for body in system.bodies:
            rates[body.x] = one, Name(body.v)
        for body in read.free:
            force = read.forces[body.name]
            for bank in read.banks:
                if body.name in bank.jacobian[0]:
                    lever, pull = bank.jacobian[0][body.name], Name(bank.forces[0])
                    force = Binary("-", force, pull if lever == one else Binary("*", lever, pull))
            rates[body.v] = read.inertias[body.name], force
        rates |= {name: (one, tree) for name, tree in read.flow.items()}
        if given := [name for name in subject.initial or {} if "." in name]:
            raise _refusal(f"initial, name {given[0]!r}", "it is a value of a contact")
        layout = start.program.layout.y
        values = [*rates, *(name for each in system.sampled for name in each.updates)]
        every = [*read.shared, *values, *inputs, *(name for name, _ in definitions)]
        for name in every:
            if not name.startswith(own):
                identifier(name, words, f"name {name!r}")
        late = {name for each in contacts for _, tree in each.inputs for name in names_in(tree)}
        late |= {name for _, tree in definitions for name in names_in(tree)}
        if any(name.endswith((" a", ".F")) for name in late):
            raise _refusal(f"system {system.name!r}", "it reads forces or accelerations")
        return cls(
            subject,
            {k: v for k, v in read.shared.items() if not k.startswith(own)},
            tuple(inputs),
            tuple(definitions),
            rates,
            {name: float(start.y[layout.index(name)]) for name in values},
            contacts,
            tuple(system.sampled),
            read.updates,
        )


def safe_name(name: str) -> str:
    """Return a name that any language can have.

    Examples
    --------
    >>> safe_name("bearing.F")
    'bearing_F'
    """
    return re.sub(r"\W", "_", name)


def _part(subject: Subject, bank: Bank) -> ContactPart:
    contact = bank.contact
    own = replace(
        subject,
        name=f"{subject.name}_{bank.name}",
        title=f"{bank.name} of {subject.title}",
        whole=None,
        friction=contact,
        own_chart=contact.chart,
        initial=None,
    )
    element = NamedFriction.of(own, (), time=False)
    read: Assembly = subject.system.assembly
    means = {**bank.means, bank.chart.velocities[0]: Name(bank.velocities[0])}
    known = {each.name: each.tree for each in read.definitions if each.tree is not None}

    def over_system(tree: Value) -> Value:
        mine = {u: over_system(known[u]) for u in names_in(tree) if u.startswith(f"{bank.name}.")}
        return renamed(tree, mine) if mine else tree

    found = tuple((name, over_system(means[name])) for name, _ in element.inputs if name in means)
    if len(found) != len(element.inputs):
        raise _refusal(f"contact {bank.name!r}", "its chart reads more than the system gives it")
    return ContactPart(bank.name, own, found)


def _refuse(bank: Bank, events: Iterable[str]) -> None:
    place = f"contact {bank.name!r}"
    if len(bank.velocities) != 1:
        raise _refusal(place, "it has no velocity, or several")
    if bank.locked:
        raise _refusal(place, f"its state {bank.locked[0]!r} locks the bodies together")
    if bank.periodic or bank.lasting or tuple(events):
        raise _refusal(place, "it is asked at ticks, or waits for events or for how long one holds")


def _refusal(place: str, why: str) -> ParameterError:
    return ParameterError(
        f"{why}, which this format cannot express for a whole system",
        place=place,
        advice="export the system as c99, js or fmu2, or one contact (--contact)",
    )
