"""Loading of generated code so that debuggers and tracebacks find its lines.

This is the only place where text becomes code, and the text is always our own, printed from a
checked tree.
"""

from __future__ import annotations

import ast
import builtins
import functools
import hashlib
import inspect
import itertools
import linecache
import math
from collections.abc import Callable, Iterable, Mapping
from types import CodeType, SimpleNamespace
from typing import Any

import numpy as np

from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.foundation.parser import PARSER
from gms_fsm.foundation.text import visible
from gms_fsm.language import ARGUMENTS, ELEMENTARY, NAMESPACE
from gms_fsm.systems.signals import first_after, piecewise_linear, piecewise_slope
from integrators import elementary
from integrators.machine_code import whole_numbers
from integrators.runners import quick

# What generated text calls besides the functions of the expression language, and what these call.
SIGNALS: Mapping[str, Any] = {
    "first_after": first_after,
    "piecewise_linear": piecewise_linear,
    "piecewise_slope": piecewise_slope,
    "nan": math.nan,
}


def load(title: str, source: str, names: Mapping[str, Any] | None = None) -> dict[str, Any]:
    r"""Run generated text and return the names it defines.

    Examples
    --------
    >>> load("example", "def twice(v):\n    return 2.0 * v\n")["twice"](3.0)
    6.0
    """
    namespace: dict[str, Any] = {**NAMESPACE, **(names or {})}
    exec(_compiled(title, source), namespace)
    return namespace


def quickened(namespace: dict[str, Any]) -> dict[str, Any]:
    """Let a namespace replace elementary functions by machine code when they are called often."""

    def counted(name: str, function: Callable[..., float], count: int) -> Callable[..., float]:
        left = quick.FREE

        def call(*arguments: float) -> float:
            nonlocal left
            left -= 1
            if left == 0:
                namespace[name] = quick.scalar(function, count)
            return function(*arguments)

        return call

    for name in ELEMENTARY:
        namespace[name] = counted(name, NAMESPACE[name], ARGUMENTS[name])
    return namespace


class CarefulText:
    """Generated text with functions and numbers that never raise, for use by `ieee`.

    It is run when one of its functions is called first, in most runs never.
    """

    def __init__(self, title: str, source: str, names: Mapping[str, Any] | None = None) -> None:
        self._text = title, source
        self._names = {**NAMESPACE, **(names or {}), **_IEEE, "_wide": _wide}

    @functools.cached_property
    def _namespace(self) -> dict[str, Any]:
        namespace = dict(self._names)
        exec(_compiled(*self._text, careful=True), namespace)
        return namespace

    def __getitem__(self, name: str) -> Callable[..., Any]:
        """Return a function of the text."""
        return lambda *arguments: self._namespace[name](*arguments)


def standalone(source: str) -> str:
    r"""Return generated text as a standalone program, with the imports and functions that it uses.

    Examples
    --------
    >>> print(standalone("# twice\ndef twice(u):\n    return 2.0 * sqrt(u)\n"))
    # twice
    <BLANKLINE>
    from math import sqrt
    <BLANKLINE>
    <BLANKLINE>
    def twice(u):
        return 2.0 * sqrt(u)
    <BLANKLINE>
    """
    used, own = set[str](), set[str]()
    for node in ast.walk(_tree(source)):
        match node:
            case ast.Name(id=name, ctx=ast.Load()):
                used.add(name)
            case ast.Name(id=name) | ast.arg(arg=name) | ast.FunctionDef(name=name):
                own.add(name)
    if used & {"piecewise_linear", "piecewise_slope"}:
        used.add("first_after")  # which they call
    known: dict[str, Any] = {**NAMESPACE, **SIGNALS}
    python = {name for name, each in vars(builtins).items() if known.get(name, each) is each}
    missing = sorted(used - own - python)
    if foreign := [name for name in missing if name not in known]:
        raise ParameterError(
            "a Python function, which cannot be written as text",
            place=f"{', '.join(foreign)}",
            advice="give the signal as an expression or as corners",
        )
    borrowed = [name for name in missing if known[name] is getattr(math, name, None)]
    parts = [f"from math import {', '.join(borrowed)}\n"] if borrowed else []
    if ours := [name for name in missing if name in ELEMENTARY]:
        parts.insert(0, elementary_text(ours))
    parts += ["\n" + bare(known[name]) for name in missing if name not in {*borrowed, *ours}]
    head, body = _split_head(source)
    return "\n".join([head, *parts, "\n" + body.lstrip("\n")])


@functools.lru_cache(maxsize=64)
def reads_time(source: str) -> bool:
    r"""Return whether generated text reads the time for more than a record's value.

    Examples
    --------
    >>> reads_time("def f(t, tables):\n    return piecewise_linear(t, tables[0], tables[1])\n")
    False
    >>> reads_time("def f(t):\n    return 2.0 * t\n")
    True
    """
    nodes = [*ast.walk(_tree(source))]
    records = {
        node.args[0]
        for node in nodes
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "piecewise_linear"
    }
    return any(
        isinstance(node, ast.Name) and node.id == "t" for node in nodes if node not in records
    )


