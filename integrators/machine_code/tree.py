"""The typed program between the front end and the printers: numbers, addresses, plain statements.

Kinds are ``"f"`` (64-bit float), ``"i"`` (64-bit integer), ``"b"`` (truth value, one byte in
memory) and ``"p"`` (address). Names of locals are unique within a function.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

SIZES = {"f": 8, "i": 8, "b": 1, "p": 8}  # bytes in memory


# --------------------------------------------------------------------------- expressions
@dataclass(frozen=True, eq=False)
class Const:
    """A number; equal to others with the same bits. Named constants of Python keep their names."""

    kind: str
    value: Any
    name: str = ""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Const) and self._bits == other._bits

    def __hash__(self) -> int:
        return hash(self._bits)

    @functools.cached_property
    def _bits(self) -> tuple[str, str]:
        return self.kind, repr(self.value)  # 0.0 is not -0.0, and NaN is NaN


@dataclass(frozen=True)
class Local:
    """A variable or parameter of the function.

    An address says what it leads to: the kind of the entries there, or nothing, to a whole block.
    """

    kind: str
    name: str
    to: str = field(default="", compare=False)


@dataclass(frozen=True)
class Global:
    """The address of a table of constants."""

    name: str
    kind: str = "p"


@dataclass(frozen=True)
class Op:
    """An operation on evaluated operands.

    ``+ - * /``, integer ``// % & | ^ << >>``, comparisons, ``neg``, ``not``, ``abs``, ``sqrt``,
    ``copysign``, ``min`` and ``max`` (as Python's: the first operand unless the second is smaller
    or larger), ``float`` and ``int`` (conversions).
    """

    kind: str
    op: str
    operands: tuple[Expr, ...]


@dataclass(frozen=True)
class Logic:
    """``and`` or ``or``; the right operand is evaluated only if it matters."""

    op: str
    left: Expr
    right: Expr
    kind: str = "b"


@dataclass(frozen=True)
class Choose:
    """``yes if test else no``; only one of them is evaluated."""

    kind: str
    test: Expr
    yes: Expr
    no: Expr


@dataclass(frozen=True)
class Address:
    """A place in memory: base + offset bytes + index times the size of an entry.

    That of a number of a record has a name, for readers of what is printed. In an empty array there
    is no place: what reads or writes there is never reached.
    """

    base: Expr
    offset: int = 0
    index: Expr | None = None
    size: int = 8
    name: str = field(default="", compare=False)
    empty: bool = field(default=False, compare=False)


@dataclass(frozen=True)
class Load:
    """The content of a place in memory."""

    kind: str
    address: Address


@dataclass(frozen=True)
class AddressOf:
    """An address as a value, and the kind of the entries there."""

    address: Address
    kind: str = "p"
    to: str = field(default="", compare=False)


@dataclass(frozen=True)
class Invoke:
    """A call of a function of the module; its kind is empty unless it returns one number."""

    kind: str
    name: str
    arguments: tuple[Expr, ...]
    writes: bool = field(default=False, compare=False)  # also without memory among its arguments


@dataclass(frozen=True)
class Foreign:
    """A call of a function of the C library, from float to float."""

    name: str
    arguments: tuple[Expr, ...]
    kind: str = "f"


@dataclass(frozen=True)
class Callback:
    """A call of a function of the host program, from float to float, by its number."""

    number: int
    arguments: tuple[Expr, ...]
    kind: str = "f"


Expr = Const | Local | Global | Op | Logic | Choose | Load | AddressOf | Invoke | Foreign | Callback


def leads_to(expr: Expr) -> str:
    """Return the kind of the entries that an address leads to; empty for a block.

    Examples
    --------
    >>> leads_to(Global("table0")), leads_to(Local("p", "y.0.", "f"))
    ('f', 'f')
    """
    match expr:
        case Local(to=kind) | AddressOf(to=kind):
            return kind
        case Choose(yes=yes):
            return leads_to(yes)
        case Global():
            return "f"
    return ""


def may_write(expr: Expr) -> bool:
    """Return whether an expression calls a function of the module that is given memory.

    Examples
    --------
    >>> may_write(Invoke("f", "sin", (Local("f", "x"),)))
    False
    >>> may_write(Invoke("i", "ask", (), writes=True))  # it knows where the memory is
    True
    """
    made = [each for each in parts_of(expr) if isinstance(each, Invoke)]
    return any(each.writes or any(u.kind == "p" for u in each.arguments) for each in made)


def parts_of(expr: Expr) -> list[Expr]:
    """Return an expression and all its parts, from left to right.

    Examples
    --------
    >>> total = Op("f", "+", (Local("f", "a"), Const("f", 1.0)))
    >>> [type(each).__name__ for each in parts_of(total)]
    ['Op', 'Local', 'Const']
    """
    found: list[Expr] = []
    waiting = [expr]
    while waiting:
        each = waiting.pop()
        found.append(each)
        if below := _BELOW.get(type(each)):
            waiting += below(each)[::-1]
    return found


def _in_address(expr: Load | AddressOf) -> tuple[Expr, ...]:
    address = expr.address
    return (address.base,) if address.index is None else (address.base, address.index)


_BELOW: Mapping[type[Expr], Callable[[Any], tuple[Expr, ...]]] = {
    Op: operator.attrgetter("operands"),
    Logic: operator.attrgetter("left", "right"),
    Choose: operator.attrgetter("test", "yes", "no"),
    Load: _in_address,
    AddressOf: _in_address,
    **dict.fromkeys((Invoke, Foreign, Callback), operator.attrgetter("arguments")),
}


def locals_in(expr: Expr) -> Iterator[Local]:
    """Yield the locals that an expression reads.

    Examples
    --------
    >>> [each.name for each in locals_in(Op("f", "+", (Local("f", "a"), Local("f", "b"))))]
    ['a', 'b']
    """
    return (part for part in parts_of(expr) if isinstance(part, Local))


# --------------------------------------------------------------------------- statements
@dataclass(frozen=True)
class Assign:
    """Assign to a local."""

    target: Local
    value: Expr


@dataclass(frozen=True)
class AssignMany:
    """Assign several results of a call to locals."""

    targets: tuple[Local, ...]
    call: Invoke


@dataclass(frozen=True)
class Put:
    """Write to memory."""

    kind: str
    address: Address
    value: Expr


@dataclass(frozen=True)
class Do:
    """Call a function that returns nothing."""

    call: Expr


@dataclass(frozen=True)
class If:
    """A branch."""

    test: Expr
    body: tuple[Statement, ...]
    orelse: tuple[Statement, ...]


@dataclass(frozen=True)
class While:
    """A loop."""

    test: Expr
    body: tuple[Statement, ...]


@dataclass(frozen=True)
class For:
    """A loop over a range with a constant step; the limit is evaluated once."""

    target: Local
    start: Expr
    stop: Expr
    step: int
    body: tuple[Statement, ...]


@dataclass(frozen=True)
class Break:
    """Leave the innermost loop."""


@dataclass(frozen=True)
class Continue:
    """Begin the next turn of the innermost loop."""


@dataclass(frozen=True)
class Return:
    """Return numbers."""

    values: tuple[Expr, ...]


Statement = Assign | AssignMany | Put | Do | If | While | For | Break | Continue | Return


def blocks_of(statement: Statement) -> tuple[tuple[Statement, ...], ...]:
    """Return the blocks of statements inside a statement."""
    match statement:
        case If(body=body, orelse=orelse):
            return body, orelse
        case For(body=body) | While(body=body):
            return (body,)
    return ()


def statements_of(body: Iterable[Statement]) -> Iterator[Statement]:
    """Yield all statements, those inside others after them."""
    for each in body:
        yield each
        for block in blocks_of(each):
            yield from statements_of(block)


def targets_of(statement: Statement) -> tuple[Local, ...]:
    """Return the locals that a statement itself assigns to."""
    match statement:
        case Assign(target=target) | For(target=target):
            return (target,)
        case AssignMany(targets=targets):
            return targets
    return ()


def expressions_of(statement: Statement) -> tuple[Expr, ...]:
    """Return the expressions of a statement itself, without those of its blocks."""
    match statement:
        case Assign(value=value):
            return (value,)
        case AssignMany(call=call) | Do(call=call):
            return (call,)
        case Put(address=address, value=value):
            return AddressOf(address), value
        case If(test=test) | While(test=test):
            return (test,)
        case For(start=start, stop=stop):
            return start, stop
        case Return(values=values):
            return values
    return ()


def expressions_in(body: Iterable[Statement]) -> Iterator[Expr]:
    """Yield all expressions and their parts."""
    for statement in statements_of(body):
        for each in expressions_of(statement):
            yield from parts_of(each)


# --------------------------------------------------------------------------- modules
@dataclass(frozen=True)
class OuterEntry:
    """An entry of a module that is in memory already, called with arrays and integers.

    It stands for a function that returns an integer.
    """

    name: str


@dataclass(frozen=True)
class TypedFunction:
    """A function; entries can be called from outside.

    Parameters
    ----------
    name : str
        Unique in its module.
    parameters : tuple of Local
        Numbers and addresses.
    results : str
        The kinds of what it returns, one letter each.
    variables : tuple of Local
        Its other locals.
    body : tuple of Statement
        What it does.
    entry : bool
        Whether it can be called from outside.
    inline : bool, optional
        Whether it is put inline; LLVM decides if omitted.
    about : str
        What it is for, for readers of what is printed.
    apart : tuple of str
        Of its arguments the arrays that nothing else that it is given overlaps.
    """

    name: str
    parameters: tuple[Local, ...]
    results: str
    variables: tuple[Local, ...]
    body: tuple[Statement, ...]
    entry: bool = False
    inline: bool | None = None
    about: str = field(default="", compare=False)
    apart: tuple[str, ...] = ()


@dataclass(frozen=True)
class ConstantTable:
    """Constants in memory."""

    name: str
    kind: str
    values: tuple[Any, ...]


@dataclass
class Module:
    """Functions in the order in which they are needed, and tables."""

    functions: list[TypedFunction] = field(default_factory=list)
    tables: list[ConstantTable] = field(default_factory=list)
    callbacks: int = 0
    outer: dict[str, str] = field(default_factory=dict)  # entries of others: kinds of arguments
    # Of the block, if what may be needed is read at once: it pays where eight numbers are computed
    # side by side, of which one may need it.
    words: int = 0
