"""Trees of the expression language in a replay page, where one function of the page reads them.

A number stands for itself, a text for a name, a list for an operation and its parts:
``["and", [">=", "z", "s"], [">", "v", "v_c"]]``. Functions that a browser may round differently
than Python (``exp``, ``sin`` ...) are wrapped in a guard as ``["stored", "#0", tree]``: at a row of
the run the page uses the stored column ``#0``, elsewhere the tree.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from gms_fsm.language import (
    Binary,
    Both,
    Call,
    Either,
    Negative,
    Node,
    Not,
    Relation,
    Value,
    fold,
    product_power,
)
from gms_fsm.language.functions import ROUGH

# Functions that round the same everywhere.
EXACT = (*ROUGH, "sqrt", "tooth", "noise")
Stored = dict[str, Value]  # by name, such as "#0"


def tree_of(tree: Node, stored: Stored | None = None) -> Any:
    """Return a tree as data for the page.

    Examples
    --------
    >>> from gms_fsm.language import parse_condition
    >>> found = {}
    >>> tree_of(parse_condition("z**2 >= exp(-v)", ["z", "v"]), found)
    ['>=', ['product', 'z', 2], ['stored', '#0', ['exp', ['-', 'v']]]]
    >>> sorted(found)
    ['#0']
    """
    return fold(tree, _Data(stored))


class _Data:
    """The algebra of data for the page."""

    def __init__(self, stored: Stored | None) -> None:
        self.stored = stored

    def number(self, value: float) -> float:
        return value

    def name(self, name: str) -> str:
        return name

    def negative(self, _: Negative, parts: Iterator[Any]) -> Any:
        return ["-", *parts]

    def binary(self, node: Binary, parts: Iterator[Any]) -> Any:
        return [node.op, *parts]

    def power(self, node: Binary, parts: Iterator[Any]) -> Any:
        whole = product_power(node.left, node.right)
        if whole is not None:
            return ["product", next(parts), whole]
        return self._inexact(node, ["**", *parts])

    def call(self, node: Call, parts: Iterator[Any]) -> Any:
        found = [node.function, *parts]
        return found if node.function in EXACT else self._inexact(node, found)

    def _inexact(self, node: Value, data: Any) -> Any:
        if self.stored is None:
            return data
        same = [name for name, known in self.stored.items() if known == node]
        name = same[0] if same else f"#{len(self.stored)}"
        self.stored[name] = node
        return ["stored", name, data]

    def relation(self, node: Relation, parts: Iterator[Any]) -> Any:
        return [node.op, *parts]

    def in_state(self, element: int, state: str) -> Any:
        return ["state", element, state]

    def negation(self, _: Not, parts: Iterator[Any]) -> Any:
        return ["not", *parts]

    def both(self, _: Both, parts: Iterator[Any]) -> Any:
        return ["and", *parts]

    def either(self, _: Either, parts: Iterator[Any]) -> Any:
        return ["or", *parts]
