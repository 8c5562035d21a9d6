"""Frictions and systems with random numbers, on random records: repeat one by name and seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    Model,
    Prescribed,
    State,
    Stribeck,
    System,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.app.scenario import load_scenario, load_system
from gms_fsm.charts.registry import entry
from gms_fsm.charts.zoo.sliding.karnopp import KARNOPP
from gms_fsm.systems.models import demonstration
from gms_fsm.systems.system import system_of
from tests.helpers import ROOT
from tests.physics.test_sliding_follows_filippov import follower

CHARTS = ("lugre", "elasto-plastic", "seven-parameter", "maxwell-slip", "reset-integrator")
NAMES = ("gms-4-signed", "gms-4-published", "gms-16-signed", "gms-16-published", *CHARTS)
KARNOPP_MODEL = ChartModel(KARNOPP, {"F_c": 1.0, "F_s": 1.5, "sigma_2": 0.4, "D": 1e-4})


def servo() -> System:
    """Return the servo of the scenarios, whose controller is sampled."""
    return load_system("servo")


@dataclass(frozen=True)
class Case:
    """A friction and the corners of its velocity; ``case(name, seed)`` repeats it."""

    model: Any
    t: np.ndarray
    v: np.ndarray

    def simulated(self, **settings: Any) -> Trace:
        """Return a run of the whole record."""
        return simulate(self.model, Prescribed((self.t, self.v)), float(self.t[-1]), **settings)


def case(name: str, seed: int, corners: int = 12) -> Case:
    """Return a friction with random numbers on a random record."""
    rng = np.random.default_rng(seed)
    if name.startswith("gms"):
        _, n, law = name.split("-")
        model: Any = _gms(int(n), law, rng)
        scale = 0.2
    else:
        model, scale = _varied(name, rng), 3e-3
    t = np.cumsum(rng.uniform(0.05, 0.2, corners))
    return Case(model, t - t[0], scale * rng.uniform(-1.0, 1.0, corners))


def _gms(n: int, law: Any, rng: np.random.Generator) -> GMS:
    k = rng.uniform(10.0, 1000.0, n)
    weights = rng.uniform(0.3, 2.0, n) / (n * k)
    parameters = GMSParameters(
        k,
        rng.uniform(0.0, 0.5, n),
        weights * rng.uniform(1.0, 20.0, n),  # the published law grows at such rates for v < 0
        sigma_2=rng.uniform(0.0, 1.0),
        stribeck=Stribeck(1.0, rng.uniform(1.2, 2.0), rng.uniform(0.01, 0.1)),
        v_c=1e-6,
        weights=weights,
    )
    return GMS(parameters, law=law)


def _varied(name: str, rng: np.random.Generator) -> ChartModel:
    """Return a chart with the numbers of its demonstration, each changed by up to a tenth."""
    model = demonstration(entry(name))
    values = {
        key: np.multiply(value, rng.uniform(0.9, 1.1, np.shape(value)))
        for key, value in model.values.items()
    }
    return ChartModel(
        model.chart,
        values,
        n=model.n,
        weights=model.weights,
        stribeck=model.stribeck,
        sigma_2=model.sigma_2,
    )


# --------------------------------------------------------------------------- dense records
Subject = tuple[Model | System, np.ndarray, Mapping[str, np.ndarray]]


def walk(random: np.random.Generator, t: np.ndarray, size: float) -> np.ndarray:
    """Return a random motion with rests, jumps of slope and reversals."""
    knots = np.linspace(t[0], t[-1], int(random.integers(8, 30)))
    values = random.normal(size=knots.size) * size
    values[random.random(knots.size) < 0.2] = 0.0
    return np.interp(t, knots, values)


def times(random: np.random.Generator, end: float, rows: int = 400) -> np.ndarray:
    """Return uneven samples."""
    return np.concatenate([[0.0], np.cumsum(random.uniform(0.2, 1.8, rows)) * end / rows])


def _friction(name: str) -> Callable[[np.random.Generator], Subject]:
    def made(random: np.random.Generator) -> Subject:
        given = case(name, int(random.integers(1000)), corners=40)
        t = np.sort(np.concatenate([given.t, times(random, given.t[-1])[1:-1]]))
        t = t[t <= given.t[-1]]
        return given.model, t, {"v": np.interp(t, given.t, given.v)}

    return made


def _karnopp(random: np.random.Generator) -> Subject:
    system = System(
        "mass",
        bodies=(Body("mass", inertia="m", force="f", x="x", v="v"),),
        contacts=(Contact("pad", KARNOPP_MODEL, v="v"),),
        signals={"f": "0"},
        numbers={"m": float(random.uniform(0.5, 2.0))},
    )
    t = times(random, 10.0)
    return system, t, {"f": walk(random, t, 2.0)}


def _servo(random: np.random.Generator) -> Subject:
    system = servo()
    numbers = {name: value for name, value in system.numbers.items() if name != "ref"}
    t = times(random, 0.3)
    reference = walk(random, t, 3e-3)
    return replace(system, numbers=numbers, signals={"ref": "0"}), t, {"ref": reference}


def _between_states(random: np.random.Generator) -> Subject:
    """Return a deflection that is driven back to 0 from two states, and slides there."""
    t = times(random, 20.0)
    return follower(), t, {"v": 1.5 * np.sin(3.0 * t) + walk(random, t, 0.3)}


DENSE: Mapping[str, Callable[[np.random.Generator], Subject]] = {
    "GMS 4": _friction("gms-4-signed"),
    "GMS 16": _friction("gms-16-published"),
    "LuGre": _friction("lugre"),
    "Karnopp": _karnopp,
    "servo": _servo,
    "between states": _between_states,
}


def dense(name: str, seed: int) -> Subject:
    """Return a friction or a system on a dense record, by name and seed."""
    return DENSE[name](np.random.default_rng([seed, *name.encode()]))


def loaded(load: str = "load") -> Contact:
    """Return a friction that reads the time, its position and a further input, with actions."""
    chart = Chart(
        "loaded",
        inputs=("v", "x", "t", "N"),
        variables=("z",),
        parameters=("mu",),
        let={"big": "max(N, 1)", "rel": "z / (mu * big)"},
        states=(
            State("a", flow={"z": "v - abs(v) * rel"}),
            State("b", entry={"z": "z / 2"}, flow={"z": "-3 * z + min(t, 0.4)"}),
        ),
        transitions=(
            Transition(
                "go",
                "a",
                "b",
                guard="x > 0.05 and (t > 0.3 or not N < 1)",
                actions={"z": "z + 0.01 * sgn(x)"},
            ),
            Transition("back", "b", "a", guard="age > 0.2 and v < 0"),
        ),
        outputs={"F": "N * z + 0.1 * dz + x**3"},
    )
    return Contact("contact", chart, {"mu": 0.3}, inputs={"N": f"{load} + 1"})


def reads_acceleration() -> Chart:
    """Return a bristle that feels how fast it is moved."""
    return Chart(
        "reads a",
        variables=("z",),
        parameters=("k",),
        inputs=("t",),
        states=(State("calm", flow={"z": "v"}), State("wild", flow={"z": "-z"})),
        transitions=(
            Transition("leave", "calm", "wild", guard="a > 1"),
            Transition("return_", "wild", "calm", guard="a < -1"),
        ),
        outputs={"F": "k * z"},
    )


def scenario(name: str) -> System:
    """Return the system of an included scenario."""
    loaded = load_scenario(ROOT / f"gms_fsm/scenarios/{name}.toml")
    return loaded.system or system_of(loaded.model, loaded.rig)
