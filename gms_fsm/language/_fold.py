"""`fold`: the single way to traverse a tree, whatever the result.

An algebra defines the result for each kind of node, given the results for the node's parts.
Numbers, arrays over rows, solver formulas, printed text and derivatives are all algebras.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol, TypeVar, overload

from gms_fsm.language.tree import (
    Binary,
    Both,
    Call,
    Condition,
    Either,
    InState,
    Name,
    Negative,
    Node,
    Not,
    Number,
    Relation,
    Value,
)

V = TypeVar("V")
C = TypeVar("C")


class ValueAlgebra(Protocol[V]):
    """Results for the nodes of a value.

    The parts of a node are folded lazily, as they are taken from the iterator; a part that is not
    taken is not evaluated.
    """

    def number(self, value: float, /) -> V:
        """Read a constant."""

    def name(self, name: str, /) -> V:
        """Read a declared name."""

    def negative(self, node: Negative, parts: Iterator[V], /) -> V:
        """Read ``-u``; one part."""

    def binary(self, node: Binary, parts: Iterator[V], /) -> V:
        """Read a sum, difference, product or quotient; two parts."""

    def power(self, node: Binary, parts: Iterator[V], /) -> V:
        """Read ``base**exponent``; two parts."""

    def call(self, node: Call, parts: Iterator[V], /) -> V:
        """Read a function; one part per argument."""


class Algebra(ValueAlgebra[V], Protocol[V, C]):
    """Results for the nodes of a condition as well."""

    def relation(self, node: Relation, parts: Iterator[V], /) -> C:
        """Read a comparison; two parts."""

    def in_state(self, element: int, state: str, /) -> C:
        """Read ``state(element) == state``; element 0 is the current element."""

    def negation(self, node: Not, parts: Iterator[C], /) -> C:
        """Read ``not a``; one part."""

    def both(self, node: Both, parts: Iterator[C], /) -> C:
        """Read ``a and b ...``; one part per operand."""

    def either(self, node: Either, parts: Iterator[C], /) -> C:
        """Read ``a or b ...``; one part per operand."""


_OPERATIONS = {
    Negative: "negative",
    Binary: "binary",
    Call: "call",
    Relation: "relation",
    Not: "negation",
    Both: "both",
    Either: "either",
}


@overload
def fold(tree: Value, algebra: ValueAlgebra[V]) -> V: ...
@overload
def fold(tree: Condition, algebra: Algebra[V, C]) -> C: ...
@overload
def fold(tree: Node, algebra: Algebra[V, C]) -> V | C: ...
def fold(tree: Node, algebra: Any) -> Any:
    """Return the result of applying an algebra to a tree.

    Parameters
    ----------
    tree : Value or Condition
        A checked tree.
    algebra : ValueAlgebra or Algebra
        An object with a method for each kind of node; conditions need an `Algebra`.

    Returns
    -------
    object
        The algebra's result for the root.

    Examples
    --------
    Tree depth as an algebra:

    >>> from gms_fsm.language import fold, parse_value
    >>> class Depth:
    ...     def number(self, value):
    ...         return 1
    ...     def name(self, name):
    ...         return 1
    ...     def negative(self, node, parts):
    ...         return 1 + max(parts)
    ...     binary = power = call = negative
    >>> fold(parse_value("2 * v + exp(-v)", ["v"]), Depth())
    4
    """
    match tree:
        case Name():
            return algebra.name(tree.id)
        case Number():
            return algebra.number(tree.value)
        case InState():
            return algebra.in_state(tree.element, tree.state)
    power = isinstance(tree, Binary) and tree.op == "**"
    operation = getattr(algebra, "power" if power else _OPERATIONS[type(tree)])
    return operation(tree, (fold(part, algebra) for part in tree.parts))
