"""The inputs, outputs and parameters of what is exported, with the names that C gives them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from gms_fsm.charts.parameters import (
    QUANTITIES,
    SIGMA_2,
    STRIBECK,
    WEIGHTS,
    Parameter,
    adapted,
)
from gms_fsm.errors import ParameterError
from gms_fsm.exporters._names import identifier
from gms_fsm.foundation.quantities import per_second
from gms_fsm.foundation.text import visible
from gms_fsm.language import EVENT
from gms_fsm.run.problem import Problem
from gms_fsm.systems.reading.values import CURVE, MODEL, WEIGHT, numbers_of
from gms_fsm.systems.system import Contact, System

DERIVED = ("v dip", "v flat")  # computed from the other numbers of a curve


@dataclass(frozen=True)
class Quantity:
    """A number, or one number per element of a contact.

    Parameters
    ----------
    name : str
        In C: ``z``, or ``bearing_z`` if there are several contacts or bodies.
    label : str
        What the trees call it: ``bearing.z``.
    place : {"y", "seen", "mode", "shared", "own"}
        Which array it is in.
    index : int
        Of its first value there.
    length : int or None
        Number of elements; None for a single number.
    unit, meaning : str
        Empty if unknown.
    values : tuple of float
        Of a parameter; of a state its initial values.
    """

    name: str
    label: str
    place: str
    index: int
    length: int | None
    unit: str
    meaning: str
    values: tuple[float, ...] = ()

    @property
    def about(self) -> str:
        """Unit and meaning, for a comment."""
        return visible(", ".join(part for part in (self.unit, self.meaning) if part))

    @property
    def shown(self) -> str:
        """A line of a README."""
        return (
            f"- `{self.name}` = {', '.join(map(repr, self.values))} {visible(self.unit)}".rstrip()
        )


def outputs_of(start: Problem, alone: bool, words: Iterable[str]) -> tuple[Quantity, ...]:
    """Return what an export shows: states, forces and what else is observed."""
    layout = start.program.layout
    found: list[Quantity] = []
    for place, places in (("y", layout.y), ("seen", layout.observed)):
        for label in dict.fromkeys(name for name, _ in places):
            first, *others = places.all_of(label) if label in places.own else [places.index(label)]
            count = 1 + len(others) if label in places.own else None
            if any(each.label == label for each in found):
                continue  # a position is in both
            if count is not None and _of_bristles(start.system, label):
                continue
            known = _declared(start.system, label)
            values = tuple(start.y[k] for k in (first, *others)) if place == "y" else ()
            what = known.unit, known.meaning
            found.append(Quantity(_plain(label, alone), label, place, first, count, *what, values))
    for bank in layout.banks:
        label = bank.of("state")
        initial = tuple(float(k) for k in start.mode[bank.elements])
        states = ", ".join(
            f"{k} {each.name}"
            for k, each in enumerate(start.system.contact(bank.name).chart.states)
        )
        found.append(
            Quantity(_plain(label, alone), label, "mode", bank.first, bank.n, "", states, initial)
        )
    found = _named(found, start, alone, words)
    _check([each.name for each in found], [each.label for each in found], words)
    return tuple(found)


def _named(
    found: list[Quantity], start: Problem, alone: bool, words: Iterable[str]
) -> list[Quantity]:
    """Return the same with events called as their users call them, where that name is free."""
    others = {each.name for each in (*found, *parameters_of(start, alone, ()))}
    others |= {*start.system.names, *words}
    return [
        replace(each, name=plain)
        if each.label.startswith(EVENT) and (plain := each.label.removeprefix(EVENT)) not in others
        else each
        for each in found
    ]


def _of_bristles(system: System, label: str) -> bool:
    """Return whether a quantity is that of the one element of a supervisor, which is no bristle."""
    owner, _, name = label.rpartition(".")
    known = name in ("s", WEIGHT) or name.endswith("_elements")
    return known and any(each.name == owner for each in system.supervisors)


def parameters_of(start: Problem, alone: bool, words: Iterable[str]) -> tuple[Quantity, ...]:
    """Return the numbers of an export."""
    shared, own = numbers_of(start.system)
    found = [
        _parameter(start.system, label, "shared", k, None, (value,), alone)
        for k, (label, value) in enumerate(shared.items())
        if not label.endswith(DERIVED) and not _replaced(label, shared, own)
    ]
    width = max((values.size for _, values in own.values()), default=0)
    found += [
        _parameter(start.system, label, "own", k * width, values.size, values.tolist(), alone)
        for k, (label, (_, values)) in enumerate(own.items())
        if not _of_bristles(start.system, label)
    ]
    _check([each.name for each in found], [each.label for each in found], words)
    return tuple(found)


def _replaced(label: str, shared: Iterable[str], own: Iterable[str]) -> bool:
    """Return whether a number of all models is not used, because the chart has one of that name."""
    return MODEL in label and label.replace(MODEL, "") in {*shared, *own}


def _parameter(
    system: System, label: str, place: str, index: int, length: int | None, values: Any, alone: bool
) -> Quantity:
    known, plain = _declared(system, label), label
    for prefix in (CURVE, MODEL):
        plain = plain.replace(f".{prefix}", ".")
    plain = plain.replace(WEIGHT, WEIGHTS.name)
    return Quantity(
        _plain(plain, alone), label, place, index, length, known.unit, known.meaning, tuple(values)
    )


def _declared(system: System, label: str) -> Parameter:
    """Return unit and meaning of a name in the trees."""
    owner, _, name = label.rpartition(".")
    contact = next((each for each in system.machines if each.name == owner), None)
    known: dict[str, Parameter] = {}
    if contact is not None:
        known = dict(_of_contact(contact))
    elif name.startswith(EVENT):
        known = {name: Parameter(name, meaning="event, 1 where it has come")}
    else:
        for body in system.bodies:
            position = Parameter(body.x, body.unit, meaning="position")
            speed = Parameter(body.v, per_second(body.unit), meaning="velocity")
            known |= {body.x: position, body.v: speed}
    return known.get(name, Parameter(re.sub(r"\W", "_", name), system.units.get(name, "")))


def _of_contact(contact: Contact) -> Iterator[tuple[str, Parameter]]:
    chart = contact.chart
    forces = Parameter("F_elements", "N", meaning="forces of the elements")
    known = {**QUANTITIES, "F_elements": forces, WEIGHT: WEIGHTS, f"{MODEL}sigma_2": SIGMA_2}
    known |= {f"{CURVE}{each.name}": each for each in STRIBECK}
    yield from ((name, adapted(each, chart)) for name, each in known.items())
    yield from chart.declared.items()
    for name in chart.variables:
        rate = per_second(chart.unit(name))
        yield f"d{name}", Parameter(f"d{name}", rate, meaning=f"derivative of {name}")


def _plain(label: str, alone: bool) -> str:
    """Return the name in C."""
    name = label.partition(".")[2] if alone and "." in label else label
    return re.sub(r"\W+", "_", name)


def _said(label: str) -> str:
    """Return what the user calls it."""
    return label.removeprefix("friction.")


def _check(names: list[str], labels: list[str], words: Iterable[str]) -> None:
    """Refuse names that C cannot have, and equal ones."""
    for name, label in zip(names, labels, strict=True):
        identifier(name, words, f"name {_said(label)!r}")
        if names.count(name) > 1:
            raise ParameterError(
                f"two quantities would be called {name!r}",
                place=f"name {_said(label)!r}",
                advice="give one of them another name",
            )
