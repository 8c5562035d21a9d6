"""A module without what cannot happen at one start: for texts that people read.

Branches that are never taken, constants under other names, functions, parameters and numbers that
nothing reads are left out. What remains computes the same bits.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from typing import Any

from integrators.machine_code.readable.possible import (
    INFINITE,
    BlockStart,
    Possible,
    fails,
    holds,
    impossible,
    never,
)
from integrators.machine_code.tree import (
    Address,
    AddressOf,
    Assign,
    AssignMany,
    Break,
    Callback,
    Choose,
    Const,
    Continue,
    Do,
    Expr,
    For,
    Foreign,
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
    Statement,
    TypedFunction,
    While,
    expressions_in,
    expressions_of,
    locals_in,
    parts_of,
    statements_of,
)

__all__ = ["simplified"]

Body = tuple[Statement, ...]
SMALL = 12  # parts of an expression that may stand inside another one


def simplified(
    module: Module,
    start: BlockStart,
    given: Collection[int],
    read: Collection[int],
) -> Module:
    """Return a module without what cannot happen.

    Examples
    --------
    >>> from integrators.machine_code.front_end.translate import Translator
    >>> from integrators.machine_code.front_end.values import NumberValue
    >>> from integrators.step_size import memory_of
    >>> translator = Translator()
    >>> _ = translator.entry("entry", memory_of, [NumberValue(Const("f", 4.0))])
    >>> [each.name for each in simplified(translator.module, BlockStart({}, {}), (), ()).functions]
    ['entry']
    """
    while True:
        possible = Possible(module, start, given)
        functions = [each for each in module.functions if each.name in possible.reached]
        functions = [_Certain(possible, each).rewritten() for each in functions]
        functions = _without_idle_calls(functions)
        functions = _without_unread_words(functions, {*start.numbers}, read)
        functions = [_forwarded(each) for each in functions]
        functions = _without_unread_parameters(functions)
        made = replace(module, functions=functions)
        if made == module:
            used = {
                each.name
                for f in functions
                for each in expressions_in(f.body)
                if isinstance(each, Global)
            }
            return replace(module, tables=[each for each in module.tables if each.name in used])
        module = made


# --------------------------------------------------------------------------- walking
def changed(expr: Expr, change: Callable[[Expr], Expr]) -> Expr:
    """Return an expression whose parts have been changed, and then itself."""

    def inside(address: Address) -> Address:
        index = None if address.index is None else changed(address.index, change)
        return replace(address, base=changed(address.base, change), index=index)

    match expr:
        case Op(operands=parts):
            made: Expr = replace(expr, operands=tuple(changed(each, change) for each in parts))
        case Invoke(arguments=parts) | Foreign(arguments=parts) | Callback(arguments=parts):
            made = replace(expr, arguments=tuple(changed(each, change) for each in parts))
        case Logic(left=left, right=right):
            made = replace(expr, left=changed(left, change), right=changed(right, change))
        case Choose(test=test, yes=yes, no=no):
            a, b, c = (changed(each, change) for each in (test, yes, no))
            made = replace(expr, test=a, yes=b, no=c)
        case Load(address=address) | AddressOf(address=address):
            made = replace(expr, address=inside(address))
        case _:
            made = expr
    return change(made)


def with_expressions(statement: Statement, change: Callable[[Expr], Expr]) -> Statement:
    """Return a statement with changed expressions; its blocks stay."""

    def new(expr: Expr) -> Any:
        return changed(expr, change)

    match statement:
        case Assign(value=value):
            return replace(statement, value=new(value))
        case AssignMany(call=call) | Do(call=call):
            return replace(statement, call=new(call))
        case Put(address=address, value=value):
            return replace(statement, address=new(AddressOf(address)).address, value=new(value))
        case If(test=test) | While(test=test):
            return replace(statement, test=new(test))
        case For(start=start, stop=stop):
            return replace(statement, start=new(start), stop=new(stop))
        case Return(values=values):
            return replace(statement, values=tuple(map(new, values)))
    return statement


def rebuilt(body: Body, change: Callable[[Statement], Iterable[Statement]]) -> Body:
    """Return statements, each changed after those inside it."""
    made: list[Statement] = []
    for each in body:
        if isinstance(each, If):
            each = replace(
                each, body=rebuilt(each.body, change), orelse=rebuilt(each.orelse, change)
            )
        elif isinstance(each, While | For):
            each = replace(each, body=rebuilt(each.body, change))
        made += change(each)
    return tuple(made)


# --------------------------------------------------------------------------- constants, branches
class _Certain:
    """Rewrites one function with what is certain."""

    def __init__(self, possible: Possible, function: TypedFunction) -> None:
        self.possible, self.function = possible, function

    def rewritten(self) -> TypedFunction:
        """Return the function without branches that are never taken."""
        return replace(self.function, body=_reachable(rebuilt(self.function.body, self._statement)))

    def _statement(self, statement: Statement) -> Iterable[Statement]:
        name, of = self.function.name, self.possible.of
        match statement:
            case If(test=test, body=body, orelse=orelse):
                tests = of(name, test)
                if (holds(tests) or impossible(orelse)) and _pure(test):
                    return body
                if (fails(tests) or impossible(body)) and _pure(test):
                    return orelse
                if not body and not orelse and _pure(test):
                    return ()
                if not body:
                    statement = If(Op("b", "not", (test,)), orelse, ())
            case While(test=test) if fails(of(name, test)) and _pure(test):
                return ()
            case For(start=start, stop=stop, body=body):
                if (never(of(name, start), of(name, stop)) or not body) and _pure(start, stop):
                    return ()
        return (with_expressions(statement, self._expression),)

    def _expression(self, expr: Expr) -> Expr:
        """Return a constant, or a shorter expression with the same bits."""
        name, of = self.function.name, self.possible.of
        match expr:
            case Choose(test=test, yes=yes, no=no) if _pure(test):
                tests = of(name, test)
                if holds(tests) or fails(tests):
                    return yes if holds(tests) else no
            case Logic(op=op, left=left, right=right) if _pure(left):
                first = of(name, left)
                if holds(first) or fails(first):
                    return right if holds(first) == (op == "and") else Const("b", op == "or")
            case Op(op="|", operands=(Const(name=one), Const(name=other))) if one and other:
                return expr
            case Op(op="-", operands=(Const(), Const(name=name))) if name:
                return expr
        if isinstance(expr, Const | Global | AddressOf) or not _pure(expr):
            return expr
        values = of(name, expr)
        if values is not None and len(values) == 1:
            return next(iter(values))
        match expr:
            case Logic(op=op, left=left, right=right):
                return left if (holds if op == "and" else fails)(of(name, right)) else expr
            case Op(op="min", operands=(a, b)) if of(name, b) == INFINITE:
                return a
            case Op(op="*", operands=(a, Const(value=1.0)) | (Const(value=1.0), a)):
                return a
            case Op(op="not", operands=(Op(op="not", operands=(a,)),)):
                return a
        return expr


def _reachable(body: Body) -> Body:
    """Leave out what stands after a statement that never goes on."""
    made: list[Statement] = []
    for each in body:
        if isinstance(each, If):
            each = replace(each, body=_reachable(each.body), orelse=_reachable(each.orelse))
        elif isinstance(each, While | For):
            each = replace(each, body=_reachable(each.body))
        made.append(each)
        if _leaves(each):
            break
    return tuple(made)


def _leaves(statement: Statement) -> bool:
    match statement:
        case Return() | Break() | Continue():
            return True
        case If(body=body, orelse=orelse):
            return bool(body and orelse) and _leaves(body[-1]) and _leaves(orelse[-1])
    return False


def _pure(*expressions: Expr) -> bool:
    """Return whether nothing is called that is given memory, or that the host has."""
    return not any(
        isinstance(part, Callback)
        or (isinstance(part, Invoke) and any(each.kind == "p" for each in part.arguments))
        for expr in expressions
        for part in parts_of(expr)
    )


# --------------------------------------------------------------------------- what has no effect
def _without_idle_calls(functions: list[TypedFunction]) -> list[TypedFunction]:
    """Leave out calls of functions that change nothing and return nothing."""
    acting = {f.name for f in functions if f.entry or _acts(f.body)}
    while more := {
        f.name
        for f in functions
        if f.name not in acting
        and any(isinstance(each, Invoke) and each.name in acting for each in expressions_in(f.body))
    }:
        acting |= more

    def idle(expr: Expr) -> bool:
        return not any(
            isinstance(each, Callback) or (isinstance(each, Invoke) and each.name in acting)
            for each in parts_of(expr)
        )

    def without(f: TypedFunction) -> TypedFunction:
        seen = {each.name for each in expressions_in(f.body) if isinstance(each, Local)}

        def changed_to(statement: Statement) -> Iterable[Statement]:
            match statement:
                case Do(call=call) if idle(call):
                    return ()
                case Assign(target=Local(name=name), value=value) if name not in seen and idle(
                    value
                ):
                    return ()
                case AssignMany(targets=targets, call=call) if idle(call) and not any(
                    each.name in seen for each in targets
                ):
                    return ()
            return (statement,)

        return replace(f, body=rebuilt(f.body, changed_to))

    return [*map(without, functions)]


def _acts(body: Body) -> bool:
    """Return whether statements write, call the host, or may go on for ever."""
    return any(isinstance(each, Put | While) for each in statements_of(body)) or any(
        isinstance(each, Callback) for each in expressions_in(body)
    )


def _without_unread_words(
    functions: list[TypedFunction], single: set[int], read: Collection[int]
) -> list[TypedFunction]:
    """Leave out what is written to single numbers of the block that nothing reads."""

    def of(address: Address) -> int:
        base = address.base
        whole = isinstance(base, Local) and not base.to and address.index is None
        return address.offset if whole else -1

    seen = {of(e.address) for f in functions for e in expressions_in(f.body) if isinstance(e, Load)}
    unread = single - seen - {*read}

    def changed_to(statement: Statement) -> Iterable[Statement]:
        match statement:
            case Put(address=address, value=value) if of(address) in unread and _pure(value):
                return ()
        return (statement,)

    return [replace(f, body=rebuilt(f.body, changed_to)) for f in functions]


def _without_unread_parameters(functions: list[TypedFunction]) -> list[TypedFunction]:
    """Leave out parameters that nothing reads, where their arguments have no effect."""
    unread: dict[str, set[int]] = {}
    for f in functions:
        seen = {each.name for each in expressions_in(f.body) if isinstance(each, Local)}
        own = set() if f.entry else {k for k, u in enumerate(f.parameters) if u.name not in seen}
        unread[f.name] = own
    for f in functions:
        for each in expressions_in(f.body):
            if isinstance(each, Invoke):
                unread[each.name] -= {k for k, u in enumerate(each.arguments) if not _pure(u)}

    def shorter(expr: Expr) -> Expr:
        if isinstance(expr, Invoke) and unread[expr.name]:
            kept = (u for k, u in enumerate(expr.arguments) if k not in unread[expr.name])
            return replace(expr, arguments=tuple(kept))
        return expr

    return [
        replace(
            f,
            parameters=tuple(u for k, u in enumerate(f.parameters) if k not in unread[f.name]),
            body=rebuilt(f.body, lambda each: (with_expressions(each, shorter),)),
        )
        for f in functions
    ]


# --------------------------------------------------------------------------- temporary names
def _forwarded(function: TypedFunction) -> TypedFunction:
    """Put what has only a temporary name where it is read, in the statement after it."""
    reads = Counter(each.name for each in expressions_in(function.body) if isinstance(each, Local))
    writes = Counter[str]()
    for each in statements_of(function.body):
        match each:
            case Assign(target=target) | For(target=target):
                writes[target.name] += 1
            case AssignMany(targets=targets):
                writes.update(target.name for target in targets)

    def once(local: Local) -> bool:
        own = local.name.startswith(".") and local.kind != "p"
        return own and reads[local.name] == writes[local.name] == 1

    def block(body: Body) -> Body:
        made: list[Statement] = []
        waiting: dict[str, Assign] = {}
        for each in body:
            if isinstance(each, If):
                each = replace(each, body=block(each.body), orelse=block(each.orelse))
            elif isinstance(each, While | For):
                each = replace(each, body=block(each.body))
            if isinstance(each, Assign) and once(each.target) and _small(each.value):
                inside = {u.name for u in locals_in(each.value)} & waiting.keys()
                each = _filled(each, {name: waiting.pop(name) for name in inside})
                waiting[each.target.name] = each
                continue
            each = _moved_into(each, waiting, made)
            match made[-1] if made else None, each:
                case AssignMany(targets=targets) as call, Assign(target, Local() as source) if (
                    source in targets
                    and once(source)
                    and target not in targets
                    and target.kind == source.kind
                ):
                    moved = (target if u == source else u for u in targets)
                    made[-1] = replace(call, targets=tuple(moved))
                    continue
                case Assign(source, value), Assign(target, Local() as copied) if (
                    copied == source and once(source) and target.kind == source.kind
                ):
                    made[-1] = Assign(target, value)
                    continue
                case Assign(source, value), Put(address=address, value=Local() as copied) if (
                    copied == source and once(source) and address.index is None
                ):
                    made[-1] = replace(each, value=value)
                    continue
            made.append(each)
        return (*made, *waiting.values())

    return replace(function, body=block(function.body))


def _small(value: Expr) -> bool:
    return _pure(value) and sum(1 for _ in parts_of(value)) <= SMALL


def _moved_into(
    statement: Statement, waiting: dict[str, Assign], made: list[Statement]
) -> Statement:
    """Return a statement that reads values where they were; append others that cannot wait."""
    if not waiting:
        return statement
    expressions = () if isinstance(statement, While | For) else expressions_of(statement)
    calls = sum(
        not _pure(part) and isinstance(part, Invoke) for e in expressions for part in parts_of(e)
    )
    top = sum(isinstance(each, Invoke) for each in expressions)
    allowed = calls <= top <= 1
    inside = {part.name for e in expressions for part in parts_of(e) if isinstance(part, Local)}
    given = {name: waiting.pop(name) for name in inside & waiting.keys()} if allowed else {}
    target = None
    if isinstance(statement, Assign) and _pure(statement.value):
        target = statement.target
    for name, each in [*waiting.items()]:
        if target is None or target in locals_in(each.value):
            made.append(waiting.pop(name))
    filled: Statement = _filled(statement, given)
    return filled


def _filled(statement: Statement, given: Mapping[str, Assign]) -> Any:
    """Return a statement, of the same class, with values for locals that are assigned them."""

    def value(expr: Expr) -> Expr:
        return given[expr.name].value if isinstance(expr, Local) and expr.name in given else expr

    return with_expressions(statement, value)
