"""Parameters as data: the name, unit and rule of every number that a chart or a model takes.

A parameter is declared once, next to its chart. The checks and their messages, the keys of
scenario files, the names accepted by a sweep, the assumptions of a proof, and the units in reports
and figures are all derived from that declaration.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.errors import ChartError, GMSError, ParameterError, shown
from gms_fsm.foundation.arguments import refusing, unknown
from gms_fsm.foundation.equality import ByIdentity
from gms_fsm.foundation.quantities import OF_A_ROTATION, in_si, of_rotation

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Chart

FloatArray: TypeAlias = NDArray[np.float64]

ANY = "finite"  # the rule that applies to every number
TINY = 1e-300  # one over a number that is not larger might be infinite
FEW = 16  # numbers that are looked at one by one in less time than NumPy's functions take
_HOLDS: Mapping[str, Callable[[Any, Any], Any]] = {
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
}
_IN_WORDS = {">=": "at least", "<=": "at most", ">": "greater than", "<": "less than"}


@dataclass(frozen=True)
class Bound:
    """One comparison of a rule.

    Parameters
    ----------
    op : {">", ">=", "<", "<="}
        The comparison operator.
    limit : float or str
        A number, or the name of another parameter.
    text : str
        The bound as written, for example ``">= F_c"``.
    """

    op: str
    limit: float | str
    text: str

    def holds(self, value: Any, limit: Any) -> Any:
        """Return whether a number satisfies the bound, or an array of such truth values."""
        return _HOLDS[self.op](value, limit)


@functools.lru_cache(maxsize=256)
def bounds_of(rule: str) -> tuple[Bound, ...]:
    """Return the comparisons in a rule; none for ``"finite"``.

    Examples
    --------
    >>> [(bound.op, bound.limit) for bound in bounds_of("> 0 and <= F_s")]
    [('>', 0.0), ('<=', 'F_s')]
    """
    if rule == ANY:
        return ()
    return tuple(_bound(part.strip(), rule) for part in rule.split(" and "))


@functools.lru_cache(maxsize=256)
def fixed_bounds(rule: str) -> tuple[Bound, ...]:
    """Return the comparisons with numbers in a rule."""
    return tuple(bound for bound in bounds_of(rule) if not isinstance(bound.limit, str))


@functools.lru_cache(maxsize=256)
def _limits(rule: str) -> tuple[tuple[Callable[[Any, Any], Any], Any], ...]:
    """Return the operators and numbers of these comparisons."""
    return tuple((_HOLDS[bound.op], bound.limit) for bound in fixed_bounds(rule))


@functools.lru_cache(maxsize=256)
def relative_bounds(rule: str) -> tuple[Bound, ...]:
    """Return the comparisons with other parameters in a rule."""
    return tuple(bound for bound in bounds_of(rule) if isinstance(bound.limit, str))


def _bound(text: str, rule: str) -> Bound:
    op = next((op for op in _HOLDS if text.startswith(op)), "")
    limit = text.removeprefix(op).strip()
    if op and limit.isidentifier():
        return Bound(op, limit, f"{op} {limit}")
    try:
        number = float(limit) if op else math.nan
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ChartError(
            f"{text!r} is not a bound",
            place=f"rule {rule!r}",
            advice="a rule is 'finite', or comparisons with a number or a parameter, for "
            "example '> 0', '>= F_c', '>= 0 and < 1'",
        )
    return Bound(op, number, f"{op} {limit}")


@refusing(ChartError)
@dataclass(frozen=True)
class Parameter:
    """A number that a chart or a model takes: its name, unit and rule.

    In `Chart.parameters` a plain name stands for a parameter of unknown unit without a rule.

    Parameters
    ----------
    name : str
        For example ``"k"``.
    unit : str
        An SI unit, for example ``"N/m"``; ``"1"`` for a plain number, empty if unknown.
    rule : str
        What its value must satisfy besides being finite: ``"finite"`` (nothing more), or
        comparisons with numbers and other parameters: ``"> 0"``, ``">= F_c"``, ``">= 0 and < 1"``.
    per_element : bool
        Whether the elements of a bank may differ in it: one number per element, or one for all.
        If False, only one number for all is accepted.
    meaning : str
        A short description for messages and tables: ``"bristle stiffness"``.
    assumed : str
        What a proof assumes in place of the rule; only needed if the rule allows a limit at which
        the model degenerates.

    Raises
    ------
    ChartError
        If a rule cannot be read.

    Examples
    --------
    >>> Parameter("F_s", "N", ">= F_c").conditions
    ('F_s >= F_c',)
    """

    name: str
    unit: str = ""
    rule: str = ANY
    per_element: bool = field(default=True, kw_only=True)
    meaning: str = field(default="", kw_only=True)
    assumed: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        for name in ("name", "unit", "rule", "meaning", "assumed"):
            given = getattr(self, name)
            if not isinstance(given, str):
                raise ChartError(
                    f"{name} is {shown(given)}, not a text", place=f"parameter {shown(self.name)}"
                )
        try:
            bounds_of(self.rule)
            bounds_of(self.assumed or ANY)
        except ChartError as error:
            raise error.replaced(place=f"parameter {self.name!r}, {error.place}") from None

    @property
    def bounds(self) -> tuple[Bound, ...]:
        """The comparisons of the rule."""
        return bounds_of(self.rule)

    @property
    def conditions(self) -> tuple[str, ...]:
        """What a proof assumes, as texts in the expression language."""
        return tuple(f"{self.name} {bound.text}" for bound in bounds_of(self.assumed or self.rule))

    @property
    def others(self) -> frozenset[str]:
        """The parameters that its rule refers to."""
        every = (*self.bounds, *bounds_of(self.assumed or ANY))
        return frozenset(bound.limit for bound in every if isinstance(bound.limit, str))

    @property
    def described(self) -> str:
        """A description in one line.

        >>> Parameter("k", "N/m", "> 0", meaning="bristle stiffness").described
        'bristle stiffness, N/m, > 0; one number per element'
        """
        rule = "" if self.rule == ANY else self.rule
        known = ", ".join(part for part in (self.meaning, self.unit, rule) if part)
        return "; ".join(filter(None, (known, "one number per element" * self.per_element)))


# Names with the same meaning in every chart and on every rig.
QUANTITIES: Mapping[str, Parameter] = {
    each.name: each
    for each in (
        Parameter("t", "s", meaning="time"),
        Parameter("x", "m", meaning="position"),
        Parameter("v", "m/s", meaning="velocity"),
        Parameter("s", "m", "> 0", meaning="threshold: weight times Stribeck curve"),
        Parameter("z", "m", meaning="deflection"),
        Parameter("F", "N", meaning="friction force"),
        Parameter("N", "N", meaning="normal force"),
    )
}
# What a model takes in addition to its chart's parameters.
SIGMA_2 = Parameter("sigma_2", "Ns/m", ">= 0", per_element=False, meaning="viscous friction")
WEIGHTS = Parameter("weights", "m/N", "> 0", meaning="threshold weights")
STRIBECK = (
    Parameter("F_c", "N", "> 0", per_element=False, meaning="Coulomb friction"),
    Parameter("F_s", "N", ">= F_c", per_element=False, meaning="stiction"),
    Parameter("v_s", "m/s", "> 0", per_element=False, meaning="Stribeck velocity"),
    # The bounds keep abs(v / v_s)**delta and the width of the dip within the range of floats.
    Parameter("delta", "1", ">= 0.1 and <= 20", per_element=False, meaning="Stribeck exponent"),
)


def with_shared(own: Iterable[Parameter], *, curve: bool) -> tuple[Parameter, ...]:
    """Return a chart's parameters and those shared by all models.

    Examples
    --------
    >>> [each.name for each in with_shared((Parameter("k"), Parameter("F_c")), curve=False)]
    ['k', 'F_c', 'sigma_2']
    """
    shared = (WEIGHTS, SIGMA_2, *STRIBECK) if curve else (SIGMA_2,)
    found: dict[str, Parameter] = {}
    for each in (*own, *shared):
        found.setdefault(each.name, each)
    return tuple(found.values())


# --------------------------------------------------------------------------- rotations
def measured(chart: Chart, rotary: bool, units: tuple[tuple[str, str], ...] = ()) -> Chart:
    """Return an equal chart as a contact of a system measures it: with F in Nm where it turns.

    >>> from gms_fsm.charts import LUGRE
    >>> turning = measured(LUGRE, True, (("sigma_1", "Nms"),))
    >>> [turning.unit(name) for name in ("sigma_0", "sigma_1", "v", "z")], turning == LUGRE
    (['Nm/rad', 'Nms', 'rad/s', 'rad'], True)
    """
    same = (chart.rotary, chart.units) == (rotary, units)
    return chart if same else _measured(ByIdentity(chart), rotary, units)


@functools.lru_cache(maxsize=256)  # caches know charts by identity: one for each use
def _measured(chart: ByIdentity[Chart], rotary: bool, units: tuple[tuple[str, str], ...]) -> Chart:
    other = copy(chart.it)
    object.__setattr__(other, "rotary", rotary)
    object.__setattr__(other, "units", units)
    return other


def adapted(parameter: Parameter, chart: Chart) -> Parameter:
    """Return a parameter, of a chart or shared by models, with the unit in which it is measured.

    That is the declared one; else, where the contact turns, one of rotations. A chart that writes
    such units itself means what it writes; a normal force stays a force.
    """
    name, unit = parameter.name, parameter.unit
    if (given := dict(chart.units).get(name)) is not None:
        return replace(parameter, unit=given)
    if not chart.rotary or (name, unit) == ("N", "N"):
        return parameter
    meant = name in chart.parameter_names and any(
        OF_A_ROTATION.search(each.unit) for each in chart.parameters
    )
    return parameter if meant else replace(parameter, unit=of_rotation(unit))


# --------------------------------------------------------------------------- checks
def checked_scalar(name: str, value: Any, rule: str) -> float:
    """Return a value as a float if it is finite and satisfies a rule."""
    if type(value) is float and math.isfinite(value):
        for holds, limit in _limits(rule):
            if not holds(value, limit):
                break
        else:
            return value
    try:
        if isinstance(value, str | bytes):  # float("100") is a number
            raise TypeError
        number = float(value)
    except (TypeError, ValueError):
        plain = in_si(value) if isinstance(value, str) else ""
        form = f", without quotes and in SI units: {plain}" if plain else ""
        raise ParameterError(f"it must be a number{form}", place=name, value=value) from None
    except OverflowError:  # an integer too large for a float
        raise ParameterError("it is too large", place=name, advice="it must be finite") from None
    if not math.isfinite(number):
        raise ParameterError("it must be finite", place=name, value=number)
    for bound in fixed_bounds(rule):
        if not bound.holds(number, bound.limit):
            raise ParameterError(f"it must be {bound.text}", place=name, value=number)
    return number


def finite_numbers(given: Mapping[str, Any], here: str) -> dict[str, float]:
    """Return numbers by name as floats if all of them are finite."""
    for value in given.values():
        if type(value) is not float or not math.isfinite(value):
            return {name: checked_scalar(f"{here}: {name}", u, ANY) for name, u in given.items()}
    return dict(given)


def check_rules(parameters: Sequence[Parameter], here: str) -> None:
    """Refuse rules that name what is not another parameter."""
    names = [each.name for each in parameters]
    for i, each in enumerate(parameters):
        known = sorted({*names} - {each.name})
        for name in sorted(each.others - {*known}):
            raise ChartError(
                f"{here}, parameter {each.name!r}: its rule names {name!r}, "
                "which is not another parameter",
                advice=f"there are {', '.join(map(repr, known)) or 'none'}",
                key=("parameters", i, "rule"),
            )


def check_names(
    parameters: Iterable[Parameter],
    given: Iterable[str],
    place: str,
    kind: type[GMSError] = ParameterError,
) -> None:
    """Refuse values of which one has no parameter, or of which a parameter has none."""
    known, names = {each.name: each for each in parameters}, [*given]
    for name in names:
        if name not in known:
            raise unknown("parameter", name, known, kind, place=place)
    lacking = [f"{name} [{each.unit}]" for name, each in known.items() if name not in names]
    if lacking:
        text = ", ".join(each.removesuffix(" []") for each in lacking)
        raise kind(f"no value is given for {text}", place=place, advice="give each one")


def checked_array(name: str, values: ArrayLike, n: int | None, rule: str) -> FloatArray:
    """Return a read-only copy, shape (n,), if every entry is finite and satisfies a rule."""
    array = as_numbers(name, values)
    if array.ndim != 1 or array.size == 0:
        raise ParameterError(f"{name} has shape {array.shape}", advice=_flat(array))
    if n is not None and array.size != n:
        if n == 1:
            raise ParameterError(
                f"{name} has {array.size} entries, but there is 1 element",
                advice=f"give one number, or the number of elements, n={array.size}",
            )
        raise ParameterError(
            f"{name} has {array.size} entries, but there are {n} elements",
            advice="give one number for each element",
        )
    if array.size <= FEW:
        numbers = array.tolist()
        sound = all(map(math.isfinite, numbers))
        for holds, limit in _limits(rule):
            for number in numbers:
                sound = sound and holds(number, limit)
    else:
        sound = all(bool(holds(array, limit).all()) for holds, limit in _limits(rule))
        sound = sound and bool(np.isfinite(array).all())
    if not sound:
        for i, number in enumerate(array.tolist()):  # the first one is refused
            checked_scalar(f"{name}[{i}] (element {i + 1})", number, rule)
    array.setflags(write=False)
    return array


def _flat(array: FloatArray) -> str:
    """Return the advice on an array that is no flat list."""
    if array.ndim == 0 and np.isfinite(array):
        return f"it must be a list of numbers, such as [{array.item():g}, {array.item():g}]"
    ravel = "; numpy.ravel makes one" if 0 < array.size == max(array.shape, default=0) else ""
    return f"it must be a flat list of numbers, not empty{ravel}"


def as_numbers(name: str, values: ArrayLike) -> FloatArray:
    """Return a copy as an array of floats of any shape; raise a `ParameterError` if impossible."""
    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ParameterError("it must be a list of numbers", place=name, value=values) from None
    except OverflowError:
        raise ParameterError(
            "a number in it is too large", place=name, advice="it must be finite"
        ) from None


def checked_values(
    parameters: Iterable[Parameter], values: Mapping[str, Any], n: int = 1
) -> dict[str, float | FloatArray]:
    """Return the values of parameters if all of them satisfy their rules.

    Examples
    --------
    >>> curve = Parameter("F_c", "N", "> 0"), Parameter("F_s", "N", ">= F_c")
    >>> checked_values(curve, {"F_c": 1, "F_s": 1.5})
    {'F_c': 1.0, 'F_s': 1.5}
    >>> checked_values(curve, {"F_c": 1, "F_s": 0.5})
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: F_s is 0.5, F_c is 1.0; F_s must be at least F_c (F_s >= F_c)
    """
    known = {each.name: each for each in parameters}
    checked = {name: _checked(each, values[name], n) for name, each in known.items()}
    for each in known.values():
        for bound in relative_bounds(each.rule):
            if (other := known.get(str(bound.limit))) is not None:
                _compare(each, other, bound, checked)
    return checked


def _checked(parameter: Parameter, value: Any, n: int) -> float | FloatArray:
    name, rule = parameter.name, parameter.rule
    if not is_list(value):
        return checked_scalar(name, value, rule)
    if not parameter.per_element:
        raise ParameterError("it must be a number, one for all elements", place=name, value=value)
    return checked_array(name, value, n, rule)


def is_list(value: Any) -> bool:
    """Return whether a value is not one number, but several."""
    if isinstance(value, float):
        return False
    try:
        return np.ndim(value) > 0
    except ValueError:  # rows of different lengths
        return True


def _compare(
    one: Parameter, other: Parameter, bound: Bound, values: Mapping[str, float | FloatArray]
) -> None:
    """Check a bound that refers to another parameter."""
    held = bound.holds(values[one.name], values[other.name])
    if held is True or np.all(held):
        return
    pair = np.broadcast_arrays(values[one.name], values[other.name])
    value, limit = (np.atleast_1d(each) for each in pair)
    for i in np.flatnonzero(~bound.holds(value, limit))[:1]:
        place = f"[{i}] (element {i + 1})" if pair[0].ndim else ""
        least = f"the {other.meaning}" if other.meaning else other.name
        raise ParameterError(
            f"{one.name}{place} is {float(value[i])!r}, {other.name}{place} is {float(limit[i])!r}",
            advice=f"{one.meaning or one.name} must be {_IN_WORDS[bound.op]} {least} ({one.name} "
            f"{bound.text})",
        )


def as_floats(values: FloatArray) -> list[float]:
    """Return plain Python floats; the readable engine is three times as fast with lists."""
    floats: list[float] = values.tolist()
    return floats
