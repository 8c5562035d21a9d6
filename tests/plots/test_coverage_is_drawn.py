"""A chart drawn with coverage: lines are the wider the more often an edge was taken."""

from __future__ import annotations

import functools
import re

import pytest

from gms_fsm import Coverage, ParameterError, Prescribed, coverage, simulate
from gms_fsm.traces.coverage.counts import ChartCoverage
from plots import statechart
from plots.charts.labels import THICK, THIN
from tests.helpers import FIG4_SINE, stick_slip


@functools.cache
def counted() -> ChartCoverage:
    model = stick_slip("signed")
    there = [simulate(model, Prescribed("0.2"), 3.0) for _ in range(5)]
    back = simulate(model, Prescribed("-0.2"), 3.0)
    return coverage([*there, back]).contact()


def lines(part: ChartCoverage) -> dict[str, str]:
    """Return the attributes of each edge's line, by the edge."""
    source = statechart(part.chart, counts=part).source
    found = {}
    for edge in part.chart.transitions:
        (found[edge.name],) = re.findall(rf'^.*->.*id="?[\w-]*edge-{edge.name}.*$', source, re.M)
    return found


def width(line: str) -> float:
    found = re.search(r'penwidth="?([\d.]+)', line)
    return THIN if found is None else float(found[1])


def test_the_edge_taken_most_often_is_the_widest_and_one_never_taken_is_dashed() -> None:
    found = lines(counted())
    assert width(found["break_away_forward"]) == THICK
    assert THIN < width(found["break_away_backward"]) < THICK
    assert ["dashed" in found[name] for name in found] == [False, False, True]
    assert width(found["arrest"]) == THIN


def test_the_counts_are_written_for_all_elements_together() -> None:
    source = statechart(counted().chart, counts=counted()).source
    for text in ("taken 20 times", "taken 4 times", "never taken", "entered 24 times"):
        assert text in source


def test_a_run_keeps_its_picture() -> None:
    trace = simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 30.0)
    source = statechart(trace.model.chart, 4, counts=trace).source
    assert {*re.findall(r'penwidth="?([\d.]+)', source)} <= {"1.1", "1.2"}


def test_counts_of_another_chart_and_single_elements_are_refused() -> None:
    part = counted()
    with pytest.raises(ParameterError, match="counts is a run of the chart"):
        statechart(stick_slip("published").chart, counts=part)
    with pytest.raises(ParameterError, match="all elements together"):
        statechart(part.chart, 4, counts=part)
    with pytest.raises(ParameterError, match="ChartCoverage"):
        statechart(part.chart, counts=Coverage({"": part}))  # type: ignore[arg-type]
