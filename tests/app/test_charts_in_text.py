"""A chart drawn in text has every state, guard and edge of the chart, and lines that lead there."""

from __future__ import annotations

import re
from itertools import product

import pytest

from gms_fsm import Prescribed
from gms_fsm.charts import CHARTS
from gms_fsm.charts.chart import Chart
from gms_fsm.debugger._view import EdgeView, StateView, chart_states
from gms_fsm.debugger.tui._chart import chart_art
from gms_fsm.debugger.tui._spans import plain
from gms_fsm.session.session import Session
from tests.helpers import FIG4_SINE, stick_slip

TURNS = "╮╯┤┐┘┓┛┨┪┩┥┫┦┧"  # characters with an arm to the left and none to the right
ACROSS = " ╶╺─━┼┿╂╋╀╁╃╄╅╆╇╈╉╊┽┾"  # a line, and its crossings with lanes
CHART_LIST = list(CHARTS.values())


def _states(chart: Chart, active: str = "", fired: str = "") -> list[StateView]:
    """Return a chart as the debugger shows it, with one edge taken."""
    return [
        StateView(
            state.name,
            state.name == active,
            tuple(state.flow.items()),
            state.locked,
            tuple(state.outputs.items()),
            tuple(
                EdgeView(
                    edge.name,
                    edge.target,
                    chart.guard_text(edge.name),
                    priority,
                    (),
                    edge.name == fired,
                )
                for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1)
            ),
        )
        for state in chart.states
    ]


def _ends(rows: list[str]) -> dict[int, str]:
    """Return the state at which each lane arrives, by the lane's column."""
    found = {}
    for row in rows:
        if "◀" in row:
            name = re.sub(r"^(●▶)?\s*[│┃]\s", "", row).split()[0]
            after = row[row.index("◀") + 1 :]
            last = max(i for i, c in enumerate(after) if c in TURNS)
            found[row.index("◀") + 1 + last] = name
    return found


def _lane(row: str, begin: int) -> int:
    """Follow an edge from the end of its text to the lane it joins."""
    for column in range(begin, len(row)):
        if row[column] in TURNS:
            return column
        assert row[column] in ACROSS, (row, row[column])
    raise AssertionError(f"the edge ends nowhere: {row}")


@pytest.mark.slow
@pytest.mark.parametrize("chart", CHART_LIST, ids=lambda chart: chart.name)
def test_each_edge_leads_to_its_target(chart: Chart) -> None:
    for fired, width in product(("", *(edge.name for edge in chart.transitions)), (30, 60, 120)):
        rows = plain(chart_art(_states(chart, fired=fired), width)).splitlines()
        lanes = _ends(rows)
        starts = [row for row in rows if re.match(r"^    [├╰┝┕┖┗][╴╸─━]\d ", row)]
        edges = [edge for state in chart.states for _, edge in chart.leaving(state.name)]
        assert len(starts) == len(edges)
        for row, edge in zip(starts, edges, strict=True):
            text = re.match(r"^.{6}.*?(?= [╶╺])", row)
            assert text, row
            assert lanes[_lane(row, text.end())] == edge.target, "\n".join(rows)


@pytest.mark.parametrize("chart", CHART_LIST, ids=lambda chart: chart.name)
def test_every_state_and_guard_is_there(chart: Chart) -> None:
    text = plain(chart_art(_states(chart), 400, names=True))
    unnamed = plain(chart_art(_states(chart), 400, names=False))
    for state in chart.states:
        assert re.search(rf"[│┃] {state.name} ", text)
        for name, rate in state.flow.items():
            assert f"d{name} = {rate}" in text
    for edge in chart.transitions:
        assert f"[{chart.guard_text(edge.name)}]" in text
        assert f"{edge.name} [" in text
        assert f"[{chart.guard_text(edge.name)}]" in unnamed
        assert f"{edge.name} [" not in unnamed


def test_the_active_state_and_the_edge_taken_differ_in_words_and_lines() -> None:
    session = Session(stick_slip("published"), Prescribed(FIG4_SINE), 10.0)
    session.next_transition()
    text = plain(chart_art(chart_states(session, 0), 80))
    assert "┃ slip  ◉ ACTIVE" in text
    assert "│ stick " in text
    assert "1 break_away_forward FIRED [z >= s && v > v_c] ✓✓ ╺" in text
    assert "◀━" in text
    session.step()
    text = plain(chart_art(chart_states(session, 3), 80))
    assert "┃ stick" in text or "┃ slip" in text
    assert text.count("ACTIVE") == 1


def test_a_chart_without_edges_is_a_box() -> None:
    chart = CHARTS["lugre"]
    text = plain(chart_art(_states(chart, active=chart.states[0].name), 60))
    assert "◀" not in text
    assert "ACTIVE" in text
