"""The front end: plain Python functions, specialised for the types of their arguments.

The subset: numbers, arrays of one or two dimensions, named tuples (also new ones), ``for`` over
ranges and arrays, ``while``, ``if``, the usual operators, ``abs``, ``min``, ``max``, ``len``, the
functions of `math`, and calls of other functions of the subset, which may be passed as arguments.
Integers have 64 bits. What a function does to numbers is exactly what Python does, operation by
operation, except that nothing raises: a division by zero gives inf or NaN.

A named tuple is never built in memory. Its fields are known while translating; a function that
takes one is translated once for each kind of it, and receives the few addresses that its fields are
found from.
"""

from __future__ import annotations

import ast
import builtins
import linecache
import math
import operator
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from integrators.machine_code.tree import (
    Address,
    AddressOf,
    Break,
    Callback,
    Choose,
    Const,
    Continue,
    Do,
    Expr,
    For,
    Foreign,
    Function,
    Global,
    If,
    Invoke,
    Load,
    Local,
    Logic,
    Module,
    Op,
    Put,
    Return,
    Set,
    SetMany,
    Statement,
    Table,
    While,
    locals_in,
)
from integrators.machine_code.values import (
    Array,
    Fixed,
    Number,
    Record,
    Value,
    leaves,
    plus,
    substituted,
)

__all__ = ["HostFunction", "TranslationError", "Translator"]

_FOREIGN: Mapping[Any, str] = {
    getattr(math, name): name
    for name in ("exp", "log", "sin", "cos", "tan", "tanh", "sinh", "cosh", "atan", "asinh", "pow")
} | {math.atan2: "atan2", math.asin: "asin", math.acos: "acos"}
_OPERATORS: Mapping[type[ast.AST], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.FloorDiv: "//",
    ast.Mod: "%",
    ast.BitAnd: "&",
    ast.BitOr: "|",
    ast.BitXor: "^",
    ast.LShift: "<<",
    ast.RShift: ">>",
}
_COMPARISONS: Mapping[type[ast.AST], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
_RANK = "bif"  # truth values are integers, integers are floats


class TranslationError(Exception):
    """A line that cannot be translated.

    Parameters
    ----------
    reason : str
        What is not possible.
    place : str
        The file and the line.
    line : str
        The text of the line.
    """

    def __init__(self, reason: str, place: str, line: str) -> None:
        super().__init__(f"{place}: {reason}: {line}")
        self.reason = reason
        self.place = place
        self.line = line


@dataclass(frozen=True)
class HostFunction:
    """A function of the host program, from float to float, called by its number."""

    number: int


class _Wider(Exception):
    """A local must have a wider kind than its first assignment says."""

    def __init__(self, name: str, kind: str) -> None:
        super().__init__(name)
        self.name, self.kind = name, kind


@dataclass(frozen=True)
class _Translated:
    """A specialised function: its name, and the value it returns, in terms of parameters."""

    name: str
    parameters: tuple[Local, ...]
    result: Value | None
    slots: tuple[Local, ...]  # locals in `result` that stand for returned numbers


# --------------------------------------------------------------------------- source texts
@dataclass(frozen=True)
class _File:
    lines: list[str]
    definitions: Mapping[tuple[str, int], ast.FunctionDef]
    codes: Mapping[tuple[str, int], types.CodeType]


_files: dict[tuple[str, int], _File] = {}


def _file(code: types.CodeType, names: dict[str, Any]) -> _File:
    lines = linecache.getlines(code.co_filename, names)
    text = "".join(lines)
    key = code.co_filename, hash(text)
    if key not in _files:
        tree = ast.parse(text)
        definitions = {
            (node.name, (node.decorator_list or [node])[0].lineno): node
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef)
        }
        codes, found = [compile(tree, code.co_filename, "exec", dont_inherit=True)], {}
        while codes:
            each = codes.pop()
            found[each.co_name, each.co_firstlineno] = each
            codes += [part for part in each.co_consts if isinstance(part, types.CodeType)]
        _files[key] = _File(lines, definitions, found)
    return _files[key]


