"""The texts of functions that are loaded, as syntax trees, and errors that name a line of them."""

from __future__ import annotations

import ast
import functools
import linecache
import types
import weakref
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from dataclasses import dataclass, field
from typing import Any


class TranslationError(Exception):
    """A line that cannot be translated.

    Parameters
    ----------
    reason : str
        What is not possible.
    place : str
        The file and the line.
    line : str
        The text of the line.
    """

    def __init__(self, reason: str, place: str, line: str) -> None:
        super().__init__(f"{place}: {reason}: {line}")
        self.reason = reason
        self.place = place
        self.line = line


@dataclass(frozen=True)
class NamesUsed:
    """What a text does with its names."""

    assigned: Counter[str]  # how often
    changed: set[str]  # variables of loops that are assigned inside them
    read_after: set[str]  # read outside the loops over them
    only_indexed: set[str]  # nothing but entries is used, none counted from the end


def names_of(definition: ast.AST) -> NamesUsed:
    """Return what a text does with its names, which nobody changes.

    Examples
    --------
    >>> names_of(ast.parse("for i in range(3): x[i] = len(y)")).only_indexed
    {'x'}
    """
    used = NamesUsed(Counter(), set(), set(), set())
    whole = set[str]()
    nothing: frozenset[str] = frozenset()
    waiting: list[tuple[Any, frozenset[str]]] = [(definition, nothing)]
    while waiting:
        node, loops = waiting.pop()
        kind = type(node)
        if kind is ast.Name:
            whole.add(node.id)
            if type(node.ctx) is ast.Store:
                used.assigned[node.id] += 1
                if node.id in loops:
                    used.changed.add(node.id)
            elif node.id not in loops:
                used.read_after.add(node.id)
        elif kind is ast.For:
            inside = loops | {node.target.id} if type(node.target) is ast.Name else loops
            waiting += [(node.iter, loops), (node.target, loops)]
            waiting += [(each, inside) for each in node.body]
        elif kind is ast.Subscript and type(node.value) is ast.Name and _is_place(node.slice):
            used.only_indexed.add(node.value.id)
            if node.value.id not in loops:
                used.read_after.add(node.value.id)
            waiting.append((node.slice, loops))
        elif kind is not ast.Constant:
            for name in node._fields:
                part = getattr(node, name, None)
                if type(part) is list:
                    waiting += [(each, loops) for each in part]
                elif isinstance(part, ast.stmt | ast.expr):
                    waiting.append((part, loops))
    used.only_indexed.difference_update(whole)
    return used


def _is_place(node: ast.expr) -> bool:
    """Return whether an index is one place, which is not counted from the end."""
    return not isinstance(node, ast.Slice | ast.UnaryOp)


@dataclass(frozen=True)
class Source:
    """The text of a function."""

    function: Any
    file: _File
    definition: ast.FunctionDef

    @functools.cached_property
    def parameters(self) -> list[str]:
        """The names of its parameters."""
        return [each.arg for each in self.definition.args.args]

    @property
    def names(self) -> NamesUsed:
        """What it does with its names."""
        return self.names_in(self.definition)

    def names_in(self, part: ast.AST) -> NamesUsed:
        """Return what a part of it does with its names."""
        known = self.file.names
        if (found := known.get(part)) is None:
            known[part] = found = names_of(part)
        return found

    def error(self, reason: str, node: ast.AST) -> TranslationError:
        """Return an error at a node of the tree."""
        number = getattr(node, "lineno", self.definition.lineno)
        place = f"{self.function.__code__.co_filename}, line {number}, in {self.function.__name__}"
        return TranslationError(reason, place, self.file.lines[number - 1].strip())


@dataclass(frozen=True, eq=False)
class _File:
    lines: list[str]
    definitions: Mapping[tuple[str, int], ast.FunctionDef]
    codes: Mapping[tuple[str, int], types.CodeType] | None  # None if it is in no file
    # Of its parts: a text is translated for each system, and most of them alike.
    names: dict[ast.AST, NamesUsed] = field(default_factory=dict)

    def is_of(self, code: types.CodeType) -> bool:
        """Return whether a function was made from this text, which a file may no longer have."""
        if self.codes is None:
            return True
        own = self.codes.get((code.co_name, code.co_firstlineno))
        return own is not None and _meaning(own) == _meaning(code)


# Trees of long texts, those of many bodies, stay only while they are translated: a search for
# garbage walks through all that stay, and that takes longer than to read the text again.
_files: MutableMapping[tuple[str, int], _File] = {}
_long_files: MutableMapping[tuple[str, int], _File] = weakref.WeakValueDictionary()
LONG = 200_000  # characters


def source_of(function: Callable[..., Any]) -> Source:
    """Return the text of a function.

    Examples
    --------
    >>> from integrators.step_size import next_factor
    >>> source_of(next_factor).definition.name
    'next_factor'
    """
    code = function.__code__
    found = _file(code, function.__globals__)
    key = code.co_name, code.co_firstlineno
    node = found.definitions.get(key)
    if node is None or not found.is_of(code):
        reason = "its text is not there, or has changed since it was loaded"
        raise TranslationError(reason, code.co_filename, code.co_name)
    return Source(function, found, node)


def _meaning(code: types.CodeType) -> list[Any]:
    """Return what a function does, without its place in a file and the functions inside it."""
    constants = [
        (type(each), each if isinstance(each, frozenset) else repr(each))
        for each in code.co_consts
        if not isinstance(each, types.CodeType)
    ]
    return [code.co_code, code.co_names, code.co_varnames, constants]


def _functions_in(tree: ast.AST) -> Iterator[ast.FunctionDef]:
    """Yield the functions of a text, those inside other statements too."""
    for name in ("body", "orelse", "handlers", "finalbody", "cases"):
        for node in getattr(tree, name, ()):
            if isinstance(node, ast.FunctionDef):
                yield node
            yield from _functions_in(node)


def _file(code: types.CodeType, names: dict[str, Any]) -> _File:
    lines = linecache.getlines(code.co_filename, names)
    text = "".join(lines)
    key = code.co_filename, hash(text)
    files = _files if len(text) < LONG else _long_files
    found = files.get(key)
    if found is None:
        tree = ast.parse(text)
        definitions = {
            (node.name, min([node.lineno, *(each.lineno for each in node.decorator_list)])): node
            for node in _functions_in(tree)
        }
        given = linecache.cache.get(code.co_filename)
        in_file = given is None or len(given) == 1 or given[1] is not None
        codes = _codes(tree, code.co_filename) if in_file else None
        files[key] = found = _File(lines, definitions, codes)
    return found


def _codes(tree: ast.Module, filename: str) -> dict[tuple[str, int], types.CodeType]:
    """Return what the functions of a text are compiled to, by name and first line."""
    codes, found = [compile(tree, filename, "exec", dont_inherit=True)], {}
    while codes:
        each = codes.pop()
        found[each.co_name, each.co_firstlineno] = each
        codes += [part for part in each.co_consts if isinstance(part, types.CodeType)]
    return found
