"""Which values the numbers of a module can have, found by following every path from its entries.

A number of the block begins as it is at the start, and then has what is written to it. What no path
writes is a constant. A branch that cannot be taken is not followed.
"""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from integrators.machine_code.tree import (
    Address,
    AddressOf,
    Assign,
    AssignMany,
    Break,
    Choose,
    Const,
    Continue,
    Do,
    Expr,
    For,
    If,
    Invoke,
    Load,
    Local,
    Logic,
    Module,
    Op,
    Put,
    Return,
    Statement,
    TypedFunction,
    While,
    expressions_in,
    parts_of,
    statements_of,
)

__all__ = [
    "BlockStart",
    "Possible",
    "changing_of",
    "impossible",
]

Values = frozenset[Const] | None  # None: any
MOST = 16  # values of one number that are kept apart
NONE: frozenset[Const] = frozenset()
INFINITE = frozenset({Const("f", math.inf)})
_OPERATIONS: Mapping[str, Callable[..., Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
    "//": operator.floordiv, "%": operator.mod, "&": operator.and_, "|": operator.or_,
    "^": operator.xor, "<<": operator.lshift, ">>": operator.rshift,
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
    "==": operator.eq, "!=": operator.ne, "neg": operator.neg, "not": operator.not_, "abs": abs,
    "sqrt": math.sqrt, "copysign": math.copysign, "min": min, "max": max,
    "float": float, "int": int,
}  # fmt: skip
_TYPES: Mapping[str, Any] = {"f": float, "i": int, "b": bool}


# --------------------------------------------------------------------------- walking
def root_of(expr: Expr) -> str:
    """Return the local from which an address is found; empty if there is none."""
    match expr:
        case Local(kind="p", name=name):
            return name
        case AddressOf(address=address):
            return root_of(address.base)
    return ""


def changing_of(module: Module) -> set[tuple[str, str]]:
    """Return the addresses through which something is written, by function and local."""
    found = set[tuple[str, str]]()
    parameters = {f.name: f.parameters for f in module.functions}
    before = -1
    while len(found) != before:
        before = len(found)
        for f in module.functions:
            for each in statements_of(f.body):
                match each:
                    case Put(address=address):
                        found.add((f.name, root_of(address.base)))
                    case Assign(target=target, value=value) if (
                        target.kind == "p" and (f.name, target.name) in found
                    ):
                        found |= {(f.name, root_of(part)) for part in parts_of(value)}
            for part in expressions_in(f.body):
                if isinstance(part, Invoke):
                    for own, given in zip(parameters[part.name], part.arguments, strict=True):
                        if (part.name, own.name) in found:
                            found |= {(f.name, root_of(each)) for each in parts_of(given)}
    return found


def _written(module: Module) -> Iterator[int]:
    """Yield the offsets in the block of what is written, or lent to who writes there."""
    changing = changing_of(module)
    parameters = {f.name: f.parameters for f in module.functions}
    for f in module.functions:
        lent: list[Expr] = []
        for each in statements_of(f.body):
            match each:
                case Put(address=address) if _whole(address.base):
                    yield address.offset
                case Assign(target=target, value=value) if (f.name, target.name) in changing:
                    lent.append(value)
        for part in expressions_in(f.body):
            if isinstance(part, Invoke):
                pairs = zip(parameters[part.name], part.arguments, strict=True)
                lent += [given for own, given in pairs if (part.name, own.name) in changing]
        for expr in lent:
            for part in parts_of(expr):
                if isinstance(part, AddressOf) and _whole(part.address.base):
                    yield part.address.offset


def _whole(base: Expr) -> bool:
    """Return whether an address is that of a whole block."""
    return isinstance(base, Local) and base.kind == "p" and not base.to


# --------------------------------------------------------------------------- values
@dataclass(frozen=True)
class BlockStart:
    """What is in a block at the start, by offset."""

    numbers: Mapping[int, Const]  # single ones
    arrays: Mapping[int, Sequence[Const]]  # of words of eight bytes


class Possible:
    """The possible values of everything in a module.

    `given` are the offsets in the block of what is also written from outside.

    Examples
    --------
    >>> from integrators.machine_code.front_end.translate import Translator
    >>> from integrators.machine_code.front_end.values import NumberValue
    >>> from integrators.step_size import memory_of
    >>> translator = Translator()
    >>> _ = translator.entry("entry", memory_of, [NumberValue(Const("f", 4.0))])
    >>> found = Possible(translator.module, BlockStart({}, {}), ())
    >>> [each.value for each in found.results["memory_of"][0]]
    [2.0]
    """

    def __init__(self, module: Module, start: BlockStart, given: Collection[int] = ()) -> None:
        self.functions = {each.name: each for each in module.functions}
        self.words: dict[int, Values] = {
            place: None if place in given else frozenset({value})
            for place, value in start.numbers.items()
        }
        self.rows = dict[int, Values]()  # by each word of the arrays that nothing writes
        written = {*given, *_written(module)}
        for place, row in start.arrays.items():
            words = range(place, place + 8 * len(row), 8)
            if len({*row}) <= MOST and written.isdisjoint(words):
                self.rows |= dict.fromkeys(words, frozenset(row))
        self.locals: dict[tuple[str, str], Values] = {}
        self.results: dict[str, list[Values]] = {
            each.name: [NONE] * len(each.results) for each in module.functions
        }
        self.reached = {each.name for each in module.functions if each.entry}
        for each in module.functions:
            if each.entry:
                self.locals |= {(each.name, u.name): None for u in each.parameters}
        self.readers = dict[Any, set[str]]()  # of a number of the block, or of a function's results
        self.waiting = {*self.reached}  # functions to be followed again
        while self.waiting:
            for each in reversed(module.functions):  # those that call before those that are called
                if each.name in self.waiting:
                    self.waiting.remove(each.name)
                    self._block(each, each.body)

    # ------------------------------------------------------------------ what is learnt
    def _joined(self, known: Values, more: Values, readers: Iterable[str]) -> Values:
        """Return more possible values; who reads them is followed again if there are new ones."""
        if known is None or (more is not None and more <= known):
            return known
        self.waiting |= {*readers} & self.reached
        joined = None if more is None else known | more
        return None if joined is None or len(joined) > MOST else joined

    def _assign(self, name: str, local: str, more: Values) -> None:
        key = name, local
        self.locals[key] = self._joined(self.locals.get(key, NONE), more, [name])

    def _block(self, function: TypedFunction, body: Iterable[Statement]) -> bool:
        """Follow statements; return whether what comes after them may be reached."""
        return all(self._statement(function, each) for each in body)

    def _statement(self, function: TypedFunction, statement: Statement) -> bool:
        name = function.name
        match statement:
            case Assign(target=target, value=value):
                self._assign(name, target.name, self.of(name, value))
            case AssignMany(targets=targets, call=call):
                self.of(name, call)
                for k, target in enumerate(targets):
                    self._assign(name, target.name, self.results[call.name][k])
            case Put(address=address, value=value):
                self._look_at(name, address)
                made = self.of(name, value)
                if (place := self.place(address)) in self.words:
                    readers = self.readers.get(place, ())
                    self.words[place] = self._joined(self.words[place], made, readers)
            case Do(call=call):
                self.of(name, call)
            case If(test=test, body=body, orelse=orelse):
                tests = self.of(name, test)
                if tests == NONE:  # not known yet
                    return False
                ways = [body] if holds(tests) else [orelse] if fails(tests) else [body, orelse]
                ways = [way for way in ways if not impossible(way)]
                goes_on = [self._block(function, way) for way in ways]
                return any(goes_on)
            case While(test=test, body=body):
                if not fails(self.of(name, test)):
                    self._block(function, body)
            case For(target=target, start=start, stop=stop, body=body):
                first, last = self.of(name, start), self.of(name, stop)
                if not never(first, last):
                    self._assign(name, target.name, None)
                    self._block(function, body)
            case Return(values=values):
                known, readers = self.results[name], self.readers.get(name, ())
                for k, value in enumerate(values):
                    known[k] = self._joined(known[k], self.of(name, value), readers)
                return False
            case Break() | Continue():
                return False
        return True

    # ------------------------------------------------------------------ values
    def place(self, address: Address) -> int:
        """Return the offset of a single number of the block, or -1."""
        return address.offset if _whole(address.base) and address.index is None else -1

    def _look_at(self, name: str, address: Address) -> None:
        self.of(name, address.base)
        if address.index is not None:
            self.of(name, address.index)

    def of(self, name: str, expr: Expr) -> Values:
        """Return the possible values of an expression of a function."""
        match expr:
            case Const():
                return frozenset({expr})
            case Local(kind=kind, name=local):
                return None if kind == "p" else self.locals.get((name, local), NONE)
            case Load(address=address):
                self._look_at(name, address)
                if (place := self.place(address)) in self.words:
                    self.readers.setdefault(place, set()).add(name)
                    return self.words[place]
                known = _whole(address.base) and not address.empty
                return self.rows.get(address.offset) if known else None
            case Choose(test=test, yes=yes, no=no):
                tests = self.of(name, test)
                a = NONE if fails(tests) else self.of(name, yes)
                b = NONE if holds(tests) else self.of(name, no)
                return None if a is None or b is None else a | b
            case Logic(op=op, left=left, right=right):
                first = self.of(name, left)
                if (fails if op == "and" else holds)(first):
                    return first
                second = self.of(name, right)
                if first is None or second is None:
                    if (fails if op == "and" else holds)(second):
                        return second
                    return None
                python = all if op == "and" else any
                both = itertools.product(first, second)
                return frozenset(Const("b", python((a.value, b.value))) for a, b in both)
            case Op():
                return self._operation(name, expr)
            case Invoke(name=called, arguments=arguments):
                function = self.functions[called]
                self.readers.setdefault(called, set()).add(name)
                if called not in self.reached:
                    self.reached.add(called)
                    self.waiting.add(called)
                for parameter, each in zip(function.parameters, arguments, strict=True):
                    self._assign(called, parameter.name, self.of(name, each))
                return self.results[called][0] if expr.kind else None
        for each in getattr(expr, "arguments", ()):
            self.of(name, each)
        if hasattr(expr, "address"):
            self._look_at(name, expr.address)
        return None

    def _operation(self, name: str, expr: Op) -> Values:
        operands = [self.of(name, each) for each in expr.operands]
        if (expr.op == "<" and operands[0] == INFINITE) or (
            expr.op == ">" and operands[1] == INFINITE
        ):
            return frozenset({Const("b", False)})
        if any(each is None for each in operands):
            return None
        rows = [*itertools.product(*(each for each in operands if each is not None))]
        if len(rows) > MOST * MOST:
            return None
        try:
            made = [_OPERATIONS[expr.op](*(each.value for each in row)) for row in rows]
        except (ArithmeticError, ValueError):
            return None
        found = frozenset(Const(expr.kind, _TYPES[expr.kind](each)) for each in made)
        return None if len(found) > MOST else found


def impossible(body: Iterable[Statement]) -> bool:
    """Return whether statements certainly read or write in an empty array: nobody gets there."""
    for each in body:
        match each:
            case Assign(value=value):
                first: tuple[Expr, ...] = (value,)
            case AssignMany(call=call) | Do(call=call):
                first = (call,)
            case Put(address=address, value=value):
                first = (Load("i", address), value)
            case If(test=test) | While(test=test):
                first = (test,)
            case For(start=start, stop=stop):
                first = (start, stop)
            case _:
                return False
        if any(map(_reads_nothing, first)):
            return True
        if isinstance(each, If | While):
            return False  # it may be left there
    return False


def _reads_nothing(expr: Expr) -> bool:
    match expr:
        case Load(address=address):
            inside = (each for each in (address.base, address.index) if each is not None)
            return address.empty or any(map(_reads_nothing, inside))
        case Op(operands=parts) | Invoke(arguments=parts):
            return any(map(_reads_nothing, parts))
        case Logic(left=first) | Choose(test=first):
            return _reads_nothing(first)
    return False


def holds(tests: Values) -> bool:
    """Return whether a test always holds."""
    return tests is not None and len(tests) == 1 and all(each.value for each in tests)


def fails(tests: Values) -> bool:
    """Return whether a test never holds."""
    return tests is not None and not any(each.value for each in tests)


def never(first: Values, last: Values) -> bool:
    """Return whether a loop from the first number to before the last one has no turn."""
    if first is None or last is None or not first or not last:
        return False
    return bool(min(each.value for each in first) >= max(each.value for each in last))
