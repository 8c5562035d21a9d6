"""The nodes of a checked tree, and simple traversals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

from gms_fsm.language.functions import CHOICES


@dataclass(frozen=True)
class Number:
    """A finite constant."""

    value: float
    parts: ClassVar[tuple[()]] = ()


@dataclass(frozen=True)
class Name:
    """A declared name."""

    id: str
    parts: ClassVar[tuple[()]] = ()


@dataclass(frozen=True)
class Negative:
    """``-operand``."""

    operand: Value

    @property
    def parts(self) -> tuple[Value]:
        """The operand."""
        return (self.operand,)


@dataclass(frozen=True)
class Binary:
    """``left op right`` with op one of ``+ - * / **``."""

    op: str
    left: Value
    right: Value

    @property
    def parts(self) -> tuple[Value, Value]:
        """Both sides."""
        return (self.left, self.right)


@dataclass(frozen=True)
class Call:
    """``function(*arguments)``."""

    function: str
    arguments: tuple[Value, ...]

    @property
    def parts(self) -> tuple[Value, ...]:
        """The arguments."""
        return self.arguments


@dataclass(frozen=True)
class Relation:
    """One atomic comparison, ``left op right`` with op one of ``< <= > >=``."""

    op: str
    left: Value
    right: Value

    @property
    def parts(self) -> tuple[Value, Value]:
        """Both sides."""
        return (self.left, self.right)


@dataclass(frozen=True)
class InState:
    """``state(element) == name``, elements counted from 1: in breakpoints, never in guards.

    Element 0 is the current element: ``state == name`` in invariants.
    """

    element: int
    state: str
    parts: ClassVar[tuple[()]] = ()


@dataclass(frozen=True)
class Not:
    """``not operand``."""

    operand: Condition

    @property
    def parts(self) -> tuple[Condition]:
        """The operand."""
        return (self.operand,)


@dataclass(frozen=True)
class Both:
    """``a and b and ...``."""

    operands: tuple[Condition, ...]

    @property
    def parts(self) -> tuple[Condition, ...]:
        """The operands."""
        return self.operands


@dataclass(frozen=True)
class Either:
    """``a or b or ...``."""

    operands: tuple[Condition, ...]

    @property
    def parts(self) -> tuple[Condition, ...]:
        """The operands."""
        return self.operands


LASTING = "duration("  # and how long a condition has held
COUNTING = ("is_in(", "count(")  # names that stand for numbers of elements begin like this
Value: TypeAlias = Number | Name | Negative | Binary | Call
Condition: TypeAlias = Relation | InState | Not | Both | Either
Node: TypeAlias = Value | Condition


def walk(node: Node) -> Iterator[Node]:
    """Yield every node of a tree, with the parts of a node before the node itself."""
    for part in node.parts:
        yield from walk(part)
    yield node


def names_in(node: Node) -> frozenset[str]:
    """Return the names a tree depends on.

    Parameters
    ----------
    node : Node
        A value or a condition.

    Returns
    -------
    frozenset of str
        In no particular order.

    Examples
    --------
    >>> from gms_fsm.language import names_in, parse_value
    >>> sorted(names_in(parse_value("k * z + pi", ["k", "z"])))
    ['k', 'z']
    """
    return frozenset(n.id for n in walk(node) if isinstance(n, Name))


def states_in(node: Node) -> frozenset[int]:
    """Return the elements whose states a condition refers to; 0 is the current element.

    Parameters
    ----------
    node : Node
        A value or a condition.

    Returns
    -------
    frozenset of int
        In no particular order.

    Examples
    --------
    >>> from gms_fsm.language import parse_condition, states_in
    >>> asked = parse_condition("v > 0 or state(2) == slip", ["v"], ["slip"], 2)
    >>> sorted(states_in(asked))
    [2]
    """
    return frozenset(n.element for n in walk(node) if isinstance(n, InState))


def is_whole(value: Value) -> bool:
    """Tell whether a value is a whole number, whatever its names stand for."""
    match value:
        case Number(number):
            return number.is_integer()
        case Name(name):
            return name.startswith(COUNTING)
        case Call("floor" | "round" | "sgn"):
            return True
        case Call(function, arguments) if function in CHOICES:
            return all(map(is_whole, arguments[2:]))
        case Negative() | Binary("+" | "-" | "*") | Call("abs" | "min" | "max"):
            return all(map(is_whole, value.parts))
    return False


def rebuilt(value: Value, change: Callable[[Value], Value]) -> Value:
    """Return a copy of a value with a function applied to each of its parts."""
    match value:
        case Negative(operand):
            return Negative(change(operand))
        case Binary(op, left, right):
            return Binary(op, change(left), change(right))
        case Call(function, arguments):
            return Call(function, tuple(change(argument) for argument in arguments))
    return value
