"""Which element is meant: by its number in Python, or by a text such as ``"gear 1"``.

Inside a session elements are machines, which are counted over all contacts from 0.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import SessionError, shown
from gms_fsm.foundation.arguments import unknown
from gms_fsm.foundation.text import visible
from gms_fsm.lowering.layout import BankPlaces
from gms_fsm.run.problem import Problem


def machine_of(element: int | str, start: Problem) -> int:
    """Return the machine that an argument means."""
    banks = start.program.layout.banks
    if isinstance(element, str):
        return _of_text(element, start)
    whole = isinstance(element, int | np.integer) and not isinstance(element, bool)
    if len(banks) > 1:
        raise SessionError(
            f"element {shown(element)} names no contact",
            advice=f"write, for example, '{banks[0].name} 1'; {_known(banks)}",
        )
    if not whole or not 0 <= element < banks[0].n:
        raise _no_element(shown(element), banks[0])
    return int(element)


def _of_text(text: str, start: Problem) -> int:
    banks = start.program.layout.banks
    form = re.fullmatch(r"\s*(\w+?)(?:\s+(\d{1,9}))?\s*", text)
    named = {bank.name: bank for bank in banks}
    if not start.what.named or form is None or form[1] not in named:
        edges = [edge.name for bank in banks for edge in chart_of(start, bank).transitions]
        known = shown(text) + (f" (to name an edge, use edge={text!r})" if text in edges else "")
        if not start.what.named:
            raise _no_element(known, banks[0])
        raise SessionError(
            f"no element {known}",
            advice=f"write, for example, '{banks[0].name} 1'; {_known(banks)}",
        )
    bank = named[form[1]]
    if form[2] is None and bank.n > 1:
        raise SessionError(
            f"contact {bank.name!r} has {bank.n} elements",
            advice=f"write '{bank.name} 1' to '{bank.name} {bank.n}'",
        )
    number = int(form[2] or 1)
    if not 1 <= number <= bank.n:
        raise SessionError(
            f"no element {number} of contact {bank.name!r}", advice=f"there are 1 to {bank.n}"
        )
    return bank.first + number - 1


def _no_element(text: str, bank: BankPlaces) -> SessionError:
    return SessionError(
        f"no element {text}",
        advice=f"there are 0 to {bank.n - 1} (counted from 0 in Python, from 1 in text)",
    )


def _known(banks: Sequence[BankPlaces]) -> str:
    return f"the contacts are {', '.join(bank.name for bank in banks)}"


def contact_named(name: str, start: Problem) -> BankPlaces:
    """Return the contact with a name; raise `SessionError` if there is none."""
    for bank in start.program.layout.banks:
        if bank.name == name and start.what.named:
            return bank
    known = (bank.name for bank in start.program.layout.banks)
    raise unknown("contact", name, known, SessionError)


def element_name(start: Problem, machine: int) -> str:
    """Return what an element is called in text: ``element 2``, or in a system ``gear 2``."""
    bank = start.program.layout.bank(machine)
    return start.what.element(bank.name, machine - bank.first)


def title_of(start: Problem) -> str:
    """Return what runs: titles of model and rig, or of a system and its contacts."""
    if start.what.named:
        titles = [start.system.name, *(each.title for each in start.system.machines)]
    else:
        titles = [start.model.title, start.rig.title]
    return visible("; ".join(titles))


def chart_of(start: Problem, bank: BankPlaces) -> Chart:
    """Return the chart of a contact."""
    return start.system.contact(bank.name).chart


def source_of(edge: str, chart: Chart) -> tuple[str, ...]:
    """Return the states that an edge leaves; raise `SessionError` if there is no such edge."""
    sources = tuple(each.source for each in chart.transitions if each.name == edge)
    if not sources:
        raise unknown("edge", edge, (each.name for each in chart.transitions), SessionError)
    return sources
