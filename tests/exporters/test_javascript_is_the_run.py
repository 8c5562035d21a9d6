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
    Trace,
    Transition,
    export,
)
from gms_fsm.systems.system import system_of
from tests.corpus import run
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

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not shutil.which("node"), reason="there is no node"),
]
SCENARIOS = ROOT / "gms_fsm/scenarios"
SEED = 11


def pulled(**numbers: float) -> System:
    """A mass pulled over four elements."""
    return System(
        "pulled",
        bodies=(Body("mass", inertia="m", force="k * (V * t - x)"),),
        contacts=(Contact("pad", stick_slip("signed")),),
        numbers={"m": 1.0, "k": 2.0, "V": 0.1} | numbers,
    )


def same(case: Case, folder: Path, **more: Any) -> Trace:
    """Assert that a run has the same bits in JavaScript, and return it."""
    trace, _ = case.run("ifelse")
    assert trace is not None
    assert differences(case, trace, in_javascript(case, folder, **more)) == []
    return trace


@pytest.mark.matrix
@pytest.mark.parametrize("name", matrix(["ball_screw_table", "servo"], ["servo"]))
def test_a_scenario_has_the_same_bits_in_c_and_in_javascript(name: str) -> None:
    compilers = [(each, "-O2") for each in COMPILERS[:1]]
    assert check(scenario(SCENARIOS / f"{name}.toml"), compilers, ("node",)) == []


@pytest.mark.slow
@pytest.mark.parametrize("index", matrix([0, 1], [0]))
def test_a_random_system_has_the_same_bits(index: int, tmp_path: Path) -> None:
    """Repeat a difference with: python -m tests.soak.platforms --seed 11 --first INDEX."""
    same(random_case(SEED, index), tmp_path)


def test_functions_that_jump_have_the_same_bits(tmp_path: Path) -> None:
    friction, rig = run("functions that jump").subject
    trace = same(Case("jumps", system_of(friction, rig), 9.0, {}), tmp_path)
    assert len(trace.transitions) > 10


@pytest.mark.matrix
def test_events_and_conditions_that_last_have_the_same_bits(tmp_path: Path) -> None:
    friction, rig = run("conditions that last").subject
    (system,) = run("events at given times").subject
    for name, each in (("lasting", system_of(friction, rig)), ("events", system)):
        assert len(same(Case(name, each, 2.0, {}), tmp_path / name).transitions) > 5


@pytest.mark.matrix
def test_columns_grow(tmp_path: Path) -> None:
    case = dataclasses.replace(scenario(SCENARIOS / "pulled_mass.toml"), t_end=6.0)
    trace = same(case, tmp_path)
    assert len(trace) > 1024
    assert len(trace.transitions) > 256


@pytest.mark.matrix
def test_tolerances_follow_the_numbers_and_another_run_is_noticed(tmp_path: Path) -> None:
    case, numbers = Case("pulled", pulled(), 5.0, {}), "{ pad_F_s: 3, pad_v_s: 0.01, m: 0.2 }"
    model = stick_slip("signed")
    curve = dataclasses.replace(model.stribeck, F_s=3.0, v_s=0.01)
    other = GMS(dataclasses.replace(model.parameters, stribeck=curve), law="signed")
    system = dataclasses.replace(pulled(m=0.2), contacts=(Contact("pad", other),))
    made = in_javascript(case, tmp_path, numbers=numbers)
    trace, _ = dataclasses.replace(case, system=system).run("ifelse")
    assert trace is not None
    assert differences(case, trace, made) == []
    near, _ = dataclasses.replace(case, system=system, settings={"rtol": 1.0000001e-6}).run()
    assert near is not None
    assert differences(case, near, made) != []


def test_a_run_that_cannot_go_on_says_so_and_keeps_its_rows(tmp_path: Path) -> None:
    case = Case("pulled", pulled(), 60.0, {"max_steps": 200})
    trace, end = case.run("ifelse")
    assert trace is not None
    assert "StepLimitError" in end
    made = in_javascript(case, tmp_path)
    assert made["end"] == f"t = {float(trace.t[-1])!r} s: it needs more than 200 steps"
    assert differences(case, trace, made) == []


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


def winding(k: float) -> ChartModel:
    """Return elements whose first deflections follow from a number."""
    chart = Chart(
        "winding down",
        parameters=(Parameter("k", "N/m"),),
        inputs=("v",),
        variables=("z",),
        states=(
            State("stick", entry={"z": "2.0 * k"}, flow={"z": "v"}),
            State("slip", flow={"z": "-z"}),
        ),
        transitions=(
            Transition("go", "stick", "slip", "abs(z) > 3"),
            Transition("back", "slip", "stick", "abs(z) < 1"),
        ),
        outputs={"F": "z"},
    )
    return ChartModel(chart, {"k": [k, 0.9]}, n=2)


def bank(k: float) -> GMS:
    more: dict[str, Any] = {"sigma_2": 0.1, "stribeck": Stribeck(0.4, 1.5, 1e-3), "v_c": 1e-6}
    return GMS(GMSParameters([k, 0.9], [0.3, 0.4], [0.1, 0.05], **more), law="signed")


@pytest.mark.every(2)
@pytest.mark.parametrize("model", [bank, winding])
def test_one_friction_is_stepped_as_in_python(model: Any, tmp_path: Path) -> None:
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
    assert found["first"]["z"] == ([0.0, 0.0] if model is bank else [14.0, 1.8])
