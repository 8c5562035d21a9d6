"""The loop's state has names: no constant stands for a place in an array."""

import ast
from pathlib import Path

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


def test_no_constant_is_an_index() -> None:
    assert {"loop", "advance", "crossings", "sliding"} <= {path.stem for path in LOOP}
    for path in LOOP:
        assert constants_as_places(path.read_text(encoding="utf-8")) == [], path
    for text in ("clock[T]", "now.clock[steps.T] = 0.0", "table[3 * most + SLOPE][0]"):
        assert constants_as_places(text)
