"""Frictions and systems on random records, for the exported C programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gms_fsm import GMS, Body, Contact, GMSParameters, LuGre, Model, Stribeck, System
from gms_fsm.app.scenario import load_system
from gms_fsm.charts.zoo.sliding.karnopp import KARNOPP
from gms_fsm.systems.models import ChartModel
from tests.physics.test_sliding_follows_filippov import follower

SCENARIOS = Path(__file__).parents[2] / "scenarios"
Case = tuple[Model | System, np.ndarray, Mapping[str, np.ndarray]]


def walk(random: np.random.Generator, t: np.ndarray, size: float) -> np.ndarray:
    """Return a random motion with rests, jumps of slope and reversals."""
    knots = np.linspace(t[0], t[-1], int(random.integers(8, 30)))
    values = random.normal(size=knots.size) * size
    values[random.random(knots.size) < 0.2] = 0.0
    return np.interp(t, knots, values)


def times(random: np.random.Generator, end: float, rows: int = 400) -> np.ndarray:
    """Return even or uneven samples."""
    if random.random() < 0.5:
        return np.linspace(0.0, end, rows + 1)
    return np.concatenate([[0.0], np.cumsum(random.uniform(0.2, 1.8, rows)) * end / rows])


def gms(n: int) -> Callable[[np.random.Generator], Case]:
    """Return a maker of a bank of n elements."""

    def made(random: np.random.Generator) -> Case:
        parameters = GMSParameters(
            k=10.0 ** random.uniform(-1, 3, n),
            sigma=random.uniform(0, 1, n),
            C=random.uniform(0.01, 0.2, n),
            v_c=1e-6,
            stribeck=Stribeck(F_c=0.4, F_s=float(random.uniform(0.4, 2.0)), v_s=1e-3),
            sigma_2=0.1,
            weights=random.uniform(0.2, 2.0, n),
        )
        law = "signed" if random.random() < 0.5 else "published"
        t = times(random, 20.0)
        return GMS(parameters, law=law), t, {"v": walk(random, t, 0.3)}

    return made


def lugre(random: np.random.Generator) -> Case:
    """Return a LuGre bristle."""
    curve = Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3, delta=float(random.choice([1.0, 2.0])))
    model = LuGre(sigma_0=10.0 ** random.uniform(3, 5), sigma_1=300.0, sigma_2=0.4, stribeck=curve)
    t = times(random, 2.0)
    return model, t, {"v": walk(random, t, 3e-3)}


def karnopp(random: np.random.Generator) -> Case:
    """Return a mass with Karnopp's friction under a force."""
    values = {"F_c": 1.0, "F_s": 1.5, "sigma_2": 0.4, "D": 10.0 ** random.uniform(-5, -2)}
    system = System(
        "mass",
        bodies=(Body("mass", inertia="m", force="f", x="x", v="v"),),
        contacts=(Contact("pad", ChartModel(KARNOPP, values), v="v"),),
        signals={"f": "0"},
        numbers={"m": float(random.uniform(0.5, 2.0))},
    )
    t = times(random, 10.0)
    return system, t, {"f": walk(random, t, 2.0)}


def servo(random: np.random.Generator) -> Case:
    """Return the servo of the scenarios with another reference."""
    system = load_system(SCENARIOS / "servo.toml")
    numbers = {name: value for name, value in system.numbers.items() if name != "ref"}
    t = times(random, 0.3)
    reference = walk(random, t, 3e-3)
    return replace(system, numbers=numbers, signals={"ref": "0"}), t, {"ref": reference}


def between_states(random: np.random.Generator) -> Case:
    """Return a deflection that is driven back to 0 from two states, and slides there."""
    t = times(random, 20.0)
    return follower(), t, {"v": 1.5 * np.sin(3.0 * t) + walk(random, t, 0.3)}


CASES: Mapping[str, Callable[[np.random.Generator], Case]] = {
    "GMS 4": gms(4),
    "GMS 16": gms(16),
    "LuGre": lugre,
    "Karnopp": karnopp,
    "servo": servo,
    "between states": between_states,
}


def case(name: str, seed: int) -> tuple[Any, np.ndarray, Mapping[str, np.ndarray]]:
    """Return a case by name and seed."""
    return CASES[name](np.random.default_rng([seed, *name.encode()]))
