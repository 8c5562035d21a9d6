"""Claim: a whole system as MATLAB or Modelica has the switches of `simulate`, near its motion."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Body, ChartModel, Contact, Sampled, System, export, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.targets.modelica import modelica
from tests.exporters.frictions import scenario


def pushed_mass() -> System:
    """Return a mass on a spring, which a force that a sampler changes pushes over a pad."""
    pad = ChartModel(CHARTS["maxwell-slip"], {"k": 10.0, "F_c": 0.2})
    return System(
        "mass",
        bodies=(Body("mass", inertia="m", force="f + 0.3 * sin(6 * t)"),),
        contacts=(Contact("pad", pad),),
        sampled=(Sampled("push", period=0.1, updates={"f": "0.3 - 2 * x"}),),
        numbers={"m": 0.5},
    )


@pytest.mark.slow
def test_octave_runs_a_system(tmp_path: Path) -> None:
    octave = pytest.importorskip("tests.exporters.octave").OCTAVE
    if octave is None:
        pytest.skip("octave-cli is not installed")
    system, t_end = pushed_mass(), 1.0
    export(system, "matlab", tmp_path, name="mass")
    shown = "printf('%.17g ', log.x(end), rows(log.t), rows(log.switches.pad))"
    runs = f"log = mass({t_end}, 0.02); {shown}"
    command = [octave, "--norc", "--quiet", "--eval", runs]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    x, rows, switches = map(float, done.stdout.split())
    trace = simulate(system, t_end, rtol=1e-10)
    assert rows == 51
    assert switches == len(trace.transitions) > 0
    assert x == pytest.approx(trace.body("mass").x[-1], rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "t_end"), [("servo", 0.02)])
def test_rumoca_runs_a_system(name: str, t_end: float) -> None:
    rumoca = pytest.importorskip("rumoca")
    system = scenario(name)
    text = modelica(Subject.of(system, "modelica", name=name))[f"{name}.mo"]
    config = rumoca.SimConfig(solver="auto", rtol=1e-9, atol=1e-14)
    found = rumoca.Session().loads(text, model=name)
    result = found.simulate((0.0, t_end), dt=t_end / 10, config=config)
    trace = simulate(system, t_end, rtol=1e-10)
    x = trace.body(system.bodies[-1].name).x[-1]
    assert np.asarray(result["x_l"])[-1] == pytest.approx(x, abs=1e-10)


def test_a_friction_between_flanges_pulls_both() -> None:
    files = modelica(Subject.of(scenario("servo").contact("bearing"), "modelica", name="pad"))
    text = files["pad_flanges.mo"]
    assert "model pad_translational" in text
    assert "friction.v = der(phi_rel);" in text
    for line in ("flange_b.f = friction.F;", "flange_a.f = -friction.F;"):
        assert line in text
