"""A formula of any shape is parsed, or refused, in bounded time and with a short message.

Fuzzing found each case. Work is measured in calls rather than time.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, Transition, simulate
from gms_fsm.errors import ExpressionError
from gms_fsm.language import evaluate, names_in, parse_condition, parse_value, spell

LONG = "x" * 50_000


def calls_of(work: Callable[[], object]) -> int:
    """Return the number of Python function calls; give up at a million."""
    count = 0

    def look(_frame: Any, what: str, _argument: Any) -> None:
        nonlocal count
        count += what == "call"
        assert count < 1_000_000, "unbounded work"

    sys.setprofile(look)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


@pytest.mark.parametrize("power", ["2", "8", "9", "0.5", "-3"])
def test_powers_of_powers_cost_no_more_than_their_length(power: str) -> None:
    """The work once doubled with each level: 50 levels would have taken years."""
    text = "(" * 50 + "v" + f")**{power}" * 50

    def read() -> None:
        tree = parse_value(text, ["v"])
        assert names_in(tree) == {"v"}
        assert len(spell(tree)) < 100 * len(text)
        assert evaluate(tree, {"v": 1.0}) == 1.0

    assert calls_of(read) < 100_000


def test_exponents_count_as_part_of_what_is_multiplied() -> None:
    """64 copies of a power whose exponent has 64 copies of a power ...: a line made gigabytes."""
    text = "v"
    for _ in range(9):
        text = f"((v**({text} + z))**8)**8"
    tree = parse_value(text, ["v", "z"])
    assert len(spell(tree)) < 100 * len(text)
    assert evaluate(tree, {"v": 1.0, "z": 0.0}) == 1.0


@pytest.mark.parametrize("function", ["min", "max"])
def test_many_arguments_inside_many_arguments_count_as_depth(function: str) -> None:
    """min(a, b, c) is min(min(a, b), c): 50 in 50 in 50 is too deep for every later reader."""
    text = "v"
    for _ in range(40):
        text = f"{function}({text}{', v' * 48})"
    with pytest.raises(ExpressionError, match="nested too deeply"):
        parse_value(text, ["v"])
    one = parse_value(f"{function}({', '.join('v' * 50)})", ["v"])
    assert evaluate(one, {"v": 2.0}) == 2.0


@pytest.mark.parametrize("text", [LONG[:9000], f"{LONG[:9000]}(v)", f"'{LONG[:9000]}'"])
def test_a_long_name_does_not_make_a_long_message(text: str) -> None:
    for parse in (parse_value, parse_condition):
        with pytest.raises(ExpressionError) as caught:
            parse(text, ["v"])
        assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("name", ["a\0b", "a\nb", "<>", '"""', "\u202e"])
def test_any_name_of_a_chart_can_be_run(name: str) -> None:
    """Python accepts no null character in a file name, which the generated text is given."""
    states = State("a", {"z": "v"}), State("b", {"z": "0"})
    edge = Transition("e", "a", "b", "z >= s")
    chart = Chart(name, ("v", "s"), ("z",), (), states, (edge,), {"F": "z"})
    model = ChartModel(chart, {}, n=1, stribeck=Stribeck(1, 1.5, 1e-3))
    for engine in ("machines", "ifelse"):
        assert len(simulate(model, Prescribed("1"), 2.0, engine=engine).transitions) == 1


@pytest.mark.parametrize(
    "text",
    [
        "z >= s" + " >= v" * 1500,
        " or ".join(["z >= s"] * 600),
        " and ".join(["(" + " or ".join(["z < s"] * 20) + ")"] * 20),
    ],
    ids=["chain", "row", "groups"],
)
def test_hundreds_of_comparisons_are_refused(text: str) -> None:
    """The program that watches each of them separately was too deep for Python to compile."""
    with pytest.raises(ExpressionError, match="too many comparisons"):
        parse_condition(text, ["z", "s", "v"])


def test_a_hundred_comparisons_run() -> None:
    guard = " or ".join(f"z >= s + {i}" for i in range(50)) + " or z" + " >= s" * 50
    states = State("a", {"z": "v"}), State("b", {"z": "0"})
    edge = Transition("e", "a", "b", guard)
    chart = Chart("long", ("v", "s"), ("z",), (), states, (edge,), {"F": "z"})
    model = ChartModel(chart, {}, n=1, stribeck=Stribeck(1, 1.5, 1e-3))
    for engine in ("machines", "ifelse"):
        assert len(simulate(model, Prescribed("1"), 2.0, engine=engine).transitions) == 1
