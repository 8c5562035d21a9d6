"""What the trees of a system depend on: its texts, and which kinds of numbers it has."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import is_list
from gms_fsm.foundation.display import full_text
from gms_fsm.foundation.equality import ByIdentity

if TYPE_CHECKING:
    from gms_fsm.systems.system import System


def texts_of_system(system: System) -> tuple[Any, ...]:
    """Return everything that the trees of a system and its names depend on, in hashable form."""
    contacts = [
        (
            contact.name,
            _text_of(ByIdentity(contact.chart)),
            contact.v,
            tuple(contact.inputs.items()),
            tuple(is_list(contact.values[each.name]) for each in contact.chart.parameters),
            contact.model is None,
            contact.period is None,
            contact.stribeck and contact.stribeck.text,
        )
        for contact in system.machines
    ]
    signals = [
        (name, signal if isinstance(signal, str) else (type(signal), getattr(signal, "text", "")))
        for name, signal in system.signals.items()
    ]
    sampled = [(each.name, each.period, tuple(each.updates.items())) for each in system.sampled]
    return (
        system.name,
        system.bodies,
        system.springs,
        tuple(contacts),
        tuple(system.numbers),
        tuple(signals),
        tuple(system.flow.items()),
        tuple(system.let.items()),
        tuple(sampled),
        system.open,
        len(system.contacts),
        tuple(each.name for each in system.controllers),
    )


@functools.lru_cache(maxsize=256)
def _text_of(chart: ByIdentity[Chart]) -> str:
    return full_text(chart.it)
