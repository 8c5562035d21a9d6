"""Locals of a function: where each can be declared, and which are only copies of others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from integrators.machine_code.tree import (
    Assign,
    AssignMany,
    Do,
    Expr,
    For,
    If,
    Invoke,
    Load,
    Local,
    Put,
    Return,
    Statement,
    TypedFunction,
    While,
    locals_in,
    may_write,
    parts_of,
)


# --------------------------------------------------------------------------- declarations
def declarations(body: tuple[Statement, ...]) -> dict[int, frozenset[str]]:
    """Return by the `id` of statements the locals that live only from there to a block's end.

    Examples
    --------
    >>> x = Local("f", "x")
    >>> body = (Assign(x, Local("f", "u")), Return((x,)))
    >>> declarations(body) == {id(body[0]): frozenset({"x"})}
    True
    """
    found: dict[int, frozenset[str]] = {}
    _declare(body, _names_in(body), found)
    return found


def _declare(
    block: tuple[Statement, ...], free: frozenset[str], found: dict[int, frozenset[str]]
) -> None:
    mentioned = [_names_in((each,)) & free for each in block]
    counts = Counter(name for names in mentioned for name in names)
    seen = frozenset[str]()
    for statement, names in zip(block, mentioned, strict=True):
        alone = frozenset(name for name in names if counts[name] == 1)
        read = frozenset(each.name for expr in _read_by(statement) for each in locals_in(expr))
        set_here = frozenset(each.name for each in _set_by(statement))
        if isinstance(statement, For):
            set_here &= alone
        if new := (set_here & names) - read - seen:
            found[id(statement)] = new
        seen |= names
        inner = _blocks_of(statement)
        for k, each in enumerate(inner):
            others = _names_in(*(u for j, u in enumerate(inner) if j != k))
            _declare(each, alone - read - set_here - others, found)


def _names_in(*blocks: tuple[Statement, ...]) -> frozenset[str]:
    names: set[str] = set()
    for statement in _all_in(*blocks):
        names.update(each.name for each in _set_by(statement))
        names.update(each.name for expr in _read_by(statement) for each in locals_in(expr))
    return frozenset(names)


def assigned(*blocks: tuple[Statement, ...]) -> frozenset[str]:
    """Return the names of the locals that statements assign to."""
    return frozenset(u.name for each in _all_in(*blocks) for u in _set_by(each))


def _all_in(*blocks: tuple[Statement, ...]) -> Iterator[Statement]:
    for block in blocks:
        for each in block:
            yield each
            yield from _all_in(*_blocks_of(each))


def _blocks_of(statement: Statement) -> tuple[tuple[Statement, ...], ...]:
    match statement:
        case If(body=body, orelse=orelse):
            return body, orelse
        case For(body=body) | While(body=body):
            return (body,)
    return ()


def _set_by(statement: Statement) -> tuple[Local, ...]:
    """Return the locals that a statement itself assigns to."""
    match statement:
        case Assign(target=target) | For(target=target):
            return (target,)
        case AssignMany(targets=targets):
            return targets
    return ()


def _read_by(statement: Statement) -> tuple[Expr, ...]:
    """Return the expressions of a statement itself."""
    match statement:
        case Assign(value=value):
            return (value,)
        case AssignMany(call=call) | Do(call=call):
            return (call,)
        case Put(address=address, value=value):
            index = () if address.index is None else (address.index,)
            return address.base, *index, value
        case If(test=test) | While(test=test):
            return (test,)
        case For(start=start, stop=stop):
            return start, stop
        case Return(values=values):
            return values
    return ()


# --------------------------------------------------------------------------- copies
def without_copies(function: TypedFunction) -> TypedFunction:
    """Return a function in which a local that is only handed on to the next statement is gone.

    Examples
    --------
    >>> x, u = Local("f", "x"), Local("f", "u")
    >>> made = TypedFunction("same", (u,), "f", (x,), (Assign(x, u), Return((x,))))
    >>> without_copies(made).body == (Return((u,)),)
    True
    """
    everything = [*_all_in(function.body)]
    reads = Counter(
        each.name for statement in everything for u in _read_by(statement) for each in locals_in(u)
    )
    sets = Counter(each.name for statement in everything for each in _set_by(statement))
    once = {name for name, count in reads.items() if count == 1 and sets[name] == 1}
    body = _joined(function.body, once)
    left = _names_in(body)
    variables = tuple(each for each in function.variables if each.name in left)
    return replace(function, body=body, variables=variables)


def _joined(block: Iterable[Statement], once: set[str]) -> tuple[Statement, ...]:
    made: list[Statement] = []
    for each in block:
        changes: dict[str, Any] = {}
        for name in ("body", "orelse"):
            if hasattr(each, name):
                changes[name] = _joined(getattr(each, name), once)
        made.append(replace(each, **changes) if changes else each)
        while _join(made, once):
            pass
    return tuple(made)


def _join(made: list[Statement], once: set[str]) -> bool:
    """Join the last two statements, if the second only hands on what the first one found."""
    match made[-2:]:
        case [Assign(target=Local(name=name), value=value), Assign(value=Local(name=same)) as last]:
            joined: Statement = replace(last, value=value)
        case [Assign(target=Local(name=name), value=value), Return(values=(Local(name=same),))]:
            joined = Return((value,))
        case [
            Assign(target=Local(name=name), value=value),
            Put(address=address, value=Local(name=same)) as last,
        ] if not (may_write(value) and any(map(_loads, (address.base, address.index)))):
            joined = replace(last, value=value)
        case [
            AssignMany(targets=targets) as first,
            Assign(target=target, value=Local(name=same) as handed),
        ] if handed in targets and target not in targets:
            name = same
            joined = replace(first, targets=tuple(target if u == handed else u for u in targets))
        case _:
            return False
    if name != same or name not in once:
        return False
    made[-2:] = [joined]
    return True


def _loads(expr: Expr | None) -> bool:
    """Return whether an expression reads what a call may change."""
    return expr is not None and any(isinstance(part, Load | Invoke) for part in parts_of(expr))
