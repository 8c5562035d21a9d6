"""How other languages write an expression: one algebra for all of them.

Every operation is written in the order in which the engines compute it, and small integer powers as
products, as they do; so a language with IEEE numbers rounds alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from gms_fsm.errors import ParameterError
from gms_fsm.language import (
    Binary,
    Both,
    Call,
    Either,
    Negative,
    Node,
    Not,
    Relation,
    fold,
    product_power,
)

__all__ = ["Notation", "number_with_point"]

# How tightly operators bind. A sign binds like a sum: two operators in a row are refused by many
# languages. Mixed `and` and `or` are always in parentheses, which compilers ask for.
_LOGIC, _RELATION, _SUM, _PRODUCT, _ATOM = range(5)


def number_with_point(value: float) -> str:
    """Return a number with all its digits and a decimal point: ``1.0e-06``.

    Parameters
    ----------
    value : float
        Finite.

    Returns
    -------
    str
        Readable by every language.

    Examples
    --------
    >>> number_with_point(1e-06), number_with_point(0.5)
    ('1.0e-06', '0.5')
    """
    digits, _, exponent = repr(value).partition("e")
    if "." not in digits:
        digits += ".0"
    return f"{digits}e{exponent}" if exponent else digits


@dataclass(frozen=True)
class Notation:
    """The notation of a language.

    Parameters
    ----------
    both, either, negation, true : str
        The words for and, or, not and true; the first two with their spaces.
    functions : mapping of str to str
        For each function how it is written, with ``{0}`` and ``{1}`` for its arguments; one that is
        missing cannot be expressed.
    power : str
        How a power is written.
    number : callable
        Writes a number.
    """

    both: str
    either: str
    negation: str
    true: str
    functions: Mapping[str, str]
    power: str
    number: Callable[[float], str] = field(default=number_with_point)

    def spell(self, node: Node, texts: Mapping[str, str]) -> str:
        """Write a tree.

        Parameters
        ----------
        node : Node
            A value or a condition.
        texts : mapping of str to str
            What is written for some names, for example ``{"k": "k[i]"}``.

        Returns
        -------
        str
            The text, with parentheses where the language needs them.

        Raises
        ------
        ParameterError
            If the language has no such function.

        Examples
        --------
        >>> from gms_fsm.language import parse_value
        >>> c = Notation(" && ", " || ", "!", "1", {"abs": "fabs({0})"}, "pow({0}, {1})")
        >>> c.spell(parse_value("-k * abs(z) - z**2", "kz"), {"k": "k[i]"})
        '(-k[i]) * fabs(z) - z * z'
        """
        return fold(node, _Speller(self, texts)).text

    def check(self, node: Node, place: str, language: str) -> None:
        """Refuse a tree with a function that the language does not have.

        Parameters
        ----------
        node : Node
            A value or a condition.
        place, language : str
            For the message.

        Raises
        ------
        ParameterError
            Naming the function.
        """
        try:
            self.spell(node, {})
        except KeyError as error:
            raise ParameterError(
                f"{language} has no function {error.args[0]!r}",
                place=place,
                advice="write the expression without it, or choose another format",
            ) from None


class _Printed(NamedTuple):
    text: str
    level: int

    def at(self, level: int) -> str:
        """Return the text, in parentheses if it binds less tightly."""
        return self.text if self.level >= level else f"({self.text})"


class _Speller:
    """The algebra of text."""

    def __init__(self, notation: Notation, texts: Mapping[str, str]) -> None:
        self.notation, self.texts = notation, texts

    def number(self, value: float) -> _Printed:
        return _Printed(self.notation.number(value), _ATOM if value >= 0.0 else _SUM)

    def name(self, name: str) -> _Printed:
        return _Printed(self.texts.get(name, name), _ATOM)

    def negative(self, _: Negative, parts: Iterator[_Printed]) -> _Printed:
        return _Printed("-" + next(parts).at(_ATOM), _SUM)

    def binary(self, node: Binary, parts: Iterator[_Printed]) -> _Printed:
        left, right = parts
        level = _SUM if node.op in "+-" else _PRODUCT
        return _Printed(f"{left.at(level)} {node.op} {right.at(level + 1)}", level)

    def power(self, node: Binary, parts: Iterator[_Printed]) -> _Printed:
        base, exponent = parts
        whole = product_power(node.left, node.right)
        if whole is None:
            return _Printed(self.notation.power.format(base.text, exponent.text), _ATOM)
        if whole == 0:
            return _Printed(self.notation.number(1.0), _ATOM)
        if whole == 1:
            return base
        product = " * ".join([base.at(_PRODUCT)] + [base.at(_ATOM)] * (abs(whole) - 1))
        if whole > 0:
            return _Printed(product, _PRODUCT)
        bottom = base.at(_ATOM) if whole == -1 else f"({product})"
        return _Printed(f"{self.notation.number(1.0)} / {bottom}", _PRODUCT)

    def call(self, node: Call, parts: Iterator[_Printed]) -> _Printed:
        pattern = self.notation.functions[node.function]
        return _Printed(pattern.format(*(part.text for part in parts)), _ATOM)

    def relation(self, node: Relation, parts: Iterator[_Printed]) -> _Printed:
        left, right = (part.at(_SUM) for part in parts)
        return _Printed(f"{left} {node.op} {right}", _RELATION)

    def in_state(self, _element: int, _state: str) -> _Printed:
        raise TypeError("a guard depends on values, not on states")

    def negation(self, _: Not, parts: Iterator[_Printed]) -> _Printed:
        return _Printed(f"{self.notation.negation}({next(parts).text})", _ATOM)

    def both(self, node: Both, parts: Iterator[_Printed]) -> _Printed:
        if not node.operands:
            return _Printed(self.notation.true, _ATOM)
        return _Printed(self.notation.both.join(part.at(_RELATION) for part in parts), _LOGIC)

    def either(self, _: Either, parts: Iterator[_Printed]) -> _Printed:
        return _Printed(self.notation.either.join(part.at(_RELATION) for part in parts), _LOGIC)
