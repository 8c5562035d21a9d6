"""The operators, functions and constants of the language, as the generated code computes them."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

from integrators import elementary
from integrators.machine_code import whole_numbers

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
    "floor": whole_numbers.floor,
    "round": whole_numbers.nearest,
}
# What generated text calls besides: powers, and a value whose sign changes where floor jumps.
NAMESPACE: Mapping[str, Callable[..., float]] = {
    **FUNCTIONS,
    "pow": elementary.power,
    "tooth": whole_numbers.tooth,
    "noise": whole_numbers.noise,
}
# Functions that are read as others, or as one of whole numbers, with the number of their arguments.
SHORT = {"mod": 2, "quantise": 2, "saturate": 3, "if": 3, "noise": 2}
# ``if(a > b, c, d)`` is the call ``if_gt(a, b, c, d)``.
CHOICES: Mapping[str, str] = {"if_lt": "<", "if_le": "<=", "if_gt": ">", "if_ge": ">="}
# Words that are younger than files which use them as names: a declared name wins.
YIELDING = ("floor", "round", *SHORT)
CONSTANTS: Mapping[str, float] = {"pi": math.pi}
# What others call them, and what they call the names of texts.
_QUANTITIES = {"time": "t", "position": "x", "velocity": "v", "force": "F"}  # of records, of runs
ALIASES: Mapping[str, str] = {
    "quantize": "quantise",
    "clip": "saturate",
    "clamp": "saturate",
    "nearest": "round",
    "rint": "round",
    "sign": "sgn",
    "signum": "sgn",
    "fabs": "abs",
    "π": "pi",
    "speed": "v",
    **_QUANTITIES,
    **{short: name for name, short in _QUANTITIES.items()},
}
# Conditions that stand only in some texts, and in which.
ELSEWHERE: Mapping[str, str] = {
    "is_in": "is_in(pad.stuck) in the texts of a system; state(1) == stuck in a session",
    "count": "count(pad.slip) in the texts of a system",
    "delay": "delay(u, 3) in the updates of a Sampled",
    "duration": "duration(v > 0), in s, in the guards of edges and the texts of states",
    "after": "after(2), in s, alone or joined by and, in the guard of an edge",
}
SEVERAL = ("min", "max")  # functions of two or more arguments; the others take one
# Functions whose flow has a corner or a jump.
ROUGH = ("sgn", "abs", "min", "max", "floor", "round", *CHOICES)
# Those of them that are ours.
ELEMENTARY: Mapping[str, Callable[..., float]] = {
    name: each
    for name, each in NAMESPACE.items()
    if each.__module__ in (elementary.__name__, whole_numbers.__name__)
}
ARGUMENTS: Mapping[str, int] = {name: 2 if name in ("pow", "noise") else 1 for name in ELEMENTARY}
