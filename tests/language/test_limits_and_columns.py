"""The limits of a text are exact, and an error points at the column in the text as written."""

from __future__ import annotations

from typing import Any

import pytest

from gms_fsm.errors import ExpressionError
from gms_fsm.language import InState, Name, Not, evaluate, parse_condition, parse_value, spell


def _refused(text: str, *names: str, **states: Any) -> ExpressionError:
    read = parse_condition if states else parse_value
    with pytest.raises(ExpressionError) as caught:
        read(text, names, **states)
    return caught.value


def test_the_longest_text_has_ten_thousand_characters() -> None:
    assert parse_value("v" + " " * 9_999, "v") == Name("v")
    assert _refused("v" + " " * 10_000, "v").column == 10_001


def test_the_deepest_tree_has_sixty_levels() -> None:
    assert parse_value("-" * 59 + "v", "v")
    assert "nested" in str(_refused("-" * 60 + "v", "v"))
    deep = _refused("-" * 9_000 + "v", "v")  # too deep even for Python
    assert ("nested" in deep.reason, deep.column) == (True, 1)
    assert parse_condition("not " * 58 + "v > 1", "v")
    with pytest.raises(ExpressionError, match="nested"):
        parse_condition("not " * 59 + "v > 1", "v")


def test_min_takes_fifty_arguments_folded_from_the_left_as_deep_as_any_tree_may_be() -> None:
    assert spell(parse_value("min(a, b, c, d)", "abcd")) == "min(min(min(a, b), c), d)"
    assert parse_value("max(" + "v, " * 49 + "v)", "v")
    assert "at most 50" in str(_refused("max(" + "v, " * 50 + "v)", "v"))
    assert parse_value("-" * 10 + "max(" + "v, " * 49 + "v)", "v")  # 10 + 1 + 48 + 1 levels
    assert "nested" in str(_refused("-" * 11 + "max(" + "v, " * 49 + "v)", "v"))
    for several in (2, 3, 4, 5, 6):  # a fold may skip the deepest level, and is still detected
        nested = "v"
        for _ in range(59 // (several - 1)):
            nested = f"min({nested}{', v' * (several - 1)})"
        assert parse_value(nested, "v")
        over = f"min({nested}{', v' * (several - 1)})"
        assert "nested" in str(_refused(over, "v"))
    # The last argument is at the top of the fold, the first two at its bottom.
    assert parse_value("max(" + "v, " * 49 + "-" * 58 + "v)", "v")
    assert "nested" in str(_refused("max(" + "v, " * 49 + "-" * 59 + "v)", "v"))
    assert parse_value("max(v, " + "-" * 10 + "v, " + "v, " * 47 + "v)", "v")
    assert "nested" in str(_refused("max(v, " + "-" * 11 + "v, " + "v, " * 47 + "v)", "v"))


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("w", 1),
        ("  w", 3),
        ("v + w", 5),
        ("\u03bc + w", 5),
        ("  \u03bc*\u03bc + w", 9),
        ("v +", 4),
        ("  v + ", 7),
        ("  v )", 5),
        ("v # w", 3),
        ("", 1),
        ("   ", 1),
        ("v\n+ w", 5),
        ("v + \ud800", 5),
    ],
)
def test_the_column_is_counted_in_characters_of_the_text_as_written(text: str, column: int) -> None:
    assert _refused(text, "v", "\u03bc").column == column


def test_a_text_has_a_hundred_comparisons_at_most() -> None:
    assert parse_condition(" and ".join(["v > 0"] * 100), "v")
    with pytest.raises(ExpressionError, match="too many comparisons"):
        parse_condition(" and ".join(["v > 0"] * 101), "v")


def test_pow_takes_two_arguments() -> None:
    assert parse_value("pow(a, b)", "ab") == parse_value("a**b", "ab")
    for arguments in ("", "a", "a, b, a"):
        assert "two arguments" in str(_refused(f"pow({arguments})", "a", "b"))


def test_which_marks_cannot_be_read() -> None:
    assert "half a character" in str(_refused("v + \ud800", "v"))
    assert "half a character" in str(_refused("v + \udfff", "v"))
    assert "half a character" not in str(_refused("v + \ue000", "v"))
    assert "half a character" not in str(_refused("v + \ud7ff", "v"))
    assert "unexpected ';'" in str(_refused("v;", "v"))


def test_states_are_referred_to_by_number_from_one_and_by_equality() -> None:
    known: dict[str, Any] = {"states": ["slip"], "elements": 2}
    assert parse_condition("state(1) == slip", "v", **known) == InState(1, "slip")
    assert parse_condition("state(2) != slip", "v", **known) == Not(InState(2, "slip"))
    for number in ("0", "3", "1.0", "True"):
        _refused(f"state({number}) == slip", "v", **known)
    for wrong in ("state(1) > slip", "state(1) == fly", "state == slip"):
        _refused(wrong, "v", **known)
    _refused("state(1) == slip", "v", states=())
    asked = {"state(1)": "slip", "state(2)": "stick"}
    assert evaluate(InState(1, "slip"), asked) is True
    assert evaluate(InState(2, "slip"), asked) is False
    assert evaluate(InState(1, "slip"), {"state(1)": "arrested"}) is False
