"""Steps end on corners and jumps in outputs and in a rig's equation, just as on those in flows.

Before, a run with `F = "F_c * sgn(v)"` reached t = 0.015 of 5 s and recorded gigabytes; a corner in
a rig's text cost the method its order.
"""

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, Slider, State, simulate
from gms_fsm.lowering.program import lower
from gms_fsm.systems.signals import as_signal
from tests.helpers import matrix, same_bits

ENGINES = ["machines", "ifelse", "compiled"]


def force(text: str, **parameters: float) -> ChartModel:
    chart = Chart(
        "a force",
        inputs=("v", "x", "t"),
        variables=("z",),
        parameters=tuple(parameters),
        states=(State("on", flow={"z": "v"}),),
        transitions=(),
        outputs={"F": text},
    )
    return ChartModel(chart, parameters)


class Buffer:
    """A mass that meets a spring at x = gap; the chart has its own parameter `gap`."""

    title = "mass and buffer"
    acceleration = "(push - stiffness * max(x - gap, 0) - F) / mass"

    def __init__(self) -> None:
        self.signals = {"push": as_signal("0")}
        self.numbers = {"mass": 1.0, "stiffness": 100.0, "gap": 0.5}


def needs(engine):
    if engine == "compiled":
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    return engine


@pytest.mark.slow
@pytest.mark.parametrize("engine", matrix(ENGINES, ["machines", "ifelse"]))
def test_steps_end_exactly_on_a_buffer_in_a_rigs_equation(engine):
    """Free flight at 1 m/s, half a swing of 10 rad/s in the spring, flight back."""
    trace = simulate(
        force("0 * gap", gap=7.0),
        Buffer(),
        2.0,
        engine=needs(engine),
        initial={"v": 1.0},
        rtol=1e-9,
    )
    assert np.abs(trace.t - 0.5).min() < 1e-12
    assert np.abs(trace.t - (0.5 + np.pi / 10)).min() < 1e-8
    assert trace.v[-1] == pytest.approx(-1.0, abs=1e-8)
    assert trace.x[-1] == pytest.approx(0.5 - (2.0 - 0.5 - np.pi / 10), abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "place", "engine"),
    [
        ("c * abs(x - 0.3)", 0.3, "machines"),
        ("c * max(x, 0.3)", 0.3, "machines"),
        ("min(c * z, 0.3)", 0.3, "compiled"),
        ("c * abs(dz - 0.5 * x)", None, "machines"),
    ],
)
def test_corners_of_an_output_are_rows(text, place, engine):
    model, rig = force(text, c=1.0), Slider(1.0, "2")
    trace = simulate(model, rig, 1.0, engine=needs(engine), initial={"v": 0.1})
    if place is not None:
        assert np.abs(trace.x - place).min() < 1e-14
    same_bits(trace, simulate(model, rig, 1.0, engine="ifelse", initial={"v": 0.1}))


def test_the_order_of_a_method_survives_a_corner_of_the_force():
    """Fixed steps of RK4 over a stiffness that changes at x = 0.3: error by h^4."""
    model, rig = force("c * abs(x - 0.3)", c=5.0), Slider(1.0, "1")
    exact = simulate(model, rig, 1.0, rtol=1e-12, atol=1e-14).x[-1]
    errors = [
        abs(simulate(model, rig, 1.0, method="rk4", step=h).x[-1] - exact)
        for h in (1 / 20, 1 / 40, 1 / 80)
    ]
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > 3.4).all()


def test_in_open_loop_the_jump_of_a_force_is_a_row():
    trace = simulate(force("c * sgn(v)", c=2.0), Prescribed("cos(t)"), 3.0)
    (row,) = np.flatnonzero(np.diff(np.sign(trace.F)) < 0)
    assert trace.t[row + 1] == pytest.approx(np.pi / 2, abs=1e-12)


def test_names_of_chart_and_rig_are_kept_separate():
    """A chart's own mass is not the rig's, neither in a corner of one nor of the other."""
    model = force("abs(z - mass)", mass=0.4)
    program = lower(model, Slider(2.0, "1"))
    assert "z - mass_" in program.source
    trace = simulate(model, Slider(2.0, "1"), 2.0)
    assert np.abs(trace.x - 0.4).min() < 1e-13
