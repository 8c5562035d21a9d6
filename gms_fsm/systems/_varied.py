"""A system with some of its numbers replaced: its own, and those of its contacts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import Parameter
from gms_fsm.systems._parts import Contact
from gms_fsm.systems.models import parameters_of, with_values
from gms_fsm.systems.system import System

__all__ = ["numbers_in", "with_numbers_of"]

NUMBERS = "numbers"


def numbers_in(system: System) -> dict[str, tuple[Parameter, int]]:
    """Return the numbers of a system that can be varied.

    Parameters
    ----------
    system : System
        Any system.

    Returns
    -------
    dict of str to (Parameter, int)
        By name: ``"numbers.m"``, and ``"pad.F_s"`` for a parameter of the contact pad; with the
        number of elements it can have one value for each of, or 0.

    Examples
    --------
    >>> from gms_fsm import Body
    >>> from gms_fsm.charts import CHARTS
    >>> pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0})
    >>> mass = Body("mass", inertia="m", force="2 * t")
    >>> list(numbers_in(System("one", bodies=(mass,), contacts=(pad,), numbers={"m": 1.0})))
    ['numbers.m', 'pad.F_c', 'pad.F_s', 'pad.b']
    """
    found = {f"{NUMBERS}.{name}": (Parameter(name), 0) for name in system.numbers}
    for contact in system.contacts:
        own = contact.chart.parameters if contact.model is None else parameters_of(contact.model)
        for each in own:
            wide = each.name == "weights" or np.ndim(contact.values.get(each.name, 0.0)) > 0
            found.setdefault(f"{contact.name}.{each.name}", (each, contact.n if wide else 0))
    return found


def with_numbers_of(system: System, values: Mapping[str, ArrayLike]) -> System:
    """Return a system with some of its numbers replaced.

    Parameters
    ----------
    system : System
        The system that supplies all other numbers.
    values : mapping
        By a name from `numbers_in`.

    Returns
    -------
    System
        A new system, checked.

    Raises
    ------
    ParameterError
        If a value breaks its rule, or an inertia is no longer positive.
    """
    groups: dict[str, dict[str, ArrayLike]] = {}
    for name, value in values.items():
        owner, _, own = name.partition(".")
        groups.setdefault(owner, {})[own] = value
    return replace(
        system,
        contacts=tuple(_varied(each, groups.get(each.name, {})) for each in system.contacts),
        numbers={**system.numbers, **groups.get(NUMBERS, {})},  # type: ignore[dict-item]
    )


def _varied(contact: Contact, new: Mapping[str, ArrayLike]) -> Contact:
    """Return a contact with some of its numbers replaced."""
    if not new:
        return contact
    if contact.model is not None:
        model = with_values(contact.model, new)
        return Contact(
            contact.name, model, v=contact.v, inputs=contact.inputs, period=contact.period
        )
    return Contact(
        contact.name,
        contact.chart,
        {**contact.values, **new},
        v=contact.v,
        n=contact.n,
        inputs=contact.inputs,
        period=contact.period,
    )
