"""Evaluation of a tree at one point, bit for bit as generated code computes it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from gms_fsm.language._fold import fold
from gms_fsm.language._powers import product_power
from gms_fsm.language.functions import CHOICES, COMPARISONS, NAMESPACE, OPERATIONS
from gms_fsm.language.tree import Binary, Both, Call, Either, Negative, Node, Not, Relation


def evaluate(node: Node, values: Mapping[str, Any]) -> float | bool:
    """Evaluate a tree, rounding exactly as the generated code does.

    Parameters
    ----------
    node : Node
        A value or a condition.
    values : mapping of str to float
        A number for every name in the tree; for ``state(1)``, the key of that name maps to a state.

    Returns
    -------
    float or bool
        The number, or the truth value.

    Examples
    --------
    >>> from gms_fsm.language import evaluate, parse_condition
    >>> evaluate(parse_condition("z >= s and v > 0", "zsv"), {"z": 1.0, "s": 1.0, "v": 0.1})
    True
    """
    return fold(node, _Numbers(values))


class _Numbers:
    """The algebra of numbers and truth values; `and` and `or` short-circuit as in Python."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self.values = values

    def number(self, value: float) -> float:
        return value

    def name(self, name: str) -> float:
        return float(self.values[name])

    def negative(self, _: Negative, parts: Iterator[float]) -> float:
        return -next(parts)

    def binary(self, node: Binary, parts: Iterator[float]) -> float:
        result: float = OPERATIONS[node.op](*parts)
        return result

    def power(self, node: Binary, parts: Iterator[float]) -> float:
        whole = product_power(node.left, node.right)
        if whole is None:
            return NAMESPACE["pow"](*parts)
        if whole == 0:
            return 1.0
        product = factor = next(parts)
        for _ in range(abs(whole) - 1):
            product *= factor
        return 1.0 / product if whole < 0 else product

    def call(self, node: Call, parts: Iterator[float]) -> float:
        if node.function not in CHOICES:
            return NAMESPACE[node.function](*parts)
        holds = COMPARISONS[CHOICES[node.function]](next(parts), next(parts))
        return fold(node.arguments[2 if holds else 3], self)

    def relation(self, node: Relation, parts: Iterator[float]) -> bool:
        result: bool = COMPARISONS[node.op](*parts)
        return result

    def in_state(self, element: int, state: str) -> bool:
        return bool(self.values[f"state({element})"] == state)

    def negation(self, _: Not, parts: Iterator[bool]) -> bool:
        return not next(parts)

    def both(self, _: Both, parts: Iterator[bool]) -> bool:
        return all(parts)

    def either(self, _: Either, parts: Iterator[bool]) -> bool:
        return any(parts)
