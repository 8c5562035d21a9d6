"""python-statemachine loads an exported SCXML document and steps it as `simulate` switches."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Transition, export, simulate
from tests.exporters.charts_to_export import model
from tests.exporters.nested_charts import made, run_of, seen_by
from tests.exporters.scxml_host import PythonStateMachine, moved_by, run, switches_of
from tests.helpers import stick_slip

VELOCITY = "0.15 * sin(2 * pi * t / 25)"


@pytest.mark.slow
def test_the_gms_element(tmp_path: Path) -> None:
    pytest.importorskip("statemachine", reason="needs python-statemachine")
    gms = stick_slip("signed")
    path, *_ = export(gms, "scxml", tmp_path, name="gms")
    trace = simulate(
        gms, Prescribed(VELOCITY), 25.0, method="euler", step=0.05, events="step", engine="ifelse"
    )
    mine = run(PythonStateMachine(path), gms, 0, moved_by(VELOCITY), 25.0, 0.05)
    assert len(mine) == 4
    assert mine == switches_of(trace, 0)


@pytest.mark.slow
def test_a_chart_with_functions_that_jump(tmp_path: Path) -> None:
    """The tool knows neither a choice nor a function that rounds to the even number."""
    pytest.importorskip("statemachine", reason="needs python-statemachine")
    chart = Chart(
        "jumps",
        inputs=("t", "v"),
        variables=("z", "n"),
        states=(State("on", {"z": "v", "n": "0"}), State("off", {"z": "-0.3 * z", "n": "0"})),
        transitions=(
            Transition(
                "rest",
                "on",
                "off",
                "if(v > 0 and not quantise(z, 0.25) < 0.5, z, 0) > 0.5",
                actions={"n": "mod(n + 1, 3)"},
            ),
            Transition("go", "off", "on", "z < 0.2 and (round(n) == 1 or mod(t, 2) > 1)"),
        ),
        outputs={"F": "z"},
    )
    friction, velocity = ChartModel(chart, {}), "0.7 * sin(t)"
    path, *_ = export(friction, "scxml", tmp_path, name="jumps")
    trace = simulate(friction, Prescribed(velocity), 25.0, method="euler", step=0.05, events="step")
    mine = run(PythonStateMachine(path), friction, 0, moved_by(velocity), 25.0, 0.05)
    assert len(mine) > 4
    assert mine == switches_of(trace, 0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 8, 17])
def test_random_states_in_states(seed: int, tmp_path: Path) -> None:
    """The same state, and the same value that every entry, exit and action changes, each step."""
    pytest.importorskip("statemachine", reason="needs python-statemachine")
    path, *_ = export(made(seed), "scxml", tmp_path, name="own")
    seen, trace = run_of(made(seed))
    assert seen_by(PythonStateMachine(path), made(seed)) == seen
    assert len(trace.transitions) > 5


def test_the_readme_is_a_program(tmp_path: Path) -> None:
    pytest.importorskip("statemachine", reason="needs python-statemachine")
    export(model("seven-parameter"), "scxml", tmp_path, name="own")
    text = (tmp_path / "README-own-scxml.md").read_text(encoding="utf-8")
    block = text.partition("    pip install")[2].partition("\n\n")[2].partition("What it does")[0]
    said: list[Any] = []
    program = "\n".join(line.removeprefix("    ") for line in block.splitlines())
    program = program.replace('Path("', f'Path("{tmp_path}/').replace("print(", "said.append((")
    exec(program.rstrip() + ")", {"said": said})
    ((states, values),) = said
    assert states == ["stick"]
    assert values["k_t"] == 1e5


def test_names_that_a_tool_keeps_for_itself_are_in_the_readme(tmp_path: Path) -> None:
    chart = Chart("own", parameters=("model",), states=(State("a"),), outputs={"F": "v"})
    export(chart, "scxml", tmp_path, name="own")
    text = (tmp_path / "README-own-scxml.md").read_text(encoding="utf-8")
    assert "python-statemachine keeps the names model for itself" in text
    assert "set every <data> without expr" in text
