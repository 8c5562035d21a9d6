"""The loop's state has names: no constant stands for a place in an array."""

import ast
from pathlib import Path

import pytest

import integrators

ROOM = Path(integrators.__file__).parent
# `elementary` has tables of coefficients; the translator has no state of the loop.
LOOP = [
    path
    for path in sorted(ROOM.rglob("*.py"))
    if "machine_code" not in path.parts and path.stem not in ("elementary", "compiled", "quick")
]


def constants_as_places(text: str) -> list[str]:
    """Return the subscripts of a module whose place contains a name in capitals."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Subscript):
            parts = [*ast.walk(node.slice)]
            names = [each.id for each in parts if isinstance(each, ast.Name)]
            names += [each.attr for each in parts if isinstance(each, ast.Attribute)]
            if any(map(str.isupper, names)):
                found.append(ast.unparse(node))
    return found


@pytest.mark.parametrize("path", LOOP, ids=lambda path: path.stem)
def test_no_constant_is_an_index(path: Path) -> None:
    assert constants_as_places(path.read_text(encoding="utf-8")) == []


def test_the_loop_is_looked_at() -> None:
    assert {"loop", "advance", "crossings", "sliding"} <= {path.stem for path in LOOP}


@pytest.mark.parametrize(
    "text",
    ["clock[T]", "now.clock[steps.T] = 0.0", "counts[FIRST + PHASE]", "table[3 * most + SLOPE][0]"],
)
def test_such_indices_are_found(text: str) -> None:
    assert constants_as_places(text)
