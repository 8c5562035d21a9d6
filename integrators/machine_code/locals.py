"""Locals of a function: where each can be declared, and which are only copies of others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, NamedTuple

from integrators.machine_code.tree import (
    Assign,
    AssignMany,
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
    blocks_of,
    expressions_in,
    expressions_of,
    locals_in,
    may_write,
    parts_of,
    statements_of,
    targets_of,
)


# --------------------------------------------------------------------------- declarations
def declarations(body: tuple[Statement, ...], *, narrow: bool = True) -> Declarations:
    """Return where the locals of a function can be declared; the others live in all of it.

    If not `narrow`, only where one statement gives them their value.

    Examples
    --------
    >>> x = Local("f", "x")
    >>> body = (Assign(x, Local("f", "u")), Return((x,)))
    >>> declarations(body).at == {id(body[0]): frozenset({"x"})}
    True
    """
    found = Declarations({}, {})
    _declare(body, mentioned(body), found, narrow=narrow)
    return found


class Declarations(NamedTuple):
    """By the `id` of statements the locals that live only from there to a block's end."""

    at: dict[int, frozenset[str]]  # the statement gives them their value
    before: dict[int, frozenset[str]]  # all branches of the statement do


def _declare(
    block: tuple[Statement, ...], free: frozenset[str], found: Declarations, *, narrow: bool
) -> None:
    named = [mentioned((each,)) & free for each in block]
    counts = Counter(name for names in named for name in names)
    counting = [
        {each.target.name} if narrow and isinstance(each, For) else set[str]() for each in block
    ]
    elsewhere = {name for names, own in zip(named, counting, strict=True) for name in names - own}
    seen = frozenset[str]()
    for statement, names in zip(block, named, strict=True):
        alone = frozenset(name for name in names if counts[name] == 1)
        read = frozenset(u.name for expr in expressions_of(statement) for u in locals_in(expr))
        set_here = frozenset(each.name for each in targets_of(statement))
        if isinstance(statement, For):
            set_here &= alone | (names - elsewhere)
        if new := (set_here & names) - read - seen:
            found.at[id(statement)] = new
        inner, inside = blocks_of(statement), frozenset[str]()
        for k, each in enumerate(inner):
            others = mentioned(*(u for j, u in enumerate(inner) if j != k))
            own = alone - read - set_here - others
            _declare(each, own, found, narrow=narrow)
            inside |= own
        later = names - new - seen - inside
        if narrow and (bare := frozenset(name for name in later if _sets(statement, name))):
            found.before[id(statement)] = bare
        seen |= names if not narrow else names & elsewhere


def _sets(statement: Statement, name: str) -> bool:
    """Return whether all branches of a statement give a local a value before they read it."""
    match statement:
        case Assign(value=value) | AssignMany(call=value):
            own = any(each.name == name for each in targets_of(statement))
            return own and all(each.name != name for each in locals_in(value))
        case If(test=test, body=body, orelse=orelse):
            if any(each.name == name for each in locals_in(test)):
                return False
            parts = [
                [each for each in part if name in mentioned((each,))] for part in (body, orelse)
            ]
            return all(part and _sets(part[0], name) for part in parts)
    return False


def mentioned(*blocks: tuple[Statement, ...]) -> frozenset[str]:
    """Return the names of the locals that statements read or assign to."""
    read = (u.name for block in blocks for u in expressions_in(block) if isinstance(u, Local))
    return assigned(*blocks) | frozenset(read)


def assigned(*blocks: tuple[Statement, ...]) -> frozenset[str]:
    """Return the names of the locals that statements assign to."""
    within = (each for block in blocks for each in statements_of(block))
    return frozenset(u.name for each in within for u in targets_of(each))


def assigned_once(body: tuple[Statement, ...]) -> frozenset[str]:
    """Return the locals that one statement only gives a value to, and which do not count a loop."""
    within = [*statements_of(body)]
    sets = Counter(u.name for each in within for u in targets_of(each))
    counting = {each.target.name for each in within if isinstance(each, For)}
    return frozenset(name for name, count in sets.items() if count == 1) - counting


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
    reads = Counter(u.name for u in expressions_in(function.body) if isinstance(u, Local))
    within = statements_of(function.body)
    sets = Counter(u.name for each in within for u in targets_of(each))
    once = {name for name, count in reads.items() if count == 1 and sets[name] == 1}
    body = _joined(function.body, once)
    left = mentioned(body)
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