def elementary_text(names: Iterable[str]) -> str:
    """Return the text of elementary functions of the language, and of all that they use.

    Examples
    --------
    >>> program = {}
    >>> exec(elementary_text(["pow"]), program)
    >>> program["pow"](2.0, 0.5) == 2.0 ** 0.5
    True
    """
    parts = _elementary_parts()
    place = {name: number for number, (given, _, _) in enumerate(parts) for name in given}
    waiting = [NAMESPACE[name].__name__ for name in names]
    used = set[int]()
    while waiting:
        found = place.get(waiting.pop())
        if found is not None and found not in used:
            used.add(found)
            waiting += parts[found][1]
    lines = ["import math\n", *(parts[number][2] for number in sorted(used))]
    renamed = {NAMESPACE[name].__name__: name for name in names}
    return "\n".join([*lines, *(f"\n{b} = {a}" for a, b in renamed.items() if a != b), ""])


@functools.cache
def _elementary_parts() -> list[tuple[list[str], list[str], str]]:
    """Return the names that each part of the module defines, those that it uses, and its text."""
    parts = []
    sources = (_tree(inspect.getsource(each)).body for each in (elementary, whole_numbers))
    for part in itertools.chain(*sources):
        match part:
            case ast.FunctionDef(name=name):
                given, space = [name], "\n\n"
            case ast.Assign(targets=targets):
                given, space = _names(ast.Tuple(targets)), ""
            case _:
                continue
        parts.append((given, _names(part), space + _unannotated(part)))
    return parts


def _names(tree: ast.AST) -> list[str]:
    return [each.id for each in ast.walk(tree) if isinstance(each, ast.Name)]


def _tree(source: str) -> ast.Module:
    """Parse a text, one at a time."""
    with PARSER:
        return ast.parse(source)


def _split_head(source: str) -> tuple[str, str]:
    """Split the leading comments of a text from the rest."""
    lines = source.splitlines(keepends=True)
    end = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
    return "".join(lines[:end]), "".join(lines[end:])


def bare(function: Callable[..., Any]) -> str:
    """Return a function's text without annotations, with its docstring cut to the first line."""
    return _unannotated(_tree(inspect.getsource(function))) + "\n"


def _unannotated(tree: ast.AST) -> str:
    for node in ast.walk(tree):
        if isinstance(node, ast.arg):
            node.annotation = None
        if isinstance(node, ast.FunctionDef):
            node.returns = None
            first = (ast.get_docstring(node) or "").partition("\n")[0]
            node.body[0] = ast.Expr(ast.Constant(first))
    return ast.unparse(ast.fix_missing_locations(tree))


@functools.lru_cache(maxsize=256)
def _compiled(title: str, source: str, careful: bool = False) -> CodeType:
    digest = hashlib.sha256(source.encode()).hexdigest()[:8]
    filename = f"<{visible(title)} {digest}>"
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    if not careful:
        return compile(source, filename, "exec")
    tree = ast.fix_missing_locations(_WideNumbers().visit(_tree(source)))
    return compile(tree, filename, "exec")


class _WideNumbers(ast.NodeTransformer):
    """Replaces every literal number by one that does not raise: 1.0 / 0.0 becomes inf."""

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if not isinstance(node.value, float):
            return node
        return ast.Call(ast.Name("_wide", ast.Load()), [node], [])


# --------------------------------------------------------------------------- IEEE arithmetic
# A trial step may reach a point where exp overflows or a root has a negative argument. There IEEE
# arithmetic yields inf or NaN and the step size shrinks; Python raises. So the text runs as it is,
# fast, and if it raises, again with numbers that do not: the same bits as the compiled text.
def ieee(fast: Callable[..., Any], careful: Callable[..., Any]) -> Callable[..., Any]:
    r"""Return a generated function that yields inf and NaN where Python would raise.

    Examples
    --------
    >>> source = "def rate(y, dy):\n    dy[0] = 1.0 / y[0]\n"
    >>> rate = ieee(load("example", source)["rate"], CarefulText("example", source)["rate"])
    >>> dy = [0.0]
    >>> rate([0.0], dy)
    >>> dy
    [inf]
    """

    @functools.wraps(fast)
    def function(*arguments: Any) -> Any:
        try:
            return fast(*arguments)
        except (ArithmeticError, ValueError) as error:
            if isinstance(error, GMSError):  # from a user's own signal
                raise
        wide = [_wide(argument) for argument in arguments]
        with np.errstate(all="ignore"):
            value = careful(*wide)
        for argument, result in zip(arguments, wide, strict=True):
            if isinstance(argument, list):
                argument[:] = [float(u) if isinstance(u, float) else u for u in result]
        return value

    return function


def _wide(argument: Any) -> Any:
    """Return floats, however nested, as NumPy numbers, which do not raise."""
    if isinstance(argument, float):
        return np.float64(argument)
    if isinstance(argument, list | tuple):
        return type(argument)(_wide(part) for part in argument)
    if hasattr(argument, "__dict__"):  # an element, whose values are read by a guard
        return SimpleNamespace(**{name: _wide(value) for name, value in vars(argument).items()})
    return argument


def _wide_result(function: Callable[..., float]) -> Callable[..., Any]:
    """Return a function whose result does not raise when it is used."""
    return lambda *arguments: np.float64(function(*map(float, arguments)))


_IEEE: Mapping[str, Callable[..., Any]] = {
    **{name: _wide_result(each) for name, each in ELEMENTARY.items()},
    "sqrt": np.sqrt,
}
