"""Statements: assignments, branches, loops and returns."""

from __future__ import annotations

import ast
import functools
from collections.abc import Sequence

from integrators.machine_code.front_end.bindings import bind, give, own
from integrators.machine_code.front_end.expressions import call as translated_call
from integrators.machine_code.front_end.expressions import (
    condition,
    contains,
    in_order,
    integer,
    negated,
    number,
    operation,
    steady,
    subscript,
    value,
)
from integrators.machine_code.front_end.values import (
    ArrayValue,
    FixedValue,
    NumberValue,
    RecordValue,
    Value,
)
from integrators.machine_code.front_end.work import Work, as_kind
from integrators.machine_code.tree import (
    Assign,
    Break,
    Const,
    Continue,
    Do,
    For,
    If,
    Invoke,
    Load,
    Local,
    Put,
    Return,
    Statement,
    While,
)


def body(work: Work) -> tuple[Statement, ...]:
    """Translate the statements of a function."""
    made = (*work.out, *_block(work, work.source.definition.body))
    if _comes_to_its_end(made):
        if work.gives:
            work.node = work.source.definition
            raise work.error("the function may end without a value")
        made += (Return(()),)
    return made


def _comes_to_its_end(made: Sequence[Statement]) -> bool:
    """Return whether what stands after some statements may be reached."""
    match made[-1] if made else None:
        case Return() | Break() | Continue():
            return False
        case If(body=yes, orelse=no):
            return _comes_to_its_end(yes) or _comes_to_its_end(no)
        case While(test=Const(), body=inside):
            return _is_left(inside)
    return True


def _is_left(made: Sequence[Statement]) -> bool:
    """Return whether statements leave the loop they are in."""
    return any(
        isinstance(each, Break)
        or (isinstance(each, If) and (_is_left(each.body) or _is_left(each.orelse)))
        for each in made
    )


def _block(work: Work, nodes: Sequence[ast.stmt]) -> tuple[Statement, ...]:
    before, work.out = work.out, []
    for node in nodes:
        work.node = node
        _statement(work, node)
    made, work.out = tuple(work.out), before
    return made


def _statement(work: Work, node: ast.stmt) -> None:
    match node:
        case ast.Expr(value=ast.Constant()) | ast.Pass():
            pass
        case ast.Expr(value=ast.Call() as called):
            made = translated_call(work, called)
            if isinstance(made, NumberValue) and not isinstance(made.expr, Local | Const):
                work.out.append(Do(made.expr))
        case ast.Assign(targets=[target], value=given):
            _assign(work, target, given)
        case ast.Assign(targets=targets, value=given):
            common = NumberValue(work.kept(number(work, given)))
            for target in targets:
                _store(work, target, common)
        case ast.AnnAssign(target=target, value=ast.expr() as given):
            _assign(work, target, given)
        case ast.AugAssign(target=target, op=op, value=given):
            _augment(work, target, op, given)
        case ast.If(test=test, body=inside, orelse=orelse):
            chosen = condition(work, test)
            if isinstance(chosen, Const):
                work.out += _block(work, inside if chosen.value else orelse)
            else:
                work.out.append(If(chosen, _block(work, inside), _block(work, orelse)))
        case ast.While(test=test, body=inside, orelse=[]):
            _while(work, test, inside)
        case ast.For(target=ast.Name(id=name), iter=over, body=inside, orelse=[]):
            _for(work, name, over, inside)
        case ast.Break():
            work.out.append(Break())
        case ast.Continue():
            work.out.append(Continue())
        case ast.Return(value=None):
            give(work, None)
        case ast.Return(value=ast.Tuple(elts=parts)):
            values = in_order(work, parts)
            give(work, RecordValue(tuple, {str(k): each for k, each in enumerate(values)}))
        case ast.Return(value=ast.expr() as given):
            give(work, value(work, given))
        case _:
            raise work.error("this statement is not part of the subset")


# --------------------------------------------------------------------------- loops
def _while(work: Work, test: ast.expr, inside: Sequence[ast.stmt]) -> None:
    before, work.out = work.out, []
    going_on = condition(work, test)
    first, work.out = work.out, before
    if first:  # statements that come before the condition, each time
        leave = If(negated(going_on), (Break(),), ())
        work.out.append(While(Const("b", True), (*first, leave, *_block(work, inside))))
    else:
        work.out.append(While(going_on, _block(work, inside)))


def _for(work: Work, name: str, over: ast.expr, inside: list[ast.stmt]) -> None:
    if name in work.source.names.changed:
        raise work.error(f"the loop changes its own variable {name}")
    if isinstance(over, ast.Call) and value(work, over.func) == FixedValue(range):
        _over_range(work, name, over, inside)
        return
    whole = value(work, over)
    if isinstance(whole, RecordValue):
        _over_tuple(work, name, whole, inside)
    elif isinstance(whole, ArrayValue) and len(whole.dims) == 1:
        _over_array(work, name, whole, inside)
    else:
        raise work.error("a loop goes over a range or over an array of numbers")


