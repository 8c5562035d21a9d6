"""A contact of a system steps alone: what its texts name is given with the velocity."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Body, Chart, Contact, FrictionBank, FrictionState, State, System, simulate
from gms_fsm.charts.registry import entry, registered
from gms_fsm.errors import ParameterError
from gms_fsm.systems.models import demonstration
from tests.helpers import FASTEST, stick_slip

LOADED = Chart(
    "Dahl under a normal force", inputs=("v", "N", "x"), variables=("z",), parameters=("k", "mu"),
    states=(State("only", flow={"z": "v - abs(v) * k * z / (mu * N)"},
                  outputs={"F": "k * z + 0.1 * x"}),),
)  # fmt: skip
T = np.arange(200) * 2.0**-7
V = 0.3 * np.sin(3 * T)
N = 10 + 4 * np.sin(T)


def contact(load: str = "N_0 * share") -> Contact:
    inputs = {"N": load, "x": "x_load"}
    return Contact("pad", LOADED, {"k": 100.0, "mu": 0.3}, v="v_load", inputs=inputs)


@pytest.mark.parametrize("engine", ["ifelse"] if FASTEST == "ifelse" else ["ifelse", "compiled"])
def test_inputs_are_straight_lines_too(engine: str) -> None:
    body = Body("load", velocity="v_load", x="x_load", v="v_load")
    signals = {"v_load": (T, V), "N_0": (T, N), "share": (T, 0.5 + 0 * T)}
    system = System("loaded", bodies=(body,), contacts=(contact(),), signals=signals)
    trace = simulate(system, T[-1], t_eval=T, initial={"x_load": 2.0}, engine=FASTEST)
    friction = FrictionState(contact(), initial={"x": 2.0}, engine=engine)
    assert friction.inputs == ("N_0", "share")
    forces = [
        friction.advance(V[j - 1], V[j], 2.0**-7, N_0=(N[j - 1], N[j]), share=(0.5, 0.5))
        for j in range(1, len(T))
    ]
    np.testing.assert_array_equal(forces, trace.F[1:])


def test_banks_give_each_joint_its_inputs() -> None:
    bank = FrictionBank([contact("N_0"), stick_slip("signed"), contact("2 * N_0")])
    one, other = FrictionState(contact("N_0")), FrictionState(contact("2 * N_0"))
    plain = FrictionState(stick_slip("signed"))
    assert bank.inputs == one.inputs == ("N_0",)
    for j in range(1, len(T)):
        pair = np.full(3, V[j - 1]), np.full(3, V[j])
        forces = bank.advance(*pair, 0.01, N_0=(N[j - 1], [N[j], 1.0, 0.5 * N[j]]))
        assert forces.tolist() == [
            one.advance(V[j - 1], V[j], 0.01, N_0=(N[j - 1], N[j])),
            plain.advance(V[j - 1], V[j], 0.01),
            other.advance(V[j - 1], V[j], 0.01, N_0=(N[j - 1], 0.5 * N[j])),
        ]


def test_texts_over_time_need_nothing() -> None:
    friction = FrictionState(contact("10 + 1e1 * sin(2 * pi * t)"))
    assert friction.inputs == ()
    assert friction.advance(0.0, 0.1, 0.5) > 0.0


def test_a_model_in_a_contact() -> None:
    model = stick_slip("signed")
    inside = FrictionState(Contact("bearing", model, v="w_m - 3 * w_l"))
    alone = FrictionState(model)
    for j in range(1, len(T)):
        assert inside.advance(V[j - 1], V[j], 0.1) == alone.advance(V[j - 1], V[j], 0.1)


def test_missing_and_wrong_inputs() -> None:
    friction = FrictionState(contact("N_0"))
    before = friction.to_array()
    with pytest.raises(ParameterError, match=r"given are none; give N_0=\(start, end\)"):
        friction.advance(0.0, 0.1, 0.1)
    with pytest.raises(ParameterError, match=r"N_0 is 5\.0; it must be a pair"):
        friction.advance(0.0, 0.1, 0.1, N_0=5.0)
    with pytest.raises(ParameterError, match="N_0 is nan; it must be finite"):
        friction.peek(0.0, 0.1, 0.1, N_0=(1.0, float("nan")))
    np.testing.assert_array_equal(friction.to_array(), before)


LOCKS = {"stiction", "karnopp", "modelica", "dog-clutch", "end-stop"}


@pytest.mark.parametrize("name", sorted({*registered()} - {"planar-coulomb"}))
def test_included_charts_step_unless_they_lock(name: str) -> None:
    model = demonstration(entry(name), "signed" if name == "gms" else "")
    if name in LOCKS:
        with pytest.raises(ParameterError, match="it locks the contact"):
            FrictionState(model)
    else:
        friction = FrictionState(model, engine="ifelse")
        assert np.isfinite(friction.peek(0.0, 0.001, 0.0))
