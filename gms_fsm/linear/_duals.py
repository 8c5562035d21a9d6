"""Numbers with their derivatives, so that generated text computes both at once."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.language import NAMESPACE, Call, Name, Value, derivative, evaluate
from gms_fsm.lowering.generated import load
from gms_fsm.lowering.program import Program

ONE, TWO = "u", "w"  # names of the arguments of a function


class Sloped:
    """A number and its partial derivatives with respect to some seeds."""

    __slots__ = ("slope", "value")

    def __init__(self, value: float, slope: FloatArray) -> None:
        self.value, self.slope = value, slope

    def __neg__(self) -> Sloped:
        return Sloped(-self.value, -self.slope)

    def __add__(self, other: Sloped | float) -> Sloped:
        value, slope = _parts(other)
        return Sloped(self.value + value, self.slope + slope)

    def __sub__(self, other: Sloped | float) -> Sloped:
        value, slope = _parts(other)
        return Sloped(self.value - value, self.slope - slope)

    def __mul__(self, other: Sloped | float) -> Sloped:
        value, slope = _parts(other)
        return Sloped(self.value * value, self.slope * value + self.value * slope)

    def __truediv__(self, other: Sloped | float) -> Sloped:
        value, slope = _parts(other)
        ratio = self.value / value
        return Sloped(ratio, (self.slope - ratio * slope) / value)

    __radd__, __rmul__ = __add__, __mul__

    def __rsub__(self, other: float) -> Sloped:
        return -self + other

    def __rtruediv__(self, other: float) -> Sloped:
        ratio = other / self.value
        return Sloped(ratio, -ratio / self.value * self.slope)

    def __abs__(self) -> Sloped:
        return -self if self.value < 0.0 else self

    def __lt__(self, other: Sloped | float) -> bool:
        return self.value < _parts(other)[0]

    def __le__(self, other: Sloped | float) -> bool:
        return self.value <= _parts(other)[0]

    def __gt__(self, other: Sloped | float) -> bool:
        return self.value > _parts(other)[0]

    def __ge__(self, other: Sloped | float) -> bool:
        return self.value >= _parts(other)[0]

    def __eq__(self, other: object) -> bool:
        return self.value == (other.value if isinstance(other, Sloped) else other)

    __hash__ = None  # type: ignore[assignment]  # it is compared by its value


def _parts(number: Sloped | float) -> tuple[float, Any]:
    return (number.value, number.slope) if isinstance(number, Sloped) else (number, 0.0)


def slope_of(number: Any, seeds: int) -> FloatArray:
    """Return the derivatives of a number; zeros if it depends on no seed."""
    return number.slope if isinstance(number, Sloped) else np.zeros(seeds)


@functools.cache
def _slope(function: str, by: str) -> Value | None:
    """Return the derivative of a function of the language with respect to one argument."""
    names = (ONE, TWO) if function in ("min", "max") else (ONE,)
    return derivative(Call(function, tuple(map(Name, names))), by)


def _function(name: str, plain: Callable[..., float]) -> Callable[..., Any]:
    def call(*arguments: Sloped | float) -> Sloped | float:
        values = [_parts(each)[0] for each in arguments]
        value = plain(*values)
        dual = [each for each in arguments if isinstance(each, Sloped)]
        if not dual or name in ("floor", "round", "sgn", "noise"):
            return value
        numbers = dict(zip((ONE, TWO), values, strict=False))
        total = np.zeros_like(dual[0].slope)
        for by, argument in zip((ONE, TWO), arguments, strict=False):
            tree = _slope(name, by)
            if isinstance(argument, Sloped) and tree is not None:
                total = total + evaluate(tree, numbers) * argument.slope
        return Sloped(value, total)

    return call


def _power(base: Sloped | float, exponent: Sloped | float) -> Sloped | float:
    """Return a power; with respect to the exponent it holds for a positive base."""
    plain = NAMESPACE["pow"]
    (b, db), (n, dn) = _parts(base), _parts(exponent)
    value = plain(b, n)
    slope: Any = n * plain(b, n - 1.0) * db if np.any(db) else 0.0
    if np.any(dn):
        slope = slope + value * NAMESPACE["log"](b) * dn
    return value if np.ndim(slope) == 0 else Sloped(value, slope)


def _several(name: str, plain: Callable[..., float]) -> Callable[..., Any]:
    """Return min or max of any number of arguments."""
    two = _function(name, plain)
    return lambda *arguments: functools.reduce(two, arguments)


NAMES: Mapping[str, Callable[..., Any]] = {
    **{name: _function(name, each) for name, each in NAMESPACE.items()},
    **{name: _several(name, NAMESPACE[name]) for name in ("min", "max")},
    "abs": abs,
    "pow": _power,
    # A record stands for one value here: that of its input.
    "piecewise_linear": lambda *record: record[2][0],
    "piecewise_slope": lambda *_: 0.0,
}


def with_slopes(program: Program) -> dict[str, Callable[..., Any]]:
    """Return the functions of a program, for dual numbers."""
    called = {f"{name}_signal": each for name, each in program.callables.items()}
    return load(program.plan.title, program.source, {**called, **NAMES, "nan": float("nan")})
