"""What a fit varies: the numbers of a model or a system by name, and coordinates to search in.

A positive number is searched by its logarithm, a number with a lower bound that is another number
(``F_s >= F_c``) by the logarithm of its relative excess, any other linearly.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray, Parameter, checked_scalar
from gms_fsm.errors import ParameterError, keyed, shown
from gms_fsm.foundation.arguments import unknown
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import NamedNumber, joined, known_in, parts_of, value_in

SPAN = 1e3  # by default a positive number is searched from 1/1000 to 1000 times its start
LEAST_EXCESS, MOST_EXCESS = 1e-3, 20.0  # of F_s over F_c, relative
LINEAR_SPAN = 100.0  # times the start


@dataclass(frozen=True)
class Unknown:
    """A number to be found."""

    name: str  # as in tables: ``k1``, ``F_c``, ``gear.k2``
    key: str  # the parameter's name in the model: ``k``
    element: int | None  # counted from 0; None for a number that all elements share
    parameter: Parameter  # unit, rule and meaning
    start: float  # the value at which a search starts
    low: float = -math.inf  # bounds of the search
    high: float = math.inf  # bounds of the search
    other: str = ""  # the parameter that is its lower bound, if any

    @cached_property
    def positive(self) -> bool:
        """Whether its rule and its start make it positive."""
        limits = [b.limit for b in self.parameter.bounds if b.op in (">", ">=")]
        return self.start > 0.0 and any(not isinstance(x, str) and x >= 0.0 for x in limits)

    @cached_property
    def kind(self) -> str:
        """How it is searched: ``"excess"``, ``"log"`` or ``"linear"``."""
        if self.other:
            return "excess"
        return "log" if self.positive else "linear"

    @cached_property
    def least(self) -> float:
        """The smallest value its rule allows, -inf if there is none."""
        limits = [b.limit for b in self.parameter.bounds if b.op in (">", ">=")]
        return max((x for x in limits if not isinstance(x, str)), default=-math.inf)


def unknowns_of(
    subject: Mounted,
    free: Iterable[str],
    tied: Sequence[str],
    bounds: Mapping[str, tuple[float, float]],
) -> tuple[Unknown, ...]:
    """Return the numbers to be found, from their names."""
    found: dict[str, Unknown] = {}
    for name in free:
        for each in _named(subject, name, tied):
            if each.name in found:
                raise ParameterError(f"{each.name!r} is given twice", place="free")
            found[each.name] = each
    for name in tied:
        if not any(each.key == name and each.element is None for each in found.values()):
            raise ParameterError(
                f"{shown(name)} is not among the free parameters",
                place="tied",
                advice=f"free are {', '.join(found) or 'none'}",
            )
    bounded = dict(found)
    for name, pair in bounds.items():
        hit = [key for key, each in found.items() if name in (key, each.key)]
        if not hit:
            raise ParameterError(
                f"{shown(name)} is not among the free parameters",
                place="bounds",
                key=("bounds", name),
                advice=f"free are {', '.join(found) or 'none'}",
            )
        for key in hit:
            other = found[key].other
            base = float(np.min(value_in(subject, other))) if other else 0.0
            with keyed("bounds", name):
                bounded[key] = _bounded(found[key], pair, base)
    return tuple(bounded.values())


def _named(subject: Mounted, name: str, tied: Sequence[str]) -> list[Unknown]:
    """Return the unknowns that one name stands for."""
    found = parts_of(subject, name)
    if not found:
        error = unknown("parameter", name, known_in(subject), place="free")
        raise error.replaced(advice=f"{error.advice}; k2 is k of the second element")
    if name in tied and found[0].whole == name:
        mean = float(np.mean(value_in(subject, name)))
        found = [replace(found[0], name=name, value=mean, element=None)]
    return [
        Unknown(
            each.name,
            each.whole,
            each.element,
            each.parameter,
            each.value,
            other=_lower_bound(subject, each),
        )
        for each in found
    ]


def _lower_bound(subject: Mounted, number: NamedNumber) -> str:
    """Return the name of the number that is the lower bound of another, if there is one."""
    lead, dot, _ = number.whole.rpartition(".")
    names = known_in(subject)
    for bound in number.parameter.bounds:
        if isinstance(bound.limit, str) and bound.op in (">", ">="):
            other = f"{lead}{dot}{bound.limit}"
            if other in names and float(np.min(value_in(subject, other))) > 0.0:
                return other
    return ""


def _bounded(unknown: Unknown, pair: Any, base: float) -> Unknown:
    try:
        low, high = pair
    except (TypeError, ValueError):
        raise ParameterError(
            "it must be a pair of numbers (lowest, highest)",
            place=f"bounds of {unknown.name!r}",
            value=pair,
        ) from None
    low = checked_scalar(f"bounds of {unknown.name!r}: lowest", low, "finite")
    high = checked_scalar(f"bounds of {unknown.name!r}: highest", high, "finite")
    if not low < high:
        raise ParameterError(
            f"the lowest value {low!r} is not below the highest {high!r}",
            place=f"bounds of {unknown.name!r}",
        )
    if high <= unknown.least:
        raise ParameterError(
            f"the highest value is {high!r}",
            place=f"bounds of {unknown.name!r}",
            advice=f"its rule is {unknown.parameter.rule!r}",
        )
    if unknown.other and high <= base:
        raise ParameterError(
            f"the highest value is {high!r}, and {unknown.other} is {base!r}",
            place=f"bounds of {unknown.name!r}",
            advice=f"its rule is {unknown.parameter.rule!r}",
        )
    return replace(unknown, low=low, high=high, start=min(max(unknown.start, low), high))


# --------------------------------------------------------------------------- coordinates
@dataclass(frozen=True, eq=False)
class Coordinates:
    """The map between the numbers and the coordinates u in which they are searched."""

    subject: Mounted  # supplies all numbers that are not searched
    unknowns: tuple[Unknown, ...]  # what is searched

    @property
    def start(self) -> FloatArray:
        """The coordinates of the start, within the bounds."""
        low, high = self.limits
        found = [self._coordinate(each, each.start) for each in self.unknowns]
        inside: FloatArray = np.clip(np.array(found, dtype=float), low, high)
        return inside

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """The lowest and the highest coordinates, shape (unknowns,)."""
        pairs = [self._limits(each) for each in self.unknowns]
        return np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])

    def _limits(self, each: Unknown) -> tuple[float, float]:
        if each.kind == "excess":
            least, most = math.log(LEAST_EXCESS), math.log(MOST_EXCESS)
            base = self._base(each)
            if each.low > base:
                least = math.log(max(each.low / base - 1.0, LEAST_EXCESS))
            if math.isfinite(each.high):
                most = math.log(max(each.high / base - 1.0, 2.0 * LEAST_EXCESS))
            return least, max(most, least + 1e-3)
        if each.kind == "log":
            rules = [b.limit for b in each.parameter.bounds if b.op in ("<", "<=")]
            most = min([SPAN * each.start, *(x for x in rules if not isinstance(x, str))])
            low = each.low if each.low > 0.0 else max(each.start / SPAN, each.least)
            high = each.high if math.isfinite(each.high) else most
            return math.log(low), math.log(high)
        reach = LINEAR_SPAN * self._scale(each)
        return (
            (each.low if math.isfinite(each.low) else max(each.start - reach, each.least))
            / self._scale(each),
            (each.high if math.isfinite(each.high) else each.start + reach) / self._scale(each),
        )

    def _base(self, each: Unknown) -> float:
        return float(np.min(value_in(self.subject, each.other)))

    def _scale(self, each: Unknown) -> float:
        return abs(each.start) or 1.0

    def _coordinate(self, each: Unknown, value: float) -> float:
        if each.kind == "excess":
            return math.log(max(value / self._base(each) - 1.0, LEAST_EXCESS))
        return math.log(value) if each.kind == "log" else value / self._scale(each)

    def numbers(self, u: FloatArray) -> FloatArray:
        """Return the values of the unknowns at some coordinates, shape (unknowns,)."""
        found = np.empty(len(self.unknowns))
        plain: dict[str, float] = {}
        for i, each in enumerate(self.unknowns):
            if each.kind != "excess":
                found[i] = math.exp(u[i]) if each.kind == "log" else u[i] * self._scale(each)
                plain[each.key] = found[i]
        for i, each in enumerate(self.unknowns):
            if each.kind == "excess":  # over the present value of the other number
                base = plain.get(each.other, self._base(each))
                value = min(base * (1.0 + math.exp(u[i])), each.high)
                found[i] = max(value, each.low, base * (1.0 + LEAST_EXCESS))
        return found

    def slopes(self, u: FloatArray) -> FloatArray:
        """Return d(value)/d(coordinate), shape (unknowns,)."""
        numbers = self.numbers(u)
        return np.array(
            [
                self._scale(each)
                if each.kind == "linear"
                else value * (math.exp(x) / (1.0 + math.exp(x)) if each.kind == "excess" else 1.0)
                for each, value, x in zip(self.unknowns, numbers, u, strict=True)
            ]
        )

    def values(self, numbers: FloatArray) -> dict[str, Any]:
        """Return the values by the parameter's name, an array where elements differ."""
        return values_by_key(self.subject, self.unknowns, numbers)


def values_by_key(
    subject: Mounted, unknowns: Sequence[Unknown], numbers: Iterable[float]
) -> dict[str, Any]:
    """Return values of unknowns by the names of their parameters."""
    pairs = zip(unknowns, numbers, strict=True)
    return joined(subject, ((each.key, each.element, number) for each, number in pairs))
