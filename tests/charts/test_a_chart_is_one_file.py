"""A new chart needs only one file in ``gms_fsm/charts``: every command then knows it.

Tested in a copy of the packages, in a separate process that answers one command after another.
"""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np
import pytest

from gms_fsm import Sweep, Trace
from tests.package_copy import Copy, packages_with

pytestmark = pytest.mark.slow

PAGE = '''
"""Springs that yield: elastic up to a force, then plastic. The numbers are chosen by us."""

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

YIELDING = Chart(
    "yielding spring",
    inputs=("v",),
    variables=("z",),
    parameters=(
        Parameter("k", "N/m", "> 0", meaning="stiffness"),
        Parameter("F_y", "N", "> 0", meaning="yield force"),
        Parameter("F_z", "N", ">= F_y", meaning="force that breaks it"),
        Parameter("v_c", "m/s", "> 0", per_element=False),
    ),
    states=(
        State("elastic", flow={"z": "v"}),
        State("plastic", flow={"z": "0"}),
    ),
    transitions=(
        Transition("yield_forward", "elastic", "plastic", guard="k * z >= F_y and v > v_c"),
        Transition("yield_backward", "elastic", "plastic", guard="k * z <= -F_y and v < -v_c"),
        Transition("return_forward", "plastic", "elastic", guard="z > 0 and v < 0"),
        Transition("return_backward", "plastic", "elastic", guard="z < 0 and v > 0"),
    ),
    outputs={"F": "k * z"},
)
CHARTS = (
    Entry(
        "x",
        YIELDING,
        Demonstration({"k": (100.0, 50.0), "F_y": 1.0, "F_z": 9.0, "v_c": 1e-6}, "chosen by us"),
    ),
)
'''
SCENARIO = """
title = "yielding"

[model]
chart = "x"
k = [100.0, 50.0]
F_y = 1.0
F_z = 9.0
v_c = 1e-6
sigma_2 = 0.5

[rig]
kind = "prescribed"
velocity = "0.1*sin(t)"

[run]
t_end = 10.0

[output]
figures = []
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Copy]:
    """A copy of the packages with one additional file, and a scenario next to it."""
    with packages_with(PAGE, "x.py", tmp_path_factory.mktemp("copy")) as made:
        (made.folder / "x.toml").write_text(SCENARIO, encoding="utf-8")
        yield made


def test_chart_lists_and_draws_it(copy: Copy) -> None:
    listed = copy.gms_fsm("chart", "--list")
    assert "x: yielding spring\n" in listed
    assert "  F_z      force that breaks it, N, >= F_y; one number per element\n" in listed
    copy.gms_fsm("chart", "x", "-o", "x.mmd", "--elements", "2")
    drawn = (copy.folder / "x.mmd").read_text(encoding="utf-8")
    assert 'title: "yielding spring"' in drawn
    assert "s2_plastic --> s1_elastic : 1 [z" in drawn


def test_check_proves_it_within_its_rules(copy: Copy) -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    report = copy.gms_fsm("check", "x")
    assert "assumed: k > 0, F_y > 0, v_c > 0\n" in report
    assert "0 refuted, 0 undecided" in report
    assert "x, and as demonstrations" in " ".join(copy.gms_fsm("check", "--list").split())


def test_run_runs_a_scenario_file_of_it(copy: Copy) -> None:
    copy.gms_fsm("run", "x.toml", "-o", "out")
    trace = Trace.load(copy.folder / "out" / "trace.npz")
    assert [str(edge) for edge in trace.transitions.edge[:3]] == [
        "yield_forward",
        "yield_forward",
        "return_forward",
    ]
    assert np.abs(trace.F_elements).max() == pytest.approx(1.0)
    assert trace.model.chart.unit("F_y") == "N"
    summary = (copy.folder / "out" / "summary.md").read_text(encoding="utf-8")
    assert "k = [100, 50] N/m, F_y = 1 N, F_z = 9 N, v_c = 1e-06 m/s, sigma_2 = 0.5 Ns/m" in summary


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("model.F_y=-1", "[model] F_y is -1.0; it must be > 0"),
        ("model.F_z=0.5", "force that breaks it must be at least the yield force (F_z >= F_y)"),
        ("model.v_c=[1, 2]", "model.v_c"),
        ("model.F_q=1", "unknown key; did you mean 'F_z'? valid here: chart, n, k, F_y, F_z, v_c"),
    ],
)
def test_a_mistake_in_the_file_is_named_by_its_rule(copy: Copy, setting: str, words: str) -> None:
    assert words in copy.gms_fsm("run", "x.toml", "-o", "none", "--set", setting, code=2)


def test_sweep_varies_it(copy: Copy) -> None:
    wanted = ("--over", "F_y=0.5:2:3", "--over", "sigma_2=0:1:2", "--engine", "machines")
    copy.gms_fsm("sweep", "x.toml", *wanted, "-o", "swept")
    found = Sweep.load(copy.folder / "swept" / "sweep.npz")
    assert found.parameters["F_y"].tolist() == [0.5, 0.5, 1.25, 1.25, 2.0, 2.0]
    assert found.outcome.tolist() == ["ok"] * 6
    assert np.abs(found.z[:, 0]).tolist() == pytest.approx(
        np.minimum(np.abs(found.z[:, 0]), found.parameters["F_y"] / 100).tolist()
    )
    said = copy.gms_fsm("sweep", "x.toml", "--over", "F_c=1:2:2", code=2)
    assert "k [N/m], F_y [N], F_z [N], v_c [m/s], sigma_2 [Ns/m]\n" in said


def test_debug_steps_through_it(copy: Copy) -> None:
    told = copy.gms_fsm("debug", "x.toml", said="next\nstep\nwhy 1\nquit\n")
    assert "element 1: elastic -> plastic by yield_forward" in told
    assert "return_forward does not fire: v < 0 is false by 0.0" in told


def test_code_and_the_schema_know_it(copy: Copy) -> None:
    assert copy.gms_fsm("code", "x").startswith("# yielding spring, prescribed velocity\n")
    schema = json.loads(copy.gms_fsm("schema"))
    (table,) = (t for name, t in schema["$defs"].items() if name.endswith("x"))
    assert table["properties"]["F_y"]["description"].startswith("yield force, N, > 0")
