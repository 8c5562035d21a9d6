"""What a run makes of a chart, as the checks need it: elements, sample time, neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gms_fsm.charts.chart import Chart
from gms_fsm.language import names_in
from gms_fsm.systems.mounted import contact_of
from gms_fsm.systems.parts import Contact
from gms_fsm.systems.reading.assembly import Assembly, Bank


@dataclass(frozen=True)
class ContactFacts:
    """A chart, and what the run knows of its contact.

    Parameters
    ----------
    chart : Chart
        The chart.
    n : int
        Number of elements.
    period : float or None
        s: the machines are asked at these ticks only.
    curved : bool
        Whether each element has a threshold of its own, from a Stribeck curve.
    viscous : bool
        Whether the model adds ``sigma_2 * v`` to the force.
    free : bool
        Whether its force moves the bodies, so that dv/dt jumps where the force does.
    pulled, struck : bool
        Whether other contacts can change forces, or velocities, within an instant.
    jumping : tuple of str
        Inputs that follow velocities which an impulse can change within an instant.
    """

    chart: Chart
    n: int = 1
    period: float | None = None
    curved: bool = False
    viscous: bool = False
    free: bool = False
    pulled: bool = False
    struck: bool = False
    jumping: tuple[str, ...] = ()


def facts_of(what: Any, contact: str = "") -> ContactFacts:
    """Return the facts of a chart alone, of a model or contact, or of a contact of a system."""
    if isinstance(what, Chart) and not contact:
        return ContactFacts(what)
    given, read = contact_of(what, contact)
    if read is None:
        return _of_contact(given)
    return _in_system(read, next(bank for bank in read.banks if bank.name == given.name))


def _of_contact(contact: Contact, **beside: Any) -> ContactFacts:
    chart, curved = contact.chart, contact.stribeck is not None
    jumping = ("s",) if curved and _strikes(chart) else ()
    return ContactFacts(
        chart,
        contact.n,
        contact.period,
        curved,
        contact.sigma_2 != 0.0,
        **{"jumping": jumping, **beside},
    )


def _in_system(read: Assembly, bank: Bank) -> ContactFacts:
    others = [other for other in _coupled(read, bank) if other.edges]
    struck = any(_strikes(each.chart) for each in others)
    moved = {body.name: body.v for body in read.free}
    free = {*moved} & {body for row in bank.jacobian for body in row}
    jumping = [
        name
        for name in bank.chart.inputs
        if name not in ("t", "x", *bank.chart.velocities)
        and any(_strikes(each.chart) for each in read.banks)
        and read.closure(names_in(bank.means[name])) & {*moved.values()}
    ]
    return _of_contact(
        bank.contact, free=bool(free), pulled=bool(others), struck=struck, jumping=tuple(jumping)
    )


def _strikes(chart: Chart) -> bool:
    """Return whether a contact changes velocities by impulses."""
    locked = {each.name for each in chart.states if each.locked}
    return chart.sets_velocity or any(
        edge.impulse and edge.source not in locked for edge in chart.transitions
    )


def _coupled(read: Assembly, bank: Bank) -> list[Bank]:
    """Return the contacts that move free bodies of a contact, or of others that do."""
    free = {body.name for body in read.free}

    def moved(each: Bank) -> set[str]:
        return {body for row in each.jacobian for body in row} & free

    reached, found = moved(bank), list[Bank]()
    while more := [
        each
        for each in read.banks
        if each is not bank and each not in found and moved(each) & reached
    ]:
        found += more
        reached = reached.union(*map(moved, more))
    return found
