"""Long texts of a chart are broken at operators, never inside a name, a number or an operator."""

from __future__ import annotations

import random
import re

import pytest

from gms_fsm.language import MATLAB_LIKE, parse_condition, spell
from plots._labels import LONGEST_LINE, wrapped
from tests.plots.charts_to_draw import guard

NAMES = ("z", "w", "v", "s", "k", "v_c", "v_hi")


@pytest.mark.parametrize("seed", range(30))
@pytest.mark.parametrize("limit", [24, 34, LONGEST_LINE])
def test_nothing_is_lost_and_lines_are_short(seed: int, limit: int) -> None:
    rng = random.Random(seed)
    text = spell(parse_condition(guard(rng, rng.randint(1, 200)), NAMES), MATLAB_LIKE)
    lines = wrapped(text, limit)
    assert " ".join(line.strip() for line in lines) == text
    assert max(map(len, lines)) <= limit
    assert all(line.startswith("  ") for line in lines[1:])


@pytest.mark.parametrize(
    ("text", "limit", "lines"),
    [
        ("a > 1 && b > 2 && c > 3", 16, ["a > 1 && b > 2 &&", "  c > 3"]),
        ("alpha > 1 && beta > 2", 14, ["alpha > 1 &&", "  beta > 2"]),
        ("alpha > 1 || beta > 2 && c", 22, ["alpha > 1 ||", "  beta > 2 && c"]),
        ("alpha + beta >= gamma", 15, ["alpha + beta", "  >= gamma"]),
        ("alpha * (beta + gamma) + d", 24, ["alpha * (beta + gamma)", "  + d"]),
        ("|alpha - beta| > |gamma|", 18, ["|alpha - beta|", "  > |gamma|"]),
        ("max(alpha, beta) > 3", 18, ["max(alpha, beta)", "  > 3"]),
    ],
)
def test_where_lines_end(text: str, limit: int, lines: list[str]) -> None:
    if len(lines[0]) > limit:
        limit = len(lines[0])
    assert wrapped(text, limit) == lines


def test_a_name_longer_than_a_line_stays_whole() -> None:
    name = "x" * 60
    assert wrapped(name) == [name]
    assert wrapped(f"{name} > 1 && v > 2", 20) == [name, "  > 1 && v > 2"]
    assert wrapped("") == []


def test_words_are_never_broken() -> None:
    text = "k * abs(z - 1) ** 2 + 1.5e-06 * v_hi >= sqrt(w) && not (v > -v_c)"
    for limit in range(10, 60):
        words = [word for line in wrapped(text, limit) for word in re.findall(r"\S+", line)]
        assert words == text.split()
