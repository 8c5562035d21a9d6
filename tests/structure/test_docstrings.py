"""Claim: what the documentation shows has numpydoc docstrings, everything else one sentence.

The pages of `docs/api` name modules, classes and functions. Sections about parameters, returns and
errors are for these; elsewhere names and types say it, and a docstring adds what is not obvious.
"""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.helpers import ROOT

PACKAGES = ("gms_fsm", "integrators", "plots")
SECTION = re.compile(r"^ *(Parameters|Returns|Yields|Raises|Other Parameters)\n *---+$", re.M)
DIRECTIVE = re.compile(r"^\.\. auto(module|class|function):: ([\w.]+)$", re.M)

Place = tuple[Path, int]  # of a function: its file, and the line of its first decorator or `def`


def _object(name: str) -> Any:
    """Return the object of a dotted name."""
    module, rest = name, list[str]()
    while True:
        try:
            found: Any = importlib.import_module(module)
            break
        except ModuleNotFoundError:
            module, _, last = module.rpartition(".")
            rest.insert(0, last)
    for each in rest:
        found = getattr(found, each)
    return found


def _functions(shown: Any) -> Iterator[Any]:
    """Yield the functions behind a name: itself, or the public methods of a class."""
    if inspect.isclass(shown):
        for base in shown.__mro__:
            for name, each in vars(base).items():
                if not name.startswith("_"):
                    yield from _functions(each)
    elif isinstance(shown, property):
        yield from (each for each in (shown.fget, shown.fset) if each)
    elif isinstance(shown, functools.cached_property):
        yield shown.func
    elif isinstance(shown, classmethod | staticmethod):
        yield shown.__func__
    elif inspect.isroutine(shown) or hasattr(shown, "__wrapped__"):
        yield shown


def _shown_by(kind: str, name: str) -> Iterator[Any]:
    found = _object(name)
    if kind != "module":
        yield found
        return
    names = getattr(found, "__all__", None)
    yield from (
        each
        for key, each in ((n, getattr(found, n)) for n in names or vars(found))
        if names or (not key.startswith("_") and getattr(each, "__module__", "") == name)
    )


@functools.cache
def documented() -> frozenset[Place]:
    """Return the functions that the pages of `docs/api` show."""
    found = set()
    for page in sorted((ROOT / "docs" / "api").glob("*.rst")):
        for kind, name in DIRECTIVE.findall(page.read_text(encoding="utf-8")):
            for shown in _shown_by(kind, name):
                for function in _functions(shown):
                    code = getattr(inspect.unwrap(function), "__code__", None)
                    if code is not None and str(ROOT) in code.co_filename:
                        found.add((Path(code.co_filename), code.co_firstlineno))
    return frozenset(found)


def functions(path: Path) -> Iterator[tuple[Place, ast.FunctionDef | ast.AsyncFunctionDef]]:
    """Yield the functions of a module that have docstrings, and where they are."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and ast.get_docstring(node):
            first = min([node.lineno, *(each.lineno for each in node.decorator_list)])
            yield (path, first), node


def _modules() -> list[Path]:
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


@pytest.fixture(scope="module")
def with_sections() -> set[Place]:
    return {
        place
        for path in _modules()
        for place, node in functions(path)
        if SECTION.search(ast.get_docstring(node) or "")
    }


def test_what_is_not_documented_has_no_sections(with_sections: set[Place]) -> None:
    pytest.importorskip("matplotlib", reason="imports every documented module (extra: dev)")
    assert len(with_sections) > 300
    assert {
        f"{path.relative_to(ROOT)}:{line}" for path, line in with_sections - documented()
    } == set()


def test_the_public_functions_have_sections(with_sections: set[Place]) -> None:
    pytest.importorskip("matplotlib", reason="imports every documented module (extra: dev)")
    lacking = set()
    for module in ("gms_fsm", "plots", "integrators"):
        found = importlib.import_module(module)
        for name in found.__all__:
            shown = inspect.unwrap(getattr(found, name))
            code = getattr(shown, "__code__", None)
            if code and (Path(code.co_filename), code.co_firstlineno) not in with_sections:
                lacking.add(f"{module}.{name}")
    assert lacking == set()
