"""Systems whose texts were read before, with other numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from gms_fsm.systems.given import is_positive
from gms_fsm.systems.reading.assembly import Assembly, SystemReader
from gms_fsm.systems.reading.values import numbers_of
from gms_fsm.systems.springs import check_springs

if TYPE_CHECKING:
    from gms_fsm.systems.system import System


def renumbered(read: Assembly, system: System) -> Assembly:
    """Return what was read with the numbers of another system of the same texts."""
    shared, own = numbers_of(system)
    pairs = zip(read.banks, system.machines, strict=True)
    banks = tuple(replace(bank, contact=contact) for bank, contact in pairs)
    signals = {name: each for name, each in system.signals.items() if not isinstance(each, str)}
    definitions = tuple(replace(each, signal=signals.get(each.name)) for each in read.definitions)
    return replace(read, definitions=definitions, banks=banks, shared=shared, own=own)


def check_numbers(read: Assembly, system: System) -> None:
    """Refuse numbers with which a system that was read could not be run."""
    if not all(is_positive(tree, system.numbers) for tree in read.inertias.values()):
        SystemReader(system).check_inertias(read.inertias)
    check_springs(system)
    if read.locking:
        SystemReader(system).check_locks(read.banks)
