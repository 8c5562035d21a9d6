"""How arguments are passed: numbers by value, arrays by address, tuples as what they are made of.

Two named tuples with the same fields are passed alike, and one translation serves both. A field
whose address follows from another's is not passed a second time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from integrators.machine_code.front_end.bindings import bind
from integrators.machine_code.front_end.values import (
    ArrayValue,
    FixedValue,
    NumberValue,
    RecordValue,
    Value,
    substituted,
)
from integrators.machine_code.front_end.work import Work
from integrators.machine_code.tree import Const, Expr, Local, locals_in


def passed_of(arguments: Sequence[Value]) -> tuple[list[Expr], tuple[Any, ...]]:
    """Return what is passed for some arguments."""
    passed: list[Expr] = []
    names: dict[Local, Expr] = {}

    def known(expr: Expr) -> Expr:
        """Return an expression in terms of numbered parameters."""
        for each in locals_in(expr):
            if each not in names:
                names[each] = Local(each.kind, f"a{len(passed)}", each.to)
                passed.append(each)
        return substituted(expr, names)  # type: ignore[no-any-return]

    def shape(value: Value, direct: bool) -> Any:
        match value:
            case NumberValue(expr=expr) if direct and not isinstance(expr, Const):
                passed.append(expr)
                return "number", expr.kind, len(passed)
            case NumberValue(expr=expr):
                return "number", known(expr)
            case ArrayValue(kind=kind, dims=dims) if direct:
                passed.append(value.beginning)
                return "array", kind, len(passed), tuple(map(known, dims))
            case ArrayValue(kind=kind, dims=dims, base=base, offset=offset, index=index):
                lengths = tuple(map(known, dims))
                at = None if index is None else known(index)
                return "view", kind, lengths, known(base), offset, at
            case RecordValue(cls=cls, fields=fields):
                parts = tuple((name, shape(part, False)) for name, part in fields.items())
                return "record", id(cls), parts
            case FixedValue(value=fixed):
                return "fixed", id(fixed)

    return passed, tuple([shape(argument, True) for argument in arguments])


def take(work: Work, arguments: Sequence[Value]) -> None:
    """Give a function its parameters, in the order in which `passed_of` passes them."""
    names = [each.arg for each in work.source.definition.args.args]
    if len(names) != len(arguments):
        raise work.error(f"it takes {len(names)} arguments, not {len(arguments)}")
    known: dict[Local, Expr] = {}

    def parameter(name: str, kind: str, to: str = "") -> Local:
        local = Local(kind, f"{name}.{len(work.parameters)}.", to)
        work.parameters[local] = None
        return local

    def own(expr: Expr, name: str) -> Expr:
        for each in locals_in(expr):
            if each not in known:
                first = each.name.partition(".")[0] or name
                known[each] = parameter(first if each.kind == "p" else name, each.kind, each.to)
        return substituted(expr, known)  # type: ignore[no-any-return]

    def bound(value: Value, name: str, direct: bool) -> Value:
        match value:
            case NumberValue(expr=expr) if direct and not isinstance(expr, Const):
                return NumberValue(parameter(name, expr.kind))
            case NumberValue(expr=expr):
                return NumberValue(own(expr, name))
            case ArrayValue(kind=kind, dims=dims) if direct:
                local = parameter(name, "p", kind)
                return ArrayValue(kind, tuple(own(each, name) for each in dims), local)
            case ArrayValue(dims=dims, base=base, index=index):
                lengths = tuple(own(each, name) for each in dims)
                at = None if index is None else own(index, name)
                return replace(value, dims=lengths, base=own(base, name), index=at)
            case RecordValue(fields=fields):
                return replace(value, fields={k: bound(v, k, False) for k, v in fields.items()})
        return value

    values = [bound(each, name, True) for name, each in zip(names, arguments, strict=True)]
    for name, value in zip(names, values, strict=True):
        if name in work.assigned:
            work.assigned[name] += 1
            bind(work, name, value)
        else:
            work.scope[name] = value
