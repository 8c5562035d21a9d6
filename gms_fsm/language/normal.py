"""Transformations of trees: clauses, atomic comparisons, corners and jumps, renaming."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from gms_fsm.language._powers import integer_power
from gms_fsm.language.functions import CHOICES, ROUGH
from gms_fsm.language.tree import (
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
    is_whole,
    rebuilt,
    walk,
)

_NUMBER = re.compile(r"(?<![\w.])(?<!\*\*)(?<!\*\* )(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![\w.])")


def clauses(condition: Condition) -> tuple[Condition, ...]:
    """Return the parts of a conjunction, or the condition alone.

    Parameters
    ----------
    condition : Condition
        For example a guard.

    Returns
    -------
    tuple of Condition
        In the order of the text.

    Examples
    --------
    >>> from gms_fsm.language import clauses, parse_condition, spell
    >>> [spell(c) for c in clauses(parse_condition("z >= s and v > 0", "zsv"))]
    ['z >= s', 'v > 0.0']
    """
    return condition.operands if isinstance(condition, Both) else (condition,)


def relations(condition: Condition) -> tuple[Relation, ...]:
    """Return the comparisons of a condition, in the order of the text; one may stand twice.

    Parameters
    ----------
    condition : Condition
        For example a guard.

    Returns
    -------
    tuple of Relation
        Also those inside ``not``, as they are written.

    Examples
    --------
    >>> from gms_fsm.language import parse_condition, relations, spell
    >>> guard = parse_condition("z >= s and (v > 0 or not z >= s)", "zsv")
    >>> [spell(part) for part in relations(guard)]
    ['z >= s', 'v > 0.0', 'z >= s']
    """
    return tuple(node for node in walk(condition) if isinstance(node, Relation))


# --------------------------------------------------------------------------- atomic comparisons
@dataclass(frozen=True)
class Comparison:
    """The one relation behind ``z >= s`` and ``z < s``: its margin is ``left - right``.

    True where the margin is positive and, unless `strict`, also where it is zero. In IEEE
    arithmetic the sign of ``left - right`` agrees exactly with the raw comparison.
    """

    left: Value
    right: Value
    strict: bool


@dataclass(frozen=True)
class Requirement:
    """A comparison that must be true (or false, if `holds` is False)."""

    comparison: Comparison
    holds: bool

    @property
    def relation(self) -> Relation:
        """The requirement as an ordinary relation."""
        strict = self.comparison.strict
        op = (">" if strict else ">=") if self.holds else ("<=" if strict else "<")
        return Relation(op, self.comparison.left, self.comparison.right)


Split: TypeAlias = "Requirement | tuple[str, tuple[Split, ...]]"


def split(condition: Condition, holds: bool = True) -> Split:
    """Split a condition into comparisons joined only by ``"both"`` and ``"either"``.

    ``abs(u) <= c`` becomes ``u <= c`` and ``u >= -c`` (a root finder on ``c - abs(u)`` would step
    over a narrow window; two monotone margins prevent that), negations are pushed down to the
    comparisons, and ``z < s`` and ``z >= s`` become the same `Comparison`.

    Parameters
    ----------
    condition : Condition
        A checked condition.
    holds : bool
        False to split its negation.

    Returns
    -------
    Requirement or (str, tuple)
        A requirement, or ``("both" | "either", parts)``.

    Examples
    --------
    >>> from gms_fsm.language import parse_condition, spell, split
    >>> word, parts = split(parse_condition("abs(v) <= c", ["v", "c"]))
    >>> word, [spell(p.relation) for p in parts]
    ('both', ['v <= c', 'v >= -c'])
    """
    match condition:
        case InState():
            raise TypeError("a guard depends on values, not on states")
        case Not(operand):
            return split(operand, not holds)
        case Both(operands) | Either(operands):
            word = "both" if isinstance(condition, Both) == holds else "either"
            parts: list[Split] = []
            for operand in operands:
                part = split(operand, holds)
                if isinstance(part, Requirement) or part[0] != word:
                    parts.append(part)
                else:  # a conjunction nested in a conjunction
                    parts.extend(part[1])
            return word, tuple(parts)
        case Relation(op, Call("abs", (Call("abs") as inner,)), bound):
            return split(Relation(op, inner, bound), holds)  # ||u|| is |u|
        case Relation(op, Call("abs", (inner,)), bound):
            below = op in ("<", "<=")
            other = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}[op]
            two = (Relation(op, inner, bound), Relation(other, inner, Negative(bound)))
            return split(Both(two) if below else Either(two), holds)
        case Relation(op, left, Call("abs", (inner,))):
            mirrored = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}[op]
            return split(Relation(mirrored, Call("abs", (inner,)), left), holds)
        case Relation(op, left, right):
            positive = op in (">", ">=")
            strict = op in (">", "<=")  # a <= b is the negation of a > b
            return Requirement(Comparison(left, right, strict), positive == holds)


def comparisons(part: Split) -> tuple[Comparison, ...]:
    """Return the atomic comparisons of a split condition.

    Parameters
    ----------
    part : Requirement or (str, tuple)
        From `split`.

    Returns
    -------
    tuple of Comparison
        In the order of the text, with repetitions.

    Examples
    --------
    >>> from gms_fsm.language import comparisons, parse_condition, spell, split
    >>> [spell(c.left) for c in comparisons(split(parse_condition("z >= s and v > 0", "zsv")))]
    ['z', 'v']
    """
    if isinstance(part, Requirement):
        return (part.comparison,)
    return tuple(c for each in part[1] for c in comparisons(each))


# --------------------------------------------------------------------------- corners and jumps
def numbers_named(text: str, name: str) -> tuple[str, dict[str, str]]:
    """Return a text with names where it had numbers, and these.

    Zeros stay, and exponents.

    Parameters
    ----------
    text : str
        A formula or a guard.
    name : str
        The first name; the others end in ``_2``, ``_3`` ...

    Returns
    -------
    str
        The text.
    dict of str to str
        What stood there, by name.

    Examples
    --------
    >>> from gms_fsm.language import numbers_named
    >>> numbers_named("0.2*sin(3*t)**2", "u_is")
    ('u_is*sin(u_is_2*t)**2', {'u_is': '0.2', 'u_is_2': '3'})
    """
    numbers = dict[str, str]()

    def name_of(found: re.Match[str]) -> str:
        if not float(found[0]):
            return found[0]
        own = f"{name}_{len(numbers) + 1}" if numbers else name
        numbers[own] = found[0]
        return own

    return _NUMBER.sub(name_of, text), numbers


def rough_points(value: Value) -> tuple[Value, ...]:
    """Return every u whose sign decides a corner or a jump of `value`, innermost first.

    ``sgn(u)`` and ``abs(u)`` turn at u = 0, ``min(a, b)``, ``max(a, b)`` and ``if(a > b, ...)`` at
    a - b = 0, ``floor(u)`` at whole numbers, where ``tooth(u)`` is 0.

    Parameters
    ----------
    value : Value
        A flow or a signal.

    Returns
    -------
    tuple of Value
        Without duplicates.

    Examples
    --------
    >>> from gms_fsm.language import parse_value, rough_points, spell
    >>> [spell(u) for u in rough_points(parse_value("sgn(v) + max(v, 2)", ["v"]))]
    ['v', 'v - 2.0']
    """
    found = [_turning(n) for n in walk(value) if isinstance(n, Call) and n.function in ROUGH]
    return tuple(dict.fromkeys(found))


def turning_inside(value: Value, new: Mapping[str, Value]) -> Value:
    """Return a value with names replaced only inside its calls that have a corner or a jump.

    Parameters
    ----------
    value : Value
        For example an output that uses the rate dz.
    new : mapping of str to Value
        The replacement for each name.

    Returns
    -------
    Value
        A tree whose corners do not depend on these names.

    Examples
    --------
    >>> from gms_fsm.language import Name, parse_value, spell, turning_inside
    >>> spell(turning_inside(parse_value("k * dz + abs(dz)", ["k", "dz"]), {"dz": Name("v")}))
    'k * dz + abs(v)'
    """
    if isinstance(value, Call) and value.function in ROUGH:
        return renamed(value, new)
    return rebuilt(value, lambda part: turning_inside(part, new))


def _turning(call: Call) -> Value:
    a, *others = call.arguments
    match call.function:
        case "floor":
            return Call("tooth", (a,))
        case "round":
            return Call("tooth", (Binary("+", a, Number(0.5)),))
    if not others or others[0] == Number(0.0):
        return a
    return Binary("-", a, others[0])


def frozen(call: Call, sign: Value) -> Value:
    """Return a rough call as it goes on beyond its corner or jump while a sign is held.

    Parameters
    ----------
    call : Call
        The call, see `rough_points`.
    sign : Value
        The sign that is held: 1, -1, or 0 on the corner itself.

    Returns
    -------
    Value
        The same as the call as long as the sign is right.

    Examples
    --------
    >>> from gms_fsm.language import Name, frozen, parse_value, spell
    >>> spell(frozen(parse_value("if(v >= 1, v, 2)", ["v"]), Name("sign")))
    '(v if sign >= 0.0 else 2.0)'
    """
    a, *_ = call.arguments
    zero = Number(0.0)
    match call.function:
        case "sgn":
            return sign
        case "abs":
            return Binary("*", sign, a)
        case "min" | "max":
            return Call(
                "if_le" if call.function == "min" else "if_ge", (sign, zero, *call.arguments)
            )
        case "floor":
            there = Call("if_lt", (sign, zero, _below(a, odd=True), Call("round", (a,))))
            return Call("if_gt", (sign, zero, _below(a), there))
        case "round":
            u = Binary("+", a, Number(0.5))
            return Call("if_ge", (sign, zero, _below(u), _below(u, odd=True)))
    return Call(call.function, (sign, zero, *call.arguments[2:]))


def _below(u: Value, odd: bool = False) -> Value:
    """Return the even, or the odd, whole number below u, and half a number beyond the next."""
    half = Binary("-", Binary("*", Number(0.5), u), Number(0.75 if odd else 0.25))
    even = Binary("*", Number(2.0), Call("round", (half,)))
    return Binary("+", even, Number(1.0)) if odd else even


def substitute(
    value: Value, name_of: Callable[[Value, Call], str | None]
) -> tuple[Value, dict[str, Call]]:
    """Replace every rough call by a name whose value is computed beforehand from a frozen sign.

    Parameters
    ----------
    value : Value
        A flow or a signal.
    name_of : callable
        Takes the value at whose sign a call turns and the call, whose arguments are already
        smooth; returns a different name for each call, or None to leave it in place.

    Returns
    -------
    smooth : Value
        The tree with names in place of the calls.
    calls : dict of str to Call
        The call that each such name stands for, in the order in which they must be computed;
        arguments are already smooth. A call under a square root or a power is left in place: with
        its sign frozen, it would become negative beyond the corner, where these are not defined.
    """
    calls: dict[str, Call] = {}

    def smooth(node: Value) -> Value:
        match node:
            case Call("sqrt"):
                return node
            case Binary("**", base, exponent) if integer_power(exponent) is None:
                return Binary("**", base, smooth(exponent))
            case Call(function, arguments) if function in ROUGH:
                inner = Call(function, tuple(smooth(argument) for argument in arguments))
                name = name_of(_turning(node), inner)
                if name is None:
                    return inner
                calls[name] = inner
                return Name(name)
        return rebuilt(node, smooth)

    return smooth(value), calls


def renamed(value: Value, new: Mapping[str, Value]) -> Value:
    """Return a value with some names replaced by other values.

    Parameters
    ----------
    value : Value
        A tree.
    new : mapping of str to Value
        The replacements, by name.

    Returns
    -------
    Value
        The new tree.

    Examples
    --------
    >>> from gms_fsm.language import Name, parse_value, renamed, spell
    >>> spell(renamed(parse_value("k * dz", ["k", "dz"]), {"dz": Name("v")}))
    'k * v'
    """
    if isinstance(value, Name):
        return new.get(value.id, value)
    return rebuilt(value, lambda part: renamed(part, new))


def renamed_in(condition: Condition, new: Mapping[str, Value]) -> Condition:
    """Return a condition with some names replaced by values."""
    match condition:
        case Relation(op, left, right):
            return Relation(op, renamed(left, new), renamed(right, new))
        case Not(operand):
            return Not(renamed_in(operand, new))
        case Both(operands):
            return Both(tuple(renamed_in(each, new) for each in operands))
        case Either(operands):
            return Either(tuple(renamed_in(each, new) for each in operands))
    return condition


# --------------------------------------------------------------------------- short forms
def written_out(function: str, a: Value, b: Value, *more: Value) -> Value:
    """Return what a function of `gms_fsm.language.functions.SHORT` other than if stands for."""
    match function:
        case "saturate":
            return Call("min", (Call("max", (a, b)), *more))
        case "noise":
            return Call("noise", tuple(u if is_whole(u) else Call("floor", (u,)) for u in (a, b)))
    whole = Call("floor" if function == "mod" else "round", (Binary("/", a, b),))
    parts = Binary("*", b, whole)
    return parts if function == "quantise" else Binary("-", a, parts)


def chosen(condition: Condition, yes: Value, no: Value) -> Value:
    """Return a choice between two values, one comparison at a time."""
    match condition:
        case Relation(op, left, right):
            name = next(each for each, known in CHOICES.items() if known == op)
            return Call(name, (left, right, yes, no))
        case Not(operand):
            return chosen(operand, no, yes)
        case Both(operands):
            for each in reversed(operands):
                yes = chosen(each, yes, no)
            return yes
        case Either(operands):
            for each in reversed(operands):
                no = chosen(each, yes, no)
            return no
    raise TypeError("a value depends on numbers, not on states")
