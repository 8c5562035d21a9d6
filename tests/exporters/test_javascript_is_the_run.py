"""The JavaScript module of a system computes the bits of `simulate`, and says what is wrong."""

from __future__ import annotations

import dataclasses
import itertools
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    FrictionState,
    GMSParameters,
    Parameter,
    State,
    Stribeck,
    System,
    Transition,
    export,
)
from tests.helpers import ROOT, matrix, stick_slip
from tests.soak.platforms import (
    COMPILERS,
    Case,
    check,
    differences,
    in_javascript,
    ran,
    random_case,
    scenario,
)

needs_node = pytest.mark.skipif(not shutil.which("node"), reason="there is no node")
SCENARIOS = ROOT / "scenarios"
SEED = 11


def pulled(**numbers: float) -> System:
    """A mass pulled over four elements."""
    return System(
        "pulled",
        bodies=(Body("mass", inertia="m", force="k * (V * t - x)"),),
        contacts=(Contact("pad", stick_slip("signed")),),
        numbers={"m": 1.0, "k": 2.0, "V": 0.1} | numbers,
    )


@needs_node
@pytest.mark.slow
@pytest.mark.parametrize("name", matrix(["ball_screw_table", "servo"], ["servo"]))
def test_a_scenario_has_the_same_bits_in_c_and_in_javascript(name: str) -> None:
    differ = check(scenario(SCENARIOS / f"{name}.toml"), [(each, "-O2") for each in COMPILERS[:1]],
                   ("node",))  # fmt: skip
    assert differ == []


@needs_node
@pytest.mark.slow
@pytest.mark.parametrize("index", range(2))
def test_a_random_system_has_the_same_bits_in_javascript(index: int, tmp_path: Path) -> None:
    case = random_case(SEED, index)
    trace, _ = case.run("ifelse")
    assert trace is not None
    differ = differences(case, trace, in_javascript(case, tmp_path))
    assert differ == []


@needs_node
def test_another_run_is_noticed(tmp_path: Path) -> None:
    case = Case("pulled", pulled(), 5.0, {})
    trace, _ = dataclasses.replace(case, settings={"rtol": 1.0000001e-6}).run("ifelse")
    assert trace is not None
    assert differences(case, trace, in_javascript(case, tmp_path)) != []


@needs_node
def test_columns_grow(tmp_path: Path) -> None:
    case = dataclasses.replace(scenario(SCENARIOS / "pulled_mass.toml"), t_end=300.0)
    trace, _ = case.run("ifelse")
    assert trace is not None
    assert len(trace) > 1024
    assert len(trace.transitions) > 256
    assert differences(case, trace, in_javascript(case, tmp_path)) == []


@needs_node
def test_tolerances_follow_the_numbers(tmp_path: Path) -> None:
    case, numbers = Case("pulled", pulled(), 5.0, {}), "{ pad_F_s: 3, pad_v_s: 0.01, m: 0.2 }"
    model = stick_slip("signed")
    curve = dataclasses.replace(model.stribeck, F_s=3.0, v_s=0.01)
    other = dataclasses.replace(model.parameters, stribeck=curve)
    system = dataclasses.replace(
        pulled(m=0.2), contacts=(Contact("pad", GMS(other, law="signed")),)
    )
    trace, _ = dataclasses.replace(case, system=system).run("ifelse")
    assert trace is not None
    assert differences(case, trace, in_javascript(case, tmp_path, numbers=numbers)) == []


@needs_node
def test_a_run_that_cannot_go_on_says_so_and_keeps_its_rows(tmp_path: Path) -> None:
    case = Case("pulled", pulled(), 60.0, {"max_steps": 200})
    trace, end = case.run("ifelse")
    assert trace is not None
    assert "StepLimitError" in end
    made = in_javascript(case, tmp_path)
    assert made["end"] == f"t = {float(trace.t[-1])!r} s: it needs more than 200 steps"
    assert differences(case, trace, made) == []


@needs_node
def test_a_wrong_number_is_named(tmp_path: Path) -> None:
    export(pulled(), "js", tmp_path, t_end=1.0)
    program = tmp_path / "program.mjs"
    program.write_text(
        'import { run } from "./pulled.mjs";\n'
        "for (const each of [{ nope: 1 }, { pad_F_c: NaN }, { pad_k: [1, 2] }])\n"
        "    try { run(each); } catch (error) { console.log(error.name, error.message); }\n"
    )
    nope, nan, few = ran(program).splitlines()
    assert nope.startswith('FrictionError there is no number "nope"; there are: pad_F_c,')
    assert nan.startswith("FrictionError pad_F_c must be a finite number, not NaN")
    assert few.startswith("FrictionError pad_k must be 4 finite numbers, not 1,2")


# --------------------------------------------------------------------------- step by step
STEPS = """
import { Friction } from "./it.mjs";
let friction = new Friction(NUMBERS), last = V[0];
const found = { F: [], states: [], switches: 0, first: friction.outputs };
for (const v of V.slice(1)) {
    const other = friction.copy();
    other.advance({ v: 9 }, { v: -9 }, 0.3);
    const { F, state } = friction.advance({ v: last }, { v }, 0.1);
    found.F.push(F);
    found.states.push(state);
    found.switches += friction.log.length;
    last = v;
}
try { friction.advance({ v: 0 }, { v: NaN }, 0.1); } catch (error) { found.nan = error.message; }
try { friction.advance({ v: 0 }, { v: 0 }, -1); } catch (error) { found.back = error.message; }
found.total = friction.switches;
console.log(JSON.stringify(found));
"""
VELOCITIES = np.cumsum(np.random.default_rng(3).normal(size=60)) * 0.3


def stepped(folder: Path, model: Any, numbers: str) -> dict[str, Any]:
    export(model, "js", folder, name="it")
    text = STEPS.replace("NUMBERS", numbers)
    program = folder / "program.mjs"
    program.write_text(f"const V = {VELOCITIES.tolist()!r};\n{text}")
    found: dict[str, Any] = json.loads(ran(program))
    return found


@needs_node
def test_one_friction_is_stepped_as_in_python(tmp_path: Path) -> None:
    def model(k: float) -> GMS:
        more: dict[str, Any] = {"sigma_2": 0.1, "stribeck": Stribeck(0.4, 1.5, 1e-3), "v_c": 1e-6}
        return GMS(GMSParameters([k, 0.9], [0.3, 0.4], [0.1, 0.05], **more), law="signed")

    found, friction = stepped(tmp_path, model(0.7), "{ k: [7, 0.9] }"), FrictionState(model(7.0))
    forces, states, switches = [], [], 0
    for v0, v1 in itertools.pairwise(VELOCITIES):
        forces.append(friction.advance(v0, v1, 0.1))
        switches += len(friction.switches)
        states.append([("stick", "slip").index(each) for each in friction.states])
    assert found["F"] == forces
    assert found["states"] == states
    assert found["switches"] == found["total"] == switches > 0
    assert found["nan"] == "start and end must have finite numbers: v"
    assert found["back"].startswith("dt is -1 s: it must not be negative")


@needs_node
def test_the_entry_of_the_default_state_follows(tmp_path: Path) -> None:
    chart = Chart(
        "winding down",
        parameters=(Parameter("z_0", "m"),),
        inputs=("v",),
        variables=("z",),
        states=(State("only", entry={"z": "2.0 * z_0"}), State("never")),
        transitions=(Transition("ends", "only", "never", "z > 1e9"),),
        outputs={"F": "z"},
    )
    found = stepped(tmp_path, ChartModel(chart, {"z_0": 0.5}), "{ z_0: -3 }")
    assert found["first"]["z"] == [-6.0]
