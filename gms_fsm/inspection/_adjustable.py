"""The numbers of what runs that can be adjusted one by one: of all elements, or of one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gms_fsm.charts.parameters import Parameter
from gms_fsm.errors import ParameterError, shown
from gms_fsm.systems.numbers import Adjustable
from gms_fsm.traces.rows import column_name

__all__ = ["Number", "number_of", "numbers_of", "with_numbers"]


@dataclass(frozen=True)
class Number:
    """One number that can be adjusted.

    Parameters
    ----------
    parameter : Parameter
        Its unit, rule and meaning.
    value : float
        The present value.
    whole : str
        Name of the parameter that it is a part of.
    element : int or None
        Element index, from 0, if it is the value of one element; None if it is that of all.
    """

    parameter: Parameter
    value: float
    whole: str
    element: int | None


def numbers_of(subject: Adjustable) -> dict[str, Number]:
    """Return the numbers by name, such as ``"F_s"``, ``"k2"`` and ``"stiffness"``.

    Those of a system are called ``"numbers.m"`` and ``"gear.k2"``. A name without the number of an
    element stands for all elements; it is absent if they differ.
    """
    found: dict[str, Number] = {}
    for name, (parameter, _) in subject.known.items():
        values = np.asarray(subject.value(name), dtype=np.float64)
        if values.ndim == 0 or (values == values.flat[0]).all():
            found[name] = Number(parameter, float(values.flat[0]), name, None)
        if values.ndim and values.size > 1:
            for i, each in enumerate(values.tolist()):
                found[column_name(name, i)] = Number(parameter, each, name, i)
    return found


def number_of(subject: Adjustable, name: object) -> Number:
    """Return the number of this name; raise `ParameterError` if there is none."""
    numbers = numbers_of(subject)
    if isinstance(name, str) and name in numbers:
        return numbers[name]
    if any(each.whole == name for each in numbers.values()):
        raise ParameterError(
            f"the elements differ in {name}",
            advice=f"name that of one element, for example {column_name(str(name), 0)!r}",
        )
    raise ParameterError(
        f"there is no number {shown(name)}", advice=f"known here are {', '.join(numbers)}"
    )


def with_numbers(subject: Adjustable, values: Mapping[str, float]) -> Adjustable:
    """Return the same with other numbers."""
    if not values:
        return subject
    numbers = numbers_of(subject)
    parts = ((numbers[name].whole, numbers[name].element, each) for name, each in values.items())
    return subject.varied(subject.joined(parts))
