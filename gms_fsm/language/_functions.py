"""The operators, functions and constants of the language, as the generated code computes them."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

__all__ = [
    "COMPARISONS",
    "CONSTANTS",
    "FUNCTIONS",
    "NAMESPACE",
    "OPERATIONS",
    "ROUGH",
    "SEVERAL",
    "sgn",
]

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


# Scalar functions on purpose: numpy's array exp sometimes differs from math.exp in the last bit,
# and the readable and the compiled engine must agree bit for bit.
FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "abs": abs,
    "exp": math.exp,
    "sqrt": math.sqrt,
    "sgn": sgn,
    "min": min,
    "max": max,
    "sin": math.sin,
    "cos": math.cos,
    "tanh": math.tanh,
}
NAMESPACE: Mapping[str, Callable[..., float]] = {**FUNCTIONS, "pow": math.pow}  # of printed code
CONSTANTS: Mapping[str, float] = {"pi": math.pi}
SEVERAL = ("min", "max")  # functions of two or more arguments; the others take one
ROUGH = ("sgn", "abs", "min", "max")  # functions whose flow has a corner or a jump
