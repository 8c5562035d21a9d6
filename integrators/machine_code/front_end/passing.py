"""How arguments are passed: numbers by value, arrays by address, tuples as what they are made of.

Two named tuples with the same fields are passed alike, and one translation serves both. A field
whose address follows from another's is not passed a second time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from integrators.machine_code.front_end.bindings import bind
from integrators.machine_code.front_end.sources import Source
from integrators.machine_code.front_end.values import (
    ArrayValue,
    NumberValue,
    RecordForms,
    RecordValue,
    Value,
    renamed,
    with_locals,
)
from integrators.machine_code.front_end.work import Work
from integrators.machine_code.tree import Const, Expr, Local

ANY_LENGTH = Const("i", -1)  # of an array of which only entries are used


def without_lengths(source: Source, arguments: Sequence[Value]) -> list[Value]:
    """Return arguments without the lengths that do not matter: one translation serves them all."""
    given, free = list(arguments), source.names.only_indexed
    for k, (name, each) in enumerate(zip(source.parameters, arguments, strict=False)):
        if name in free and isinstance(each, ArrayValue) and each.dims[0] != Const("i", 0):
            given[k] = replace(each, dims=(ANY_LENGTH, *each.dims[1:]))
    return given


def passed_of(arguments: Sequence[Value], forms: RecordForms) -> tuple[list[Expr], tuple[Any, ...]]:
    """Return what is passed for some arguments, and what their translation depends on."""
    passed: list[Expr] = []
    names: dict[Local, Expr] = {}

    def numbered(local: Local) -> Expr:
        """Return the parameter that stands for a local."""
        if local not in names:
            names[local] = Local(local.kind, f"a{len(passed)}")
            passed.append(local)
        return names[local]

    def shape(value: Value) -> Any:
        match value:
            case NumberValue(expr=expr) if not isinstance(expr, Const):
                passed.append(expr)
                return "number", expr.kind, len(passed)
            case ArrayValue(kind=kind, dims=dims):
                passed.append(value.beginning)
                return "array", kind, len(passed), *(with_locals(each, numbered) for each in dims)
        return forms.shape(value, numbered)

    return passed, tuple([shape(argument) for argument in arguments])


def take(work: Work, arguments: Sequence[Value]) -> None:
    """Give a function its parameters, in the order in which `passed_of` passes them."""
    names = work.source.parameters
    if len(names) != len(arguments):
        raise work.error(f"it takes {len(names)} arguments, not {len(arguments)}")
    known: dict[Local, Local] = {}

    def parameter(name: str, kind: str, to: str = "") -> Local:
        local = Local(kind, f"{name}.{len(work.parameters)}.", to)
        work.parameters[local] = None
        return local

    def own(local: Local, name: str) -> Local:
        if local not in known:
            first = local.name.partition(".")[0] or name
            known[local] = parameter(first if local.kind == "p" else name, local.kind, local.to)
        return known[local]

    def bound(value: Value, name: str) -> Value:
        match value:
            case NumberValue(expr=expr) if not isinstance(expr, Const):
                return NumberValue(parameter(name, expr.kind))
            case ArrayValue(kind=kind, dims=dims):
                place = parameter(name, "p", kind)
                lengths = [with_locals(each, lambda local: own(local, name)) for each in dims]
                return ArrayValue(kind, tuple(lengths), place)
            case RecordValue():
                for local, field in work.translator.forms.of(value)[1].items():
                    own(local, field)
                return renamed(value, known)
        return value

    values = [bound(each, name) for name, each in zip(names, arguments, strict=True)]
    for name, value in zip(names, values, strict=True):
        if name in work.assigned:
            work.assigned[name] += 1
            bind(work, name, value)
        else:
            work.scope[name] = value
