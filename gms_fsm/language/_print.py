"""Printing of a checked tree, as Python for generated code or as Stateflow text for charts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from gms_fsm.language._fold import fold
from gms_fsm.language._functions import FUNCTIONS
from gms_fsm.language._powers import product_power
from gms_fsm.language._tree import Binary, Both, Call, Either, Name, Negative, Node, Not, Relation

__all__ = ["ECMASCRIPT", "LEVELS", "MATLAB_LIKE", "PYTHON", "Spelling", "spell"]


@dataclass(frozen=True)
class Spelling:
    """Notation for a tree: the logical operators, and how functions and powers look.

    Parameters
    ----------
    both, either, negation : str
        The words for and, or and not, with their spaces; a space before that for not if it stands
        after its operand.
    true : str
        The condition that always holds.
    bars : bool
        Write ``abs(u)`` as ``|u|``.
    products : bool
        Write small integer powers as products, and other powers as ``pow(a, b)``.
    timers : bool
        Write ``age >= T`` as ``after(T)``.
    functions : mapping of str to str
        What functions are called, ``pow`` among them, where not as in Python.
    """

    both: str
    either: str
    negation: str
    true: str
    bars: bool
    products: bool
    timers: bool = False
    functions: Mapping[str, str] = field(default_factory=dict, hash=False)

    def called(self, function: str) -> str:
        """Return what a function is called."""
        return self.functions.get(function, function)


PYTHON = Spelling(" and ", " or ", "not ", "True", bars=False, products=True)
MATLAB_LIKE = Spelling(" && ", " || ", "!", "true", bars=True, products=False, timers=True)
# The data model of SCXML. Negation is written as a comparison, which Python's readers of SCXML know
# as well; they do not know "!".
ECMASCRIPT = Spelling(
    " && ",
    " || ",
    " == false",
    "true",
    bars=False,
    products=True,
    functions={
        **{name: f"Math.{name}" for name in (*FUNCTIONS, "pow")},
        "sgn": "Math.sign",
    },
)

# How tightly each operator binds (its precedence).
LEVELS = {"or": 1, "and": 2, "not": 3, "<": 4, "+": 5, "-": 5, "*": 6, "/": 6, "neg": 7, "**": 8}
_ATOM = 9


def spell(node: Node, spelling: Spelling = PYTHON, rename: Mapping[str, str] | None = None) -> str:
    """Write a tree as text.

    Parameters
    ----------
    node : Node
        A value or a condition.
    spelling : Spelling
        `PYTHON` for generated code (a small integer power is printed as a product, so that the
        readable and the compiled engine round identically), `MATLAB_LIKE` for charts.
    rename : mapping, optional
        Names to replace, for example ``{"k": "k[i]"}``.

    Returns
    -------
    str
        The text, with no more parentheses than necessary.

    Examples
    --------
    >>> from gms_fsm.language import MATLAB_LIKE, parse_condition, parse_value, spell
    >>> guard = parse_condition("abs(v) <= v_c and not z >= s", ["v", "v_c", "z", "s"])
    >>> spell(guard, MATLAB_LIKE)
    '|v| <= v_c && !(z >= s)'
    >>> spell(parse_value("(v / v_s)**2", ["v", "v_s"]))
    'v / v_s * (v / v_s)'
    """
    return fold(node, _Printer(spelling, rename or {})).text


class _Printed(NamedTuple):
    """A text and its precedence."""

    text: str
    level: int

    def at(self, level: int) -> str:
        """Return the text, in parentheses if its precedence is below `level`."""
        return self.text if self.level >= level else f"({self.text})"


class _Printer:
    """The algebra of printed text."""

    def __init__(self, spelling: Spelling, rename: Mapping[str, str]) -> None:
        self.spelling, self.rename = spelling, rename

    def number(self, value: float) -> _Printed:
        text = repr(value)  # always with a point or an exponent: 1/2 stays one half everywhere
        if not self.spelling.products and float(f"{value:g}") == value:
            text = f"{value:g}"
        if not self.spelling.products and value == math.pi:
            text = "pi"
        return _Printed(text, _ATOM if value >= 0 else LEVELS["neg"])

    def name(self, name: str) -> _Printed:
        return _Printed(self.rename.get(name, name), _ATOM)

    def negative(self, _: Negative, parts: Iterator[_Printed]) -> _Printed:
        return _Printed("-" + next(parts).at(LEVELS["neg"] + 1), LEVELS["neg"])

    def binary(self, node: Binary, parts: Iterator[_Printed]) -> _Printed:
        level, (left, right) = LEVELS[node.op], parts
        # The right operand of + and * gets parentheses too: floating-point arithmetic is not
        # associative, and the text must show the order of evaluation.
        return _Printed(f"{left.at(level)} {node.op} {right.at(level + 1)}", level)

    def power(self, node: Binary, parts: Iterator[_Printed]) -> _Printed:
        base, exponent = parts
        if not self.spelling.products:
            return _Printed(f"{base.at(_ATOM)}^{exponent.at(_ATOM)}", LEVELS["**"])
        whole = product_power(node.left, node.right)
        if whole is None:
            return _Printed(f"{self.spelling.called('pow')}({base.text}, {exponent.text})", _ATOM)
        if whole == 0:
            return _Printed("1.0", _ATOM)
        if whole == 1:
            return base
        first, other = base.at(LEVELS["*"]), base.at(LEVELS["*"] + 1)
        product = " * ".join([first] + [other] * (abs(whole) - 1))
        if whole < 0:
            return _Printed(f"1.0 / {other if whole == -1 else f'({product})'}", LEVELS["/"])
        return _Printed(product, LEVELS["*"])

    def call(self, node: Call, parts: Iterator[_Printed]) -> _Printed:
        arguments = ", ".join(part.text for part in parts)
        if node.function == "abs" and self.spelling.bars:
            return _Printed(f"|{arguments}|", _ATOM)
        return _Printed(f"{self.spelling.called(node.function)}({arguments})", _ATOM)

    def relation(self, node: Relation, parts: Iterator[_Printed]) -> _Printed:
        left, right = (part.at(LEVELS["+"]) for part in parts)
        if node.left == Name("age") and node.op == ">=" and self.spelling.timers:
            return _Printed(f"after({right})", _ATOM)
        return _Printed(f"{left} {node.op} {right}", LEVELS["<"])

    def in_state(self, element: int, state: str) -> _Printed:
        own = f"state({element})" if element else "state"
        return _Printed(f"{own} == {state}", LEVELS["<"])

    def negation(self, _: Not, parts: Iterator[_Printed]) -> _Printed:
        word = self.spelling.negation
        if word.startswith(" "):  # after the operand
            return _Printed(next(parts).at(_ATOM) + word, LEVELS["<"])
        operand = next(parts).at(_ATOM if word == "!" else LEVELS["not"])
        return _Printed(word + operand, LEVELS["not"])

    def both(self, node: Both, parts: Iterator[_Printed]) -> _Printed:
        if not node.operands:
            return _Printed(self.spelling.true, _ATOM)
        level = LEVELS["and"]
        return _Printed(self.spelling.both.join(part.at(level + 1) for part in parts), level)

    def either(self, _: Either, parts: Iterator[_Printed]) -> _Printed:
        level = LEVELS["or"]
        return _Printed(self.spelling.either.join(part.at(level + 1) for part in parts), level)
