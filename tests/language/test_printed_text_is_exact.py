"""Printed text has exactly the parentheses that it needs; small powers are products."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from gms_fsm.language import (
    C99,
    ECMASCRIPT,
    LATEX,
    MATHEMATICS,
    MATLAB,
    MATLAB_LIKE,
    MODELICA,
    STRUCTURED_TEXT,
    Binary,
    Dialect,
    Name,
    Negative,
    Number,
    parse_condition,
    parse_value,
    product_power,
    spell,
)


def test_small_powers_are_products_until_the_text_grows_too_long() -> None:
    def power(base: str, exponent: str) -> int | None:
        tree = parse_value(f"({base})**({exponent})", "abcdefghv")
        assert isinstance(tree, Binary)
        return product_power(tree.left, tree.right)

    assert [power("v", e) for e in ("8", "-8", "--8", "0", "-0", "1")] == [8, -8, 8, 0, 0, 1]
    assert [power("v", e) for e in ("9", "-9", "0.5", "v", "1 + 1")] == [None] * 5
    eight = "a + b + c + d + e + f + g + h"
    assert power(eight, "8") == 8  # 64 parts
    assert power(eight + " + v", "7") == 7  # 63
    assert power(eight + " + v", "8") is None  # 72
    assert power("a + b + c + d + e + f + g + h + v + a + b + c + d", "5") is None  # 65
    assert power("(a + b + c + d + e + f + g)**h", "8") == 8  # 7 + 1 parts
    assert power(f"({eight})**v", "8") is None  # 8 + 1
    assert power(f"({eight})**1", "8") == 8
    assert power(f"({eight} + v)**0", "8") == 8
    seven = "a + b + c + d + e + f + g"
    for one in ("h", "h**1", "(h * v)**0"):  # each is one part
        assert power(f"{seven} + {one}", "8") == 8  # 64
        assert power(f"{eight} + {one}", "8") is None  # 72
    assert power("(a * -b)**8", "4") == 4  # 16 * 4
    assert power("(a * -b)**8", "-5") is None
    assert power("(a + b)**0.5", "8") == 8  # by pow once: two parts, not eight
    assert power("min(a, b)**-4", "8") == 8  # 2 * 4 * 8
    assert power("min(a, b, c)**-4", "8") is None


@pytest.mark.parametrize(
    ("text", "python", "matlab"),
    [
        ("a - (b - c)", "a - (b - c)", "a - (b - c)"),
        ("a + b - c", "a + b - c", "a + b - c"),
        ("a + (b + c)", "a + (b + c)", "a + (b + c)"),
        ("(a + b) * c", "(a + b) * c", "(a + b) * c"),
        ("a / (b * c)", "a / (b * c)", "a / (b * c)"),
        ("-(a * b)", "-(a * b)", "-(a * b)"),
        ("-(-a)", "-(-a)", "-(-a)"),
        ("-a * b", "-a * b", "-a * b"),
        ("a**1", "a", "a^1"),
        ("(a + b)**1", "a + b", "(a + b)^1"),
        ("a**0", "1.0", "a^0"),
        ("(a * b)**2", "a * b * (a * b)", "(a * b)^2"),
        ("(a + b)**2", "(a + b) * (a + b)", "(a + b)^2"),
        ("(-a)**2", "-a * -a", "(-a)^2"),
        ("a**-1", "1.0 / a", "a^(-1)"),
        ("(a + b)**-1", "1.0 / (a + b)", "(a + b)^(-1)"),
        ("a**-2", "1.0 / (a * a)", "a^(-2)"),
        ("c / a**2", "c / (a * a)", "c / a^2"),
        ("a**0.5 * b", "pow(a, 0.5) * b", "a^0.5 * b"),
        ("a**b**c", "pow(a, pow(b, c))", "a^(b^c)"),
        ("abs(a - b)", "abs(a - b)", "|a - b|"),
        ("exp(a) * max(a, b)", "exp(a) * max(a, b)", "exp(a) * max(a, b)"),
        (
            "0.1 + 1e-7 + 0.30000000000000004",
            "0.1 + 1e-07 + 0.30000000000000004",
            "0.1 + 1e-07 + 0.30000000000000004",
        ),
        ("1234567", "1234567.0", "1234567.0"),
    ],
)
def test_values_have_exactly_the_parentheses_they_need(text: str, python: str, matlab: str) -> None:
    tree = parse_value(text, "abc")
    assert (spell(tree), spell(tree, MATLAB_LIKE)) == (python, matlab)


def test_a_negative_number_binds_like_a_sign() -> None:  # of derivatives: read are none
    assert spell(Negative(Number(-0.5))) == "-(-0.5)"
    assert spell(Binary("**", Name("a"), Number(-0.5)), MATLAB_LIKE) == "a^(-0.5)"


@pytest.mark.parametrize(
    ("text", "python", "matlab"),
    [
        ("a - b > c and a + b < c", "a - b > c and a + b < c", "a - b > c && a + b < c"),
        ("not a > b and c > 0", "not a > b and c > 0.0", "!(a > b) && c > 0"),
        ("not (a > b and c > 0)", "not (a > b and c > 0.0)", "!(a > b && c > 0)"),
        ("not not a > b", "not not a > b", "!(!(a > b))"),
        ("(a > b or b > c) and c > a", "(a > b or b > c) and c > a", "(a > b || b > c) && c > a"),
        ("a > b or b > c and c > a", "a > b or b > c and c > a", "a > b || b > c && c > a"),
        ("a > b and (b > c and c > a)", "a > b and (b > c and c > a)", "a > b && (b > c && c > a)"),
        ("a > b or (b > c or c > a)", "a > b or (b > c or c > a)", "a > b || (b > c || c > a)"),
        ("a + b <= -c", "a + b <= -c", "a + b <= -c"),
        ("state(2) == slip", "state(2) == slip", "state(2) == slip"),
        ("state != slip", "not state == slip", "!(state == slip)"),
    ],
)
def test_conditions_have_exactly_the_parentheses_they_need(
    text: str, python: str, matlab: str
) -> None:
    tree = parse_condition(text, "abc", ["stick", "slip"], 2, own_state=True)
    assert (spell(tree), spell(tree, MATLAB_LIKE)) == (python, matlab)


@pytest.mark.parametrize(
    ("text", "in_charts", "in_code"),
    [
        ("after(0.2)", "after(0.2)", "age >= 0.2"),
        ("age >= 2 * v", "after(2 * v)", "age >= 2.0 * v"),
        ("age > 0.2", "age > 0.2", "age > 0.2"),
        ("age < 0.2", "age < 0.2", "age < 0.2"),
        ("age <= 0.2", "age <= 0.2", "age <= 0.2"),
        ("v >= 0.2", "v >= 0.2", "v >= 0.2"),
        ("0.2 >= age", "0.2 >= age", "0.2 >= age"),
        ("v > pi", "v > pi", "v > 3.141592653589793"),
        ("v > 3", "v > 3", "v > 3.0"),
    ],
)
def test_times_in_a_state_and_pi_have_their_names_in_charts_only(
    text: str, in_charts: str, in_code: str
) -> None:
    tree = parse_condition(text, ["age", "v"])
    assert (spell(tree, MATLAB_LIKE), spell(tree)) == (in_charts, in_code)


# Which functions are called pow, exp ... in C, each export says.
C = replace(C99, functions={**C99.functions, "pow": "pow({0}, {1})"})


@pytest.mark.parametrize(
    ("dialect", "value", "condition"),
    [
        (C, "(-k) * fabs(z - v * v) - pow(v, 0.5)", "(z > 0.0 && v < 1.0e-06) || !(v > z)"),
        (MATLAB, "(-k) * abs(z - v * v) - power(v, 0.5)", "(z > 0.0 && v < 1.0e-06) || ~(v > z)"),
        (
            MODELICA,
            "(-k) * (if z - v * v >= 0.0 then z - v * v else -(z - v * v)) - ((v)^(0.5))",
            "(z > 0.0 and v < 1.0e-06) or not (v > z)",
        ),
        (
            STRUCTURED_TEXT,
            "(-k) * ABS(z - v * v) - EXPT(v, 0.5)",
            "(z > 0.0 AND v < 1.0e-06) OR NOT (v > z)",
        ),
        (
            ECMASCRIPT,
            "-k * Math.abs(z - v * v) - Math.pow(v, 0.5)",
            "z > 0.0 && v < 1e-06 || (v > z) == false",
        ),
        (MATHEMATICS, "−k · |z − v²| − v^0.5", "z > 0 ∧ v < 10⁻⁶ ∨ ¬(v > z)"),
    ],
)
def test_every_dialect_writes_the_same_trees(dialect: Dialect, value: str, condition: str) -> None:
    assert spell(parse_value("-k * abs(z - v**2) - v**0.5", "kzv"), dialect) == value
    told = parse_condition("z > 0 and v < 1e-6 or not v > z", "zv")
    assert spell(told, dialect) == condition


def test_a_formula_of_latex() -> None:
    tree = parse_value(
        "-sigma_0 * (1 - z / z_ss)**2 + sgn(v) * 2e-6", ["sigma_0", "z", "z_ss", "v"]
    )
    assert spell(tree, LATEX, {"v": r"v_{i}"}) == (
        r"-\sigma_{0} \, \left(1 - \frac{z}{z_{\mathrm{ss}}}\right)^{2}"
        r" + \mathrm{sgn}\left(v_{i}\right) \cdot 2 \cdot 10^{-6}"
    )


def test_a_formula_of_latex_has_pi() -> None:
    assert spell(parse_value("pi * v", ["v"]), LATEX) == r"\pi \, v"


def test_a_choice_of_scxml_does_not_see_the_value_that_is_not_chosen() -> None:
    text = spell(parse_value("if(z > 0, if(z > 1, 2, 3), w)", "zw"), ECMASCRIPT)
    for z, w, value in ((2.0, math.inf, 2.0), (0.5, math.nan, 3.0), (-1.0, 4.0, 4.0)):
        assert eval(text, {"z": z, "w": w}) == value


def test_a_function_that_a_dialect_does_not_have_is_named() -> None:
    with pytest.raises(KeyError, match="asinh"):
        spell(parse_value("asinh(v)", ["v"]), MODELICA)


def test_short_forms_are_shown_as_they_were_given() -> None:
    text = "mod(t + 1, 2) > if(v >= 0, 0.5, 0.8) && (round(n) == 1 || !(quantise(v, 0.5) < 2))"
    asked = text.replace("&&", "and").replace("||", "or").replace("!", "not ")
    tree = parse_condition(asked, ["t", "v", "n"])
    assert spell(tree, MATLAB_LIKE) == text
    assert spell(tree, MATHEMATICS).startswith("mod(t + 1, 2) > if(v ≥ 0, 0.5, 0.8)")
    for text in ("if(v < 0 && t >= 1, 1, 2)", "if(v < 0 || t >= 1 || n > 2, if(t < 1, 1, v), 2)"):
        asked = text.replace("&&", "and").replace("||", "or")
        assert spell(parse_value(asked, ["t", "v", "n"]), MATLAB_LIKE) == text
    other = parse_value("t - 2 * floor(t / 3)", ["t"])
    assert spell(other, MATLAB_LIKE) == "t - 2 * floor(t / 3)"
