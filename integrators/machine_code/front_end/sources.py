"""The texts of functions that are loaded, as syntax trees, and errors that name a line of them."""

from __future__ import annotations

import ast
import linecache
import types
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
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
class Source:
    """The text of a function.

    Parameters
    ----------
    function : callable
        The function.
    lines : list of str
        Of its file.
    definition : ast.FunctionDef
        Its tree.
    """

    function: Any
    lines: list[str]
    definition: ast.FunctionDef

    def error(self, reason: str, node: ast.AST) -> TranslationError:
        """Return an error at a node of the tree."""
        number = getattr(node, "lineno", self.definition.lineno)
        place = f"{self.function.__code__.co_filename}, line {number}, in {self.function.__name__}"
        return TranslationError(reason, place, self.lines[number - 1].strip())


@dataclass(frozen=True)
class _File:
    lines: list[str]
    definitions: Mapping[tuple[str, int], ast.FunctionDef]
    codes: Mapping[tuple[str, int], types.CodeType]


_files: dict[tuple[str, int], _File] = {}


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
    node, loaded = found.definitions.get(key), found.codes.get(key)
    if node is None or loaded is None or _meaning(loaded) != _meaning(code):
        reason = "its text is not there, or has changed since it was loaded"
        raise TranslationError(reason, code.co_filename, code.co_name)
    return Source(function, found.lines, node)


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
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef):
            yield node
        if not isinstance(node, ast.expr):
            yield from _functions_in(node)


def _file(code: types.CodeType, names: dict[str, Any]) -> _File:
    lines = linecache.getlines(code.co_filename, names)
    text = "".join(lines)
    key = code.co_filename, hash(text)
    if key not in _files:
        tree = ast.parse(text)
        definitions = {
            (node.name, min([node.lineno, *(each.lineno for each in node.decorator_list)])): node
            for node in _functions_in(tree)
        }
        codes, found = [compile(tree, code.co_filename, "exec", dont_inherit=True)], {}
        while codes:
            each = codes.pop()
            found[each.co_name, each.co_firstlineno] = each
            codes += [part for part in each.co_consts if isinstance(part, types.CodeType)]
        _files[key] = _File(lines, definitions, found)
    return _files[key]
