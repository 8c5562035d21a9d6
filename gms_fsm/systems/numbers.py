"""The numbers of what runs, read and written by name: by sweeps, fits, sessions and pages.

Those of a system are called ``numbers.m`` and ``gear.k``, those of a model on a rig ``stiffness``
and ``k``; ``k2`` is k of the second element.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.gms import GMS_ELEMENT
from gms_fsm.charts.parameters import SIGMA_2, WEIGHTS, FloatArray, Parameter, adapted
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import one_of, unknown
from gms_fsm.systems.gms_parameters import GMSParameters
from gms_fsm.systems.models import GMS, ChartModel, Model, parameters_of
from gms_fsm.systems.mounted import Mounted, mounted
from gms_fsm.systems.parts import Contact
from gms_fsm.systems.reading.values import CURVE, MODEL, WEIGHT, of
from gms_fsm.systems.rigs import with_numbers as with_numbers_of_rig

NUMBERS = "numbers"  # the owner of those that belong to no contact


@dataclass(frozen=True)
class NamedNumber:
    """A number that can be changed by itself.

    Parameters
    ----------
    name : str
        Its own: ``"k2"``.
    parameter : Parameter
        Its unit, rule and meaning.
    value : float
        The present value.
    whole : str
        Name of the parameter that it is a part of: ``"k"``.
    element : int or None
        Element index, from 0, if it is the value of one element; None if it is that of all.
    """

    name: str
    parameter: Parameter
    value: float
    whole: str
    element: int | None


def column_name(name: str, i: int) -> str:
    """Return the name of a quantity of element i: z1, but z1_1 for a variable called z1."""
    return f"{name}{'_' if name[-1].isdigit() or name[-1] == '_' else ''}{i + 1}"


# --------------------------------------------------------------------------- whole parameters
def known_in(what: Mounted) -> dict[str, tuple[Parameter, int]]:
    """Return all numbers by name.

    Examples
    --------
    >>> from gms_fsm import Body, Contact, System
    >>> from gms_fsm.charts import CHARTS
    >>> pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0})
    >>> mass = Body("mass", inertia="m", force="2 * t")
    >>> one = mounted(System("one", bodies=(mass,), contacts=(pad,), numbers={"m": 1.0}))
    >>> list(known_in(one)), value_in(varied(one, {"pad.F_s": 2.0}), "pad.F_s")
    (['numbers.m', 'pad.F_c', 'pad.F_s', 'pad.b'], 2.0)
    """
    units = {each.name: each for each in getattr(what.rig, "parameters", ())}
    rest = {
        what.of(NUMBERS, name): (
            units.get(name, Parameter(name, what.system.units.get(name, ""))),
            0,
        )
        for name in what.rig.numbers
    }
    found = dict(rest) if what.named else {}
    for contact in what.system.machines:
        for name, each in _known(contact).items():
            found.setdefault(what.of(contact.name, name), each)
    return found | rest


def value_in(what: Mounted, name: str) -> float | FloatArray:
    """Return the present value of a number by its name in `known_in`."""
    owner, own = _owner(what, name)
    if owner == NUMBERS:
        return what.rig.numbers[own]
    each = what.system.contact(owner)
    if own in each.values:  # the chart's own one takes precedence
        return each.values[own]
    if own == WEIGHTS.name:
        return each.weights
    if own == SIGMA_2.name:
        return each.sigma_2
    assert each.stribeck is not None  # else the name would not be known
    return float(getattr(each.stribeck, own))


def label_in(what: Mounted, name: str) -> str:
    """Return what the trees call a number by its name in `known_in`, as `value_in` finds it."""
    owner, own = _owner(what, name)
    if owner == NUMBERS:
        return own
    if own in what.system.contact(owner).values:
        return of(owner, own)
    special = {WEIGHTS.name: WEIGHT, SIGMA_2.name: f"{MODEL}{own}"}
    return of(owner, special.get(own, f"{CURVE}{own}"))


def varied(what: Mounted, values: Mapping[str, ArrayLike]) -> Mounted:
    """Return the same with other numbers; a `ParameterError` if one breaks its rule."""
    if not values:
        return what
    groups: dict[str, dict[str, Any]] = {}
    for name, given in values.items():
        owner, own = _owner(what, name)
        groups.setdefault(owner, {})[own] = given
    machines = tuple(
        each.with_values(groups[each.name]) if each.name in groups else each
        for each in what.system.machines
    )
    return _remade(what, machines, groups.get(NUMBERS, {}))


def _remade(
    what: Mounted, machines: tuple[Contact, ...], numbers: Mapping[str, ArrayLike]
) -> Mounted:
    """Return the same with other contacts and supervisors, and some other numbers."""
    count = len(what.system.contacts)
    contacts, supervisors = machines[:count], machines[count:]
    if what.named:
        every: Any = {**what.system.numbers, **numbers}
        parts: Any = {"contacts": contacts, "supervisors": supervisors, "numbers": every}
        return mounted(replace(what.system, **parts))
    model = contacts[0].model
    assert model is not None
    return mounted(model, with_numbers_of_rig(what.rig, numbers), contacts[0].period)


def _owner(what: Mounted, name: str) -> tuple[str, str]:
    """Return the contact that a number belongs to, or `NUMBERS`, and its name there."""
    if what.named:
        owner, _, own = name.partition(".")
        return owner, own
    return NUMBERS if name in what.rig.numbers else what.system.machines[0].name, name


def _known(contact: Contact) -> dict[str, tuple[Parameter, int]]:
    """Return the parameters of a contact, as `known_in`."""
    model, found = contact.model, dict[str, tuple[Parameter, int]]()
    every = contact.chart.parameters if model is None else parameters_of(model)
    for own in (adapted(each, contact.chart) for each in every):
        wide = own.name == WEIGHTS.name or np.ndim(contact.values.get(own.name, 0.0)) > 0
        found.setdefault(own.name, (own, contact.n if wide else 0))
    return found


# --------------------------------------------------------------------------- single numbers
def _parts(what: Mounted, whole: str, parameter: Parameter, n: int) -> list[NamedNumber]:
    """Return a parameter as numbers: one, or one for each element."""
    values = np.ravel(np.broadcast_to(np.asarray(value_in(what, whole), dtype=float), n or ()))
    if not n:
        return [NamedNumber(whole, parameter, float(values[0]), whole, None)]
    return [
        NamedNumber(column_name(whole, i), parameter, each, whole, i)
        for i, each in enumerate(values.tolist())
    ]


def parts_of(what: Mounted, name: object) -> list[NamedNumber]:
    """Return the numbers that a name stands for: k1, k2 ... for k; none if nothing is called so."""
    for whole, (parameter, n) in known_in(what).items():
        parts = _parts(what, whole, parameter, n)
        if found := [each for each in parts if name in (whole, each.name)]:
            return found
    return []


def numbers_of(what: Mounted) -> dict[str, NamedNumber]:
    """Return the numbers by name, such as ``"F_s"``, ``"k2"`` and ``"stiffness"``.

    A name without the number of an element stands for all elements; it is absent if they differ.
    """
    found: dict[str, NamedNumber] = {}
    for whole, (parameter, n) in known_in(what).items():
        parts = _parts(what, whole, parameter, n)
        if len({each.value for each in parts}) == 1:
            found[whole] = replace(parts[0], name=whole, element=None)
        if n > 1:
            found |= {each.name: each for each in parts}
    return found


def number_of(what: Mounted, name: object) -> NamedNumber:
    """Return the number of this name; raise `ParameterError` if there is none."""
    return number_in(numbers_of(what), name)


def number_in(numbers: Mapping[str, NamedNumber], name: object) -> NamedNumber:
    """Return the one of this name among all numbers of a system, as `number_of`."""
    if isinstance(name, str) and name in numbers:
        return numbers[name]
    if any(each.whole == name for each in numbers.values()):
        raise ParameterError(
            f"the elements differ in {name}",
            advice=f"name that of one element, for example {column_name(str(name), 0)!r}",
        )
    raise unknown("number", name, numbers)


def with_numbers(what: Mounted, values: Mapping[str, float]) -> Mounted:
    """Return the same with other single numbers."""
    if not values:
        return what
    numbers = numbers_of(what)
    parts = ((numbers[name].whole, numbers[name].element, each) for name, each in values.items())
    return varied(what, joined(what, parts))


def joined(what: Mounted, parts: Iterable[tuple[str, int | None, float]]) -> dict[str, Any]:
    """Return values by name: a number, or an array where some are those of one element."""
    names, found = known_in(what), dict[str, Any]()
    for name, element, each in parts:
        if element is None:
            found[name] = float(each)
            continue
        if np.ndim(found.get(name, 0.0)) == 0:
            present = np.asarray(found.get(name, value_in(what, name)), dtype=float)
            found[name] = np.broadcast_to(present, names[name][1]).copy()
        found[name][element] = each
    return found


# --------------------------------------------------------------------------- numbers in guards
def with_named_constants(what: Mounted) -> tuple[Mounted, frozenset[str]]:
    """Return the same with parameters in place of the numbers in guards, and their names."""
    from gms_fsm.charts.constants import named_constants  # reads charts as files are: pydantic

    names: set[str] = set()

    def named(each: Contact) -> Contact:
        chart, more = named_constants(each.chart)
        fields: Any = {"chart": chart, "values": {**each.values, **more}}
        if not more or not isinstance(each.model, ChartModel | None):
            return each
        names.update(what.of(each.name, name) for name in more)
        if each.model is None:
            return each.replaced(**fields)
        return each.with_model(replace(each.model, **fields))

    machines = tuple(map(named, what.system.machines))
    return (_remade(what, machines, {}) if names else what), frozenset(names)


# --------------------------------------------------------------------------- the slip law
def law_of(what: Mounted) -> str | None:
    """Return the slip law of the first GMS model; None without."""
    laws = (_law_of(each.model) for each in what.system.machines)
    return next((each for each in laws if each is not None), None)


def with_law(what: Mounted, law: str) -> Mounted:
    """Return the same with another slip law; raise `ParameterError` if there is none."""
    one_of("law", law, GMS_ELEMENT)
    if law_of(what) is None:
        raise ParameterError("only a GMS model has a slip law", place="law", value=law)
    contacts = tuple(
        each if each.model is None else each.with_model(_lawful(each.model, law))
        for each in what.system.machines
    )
    return _remade(what, contacts, {})


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


# --------------------------------------------------------------------------- elements
def elements_of(what: Mounted) -> int | None:
    """Return the number of elements of the first GMS model; None without."""
    return next((each.n for each in what.system.machines if _law_of(each.model)), None)


def with_elements(what: Mounted, count: int) -> Mounted:
    """Return the same with so many elements in the first GMS model: the last go, or are repeated.

    Examples
    --------
    >>> from gms_fsm import GMSParameters
    >>> from gms_fsm.systems.rigs import Prescribed
    >>> bank = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> with_elements(mounted(bank, Prescribed("0.1")), 5).model.values["C"].tolist()
    [0.1, 0.05, 0.025, 0.0001, 0.0001]
    """
    first = next((each for each in what.system.machines if _law_of(each.model)), None)
    if first is None:
        raise ParameterError("only a GMS model has elements to add", place="count", value=count)
    contacts = tuple(
        each.with_model(_sized(each.model, count)) if each is first else each
        for each in what.system.machines
    )
    return _remade(what, contacts, {})


def _sized(model: Model | None, count: int) -> Model:
    """Return a GMS model with another number of elements."""

    def sized(values: FloatArray) -> FloatArray:
        return values[np.minimum(np.arange(count), values.size - 1)]

    if isinstance(model, GMS):
        p = model.parameters
        arrays: Any = {name: sized(getattr(p, name)) for name in ("k", "sigma", "C", "weights")}
        shared: Any = {name: getattr(p, name) for name in ("sigma_2", "stribeck", "v_c")}
        return GMS(GMSParameters(**arrays, **shared), law=model.law)
    assert isinstance(model, ChartModel)
    values = {k: sized(u) if np.ndim(u) else u for k, u in model.values.items()}  # type: ignore
    return replace(model, values=values, weights=sized(model.weights), n=count)
