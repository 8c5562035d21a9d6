"""In which order what machines give out can be computed: each after what it reads of others."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from gms_fsm.errors import ParameterError
from gms_fsm.language import names_in
from gms_fsm.systems.reading.definitions import Definition

if TYPE_CHECKING:
    from gms_fsm.systems.reading.assembly import Assembly, Bank


def order_of(read: Assembly) -> tuple[Bank, ...]:
    """Return the machines, each after those whose outputs its own outputs read."""
    found: list[Bank] = []
    waiting = [*read.banks]
    given = {name for each in waiting for name in each.forces}
    while waiting:
        ready = next((each for each in waiting if not read.inputs[each.index] & given), None)
        if ready is None:
            names = ", ".join(each.name for each in waiting)
            closing = " and ".join(sorted(read.inputs[waiting[0].index] & given))
            raise _loop(
                read, f"the outputs of {names} follow from each other: {closing} closes the loop"
            )
        found.append(ready)
        waiting.remove(ready)
        given.difference_update(ready.forces)
    return tuple(found)


def check_loops(read: Assembly) -> None:
    """Refuse machines whose outputs follow from each other, or from themselves by an input."""
    order_of(read)
    for bank in read.banks:
        own = {*bank.forces, *bank.rates}
        closing = read.closure(_trees_read(read, bank) - own) & {*bank.forces}
        if closing:
            raise _loop(
                read, f"an input of {bank.name} reads {min(closing)}, which follows from it"
            )


def _loop(read: Assembly, found: str) -> ParameterError:
    return ParameterError(
        f"{found} (an algebraic loop)",
        place=f"system {read.system.name!r}",
        advice="give one of them a period, or read it by a Sampled: then it is that of the last "
        "tick; or put a further state between them",
    )


def read_by(read: Assembly, bank: Bank) -> frozenset[str]:
    """Return what the outputs of a machine are computed from, but for its own."""
    return read.closure(_trees_read(read, bank)) - {*bank.forces, *bank.rates}


def _trees_read(read: Assembly, bank: Bank) -> frozenset[str]:
    """Return the names that the outputs of a machine read, and the rates that these read."""
    if bank.periodic:  # what it gives out is held
        return frozenset()
    given = (each for each in bank.outputs.values() if each is not None)
    trees = [*given, *bank.totals.values()]
    names = frozenset(name for tree in trees for name in names_in(tree))
    closed = read.closure(names)
    rates = [tree for (_, name), tree in bank.flows.items() if bank.rate(name) in closed]
    return names | {name for tree in rates for name in names_in(tree)}


def is_deferred(read: Assembly, bank: Bank) -> bool:
    """Return whether rates of a machine, on which no output depends, read outputs."""
    if bank.periodic:
        return False
    names = read.closure(name for tree in bank.flows.values() for name in names_in(tree))
    return bool(names & read.late - read.inputs[bank.index])


def in_order(definitions: Iterable[Definition]) -> tuple[Definition, ...]:
    """Return definitions, each after those that it names; others keep their order."""
    waiting, found = [*definitions], list[Definition]()
    while waiting:
        left = {each.name for each in waiting}
        ready = (each for each in waiting if each.tree is None or not names_in(each.tree) & left)
        each = next(ready, waiting[0])  # a loop is refused later
        found.append(each)
        waiting.remove(each)
    return tuple(found)
