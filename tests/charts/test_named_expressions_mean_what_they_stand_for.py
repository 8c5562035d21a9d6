"""A chart or a system with named expressions moves as one in which they are written out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Chart, Parameter, Sampled, Session, Trace, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.charts.gms import gms_element
from gms_fsm.systems.system import Body, Contact, System
from tests.corpus import ENGINES
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


def press(pull: str, power: str, load: str, chart: str, let: dict[str, str]) -> System:
    """A mass on a belt: its force, what is lost, and a contact are given as texts."""
    values = {"F_c": 1.0, "F_s": 1.5, "b": 0.0}
    karnopp = {"F_c": 1.0, "F_s": 1.5, "sigma_2": 0.1, "D": 0.1}
    return System(
        "press",
        bodies=(
            Body("mass", inertia="m", force=f"{pull} + 0.1 * c"),
            Body("belt", velocity="0.1 * sin(t)", v="w", x="y"),
        ),
        contacts=(
            Contact("pad", CHARTS[chart], values if chart == "stiction" else karnopp, v="v - w"),
        ),
        numbers={"m": 1.0, "k": 4.0},
        signals={"u": "2 * sin(3 * t)"},
        flow={"lost": power},
        sampled=(Sampled("control", period=0.1, updates={"c": load}),),
        let=let,
    )


@pytest.mark.every(2)
@pytest.mark.parametrize("chart", ["stiction", "karnopp"])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_system_of_named_expressions_has_the_bits_of_the_written_out_one(
    chart: str, engine: str
) -> None:
    let = {"pull": "u - k * x - 0.3 * v", "power": "abs(pull) * v**2", "load": "max(0, pull)"}
    one = simulate(press("pull", "power", "load", chart, let), 8.0, engine=engine)
    pull = "(u - k * x - 0.3 * v)"
    texts = pull, f"abs({pull}) * v**2", f"max(0, {pull})"
    other = simulate(press(*texts, chart, {}), 8.0, engine=engine)
    assert one.rows.y.tolist() == other.rows.y.tolist()
    assert one.transitions.t.tolist() == other.transitions.t.tolist()
    assert len(one.transitions) > 3


def test_conditions_and_files_know_the_names_of_a_system(tmp_path: Path) -> None:
    let = {"pull": "u - k * x", "power": "abs(pull) * v**2"}
    system = press("pull", "power", "pull", "stiction", let)
    assert System.load(system.save(tmp_path / "press.toml")).let == let
    saved = simulate(system, 3.0).save(tmp_path / "press.npz")
    assert Trace.load(saved).what.system.let == let
    session = Session(system, 3.0)
    assert session.reaches("power > 0.05")
    values = session.values()
    assert values["pull"] == values["u"] - 4.0 * values["x"]
    assert values["power"] == pytest.approx(0.05, rel=1e-9)
