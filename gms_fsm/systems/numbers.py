"""The numbers of what runs, by name: a system's, or those of a model and of its rig."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.gms import GMS_ELEMENT
from gms_fsm.charts.parameters import SIGMA_2, WEIGHTS, FloatArray, Parameter
from gms_fsm.errors import ParameterError
from gms_fsm.systems._parts import Contact
from gms_fsm.systems.models import GMS, ChartModel, Model, parameters_of, with_values
from gms_fsm.systems.rigs import Rig, numbers_of, with_numbers
from gms_fsm.systems.system import System

__all__ = ["Adjustable"]

NUMBERS = "numbers"


@dataclass(frozen=True, eq=False)
class Adjustable:
    """A system, a model on a rig, or a model alone, whose numbers can be replaced.

    Numbers of a system are called ``"numbers.m"``, those of its contact pad ``"pad.F_s"``.

    Parameters
    ----------
    what : Model or System
        As the user gave it.
    rig : Rig, optional
        What a model is mounted on.

    Examples
    --------
    >>> from gms_fsm import Body
    >>> from gms_fsm.charts import CHARTS
    >>> pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0})
    >>> mass = Body("mass", inertia="m", force="2 * t")
    >>> one = Adjustable(System("one", bodies=(mass,), contacts=(pad,), numbers={"m": 1.0}))
    >>> list(one.known), one.varied({"pad.F_s": 2.0}).value("pad.F_s")
    (['numbers.m', 'pad.F_c', 'pad.F_s', 'pad.b'], 2.0)
    """

    what: Model | System
    rig: Rig | None = None

    @property
    def known(self) -> dict[str, tuple[Parameter, int]]:
        """By name: the parameter, and for how many elements it can differ (0: one number)."""
        if not isinstance(self.what, System):
            rig = () if self.rig is None else numbers_of(self.rig)
            return _known(self.what) | {each.name: (each, 0) for each in rig}
        found = {f"{NUMBERS}.{name}": (Parameter(name), 0) for name in self.what.numbers}
        for contact in self.what.contacts:
            for name, each in _known(contact).items():
                found.setdefault(f"{contact.name}.{name}", each)
        return found

    def value(self, name: str) -> float | FloatArray:
        """Return the present value of a number by its name in `known`."""
        if not isinstance(self.what, System):
            rig = {} if self.rig is None else self.rig.numbers
            return rig[name] if name in rig else _value_in(self.what, name)
        owner, _, own = name.partition(".")
        if owner == NUMBERS:
            return self.what.numbers[own]
        return _value_in(self.what.contact(owner), own)

    def joined(self, parts: Iterable[tuple[str, int | None, float]]) -> dict[str, Any]:
        """Return values by name: a number, or an array where some are those of one element."""
        known, found = self.known, dict[str, Any]()
        for name, element, value in parts:
            if element is None:
                found[name] = float(value)
                continue
            if np.ndim(found.get(name, 0.0)) == 0:
                present = np.asarray(found.get(name, self.value(name)), dtype=float)
                found[name] = np.broadcast_to(present, known[name][1]).copy()
            found[name][element] = value
        return found

    def varied(self, values: Mapping[str, ArrayLike]) -> Adjustable:
        """Return the same with other numbers; a `ParameterError` if one breaks its rule."""
        if not values:
            return self
        if not isinstance(self.what, System):
            rig = None if self.rig is None else with_numbers(self.rig, values)
            return Adjustable(with_values(self.what, values), rig)
        groups: dict[str, dict[str, Any]] = {}
        for name, value in values.items():
            owner, _, own = name.partition(".")
            groups.setdefault(owner, {})[own] = value
        contacts = tuple(
            each.with_values(groups[each.name]) if each.name in groups else each
            for each in self.what.contacts
        )
        numbers = {**self.what.numbers, **groups.get(NUMBERS, {})}
        return Adjustable(replace(self.what, contacts=contacts, numbers=numbers))

    @property
    def contacts(self) -> tuple[Model | Contact, ...]:
        """What has elements."""
        return self.what.contacts if isinstance(self.what, System) else (self.what,)

    @property
    def title(self) -> str:
        """The model's title, or the system's name."""
        return self.what.name if isinstance(self.what, System) else self.what.title

    @property
    def law(self) -> str | None:
        """The slip law of the GMS model, or of the first one in a system; None without."""
        models = (each.model if isinstance(each, Contact) else each for each in self.contacts)
        return next((law for each in models if (law := _law_of(each)) is not None), None)

    def with_law(self, law: str) -> Adjustable:
        """Return the same with another slip law; raise `ParameterError` if there is none."""
        if law not in GMS_ELEMENT:
            known = " or ".join(map(repr, GMS_ELEMENT))
            raise ParameterError(f"it must be {known}", place="law", value=law)
        if self.law is None:
            raise ParameterError("only a GMS model has a slip law", place="law", value=law)
        if not isinstance(self.what, System):
            return replace(self, what=_lawful(self.what, law))
        contacts = tuple(
            each if each.model is None else each.with_model(_lawful(each.model, law))
            for each in self.what.contacts
        )
        return Adjustable(replace(self.what, contacts=contacts))


def _known(each: Model | Contact) -> dict[str, tuple[Parameter, int]]:
    """Return the parameters of a model or a contact that can be varied, as `Adjustable.known`."""
    model = each.model if isinstance(each, Contact) else each
    found: dict[str, tuple[Parameter, int]] = {}
    for own in each.chart.parameters if model is None else parameters_of(model):
        wide = own.name == WEIGHTS.name or np.ndim(each.values.get(own.name, 0.0)) > 0
        found.setdefault(own.name, (own, each.n if wide else 0))
    return found


def _value_in(each: Model | Contact, name: str) -> float | FloatArray:
    """Return the value of a parameter; the chart's own one takes precedence."""
    if name in each.values:
        return each.values[name]
    if name == WEIGHTS.name:
        return each.weights
    if name == SIGMA_2.name:
        return each.sigma_2
    assert each.stribeck is not None  # else the name would not be known
    return float(getattr(each.stribeck, name))


def _law_of(model: Model | None) -> str | None:
    """Return the slip law of a GMS model, also of one from a file, which is its chart."""
    if model is None:
        return None
    return next((law for law, chart in GMS_ELEMENT.items() if model.chart == chart), None)


def _lawful(model: Model, law: Any) -> Model:
    if isinstance(model, GMS):
        return GMS(model.parameters, law=law)
    was = _law_of(model)
    if was is None or not isinstance(model, ChartModel):
        return model
    title = model.title.replace(f"{was} law", f"{law} law")
    return replace(model, chart=GMS_ELEMENT[law], title=title)
