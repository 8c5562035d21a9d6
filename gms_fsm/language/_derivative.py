"""Partial derivatives of values, as values in the same language."""

from __future__ import annotations

from collections.abc import Iterator

from gms_fsm.language._fold import fold
from gms_fsm.language.functions import CHOICES, SEVERAL
from gms_fsm.language.tree import Binary, Call, Negative, Number, Value, names_in

ZERO, ONE = Number(0.0), Number(1.0)


def derivative(value: Value, name: str) -> Value | None:
    """Return the partial derivative of a value with respect to a name, ignoring its corners.

    Parameters
    ----------
    value : Value
        A flow, a signal or one side of a guard.
    name : str
        The name to differentiate with respect to.

    Returns
    -------
    Value or None
        None if the language cannot express it: a power with the name in its exponent.

    Examples
    --------
    >>> from gms_fsm.language import derivative, parse_value, spell
    >>> print(spell(derivative(parse_value("C * (sgn(v) - z / s)", "Cvzs"), "z")))
    C * -(1.0 / s)
    """
    try:
        return fold(value, _Slope(name))
    except ArithmeticError:
        return None


class _Slope:
    """The algebra of derivatives with respect to one name."""

    def __init__(self, by: str) -> None:
        self.by = by

    def number(self, _: float) -> Value:
        return ZERO

    def name(self, name: str) -> Value:
        return ONE if name == self.by else ZERO

    def negative(self, _: Negative, parts: Iterator[Value]) -> Value:
        return _minus(ZERO, next(parts))

    def binary(self, node: Binary, parts: Iterator[Value]) -> Value:
        a, b = node.parts
        da, db = parts
        match node.op:
            case "+":
                return _plus(da, db)
            case "-":
                return _minus(da, db)
            case "*":
                return _plus(_times(da, b), _times(a, db))
        return _over(_minus(da, _times(node, db)), b)

    def power(self, node: Binary, parts: Iterator[Value]) -> Value:
        base, exponent = node.parts
        if self.by in names_in(exponent):
            raise ArithmeticError("the derivative holds for a positive base only")
        power = Binary("**", base, _minus(exponent, ONE))
        return _times(_times(exponent, power), next(parts))

    def call(self, node: Call, parts: Iterator[Value]) -> Value:
        if self.by not in names_in(node):
            return ZERO
        if node.function == "noise":
            return ZERO
        if node.function in CHOICES:
            left, right, *_ = node.arguments
            _, _, yes, no = parts
            return yes if yes == no else Call(node.function, (left, right, yes, no))
        if node.function in SEVERAL:
            # On the corner itself this gives the mean of both sides.
            du, dw = parts
            apart = _times(Call("sgn", (Binary("-", *node.arguments),)), _minus(du, dw))
            half = Binary("*", Number(0.5), _plus(du, dw))
            other = Binary("*", Number(0.5), apart)
            return _minus(half, other) if node.function == "min" else _plus(half, other)
        return _times(_outer(node), next(parts))


def _outer(call: Call) -> Value:
    """Return the derivative of a function of one argument with respect to that argument."""
    (u,) = call.arguments
    match call.function:
        case "abs":
            return Call("sgn", (u,))
        case "sgn" | "floor" | "round":
            return ZERO
        case "tooth":  # rises from even numbers, falls from odd ones
            return Call("sgn", (Call("tooth", (Binary("+", u, Number(0.5)),)),))
        case "exp":
            return call
        case "log":
            return Binary("/", ONE, u)
        case "sqrt":
            return Binary("/", Number(0.5), call)
        case "sin":
            return Call("cos", (u,))
        case "cos":
            return Negative(Call("sin", (u,)))
        case "tanh":
            return Binary("-", ONE, Binary("*", call, call))
        case "atan":
            return Binary("/", ONE, Binary("+", ONE, Binary("*", u, u)))
        case "asinh":
            return Binary("/", ONE, Call("sqrt", (Binary("+", ONE, Binary("*", u, u)),)))
    raise ArithmeticError(f"no derivative of {call.function} is known")


def _plus(a: Value, b: Value) -> Value:
    if a == ZERO:
        return b
    return a if b == ZERO else Binary("+", a, b)


def _minus(a: Value, b: Value) -> Value:
    if b == ZERO:
        return a
    if isinstance(a, Number) and isinstance(b, Number):
        return Number(a.value - b.value)
    return Negative(b) if a == ZERO else Binary("-", a, b)


def _times(a: Value, b: Value) -> Value:
    if ZERO in (a, b):
        return ZERO
    if a == ONE:
        return b
    return a if b == ONE else Binary("*", a, b)


def _over(a: Value, b: Value) -> Value:
    return ZERO if a == ZERO else Binary("/", a, b)
