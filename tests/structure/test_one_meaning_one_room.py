"""Claim: a class name has one meaning, a private module one room, and a folder at most 12 files."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

import pytest

from tests.helpers import ROOT

PACKAGES = ("gms_fsm", "integrators", "plots")
MOST = 12  # files in a folder


def _modules() -> dict[str, Path]:
    found = {}
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    assert len(found) > 300
    return found


@pytest.fixture(scope="module")
def trees() -> dict[str, ast.Module]:
    return {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in _modules().items()}


def test_no_class_name_stands_twice(trees: dict[str, ast.Module]) -> None:
    found = defaultdict(list)
    for name, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                found[node.name].append(name)
    assert {name: places for name, places in found.items() if len(places) > 1} == {}


def test_a_private_module_is_imported_in_its_own_room_only(trees: dict[str, ast.Module]) -> None:
    rooms = {name for name, path in _modules().items() if path.name == "__init__.py"}
    wrong = set()
    for name, tree in trees.items():
        here = name if name in rooms else name.rpartition(".")[0]
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                for each in node.names:
                    parts = f"{node.module}.{each.name}".split(".")
                    private = [i for i, part in enumerate(parts[:-1]) if part[0] == "_"]
                    if f"{node.module}.{each.name}" in trees and each.name[0] == "_":
                        private.append(len(parts) - 1)
                    room = ".".join(parts[: min(private)]) if private else ""
                    if room in rooms and not f"{here}.".startswith(f"{room}."):
                        wrong.add(f"{name} imports {node.module}.{each.name}")
    assert wrong == set()


def test_no_folder_has_more_than_12_files() -> None:
    found = {}
    for package in PACKAGES:
        for folder in (ROOT / package, *(ROOT / package).rglob("*/")):
            files = [each for each in folder.iterdir() if each.is_file()]
            if folder.name != "__pycache__" and len(files) > MOST:
                found[str(folder.relative_to(ROOT))] = len(files)
    assert found == {}
