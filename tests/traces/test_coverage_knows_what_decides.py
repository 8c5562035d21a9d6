"""MC/DC: a comparison is shown if it decided the guard alone, once while true and once while false.

Checked against a truth table, for random guards and random sets of rows of it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gms_fsm.language import Relation, parse_condition
from gms_fsm.traces.coverage.decisions import Decision

NAMES = "abcd"
Table = Callable[[tuple[bool, ...]], bool]


def decision(text: str) -> Decision:
    return Decision.of(parse_condition(text, NAMES))


def vectors(number: int) -> list[str]:
    return ["".join(each) for each in itertools.product("01", repeat=number)]


@st.composite
def guards(draw: st.DrawFn, depth: int = 3) -> str:
    if depth == 0 or draw(st.booleans()):
        return f"{draw(st.sampled_from(NAMES))} > 0"
    joined = draw(st.sampled_from([" and ", " or "]))
    parts = draw(st.lists(guards(depth - 1), min_size=2, max_size=3))
    text = joined.join(f"({each})" for each in parts)
    return f"not ({text})" if draw(st.booleans()) else text


def values_of(found: Decision, vector: str) -> dict[str, bool]:
    """Return the truth of each name."""
    names = [str(getattr(each.left, "id", "")) for each in found.comparisons]
    return {name: truth == "1" for name, truth in zip(names, vector, strict=True)}


def python(text: str, values: dict[str, bool]) -> bool:
    """Let Python decide: a name is 1 or -1."""
    return bool(eval(text, {}, {name: 1 if truth else -1 for name, truth in values.items()}))


@settings(deadline=None)
@given(text=guards(), data=st.data())
def test_shown_is_what_pairs_of_the_truth_table_show(text: str, data: st.DataObject) -> None:
    found = decision(text)
    names = [*values_of(found, "0" * len(found.comparisons))]
    seen = data.draw(st.sets(st.sampled_from(vectors(len(names)))))
    for number, name in enumerate(names):
        sides = []
        for side in (True, False):
            rows = (values_of(found, vector) for vector in seen)
            sides.append(
                any(
                    python(text, row) != python(text, {**row, name: not row[name]})
                    for row in rows
                    if row[name] == side
                )
            )
        assert found.shown(seen, number) == tuple(sides)
    for vector in seen:
        assert found.holds(vector) == python(text, values_of(found, vector))


@pytest.mark.parametrize("number", [1, 2, 3, 4])
@pytest.mark.parametrize(("word", "all_"), [("and", "1"), ("or", "0")])
def test_a_conjunction_needs_all_true_and_each_alone_false(
    number: int, word: str, all_: str
) -> None:
    """For `or` it is the other way round."""
    found = decision(f" {word} ".join(f"{name} > 0" for name in NAMES[:number]))
    alone = "0" if all_ == "1" else "1"
    needed = [all_ * number]
    needed += [all_ * i + alone + all_ * (number - i - 1) for i in range(number)]
    each = range(number)
    assert all(found.shown(needed, i) == (True, True) for i in each)
    for left_out in range(len(needed)):
        fewer = needed[:left_out] + needed[left_out + 1 :]
        assert not all(found.shown(fewer, i) == (True, True) for i in each)


def test_a_comparison_that_occurs_twice_is_one() -> None:
    found = decision("(a > 0 and b > 0) or (a > 0 and c > 0)")
    assert [each for each in found.comparisons if isinstance(each, Relation)]
    assert len(found.comparisons) == 3
    assert found.shown(vectors(3), 0) == (True, True)


def test_a_guard_that_is_always_true_asks_for_nothing() -> None:
    found = decision("True")
    assert found.comparisons == ()
    assert found.holds("")
