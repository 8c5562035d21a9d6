"""Claim: the picture of two charts has all states and edges of both, and marks what differs."""

from __future__ import annotations

import re

import pytest

import plots
from gms_fsm import Chart, State, Transition
from gms_fsm.charts import CHARTS
from plots.charts.difference import LEGEND
from tests.exporters.nested_charts import made


def chart(*edges: Transition, states: tuple[str, ...] = ("stick", "slip")) -> Chart:
    parts = [State(name, {"z": "v"}) for name in states]
    return Chart("one", ("v",), ("z",), ("c",), parts, edges, {"F": "z"})


GO = Transition("go", "stick", "slip", "z > c")
BACK = Transition("back", "slip", "stick", "v < 0")


def lines(picture: object, part: str) -> str:
    """Return the lines of a picture's text about a part."""
    source: str = picture.source  # type: ignore[attr-defined]
    return "\n".join(line for line in source.splitlines() if part in line)


def test_a_removed_edge_is_dashed_and_keeps_its_guard() -> None:
    picture = plots.chart_diff(chart(GO, BACK), chart(GO))
    assert "dashed" in lines(picture, "edge-back")
    assert "v &lt; 0" in lines(picture, "guard-back")


def test_an_added_edge_is_thick() -> None:
    picture = plots.chart_diff(chart(GO), chart(GO, BACK))
    assert "penwidth" in lines(picture, "edge-back")
    assert "dashed" not in lines(picture, "edge-back")


def test_a_changed_guard_has_both_texts() -> None:
    other = Transition("go", "stick", "slip", "z >= c")
    label = lines(plots.chart_diff(chart(GO), chart(other)), "guard-go")
    assert re.search("z &gt;= c.*was.*z &gt; c", label)


def test_a_removed_state_is_there() -> None:
    picture = plots.chart_diff(chart(GO, states=("stick", "slip", "old")), chart(GO))
    assert "removed" in lines(picture, "state-old")


def test_an_edge_with_another_target_says_where_it_led() -> None:
    names = ("stick", "slip", "stop")
    other = Transition("go", "stick", "stop", "z > c")
    picture = plots.chart_diff(chart(GO, states=names), chart(other, states=names))
    assert "-&gt; slip" in lines(picture, "guard-go")


def test_equal_charts_have_nothing_marked() -> None:
    source = plots.chart_diff(chart(GO), chart(GO)).source
    assert LEGEND not in source
    assert "marked" not in source


@pytest.mark.parametrize("seed", range(0, 6, 2))
def test_random_charts_in_states_are_drawn(seed: int) -> None:
    assert plots.chart_diff(made(seed).chart, made(seed + 1).chart).source


def test_charts_with_nothing_in_common_are_drawn() -> None:
    assert plots.chart_diff(CHARTS["karnopp"], CHARTS["lugre"]).source
