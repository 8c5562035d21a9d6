"""What names stand for after assignments, and what a function returns.

A named tuple or a view of an array is nothing in memory: its parts are expressions. A part that
changes, or that differs between two assignments to the same name, has a local variable of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from integrators.machine_code.front_end.values import (
    ArrayValue,
    FixedValue,
    NumberValue,
    RecordValue,
    Value,
)
from integrators.machine_code.front_end.work import Again, Work, as_kind
from integrators.machine_code.tree import Const, Expr, Local, Return, leads_to

RESULT = "return"  # as a name; no variable can be called so


def bind(work: Work, name: str, value: Value) -> None:
    """Assign a value to a name."""
    once = work.assigned.get(name, 0) == 1
    if isinstance(value, NumberValue):
        if not (once and isinstance(value.expr, Const)):
            value = NumberValue(work.set(name, value.expr))
    elif isinstance(value, ArrayValue) and not once:
        value = _placed(work, name, value)
    else:
        value = own(work, name, value)
    _agree(work, name, value)
    work.scope[name] = value


def own(work: Work, path: str, value: Value) -> Value:
    """Return a value whose parts do not change when variables do."""
    match value:
        case RecordValue(fields=fields):
            parts = {name: own(work, f"{path}.{name}", part) for name, part in fields.items()}
            same = all(part is fields[name] for name, part in parts.items())
            return value if same else RecordValue(value.cls, parts)
        case NumberValue(expr=expr) if _changes(work, path, expr):
            return NumberValue(work.set(path, expr))
        case ArrayValue():
            place = [value.base] if value.index is None else [value.base, value.index]
            if any(_changes(work, path, each) for each in place):
                return _placed(work, path, value)
            dims = _lengths(work, path, value)
            return value if dims == value.dims else replace(value, dims=dims)
    return value


def _changes(work: Work, path: str, expr: Expr) -> bool:
    return path in work.learnt.varying or not work.constant(expr)


def _placed(work: Work, path: str, array: ArrayValue) -> ArrayValue:
    """Return a view whose beginning is in a local variable."""
    dims = _lengths(work, path, array)
    return ArrayValue(array.kind, dims, work.set(path, array.beginning))


def _lengths(work: Work, path: str, array: ArrayValue) -> tuple[Expr, ...]:
    return tuple(
        work.set(f"{path}.{k}", each) if _changes(work, f"{path}.{k}", each) else each
        for k, each in enumerate(array.dims)
    )


def _agree(work: Work, name: str, value: Value) -> None:
    """Compare with the first assignment to a name, and learn which parts differ."""
    before = work.first.setdefault(name, value)
    differing = set(_differing(work, name, before, value))
    if differing:
        work.learnt.varying |= differing
        raise Again


def _differing(work: Work, path: str, a: Value, b: Value) -> Iterator[str]:
    """Yield the parts in which two values of a name differ."""
    if a is b:
        return
    match a, b:
        case NumberValue(), NumberValue():
            if a != b:
                yield path
        case RecordValue(), RecordValue() if a.cls is b.cls and a.fields.keys() == b.fields.keys():
            for name, part in a.fields.items():
                yield from _differing(work, f"{path}.{name}", part, b.fields[name])
        case ArrayValue(), ArrayValue() if a.kind == b.kind and len(a.dims) == len(b.dims):
            if replace(a, dims=b.dims) != b:
                yield path
            for k, (one, other) in enumerate(zip(a.dims, b.dims, strict=True)):
                if one != other:
                    yield f"{path}.{k}"
        case FixedValue(), FixedValue() if a.value is b.value:
            pass
        case _:
            name = path.split(".")[0]
            what = "what the function returns" if name == RESULT else name
            raise work.error(f"{what} would be of two kinds")


# --------------------------------------------------------------------------- results
def give(work: Work, value: Value | None) -> None:
    """Return a value: its numbers, and of its arrays what the caller cannot know."""
    passed: list[Expr] = []
    if work.gives not in (None, value is not None):
        raise work.error("the function returns a value or nothing")
    work.gives = value is not None
    if value is not None:
        _agree(work, RESULT, _returned(work, RESULT, value, passed))
    work.out.append(Return(tuple(passed)))


def _returned(work: Work, path: str, value: Value, passed: list[Expr]) -> Value:
    """Return a value in terms of parameters and slots, and append what goes into the slots."""

    def slot(path: str, expr: Expr) -> Local:
        local = work.local(work.slots, path, expr.kind, leads_to(expr))
        passed.append(as_kind(work, expr, local.kind))
        return local

    match value:
        case NumberValue(expr=expr):
            return NumberValue(slot(path, expr))
        case RecordValue(fields=fields):
            parts = {k: _returned(work, f"{path}.{k}", v, passed) for k, v in fields.items()}
            return replace(value, fields=parts)
        case ArrayValue():
            lengths = [
                slot(f"{path}.{k}", each) if _changes(work, f"{path}.{k}", each) else each
                for k, each in enumerate(value.dims)
            ]
            dims = tuple(lengths)
            place = [value.base] if value.index is None else [value.base, value.index]
            if any(_changes(work, path, each) for each in place):
                return ArrayValue(value.kind, dims, slot(path, value.beginning))
            return replace(value, dims=dims)
    return value
