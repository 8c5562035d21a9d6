"""A wrong argument of `adapters.scipy.solve_ivp` is one error; a failed run keeps its rows."""

from __future__ import annotations

import math
import pickle
from typing import Any

import pytest
from scipy.integrate import RK45

from gms_fsm import Chart, ChartModel, Contact, ParameterError, State, Transition
from gms_fsm.adapters.scipy import solve_ivp
from gms_fsm.charts import CHARTS
from gms_fsm.charts.registry import entry
from tests.helpers import pulled_mass

MODEL, _ = pulled_mass()


def _mass(t: float, y: Any, F: float) -> list[float]:
    return [y[1], 2.0 * (0.1 * t - y[0]) - F]


STICTION = Contact("pad", CHARTS["stiction"], entry("stiction").demonstration.values)
NAMED = Contact("pad", MODEL)
LOADED = Contact(
    "pad",
    Chart("loaded", inputs=("v", "N"), states=(State("only", outputs={"F": "N * v"}),)),
    inputs={"N": "load"},
)
RIGHT: dict[str, Any] = {
    "fun": _mass,
    "t_span": (0.0, 1.0),
    "y0": [0.0, 0.0],
    "friction": MODEL,
    "velocity": 1,
}


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"fun": 3}, "fun is 3; it must be a function"),
        ({"fun": lambda t, y, F: [0.0]}, r"fun returns the shape \(1,\), but y0 has 2 components"),
        ({"fun": lambda t, y, F: "ab"}, "fun returns 'ab', which is no list of numbers"),
        ({"velocity": lambda y: "ab"}, "velocity returns 'ab', which is no list of numbers"),
        ({"t_span": (1.0, 1.0)}, "the end must be later"),
        ({"t_span": (0.0, math.nan)}, "t_span"),
        ({"y0": [0.0, math.nan]}, "y0"),
        ({"friction": 3}, "it must be a model or a contact"),
        ({"friction": []}, "friction: it is empty"),
        ({"friction": STICTION}, "the force of a lock depends on the masses"),
        ({"velocity": 2}, "velocity has 2, which is no component of y0; they are 0 to 1"),
        ({"velocity": [1]}, "there is 1 friction"),
        ({"velocity": lambda y: y}, r"velocity\(y\) has the shape \(2,\)"),
        ({"velocity": lambda y: math.nan}, r"velocity\(y0\) is \[nan\]; it must be finite"),
        ({"method": "euler"}, "method is 'euler'; it is no method"),
        ({"rtol": -1.0}, "rtol"),
        ({"atol": [1e-6]}, "atol"),
        ({"max_step": 0.0}, "max_step"),
        ({"max_steps": 0}, "max_steps"),
        ({"t_eval": [0.5, 2.0]}, "its times must increase and lie within t_span"),
        ({"initial": {"v": 1.0}}, "the caller's equations give the velocity"),
        ({"initial": {"q": 1.0}}, "initial has the key 'q'"),
        ({"sample": 0.0}, "sample"),
        ({"sample": 1e-9}, "there would be 1e.09 samples"),
        ({"sample": 0.1, "method": "dp45"}, "sample=... takes the methods of SciPy only"),
        ({"sample": 0.1, "friction": LOADED}, "its texts name 'load', which nobody gives here"),
        (
            {"sample": 0.1, "friction": [NAMED, NAMED], "velocity": [1, 1]},
            "they are called 'pad', 'pad'; every name must be unique",
        ),
        ({"sample": 0.1, "t_eval": [0.5]}, "the rows are the samples"),
    ],
)
def test_one_clear_error(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        solve_ivp(**{**RIGHT, **wrong})


def test_a_chart_without_scales_needs_a_tolerance() -> None:
    dahl = entry("dahl")
    model = ChartModel(dahl.chart(), dahl.demonstration.values)
    with pytest.raises(ParameterError, match="atol=1e-9"):
        solve_ivp(**{**RIGHT, "friction": model})
    assert solve_ivp(**{**RIGHT, "friction": model}, atol=1e-9).success


@pytest.mark.parametrize("options", [{}, {"sample": 0.01}])
def test_a_failed_run_keeps_its_rows(options: dict[str, Any]) -> None:
    found = solve_ivp(**{**RIGHT, "t_span": (0.0, 60.0)}, max_steps=5, **options)
    assert not found.success
    assert "max" in found.message
    assert 0.0 < found.t[-1] < 60.0
    assert found.y.shape == (2, len(found.t))
    assert len(found.t) <= 6  # also on a long arc without switches
    again = pickle.loads(pickle.dumps(found))
    assert again.message == found.message
    assert again.friction.states == found.friction.states


def test_a_friction_that_goes_on_has_its_state() -> None:
    found = solve_ivp(**RIGHT, method=RK45, atol=[1e-6, 1e-9])
    assert found.success
    begun = {**RIGHT, "t_span": (1.0, 2.0), "friction": found.friction}
    with pytest.raises(ParameterError, match=r"leave out initial=\.\.\."):
        solve_ivp(**begun, initial={"z": [0.0] * MODEL.n})


def test_a_velocity_that_is_not_finite_ends_the_run() -> None:
    found = solve_ivp(**{**RIGHT, "velocity": lambda y: math.nan if y[1] > 1e-3 else y[1]})
    assert not found.success
    assert "it stopped at t = " in found.message
    assert "gives NaN or infinity there" in found.message


def test_states_that_switch_without_progress_end_the_run() -> None:
    edges = [
        Transition("go", "a", "b", guard="v > 1e-3"),
        Transition("back", "b", "a", guard="v > 1e-4"),
    ]
    states = State("a"), State("b")
    chart = Chart("loop", ("v",), states=states, transitions=edges, outputs={"F": "v"})
    found = solve_ivp(**{**RIGHT, "friction": ChartModel(chart, {})}, atol=1e-9)
    assert not found.success
    assert "prove() finds such guards" in found.message


def test_a_step_that_becomes_too_small_ends_the_run() -> None:
    lost = {**RIGHT, "fun": lambda t, y, F: [math.nan * (t > 0.05), 0.0]}
    found = solve_ivp(**lost, method="RK45", sample=0.1)
    assert not found.success
    assert "it stopped at t = 0.0 s: the step size" in found.message
