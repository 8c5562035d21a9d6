"""The names of conditions and watches with their units, and numbers with units in texts."""

from __future__ import annotations

import re

from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.records.units import FACTORS, convert_numbers
from gms_fsm.run.problem import Problem
from gms_fsm.traces.scope import unit_of, watch_names
from gms_fsm.traces.system_scope import system_names

# What the units of SI measure; a force is a force, also where it is a normal force.
MEASURED = {
    unit: quantity
    for quantity, units in reversed(FACTORS.items())
    for unit, factor in units.items()
    if factor == 1.0
}


def names_of(start: Problem) -> list[str]:
    """Return the names allowed in conditions and watches."""
    return system_names(start.system) if start.what.named else watch_names(start.model)


def units_of(start: Problem) -> dict[str, str]:
    """Return the units of names, as far as they are known: those of bodies are not declared."""
    found: dict[str, str] = {}
    for contact in start.system.machines:
        chart = contact.chart
        for name in names_of(start):
            owner, _, last = name.rpartition(".")
            if start.what.named and (owner != contact.name or name in start.system.names):
                continue
            bare = re.sub(r"\d+$", "", last)
            if unit := unit_of(chart, last) or unit_of(chart, bare):
                found[name] = unit
    return found | {"t": "s"}


def in_si(start: Problem, text: str, name: str = "") -> str:
    """Return a text with numbers in SI for those with units, such as ``"v > 300 mm/s"``.

    With a name, the text is an expression for that name.
    """
    checked_kind("text", text, str, "a text")
    known = {each: MEASURED[u] for each, u in units_of(start).items() if u in MEASURED}
    return (
        convert_numbers(f"{name}=={text}", known).partition("==")[2]
        if name
        else convert_numbers(text, known)
    )