def _over_range(work: Work, name: str, over: ast.Call, inside: Sequence[ast.stmt]) -> None:
    limits = [integer(work, each) for each in over.args]
    start, stop = (Const("i", 0), limits[0]) if len(limits) == 1 else limits[:2]
    step = limits[2] if len(limits) == 3 else Const("i", 1)
    if not isinstance(step, Const) or step.value <= 0:
        raise work.error("the step of a range must be a positive constant")
    target = work.variable(name, "i")
    bound = NumberValue(target)
    work.scope[name] = work.first.setdefault(name, bound)
    if work.scope[name] != bound or target.kind != "i":
        raise work.error(f"{name} would be of two kinds")
    stop = work.kept(stop, f"{name}_end")
    if name in work.source.names.read_after:  # then it is what the body had last, not the limit
        place = work.new("i", word=f"{name}_next")
        made: tuple[Statement, ...] = (Assign(target, place), *_block(work, inside))
    else:
        place, made = target, _block(work, inside)
    work.out.append(For(place, start, stop, step.value, made))


def _over_array(work: Work, name: str, array: ArrayValue, inside: Sequence[ast.stmt]) -> None:
    work_array = own(work, work.fresh(), array)
    assert isinstance(work_array, ArrayValue)
    place = work.new("i", word=f"{name}_at")
    entry = work_array.at(place)
    assert isinstance(entry, NumberValue)
    stop = work.kept(work_array.dims[0], f"{name}_end")
    before, work.out = work.out, []
    bind(work, name, entry)
    first, work.out = work.out, before
    work.out.append(For(place, Const("i", 0), stop, 1, (*first, *_block(work, inside))))


def _over_tuple(work: Work, name: str, whole: RecordValue, inside: Sequence[ast.stmt]) -> None:
    """Repeat the body for each of a few values."""
    if any(isinstance(n, ast.Break | ast.Continue) for u in inside for n in ast.walk(u)):
        raise work.error("a loop over a tuple cannot be left")
    parts = own(work, work.fresh(), whole)
    assert isinstance(parts, RecordValue)
    for each in inside:  # each of them is translated several times
        work.assigned += work.source.names_in(each).assigned
    for part in parts.fields.values():
        work.scope[name] = part
        work.out += _block(work, inside)


# --------------------------------------------------------------------------- assignments
def _assign(work: Work, target: ast.expr, given: ast.expr) -> None:
    if not isinstance(target, ast.Tuple):
        if isinstance(target, ast.Subscript) and _has_call(target):
            _store(work, target, steady(work, value(work, given)))
        else:
            _store(work, target, value(work, given))
        return
    if isinstance(given, ast.Tuple):
        parts = in_order(work, given.elts)
        names = {each.id for each in target.elts if isinstance(each, ast.Name)}
        read = {each.id for each in ast.walk(given) if isinstance(each, ast.Name)}
        if names & read or any(not isinstance(each, ast.Name) for each in target.elts):
            parts = [
                NumberValue(work.kept(each.expr, f"new_{getattr(to, 'id', 'value')}"))
                if isinstance(each, NumberValue)
                else own(work, work.fresh(), each)
                for each, to in zip(parts, target.elts, strict=False)
            ]
    else:
        whole = value(work, given)
        if not isinstance(whole, RecordValue):
            raise work.error("only tuples can be unpacked")
        parts = list(whole.fields.values())
    if len(parts) != len(target.elts):
        raise work.error("the numbers of names and values differ")
    for each, part in zip(target.elts, parts, strict=True):
        _store(work, each, part)


def _augment(work: Work, target: ast.expr, op: ast.operator, given: ast.expr) -> None:
    """Translate an assignment such as ``+=``."""
    if isinstance(target, ast.Name):
        now = number(work, ast.Name(target.id, ast.Load()))
        more = number(work, given)
        _store(work, target, NumberValue(operation(work, op, now, more)))
        return
    entry = _entry(work, target)
    more = number(work, given)
    if contains(more, Invoke):
        raise work.error("call the function first")
    result = as_kind(work, operation(work, op, entry, more), entry.kind)
    work.out.append(Put(entry.kind, entry.address, result))


def _store(work: Work, target: ast.expr, given: Value) -> None:
    """Assign a value to a name, to an entry of an array or to a field of a dataclass."""
    if isinstance(target, ast.Name):
        bind(work, target.id, given)
        return
    if not isinstance(given, NumberValue):
        raise work.error("an entry or a field is a number")
    expr = work.kept(given.expr) if contains(given.expr, Invoke) else given.expr
    entry = _entry(work, target)
    work.out.append(Put(entry.kind, entry.address, as_kind(work, expr, entry.kind)))


def _entry(work: Work, target: ast.expr) -> Load:
    match target:
        case ast.Subscript():
            entry = subscript(work, target)
            if isinstance(entry, NumberValue) and isinstance(entry.expr, Load):
                return entry.expr
        case ast.Attribute(value=owner, attr=name):
            whole = value(work, owner)
            part = whole.fields.get(name) if isinstance(whole, RecordValue) else None
            if isinstance(part, ArrayValue) and not part.dims:
                return Load(part.kind, part.address)
    raise work.error("only names, entries of arrays and numbers of dataclasses can be assigned")


@functools.lru_cache(maxsize=4096)
def _has_call(node: ast.expr) -> bool:
    return any(isinstance(each, ast.Call) for each in ast.walk(node))
