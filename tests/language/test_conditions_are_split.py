"""A condition is split into its comparisons, and a value's corners are separated from it."""

from __future__ import annotations

from typing import Any

from gms_fsm.language import (
    Requirement,
    parse_condition,
    parse_value,
    rough_points,
    spell,
    split,
    substitute,
)


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