# --------------------------------------------------------------------------- modules
class Translator:
    """Translates functions into one module.

    Examples
    --------
    >>> from integrators.machine_code.values import Number
    >>> from integrators.step_size import retry_factor
    >>> translator = Translator()
    >>> arguments = [Number(Local("f", "error")), Number(Local("i", "order"))]
    >>> translator.translated(retry_factor, arguments).name
    'retry_factor'
    """

    def __init__(self) -> None:
        self.module = Module()
        self._done: dict[Any, _Translated] = {}
        self._kept: list[Any] = []  # objects whose `id` is part of a key
        self._names: dict[str, int] = {}
        self._tables: dict[Any, Array] = {}

    def entry(
        self, name: str, function: Callable[..., Any], arguments: Sequence[Value]
    ) -> Function:
        """Add a function that can be called from outside.

        Parameters
        ----------
        name : str
            Its name outside.
        function : callable
            A Python function of the subset.
        arguments : sequence of Value
            In terms of the parameters of the entry, which are its locals in order of appearance.

        Returns
        -------
        Function
            The entry; it returns what the function returns, which must be one number or nothing.
        """
        done = self.translated(function, arguments)
        parameters: dict[Local, None] = {}
        for argument in arguments:
            for expr in _exprs(argument):
                parameters.update(dict.fromkeys(locals_in(expr)))
        given, _ = _flattened(arguments)
        kind = ""
        if isinstance(done.result, Number):
            kind = done.slots[0].kind if done.slots else done.result.expr.kind
        call = Invoke(kind, done.name, tuple(given))
        body: tuple[Statement, ...] = (Return((call,)),) if kind else (Do(call), Return(()))
        made = Function(name, tuple(parameters), kind, (), body, entry=True)
        self.module.functions.append(made)
        return made

    def translated(self, function: Callable[..., Any], arguments: Sequence[Value]) -> _Translated:
        """Return a function specialised for the types of its arguments."""
        _, shapes = _flattened(arguments)
        key = (id(function), tuple(shapes))
        if key not in self._done:
            self._kept.append((function, arguments))
            self._done[key] = self._specialised(function, arguments)
        return self._done[key]

    def table(self, values: tuple[Any, ...]) -> Array:
        """Return constants as an array in memory; ragged rows are padded with zeros."""
        key = repr(values)
        if key not in self._tables:
            rows = values if values and isinstance(values[0], tuple) else None
            width = max(map(len, rows)) if rows else len(values)
            flat = tuple(
                v for row in rows or (values,) for v in (*row, *[0.0] * (width - len(row)))
            )
            name = f"table{len(self._tables)}"
            self.module.tables.append(Table(name, "f", tuple(map(float, flat))))
            dims = (Const("i", len(rows)), Const("i", width)) if rows else (Const("i", width),)
            self._tables[key] = Array("f", dims, Global(name))
        return self._tables[key]

    def _specialised(self, function: Callable[..., Any], arguments: Sequence[Value]) -> _Translated:
        wide: dict[str, str] = {}
        while True:
            work = _Body(self, function, wide)
            try:
                parameters, result, slots, body = work.run(arguments)
            except _Wider as wider:
                wide[wider.name] = wider.kind
                continue
            break
        name = function.__name__.strip("_")
        count = self._names.get(name, 0)
        self._names[name] = count + 1
        name += f"_{count}" if count else ""
        kinds = "".join(slot.kind for slot in slots)
        made = Function(name, parameters, kinds, tuple(work.variables.values()), body)
        self.module.functions.append(made)
        return _Translated(name, parameters, result, slots)


def _exprs(value: Value) -> Iterable[Expr]:
    """Yield the expressions of a value."""
    for leaf in leaves(value):
        if isinstance(leaf, Number):
            yield leaf.expr
        elif isinstance(leaf, Array):
            yield leaf.base
            if leaf.index is not None:
                yield leaf.index
            yield from (each for each in leaf.dims if each is not None)


def _flattened(arguments: Sequence[Value]) -> tuple[list[Expr], list[Any]]:
    """Return what is passed for some arguments, and their types in hashable form."""
    passed: list[Expr] = []
    names: dict[Local, Expr] = {}
    shapes: list[Any] = []

    def known(expr: Expr) -> Expr:
        """Return an expression in terms of numbered parameters."""
        for each in locals_in(expr):
            if each not in names:
                names[each] = Local(each.kind, f"a{len(passed)}")
                passed.append(each)
        return substituted(expr, names)  # type: ignore[arg-type,no-any-return]

    def shape(value: Value, direct: bool) -> Any:
        match value:
            case Number(expr=expr) if direct and not isinstance(expr, Const):
                passed.append(expr)
                return "number", expr.kind, len(passed)
            case Number(expr=expr):
                return "number", known(expr)
            case Array(kind=kind, dims=dims) if direct:
                passed.append(AddressOf(value.address))
                place = len(passed)
                return "array", kind, place, tuple(d if d is None else known(d) for d in dims)
            case Array(kind=kind, dims=dims, base=base, offset=offset, index=index):
                lengths = tuple(None if d is None else known(d) for d in dims)
                at = None if index is None else known(index)
                return "view", kind, lengths, known(base), offset, at
            case Record(cls=cls, fields=fields):
                parts = tuple((name, shape(part, False)) for name, part in fields.items())
                return "record", id(cls), parts
            case Fixed(value=fixed):
                return "fixed", fixed if isinstance(fixed, int | float | str) else id(fixed)

    for argument in arguments:
        shapes.append(shape(argument, True))
    return passed, shapes


