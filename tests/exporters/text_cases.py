"""Frictions with random numbers, and random records, for the tests of text formats."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    Prescribed,
    State,
    Stribeck,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.charts.registry import entry
from gms_fsm.systems.models import demonstration

CHARTS = ("lugre", "elasto-plastic", "seven-parameter", "maxwell-slip", "reset-integrator")
NAMES = ("gms-4-signed", "gms-4-published", "gms-16-signed", "gms-16-published", *CHARTS)


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
