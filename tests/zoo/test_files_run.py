"""Each chart of the zoo runs from a file by ``gms-fsm run``, with the bits of a run in Python."""

from __future__ import annotations

from pathlib import Path

import pytest

from gms_fsm import Trace
from gms_fsm.app.scenario import load_scenario
from tests.helpers import same_bits
from tests.scenario_files import CommandLine
from tests.zoo import zoo_cases

SCENARIO = """
[rig]
{rig}
[run]
t_end = {t_end}
engine = "ifelse"
[output]
figures = []
[model]
chart = "{name}"
{model}
"""
PULLED = 'kind = "pulled"\nmass = 1.0\nstiffness = 2.0\nspeed = 0.1'
DRIVEN = 'kind = "prescribed"\nvelocity = "3e-4 * cos(2 * t)"'
CURVE = "stribeck = { F_c = 1.0, F_s = 1.5, v_s = 0.05, delta = 1.0 }"
BRISTLE = f"sigma_0 = 1e3\nsigma_1 = 31.623\nsigma_2 = 0.4\n{CURVE}"
# Name, rig, end, model, and the least number of transitions.
FILES = (
    (
        "modelica",
        PULLED,
        20.0,
        "mu_c = 0.1\nmu_s = 0.15\nv_s = 0.01\ndelta = 2.0\npeak = 1.0\nsigma_2 = 0.1\n"
        'inputs = { N = "10 + sin(t)" }',
        4,
    ),
    ("elasto-plastic", DRIVEN, 6.0, f"z_ba = 1e-5\n{BRISTLE}", 4),
    ("maxwell-slip", DRIVEN, 6.0, "k = [4e4, 1e4]\nF_c = [0.5, 0.5]", 4),
)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "rig", "t_end", "model", "least"), FILES)
def test_a_scenario_file_runs(
    name: str, rig: str, t_end: float, model: str, least: int, gms_fsm: CommandLine, tmp_path: Path
) -> None:
    text = SCENARIO.format(name=name, rig=rig, t_end=t_end, model=model)
    Path("zoo.toml").write_text(text)
    done = gms_fsm("run", "zoo.toml", "-o", "out")
    assert done.code == 0, done.err
    saved = Trace.load("out/trace.npz")
    assert len(saved.transitions) >= least
    same_bits(saved, load_scenario("zoo.toml").simulate())


SYSTEM = """
name = "brake"
[[body]]
name = "disc"
inertia = 1.0
force = "2 * sin(t)"
[[contact]]
name = "pad"
chart = "modelica"
inputs = { N = "10 * cos(0.3 * t)" }
values = { mu_c = 0.1, mu_s = 0.15, v_s = 0.1, delta = 2.0, peak = 1.2, sigma_2 = 0.0 }
[run]
t_end = 20.0
"""


def test_a_system_file_names_its_normal_force(gms_fsm: CommandLine, tmp_path: Path) -> None:
    Path("brake.toml").write_text(SYSTEM)
    done = gms_fsm("run", "brake.toml", "-o", "out", "--set", "output.figures=[]")
    assert done.code == 0, done.err
    edges = set(Trace.load("out/trace.npz").transitions.edge.tolist())
    assert edges >= {"release_forward", "move_forward", "stop_forward", "lift"}


@pytest.mark.slow
@pytest.mark.parametrize("name", zoo_cases.CASES)
def test_a_chart_is_drawn_and_printed_as_code(
    name: str, gms_fsm: CommandLine, tmp_path: Path
) -> None:
    assert gms_fsm("chart", name, "-o", "chart.dot").code == 0
    assert Path("chart.dot").stat().st_size > 500
    done = gms_fsm("code", name, "--rig", "slider")
    assert done.code == 0, done.err
    assert "def flow" in done.out
