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
    State,
    System,
    Transition,
    export,
    simulate,
)
from gms_fsm.charts import CHARTS, GMS_ELEMENT
from gms_fsm.charts.nesting import spelled
from gms_fsm.language import evaluate, parse_value
from tests.corpus import JUMPING, LIGHT
from tests.exporters.charts_to_export import MODELS, SLOW, imported, model
from tests.helpers import matrix, stick_slip

SINE = "0.15 * sin(2 * pi * t / 25)"
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
SEVERAL = ChartModel(
    FORCE, {"k": [1.0, 2.0, 0.5], "mu": 0.3}, n=3, inputs={"N": "1 + 0.5 * sin(t) + v"}
)
JUMPS = ChartModel(JUMPING, {"k": 1.0, "T": [0.7, 1.1]}, n=2)
LOADED = Contact("pad", FORCE, {"k": 1.0, "mu": 0.3}, inputs={"N": "2 * load"})
PRESSED = Contact("pad", stick_slip("signed"), inputs={"N": "1 + 0.5 * sin(t)"})
LOAD = {"load": "0.5 + 0.2 * cos(t)"}
Case = tuple[Any, dict[str, str], float, float, int]  # friction, record, end, step, switches
CASES: dict[str, Case] = {
    "forces in guards, inputs, several elements": (SEVERAL, {"v": "sin(2 * t)"}, 20.0, 1e-2, 20),
    "a load from outside": (LOADED, {"v": "sin(2 * t)", **LOAD}, 20.0, 1e-2, 10),
    "functions that jump": (JUMPS, {"v": "0.6 * cos(1.3 * t)"}, 9.0, 1e-2, 10),
    "a load on the thresholds of a model": (PRESSED, {"v": SINE}, 25.0, 2e-2, 2),
    "states in states": (LIGHT, {"v": SINE}, 20.0, 3e-2, 40),
}


def case(name: str) -> Case:
    """Return a friction, its record, end and step, and what it switches more often than."""
    if name in CASES:
        return CASES[name]
    switches = -1 if not CHARTS[name].transitions or name == "backlash" else 2
    record = ({"v": SINE}, 25.0, 1e-2) if name.startswith("gms") else ({"v": SLOW}, 7.5, 1e-3)
    return model(name), *record, switches


@pytest.mark.every(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", [*CASES, *matrix([*MODELS], ["gms-signed", "seven-parameter"])])
def test_every_switch_and_the_force_are_equal(name: str, tmp_path: Path) -> None:
    given, record, t_end, step, least = case(name)
    path, *_ = export(given, "transitions", tmp_path, name="file")
    trees = {each: parse_value(text, ["t"]) for each, text in record.items()}
    rows = list(
        imported(path).run(
            lambda t: {each: evaluate(tree, {"t": t}) for each, tree in trees.items()}, t_end, step
        )
    )
    contact = given if isinstance(given, Contact) else Contact("friction", given)
    body = Body("body", velocity="v")
    system = System("moved", bodies=(body,), contacts=(contact,), signals=record)
    how: dict[str, Any] = {"method": "euler", "step": step, "events": "step", "engine": "ifelse"}
    trace = simulate(system, t_end, **how)
    switches = [
        (t, i, edge, states[i])
        for t, _, _, states, edges in rows
        for i, edge in enumerate(edges)
        if edge is not None
    ]
    assert switches == [
        (float(each.t), int(each.element), str(each.edge), spelled(str(each.target)))
        for each in trace.transitions
    ]
    assert len(switches) > least
    assert rows[-1][2] == trace.contact(contact.name).F[-1]


# --------------------------------------------------------------------------- by itself
ISOLATED = """
import runpy, sys
sys.argv = ["file.py", *sys.argv[1:]]
runpy.run_path("file.py", run_name="__main__")
print(sorted({name.partition(".")[0] for name in sys.modules} & {"numpy", "gms_fsm", "plots"}))
"""


def alone(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run an exported file in a process that has not imported this package."""
    command = [sys.executable, "-c", ISOLATED, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)


@pytest.mark.slow
def test_it_runs_by_itself_and_prints_its_switches(tmp_path: Path) -> None:
    export(stick_slip("signed"), "transitions", tmp_path, name="file")
    done = alone(tmp_path, "25", "0.01")
    assert done.returncode == 0, done.stderr
    *lines, last, modules = done.stdout.splitlines()
    assert modules == "[]"
    assert lines[0].endswith("element 1: break_away_forward -> slip")
    assert last.startswith(f"{len(lines)} switches; F = ")
    assert len(lines) == 16
    text = (tmp_path / "README-file-transitions.md").read_text(encoding="utf-8")
    for wanted in ("python file.py", "States: stick, slip", "not located", "k, sigma, C, v_c"):
        assert wanted in text


def test_a_chart_without_numbers_asks_for_them(tmp_path: Path) -> None:
    path, *_ = export(GMS_ELEMENT["signed"], "transitions", tmp_path, name="file")
    done = alone(tmp_path)
    assert done.returncode == 1
    assert "no numbers: fill in VALUES, one mapping for each element" in done.stderr
    values = [{"k": 1.0, "sigma": 0.0, "C": 0.1, "v_c": 1e-6}]
    rows = list(imported(path).run(lambda t: {"v": 1.0, "s": 0.5}, 1.0, 0.01, values=values))
    assert rows[-1][3] == ["slip"]
