"""The text printed by ``gms-fsm code`` is a standalone program that computes what the engine does.

It runs in a fresh Python that sees neither gms-fsm nor numpy (``python -I -S``), on states from a
run, and its flow, its choice of edges and its observed values are compared to the last bit.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    LuGre,
    Prescribed,
    PulledSlider,
    Slider,
    State,
    Stribeck,
    Transition,
    simulate,
)
from gms_fsm.app import paper
from gms_fsm.errors import ParameterError
from gms_fsm.lowering.generated import standalone
from gms_fsm.lowering.program import Program, lower
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from tests.helpers import stick_slip
from tests.scenario_files import CommandLine

pytestmark = pytest.mark.slow

RIGS: dict[str, Rig] = {
    "prescribed": Prescribed(paper.VELOCITY),
    "slider": Slider(1.0, paper.FORCE),
    "pulled": PulledSlider(1.0, 2.0, 0.1),
}
NOT_MAIN = '__name__ = "imported"\n'
# The computations of a fresh process for each state, printed without losing a bit.
ASK = """
import json, sys
results = []
for t, y, mode, held in STATES:
    dy, edges, seen = [0.0] * len(y), [0] * len(mode), [0.0] * SEEN
    flow(t, y, mode, held, P, dy)
    switch(t, y, mode, P, [0] * len(mode), edges)
    observe(t, y, mode, LIVE, P, seen)
    live = [0.0] * len(y)
    flow_live(t, y, mode, held, P, live)
    results.append([dy, edges, seen, live])
print(json.dumps([[[float(u).hex() for u in part] for part in row] for row in results]))
print(sorted(name for name in sys.modules if name.partition(".")[0] in ("numpy", "gms_fsm")))
"""


def _states(model: Model, rig: Rig, program: Program, t_end: float) -> list[list[Any]]:
    """Return some states of a run, with the signs frozen there."""
    trace = simulate(model, rig, t_end)
    rows = range(0, len(trace), max(1, len(trace) // 40))
    states = []
    for row in rows:
        t, y, mode = float(trace.t[row]), trace.rows.y[row].tolist(), trace.rows.mode[row].tolist()
        held, watch = [0.0] * program.held, [0] * len(program.strict)
        program.functions["arm"](t, y, mode, program.p, held, watch)
        states.append([t, y, mode, held])
    return states


def _engine(program: Program, states: list[list[Any]], seen: int) -> list[Any]:
    f, p = program.functions, program.p
    results = []
    for t, y, mode, held in states:
        dy, edges, out, live = [0.0] * len(y), [0] * len(mode), [0.0] * seen, [0.0] * len(y)
        f["flow"](t, y, mode, held, p, dy)
        f["switch"](t, y, mode, p, program.calm, edges)
        f["observe"](t, y, mode, program.live, p, out)
        f["flow_live"](t, y, mode, held, p, live)
        results.append([[float(u).hex() for u in part] for part in (dy, edges, out, live)])
    return results


def _compare(model: Model, rig: Rig, text: str, t_end: float) -> None:
    program = lower(model, rig)
    states = _states(model, rig, program, t_end)
    seen = 2 + (2 + len(model.chart.variables)) * model.n
    given = f"STATES, P, SEEN, LIVE = {states!r}, {program.p!r}, {seen}, {program.live!r}\n"
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", NOT_MAIN + text + "\n\n" + given + ASK],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    numbers, modules = done.stdout.splitlines()
    assert modules == "[]", "it is standalone"
    assert json.loads(numbers) == _engine(program, states, seen)


@pytest.mark.parametrize(
    ("law", "rig"), [("signed", "prescribed"), ("published", "slider"), ("signed", "pulled")]
)
def test_what_the_command_line_prints(law: Any, rig: str, gms_fsm: CommandLine) -> None:
    printed = gms_fsm("code", "--law", law, "--rig", rig)
    assert printed.code == 0, printed.err
    model = GMS(GMSParameters.paper("stick-slip"), law=law)
    _compare(model, RIGS[rig], printed.out, 30.0)


def _rough() -> ChartModel:
    chart = Chart(
        "everything",
        ("t", "x", "v", "s"),
        ("z", "w"),
        ("k", "C"),
        (
            State("one", {"z": "min(v, 0.5) + sqrt(abs(x))", "w": "max(-w, cos(t))"}),
            State("two", {"z": "C * (sgn(v) - z / s)", "w": "tanh(z)**1.5 - w"}, {"w": "0"}),
        ),
        (
            Transition("go", "one", "two", "abs(z) >= s", {"z": "0.5 * z"}),
            Transition("back", "two", "one", "abs(v) <= 0.01"),
        ),
        {"F": "k * z + exp(-w) * dz"},
    )
    return ChartModel(chart, {"k": [1.0, 2.0], "C": 0.1}, n=2, stribeck=Stribeck(1.0, 1.5, 0.1))


@pytest.mark.parametrize(
    ("model", "rig", "t_end"),
    [
        (stick_slip("signed"), Prescribed([(0, 0), (1, 0.3), (3, -0.3)]), 4.0),
        (stick_slip("signed"), Slider(1.0, ([0.0, 1.0, 5.0], [0.0, 3.0, -3.0])), 4.0),
        (_rough(), Prescribed("0.5*abs(sin(t))"), 3.0),
        (
            LuGre(sigma_0=1e3, sigma_1=30.0, sigma_2=0.4, stribeck=Stribeck(1, 1.5, 0.01)),
            Slider(1.0, "sgn(sin(t))"),
            3.0,
        ),
    ],
    ids=["ramps", "record", "every function", "LuGre"],
)
def test_printed_programs_of_other_models(model: Model, rig: Rig, t_end: float) -> None:
    _compare(model, rig, standalone(lower(model, rig).source), t_end)


def test_only_what_is_used_is_in_it() -> None:
    text = standalone(lower(stick_slip("signed"), RIGS["pulled"]).source)
    assert "from math import nan\n" in text
    assert "def exp(x):" in text
    assert "def log(x):" not in text
    assert "def sgn(u):" in text
    assert "piecewise_linear" not in text
    assert text.startswith("# GMS element, signed law")


def test_a_python_function_cannot_be_printed() -> None:
    source = lower(stick_slip("signed"), Prescribed(lambda t: 0.1 * t)).source
    with pytest.raises(
        ParameterError, match=r"v_signal: a Python function.*expression or as corners"
    ):
        standalone(source)
