"""A rig's number or signal is never confused with something else, whatever its name."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    State,
    System,
    Transition,
    simulate,
)
from gms_fsm.systems.signals import as_signal
from tests.helpers import same_bits

MODEL = GMS(GMSParameters.paper("stick-slip"), law="signed")
FREE = ["q", "mass", "k", "C", "sigma", "v_c", "z", "STICK", "stick", "arrest", "max_0", "t0"]
# Names that the generated text uses itself, or that belong to the model.
FREE += ["n", "i", "y", "p", "out", "mode", "edge", "held", "weight", "own", "shared", "tables"]
FREE += ["s", "F_c", "v_s", "sigma_2", "S", "dS", "dz", "dy", "F_i", "j", "friction", "a", "a_body"]


def pushed(names: list[str], kind: str) -> Any:
    """Return a rig with a number or a signal for each name, all of other values."""
    values = {name: f"{0.2 + 0.01 * place} * t" for place, name in enumerate(names)}
    if kind == "numbers":
        values = {name: 0.2 + 0.01 * place for place, name in enumerate(names)}
    else:
        values = {name: as_signal(text) for name, text in values.items()}
    force = " + ".join(f"{name} * sin({place + 1} * t)" for place, name in enumerate(names))
    given = {"numbers": {}, "signals": {}} | {kind: values}
    return SimpleNamespace(title="pushed", acceleration=f"{force} - F", **given)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["numbers", "signals"])
def test_a_free_name_changes_nothing(kind: str) -> None:
    """All at once, beside names that mean nothing."""
    plain = [f"quantity_{place}" for place in range(len(FREE))]
    one, other = (simulate(MODEL, pushed(names, kind), 3.0) for names in (FREE, plain))
    same_bits(one, other)
    assert abs(one.z).max() > 0.01


def test_a_is_the_acceleration_along_the_velocity_of_the_contact() -> None:
    """Of the cart (4 t - F) / 2, of what it stands on -1: 2 t + 0.75, which is 1 at t = 1/8."""
    edges = (Transition("shake", "calm", "shaken", guard="a >= 1"),)
    states = State("calm", {"z": "0"}), State("shaken", {"z": "0"})
    chart = Chart("felt", ("v",), ("z",), (), states, edges, {"F": "0.5"})
    cart = Body("cart", inertia="2", force="4*t")
    base = Body("base", velocity="-t", x="x_b", v="v_b")
    pad = Contact("pad", ChartModel(chart, {}), v="v - v_b")
    trace = simulate(System("s", bodies=(cart, base), contacts=(pad,)), 1.0, atol=1e-9)
    assert trace.transitions.t.tolist() == pytest.approx([0.125], abs=1e-12)


@pytest.mark.parametrize(
    "acceleration",
    [
        "2 * (u - F)",
        "(2 * u - 2 * F) / 1",
        "(1 + (u - 1 - F)) / m",
        "2 * u - F / m",
        "(F - u) / -m",
    ],
)
def test_an_acceleration_may_be_written_in_many_ways(acceleration: str) -> None:
    def rig(text: str) -> Any:
        given = {"numbers": {"m": 0.5}, "signals": {"u": as_signal("sin(t)")}}
        return SimpleNamespace(title="own", acceleration=text, **given)

    one, other = (
        simulate(MODEL, rig(text), 0.1, rtol=1e-10) for text in ("(u - F) / m", acceleration)
    )
    assert one.x[-1] > 1e-6
    assert other.x[-1] == pytest.approx(one.x[-1], rel=1e-5)


def test_a_system_stands_where_a_run_has_a_model_and_a_rig() -> None:
    pads = (Contact("one", MODEL, v="v"), Contact("two", MODEL, v="v"))
    mass = Body("mass", inertia=2.0, force="u - m * x")
    given = {"signals": {"u": 1.0, "w": "2 * m"}, "numbers": {"m": 3.0}}
    trace = simulate(System("both", bodies=(mass,), contacts=pads, **given), 1e-3)
    assert repr(trace.model).startswith("<2 contacts of <System 'both'")
    assert trace.rig.acceleration == "(u - m * x - F) / (2.0)"
    assert [*trace.rig.signals] == ["u"]
    belt = Body("belt", velocity="u")
    trace = simulate(System("driven", bodies=(belt,), contacts=pads, signals={"u": 1.0}), 1e-3)
    assert trace.rig.acceleration is None
