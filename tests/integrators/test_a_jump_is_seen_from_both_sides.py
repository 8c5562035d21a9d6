"""At a jump of a signal its left value is used before, its right value after, at full order."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    FrictionState,
    Prescribed,
    Slider,
    State,
    Transition,
    simulate,
)
from tests.helpers import FASTEST, non_drifting, one_element

ENGINES = ("machines", "ifelse", *(("compiled",) if FASTEST == "compiled" else ()))


def test_velocity_step_moves_z_exactly() -> None:
    """Stick integrates v exactly, so a step in v leaves no error at all, whatever the step."""
    ramps = [(0, 0.1), (1.05, 0.1), (1.05, -0.3), (3, -0.3)]
    for options in ({}, {"method": "rk4", "step": 0.2}, {"method": "euler", "step": 0.2}):
        trace = simulate(one_element("signed", F_s=9, F_c=9), Prescribed(ramps), 2.0, **options)
        assert trace.z[-1, 0] == pytest.approx(0.1 * 1.05 - 0.3 * 0.95, abs=1e-14)
        at = np.flatnonzero(np.abs(trace.t - 1.05) < 1e-12)
        assert trace.v[at].tolist() == [0.1, -0.3]


@pytest.mark.slow
def test_force_step_keeps_the_order_of_the_method() -> None:
    """The error of rk4 across a force step falls with the fourth power of the step."""
    model, _ = non_drifting("published")
    rig = Slider(1.0, [(0, 0), (0.33, 0), (0.33, 0.2), (2, 0.2)])
    exact = simulate(model, rig, 1.0, rtol=1e-12, atol=1e-14).x[-1]
    errors = [
        abs(simulate(model, rig, 1.0, method="rk4", step=h).x[-1] - exact) for h in (0.02, 0.01)
    ]
    assert errors[1] < errors[0] / 12


@pytest.mark.parametrize("engine", ENGINES)
def test_what_the_value_before_a_jump_switches_is_switched(engine: str) -> None:
    """v falls to 0 and jumps to 0.9 at t = 1.5: the chart halts, and starts again."""
    chart = Chart(
        "halts at rest",
        inputs=("v",),
        variables=("z",),
        parameters=(),
        states=(State("go", flow={"z": "v"}), State("rest", flow={"z": "v / 2"})),
        transitions=(Transition("halt", "go", "rest", guard="v <= 0"),
                     Transition("start", "rest", "go", guard="v > 0")),
        outputs={"F": "z + v / 10"},
    )  # fmt: skip
    model = ChartModel(chart, {})
    trace = simulate(model, Prescribed(([0, 1.5, 1.5, 3], [1, 0, 0.9, 0.9])), 3.0, engine=engine)
    log = [(float(each.t), str(each.edge), float(each.v)) for each in trace.transitions]
    assert log == [(1.5, "halt", 0.0), (1.5, "start", 0.9)]
    assert trace.v[np.abs(trace.t - 1.5) < 1e-12].tolist() == [0.0, 0.9, 0.9, 0.9]
    friction = FrictionState(model, engine=None if engine == FASTEST else "ifelse")
    friction.advance(1.0, 0.0, 1.5)
    assert [each.edge for each in friction.switches] == ["halt"]
    assert friction.advance(0.9, 0.9, 1.5) == trace.F[-1]


def test_a_requested_time_on_a_jump_is_right_continuous() -> None:
    ramps = [(0, 0.1), (1, 0.1), (1, -0.3), (3, -0.3)]
    trace = simulate(one_element("signed"), Prescribed(ramps), 2.0, t_eval=[0.5, 1.0, 2.0])
    assert trace.v.tolist() == [0.1, -0.3, -0.3]
