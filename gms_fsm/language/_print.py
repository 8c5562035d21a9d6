"""Printing of a checked tree in any notation: one algebra, which reads a row of `_dialects`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gms_fsm.language._dialects import ATOM, LEVELS, PYTHON, Dialect, Printed
from gms_fsm.language._fold import fold
from gms_fsm.language._powers import product_power
from gms_fsm.language.functions import CHOICES
from gms_fsm.language.tree import (
    Binary,
    Both,
    Call,
    Condition,
    Either,
    Name,
    Negative,
    Node,
    Not,
    Relation,
    Value,
)

EVENT = "event__"  # the name of an event begins like this; it is 1 where the event has come


def awaited(clause: Node) -> str:
    """Return the event that a clause of a guard waits for; empty for any other clause."""
    if isinstance(clause, Relation) and isinstance(clause.left, Name):
        name = clause.left.id
        return name.removeprefix(EVENT) if name.startswith(EVENT) else ""
    return ""


def spell(node: Node, dialect: Dialect = PYTHON, rename: Mapping[str, str] | None = None) -> str:
    """Write a tree as text.

    Parameters
    ----------
    node : Node
        A value or a condition.
    dialect : Dialect
        The notation: `PYTHON` for generated code, `MATLAB_LIKE` for charts, or another row.
    rename : mapping, optional
        What is written for some names, for example ``{"k": "k[i]"}``.

    Returns
    -------
    str
        The text, with no more parentheses than the dialect asks for.

    Raises
    ------
    KeyError
        If the dialect does not have a function of the tree.

    Examples
    --------
    >>> from gms_fsm.language import C99, MATLAB_LIKE, parse_condition, parse_value, spell
    >>> guard = parse_condition("abs(v) <= v_c and not z >= s", ["v", "v_c", "z", "s"])
    >>> spell(guard, MATLAB_LIKE)
    '|v| <= v_c && !(z >= s)'
    >>> spell(parse_value("(v / v_s)**2", ["v", "v_s"]))
    'v / v_s * (v / v_s)'
    >>> spell(parse_value("-k * abs(z) - z**2", "kz"), C99, {"k": "k[i]"})
    '(-k[i]) * fabs(z) - z * z'
    """
    return fold(node, _Printer(dialect, rename or {})).text


def _short(node: Binary) -> Call | None:
    """Return the call that was read as this, see `gms_fsm.language.functions.SHORT`."""
    match node:
        case Binary("-", a, Binary("*", b, Call("floor", (Binary("/", c, d),)))) if (a, b) == (
            c,
            d,
        ):
            return Call("mod", (a, b))
        case Binary("*", q, Call("round", (Binary("/", u, p),))) if p == q:
            return Call("quantise", (u, q))
    return None


def _chosen(node: Call) -> tuple[Condition, Value, Value]:
    """Return the condition of a choice that was read one comparison at a time, and both values."""

    def relation(node: Call) -> Relation:
        return Relation(CHOICES[node.function], *node.arguments[:2])

    *_, yes, no = node.arguments
    both, either = [relation(node)], [relation(node)]
    while isinstance(yes, Call) and yes.function in CHOICES and yes.arguments[3] == no:
        both.append(relation(yes))
        yes = yes.arguments[2]
    while len(both) == 1 and isinstance(no, Call) and no.function in CHOICES:
        if no.arguments[2] != yes:
            break
        either.append(relation(no))
        no = no.arguments[3]
    if len(either) > 1:
        return Either(tuple(either)), yes, no
    return Both(tuple(both)) if len(both) > 1 else both[0], yes, no


class _Printer:
    """The algebra of printed text."""

    def __init__(self, dialect: Dialect, rename: Mapping[str, str]) -> None:
        self.dialect, self.rename = dialect, rename

    def printed(self, text: str, level: int = ATOM) -> Printed:
        return Printed(text, level, self.dialect.brackets)

    def operator(self, operator: str, *parts: Printed) -> Printed:
        form = self.dialect.operators[operator]
        return self.printed(form(*parts), form.level)

    def function(self, function: str, parts: Iterator[Printed]) -> Printed:
        pattern = self.dialect.functions[function]
        texts = [part.text for part in parts]
        return self.printed(pattern.format(*texts, all=", ".join(texts)))

    def number(self, value: float) -> Printed:
        text = self.dialect.number(value)
        if "^" in text:  # a power of ten, after its factor
            return self.printed(text, LEVELS["*"])
        return self.printed(text, ATOM if value >= 0.0 else self.dialect.operators["neg"].level)

    def name(self, name: str) -> Printed:
        return self.printed(self.rename.get(name) or self.dialect.name(name))

    def negative(self, _: Negative, parts: Iterator[Printed]) -> Printed:
        return self.operator("neg", *parts)

    def binary(self, node: Binary, parts: Iterator[Printed]) -> Printed:
        short = _short(node)
        if short is not None and short.function in self.dialect.functions:
            return self.function(short.function, (fold(each, self) for each in short.arguments))
        return self.operator(node.op, *parts)

    def power(self, node: Binary, parts: Iterator[Printed]) -> Printed:
        if "**" in self.dialect.operators:
            return self.operator("**", *parts)
        whole = product_power(node.left, node.right)
        if whole is None:
            return self.function("pow", parts)
        base, one = next(parts), self.dialect.number(1.0)
        if whole == 0:
            return self.printed(one)
        if whole == 1:
            return base
        first, other = base.at(LEVELS["*"]), base.at(LEVELS["*"] + 1)
        product = " * ".join([first] + [other] * (abs(whole) - 1))
        if whole < 0:
            return self.printed(f"{one} / {other if whole == -1 else f'({product})'}", LEVELS["/"])
        return self.printed(product, LEVELS["*"])

    def call(self, node: Call, parts: Iterator[Printed]) -> Printed:
        if node.function in CHOICES and "if" in self.dialect.functions:
            return self.function("if", (fold(each, self) for each in _chosen(node)))
        return self.function(node.function, parts)

    def relation(self, node: Relation, parts: Iterator[Printed]) -> Printed:
        if node.left == Name("age") and node.op == ">=" and "after" in self.dialect.functions:
            next(parts)
            return self.function("after", parts)
        if (event := awaited(node)) and "after" in self.dialect.functions:  # a chart shows it
            return self.name(event)
        return self.operator(node.op, *parts)

    def in_state(self, element: int, state: str) -> Printed:
        own = f"state({element})" if element else "state"
        return self.printed(f"{own} == {state}", LEVELS["<"])

    def negation(self, _: Not, parts: Iterator[Printed]) -> Printed:
        return self.operator("not", *parts)

    def both(self, node: Both, parts: Iterator[Printed]) -> Printed:
        match node.operands:
            case (Relation("<=", a, b), Relation(">=", c, d)) if (a, b) == (
                c,
                d,
            ) and "==" in self.dialect.operators:
                return self.operator("==", fold(a, self), fold(b, self))
        return self.joined("and", parts) if node.operands else self.printed(self.dialect.true)

    def either(self, _: Either, parts: Iterator[Printed]) -> Printed:
        return self.joined("or", parts)

    def joined(self, operator: str, parts: Iterator[Printed]) -> Printed:
        form = self.dialect.operators[operator]
        inside, *_ = form.inner
        return self.printed(str(form.write).join(part.at(inside) for part in parts), form.level)
