"""A function while it is translated: its names, its local variables, and its statements so far."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from integrators.machine_code.front_end.sources import Source, TranslationError
from integrators.machine_code.front_end.values import ArrayValue, RecordForms, Value
from integrators.machine_code.tree import (
    Assign,
    Const,
    Expr,
    Global,
    Local,
    Module,
    Op,
    Statement,
    TypedFunction,
    leads_to,
    locals_in,
)

RANK = "bif"  # truth values are integers, integers are floats


class Again(Exception):
    """Something has been learnt of a variable; the function is translated once more."""


@dataclass
class Learnt:
    """What the assignments of a function say together.

    A variable has one meaning in the whole function, which must be known where it is read, and this
    may be before its last assignment.
    """

    kinds: dict[str, str] = field(default_factory=dict)  # wider than first assignments say
    varying: set[str] = field(default_factory=set)  # parts that not all assignments have alike


@dataclass(frozen=True)
class Specialised:
    """A function for arguments of certain types, and what it returns, in terms of parameters."""

    function: TypedFunction
    result: Value | None
    slots: tuple[Local, ...]  # the locals in `result` that stand for returned numbers


class Translating(Protocol):
    """What the translation of one function needs of that of the module."""

    module: Module
    forms: RecordForms

    def source(self, function: Callable[..., Any]) -> Source:
        """Return the text of a function."""

    def translated(
        self, function: Callable[..., Any], arguments: Sequence[Value], types: tuple[Any, ...]
    ) -> Specialised:
        """Return a function for some arguments."""

    def table(self, values: tuple[Any, ...]) -> ArrayValue:
        """Return constants as an array."""


class Work:
    """The translation of one function."""

    def __init__(
        self, translator: Translating, function: Callable[..., Any], learnt: Learnt
    ) -> None:
        self.translator, self.learnt = translator, learnt
        self.source = translator.source(function)
        self.names: dict[str, Any] = function.__globals__
        self.node: ast.AST = self.source.definition  # being translated
        self.out: list[Statement] = []
        self.parameters: dict[Local, None] = {}  # in order
        self.variables: dict[str, Local] = {}
        self.scope: dict[str, Value] = {}
        self.first: dict[str, Value] = {}  # what was assigned first
        self.assigned = Counter(self.source.names.assigned)  # how often the text assigns each name
        self.slots: dict[str, Local] = {}  # of what is returned
        self.gives: bool | None = None  # whether it returns a value
        self.temporary = 0

    def error(self, reason: str) -> TranslationError:
        """Return an error at the present line."""
        return self.source.error(reason, self.node)

    def local(self, table: dict[str, Local], name: str, kind: str, to: str = "") -> Local:
        """Return the local of a name; its kind is the widest of all assignments."""
        kind = self.learnt.kinds.get(name, kind)
        local = table.setdefault(name, Local(kind, name, to))
        if local.kind != kind:
            if "p" in (local.kind, kind):
                raise self.error(f"{name} is an array and a number")
            if RANK.index(kind) > RANK.index(local.kind):
                self.learnt.kinds[name] = kind
                raise Again
        return local

    def variable(self, name: str, kind: str, to: str = "") -> Local:
        """Return the local variable of a name."""
        return self.local(self.variables, name, kind, to)

    def set(self, name: str, expr: Expr) -> Local:
        """Assign a number or an address to a local variable."""
        local = self.variable(name, expr.kind, leads_to(expr))
        self.out.append(Assign(local, as_kind(self, expr, local.kind)))
        return local

    def fresh(self, word: str = "value") -> str:
        """Return a name that no variable has; a word for readers ends it."""
        self.temporary += 1
        return f".{self.temporary}.{word}"

    def new(self, kind: str, to: str = "", word: str = "value") -> Local:
        """Return a new local variable."""
        return self.variable(self.fresh(word), kind, to)

    def kept(self, expr: Expr, word: str = "value") -> Expr:
        """Return an expression that keeps its present value."""
        if isinstance(expr, Const | Global) or expr in self.parameters:
            return expr
        local = self.new(expr.kind, leads_to(expr), word)
        self.out.append(Assign(local, expr))
        return local

    def constant(self, expr: Expr) -> bool:
        """Return whether an expression reads nothing but parameters."""
        return all(each in self.parameters for each in locals_in(expr))


def as_kind(work: Work, expr: Expr, kind: str) -> Expr:
    """Convert a number to a kind that is at least as wide."""
    if expr.kind == kind:
        return expr
    if "p" in (expr.kind, kind) or RANK.index(kind) < RANK.index(expr.kind):
        raise work.error(f"a number of kind {expr.kind} does not fit into {kind}")
    if isinstance(expr, Const):
        return Const(kind, float(expr.value) if kind == "f" else int(expr.value))
    return Op(kind, "float" if kind == "f" else "int", (expr,))


def common(work: Work, *parts: Expr) -> list[Expr]:
    """Convert numbers to their widest kind."""
    kind = max((part.kind for part in parts), key=RANK.index)
    return [as_kind(work, part, kind) for part in parts]
