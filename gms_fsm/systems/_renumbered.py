"""A system that was read, with other numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from gms_fsm.systems._assembly import Assembly, Reader

if TYPE_CHECKING:
    from gms_fsm.systems.system import System

__all__ = ["renumbered"]


def renumbered(read: Assembly, system: System) -> Assembly:
    """Return what was read with the numbers of another system of the same texts.

    Parameters
    ----------
    read : Assembly
        Of a system.
    system : System
        One that differs from it in numbers only.

    Returns
    -------
    Assembly
        With the same trees. Its `system` stays the first one: a circle would have to wait for the
        garbage collector.
    """
    reader = Reader(system)
    for contact in system.contacts:
        reader.model_numbers(contact)
    reader.shared |= system.numbers
    for index, contact in enumerate(system.contacts):
        reader.numbers(index, contact)
    pairs = zip(read.banks, system.contacts, strict=True)
    banks = tuple(replace(bank, contact=contact) for bank, contact in pairs)
    return replace(read, banks=banks, shared=reader.shared, own=reader.own)
