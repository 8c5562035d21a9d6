"""A tree evaluates bit for bit to what Python computes from its printed text.

`evaluate(tree)` equals Python's own value of ``spell(tree, PYTHON)`` to the last bit, including
which error is raised; printing, parsing and printing again changes nothing; and `split` agrees with
the condition it splits, also on the boundary.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from gms_fsm.errors import ExpressionError
from gms_fsm.language import (
    MATLAB_LIKE,
    NAMESPACE,
    PYTHON,
    Binary,
    Both,
    Call,
    Comparison,
    Condition,
    Either,
    Name,
    Negative,
    Node,
    Not,
    Number,
    Relation,
    Requirement,
    Split,
    Value,
    clauses,
    evaluate,
    names_in,
    parse_condition,
    parse_value,
    sgn,
    spell,
    split,
)

NAMES = ("a", "b", "c")

# --------------------------------------------------------------------------- random trees
numbers = st.floats(min_value=0.0, allow_nan=False, allow_infinity=False).map(Number)
simple_numbers = st.sampled_from([0.0, 0.5, 1.0, 2.0, 3.0, 1e-3, 1 / 3, 1e16, 5e-324]).map(Number)
leaves = st.one_of(st.sampled_from(NAMES).map(Name), simple_numbers, numbers)
ONE_ARGUMENT = ("abs", "exp", "log", "sqrt", "sgn", "sin", "cos", "tanh", "atan", "asinh")


def _power(base: Value, whole: int) -> Value:
    exponent: Value = Number(float(abs(whole)))
    return Binary("**", base, exponent if whole >= 0 else Negative(exponent))


def _grow(inner: st.SearchStrategy[Value]) -> st.SearchStrategy[Value]:
    return st.one_of(
        inner.map(Negative),
        st.builds(Binary, st.sampled_from("+-*/"), inner, inner),
        st.builds(_power, inner, st.sampled_from([-2, 2, 3])),
        st.builds(lambda f, u: Call(f, (u,)), st.sampled_from(ONE_ARGUMENT), inner),
        st.builds(lambda f, u, w: Call(f, (u, w)), st.sampled_from(["min", "max"]), inner, inner),
    )


values_ = st.recursive(
    st.one_of(leaves, st.builds(_power, leaves, st.integers(-8, 8).filter(lambda n: abs(n) > 1))),
    _grow,
    max_leaves=8,
)
any_values = st.one_of(
    values_,
    st.builds(lambda u, w: Binary("**", u, w), values_, values_),
    st.builds(lambda u, w, x: Binary("*", Binary("**", u, w), x), values_, leaves, values_),
)
relations = st.builds(Relation, st.sampled_from(["<", "<=", ">", ">="]), values_, values_)


def _join(inner: st.SearchStrategy[Condition]) -> st.SearchStrategy[Condition]:
    several = st.lists(inner, min_size=2, max_size=3).map(tuple)
    return st.one_of(inner.map(Not), several.map(Both), several.map(Either))


conditions = st.recursive(relations, _join, max_leaves=5)
reals = st.one_of(
    st.sampled_from([-2.0, -1.0, -0.5, -0.0, 0.0, 0.5, 1.0, 2.0]),
    st.floats(allow_nan=False, allow_infinity=False),
)
points = st.fixed_dictionaries(dict.fromkeys(NAMES, reals))


def _bits(result: float | bool) -> str:
    if isinstance(result, bool):
        return str(result)
    return "nan" if math.isnan(result) else struct.pack(">d", result).hex()


def _outcome_of_tree(node: Node, point: Mapping[str, float]) -> str:
    try:
        return _bits(evaluate(node, point))
    except (ArithmeticError, ValueError) as error:
        return type(error).__name__


def _outcome_of_text(text: str, point: Mapping[str, float]) -> str:
    try:
        return _bits(eval(text, {"__builtins__": {}, **NAMESPACE}, dict(point)))
    except (ArithmeticError, ValueError) as error:
        return type(error).__name__


# --------------------------------------------------------------------------- evaluate
@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(any_values, points)
def test_a_value_equals_what_python_computes_from_its_text(
    tree: Value, point: dict[str, float]
) -> None:
    assert _outcome_of_tree(tree, point) == _outcome_of_text(spell(tree, PYTHON), point)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(conditions, points)
def test_a_condition_equals_what_python_decides_from_its_text(
    tree: Condition, point: dict[str, float]
) -> None:
    assert _outcome_of_tree(tree, point) == _outcome_of_text(spell(tree, PYTHON), point)


@settings(max_examples=50, deadline=None)
@given(st.sampled_from(["a", "(a + b)", "(a / b)", "(a * b)", "-a", "(1 / a)"]), st.data())
def test_small_integer_powers_are_products(base: str, data: st.DataObject) -> None:
    whole = data.draw(st.integers(-8, 8))
    point = data.draw(points)
    tree = parse_value(f"{base}**{whole}", NAMES)
    text = spell(tree)
    assert "**" not in text
    assert "pow" not in text
    assert _outcome_of_tree(tree, point) == _outcome_of_text(text, point)
    try:
        factor = float(evaluate(parse_value(base, NAMES), point))
        product = factor if whole else 1.0
        for _ in range(abs(whole) - 1):
            product *= factor
        expected = 1.0 / product if whole < 0 else product
    except ArithmeticError:
        return
    if not base.startswith("-"):  # -a**2 is -(a**2), as in Python
        assert _outcome_of_tree(tree, point) == _bits(expected)


@pytest.mark.parametrize("text", ["a**9", "a**0.5", "a**-9", "a**b", "a**(1 + 1)", "a**1e300"])
def test_other_powers_are_one_call_of_pow(text: str) -> None:
    printed = spell(parse_value(text, NAMES))
    assert printed.startswith("pow(a, ")


@pytest.mark.parametrize("a", [0.0, -0.0, 2.0])
def test_the_zeroth_power_is_the_same_in_the_tree_and_in_the_text(a: float) -> None:
    tree = parse_value("(1 / a)**0", NAMES)
    assert _outcome_of_tree(tree, {"a": a}) == _outcome_of_text(spell(tree), {"a": a})


def test_a_product_stays_short() -> None:
    text = "a"
    for _ in range(6):
        text = f"({text})**8"
    try:
        tree = parse_value(text, NAMES)
    except ExpressionError:
        return
    assert len(spell(tree)) < 20_000, "otherwise eight times longer with every level: endless"


# --------------------------------------------------------------------------- spell, read, spell
@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(any_values, points)
@example(parse_value("(-((a**8)**3))**3", NAMES), {"a": 1.1, "b": 0.0, "c": 0.0})
@example(parse_value(f"(({'+'.join('a' * 30)})**0)**3", NAMES), {"a": 1.1, "b": 0.0, "c": 0.0})
@example(parse_value("((a**-8)**8)**b", NAMES), {"a": 1.1, "b": 0.5, "c": 0.0})
def test_printing_and_parsing_preserve_values(tree: Value, point: dict[str, float]) -> None:
    text = spell(tree)
    try:
        again = parse_value(text, NAMES)
    except ExpressionError as error:  # the product for a power may exceed the longest text
        assume("nested too deeply" not in error.reason and len(text) <= 10_000)
        raise
    assert spell(again) == text
    assert _outcome_of_tree(again, point) == _outcome_of_tree(tree, point)
    assert names_in(again) <= names_in(tree)  # a zeroth power is printed as 1.0


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(conditions, points)
def test_printing_and_parsing_preserve_conditions(tree: Condition, point: dict[str, float]) -> None:
    text = spell(tree)
    try:
        again = parse_condition(text, NAMES)
    except ExpressionError as error:
        assume("nested too deeply" not in error.reason and len(text) <= 10_000)
        raise
    assert spell(again) == text
    assert _outcome_of_tree(again, point) == _outcome_of_tree(tree, point)


@pytest.mark.parametrize(
    ("text", "python", "matlab"),
    [
        ("a+b*c", "a + b * c", "a + b * c"),
        ("(a+b)*c", "(a + b) * c", "(a + b) * c"),
        ("a-(b-c)", "a - (b - c)", "a - (b - c)"),
        ("a+(b+c)", "a + (b + c)", "a + (b + c)"),
        ("a/(b*c)", "a / (b * c)", "a / (b * c)"),
        ("-(a+b)", "-(a + b)", "-(a + b)"),
        ("-a*b", "-a * b", "-a * b"),
        ("a**2*c", "a * a * c", "a^2 * c"),
        ("c*a**2", "c * (a * a)", "c * a^2"),
        ("-a**2", "-(a * a)", "-a^2"),
        ("1/2", "1.0 / 2.0", "1 / 2"),
        ("(a+b)**1*c", "(a + b) * c", "(a + b)^1 * c"),
        ("a**-1", "1.0 / a", "a^(-1)"),
        ("abs(a-b)", "abs(a - b)", "|a - b|"),
    ],
)
def test_no_superfluous_parentheses(text: str, python: str, matlab: str) -> None:
    tree = parse_value(text, NAMES)
    assert spell(tree, PYTHON) == python
    assert spell(tree, MATLAB_LIKE) == matlab


# --------------------------------------------------------------------------- split
tame = st.recursive(
    st.one_of(st.sampled_from(NAMES).map(Name), st.sampled_from([0.0, 0.5, 1.0]).map(Number)),
    lambda inner: st.one_of(
        inner.map(Negative),
        inner.map(lambda u: Call("abs", (u,))),
        st.builds(Binary, st.sampled_from("+-*"), inner, inner),
    ),
    max_leaves=4,
)
tame_conditions = st.recursive(
    st.builds(Relation, st.sampled_from(["<", "<=", ">", ">="]), tame, tame), _join, max_leaves=5
)
near = st.fixed_dictionaries(
    dict.fromkeys(NAMES, st.sampled_from([-2.0, -1.0, -0.5, -0.0, 0.0, 0.5, 1.0, 2.0, 1e3, 1e-3]))
)


def _truth(part: Split, point: Mapping[str, float]) -> bool:
    if isinstance(part, Requirement):
        return bool(evaluate(part.relation, point))
    word, parts = part
    return (all if word == "both" else any)([_truth(each, point) for each in parts])


def _requirements(part: Split) -> list[Requirement]:
    return (
        [part]
        if isinstance(part, Requirement)
        else [x for each in part[1] for x in _requirements(each)]
    )


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(tame_conditions, near, st.booleans())
def test_split_agrees_with_the_condition(
    condition: Condition, point: dict[str, float], holds: bool
) -> None:
    parts = split(condition, holds)
    assert _truth(parts, point) == (evaluate(condition, point) == holds)
    for requirement in _requirements(parts):
        left, right = requirement.comparison.left, requirement.comparison.right
        margin = float(evaluate(left, point)) - float(evaluate(right, point))
        true = margin > 0.0 or (margin == 0.0 and not requirement.comparison.strict)
        assert bool(evaluate(requirement.relation, point)) == (true == requirement.holds)


@pytest.mark.parametrize(
    ("one", "other"), [("a < b", "a >= b"), ("a <= b", "a > b"), ("not a < b", "a >= b")]
)
def test_a_relation_and_its_opposite_share_one_comparison(one: str, other: str) -> None:
    first, second = (split(parse_condition(text, NAMES)) for text in (one, other))
    assert isinstance(first, Requirement)
    assert isinstance(second, Requirement)
    assert first.comparison == second.comparison
    assert (first.holds == second.holds) == one.startswith("not")


def test_strict_and_non_strict_comparisons_differ() -> None:
    assert split(parse_condition("a < b", NAMES)) == Requirement(
        Comparison(Name("a"), Name("b"), strict=False), holds=False
    )
    assert split(parse_condition("a > b", NAMES)) == Requirement(
        Comparison(Name("a"), Name("b"), strict=True), holds=True
    )


@pytest.mark.parametrize(
    ("text", "word", "relations_"),
    [
        ("abs(a) <= c", "both", ["a <= c", "a >= -c"]),
        ("abs(a) < c", "both", ["a < c", "a > -c"]),
        ("abs(a) > c", "either", ["a > c", "a < -c"]),
        ("c >= abs(a)", "both", ["a <= c", "a >= -c"]),
        ("not abs(a) <= c", "either", ["a > c", "a < -c"]),
        ("a < b < c", "both", ["a < b", "b < c"]),
    ],
)
def test_windows_and_chains_are_split(text: str, word: str, relations_: list[str]) -> None:
    found, parts = split(parse_condition(text, NAMES))
    assert found == word
    assert [spell(part.relation) for part in parts] == relations_


def test_a_chain_reads_as_its_links() -> None:
    chain = parse_condition("a < b <= c > 0", NAMES)
    assert [spell(part) for part in clauses(chain)] == ["a < b", "b <= c", "c > 0.0"]


@settings(max_examples=30, deadline=None)
@given(near)
def test_splitting_two_absolute_values_terminates(point: dict[str, float]) -> None:
    condition = parse_condition("abs(a) <= abs(b)", NAMES)
    parts = split(condition)
    assert _truth(parts, point) == evaluate(condition, point)
    assert len(_requirements(parts)) <= 4


def test_nested_absolute_values_do_not_multiply() -> None:
    text = "a"
    for _ in range(12):
        text = f"abs({text})"
    found = _requirements(split(parse_condition(f"{text} <= c", NAMES)))
    assert len(found) <= 24, "twice as many with every level: 40 levels never end"


def test_the_sign_of_nan_is_zero() -> None:
    assert [sgn(u) for u in (math.nan, 0.0, -0.0, 5e-324, -5e-324)] == [0.0, 0.0, 0.0, 1.0, -1.0]
