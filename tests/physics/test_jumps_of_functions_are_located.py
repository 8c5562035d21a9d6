"""What floor, round, mod, quantise and if do in a flow or a force is the closed form's.

Steps end where such a value jumps, wherever that is: at times that are known before, on a motion,
and where the flow on both sides leads back onto the jump.
"""

from __future__ import annotations

import math

import pytest

from gms_fsm import Chart, ChartModel, Prescribed, Slider, State, Trace, simulate
from tests.helpers import FASTEST


def ran(flow: str, t_end: float = 4.0) -> Trace:
    chart = Chart(
        "jumps",
        inputs=("t", "x", "v"),
        variables=("z",),
        parameters=("T",),
        states=(State("on", {"z": flow}),),
        outputs={"F": "z"},
    )
    model = ChartModel(chart, {"T": [0.5, 0.8]}, n=2)
    return simulate(model, Prescribed("0.1"), t_end, engine=FASTEST)


DUTY = 8 * 0.2, 5 * 0.2  # of the two elements, in 4 s


@pytest.mark.every(2)
@pytest.mark.parametrize(
    ("flow", "expected"),
    [
        ("floor(t)", (6.0, 6.0)),
        ("round(t)", (8.0, 8.0)),
        ("mod(t, T)", (4 * 0.5 / 2, 4 * 0.8 / 2)),
        ("quantise(t, 0.5)", (8.0, 8.0)),
        ("if(mod(t, T) < 0.2, 1, 0)", DUTY),
        ("floor(10 * x)", (6.0, 6.0)),
        ("saturate(t, 1, 2)", (1 + 1.5 + 4, 1 + 1.5 + 4)),
        ("if(1 <= t and t < 2 or t > 3.5, t, 0)", (1.5 + 1.875, 1.5 + 1.875)),
    ],
)
def test_an_integral_over_jumps_is_exact(flow: str, expected: tuple[float, float]) -> None:
    trace = ran(flow)
    assert trace.z[-1] == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("text", ["if(sin(40 * t) > 0, 1, 0)", "0.5 + 0.5 * sgn(sin(40 * t))"])
def test_a_wave_is_seen_where_nothing_else_limits_the_steps(text: str) -> None:
    """Nothing bends between its jumps, so the error alone would allow steps over many of them."""
    t_end = 8 * math.pi
    assert ran(text, t_end).z[-1] == pytest.approx([t_end / 2] * 2, rel=1e-6)


def test_a_body_stops_where_a_choice_of_the_velocity_holds_it() -> None:
    """Coulomb friction as an if: v = 1 - t / 2, and then rest."""
    chart = Chart("if", inputs=("v",), states=(State("on"),), outputs={"F": "if(v > 0, 1, -1)"})
    trace = simulate(
        ChartModel(chart, {}), Slider(2.0, "0"), 3.0, engine=FASTEST, initial={"v": 1.0}
    )
    assert trace.v[-1] == 0.0
    assert trace.x[-1] == pytest.approx(1.0, rel=1e-12)


def test_a_body_is_held_where_a_rounded_force_jumps() -> None:
    """F is 0 below v = 1/2 and 1 above: pushed by 3/4, v reaches 1/2 and stays there."""
    chart = Chart("steps", inputs=("v",), states=(State("on"),), outputs={"F": "round(v)"})
    trace = simulate(ChartModel(chart, {}), Slider(1.0, "0.75"), 2.0, engine=FASTEST)
    assert trace.v[-1] == pytest.approx(0.5, rel=1e-12)
    assert trace.x[-1] == pytest.approx(0.75 / 2 * (2 / 3) ** 2 + 0.5 * (2 - 2 / 3), rel=1e-9)
    assert [str(each.surface) for each in trace.sliding] == ["mod(v + 0.5, 1)"]


def test_a_motion_over_the_steps_of_a_force_keeps_its_energy() -> None:
    """A mass of 1 kg in a potential of straight pieces."""
    stairs = Chart(
        "stairs", inputs=("x",), states=(State("on"),), outputs={"F": "floor(2 * x) + 0.5"}
    )
    start = {"x": 0.3, "v": 2.0}
    trace = simulate(ChartModel(stairs, {}), Slider(1.0, "0"), 6.0, engine=FASTEST, initial=start)

    def potential(x: float) -> float:
        below = math.floor(2 * x)
        whole = sum(0.5 * (k + 0.5) for k in range(below)) - sum(
            0.5 * (k + 0.5) for k in range(below, 0)
        )
        return whole + (below + 0.5) * (x - below / 2)

    energy = [0.5 * v * v + potential(x) for x, v in zip(trace.x, trace.v, strict=True)]
    assert max(trace.x) > 1.0
    assert energy == pytest.approx([energy[0]] * len(energy), rel=1e-6)
