"""Which contacts are rotations: those whose velocity is one, by the bodies in it.

A coefficient adapts unless its unit is declared: in ``v_belt - r * w`` a radius turns the speed of
a rotation into that of a translation, whether it says so or not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from gms_fsm.charts.parameters import measured
from gms_fsm.errors import ExpressionError, ParameterError, shown
from gms_fsm.foundation.arguments import unknown
from gms_fsm.foundation.quantities import base_units, si_unit
from gms_fsm.language import (
    Binary,
    Name,
    Negative,
    Number,
    Value,
    derivative,
    names_in,
    parse_value,
)
from gms_fsm.systems.given import texts_of

if TYPE_CHECKING:
    from gms_fsm.systems.parts import Contact
    from gms_fsm.systems.system import System

Powers = Mapping[str, int]  # exponents of base units


def checked_units(system: System, here: str, like: System | None) -> dict[str, str]:
    """Return the declared units of a system, if they are units of SI and of its quantities.

    Those of another one with the same texts are.
    """
    given = texts_of(system.units, f"{here}: units")
    if not given or (like is not None and given == like.units):
        return given
    known = [*system.signals, *system.numbers, *system.flow, *system.let]
    known += [name for each in system.sampled for name in each.updates]
    known += [f"{each.name}.{name}" for each in system.machines for name in _own(each)]
    for name, unit in given.items():
        if name not in known:
            raise unknown("quantity", name, known, place=f"{here}: units", key=("units", name))
        if not si_unit(unit):
            raise ParameterError(
                "it must be a unit of SI, without a prefix, such as 'm/rad'",
                place=f"{here}: units[{name!r}]",
                value=unit,
                key=("units", name),
            )
    return given


def _own(machine: Contact) -> Iterator[str]:
    """Yield what a contact's chart has of its own: parameters, inputs and variables."""
    chart = machine.chart
    yield from dict.fromkeys((*chart.parameter_names, *chart.inputs, *chart.variables))


def in_their_units(
    system: System, kind: str, here: str, like: System | None
) -> tuple[Contact, ...]:
    """Return contacts, or supervisors, whose charts know in which units they are measured.

    They turn if those of another system with the same texts do, in the same units.
    """
    found = []
    seen = getattr(like, kind) if like is not None and like.units == system.units else ()
    for k, each in enumerate(getattr(system, kind)):
        known = dict(each.chart.units)  # as another system has declared them
        for name in _own(each) if system.units else ():
            if (unit := system.units.get(f"{each.name}.{name}")) is not None:
                known[name] = unit
        rotary = seen[k].chart.rotary if seen else bool(each.v) and _turns(each, system, here)
        chart = measured(each.chart, rotary, tuple(known.items()))
        found.append(each if chart is each.chart else each.replaced(chart=chart))
    return tuple(found)


def _turns(contact: Contact, system: System, here: str) -> bool:
    """Return whether the velocity of a contact is that of a rotation."""
    bodies = {body.v: body for body in system.bodies}
    if not any(body.rotary for body in bodies.values()):
        return False
    try:
        tree = parse_value(contact.v[0], [*bodies, *system.numbers])
    except ExpressionError:
        return False  # it is refused where it is read
    sure, likely = set[str](), set[str]()
    declared = False
    for v, body in bodies.items():
        slope = derivative(tree, v)
        if slope is None or slope == Number(0.0):
            continue
        powers = _powers(slope, system.units)
        if powers is None:
            likely.add(body.unit)
        else:
            declared = declared or bool(names_in(slope))
            sure.add(_length(powers, body.unit))
    if declared and not sure <= {"m"} and not sure <= {"rad"}:
        raise ParameterError(
            f"with the units of its numbers v = {contact.v[0]!r} is no velocity",
            place=f"{here}, contact {shown(contact.name)}",
            advice="its terms must all be in m/s, or all in rad/s: see units={...}",
        )
    return (sure or likely) == {"rad"}


def _length(powers: Powers, unit: str) -> str:
    """Return the unit of a length or an angle times a coefficient; a radius is in m or m/rad."""
    found = {**powers, unit: powers.get(unit, 0) + 1, "rad": 0}
    left = {name: power for name, power in found.items() if power}
    return {(): "rad", (("m", 1),): "m"}.get(tuple(left.items()), "another unit")


def _powers(tree: Value, units: Mapping[str, str]) -> Powers | None:
    """Return the units of a coefficient; None where a number adapts."""
    match tree:
        case Number(value):
            return {} if abs(value) == 1.0 else None
        case Name(name):
            return base_units(units[name]) if name in units else None
        case Negative(operand):
            return _powers(operand, units)
        case Binary("*" | "/" as op, left, right):
            a, b = _powers(left, units), _powers(right, units)
            if a is None or b is None:
                return None
            sign = 1 if op == "*" else -1
            return {each: a.get(each, 0) + sign * b.get(each, 0) for each in {*a, *b}}
    return None
