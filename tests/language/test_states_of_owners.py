"""``gear.state(2) == slip`` names an element of an owner; elements are counted over all owners."""

from __future__ import annotations

import pytest

from gms_fsm.errors import ExpressionError
from gms_fsm.language import InState, Not, parse_condition, spell
from gms_fsm.language._read import Owner

OWNERS = {"pad": Owner(0, 2, ("stick", "slip")), "gear": Owner(2, 1, ("free", "left"))}
NAMES = ["gear.F", "v"]


@pytest.mark.parametrize(
    ("text", "tree"),
    [
        ("pad.state(1) == stick", InState(1, "stick")),
        ("pad.state(2) == slip", InState(2, "slip")),
        ("gear.state(1) == left", InState(3, "left")),
        ("gear.state == left", InState(3, "left")),
        ("gear.state != free", Not(InState(3, "free"))),
    ],
)
def test_an_element_is_found(text: str, tree: object) -> None:
    assert parse_condition(text, NAMES, owners=OWNERS) == tree


def test_dotted_names_are_values() -> None:
    found = parse_condition("gear.F > 1 and pad.state(1) == slip", NAMES, owners=OWNERS)
    assert spell(found) == "gear.F > 1.0 and state(1) == slip"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("pad.state == slip", r"pad\.state needs a number.*pad\.state\(1\)"),
        ("pad.state(0) == slip", r"pad\.state\(...\) takes an .*pad\.state\(1\) to pad\.st"),
        ("pad.state(3) == slip", r"takes an element number"),
        ("gear.state(2) == left", r"gear\.state\(1\) to gear\.state\(1\)"),
        ("gear.state == slip", "unknown state"),
        ("rope.state == slip", "only < <= > >= compare floats"),
        ("state(1) == slip", r"state needs its owner.*pad\.state\(1\)"),
        ("state == slip", r"state needs its owner"),
    ],
)
def test_anything_else_says_what_is_wrong(text: str, said: str) -> None:
    with pytest.raises(ExpressionError, match=f"(?s){said}"):
        parse_condition(text, NAMES, owners=OWNERS)


def test_without_owners_there_are_no_elements() -> None:
    for text in ("state(1) == slip", "state == slip"):
        with pytest.raises(ExpressionError):
            parse_condition(text, ["v"], ["slip"])