# --------------------------------------------------------------------------- bodies
@dataclass
class _Body:
    """The translation of one function."""

    translator: Translator
    function: Any
    wide: Mapping[str, str]
    variables: dict[str, Local] = field(default_factory=dict)

    def __post_init__(self) -> None:
        code, self.names = self.function.__code__, self.function.__globals__
        source = _file(code, self.names)
        key = code.co_name, code.co_firstlineno
        node, loaded = source.definitions.get(key), source.codes.get(key)
        if node is None or loaded is None or loaded.co_code != code.co_code:
            text = "its text has changed since it was loaded"
            raise TranslationError(text, code.co_filename, code.co_name)
        self.definition, self.source = node, source
        self.node: ast.AST = node
        self.scope: dict[str, Value] = {}
        self.out: list[Statement] = []
        self.result: Value | None = None
        self.slots: tuple[Local, ...] = ()
        self.loops: set[str] = set()  # names of loop variables in use
        self.temporary = 0
        assigned = [
            target.id
            for each in ast.walk(self.definition)
            if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)
            for target in [each]
        ]
        self.assigned = {name: assigned.count(name) for name in assigned}

    def run(
        self, arguments: Sequence[Value]
    ) -> tuple[tuple[Local, ...], Value | None, tuple[Local, ...], tuple[Statement, ...]]:
        """Return parameters, the returned value, its slots, and the statements."""
        names = [each.arg for each in self.definition.args.args]
        if len(names) != len(arguments):
            raise self.error(f"it takes {len(names)} arguments, not {len(arguments)}")
        self._take(names, arguments)
        body = (*self.out, *self.block(self.definition.body))
        if not self.slots and not isinstance(self.result, Number):
            body += (Return(()),) if not body or not isinstance(body[-1], Return) else ()
        return tuple(self.parameters), self.result, self.slots, body

    def _take(self, names: Sequence[str], arguments: Sequence[Value]) -> None:
        """Bind the parameters; in the same order as `_flattened` passes them."""
        parameters: list[Local] = []
        self.parameters = parameters
        known: dict[Local, Expr] = {}

        def own(expr: Expr, name: str) -> Expr:
            for each in locals_in(expr):
                if each not in known:
                    known[each] = local = Local(each.kind, f"{name}.{len(parameters)}")
                    parameters.append(local)
            return substituted(expr, known)  # type: ignore[arg-type,no-any-return]

        def bound(value: Value, name: str, direct: bool) -> Value:
            match value:
                case Number(expr=expr) if direct and not isinstance(expr, Const):
                    local = Local(expr.kind, f"{name}.{len(parameters)}")
                    parameters.append(local)
                    return Number(local)
                case Array(kind=kind, dims=dims) if direct:
                    local = Local("p", f"{name}.{len(parameters)}")
                    parameters.append(local)
                    lengths = tuple(None if d is None else own(d, name) for d in dims)
                    return Array(kind, lengths, local)
                case Number(expr=expr):
                    return Number(own(expr, name))
                case Array(kind=kind, dims=dims, base=base, offset=offset, index=index):
                    lengths = tuple(None if d is None else own(d, name) for d in dims)
                    at = None if index is None else own(index, name)
                    return Array(kind, lengths, own(base, name), offset, at)
                case Record(cls=cls, fields=fields):
                    return Record(cls, {k: bound(v, k, False) for k, v in fields.items()})
            return value

        for name, argument in zip(names, arguments, strict=True):
            value = bound(argument, name, True)
            if name in self.assigned:
                self.assigned[name] += 1
                self.bind(name, value)
            else:
                self.scope[name] = value

    # ------------------------------------------------------------------ errors, names
    def error(self, reason: str) -> TranslationError:
        """Return an error at the present line."""
        number = getattr(self.node, "lineno", self.definition.lineno)
        place = f"{self.function.__code__.co_filename}, line {number}, in {self.function.__name__}"
        return TranslationError(reason, place, self.source.lines[number - 1].strip())

    def variable(self, name: str, kind: str) -> Local:
        """Return the local of a name."""
        kind = self.wide.get(name, kind)
        local = self.variables.setdefault(name, Local(kind, name))
        if local.kind != kind:
            if "p" in (local.kind, kind):
                raise self.error(f"{name} is an array and a number")
            if _RANK.index(kind) > _RANK.index(local.kind):
                raise _Wider(name, kind)
        return local

    def kept(self, expr: Expr) -> Expr:
        """Return an expression that keeps its present value."""
        if isinstance(expr, Const | Global) or (
            isinstance(expr, Local) and expr in self.parameters
        ):
            return expr
        self.temporary += 1
        local = self.variable(f"u.{self.temporary}", expr.kind)
        self.out.append(Set(local, expr))
        return local

    def constant(self, expr: Expr) -> bool:
        """Return whether an expression reads nothing but parameters."""
        return all(each in self.parameters for each in locals_in(expr))

    # ------------------------------------------------------------------ statements
    def block(self, nodes: Sequence[ast.stmt]) -> tuple[Statement, ...]:
        """Translate statements."""
        before, self.out = self.out, []
        for node in nodes:
            self.node = node
            self.statement(node)
        made, self.out = tuple(self.out), before
        return made

    def statement(self, node: ast.stmt) -> None:
        """Translate a statement."""
        match node:
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                pass
            case ast.Expr(value=ast.Call() as call):
                made = self.call(call)
                if isinstance(made, Number) and not isinstance(made.expr, Local | Const):
                    self.out.append(Do(made.expr))
            case ast.Assign(targets=[target], value=value):
                self.assign(target, value)
            case ast.Assign(targets=targets, value=value):
                common = Number(self.kept(self.number(value)))
                for target in targets:
                    self.store(target, common)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self.assign(target, value)
            case ast.AugAssign(target=target, op=op, value=value):
                self.augment(target, op, value)
            case ast.If(test=test, body=body, orelse=orelse):
                condition = self.condition(test)
                if isinstance(condition, Const):
                    self.out += self.block(body if condition.value else orelse)
                else:
                    self.out.append(If(condition, self.block(body), self.block(orelse)))
            case ast.While(test=test, body=body, orelse=[]):
                before, self.out = self.out, []
                condition = self.condition(test)
                first, self.out = self.out, before
                if first:  # statements that come before the condition, each time
                    leave = If(_negated(condition), (Break(),), ())
                    inside = (*first, leave, *self.block(body))
                    self.out.append(While(Const("b", True), inside))
                else:
                    self.out.append(While(condition, self.block(body)))
            case ast.For(target=ast.Name(id=name), iter=over, body=body, orelse=[]):
                self.loop(name, over, body)
            case ast.Break():
                self.out.append(Break())
            case ast.Continue():
                self.out.append(Continue())
            case ast.Return(value=value):
                self.give(value)
            case _:
                raise self.error("this statement is not part of the subset")

    def loop(self, name: str, over: ast.expr, body: list[ast.stmt]) -> None:
        """Translate a for loop."""
        if any(
            isinstance(each, ast.Name) and each.id == name and isinstance(each.ctx, ast.Store)
            for part in body
            for each in ast.walk(part)
        ):
            raise self.error(f"the loop changes its own variable {name}")
        if isinstance(over, ast.Call) and self.value(over.func) == Fixed(range):
            limits = [self.integer(each) for each in over.args]
            start, stop = (Const("i", 0), limits[0]) if len(limits) == 1 else limits[:2]
            step = limits[2] if len(limits) == 3 else Const("i", 1)
            if not isinstance(step, Const) or step.value <= 0:
                raise self.error("the step of a range must be a positive constant")
            target = self.variable(name, "i")
            self.scope[name] = Number(target)
            stop = stop if self.constant(stop) else self.kept(stop)
            made = self.block(body)
            self.out.append(For(target, start, stop, step.value, made))
            return
        array = self.value(over)
        if isinstance(array, Record):  # a few values: the body once for each
            if any(isinstance(n, ast.Break | ast.Continue) for u in body for n in ast.walk(u)):
                raise self.error("a loop over a tuple cannot be left")
            for part in array.fields.values():
                self.bind(name, part)
                self.out += self.block(body)
            return
        if not isinstance(array, Array) or len(array.dims) != 1 or array.dims[0] is None:
            raise self.error("a loop goes over a range or over an array of numbers")
        self.temporary += 1
        place = self.variable(f"u.{self.temporary}", "i")
        entry = array.at(place)
        assert isinstance(entry, Number)
        target = self.variable(name, entry.expr.kind)
        self.scope[name] = Number(target)
        length = array.dims[0]
        length = length if self.constant(length) else self.kept(length)
        made = (Set(target, entry.expr), *self.block(body))
        self.out.append(For(place, Const("i", 0), length, 1, made))

    def assign(self, target: ast.expr, value: ast.expr) -> None:
        """Translate an assignment."""
        if isinstance(target, ast.Tuple):
            if isinstance(value, ast.Tuple):
                parts = self.in_order(value.elts)
                if any(isinstance(each, ast.Subscript) for each in target.elts) or len(
                    {n.id for n in ast.walk(value) if isinstance(n, ast.Name)}
                    & {each.id for each in target.elts if isinstance(each, ast.Name)}
                ):
                    parts = [
                        Number(self.kept(each.expr)) if isinstance(each, Number) else each
                        for each in parts
                    ]
            else:
                whole = self.value(value)
                if not isinstance(whole, Record):
                    raise self.error("only tuples can be unpacked")
                parts = list(whole.fields.values())
            if len(parts) != len(target.elts):
                raise self.error("the numbers of names and values differ")
            for each, part in zip(target.elts, parts, strict=True):
                self.store(each, part)
        else:
            self.store(target, self.value(value))

    def augment(self, target: ast.expr, op: ast.operator, value: ast.expr) -> None:
        """Translate an assignment such as ``+=``."""
        if isinstance(target, ast.Name):
            place: ast.expr = ast.Name(target.id, ast.Load())
            now = self.number(place)
            self.store(target, Number(self.operation(op, now, self.number(value))))
            return
        assert isinstance(target, ast.Subscript)
        entry = self.subscript(target)
        if not isinstance(entry, Number) or not isinstance(entry.expr, Load):
            raise self.error("only entries of arrays can be changed")
        more = self.number(value)
        address = entry.expr.address
        if _contains(more, Invoke):
            raise self.error("call the function first")
        self.out.append(
            Put(entry.expr.kind, address, self.as_kind(self.operation(op, entry.expr, more),
                entry.expr.kind))
        )  # fmt: skip

    def store(self, target: ast.expr, value: Value) -> None:
        """Assign a value to a name or to an entry of an array."""
        if isinstance(target, ast.Name):
            self.bind(target.id, value)
            return
        if not isinstance(target, ast.Subscript) or not isinstance(value, Number):
            raise self.error("only names and entries of arrays can be assigned")
        expr = value.expr
        if _contains(expr, Invoke):
            expr = self.kept(expr)
        entry = self.subscript(target)
        if not isinstance(entry, Number) or not isinstance(entry.expr, Load):
            raise self.error("only entries of arrays can be assigned")
        kind = entry.expr.kind
        self.out.append(Put(kind, entry.expr.address, self.as_kind(expr, kind)))

    def bind(self, name: str, value: Value) -> None:
        """Assign a value to a name."""
        match value:
            case Number(expr=Const() as expr) if self.assigned.get(name, 0) == 1:
                self.scope[name] = value
                return
            case Number(expr=expr):
                local = self.variable(name, expr.kind)
                self.out.append(Set(local, self.as_kind(expr, local.kind)))
                self.scope[name] = Number(local)
                return
            case Array() if self.assigned.get(name, 0) == 1 and self._still(value):
                bound: Value = value
            case Array(kind=kind, dims=dims):
                local = self.variable(name, "p")
                self.out.append(Set(local, AddressOf(value.address)))
                lengths = [self._set_dim(f"{name}.{k}", each) for k, each in enumerate(dims)]
                before = self.scope.get(name)
                if isinstance(before, Array) and len(before.dims) == len(lengths):
                    lengths = [
                        a if a == b else None
                        for a, b in zip(lengths, before.dims, strict=True)
                    ]  # fmt: skip
                self.scope[name] = Array(kind, tuple(lengths), local)
                return
            case Record():
                bound = self._set_record(name, value)
                if name in self.scope and self.scope[name] != bound:
                    raise self.error(f"{name} has become another kind of tuple")
            case Fixed():
                bound = value
                if name in self.scope and self.scope[name] != bound:
                    raise self.error(f"{name} has become another object")
        self.scope[name] = bound

    def _still(self, array: Array) -> bool:
        """Return whether a view stays the same as long as the function runs."""
        parts = [array.base, *(each for each in array.dims if each is not None)]
        return all(map(self.constant, parts if array.index is None else [*parts, array.index]))

    def _set_dim(self, name: str, length: Expr | None) -> Expr | None:
        if length is None or self.constant(length):
            return length
        local = self.variable(name, "i")
        self.out.append(Set(local, length))
        return local

    def _set_record(self, name: str, value: Value) -> Value:
        """Keep what changes in a tuple under names of its own."""
        match value:
            case Record(cls=cls, fields=fields):
                parts = {k: self._set_record(f"{name}.{k}", v) for k, v in fields.items()}
                return Record(cls, parts)
            case Number(expr=expr) if not self.constant(expr):
                local = self.variable(name, expr.kind)
                self.out.append(Set(local, self.as_kind(expr, local.kind)))
                return Number(local)
            case Array(kind=kind, dims=dims) if not self._still(value):
                lengths = tuple(self._set_dim(f"{name}.{k}", d) for k, d in enumerate(dims))
                if value.index is None and self.constant(value.base):
                    return Array(kind, lengths, value.base, value.offset)
                local = self.variable(name, "p")
                self.out.append(Set(local, AddressOf(value.address)))
                return Array(kind, lengths, local)
        return value

    def give(self, node: ast.expr | None) -> None:
        """Translate a return."""
        value: Value | None = None if node is None else self.value(node)
        if value is None:
            self.out.append(Return(()))
            return
        passed: list[Expr] = []

        def template(part: Value) -> Value:
            match part:
                case Number(expr=expr):
                    passed.append(expr)
                    return Number(Local(expr.kind, f"r.{len(passed) - 1}"))
                case Record(cls=cls, fields=fields):
                    return Record(cls, {k: template(v) for k, v in fields.items()})
                case Array(dims=dims):
                    changing = [d for d in dims if d is not None and not self.constant(d)]
                    slots = {}
                    for each in changing:
                        passed.append(each)
                        slots[each] = Local("i", f"r.{len(passed) - 1}")
                    if not self.constant(part.base) or part.index is not None:
                        raise self.error("this array cannot be returned")
                    lengths = tuple(None if d is None else slots.get(d, d) for d in dims)
                    return Array(part.kind, lengths, part.base, part.offset)
            return part

        made = template(value)
        if self.result is None:
            self.result = made
            self.slots = tuple(Local(each.kind, f"r.{k}") for k, each in enumerate(passed))
        else:
            if len(passed) != len(self.slots):
                raise self.error("the returned values differ in kind")
            kinds = [slot.kind for slot in self.slots]
            passed = [self.as_kind(e, k) for e, k in zip(passed, kinds, strict=True)]
        self.out.append(Return(tuple(passed)))

    # ------------------------------------------------------------------ values
    def in_order(self, nodes: Sequence[ast.expr]) -> list[Value]:
        """Translate operands; what is read from memory stays on its side of a call."""
        made: list[Value] = []
        for k, node in enumerate(nodes):
            value = self.value(node)
            if isinstance(value, Number) and _contains(value.expr, Invoke):
                touched = [
                    isinstance(each, Number) and _contains(each.expr, Load | Invoke)
                    for each in made
                ]
                made = [
                    Number(self.kept(each.expr)) if old and isinstance(each, Number) else each
                    for each, old in zip(made, touched, strict=True)
                ]
                if any(touched) or any(not isinstance(u, ast.Constant) for u in nodes[k + 1 :]):
                    value = Number(self.kept(value.expr))
            made.append(value)
        return made

    def number(self, node: ast.expr) -> Expr:
        """Translate an expression that is a number."""
        value = self.value(node)
        if not isinstance(value, Number):
            raise self.error(f"{ast.unparse(node)} is not a number")
        return value.expr

    def integer(self, node: ast.expr) -> Expr:
        """Translate an expression that is an integer."""
        expr = self.number(node)
        if expr.kind == "f":
            raise self.error(f"{ast.unparse(node)} is not an integer")
        return self.as_kind(expr, "i")

    def numbers(self, nodes: Sequence[ast.expr]) -> list[Expr]:
        """Translate several numbers, in order."""
        made = self.in_order(nodes)
        for node, each in zip(nodes, made, strict=True):
            if not isinstance(each, Number):
                raise self.error(f"{ast.unparse(node)} is not a number")
        return [each.expr for each in made if isinstance(each, Number)]

    def value(self, node: ast.expr) -> Value:
        """Translate an expression."""
        match node:
            case ast.Constant(value=bool() | int() | float() as given):
                return Number(_constant(given))
            case ast.Name(id=name):
                return self.named(name)
            case ast.Attribute(value=whole, attr=name):
                return self.attribute(self.value(whole), name)
            case ast.Subscript():
                return self.subscript(node)
            case ast.Call():
                made = self.call(node)
                if made is None:
                    raise self.error("the function returns nothing")
                return made
            case ast.BinOp(left=left, op=op, right=right):
                a, b = self.numbers([left, right])
                return Number(self.operation(op, a, b))
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return Number(_negated(self.condition(operand)))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                expr = self.number(operand)
                if isinstance(expr, Const):
                    return Number(Const(expr.kind, -expr.value))
                return Number(Op(expr.kind, "neg", (expr,)))
            case ast.Compare(left=left, ops=ops, comparators=others):
                return Number(self.comparison(left, ops, others))
            case ast.BoolOp():
                return Number(self.condition(node))
            case ast.IfExp(test=test, body=yes, orelse=no):
                return self.choice(test, yes, no)
            case ast.Tuple(elts=parts):
                values = self.in_order(parts)
                return Record(tuple, {str(k): each for k, each in enumerate(values)})
        raise self.error("this expression is not part of the subset")

    def named(self, name: str) -> Value:
        """Return what a name stands for."""
        if name in self.scope:
            return self.scope[name]
        if name in self.assigned:
            raise self.error(f"{name} is read before it is assigned")
        if name in self.names:
            return self.fixed(self.names[name])
        if hasattr(builtins, name):
            return Fixed(getattr(builtins, name))
        raise self.error(f"{name} is not defined")

    def fixed(self, given: Any) -> Value:
        """Return a Python object as a value."""
        if isinstance(given, bool | int | float):
            return Number(_constant(given))
        if isinstance(given, tuple) and not hasattr(given, "_fields"):
            return self.translator.table(given)
        return Fixed(given)

    def attribute(self, whole: Value, name: str) -> Value:
        """Return a field of a tuple, or a member of a module."""
        if isinstance(whole, Record) and name in whole.fields:
            part = whole.fields[name]
            return self.fixed(part.value) if isinstance(part, Fixed) else part
        if isinstance(whole, Fixed) and isinstance(whole.value, types.ModuleType):
            return self.fixed(getattr(whole.value, name))
        raise self.error(f"there is no {name}")

    def subscript(self, node: ast.Subscript) -> Value:
        """Return an entry, a row, or the first entries of an array."""
        whole = self.value(node.value)
        if isinstance(whole, Record) and isinstance(node.slice, ast.Constant):
            return whole.fields[str(node.slice.value)]
        if not isinstance(whole, Array):
            raise self.error(f"{ast.unparse(node.value)} is not an array")
        if isinstance(node.slice, ast.Slice):
            if node.slice.lower or node.slice.step or node.slice.upper is None:
                raise self.error("only the first entries of an array can be taken")
            count = self.kept(self.integer(node.slice.upper))
            return Array(
                whole.kind, (count, *whole.dims[1:]), whole.base, whole.offset, whole.index
            )
        place = self.integer(node.slice)
        if isinstance(place, Const) and place.value < 0:
            if whole.dims[0] is None:
                raise self.error("the length of this array is not known")
            place = plus(whole.dims[0], place)
        try:
            return whole.at(place)
        except ValueError as error:
            raise self.error(str(error)) from None

    # ------------------------------------------------------------------ operations
    def as_kind(self, expr: Expr, kind: str) -> Expr:
        """Convert a number to a kind that is at least as wide."""
        if expr.kind == kind:
            return expr
        if "p" in (expr.kind, kind) or _RANK.index(kind) < _RANK.index(expr.kind):
            raise self.error(f"a number of kind {expr.kind} does not fit into {kind}")
        if isinstance(expr, Const):
            return Const(kind, float(expr.value) if kind == "f" else int(expr.value))
        return Op(kind, "float" if kind == "f" else "int", (expr,))

    def common(self, *parts: Expr) -> list[Expr]:
        """Convert numbers to their widest kind."""
        kind = max((part.kind for part in parts), key=_RANK.index)
        return [self.as_kind(part, kind) for part in parts]

    def operation(self, op: ast.operator, a: Expr, b: Expr) -> Expr:
        """Return the result of an operator."""
        if isinstance(op, ast.Pow):
            if isinstance(a, Const) and isinstance(b, Const):
                return _constant(a.value**b.value)
            return Foreign("pow", (self.as_kind(a, "f"), self.as_kind(b, "f")))
        if type(op) not in _OPERATORS:
            raise self.error("this operator is not part of the subset")
        sign = _OPERATORS[type(op)]
        if sign == "/":
            a, b = self.as_kind(a, "f"), self.as_kind(b, "f")
        a, b = self.common(a, b)
        if a.kind == "b":
            a, b = self.as_kind(a, "i"), self.as_kind(b, "i")
        if a.kind == "f" and sign not in "+-*/":
            raise self.error(f"{sign} is for integers only")
        if isinstance(a, Const) and isinstance(b, Const) and not (sign == "/" and b.value == 0):
            return _constant(_folded(sign, a.value, b.value))
        return Op(a.kind, sign, (a, b))

    def comparison(
        self, left: ast.expr, ops: Sequence[ast.cmpop], others: Sequence[ast.expr]
    ) -> Expr:
        """Return a comparison, which may be a chain."""
        if isinstance(ops[0], ast.In | ast.NotIn) and isinstance(others[0], ast.Tuple):
            whole = self.number(left)
            found: Expr = Const("b", False)
            for each in others[0].elts:
                a, b = self.common(whole, self.number(each))
                found = _or(found, Op("b", "==", (a, b)))
            return _negated(found) if isinstance(ops[0], ast.NotIn) else found
        parts = self.numbers([left, *others])
        result: Expr = Const("b", True)
        for a, op, b in zip(parts, ops, parts[1:], strict=False):
            if type(op) not in _COMPARISONS:
                raise self.error("this comparison is not part of the subset")
            a, b = self.common(a, b)
            sign = _COMPARISONS[type(op)]
            if isinstance(a, Const) and isinstance(b, Const):
                one: Expr = Const("b", _folded(sign, a.value, b.value))
            else:
                one = Op("b", sign, (a, b))
            result = _and(result, one)
        return result

    def condition(self, node: ast.expr) -> Expr:
        """Translate an expression as a truth value."""
        if isinstance(node, ast.BoolOp):
            join = _and if isinstance(node.op, ast.And) else _or
            made: Expr | None = None
            for each in node.values:
                before = len(self.out)
                part = self.condition(each)
                if made is not None and len(self.out) != before:
                    raise self.error("after and and or only plain expressions are possible")
                made = part if made is None else join(made, part)
            assert made is not None
            return made
        expr = self.number(node)
        if expr.kind == "b":
            return expr
        if isinstance(expr, Const):
            return Const("b", bool(expr.value))
        return Op("b", "!=", (expr, Const(expr.kind, 0 if expr.kind == "i" else 0.0)))

    def choice(self, test: ast.expr, yes: ast.expr, no: ast.expr) -> Value:
        """Translate a conditional expression."""
        condition = self.condition(test)
        if isinstance(condition, Const):
            return self.value(yes if condition.value else no)
        before = len(self.out)
        a, b = self.value(yes), self.value(no)
        if len(self.out) != before:
            raise self.error("the alternatives must be plain expressions")
        if isinstance(a, Number) and isinstance(b, Number):
            u, v = self.common(a.expr, b.expr)
            return Number(Choose(u.kind, condition, u, v))
        if isinstance(a, Array) and isinstance(b, Array) and a.kind == b.kind:
            dims = tuple(u if u == v else None for u, v in zip(a.dims, b.dims, strict=True))
            place = Choose("p", condition, AddressOf(a.address), AddressOf(b.address))
            return Array(a.kind, dims, self.kept(place))
        raise self.error("the alternatives differ in kind")

    # ------------------------------------------------------------------ calls
    def call(self, node: ast.Call) -> Value | None:
        """Translate a call."""
        called = self.value(node.func)
        if not isinstance(called, Fixed):
            raise self.error(f"{ast.unparse(node.func)} is not a function")
        function = called.value
        if isinstance(function, type) and hasattr(function, "_fields"):
            return self.record(function, node)
        if node.keywords:
            raise self.error("arguments are given by place")
        if function is float and isinstance(node.args[0], ast.Constant):
            return Number(Const("f", float(node.args[0].value)))  # type: ignore[arg-type]
        arguments = self.in_order(node.args)
        if isinstance(function, types.FunctionType):
            return self.own_call(function, arguments)
        if function is len:
            return self.length(arguments[0])
        parts = [each.expr for each in arguments if isinstance(each, Number)]
        if len(parts) != len(arguments):
            raise self.error("the function takes numbers")
        return Number(self.known_call(function, parts))

    def known_call(self, function: Any, parts: list[Expr]) -> Expr:
        """Return a call of a built-in function."""
        if isinstance(function, HostFunction):
            self.translator.module.callbacks = max(
                self.translator.module.callbacks, function.number + 1
            )
            return Callback(function.number, tuple(self.as_kind(each, "f") for each in parts))
        if function in (min, max):
            parts = self.common(*parts)
            made = parts[0]
            for each in parts[1:]:
                made = Op(made.kind, function.__name__, (made, each))
            return made
        if function is abs:
            return Op(parts[0].kind, "abs", (parts[0],))
        if function is math.sqrt:
            return Op("f", "sqrt", (self.as_kind(parts[0], "f"),))
        if function is float:
            return self.as_kind(parts[0], "f")
        if function is int:
            return parts[0] if parts[0].kind == "i" else Op("i", "int", (parts[0],))
        if function in _FOREIGN:
            given = tuple(self.as_kind(each, "f") for each in parts)
            return Foreign(_FOREIGN[function], given)
        raise self.error(f"{getattr(function, '__name__', function)} is not part of the subset")

    def length(self, whole: Value) -> Value:
        """Return the length of an array or a tuple."""
        if isinstance(whole, Record):
            return Number(Const("i", len(whole.fields)))
        if not isinstance(whole, Array) or whole.dims[0] is None:
            raise self.error("the length is not known")
        return Number(whole.dims[0])

    def record(self, cls: Any, node: ast.Call) -> Value:
        """Return a new tuple; its numbers keep their present values."""
        names = [*cls._fields[: len(node.args)], *(each.arg for each in node.keywords)]
        nodes = [*node.args, *(each.value for each in node.keywords)]
        fields: dict[str, Value] = {}
        for name, part in zip(names, nodes, strict=True):
            value = self.value(part)
            if isinstance(value, Number) and not isinstance(part, ast.Attribute):
                value = Number(self.kept(value.expr))
            fields[str(name)] = value
        return Record(cls, {name: fields[name] for name in cls._fields})

    def own_call(self, function: Callable[..., Any], arguments: list[Value]) -> Value | None:
        """Return a call of another function of the subset."""
        done = self.translator.translated(function, arguments)
        if isinstance(done.result, Record):  # it may contain what is passed
            arguments = [
                Number(self.kept(each.expr)) if isinstance(each, Number) else each
                for each in arguments
            ]
        passed, _ = _flattened(arguments)
        result, slots = done.result, done.slots
        if result is None:
            self.out.append(Do(Invoke("", done.name, tuple(passed))))
            return None
        if isinstance(result, Number):
            return Number(Invoke(slots[0].kind, done.name, tuple(passed)))
        given: dict[Local, Expr] = {}
        for parameter, each in zip(done.parameters, passed, strict=True):
            given[parameter] = each
        targets = []
        for slot in slots:
            self.temporary += 1
            targets.append(self.variable(f"u.{self.temporary}", slot.kind))
            given[slot] = targets[-1]
        call = Invoke(slots[0].kind if len(slots) == 1 else "", done.name, tuple(passed))
        if not slots:
            self.out.append(Do(call))
        elif len(slots) == 1:
            self.out.append(Set(targets[0], call))
        else:
            self.out.append(SetMany(tuple(targets), call))
        return substituted(result, given)  # type: ignore[no-any-return]


