"""The numbers of what runs that can be adjusted one by one, and its slip law."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from gms_fsm.charts.gms import GMS_ELEMENT
from gms_fsm.charts.parameters import Parameter
from gms_fsm.errors import ParameterError, shown
from gms_fsm.systems._varied import NUMBERS, numbers_in, with_numbers_of
from gms_fsm.systems.models import GMS, Model, parameters_of, with_values
from gms_fsm.systems.rigs import Rig, numbers_of, with_numbers
from gms_fsm.systems.system import Contact, System
from gms_fsm.traces.rows import column_name

__all__ = ["Number", "Subject"]


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


@dataclass(frozen=True, eq=False)
class Subject:
    """What runs: a model on a rig, or a system (then the rig is None)."""

    model: Model | System
    rig: Rig | None

    @property
    def numbers(self) -> dict[str, Number]:
        """The numbers by name, such as ``"F_s"``, ``"k2"`` and ``"stiffness"``.

        Those of a system are called ``"numbers.m"`` and ``"gear.k2"``. A name without the number of
        an element stands for all elements; it is absent if they differ.
        """
        found: dict[str, Number] = {}
        for name, parameter, value in self._values():
            values = np.asarray(value, dtype=np.float64)
            if values.ndim == 0 or (values == values.flat[0]).all():
                found[name] = Number(parameter, float(values.flat[0]), name, None)
            if values.ndim and values.size > 1:
                for i, each in enumerate(values.tolist()):
                    found[column_name(name, i)] = Number(parameter, each, name, i)
        return found

    def _values(self) -> Iterator[tuple[str, Parameter, Any]]:
        if isinstance(self.model, System):
            for name, (parameter, _) in numbers_in(self.model).items():
                owner, _, own = name.partition(".")
                if owner == NUMBERS:
                    yield name, parameter, self.model.numbers[own]
                else:
                    yield name, parameter, _value_in(self.model.contact(owner), own)
            return
        for parameter in parameters_of(self.model):
            yield parameter.name, parameter, _value_in(self.model, parameter.name)
        assert self.rig is not None
        for parameter in numbers_of(self.rig):
            yield parameter.name, parameter, self.rig.numbers[parameter.name]

    def check(self, name: object) -> Number:
        """Return the number of this name; raise `ParameterError` if there is none."""
        numbers = self.numbers
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

    def with_numbers(self, values: Mapping[str, float]) -> Subject:
        """Return the same with other numbers."""
        if not values:
            return self
        given: dict[str, Any] = {}
        numbers = self.numbers
        for name, value in values.items():
            number = numbers[name]
            if number.element is None:
                given[name] = value
                continue
            if number.whole not in given or np.ndim(given[number.whole]) == 0:
                n = sum(
                    each.whole == number.whole and each.element is not None
                    for each in numbers.values()
                )
                each = [numbers[column_name(number.whole, i)].value for i in range(n)]
                given[number.whole] = [given[number.whole]] * n if number.whole in given else each
            given[number.whole][number.element] = value
        if isinstance(self.model, System):
            return Subject(with_numbers_of(self.model, given), None)
        assert self.rig is not None
        return Subject(with_values(self.model, given), with_numbers(self.rig, given))

    @property
    def law(self) -> str | None:
        """The slip law of the GMS model, or of the first one in a system; None without."""
        return next((each.law for each in _banks(self.model)), None)

    def with_law(self, law: str) -> Subject:
        """Return the same with another slip law; raise `ParameterError` if there is none."""
        if law not in GMS_ELEMENT:
            known = " or ".join(map(repr, GMS_ELEMENT))
            raise ParameterError(f"it must be {known}", place="law", value=law)
        if self.law is None:
            raise ParameterError("only a GMS model has a slip law", place="law", value=law)
        if not isinstance(self.model, System):
            return Subject(_lawful(self.model, law), self.rig)
        contacts = [
            each
            if each.model is None
            else Contact(each.name, _lawful(each.model, law), v=each.v, period=each.period)
            for each in self.model.contacts
        ]
        return Subject(replace(self.model, contacts=tuple(contacts)), None)


def _value_in(model: Model | Contact, name: str) -> Any:
    """Return the value of a parameter; the chart's own one takes precedence."""
    curve = model.stribeck
    shared = {} if curve is None else {**asdict(curve), "weights": model.weights}
    return {"sigma_2": model.sigma_2, **shared, **model.values}[name]


def _banks(model: Model | System) -> list[GMS]:
    if isinstance(model, System):
        return [each.model for each in model.contacts if isinstance(each.model, GMS)]
    return [model] if isinstance(model, GMS) else []


def _lawful(model: Model, law: Any) -> Model:
    return GMS(model.parameters, law=law) if isinstance(model, GMS) else model
