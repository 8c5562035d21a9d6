"""The input N of a contact multiplies its Stribeck curve, in every model that has one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gms_fsm import GMS, Body, Contact, FrictionState, GMSParameters, LuGre, Stribeck, System
from gms_fsm import simulate as run
from gms_fsm.charts.registry import entry
from gms_fsm.systems.models import Model, demonstration, with_values
from gms_fsm.systems.signals import Corners
from tests.helpers import FASTEST

PAPER = GMSParameters.paper("stick-slip")
LUGRE = LuGre(sigma_0=10.0, sigma_1=0.2, sigma_2=0.1, stribeck=Stribeck(0.3, 0.5, 0.01))
MODELS: dict[str, tuple[Model, float]] = {
    "signed": (GMS(PAPER, law="signed"), 3.0),
    "published": (GMS(PAPER, law="published"), 3.0),
    "lugre": (LUGRE, 0.2),
    "elasto-plastic": (demonstration(entry("elasto-plastic")), 1e-3),
}
ENGINES = ("machines", "ifelse", *(("compiled",) if FASTEST == "compiled" else ()))


def moved(model: Model, v: str, N: str | None = None, **signals: Any) -> System:
    inputs = None if N is None else {"N": N}
    return System(
        "moved",
        bodies=(Body("body", velocity="v"),),
        contacts=(Contact("pad", model, v="v", inputs=inputs),),
        signals={"v": v, **signals},
    )


@pytest.mark.every(2)
@pytest.mark.parametrize("name", MODELS)
def test_a_constant_load_is_a_factor_of_both_strengths(name: str) -> None:
    """N = 5 and a curve of five times the height: the same switches, forces and tolerances."""
    model, speed = MODELS[name]
    assert model.stribeck is not None
    F_c, F_s = 5.0 * model.stribeck.F_c, 5.0 * model.stribeck.F_s
    v = f"{speed} * (sin(t) + 0.7 * sin(3 * t))"
    systems = moved(model, v, "5"), moved(with_values(model, {"F_c": F_c, "F_s": F_s}), v)
    how = {"rtol": 1e-9, "t_eval": np.linspace(0.0, 6.0, 31), "engine": FASTEST}
    loaded, strong = (run(system, 6.0, **how) for system in systems)  # type: ignore[arg-type]
    for one, other in zip(
        *(trace.settings["atol"].values() for trace in (loaded, strong)), strict=True
    ):
        assert one == pytest.approx(other, rel=1e-12)
    pad, other = loaded.contact("pad"), strong.contact("pad")
    np.testing.assert_allclose(pad.s, other.s, rtol=1e-12)
    np.testing.assert_allclose(pad.F, other.F, rtol=0, atol=1e-6 * np.abs(other.F).max())
    assert loaded.transitions.edge.tolist() == strong.transitions.edge.tolist()


def test_a_load_that_varies_agrees_with_scipy() -> None:
    """LuGre under N = 2 + 1.5 sin(3 t), as equations of its own."""

    def v(t: Any) -> Any:
        return 0.2 * np.sin(t)

    def flow(t: float, z: Any) -> Any:
        s = (0.3 + 0.2 * np.exp(-((v(t) / 0.01) ** 2))) * (2.0 + 1.5 * np.sin(3.0 * t))
        return v(t) - 10.0 * abs(v(t)) * z / s

    t = np.linspace(0.0, 6.0, 61)
    exact = solve_ivp(flow, (0.0, 6.0), [0.0], t_eval=t, rtol=1e-11, atol=1e-13, max_step=0.01)
    trace = run(moved(LUGRE, "0.2*sin(t)", "2 + 1.5*sin(3*t)"), 6.0, rtol=1e-8, t_eval=t)
    np.testing.assert_allclose(trace.contact("pad").z[:, 0], exact.y[0], rtol=0, atol=1e-7)


def test_break_away_is_where_the_deflection_meets_the_loaded_threshold() -> None:
    """At constant v, z = v t, and s = w S(v) (1 + t): they meet at w S / (v - w S)."""
    model = GMS(PAPER, law="signed")
    trace = run(moved(model, "1.0", "1 + t"), 3.0)
    assert model.stribeck is not None
    s = model.weights * float(model.stribeck(1.0))
    np.testing.assert_allclose(np.sort(trace.transitions.t), np.sort(s / (1.0 - s)), rtol=1e-12)


def test_a_load_below_the_least_one_counts_as_the_least_one() -> None:
    trace = run(moved(GMS(PAPER, law="signed"), "0.0", "1 - t"), 3.0, t_eval=[0.5, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(trace.contact("pad").s[:, 0] / 1.5, [0.5, 1e-9, 1e-9, 1e-9])


def test_an_input_x_is_the_position_that_the_contact_reads() -> None:
    """The potential of Prandtl and Tomlinson, shifted by a tenth of a metre."""
    model = demonstration(entry("prandtl-tomlinson"))

    def trace(inputs: dict[str, str]) -> Any:
        pad = Contact("pad", model, v="v", inputs=inputs)
        return run(System("one", bodies=(Body("b", inertia=1.0),), contacts=(pad,)), 0.1)

    assert trace({}).contact("pad").x[0] == 0.0
    assert trace({"x": "x + 0.1"}).contact("pad").x[0] == 0.1
    assert trace({"x": "x"}).contact("pad").F.tolist() == trace({}).contact("pad").F.tolist()


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES[1:])
def test_a_friction_state_takes_the_load_and_gives_the_bits_of_a_record(engine: str) -> None:
    """Also where velocity and load jump, together and alone."""
    rng = np.random.default_rng(5)
    for name in ("signed", "lugre") if engine == "ifelse" else ("signed",):
        model, speed = MODELS[name]
        t = np.linspace(0.0, 10.0, 41)
        v0, v1 = speed * rng.normal(size=(2, 40))
        N0, N1 = rng.uniform(1.0, 4.0, (2, 40))
        v0[10:20], N0[20:30] = v1[9:19], N1[19:29]  # one of them goes on
        v1[5], v1[25] = 0.0, 0.0
        both = np.ravel(np.stack([t[:-1], t[1:]], axis=1))
        records = {
            key: Corners(both, np.ravel(np.stack(each, axis=1)), held=False)
            for key, each in {"v": (v0, v1), "N": (N0, N1)}.items()
        }
        pad = Contact("pad", model, v="v", inputs={"N": "N"})
        system = System("moved", bodies=(Body("body", velocity="v"),), contacts=(pad,),
                        signals=records)  # fmt: skip
        trace = run(system, 10.0, engine=engine)
        state, log = FrictionState(pad, engine=engine), []
        assert state.inputs == ("N",)
        for j in range(40):
            force = state.advance_to(v0[j], v1[j], t[j + 1], N=(N0[j], N1[j]))
            log += [(each.t, each.element, each.edge) for each in state.switches]
        assert force == trace.contact("pad").F[-1]
        assert log == [(float(r.t), int(r.element), str(r.edge)) for r in trace.transitions]
        assert log or name == "lugre"
