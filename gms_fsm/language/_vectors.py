"""The truth of a condition at many rows at once: the verdict of one row at a time, to the bit.

Sums, products and comparisons of numpy round as Python's do. Functions that do not (`exp`, `sin`
...) are taken from `math`, number by number. Where Python would raise (1/0) numpy goes on with inf;
such places are noted and decided by `evaluate` itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.language.expression import (
    FUNCTIONS,
    Binary,
    Both,
    Call,
    Condition,
    Either,
    InState,
    Name,
    Negative,
    Not,
    Number,
    Relation,
    Value,
    evaluate,
    product_power,
)

__all__ = ["truths", "values_of"]

Truths = NDArray[np.bool_]


def truths(
    condition: Condition, columns: Mapping[str, ArrayLike], shape: tuple[int, ...]
) -> Truths:
    """Return where a condition holds; what cannot be computed (1/0) is not true.

    Parameters
    ----------
    condition : Condition
        A guard, a clause, an invariant.
    columns : mapping of str to array_like
        For every name numbers that broadcast to `shape`; for ``state(1)`` under that key (for
        ``state`` under ``state(0)``) names of states.
    shape : tuple of int
        Of the answer.

    Returns
    -------
    ndarray of bool
        Equal, place by place, to `gms_fsm.inspection.explain.holds`.

    Examples
    --------
    >>> from gms_fsm.language.expression import parse_condition
    >>> truths(parse_condition("1 / z > 2", ["z"]), {"z": [0.25, 0.0, 1.0]}, (3,)).tolist()
    [True, False, False]
    """
    reader = _Reader(columns, shape)
    with np.errstate(all="ignore"):
        found = np.array(np.broadcast_to(reader.truth(condition), shape))
    for place in np.argwhere(reader.doubtful):
        at = tuple(place)
        values = {name: np.broadcast_to(column, shape)[at] for name, column in columns.items()}
        try:
            found[at] = evaluate(condition, values)
        except (ArithmeticError, ValueError):
            found[at] = False
    return found


def values_of(tree: Value, columns: Mapping[str, ArrayLike]) -> NDArray[np.float64]:
    """Return a value at many places; NaN or infinity where it cannot be computed.

    Parameters
    ----------
    tree : Value
        For example a signal.
    columns : mapping of str to array_like
        For every name numbers of one shape.

    Returns
    -------
    ndarray
        Of that shape.

    Examples
    --------
    >>> from gms_fsm.language.expression import parse_value
    >>> values_of(parse_value("2 * t + 1", ["t"]), {"t": [0.0, 1.0]}).tolist()
    [1.0, 3.0]
    """
    shape = np.broadcast_shapes(*(np.shape(column) for column in columns.values()))
    with np.errstate(all="ignore"):
        found = _Reader(columns, shape).value(tree)
    return np.array(np.broadcast_to(found, shape), dtype=np.float64)


class _Reader:
    """Computes a tree over arrays and notes where Python would have raised."""

    def __init__(self, columns: Mapping[str, ArrayLike], shape: tuple[int, ...]) -> None:
        self.columns = columns
        self.doubtful: Truths = np.zeros(shape, dtype=np.bool_)

    def doubt(self, places: Any) -> None:
        if places.any():
            self.doubtful |= places

    def truth(self, node: Condition) -> Any:
        match node:
            case Relation(op, left, right):
                a, b = self.value(left), self.value(right)
                if op == "<":
                    return a < b
                if op == "<=":
                    return a <= b
                return a > b if op == ">" else a >= b
            case InState(element, state):
                return np.asarray(self.columns[f"state({element})"]) == state
            case Not(operand):
                return ~self.truth(operand)
            case Both(operands):
                return np.logical_and.reduce(self.together(operands))
            case Either(operands):
                return np.logical_or.reduce(self.together(operands))

    def together(self, operands: tuple[Condition, ...]) -> list[Any]:
        return list(np.broadcast_arrays(*(self.truth(operand) for operand in operands)))

    def value(self, node: Value) -> Any:
        match node:
            case Number(value):
                return np.float64(value)
            case Name(name):
                return np.asarray(self.columns[name], dtype=np.float64)
            case Negative(operand):
                return -self.value(operand)
            case Binary("**", base, exponent):
                return self.power(base, exponent)
            case Binary(op, left, right):
                a, b = self.value(left), self.value(right)
                if op == "+":
                    return a + b
                if op == "-":
                    return a - b
                if op == "*":
                    return a * b
                self.doubt(b == 0.0)
                return a / b
            case Call(function, arguments):
                return self.call(function, *(self.value(argument) for argument in arguments))

    def power(self, base: Value, exponent: Value) -> Any:
        factor, whole = self.value(base), product_power(base, exponent)
        if whole is None:
            return self.one_by_one(math.pow, factor, self.value(exponent))
        if whole == 0:
            return np.float64(1.0)
        product = factor
        for _ in range(abs(whole) - 1):
            product = product * factor
        if whole > 0:
            return product
        self.doubt(product == 0.0)
        return 1.0 / product

    def call(self, function: str, *arguments: Any) -> Any:
        u = arguments[0]
        match function:
            case "abs":
                return np.abs(u)
            case "sqrt":
                self.doubt(u < 0.0)
                return np.sqrt(u)
            case "sgn":
                return np.where(u > 0.0, 1.0, np.where(u < 0.0, -1.0, 0.0))
            case "min":  # Python's own: the second only if it is smaller, NaN or not
                return np.where(arguments[1] < u, arguments[1], u)
            case "max":
                return np.where(arguments[1] > u, arguments[1], u)
        return self.one_by_one(FUNCTIONS[function], *arguments)

    def one_by_one(self, function: Callable[..., float], *arguments: Any) -> Any:
        """Compute with Python's own function; where it raises it is NaN, and noted."""
        arrays = np.broadcast_arrays(*arguments)
        shape, lists = arrays[0].shape, [array.ravel().tolist() for array in arrays]
        try:
            return np.array(list(map(function, *lists))).reshape(shape)
        except (ArithmeticError, ValueError):
            values = np.full(arrays[0].size, math.nan)
        raised = np.zeros(values.size, dtype=np.bool_)
        for i, numbers in enumerate(zip(*lists, strict=True)):
            try:
                values[i] = function(*numbers)
            except (ArithmeticError, ValueError):
                raised[i] = True
        self.doubt(raised.reshape(shape))
        return values.reshape(shape)
