"""Every reader takes a tree through `fold` or `split`; none can change what another one uses."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gms_fsm.language import (
    MATLAB_LIKE,
    Binary,
    Both,
    Call,
    Comparison,
    Either,
    InState,
    Name,
    Negative,
    Node,
    Not,
    Number,
    Relation,
    Requirement,
    clauses,
    evaluate,
    fold,
    parse_condition,
    parse_value,
    rough_points,
    spell,
    split,
    states_in,
    substitute,
)
from gms_fsm.language._vectors import truths, values_of
from gms_fsm.language.normal import renamed_in
from gms_fsm.language.tree import walk


def test_a_tree_and_its_spelling_cannot_be_changed() -> None:
    text = "not -a > b * 2 and (state(1) == slip or max(a, b) > c)"
    parts = list(walk(parse_condition(text, "abc", ["slip"], 1)))
    assert len({type(part) for part in parts}) == 10
    comparison = split(parse_condition("a > b", "abc"))
    assert isinstance(comparison, Requirement)
    for part in (*parts, MATLAB_LIKE, comparison, comparison.comparison):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(part, dataclasses.fields(part)[0].name, None)


# --------------------------------------------------------------------------- fold
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


# --------------------------------------------------------------------------- split
def _requirements(text: str, holds: bool = True) -> Any:
    def told(part: Any) -> Any:
        if isinstance(part, Requirement):
            return spell(part.relation)
        return (part[0], *(told(p) for p in part[1]))

    return told(split(parse_condition(text, "abc"), holds))


def test_splitting_handles_both_directions_of_every_comparison() -> None:
    for op, not_op in ((">", "<="), (">=", "<"), ("<", ">="), ("<=", ">")):
        assert _requirements(f"a {op} b") == f"a {op} b"
        assert _requirements(f"a {op} b", holds=False) == f"a {not_op} b"
        assert _requirements(f"not a {op} b") == f"a {not_op} b"
        mirrored = op.translate(str.maketrans("<>", "><"))
        word = "both" if op[0] == "<" else "either"
        assert _requirements(f"abs(a) {op} b") == (word, f"a {op} b", f"a {mirrored} -b")
        assert _requirements(f"b {mirrored} abs(a)") == (word, f"a {op} b", f"a {mirrored} -b")
        assert _requirements(f"abs(abs(a)) {op} b") == _requirements(f"abs(a) {op} b")


def test_splitting_flattens_nesting_and_swaps_words_under_negation() -> None:
    text = "a > b and (b > c and (c > a or abs(a) > c))"
    assert _requirements(text) == ("both", "a > b", "b > c", ("either", "c > a", "a > c", "a < -c"))
    turned = ("either", "a <= b", "b <= c", ("both", "c <= a", "a <= c", "a >= -c"))
    assert _requirements(text, holds=False) == turned
    assert _requirements(f"not ({text})") == turned


def test_a_corner_against_zero_turns_where_the_other_side_does() -> None:
    for text, turning in (("max(a, 0)", "a"), ("min(a, 1)", "a - 1.0"), ("max(a, -1)", "a - -1.0")):
        assert [spell(u) for u in rough_points(parse_value(text, "a"))] == [turning]


def test_a_relation_and_its_opposite_share_one_comparison() -> None:
    less = Comparison(Name("a"), Name("b"), strict=False)
    assert split(parse_condition("a < b", "ab")) == Requirement(less, holds=False)
    assert split(parse_condition("a >= b", "ab")) == Requirement(less, holds=True)
    assert split(parse_condition("not a < b", "ab")) == Requirement(less, holds=True)
    more = Comparison(Name("a"), Name("b"), strict=True)
    assert split(parse_condition("a > b", "ab")) == Requirement(more, holds=True)
    assert split(parse_condition("a <= b", "ab")) == Requirement(more, holds=False)


def test_a_chain_reads_as_its_links() -> None:
    chain = parse_condition("a < b <= c > 0", "abc")
    assert [spell(part) for part in clauses(chain)] == ["a < b", "b <= c", "c > 0.0"]
    assert _requirements("a < b < c") == ("both", "a < b", "b < c")


def test_rough_calls_become_names_in_the_order_they_are_computed_and_smooth_ones_stay() -> None:
    flow = parse_value("C * sgn(v) - max(v, -exp(abs(z)))", ["C", "v", "z"])
    names = dict(zip(rough_points(flow), "abc", strict=True))
    assert [spell(u) for u in names] == ["v", "z", "v - -exp(abs(z))"]
    smooth, calls = substitute(flow, lambda u, call: f"{call.function}_{names[u]}")
    assert spell(smooth) == "C * sgn_a - max_c"
    assert [(name, spell(call)) for name, call in calls.items()] == [
        ("sgn_a", "sgn(v)"),
        ("abs_b", "abs(z)"),
        ("max_c", "max(v, -exp(abs_b))"),
    ]


# --------------------------------------------------------------------------- states
def test_states_are_compared_by_name() -> None:
    states = np.array([["stick", "slip"], ["slip", "slip"]])
    columns = {"state(0)": states, "state(1)": states[:, :1]}
    own = parse_condition("state == slip", [], ["stick", "slip"], 2, own_state=True)
    first = parse_condition("state(1) != slip", [], ["stick", "slip"], 2, own_state=True)
    assert truths(own, columns, (2, 2)).tolist() == [[False, True], [True, True]]
    assert truths(first, columns, (2, 2)).tolist() == [[True, True], [False, False]]
    assert (own, first) == (InState(0, "slip"), Not(InState(1, "slip")))
    assert renamed_in(first, {"v": Number(0.0)}) == first
    with pytest.raises(TypeError, match="on values, not on states"):
        split(own)
    assert (states_in(own), states_in(first)) == ({0}, {1})
    asked = {"state(1)": "slip", "state(2)": "stick"}
    assert evaluate(InState(1, "slip"), asked) is True
    assert evaluate(InState(2, "slip"), asked) is False
    assert evaluate(InState(1, "slip"), {"state(1)": "arrested"}) is False


def test_an_empty_condition_and_a_zeroth_power_are_constants() -> None:
    assert truths(Both(()), {}, (2,)).tolist() == [True, True]
    assert values_of(parse_value("z**0", ["z"]), {"z": [0.0, 2.0]}).tolist() == [1.0, 1.0]
