"""Claim: each text format is read by another tool, and refuses by name what it cannot say."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, FrictionState, State, export
from gms_fsm.charts.registry import entry
from gms_fsm.exporters import Subject, formats
from gms_fsm.systems.models import demonstration
from tests.corpus import LIGHT
from tests.exporters.frictions import case, loaded


@pytest.mark.matrix
@pytest.mark.slow
def test_blark_parses_structured_text() -> None:
    blark = pytest.importorskip("blark")
    for given in (case("gms-4-signed", 0).model, LIGHT):
        subject = Subject.of(given, "st", name="friction")
        blark.parse_source_code(formats()["st"].write(subject)["friction.st"])


@pytest.mark.slow
def test_octave_takes_a_switch_and_holds_its_tolerance_on_a_stiff_flow(tmp_path: Path) -> None:
    """By default, in calls many relaxation times long, through the narrow Stribeck curve."""
    octave = pytest.importorskip("tests.exporters.octave")
    if octave.OCTAVE is None:
        pytest.skip("octave-cli is not installed")
    given = case("gms-4-signed", 1, corners=3)
    lines = octave.lines_of(given.t[:2], given.v[:2], 0.05)
    forces, log = octave.ran_in_octave(tmp_path / "switch", given.model, lines, 1e-2)
    expected = given.simulated(rtol=1e-8).transitions
    assert [i - 1 for _, i, _ in log] == expected.element[expected.t < given.t[1]].tolist()
    assert log
    assert len(forces) == len(lines)
    model = demonstration(entry("lugre"))
    lines = np.array([[0.0, 0.1, 0.01], [0.1, -0.1, 0.05], [-0.1, 0.0, 0.05]])
    forces, _ = octave.ran_in_octave(tmp_path / "stiff", model, lines, np.inf)
    friction = FrictionState(model, rtol=1e-12)
    exact = [friction.advance(*line) for line in lines.tolist()]
    assert forces.tolist() == pytest.approx(exact, rel=1e-6)


@pytest.mark.slow
def test_rumoca_takes_the_switches() -> None:
    pytest.importorskip("rumoca")
    from tests.exporters.rumoca_runs import compared

    switches, apart = compared("maxwell-slip", 0)
    assert switches == 12
    assert apart < 1e-6


@pytest.mark.parametrize("form", ["matlab", "modelica", "st"])
def test_a_friction_that_reads_everything(form: str) -> None:
    """Time, position, a further input, actions, corners; one element, then several."""
    chart = loaded().chart
    for given in (loaded(), ChartModel(chart, {"mu": [0.3, 0.5]}, n=2, inputs={"N": "1 + t"})):
        files = formats()[form].write(Subject.of(given, form, name="friction"))
        text, *_, readme = files.values()
        assert all(re.search(rf"\b{each}\b", text) for each in ("v", "x", "big", "rel", "mu"))
        assert "## How to run it" in readme
        assert "## What it does not do" in readme


@pytest.mark.matrix
@pytest.mark.every(4)
@pytest.mark.parametrize("form", ["c99", "js", "matlab", "modelica", "scxml", "st", "transitions"])
def test_a_variable_starts_where_its_chart_says(form: str, tmp_path: Path) -> None:
    for start in (0.3125, 0.4375):
        states = (State("first", {"z": "v"}),)
        chart = Chart("one", ("v",), ("z",), (), states, (), {"F": "z"}, initial={"z": start})
        text = "".join(
            path.read_text(encoding="utf-8")
            for path in export(ChartModel(chart, {}), form, tmp_path / str(start), name="own")
        )
        assert repr(start) in text


def test_names_of_structured_text_give_way_to_each_other(tmp_path: Path) -> None:
    """They differ in more than capitals."""
    chart = Chart(
        "cases",
        variables=("f", "State"),
        parameters=("STATE_X", "force", "F_i2"),
        states=tuple(State(each, flow={"f": "v"}) for each in ("a", "X", "X2")),
        outputs={"F": "STATE_X * f + force * State + F_i2"},
    )
    model = ChartModel(chart, {"STATE_X": 1.0, "force": 2.0, "F_i2": 3.0}, n=2)
    text = formats()["st"].write(Subject.of(model, "st", name="cycle"))["cycle.st"]
    for block in text.split("END_FUNCTION_BLOCK"):
        names = [each.upper() for each in re.findall(r"^ +(\w+) : ", block, re.MULTILINE)]
        assert len({*names, "CYCLE"}) == len(names) + 1, names


def test_matlab_keeps_names_below_its_limit(tmp_path: Path) -> None:
    longest = 63 - len("_runge_kutta")
    given = case("lugre", 0).model
    (path, *_) = export(given, "matlab", tmp_path / "out", name="k" * longest)
    names = re.findall(r"^function .*?(k{9}\w*)", path.read_text(encoding="utf-8"), re.MULTILINE)
    assert max(map(len, names)) == 63