# --------------------------------------------------------------------------- expressions
def _constant(value: Any) -> Const:
    """Return a Python number as a constant."""
    if isinstance(value, bool):
        return Const("b", value)
    return Const("f" if isinstance(value, float) else "i", value)


def _folded(sign: str, a: Any, b: Any) -> Any:
    """Compute with constants, as Python does."""
    return {
        "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
        "//": operator.floordiv, "%": operator.mod, "&": operator.and_, "|": operator.or_,
        "^": operator.xor, "<<": operator.lshift, ">>": operator.rshift, "<": operator.lt,
        "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq,
        "!=": operator.ne,
    }[sign](a, b)  # fmt: skip


def _negated(expr: Expr) -> Expr:
    if isinstance(expr, Const):
        return Const("b", not expr.value)
    return Op("b", "not", (expr,))


def _and(a: Expr, b: Expr) -> Expr:
    if isinstance(a, Const):
        return b if a.value else a
    return Logic("and", a, b) if not (isinstance(b, Const) and b.value) else a


def _or(a: Expr, b: Expr) -> Expr:
    if isinstance(a, Const):
        return a if a.value else b
    return Logic("or", a, b) if not (isinstance(b, Const) and not b.value) else a


def _contains(expr: Expr, kind: Any) -> bool:
    return any(isinstance(each, kind) for each in _walk(expr))


def _walk(expr: Expr) -> Iterable[Expr]:
    """Yield an expression and all its parts."""
    yield expr
    match expr:
        case Op(operands=parts) | Invoke(arguments=parts):
            for part in parts:
                yield from _walk(part)
        case Foreign(arguments=parts) | Callback(arguments=parts):
            for part in parts:
                yield from _walk(part)
        case Logic(left=left, right=right):
            yield from _walk(left)
            yield from _walk(right)
        case Choose(test=test, yes=yes, no=no):
            for part in (test, yes, no):
                yield from _walk(part)
        case Load(address=Address(base=base, index=index)):
            yield from _walk(base)
            if index is not None:
                yield from _walk(index)
        case AddressOf(address=Address(base=base, index=index)):
            yield from _walk(base)
            if index is not None:
                yield from _walk(index)

