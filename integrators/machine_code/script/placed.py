"""Functions for a block at a known place: its address is a number, and no function is handed it.

Addresses of constants become constants. A parameter that has the same constant at all calls goes,
and so does a function that nobody calls.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from integrators.machine_code.locals import assigned
from integrators.machine_code.tree import (
    Address,
    AddressOf,
    Const,
    Invoke,
    Local,
    Module,
    TypedFunction,
    expressions_in,
    may_write,
)


def placed(module: Module, known: Mapping[str, Const]) -> Module:
    """Return a module whose entries have constants for parameters of some names.

    Examples
    --------
    >>> from integrators.machine_code.tree import Load, Return
    >>> block = Local("p", "block")
    >>> body = (Return((Load("f", Address(block, 16)),)),)
    >>> entry = TypedFunction("third", (block,), "f", (), body, entry=True)
    >>> made = placed(Module([entry]), {"block": Const("p", 64)}).functions[0]
    >>> made.parameters, made.body[0].values[0].address.base.value
    ((), 80)
    """
    done: list[TypedFunction] = []  # callers first
    calls = dict[str, list[Invoke]]()
    gone = dict[str, frozenset[int]]()
    for function in reversed(module.functions):
        given = known
        if not function.entry and function.name not in calls:
            continue
        if not function.entry:
            arguments = zip(*(each.arguments for each in calls[function.name]), strict=True)
            same = [a[0] if isinstance(a[0], Const) and len({*a}) == 1 else None for a in arguments]
            named = zip(function.parameters, same, strict=True)
            changed = assigned(function.body)
            given = {u.name: v for u, v in named if v is not None and u.name not in changed}
            gone[function.name] = frozenset(
                k for k, each in enumerate(function.parameters) if each.name in given
            )
        made = replace(function, body=_changed(function.body, _with(given)))
        kept = tuple(each for each in function.parameters if each.name not in given)
        done.append(replace(made, parameters=kept))
        for call in expressions_in(made.body):
            if isinstance(call, Invoke):
                calls.setdefault(call.name, []).append(call)

    def shorter(part: Any) -> Any:
        if not isinstance(part, Invoke):
            return part
        left = tuple(u for k, u in enumerate(part.arguments) if k not in gone[part.name])
        return replace(part, arguments=left, writes=may_write(part))

    functions = [replace(each, body=_changed(each.body, shorter)) for each in reversed(done)]
    return replace(module, functions=functions)


def _with(given: Mapping[str, Const]) -> Callable[[Any], Any]:
    """Return what puts constants in the place of parameters, and counts addresses together."""

    def change(part: Any) -> Any:
        match part:
            case Local(name=name):
                return given.get(name, part)
            case Address(base=Const(value=base), offset=offset, index=None | Const() as index):
                more = 0 if index is None else index.value * part.size
                return replace(part, base=Const("p", base + offset + more), offset=0, index=None)
            case AddressOf(address=Address(base=Const() as base, offset=0, index=None)):
                return base
        return part

    return change


def _changed(part: Any, change: Callable[[Any], Any]) -> Any:
    """Return a part of the program with all its parts changed, from the inside."""
    if isinstance(part, tuple):
        return tuple(_changed(each, change) for each in part)
    if not dataclasses.is_dataclass(part) or isinstance(part, type | Const):
        return part
    old = {name: getattr(part, name) for name in part.__dataclass_fields__}
    new = {name: _changed(each, change) for name, each in old.items()}
    same = all(new[name] is each for name, each in old.items())
    return change(part if same else type(part)(**new))
