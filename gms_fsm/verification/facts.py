"""What a run makes of a chart, as the checks need it: elements, sample time, neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.systems.models import is_model
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
    """

    chart: Chart
    n: int = 1
    period: float | None = None
    curved: bool = False
    viscous: bool = False
    free: bool = False
    pulled: bool = False
    struck: bool = False


def _chosen(read: Assembly, contact: str) -> Bank:
    """Return the contact of a system that is meant: the only one, or the one named."""
    banks = {bank.name: bank for bank in read.banks}
    if not contact and len(banks) > 1:
        raise ParameterError(
            f"system {read.system.name!r} has the contacts {', '.join(map(repr, banks))}",
            place="contact",
            advice=f"say which one: prove(system, contact={next(iter(banks))!r})",
        )
    if contact and contact not in banks:
        raise unknown("contact", contact, [*banks], ParameterError, place="contact")
    return banks[contact or next(iter(banks))]


def facts_of(what: Any, contact: str = "") -> ContactFacts:
    """Return the facts of a chart alone, of a model or contact, or of a contact of a system."""
    if read := getattr(what, "assembly", None):  # a system
        return _in_system(read, _chosen(read, contact))
    if contact:
        raise ParameterError(
            "only a system has contacts", place="contact", value=contact, advice="leave it out"
        )
    if isinstance(what, Chart):
        return ContactFacts(what)
    if isinstance(what, Contact):
        return _of_contact(what)
    if is_model(what):
        return _of_contact(Contact("friction", what))
    raise ParameterError(
        "prove takes a Chart, a model, a Contact or a System", place="chart", value=what
    )


def _of_contact(contact: Contact, **beside: bool) -> ContactFacts:
    return ContactFacts(
        contact.chart,
        contact.n,
        contact.period,
        contact.stribeck is not None,
        contact.sigma_2 != 0.0,
        **beside,
    )


def _in_system(read: Assembly, bank: Bank) -> ContactFacts:
    others = [other for other in _coupled(read, bank) if other.edges]
    struck = any(other.is_impulse(edge) for other in others for edge in other.edges)
    free = {body.name for body in read.free} & {body for row in bank.jacobian for body in row}
    return _of_contact(bank.contact, free=bool(free), pulled=bool(others), struck=struck)


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
