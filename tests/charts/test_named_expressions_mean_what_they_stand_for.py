"""A chart with named expressions moves as one in which they are written out."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Chart, Parameter, State, Transition, simulate
from gms_fsm.charts.gms import gms_element
from gms_fsm.systems.system import Body, Contact, System
from tests.helpers import event_sequence, pulled_mass


def gms_in_words() -> Chart:
    """The signed GMS element with its curve, thresholds and viscous friction as text."""
    element = gms_element("signed")
    return Chart(
        "GMS, all in the chart",
        inputs=("v",),
        variables=("z",),
        parameters=(
            *element.parameters,
            Parameter("w", "m/N", "> 0"),
            *(Parameter(name, per_element=False) for name in ("F_c", "F_s", "v_s", "sigma_2")),
        ),
        states=element.states,
        transitions=element.transitions,
        outputs=element.outputs,
        let={"S": "F_c + (F_s - F_c) * exp(-(v / v_s)**2)", "s": "w * S"},
        contact_outputs={"F": "F + sigma_2 * v"},
    )


def as_a_system() -> System:
    model, rig = pulled_mass()
    p = model.parameters  # type: ignore[attr-defined]
    values = {name: getattr(p, name) for name in ("k", "sigma", "C", "v_c", "sigma_2")}
    values |= {name: getattr(p.stribeck, name) for name in ("F_c", "F_s", "v_s")}
    values["w"] = p.weights
    return System(
        "pulled",
        bodies=(Body("mass", inertia="m", force="K * (V * t - x)"),),
        contacts=(Contact("pad", gms_in_words(), values, n=4),),
        numbers={
            "m": rig.numbers["mass"],
            "K": rig.numbers["stiffness"],
            "V": rig.numbers["speed"],
        },
    )


@pytest.mark.slow
def test_a_gms_bank_in_words_is_the_gms_model() -> None:
    model, rig = pulled_mass()
    one = simulate(model, rig, 40.0, rtol=1e-9)
    other = simulate(as_a_system(), 40.0, rtol=1e-9)
    assert event_sequence(one) == event_sequence(other)
    np.testing.assert_allclose(one.transitions.t, other.transitions.t, atol=1e-6)
    np.testing.assert_allclose(one.F[-1], other.F[-1], rtol=1e-6)
    np.testing.assert_allclose(one.s[-1], other.s[-1], rtol=1e-6)


def test_a_chart_may_use_the_names_of_the_generated_text() -> None:
    chart = Chart(
        "names",
        variables=("y", "n"),
        parameters=("p", "i", "S", "own", "tables"),
        states=(
            State("mode", flow={"y": "p * v - i * y", "n": "y"}),
            State("held", flow={"y": "-S * y"}),
        ),
        transitions=(
            Transition("out", "mode", "held", guard="n > own and y > 0.5"),
            Transition("edge", "held", "mode", guard="y < tables"),
        ),
        outputs={"F": "y + n"},
    )
    plain = Chart(
        "plain",
        variables=("a1", "a2"),
        parameters=("b1", "b2", "b3", "b4", "b5"),
        states=(
            State("s1", flow={"a1": "b1 * v - b2 * a1", "a2": "a1"}),
            State("s2", flow={"a1": "-b3 * a1"}),
        ),
        transitions=(
            Transition("e1", "s1", "s2", guard="a2 > b4 and a1 > 0.5"),
            Transition("e2", "s2", "s1", guard="a1 < b5"),
        ),
        outputs={"F": "a1 + a2"},
    )
    numbers = (2.0, 0.5, 3.0, 1.0, 0.01)

    def run(chart: Chart) -> np.ndarray:
        values = dict(zip(chart.parameter_names, numbers, strict=True))
        system = System(
            "names",
            bodies=(Body("b", velocity="1 + sin(t)", x="out", v="watch"),),
            contacts=(Contact("shared", chart, values, v="watch"),),
        )
        return np.asarray(simulate(system, 10.0, engine="ifelse").F)

    np.testing.assert_array_equal(run(chart), run(plain))
