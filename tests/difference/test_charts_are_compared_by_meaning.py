"""Claim: a difference of texts counts where it makes a difference, and then a point shows it."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from gms_fsm import Chart, Diff, Parameter, State, Transition, diff
from gms_fsm.charts.registry import registered
from gms_fsm.language import evaluate

STATES = (State("stick", {"z": "v"}), State("slip", {"z": "0"}))


def chart(
    guards: Sequence[tuple[str, str, str, str]] = (("go", "stick", "slip", "z > c"),),
    *,
    states: Sequence[State] = STATES,
    parameters: Sequence[Any] = ("c",),
    output: str = "z",
    **more: Any,
) -> Chart:
    edges = [Transition(name, source, target, guard) for name, source, target, guard in guards]
    return Chart("one", ("v",), ("z",), parameters, states, edges, {"F": output}, **more)


def guarded(guard: str, **more: Any) -> Chart:
    return chart([("go", "stick", "slip", guard)], **more)


@pytest.fixture
def z3() -> None:
    """Without z3 texts are compared only."""
    pytest.importorskip("z3", reason="needs z3 (extra: check)")


def compared(one: str, other: str, **more: Any) -> Diff:
    return diff(guarded(one, **more), guarded(other, **more))


def test_a_chart_is_equal_to_itself() -> None:
    every = [each.chart(law) for each in registered().values() for law in each.laws or ("",)]
    assert {diff(each, each).summary for each in every} == {"equal"}


@pytest.mark.usefixtures("z3")
@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("abs(z) > c", "z > c or z < -c"),
        ("2 * z > c", "z > 0.5 * c"),
        ("not (z > c and v < 0)", "z <= c or v >= 0"),
        ("max(z, v) > c", "z > c or v > c"),
        ("exp(z) > c", "c < exp(z)"),
    ],
)
def test_guards_that_hold_at_the_same_points_are_equivalent(one: str, other: str) -> None:
    rule = [Parameter("c", rule="> 0")]
    assert compared(one, other, parameters=rule).verdict == "equivalent"


@pytest.mark.usefixtures("z3")
@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("z > c", "z >= c"),
        ("z > c", "z > c and v > 0"),
        ("abs(z) > c", "z > c"),
        ("exp(z) > c", "exp(z) > c + 1"),
        ("after(0.1)", "after(0.2)"),
        ("True", "not True"),
    ],
)
def test_at_the_point_of_a_difference_one_guard_holds(one: str, other: str) -> None:
    a, b = guarded(one), guarded(other)
    found = diff(a, b)
    assert found.verdict == "different"
    assert evaluate(a.guards["go"], found.point) != evaluate(b.guards["go"], found.point)


@pytest.mark.usefixtures("z3")
def test_what_is_not_encoded_and_shows_no_difference_is_undecided() -> None:
    found = compared("exp(z) > 1", "z > 0")
    assert found.verdict == "undecided"
    assert "is not encoded" in found.reason
    assert not found.equivalent


@pytest.mark.usefixtures("z3")
def test_a_rule_makes_texts_equivalent() -> None:
    verdicts = [
        compared("c * z > c", "z > 1", parameters=[Parameter("c", rule=rule)]).verdict
        for rule in ("> 0", "finite")
    ]
    assert verdicts == ["equivalent", "different"]


OVERLAPPING = [("up", "stick", "slip", "z > c"), ("down", "stick", "stick", "v > 0")]
APART = [("up", "stick", "slip", "z > c"), ("down", "stick", "stick", "z < c")]


@pytest.mark.usefixtures("z3")
@pytest.mark.parametrize(
    ("edges", "verdict"), [(OVERLAPPING, "different"), (APART, "equivalent")], ids=str
)
def test_the_order_of_edges_counts_where_both_are_enabled(
    edges: list[tuple[str, str, str, str]], verdict: str
) -> None:
    found = diff(chart(edges), chart(edges[::-1]))
    assert found.verdict == verdict
    assert [each.part for each in found.changes] == ["order of edges leaving"]


def test_names_are_matched_by_what_they_do() -> None:
    called: Mapping[str, str] = {"stick": "held", "slip": "gliding"}
    other = Chart(
        "other",
        ("v",),
        ("q",),
        ("limit",),
        (State("held", {"q": "v"}), State("gliding", {"q": "0"})),
        (Transition("leaves", "held", "gliding", "q > limit"),),
        {"F": "q"},
    )
    found = diff(chart(), other)
    assert found.verdict == "equivalent"
    assert dict(found.states) == dict(called)
    assert {(each.part, each.name, each.after) for each in found.changes} == {
        ("state", "stick", "held"),
        ("state", "slip", "gliding"),
        ("variable", "z", "q"),
        ("parameter", "c", "limit"),
        ("edge", "go", "leaves"),
    }


NESTED = (State("on", states=(State("stick", {"z": "v"}), State("slip", {"z": "0"}))),)


def test_states_in_states_may_be_written_flat() -> None:
    flat = chart([("go", "stick", "slip", "z > c")])
    nested = chart([("go", "on.stick", "on.slip", "z > c")], states=NESTED)
    assert diff(nested, flat).verdict == "equivalent"


@pytest.mark.usefixtures("z3")
def test_each_kind_of_change_is_listed() -> None:
    b = Chart(
        "two",
        ("v", "t"),
        ("z",),
        (Parameter("c", "N", "> 0"), "d"),
        (State("stick", {"z": "2 * v"}), State("slip", {"z": "0"}), State("stop")),
        (
            Transition("go", "stick", "stop", "z >= c", {"z": "0"}),
            Transition("back", "slip", "stick", "v < 0"),
        ),
        {"F": "z + d"},
        initial={"z": 1.0},
    )
    lines = diff(chart(), b).text.splitlines()
    assert lines == [
        "first -> second",
        "  + state stop",
        "  + input t",
        "  + parameter d",
        "  ~ unit of parameter c: none -> N",
        "  ~ rule of parameter c: finite -> > 0",
        "  ~ initial value of z: 0 -> 1",
        "  ~ flow of z in state stick: v -> 2 * v",
        "  ~ output F in states stick, slip: z -> z + d",
        "  ~ target of edge go: slip -> stop",
        "  ~ guard of edge go: z > c -> z >= c",
        "  ~ action of edge go: none -> z := 0",
        "  + edge back: slip -> stick [v < 0]",
        "different: state 'stop' is in the second only",
    ]


def test_no_line_is_longer_than_80_characters() -> None:
    long = " or ".join(f"z > {i} * c and v < {i}" for i in range(20))
    text = compared(long, long.replace("v < 3", "v < 33")).text
    assert max(map(len, text.splitlines())) <= 80


def test_without_z3_texts_are_compared_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "z3", None)
    assert compared("z > c", "not c >= z").verdict == "equivalent"
    found = compared("2 * z > c", "z > 0.5 * c")
    assert found.verdict == "undecided"
    assert 'pip install "gms-fsm[check]"' in found.reason


def test_without_z3_a_point_still_shows_a_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "z3", None)
    assert compared("z > c", "z > c + 1").verdict == "different"


@pytest.mark.usefixtures("z3")
def test_events_at_a_point_are_called_by_name() -> None:
    def awaiting(event: str) -> Chart:
        edge = Transition("go", "stick", "slip", "z > c", event=event)
        return Chart("one", ("v",), ("z",), ("c",), STATES, (edge,), {"F": "z"})

    last = diff(awaiting("hot"), awaiting("cold")).text.splitlines()[-1]
    assert last == "  for example at c = 1, event cold has come, event hot has not come, z = 2"


def test_charts_that_differ_in_their_names_only_are_equivalent() -> None:
    other = Chart("two", ("v",), ("z",), ("c",), STATES, chart().transitions, {"F": "z"})
    assert diff(chart(), other).verdict == "equivalent"


def test_initial_values_that_differ_look_different() -> None:
    found = diff(chart(initial={"z": 1.0}), chart(initial={"z": 1.0 + 2**-52}))
    assert "  ~ initial value of z: 1 -> 1.0000000000000002" in found.text.splitlines()
