"""An exported transitions file takes the switches of `simulate` with Euler's method, bit for bit.

It runs by itself, with nothing but the package transitions.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    Parameter,
    Prescribed,
    State,
    System,
    Transition,
    export,
    simulate,
)
from gms_fsm.charts import CHARTS, GMS_ELEMENT
from gms_fsm.language import evaluate, parse_value
from tests.exporters.charts_to_export import MODELS, SLOW, imported, model
from tests.helpers import stick_slip

T_END, STEP = 7.5, 1e-3


def run_of(file: Any, text: str, t_end: float, step: float) -> tuple[list[Any], list[Any]]:
    """Return the switches and the rows of a file."""
    tree = parse_value(text, ["t"])
    rows = list(file.run(lambda t: {"v": evaluate(tree, {"t": t})}, t_end, step))
    switches = [
        (t, i, edge, states[i])
        for t, _, _, states, edges in rows
        for i, edge in enumerate(edges)
        if edge is not None
    ]
    return switches, rows


def log_of(trace: Any) -> list[Any]:
    return [
        (float(each.t), int(each.element), str(each.edge), str(each.target))
        for each in trace.transitions
    ]


@pytest.mark.parametrize(
    "name",
    [
        name
        if name in ("gms-signed", "seven-parameter", "backlash")
        else pytest.param(name, marks=pytest.mark.matrix)
        for name in MODELS
    ],
)
def test_every_switch_and_the_force_are_equal(name: str, tmp_path: Path) -> None:
    velocity = "0.15 * sin(2 * pi * t / 25)" if name.startswith("gms") else SLOW
    t_end, step = (25.0, 5e-3) if name.startswith("gms") else (T_END, STEP)
    path, *_ = export(model(name), "transitions", tmp_path, name="file")
    switches, rows = run_of(imported(path), velocity, t_end, step)
    trace = simulate(
        model(name),
        Prescribed(velocity),
        t_end,
        method="euler",
        step=step,
        events="step",
        engine="ifelse",
    )
    assert switches == log_of(trace)
    assert len(switches) > 2 or not CHARTS[name].transitions or name == "backlash"
    assert rows[-1][2] == trace.F[-1]


FORCE = Chart(
    "reads what it gives",
    inputs=("t", "v", "N", "x"),
    variables=("z",),
    parameters=(Parameter("k"), "mu"),
    states=(
        State("stick", flow={"z": "v"}, entry={"z": "0.25 * z"}),
        State("slip", flow={"z": "0.1 * v * cos(t)"}, exit={"z": "z - 0.1 * k"}),
    ),
    transitions=(
        Transition("slips", "stick", "slip", "abs(F) >= mu * N and x > -1", {"z": "mu * z"}),
        Transition("sticks", ("slip",), "stick", "after(0.3) and F * v < 0"),
    ),
    outputs={"F": "k * z + 0.01 * dz"},
    let={"unused": "k * 2"},
    contact_outputs={"F": "F + 0.5 * v"},
)


def test_forces_in_guards_inputs_and_several_elements(tmp_path: Path) -> None:
    given = ChartModel(
        FORCE, {"k": [1.0, 2.0, 0.5], "mu": 0.3}, n=3, inputs={"N": "1 + 0.5 * sin(t) + v"}
    )
    path, *_ = export(given, "transitions", tmp_path, name="file")
    switches, rows = run_of(imported(path), "sin(2 * t)", 20.0, 1e-2)
    trace = simulate(
        given, Prescribed("sin(2 * t)"), 20.0, method="euler", step=1e-2, events="step"
    )
    assert len(switches) > 20
    assert switches == log_of(trace)
    assert rows[-1][2] == trace.F[-1]


def test_a_contact_whose_load_comes_from_outside(tmp_path: Path) -> None:
    contact = Contact("pad", FORCE, {"k": 1.0, "mu": 0.3}, inputs={"N": "2 * load"})
    system = System(
        "brake",
        bodies=(Body("body", velocity="v"),),
        contacts=(contact,),
        signals={"v": "sin(2 * t)", "load": "0.5 + 0.2 * cos(t)"},
    )
    path, *_ = export(contact, "transitions", tmp_path, name="file")
    file = imported(path)
    v, load = parse_value("sin(2 * t)", ["t"]), parse_value("0.5 + 0.2 * cos(t)", ["t"])
    rows = list(
        file.run(
            lambda t: {"v": evaluate(v, {"t": t}), "load": evaluate(load, {"t": t})}, 20.0, 1e-2
        )
    )
    trace = simulate(system, 20.0, method="euler", step=1e-2, events="step")
    taken = [(t, edge) for t, _, _, _, (edge,) in rows if edge is not None]
    assert len(taken) > 10
    assert taken == [(float(each.t), str(each.edge)) for each in trace.transitions]


def test_a_load_on_the_thresholds_of_a_model(tmp_path: Path) -> None:
    contact = Contact("pad", stick_slip("signed"), inputs={"N": "1 + 0.5 * sin(t)"})
    system = System(
        "brake",
        bodies=(Body("body", velocity="v"),),
        contacts=(contact,),
        signals={"v": "0.15 * sin(2 * pi * t / 25)"},
    )
    path, *_ = export(contact, "transitions", tmp_path, name="file")
    switches, rows = run_of(imported(path), "0.15 * sin(2 * pi * t / 25)", 25.0, 5e-3)
    trace = simulate(system, 25.0, method="euler", step=5e-3, events="step", engine="ifelse")
    assert len(switches) > 2
    assert switches == log_of(trace)
    assert rows[-1][2] == trace.contact("pad").F[-1]


# --------------------------------------------------------------------------- by itself
ISOLATED = """
import runpy, sys
sys.argv = ["file.py", *sys.argv[1:]]
runpy.run_path("file.py", run_name="__main__")
print(sorted({name.partition(".")[0] for name in sys.modules} & {"numpy", "gms_fsm", "plots"}))
"""


def alone(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run an exported file in a process that has not imported this package."""
    return subprocess.run(
        [sys.executable, "-c", ISOLATED, *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        timeout=60,
    )


def test_it_runs_by_itself_and_prints_its_switches(tmp_path: Path) -> None:
    export(stick_slip("signed"), "transitions", tmp_path, name="file")
    done = alone(tmp_path, "25", "0.01")
    assert done.returncode == 0, done.stderr
    *lines, last, modules = done.stdout.splitlines()
    assert modules == "[]"
    assert lines[0].endswith("element 1: break_away_forward -> slip")
    assert last.startswith(f"{len(lines)} switches; F = ")
    assert len(lines) == 16


def test_a_chart_without_numbers_asks_for_them(tmp_path: Path) -> None:
    path, *_ = export(GMS_ELEMENT["signed"], "transitions", tmp_path, name="file")
    done = alone(tmp_path)
    assert done.returncode == 1
    assert "no numbers: fill in VALUES, one mapping for each element" in done.stderr
    file = imported(path)
    values = [{"k": 1.0, "sigma": 0.0, "C": 0.1, "v_c": 1e-6}]
    rows = list(file.run(lambda t: {"v": 1.0, "s": 0.5}, 1.0, 0.01, values=values))
    assert rows[-1][3] == ["slip"]


def test_the_readme_says_how_to_run_it(tmp_path: Path) -> None:
    export(stick_slip("signed"), "transitions", tmp_path, name="own")
    text = (tmp_path / "README-own-transitions.md").read_text(encoding="utf-8")
    for wanted in ("python own.py", "States: stick, slip", "not located", "k, sigma, C, v_c"):
        assert wanted in text
