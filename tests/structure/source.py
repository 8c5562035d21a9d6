"""The modules of the packages, read and parsed once; checks of the structure walk over them."""

from __future__ import annotations

import ast
import functools
import gc
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from tests.helpers import ROOT

PACKAGES = ("gms_fsm", "integrators", "plots")


class Source(NamedTuple):
    """A module: its dotted name, its path from the root, its text and its syntax tree."""

    name: str
    path: str
    text: str
    tree: ast.Module

    @classmethod
    def of(cls, text: str, path: str = "gms_fsm/example.py") -> Source:
        """Return a module of a text."""
        return cls(_name(path), path, text, ast.parse(text))

    @property
    def nodes(self) -> tuple[ast.AST, ...]:
        """All nodes of its tree."""
        return _nodes(self.tree)

    @property
    def is_package(self) -> bool:
        """Whether it is the module of a folder."""
        return self.path.endswith("/__init__.py")


@functools.cache
def _nodes(tree: ast.Module) -> tuple[ast.AST, ...]:
    return tuple(ast.walk(tree))


def _name(path: str) -> str:
    parts = Path(path).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@functools.cache
def sources() -> Mapping[str, Source]:
    """Return all modules by name."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    gc.disable()  # half a million nodes that live to the end
    try:
        found = [
            Source.of(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix())
            for path in paths
        ]
    finally:
        gc.freeze()
        gc.enable()
    assert len(found) > 300
    return {each.name: each for each in found}
