"""Evaluation of a condition at many rows at once, bit for bit as row by row.

Sums, products and comparisons round in numpy as they do in Python. `exp`, `sin` ... are those of
`integrators.elementary`, in machine code where arrays are long. Where Python would raise (1/0),
numpy continues with inf; such places are recorded and then decided by `evaluate`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.language._evaluate import evaluate
from gms_fsm.language._fold import fold
from gms_fsm.language._powers import product_power
from gms_fsm.language.functions import CHOICES, COMPARISONS, NAMESPACE, OPERATIONS
from gms_fsm.language.tree import (
    Binary,
    Both,
    Call,
    Condition,
    Either,
    Negative,
    Not,
    Relation,
    Value,
)
from integrators.runners import quick

Truths = NDArray[np.bool_]


def truths(
    condition: Condition, columns: Mapping[str, ArrayLike], shape: tuple[int, ...]
) -> Truths:
    """Return where a condition is true; where it cannot be computed (1/0) it counts as false.

    Parameters
    ----------
    condition : Condition
        A guard, a clause or an invariant.
    columns : mapping of str to array_like
        For every name, numbers that broadcast to `shape`; for ``state(1)`` the key of that name
        (for ``state`` the key ``state(0)``) maps to names of states.
    shape : tuple of int
        Shape of the result.

    Returns
    -------
    ndarray of bool
        Equal, element by element, to `gms_fsm.session.explain.holds`.

    Examples
    --------
    >>> from gms_fsm.language import parse_condition
    >>> truths(parse_condition("1 / z > 2", ["z"]), {"z": [0.25, 0.0, 1.0]}, (3,)).tolist()
    [True, False, False]
    """
    arrays = _Arrays(columns, shape)
    with np.errstate(all="ignore"):
        found = np.array(np.broadcast_to(fold(condition, arrays), shape))
    for place in np.argwhere(arrays.doubtful):
        at = tuple(place)
        values = {name: np.broadcast_to(column, shape)[at] for name, column in columns.items()}
        try:
            found[at] = evaluate(condition, values)
        except (ArithmeticError, ValueError):
            found[at] = False
    return found


def values_of(tree: Value, columns: Mapping[str, ArrayLike]) -> NDArray[np.float64]:
    """Evaluate a value at many points; NaN or infinity where it cannot be computed.

    Parameters
    ----------
    tree : Value
        For example a signal.
    columns : mapping of str to array_like
        For every name, numbers of one common shape.

    Returns
    -------
    ndarray
        An array of that shape.

    Examples
    --------
    >>> from gms_fsm.language import parse_value
    >>> values_of(parse_value("2 * t + 1", ["t"]), {"t": [0.0, 1.0]}).tolist()
    [1.0, 3.0]
    """
    shape = np.broadcast_shapes(*(np.shape(column) for column in columns.values()))
    with np.errstate(all="ignore"):
        found = fold(tree, _Arrays(columns, shape))
    return np.array(np.broadcast_to(found, shape), dtype=np.float64)


class _Arrays:
    """The algebra of arrays; it records where Python would have raised."""

    def __init__(self, columns: Mapping[str, ArrayLike], shape: tuple[int, ...]) -> None:
        self.columns = columns
        self.doubtful: Truths = np.zeros(shape, dtype=np.bool_)

    def doubt(self, places: Any) -> None:
        if places.any():
            self.doubtful |= places

    def number(self, value: float) -> Any:
        return np.float64(value)

    def name(self, name: str) -> Any:
        return np.asarray(self.columns[name], dtype=np.float64)

    def negative(self, _: Negative, parts: Iterator[Any]) -> Any:
        return -next(parts)

    def binary(self, node: Binary, parts: Iterator[Any]) -> Any:
        a, b = parts
        if node.op == "/":
            self.doubt(b == 0.0)
        return OPERATIONS[node.op](a, b)

    def power(self, node: Binary, parts: Iterator[Any]) -> Any:
        factor, whole = next(parts), product_power(node.left, node.right)
        if whole is None:
            return quick.each(NAMESPACE["pow"], factor, next(parts))
        if whole == 0:
            return np.float64(1.0)
        product = factor
        for _ in range(abs(whole) - 1):
            product = product * factor
        if whole > 0:
            return product
        self.doubt(product == 0.0)
        return 1.0 / product

    def call(self, node: Call, parts: Iterator[Any]) -> Any:
        if node.function in CHOICES:
            return self.choice(node, parts)
        u, *others = parts
        match node.function:
            case "abs":
                return np.abs(u)
            case "sqrt":
                self.doubt(u < 0.0)
                return np.sqrt(u)
            case "sgn":
                return np.where(u > 0.0, 1.0, np.where(u < 0.0, -1.0, 0.0))
            case "min":  # as in Python: the second only if it is smaller, even with NaN
                return np.where(others[0] < u, others[0], u)
            case "max":
                return np.where(others[0] > u, others[0], u)
            case "floor":
                return np.floor(u)
            case "round":
                return np.rint(u)
        return quick.each(NAMESPACE[node.function], u, *others)

    def choice(self, node: Call, parts: Iterator[Any]) -> Any:
        """Choose; a place is in doubt only where what is chosen there is."""
        holds = COMPARISONS[CHOICES[node.function]](next(parts), next(parts))
        before, found, doubts = self.doubtful, [], []
        for part in node.arguments[2:]:
            self.doubtful = np.zeros_like(before)
            found.append(fold(part, self))
            doubts.append(self.doubtful)
        self.doubtful = before | np.where(holds, *doubts)
        return np.where(holds, *found)

    def relation(self, node: Relation, parts: Iterator[Any]) -> Any:
        return COMPARISONS[node.op](*parts)

    def in_state(self, element: int, state: str) -> Any:
        return np.asarray(self.columns[f"state({element})"]) == state

    def negation(self, _: Not, parts: Iterator[Any]) -> Any:
        return ~next(parts)

    def both(self, node: Both, parts: Iterator[Any]) -> Any:
        if not node.operands:
            return np.True_
        return np.logical_and.reduce(np.broadcast_arrays(*parts))

    def either(self, _: Either, parts: Iterator[Any]) -> Any:
        return np.logical_or.reduce(np.broadcast_arrays(*parts))
