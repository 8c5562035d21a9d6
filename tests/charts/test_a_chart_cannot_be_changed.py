"""A chart is data: no part of it can be replaced, and it compares by its texts."""

from __future__ import annotations

import dataclasses

import pytest

from gms_fsm.charts.chart import Chart, State, Transition


def _chart() -> Chart:
    return Chart(
        "sticky",
        inputs=("v",),
        variables=("z",),
        parameters=("k",),
        states=(State("stick", flow={"z": "v"}, entry={"z": "0"}), State("slip", flow={"z": "0"})),
        transitions=(Transition("leave", "stick", "slip", "z > 1"),),
        outputs={"F": "k * z"},
    )


def test_no_part_of_a_chart_can_be_exchanged_afterwards() -> None:
    chart = _chart()
    parts = ((chart, "name"), (chart.states[0], "flow"), (chart.transitions[0], "guard"))
    for part, attribute in parts:
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(part, attribute, "another")


def test_charts_are_shown_and_compared_by_text_not_by_tree() -> None:
    chart = _chart()
    assert "guards=" not in repr(chart)
    assert "flows=" not in repr(chart)
    assert "assignments=" not in repr(chart)
    assert "forces=" not in repr(chart)
    assert chart == _chart()
