"""Claim: each text format is read by another tool, and refuses by name what it cannot say."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, FrictionState, State, Transition, export
from gms_fsm.charts.registry import entry
from gms_fsm.errors import ParameterError
from gms_fsm.exporters import Subject, formats
from gms_fsm.systems.models import demonstration
from tests.exporters.text_cases import NAMES, case

FORMATS = ("matlab", "modelica", "st")


def one_state(flow: str = "v", name: str = "k", **more: Any) -> ChartModel:
    chart = Chart(
        "own",
        variables=("z",),
        parameters=(name,),
        states=(State("a", flow={"z": flow}), State("b")),
        outputs={"F": f"{name} * z"},
        **more,
    )
    return ChartModel(chart, {name: 1.0})


def test_blark_parses_structured_text() -> None:
    blark = pytest.importorskip("blark")
    subject = Subject.of(case("gms-4-signed", 0).model, "st", name="friction")
    blark.parse_source_code(formats()["st"].write(subject)["friction.st"])


def test_octave_takes_a_switch(tmp_path: Path) -> None:
    octave = pytest.importorskip("tests.exporters.octave")
    if octave.OCTAVE is None:
        pytest.skip("octave-cli is not installed")
    given = case("gms-4-signed", 1, corners=3)
    lines = octave.lines_of(given.t[:2], given.v[:2], 0.05)
    forces, log = octave.ran_in_octave(tmp_path, given.model, lines, 1e-2)
    trace = given.simulated(rtol=1e-8)
    expected = trace.transitions
    first = expected.t < given.t[1]
    assert [i - 1 for _, i, _ in log] == expected.element[first].tolist()
    assert log
    assert len(forces) == len(lines)


def test_rumoca_takes_the_switches() -> None:
    pytest.importorskip("rumoca")
    from tests.exporters.rumoca_runs import compared

    switches, apart = compared("maxwell-slip", 0)
    assert switches == 12
    assert apart < 1e-6


@pytest.mark.parametrize("form", FORMATS)
def test_all_files_are_flat_and_have_a_readme(form: str, tmp_path: Path) -> None:
    for name in NAMES:
        for path in export(case(name, 0).model, form, tmp_path / name, name="friction"):
            assert path.parent == tmp_path / name
        text = (tmp_path / name / f"README-friction-{form}.md").read_text(encoding="utf-8")
        assert "## How to run it" in text
        assert "## What it does not do" in text


@pytest.mark.parametrize(
    ("form", "name"),
    [("matlab", "function"), ("modelica", "when"), ("st", "LReal"), ("st", "step")],
)
def test_words_of_a_language_are_refused(form: str, name: str, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=f"parameter '{name}'.*word"):
        export(one_state(name=name), form, tmp_path / "out", name="friction")
    with pytest.raises(ParameterError, match="word"):
        export(one_state(), form, tmp_path / "out", name=name)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("name", ["F", "a"])
def test_guards_over_the_force_are_refused(form: str, name: str, tmp_path: Path) -> None:
    model = one_state(transitions=(Transition("go", "a", "b", guard=f"{name} > 1"),))
    wrong = f"edge 'go': it reads '{name}' of the contact"
    with pytest.raises(ParameterError, match=re.escape(wrong)):
        export(model, form, tmp_path / "out")


@pytest.mark.parametrize(
    ("form", "function"), [("st", "tanh"), ("st", "asinh"), ("modelica", "asinh")]
)
def test_missing_functions_are_refused(form: str, function: str, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=f"has no function '{function}'"):
        export(one_state(f"v - {function}(z)"), form, tmp_path / "out")


@pytest.mark.parametrize(
    ("name", "wrong"), [("Z", "for variable 'z'|for parameter"), ("k__1", "two underscores")]
)
def test_names_that_structured_text_cannot_have(name: str, wrong: str, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=wrong):
        export(one_state(name=name), "st", tmp_path / "out", name="friction")
    export(one_state(name=name), "matlab", tmp_path / "out", name="friction")


@pytest.mark.parametrize("form", ["modelica", "st"])
def test_a_name_of_the_friction_is_no_name_of_the_file(form: str, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="a quantity of the friction has this name"):
        export(one_state(), form, tmp_path / "out", name="k")


def test_structured_text_has_no_case(tmp_path: Path) -> None:
    """States that differ in capitals only are refused; names of the text give way to each other."""
    for other, wrong in (("A", "state 'A'.*one name for it and for state 'a'"), ("X2", None)):
        chart = Chart(
            "cases",
            variables=("f", "State"),
            parameters=("STATE_X", "force", "F_i2"),
            states=tuple(State(each, flow={"f": "v"}) for each in ("a", "X", other)),
            outputs={"F": "STATE_X * f + force * State + F_i2"},
        )
        model = ChartModel(chart, {"STATE_X": 1.0, "force": 2.0, "F_i2": 3.0}, n=2)
        if wrong is not None:
            with pytest.raises(ParameterError, match=wrong):
                export(model, "st", tmp_path / "out", name="cycle")
            assert not (tmp_path / "out").exists()
            export(model, "matlab", tmp_path / "m", name="cycle")
            continue
        export(model, "st", tmp_path / "out", name="cycle")
        text = (tmp_path / "out" / "cycle.st").read_text(encoding="utf-8")
        names = [each.upper() for each in re.findall(r"^ +(\w+) : ", text, re.MULTILINE)]
        names.append("CYCLE")
        assert len({*names}) == len(names), names


def test_matlab_keeps_names_below_its_limit(tmp_path: Path) -> None:
    longest = 63 - len("_runge_kutta")
    (path, *_) = export(one_state(), "matlab", tmp_path / "out", name="k" * longest)
    names = re.findall(r"^function .*?(k{9}\w*)", path.read_text(encoding="utf-8"), re.MULTILINE)
    assert max(map(len, names)) == 63
    with pytest.raises(ParameterError, match=f"more than {longest} characters"):
        export(one_state(), "matlab", tmp_path / "no", name="k" * (longest + 1))
    assert not (tmp_path / "no").exists()


def test_octave_holds_its_tolerance_on_a_stiff_flow(tmp_path: Path) -> None:
    """By default, in calls many relaxation times long, through the narrow Stribeck curve."""
    octave = pytest.importorskip("tests.exporters.octave")
    if octave.OCTAVE is None:
        pytest.skip("octave-cli is not installed")
    model = demonstration(entry("lugre"))
    lines = np.array([[0.0, 0.1, 0.01], [0.1, -0.1, 0.05], [-0.1, 0.0, 0.05]])
    forces, _ = octave.ran_in_octave(tmp_path, model, lines, np.inf)
    friction = FrictionState(model, rtol=1e-12)
    exact = [friction.advance(*line) for line in lines.tolist()]
    assert forces.tolist() == pytest.approx(exact, rel=1e-6)
