"""A derivative is the slope of its value, printed without superfluous terms."""

from __future__ import annotations

import math

import pytest

from gms_fsm.language import FUNCTIONS, SEVERAL, derivative, evaluate, parse_value, spell

POINT = {"a": 0.7, "b": -1.3, "c": 2.1}
STEP = 1e-6


def _slope(text: str, name: str, point: dict[str, float] = POINT) -> float:
    tree = parse_value(text, point)
    after, before = (
        float(evaluate(tree, {**point, name: point[name] + side * STEP})) for side in (1, -1)
    )
    return (after - before) / (2 * STEP)


@pytest.mark.parametrize(
    "text",
    [
        *(f"{name}(a * c)" for name in FUNCTIONS if name not in SEVERAL),
        *(f"{name}(b * a)" for name in FUNCTIONS if name not in (*SEVERAL, "sqrt", "log")),
        "if(a > b, a * b, b)",
        "mod(a * b, c)",
        "saturate(a * a, b, c)",
        "quantise(a, b) * a",
        *(f"{name}({arguments})" for name in SEVERAL for arguments in ("a, b * a", "b, a", "a, c")),
        "a + b * c",
        "a - b / c",
        "-a * b * a",
        "c / (a * a + b)",
        "a**3 * b",
        "(a * c)**0.5",
        "(a * b + c)**-2",
        "c**b",
        "max(min(a * c, b), a - b) * exp(-a)",
    ],
)
@pytest.mark.parametrize("name", "abc")
def test_a_derivative_is_the_slope(text: str, name: str) -> None:
    found = derivative(parse_value(text, "abc"), name)
    if (text, name) == ("c**b", "b"):
        assert found is None  # it would hold for a positive base only
    else:
        assert found is not None
        slope = _slope(text, name)
        assert float(evaluate(found, POINT)) == pytest.approx(slope, rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("function", SEVERAL)
def test_on_a_corner_the_derivative_is_the_mean_of_both_sides(function: str) -> None:
    found = derivative(parse_value(f"{function}(3 * a, 5 * b)", "ab"), "a")
    assert found is not None
    assert evaluate(found, {"a": 5.0, "b": 3.0}) == 1.5
    assert evaluate(found, {"a": 5.0, "b": 2.0}) == {"min": 0.0, "max": 3.0}[function]
    assert evaluate(found, {"a": 5.0, "b": 4.0}) == {"min": 3.0, "max": 0.0}[function]


@pytest.mark.parametrize(
    ("text", "name", "expected"),
    [
        ("b", "a", "0.0"),
        ("-a", "a", "-1.0"),
        ("-b", "a", "0.0"),
        ("a + b", "a", "1.0"),
        ("b + a", "a", "1.0"),
        ("a + a", "a", "1.0 + 1.0"),
        ("a - b", "a", "1.0"),
        ("b - a", "a", "-1.0"),
        ("a - a", "a", "0.0"),
        ("a * b", "a", "b"),
        ("b * a", "a", "b"),
        ("a * a", "a", "a + a"),
        ("a / b", "a", "1.0 / b"),
        ("b / c", "a", "0.0"),
        ("b / a", "a", "-(b / a) / a"),
        ("a**3", "a", "3.0 * (a * a)"),
        ("b**2", "a", "0.0"),
        ("exp(a)", "a", "exp(a)"),
        ("sgn(a)", "a", "0.0"),
        ("sin(2 * a)", "a", "cos(2.0 * a) * 2.0"),
        ("min(b, c)", "a", "0.0"),
        ("C * (sgn(v) - z / s)", "z", "C * -(1.0 / s)"),
    ],
)
def test_superfluous_terms_are_omitted(text: str, name: str, expected: str) -> None:
    found = derivative(parse_value(text, ["a", "b", "c", "C", "v", "z", "s"]), name)
    assert found is not None
    assert spell(found) == expected


def test_parts_without_the_name_do_not_matter() -> None:
    found = derivative(parse_value("b**c + a", "abc"), "a")
    assert found is not None
    assert spell(found) == "1.0"
    assert derivative(parse_value("b**a + a", "abc"), "a") is None


def test_abs_has_the_slope_of_its_side_and_zero_on_its_corner() -> None:
    found = derivative(parse_value("abs(a)", "a"), "a")
    assert found is not None
    assert [evaluate(found, {"a": a}) for a in (-2.0, 0.0, 2.0)] == [-1.0, 0.0, 1.0]
    assert not math.isnan(float(evaluate(found, {"a": math.inf})))
