"""Frictions and velocity records for the tests of stepping."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm import GMS, GMSParameters, Stribeck
from gms_fsm.charts.registry import entry
from gms_fsm.systems.models import ChartModel, demonstration

Floats = NDArray[np.float64]
# Every included chart with one velocity and without locks.
ZOO = ("backlash", "bouc-wen", "dahl", "elasto-plastic", "lugre", "lugre-sigma1", "maxwell-slip",
       "prandtl-tomlinson", "rate-state-ageing", "rate-state-slip", "reset-integrator",
       "seven-parameter")  # fmt: skip


def bank(rng: np.random.Generator) -> tuple[GMS, float]:
    """Return a random GMS model, and a speed at which it switches, at any scale."""
    n = int(rng.choice([1, 5]))  # each one is another program
    shares = rng.dirichlet(np.ones(n)) + 0.02
    force, v_s = 10.0 ** rng.uniform(-3, 3), 10.0 ** rng.uniform(-6, 0)
    stiffness = force / v_s * 10.0 ** rng.uniform(0, 2, n)
    sigma = rng.choice([0.0, 0.01]) * force / v_s
    parameters = GMSParameters.from_shares(
        shares / shares.sum(),
        stiffness,
        C=float(10.0 ** rng.uniform(0, 2)) * force,
        stribeck=Stribeck(force, force * float(rng.uniform(1.0, 2.0)), v_s),
        v_c=float(rng.choice([1e-5, 1e-3])) * v_s,
        sigma=[sigma] * n,
        sigma_2=float(rng.choice([0.0, 0.1])) * force / v_s,
    )
    law: Any = "signed" if rng.random() < 0.8 else "published"
    return GMS(parameters, law=law), v_s


def zoo(name: str) -> tuple[ChartModel, float]:
    """Return an included chart with its demonstration values, and a speed."""
    return demonstration(entry(name)), 0.01


def friction(rng: np.random.Generator) -> tuple[Any, float]:
    """Return a random friction and a speed."""
    if rng.random() < 0.7:
        return bank(rng)
    return zoo(str(rng.choice(ZOO)))


def record(rng: np.random.Generator, speed: float, rows: int = 300) -> tuple[Floats, Floats]:
    """Return times and velocities: a walk with rests, reversals and zeros, at any sample times."""
    even = rng.random() < 0.7
    dt = 10.0 ** rng.uniform(-5, -1)
    steps = np.full(rows - 1, dt) if even else dt * 10.0 ** rng.uniform(-1, 1, rows - 1)
    t = rng.choice([0.0, 3.7]) + np.concatenate([[0.0], np.cumsum(steps)])
    walk = np.cumsum(rng.normal(size=rows)) * 10.0 ** rng.uniform(-2, 0.5)
    v = speed * walk * np.sin(np.arange(rows) * 10.0 ** rng.uniform(-2.5, -0.5))
    for _ in range(3):
        start = int(rng.integers(0, rows))
        v[start : start + int(rng.integers(1, 30))] = 0.0
    if rng.random() < 0.3:
        v[0] = 0.0
    return t, v


def jumping(rng: np.random.Generator, v: Floats, speed: float) -> Floats:
    """Return velocities after jumps at some samples, whose velocities before them may change.

    To rest, from rest, to the opposite, to anything; v itself is what is before them.
    """
    after = v.copy()
    for j in rng.choice(np.arange(1, v.size - 1), size=int(rng.integers(1, 9)), replace=False):
        after[j] = rng.choice([0.0, -v[j], 3.0 * speed * rng.normal()])
        if rng.random() < 0.4:
            v[j] = rng.choice([0.0, speed * rng.normal()])
    return after
