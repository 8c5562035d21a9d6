"""One small run of each chart of the zoo, at any scale of length."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from gms_fsm import Body, ChartModel, Contact, Stribeck, System
from gms_fsm.charts import CHARTS
from tests.systems_cases import Case

Build: TypeAlias = Callable[[float], Case]  # of the unit of length, in m

KARNOPP = {"F_c": 1.0, "F_s": 1.5, "sigma_2": 0.4, "D": 1e-3}
MODELICA = {"mu_c": 0.4, "mu_s": 0.5, "v_s": 0.5, "delta": 1.5, "peak": 1.3, "sigma_2": 0.1}
LOAD = "2 + 2.6 * sin(0.7 * t)"  # negative for a quarter of the time
ELASTO = {"sigma_0": 1e3, "sigma_1": 10.0, "z_ba": 7e-4}
CURVE = (1.0, 1.5, 0.05)  # F_c, F_s, v_s
BANK: Mapping[str, Any] = {"k": [4e4, 3e4, 2e4, 1e4], "F_c": [0.1, 0.2, 0.3, 0.4]}
RESET = {"sigma_0": 1e4, "sigma_1": 2.0, "a_0": 0.5, "z_0": 1e-4}
DAHL = {"sigma_0": 1e4, "F_c": 1.0}
TIP = {"F_0": 1.0, "a_0": 0.2, "c": 4.0}


def driven(contact: Contact, velocity: str, unit: float, t_end: float) -> Case:
    """A body that moves with a given velocity, in units of length per second."""
    body = Body("body", velocity=f"unit * ({velocity})")
    return Case(
        System("driven", bodies=(body,), contacts=(contact,), numbers={"unit": unit}), t_end
    )


def pushed(contact: Contact, force: str, unit: float, t_end: float) -> Case:
    """A free body of 1 N s^2 per unit of length."""
    body = Body("body", inertia="m", force=force)
    numbers = {"m": 1.0 / unit, "K": 2.0 / unit, "V": 0.1 * unit}
    return Case(System("pushed", bodies=(body,), contacts=(contact,), numbers=numbers), t_end)


def karnopp(unit: float = 1.0) -> Case:
    """A load that reverses, with rests between."""
    p = KARNOPP
    values = {**p, "sigma_2": p["sigma_2"] / unit, "D": p["D"] * unit}
    pad = Contact("pad", CHARTS["karnopp"], values)
    return pushed(pad, "2.5 * sin(3 * t) * sin(0.37 * t)", unit, 20.0)


def modelica(unit: float = 1.0) -> Case:
    """A brake whose normal force comes and goes."""
    p = MODELICA
    values = {**p, "sigma_2": p["sigma_2"] / unit, "v_s": p["v_s"] * unit}
    pad = Contact("pad", CHARTS["modelica"], values, inputs={"N": LOAD})
    return pushed(pad, "2.5 * sin(3 * t)", unit, 20.0)


def dahl(unit: float = 1.0) -> Case:
    """Nested loops."""
    values = {"sigma_0": DAHL["sigma_0"] / unit, "F_c": DAHL["F_c"]}
    return driven(Contact("pad", CHARTS["dahl"], values), NESTED_V, unit, 6.0)


def lugre_sigma1(unit: float = 1.0) -> Case:
    """A pulled mass that sticks and slips."""
    values = {"sigma_0": 1e3 / unit, "sigma_1": 31.623 / unit, "v_d": 0.05 * unit}
    model = ChartModel(
        CHARTS["lugre-sigma1"], values, stribeck=curve(unit, delta=1.0), sigma_2=0.4 / unit
    )
    return pushed(Contact("pad", model), "K * (V * t - x)", unit, 12.0)


def reset_integrator(unit: float = 1.0) -> Case:
    """Nested loops."""
    p = RESET
    values = {
        "sigma_0": p["sigma_0"] / unit,
        "sigma_1": p["sigma_1"] / unit,
        "a_0": p["a_0"],
        "z_0": p["z_0"] * unit,
    }
    return driven(Contact("pad", CHARTS["reset-integrator"], values), NESTED_V, unit, 6.0)


def elasto_plastic(unit: float = 1.0) -> Case:
    """A velocity that passes the Stribeck velocity in both directions."""
    p = ELASTO
    values = {
        "sigma_0": p["sigma_0"] / unit,
        "sigma_1": p["sigma_1"] / unit,
        "z_ba": p["z_ba"] * unit,
    }
    model = ChartModel(CHARTS["elasto-plastic"], values, stribeck=curve(unit), sigma_2=0.4 / unit)
    return driven(Contact("pad", model), "0.06 * cos(2 * t)", unit, 6.0)


def maxwell_slip(unit: float = 1.0) -> Case:
    """Nested loops."""
    values = {"k": [k / unit for k in BANK["k"]], "F_c": BANK["F_c"]}
    return driven(Contact("pad", CHARTS["maxwell-slip"], values, n=4), NESTED_V, unit, 6.0)


def prandtl_tomlinson(unit: float = 1.0) -> Case:
    """A tip that is pulled over some ten hills."""
    p = TIP
    values = {"F_0": p["F_0"], "a_0": p["a_0"] * unit, "c": p["c"] / unit}
    tip = Contact("surface", CHARTS["prandtl-tomlinson"], values)
    return pushed(tip, "K * (V * t - x)", unit, 20.0)


NESTED_V = "1e-4 * (2 * cos(2 * t) + 3 * 5 * cos(5 * t))"  # of 1e-4 (sin(2 t) + 3 sin(5 t)), in m


def curve(unit: float, *, delta: float = 2.0) -> Stribeck:
    """The Stribeck curve of the cases."""
    F_c, F_s, v_s = CURVE
    return Stribeck(F_c, F_s, v_s * unit, delta)


CASES: Mapping[str, Build] = {
    each.__name__.replace("_", "-"): each
    for each in (
        karnopp,
        modelica,
        dahl,
        lugre_sigma1,
        reset_integrator,
        elasto_plastic,
        maxwell_slip,
        prandtl_tomlinson,
    )
}
