"""`fold` passes each node to the operation for its kind, and folds a part only when requested."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from gms_fsm.language import (
    Binary,
    Both,
    Call,
    Either,
    InState,
    Name,
    Negative,
    Node,
    Not,
    Number,
    Relation,
    evaluate,
    fold,
    parse_condition,
    parse_value,
)


class _Same:
    """Rebuilds every node from its parts, and records the operation used."""

    def __init__(self) -> None:
        self.called: list[str] = []

    def number(self, value: float) -> Node:
        self.called.append("number")
        return Number(value)

    def name(self, name: str) -> Node:
        self.called.append("name")
        return Name(name)

    def in_state(self, element: int, state: str) -> Node:
        self.called.append("in_state")
        return InState(element, state)

    def __getattr__(self, operation: str) -> Any:
        def again(node: Any, parts: Iterator[Any]) -> Node:
            taken = tuple(parts)
            self.called.append(operation)
            match node:
                case Binary(op) | Relation(op):
                    return type(node)(op, *taken)
                case Call(function):
                    return Call(function, taken)
                case Negative() | Not():
                    return type(node)(*taken)
            return type(node)(taken)

        return again


def test_each_kind_of_node_has_its_operation_and_parts_precede_nodes() -> None:
    text = "not -a**2 > b * 3 and (state(1) == slip or max(a, b) > c)"
    tree = parse_condition(text, "abc", ["slip"], 1)
    algebra = _Same()
    assert fold(tree, algebra) == tree
    assert algebra.called == [
        *("name", "number", "power", "negative", "name", "number", "binary", "relation"),
        "negation",
        *("in_state", "name", "name", "call", "name", "relation"),
        *("either", "both"),
    ]


@pytest.mark.parametrize("kind", [Both, Either])
def test_parts_that_an_operation_does_not_request_are_not_folded(kind: type[Both | Either]) -> None:
    class First(_Same):
        def _first(self, node: Node, parts: Iterator[Any]) -> Any:
            return next(parts)

        both = either = _first

    sides = tuple(parse_condition(text, "ab") for text in ("a > 0", "b > 0"))
    algebra = First()
    assert fold(kind(sides), algebra) == sides[0]
    assert algebra.called == ["name", "number", "relation"]


def test_and_and_or_short_circuit_as_in_python() -> None:
    point = {"v": 1.0, "z": 0.0}
    for text, truth in (("v > 0 or 1 / z > 1", True), ("v < 0 and 1 / z > 1", False)):
        assert evaluate(parse_condition(text, "vz"), point) is truth
    for text in ("v < 0 or 1 / z > 1", "v > 0 and 1 / z > 1"):
        with pytest.raises(ZeroDivisionError):
            evaluate(parse_condition(text, "vz"), point)


def test_the_base_of_a_zeroth_power_is_not_computed() -> None:
    assert evaluate(parse_value("(1 / z)**0", "z"), {"z": 0.0}) == 1.0
