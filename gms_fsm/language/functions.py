"""The operators, functions and constants of the language, as the generated code computes them."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

from integrators import elementary

OPERATIONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}
COMPARISONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def sgn(u: float) -> float:
    """Sign of u with sgn(0) = 0.

    >>> sgn(-2.5), sgn(0.0), sgn(1e-300)
    (-1.0, 0.0, 1.0)
    """
    if u > 0.0:
        return 1.0
    if u < 0.0:
        return -1.0
    return 0.0


# Our own, not those of `math` or NumPy: these differ in the last bit between C libraries.
FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "abs": abs,
    "exp": elementary.exp,
    "log": elementary.log,
    "sqrt": math.sqrt,
    "sgn": sgn,
    "min": min,
    "max": max,
    "sin": elementary.sin,
    "cos": elementary.cos,
    "tanh": elementary.tanh,
    "atan": elementary.atan,
    "asinh": elementary.asinh,
}
NAMESPACE: Mapping[str, Callable[..., float]] = {**FUNCTIONS, "pow": elementary.power}
CONSTANTS: Mapping[str, float] = {"pi": math.pi}
SEVERAL = ("min", "max")  # functions of two or more arguments; the others take one
ROUGH = ("sgn", "abs", "min", "max")  # functions whose flow has a corner or a jump
# Those of them that are ours.
ELEMENTARY: Mapping[str, Callable[..., float]] = {
    name: each for name, each in NAMESPACE.items() if each.__module__ == elementary.__name__
}
