"""The loop's state has names: no constant stands for a place in an array."""

import ast
from pathlib import Path

import pytest

import integrators

ROOM = Path(integrators.__file__).parent
LOOP = (
    "loop", "advance", "crossings", "sliding", "seizing", "jolts", "observing", "columns",
    "stepping", "exchange", "steps", "step_size", "hybrid", "states", "failures", "scipy_arcs",
)  # fmt: skip


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


@pytest.mark.parametrize("name", LOOP)
def test_no_constant_is_an_index(name: str) -> None:
    assert constants_as_places((ROOM / f"{name}.py").read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "text",
    ["clock[T]", "now.clock[steps.T] = 0.0", "counts[FIRST + PHASE]", "table[3 * most + SLOPE][0]"],
)
def test_such_indices_are_found(text: str) -> None:
    assert constants_as_places(text)
