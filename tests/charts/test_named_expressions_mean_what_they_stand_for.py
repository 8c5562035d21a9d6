"""A chart with named expressions moves as one in which they are written out."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Chart, Parameter, simulate
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
