"""A chart is written as one would write it, and its own file only is replaced."""

from __future__ import annotations

import tomllib
from dataclasses import fields
from pathlib import Path

import pytest

from gms_fsm import Chart, Prescribed, State, Stribeck, Trace, Transition, simulate
from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.errors import OutputError
from gms_fsm.systems.models import ChartModel


def test_a_planar_chart_and_plain_names_are_written_as_one_would(tmp_path: Path) -> None:
    chart = Chart(
        "puck",
        inputs=(),
        velocities=("v", "w"),
        parameters=("F_c", "m"),
        states=(
            State("free", outputs={"F": "F_c * v", "F_w": "F_c * w"}),
            State("held", locked=True),
        ),
        transitions=(Transition("stops", ("free", "held"), "held", guard="v < 0"),),
    )
    path = chart.save(tmp_path / "puck.toml")
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    assert data["velocities"] == ["v", "w"]
    assert data["parameters"] == ["F_c", "m"]
    assert data["edge"] == [
        {"name": "stops", "from": ["free", "held"], "to": "held", "guard": "v < 0"}
    ]
    assert data["state"][1] == {"name": "held", "locked": True}
    assert Chart.load(path) == chart


def test_a_layout_is_kept_by_files_of_charts_and_of_runs(tmp_path: Path) -> None:
    layout = {"stick": (0.0, 0.0), "slip": (320.0, 150.5)}
    chart = GMS_ELEMENT["signed"].placed(layout)
    path = chart.save(tmp_path / "moved.toml")
    assert tomllib.loads(path.read_text(encoding="utf-8"))["layout"] == {
        "stick": [0.0, 0.0],
        "slip": [320.0, 150.5],
    }
    assert Chart.load(path).layout == layout
    model = ChartModel(chart, {"k": 1.0, "sigma": 0.1, "C": 1.0, "v_c": 1e-6}, n=1, stribeck=CURVE)
    trace = simulate(model, Prescribed("0.1"), 0.1).save(tmp_path / "run.npz")
    assert Trace.load(trace).model.chart.layout == layout
    assert "layout" not in GMS_ELEMENT["signed"].save(tmp_path / "plain.toml").read_text()
    assert chart.placed({}).layout == {}


def test_values_at_the_start_are_kept_by_files_of_charts_and_of_runs(tmp_path: Path) -> None:
    chart = Chart("one", ("v",), ("z",), (), (State("a"),), (), {"F": "z"}, initial={"z": 0.5})
    path = chart.save(tmp_path / "one.toml")
    assert tomllib.loads(path.read_text(encoding="utf-8"))["initial"] == {"z": 0.5}
    assert Chart.load(path) == chart
    trace = simulate(ChartModel(chart, {}), Prescribed("0.1"), 0.1).save(tmp_path / "run.npz")
    assert Trace.load(trace).model.chart == chart


CURVE = Stribeck(1.0, 1.5, 0.05)
CHART = Chart("one", states=(State("a"),), outputs={"F": "v"})


def test_what_no_file_can_store_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"must end in \.toml"):
        CHART.save(tmp_path / "one.json")
    with pytest.raises(OutputError, match="which no file can store"):
        Chart("\ud800", states=(State("a"),), outputs={"F": "v"}).save(tmp_path / "one.toml")
    assert not (tmp_path / "one.toml").exists()


def test_charts_are_shown_and_compared_by_what_their_authors_wrote() -> None:
    derived = {each.name for each in fields(Chart) if not each.init}
    read = {"guards", "flows", "assignments", "forces", "lets", "totals"}
    assert derived == read | {"hidden", "nesting", "durations", "rotary", "units"}
    assert [each.name for each in fields(Chart) if each.repr != each.init] == []
    # Charts that only look different are equal; those that are the same but for outer states not.
    compared = [each.name for each in fields(Chart) if each.compare != each.init]
    assert compared == ["layout", "nesting"]
