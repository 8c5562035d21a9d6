"""Claim: the measured drift rate of LuGre is that of an independent SciPy run."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.phenomena.cases import BENCH, known


@pytest.mark.slow
def test_drift_per_period() -> None:
    table = known()
    force = table.cell("lugre", "break-away").number("break-away force at 0.1 N/s")

    def flow(t, y):
        _, v, z = y
        ramp = np.interp(t, (0.0, 2.0, 4.0), (0.0, 0.6 * force, 0.3 * force))
        push = ramp + (0.1 * force * math.sin(4 * math.pi * (t - 4.0)) if t > 4.0 else 0.0)
        s = 1.0 + 0.5 * math.exp(-((v / 1e-3) ** 2))
        dz = v - BENCH.sigma_0 * abs(v) * z / s
        friction = BENCH.sigma_0 * z + BENCH.sigma_1 * dz + BENCH.sigma_2 * v
        return [v, push - friction, dz]

    # Points of equal phase: the drift per period does not depend on the phase.
    times = 4.0 + 0.5 * np.array([10.0, 20.0])
    run = solve_ivp(
        flow, (0.0, 14.0), [0.0, 0.0, 0.0], "LSODA", times, rtol=1e-9, atol=1e-13, max_step=0.01
    )
    drift = 1e6 * (run.y[0, 1] - run.y[0, 0]) / 10.0
    measured = table.cell("lugre", "drift").number("drift per period")
    assert measured == pytest.approx(drift, rel=0.01)
    assert drift > 1.0  # µm
