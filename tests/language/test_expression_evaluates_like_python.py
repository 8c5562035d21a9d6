"""A tree evaluates bit for bit to what Python computes from its printed text.

`evaluate(tree)` equals Python's own value of ``spell(tree, PYTHON)`` to the last bit, including
which error is raised; printing, parsing and printing again changes nothing; and `split` agrees with
the condition it splits, also on the boundary.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from gms_fsm.errors import ExpressionError
from gms_fsm.language import (
    CHOICES,
    ELEMENTARY,
    FUNCTIONS,
    NAMESPACE,
    PYTHON,
    SEVERAL,
    Binary,
    Both,
    Call,
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
    evaluate,
    names_in,
    parse_condition,
    parse_value,
    sgn,
    spell,
    split,
)
from gms_fsm.language._vectors import truths
from gms_fsm.session.explain import holds
from integrators import elementary
from integrators.machine_code import whole_numbers

NAMES = ("a", "b", "c")

# --------------------------------------------------------------------------- random trees
numbers = st.floats(min_value=0.0, allow_nan=False, allow_infinity=False).map(Number)
simple_numbers = st.sampled_from([0.0, 0.5, 1.0, 2.0, 3.0, 1e-3, 1 / 3, 1e16, 5e-324]).map(Number)
leaves = st.one_of(st.sampled_from(NAMES).map(Name), simple_numbers, numbers)
ONE_ARGUMENT = tuple(name for name in FUNCTIONS if name not in SEVERAL)


def _power(base: Value, whole: int) -> Value:
    exponent: Value = Number(float(abs(whole)))
    return Binary("**", base, exponent if whole >= 0 else Negative(exponent))


def _grow(inner: st.SearchStrategy[Value]) -> st.SearchStrategy[Value]:
    return st.one_of(
        inner.map(Negative),
        st.builds(Binary, st.sampled_from("+-*/"), inner, inner),
        st.builds(_power, inner, st.sampled_from([-2, 2, 3])),
        st.builds(lambda f, u: Call(f, (u,)), st.sampled_from(ONE_ARGUMENT), inner),
        st.builds(lambda f, u, w: Call(f, (u, w)), st.sampled_from(SEVERAL), inner, inner),
        st.builds(lambda f, *u: Call(f, u), st.sampled_from([*CHOICES]), *[inner] * 4),
        st.builds(lambda *u: Call("noise", tuple(Call("floor", (v,)) for v in u)), inner, inner),
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
@settings(max_examples=160, deadline=None)
@given(any_values | conditions, points)
def test_a_tree_equals_what_python_computes_from_its_text(
    tree: Node, point: dict[str, float]
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


@pytest.mark.parametrize("a", [0.0, -0.0, 2.0])
def test_the_zeroth_power_is_the_same_in_the_tree_and_in_the_text(a: float) -> None:
    tree = parse_value("(1 / a)**0", NAMES)
    assert _outcome_of_tree(tree, {"a": a}) == _outcome_of_text(spell(tree), {"a": a})


# --------------------------------------------------------------------------- spell, read, spell
@pytest.mark.slow
@settings(max_examples=160, deadline=None)
@given(any_values | conditions, points)
@example(parse_value("(-((a**8)**3))**3", NAMES), {"a": 1.1, "b": 0.0, "c": 0.0})
@example(parse_value(f"(({'+'.join('a' * 30)})**0)**3", NAMES), {"a": 1.1, "b": 0.0, "c": 0.0})
@example(parse_value("((a**-8)**8)**b", NAMES), {"a": 1.1, "b": 0.5, "c": 0.0})
def test_printing_and_parsing_preserve_trees(tree: Node, point: dict[str, float]) -> None:
    text = spell(tree)
    read = parse_condition if isinstance(tree, Condition) else parse_value
    try:
        again = read(text, NAMES)
    except ExpressionError as error:  # the product for a power may exceed the longest text
        assume("nested too deeply" not in error.reason and len(text) <= 10_000)
        raise
    assert spell(again) == text
    assert _outcome_of_tree(again, point) == _outcome_of_tree(tree, point)
    assert names_in(again) <= names_in(tree)  # a zeroth power is printed as 1.0


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


def test_absolute_values_do_not_multiply() -> None:
    assert len(_requirements(split(parse_condition("abs(a) <= abs(b)", NAMES)))) <= 4
    text = "a"
    for _ in range(12):
        text = f"abs({text})"
    found = _requirements(split(parse_condition(f"{text} <= c", NAMES)))
    assert len(found) <= 24, "twice as many with every level: 40 levels never end"


# --------------------------------------------------------------------------- whole columns
SPECIAL = (0.0, -0.0, 1.0, -1.0, 0.5, 3.0, 1e-300, 1e300, 800.0, math.inf, -math.inf, math.nan)
cells = st.one_of(st.sampled_from(SPECIAL), st.floats(-5.0, 5.0))


@pytest.mark.slow
@settings(max_examples=100, deadline=None, derandomize=True)
@given(conditions, st.lists(st.tuples(cells, cells, cells), min_size=1, max_size=6))
def test_a_condition_over_rows_equals_one_evaluation_at_a_time(
    tree: Condition, rows: list[tuple[float, float, float]]
) -> None:
    table = np.array(rows)
    # One name shared by all elements, one of each element, one a single number.
    columns = {"a": table[:, :1], "b": table[:, 1:], "c": rows[0][2]}
    found = truths(tree, columns, (len(rows), 2))
    assert (found.shape, found.dtype) == ((len(rows), 2), np.bool_)
    for (row, i), truth in np.ndenumerate(found):
        values = {"a": rows[row][0], "b": rows[row][1 + i], "c": rows[0][2]}
        assert truth == holds(tree, values), (spell(tree), values)


@pytest.mark.parametrize("name", ["exp", "log", "sin", "cos", "tanh", "atan", "asinh"])
def test_functions_of_columns_are_the_elementary_ones_to_the_last_bit(name: str) -> None:
    function = getattr(elementary, name)
    least = 1e-3 if name == "log" else -20.0
    numbers = np.random.default_rng(1).uniform(least, 20.0, 5000)
    exact = np.array([function(u) for u in numbers.tolist()])
    tree = parse_condition(f"{name}(u) <= exact and {name}(u) >= exact", ["u", "exact"])
    assert truths(tree, {"u": numbers, "exact": exact}, numbers.shape).all()


def test_the_functions_of_our_own_are_those_of_elementary() -> None:
    ours = {"exp", "log", "sin", "cos", "tanh", "atan", "asinh", "pow"}
    ours |= {"floor", "round", "tooth", "noise"}
    assert set(ELEMENTARY) == ours
    modules = {elementary.__name__, whole_numbers.__name__}
    assert {NAMESPACE[name].__module__ for name in ours} == modules


def test_the_sign_of_nan_is_zero() -> None:
    assert [sgn(u) for u in (math.nan, 0.0, -0.0, 5e-324, -5e-324)] == [0.0, 0.0, 0.0, 1.0, -1.0]
