"""Claim: behind the door, and outside the readers of files, nothing asks whether it is a system.

A user gives a model on a rig, or a system; `gms_fsm.systems.mounted` makes one thing of both, and
its fields say what differs between them. Classes that are given to a table of functions by kind
(`functools.singledispatch`) are not asked.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

import pytest

from tests.helpers import ROOT

DOOR = "gms_fsm/systems/mounted.py"
MARKS = {"System", "Mounting", "Several"}  # a run that has one of these was given a system
ASKING = {"isinstance", "issubclass", "type"}


def asked(text: str) -> Iterator[int]:
    """Yield the lines of a module that ask whether something is a system."""
    for node in ast.walk(ast.parse(text)):
        named: list[ast.expr] = []
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ASKING:
            named = [*node.args]
        elif isinstance(node, ast.Compare):
            named = [node.left, *node.comparators]
        elif isinstance(node, ast.MatchClass):
            named = [node.cls]
        names = (part for one in named for part in ast.walk(one))
        if any(getattr(part, "id", getattr(part, "attr", "")) in MARKS for part in names):
            yield named[0].lineno


@pytest.mark.parametrize(
    "text",
    [
        "isinstance(model, System)",
        "isinstance(model, Chart | systems.System)",
        "type(model) is System",
        "x = 1 if isinstance(trace.model, (Chart, Several)) else 2",
        "match model:\n    case System(name=name):\n        pass",
    ],
)
def test_a_question_is_found(text: str) -> None:
    assert [*asked(text)]


def test_nothing_asks_behind_the_door() -> None:
    found = [
        f"{path.relative_to(ROOT).as_posix()}:{line}"
        for package in ("gms_fsm", "plots")
        for path in sorted((ROOT / package).rglob("*.py"))
        if not path.is_relative_to(ROOT / "gms_fsm" / "exporters")  # a room with a door of its own
        for line in asked(path.read_text(encoding="utf-8"))
    ]
    assert {each.partition(":")[0] for each in found} == {DOOR}, found
    assert len(found) == 3
