"""One text for trees that differ only in how they are written: order, direction, negations."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias, overload

from gms_fsm.language import (
    Binary,
    Both,
    Call,
    Condition,
    Either,
    Name,
    Negative,
    Not,
    Relation,
    Value,
    fold,
)

Truth: TypeAlias = tuple[str, str]  # what a condition is called, and its negation
SYMMETRIC = {"min", "max"}


class _CanonicalText:
    """The algebra of texts in which ``a < b`` is ``b > a``, and ``not a`` is pushed inwards.

    Parameters
    ----------
    called : callable
        What a name is called.
    """

    def __init__(self, called: Callable[[str], str]) -> None:
        self.called = called

    def number(self, value: float) -> str:
        return repr(value) if value >= 0.0 else _negative(repr(-value))

    def name(self, name: str) -> str:
        return self.called(name)

    def negative(self, _: Negative, parts: Iterator[str]) -> str:
        return _negative(next(parts))

    def binary(self, node: Binary, parts: Iterator[str]) -> str:
        a, b = parts
        if node.op in "+-*":
            op, b = ("+", _negative(b)) if node.op == "-" else (node.op, b)
            return f"({f' {op} '.join(sorted([a, b]))})"
        return f"({a} {node.op} {b})"

    power = binary

    def call(self, node: Call, parts: Iterator[str]) -> str:
        of = [*parts]
        return f"{node.function}({', '.join(sorted(of) if node.function in SYMMETRIC else of)})"

    def relation(self, node: Relation, parts: Iterator[str]) -> Truth:
        left, right = parts
        if node.op in (">", ">="):
            left, right = right, left
        if node.op in ("<", ">"):
            return f"{left} < {right}", f"{right} <= {left}"
        return f"{left} <= {right}", f"{right} < {left}"

    def in_state(self, _element: int, _state: str) -> Truth:
        raise TypeError("a guard depends on values, not on states")

    def negation(self, _: Not, parts: Iterator[Truth]) -> Truth:
        holds, fails = next(parts)
        return fails, holds

    def both(self, _: Both, parts: Iterator[Truth]) -> Truth:
        every = [*parts]
        return _joined("and", (a for a, _ in every)), _joined("or", (b for _, b in every))

    def either(self, _: Either, parts: Iterator[Truth]) -> Truth:
        every = [*parts]
        return _joined("or", (a for a, _ in every)), _joined("and", (b for _, b in every))


def _negative(text: str) -> str:
    plain = text.removeprefix("-[").removesuffix("]")
    return plain if text == f"-[{plain}]" else f"-[{text}]"


def _joined(word: str, texts: Iterator[str]) -> str:
    every = sorted(set(texts))
    if not every:
        return "true" if word == "and" else "false"
    return every[0] if len(every) == 1 else f"({f' {word} '.join(every)})"


def _itself(name: str) -> str:
    return name


def canonical(tree: Value | Condition, called: Callable[[str], str] = _itself) -> str:
    """Return the text of a tree that does not depend on how it is written.

    Different texts may still mean the same, equal ones always do.

    Examples
    --------
    >>> from gms_fsm.language import parse_condition
    >>> canonical(parse_condition("not (v > 0 or z < s)", "vzs"))
    '(s <= z and v <= 0.0)'
    """
    found: str | Truth = fold(tree, _CanonicalText(called))
    return found if isinstance(found, str) else found[0]


# --------------------------------------------------------------------------- parts of trees
@overload
def rewritten(tree: Value, change: Callable[[Value], Value]) -> Value: ...
@overload
def rewritten(tree: Condition, change: Callable[[Value], Value]) -> Condition: ...
def rewritten(tree: Value | Condition, change: Callable[[Value], Value]) -> Value | Condition:
    """Return a tree with another value for each side of its comparisons, or for itself."""
    match tree:
        case Relation(op, left, right):
            return Relation(op, change(left), change(right))
        case Not(operand):
            return Not(rewritten(operand, change))
        case Both(operands):
            return Both(tuple(rewritten(each, change) for each in operands))
        case Either(operands):
            return Either(tuple(rewritten(each, change) for each in operands))
        case Name() | Negative() | Binary() | Call():
            return change(tree)
    return tree
