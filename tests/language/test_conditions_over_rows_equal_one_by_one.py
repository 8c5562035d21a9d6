"""A condition over arrays has, place by place, the truth that one evaluation at a time has."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gms_fsm.errors import ExpressionError
from gms_fsm.language import InState, Not, parse_condition, spell, states_in
from gms_fsm.language._vectors import truths
from gms_fsm.session.explain import holds
from integrators import elementary

NAMES = ("a", "b", "c")
SPECIAL = (0.0, -0.0, 1.0, -1.0, 0.5, 3.0, 1e-300, 1e300, 800.0, math.inf, -math.inf, math.nan)
NUMBERS = st.one_of(st.sampled_from(SPECIAL), st.floats(-5.0, 5.0))


ONE_ARGUMENT = ("abs", "exp", "log", "sqrt", "sgn", "sin", "cos", "tanh", "atan", "asinh")


def _grown(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    functions = st.sampled_from([*ONE_ARGUMENT, "-"])
    exponents = st.sampled_from(["2", "3", "(-1)", "(-2)", "0", "0.5", "b"])
    return st.one_of(
        st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda p: f"({' '.join(p)})"),
        st.tuples(st.sampled_from(["min", "max"]), inner, inner).map(
            lambda p: f"{p[0]}({p[1]}, {p[2]})"
        ),
        st.tuples(functions, inner).map(lambda p: f"{p[0]}({p[1]})"),
        st.tuples(inner, exponents).map(lambda p: f"({p[0]})**{p[1]}"),
    )


VALUES = st.recursive(st.sampled_from([*NAMES, "1", "0.5", "2.0"]), _grown, max_leaves=6)
RELATIONS = st.tuples(VALUES, st.sampled_from(["<", "<=", ">", ">="]), VALUES).map(" ".join)
CONDITIONS = st.recursive(
    RELATIONS,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["and", "or"]), inner).map(lambda p: f"({' '.join(p)})"),
        inner.map(lambda text: f"(not {text})"),
    ),
    max_leaves=4,
)


@pytest.mark.slow
@settings(max_examples=100, deadline=None, derandomize=True)
@given(text=CONDITIONS, rows=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=1, max_size=6))
def test_place_by_place(text: str, rows: list[tuple[float, float, float]]) -> None:
    tree = parse_condition(text, NAMES)
    table = np.array(rows)
    # One name shared by all elements, one of each element, one a single number.
    columns = {"a": table[:, :1], "b": table[:, 1:], "c": rows[0][2]}
    shape = (len(rows), 2)
    found = truths(tree, columns, shape)
    assert found.shape == shape
    assert found.dtype == np.bool_
    for (row, i), truth in np.ndenumerate(found):
        values = {"a": rows[row][0], "b": rows[row][1 + i], "c": rows[0][2]}
        assert truth == holds(tree, values), (text, values)


@pytest.mark.parametrize("name", ["exp", "log", "sin", "cos", "tanh", "atan", "asinh"])
def test_functions_are_the_elementary_ones_to_the_last_bit(name: str) -> None:
    function = getattr(elementary, name)
    least = 1e-3 if name == "log" else -20.0
    numbers = np.random.default_rng(1).uniform(least, 20.0, 20_000)
    exact = np.array([function(u) for u in numbers.tolist()])
    tree = parse_condition(f"{name}(u) <= exact and {name}(u) >= exact", ["u", "exact"])
    assert truths(tree, {"u": numbers, "exact": exact}, numbers.shape).all()


def test_states_are_compared_by_name() -> None:
    states = np.array([["stick", "slip"], ["slip", "slip"]])
    columns = {"state(0)": states, "state(1)": states[:, :1]}
    own = parse_condition("state == slip", [], ["stick", "slip"], 2, own_state=True)
    first = parse_condition("state(1) != slip", [], ["stick", "slip"], 2, own_state=True)
    assert truths(own, columns, (2, 2)).tolist() == [[False, True], [True, True]]
    assert truths(first, columns, (2, 2)).tolist() == [[True, True], [False, False]]
    assert (own, first) == (InState(0, "slip"), Not(InState(1, "slip")))
    assert (spell(own), spell(first)) == ("state == slip", "not state(1) == slip")
    assert (states_in(own), states_in(first)) == ({0}, {1})


def test_ones_own_state_is_no_matter_of_guards_and_breakpoints() -> None:
    for elements in (0, 2):
        with pytest.raises(ExpressionError, match="state"):
            parse_condition("state == slip", ["v"], ["stick", "slip"], elements)
