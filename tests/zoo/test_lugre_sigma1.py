"""LuGre with sigma_1(v): LuGre where v_d is large, and SciPy's solution where it is not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gms_fsm import ChartModel, PulledSlider, Stribeck, Trace, simulate
from gms_fsm.charts import CHARTS

CURVE = Stribeck(F_c=1.0, F_s=1.5, v_s=0.05)
BRISTLE = {"sigma_0": 1e3, "sigma_1": 31.623}
PULL = PulledSlider(1.0, 2.0, 0.1)


def run(name: str, **own: float) -> Trace:
    model = ChartModel(CHARTS[name], {**BRISTLE, **own}, stribeck=CURVE, sigma_2=0.4)
    grid = np.linspace(0.0, 12.0, 601)
    return simulate(model, PULL, 12.0, rtol=1e-10, t_eval=grid, engine="ifelse")


@pytest.mark.slow
def test_with_a_large_v_d_it_is_lugre() -> None:
    one, other = run("lugre"), run("lugre-sigma1", v_d=1e12)
    assert (one.x == other.x).all()
    assert (one.F == other.F).all()


def test_scipy_agrees() -> None:
    v_d, trace = 0.05, run("lugre-sigma1", v_d=0.05)

    def rates(t: float, y: list[float]) -> list[float]:
        x, v, z = y
        s = 1.0 + 0.5 * math.exp(-((v / 0.05) ** 2))
        dz = v - 1e3 * abs(v) * z / s
        F = 1e3 * z + 31.623 * math.exp(-((v / v_d) ** 2)) * dz + 0.4 * v
        return [v, 2.0 * (0.1 * t - x) - F, dz]

    found = solve_ivp(
        rates, (0, 12), [0, 0, 0], "LSODA", trace.t, rtol=1e-11, atol=1e-13, max_step=2e-3
    )
    assert trace.v.max() > 0.2  # it slips
    assert trace.x == pytest.approx(found.y[0], abs=1e-7)
    assert trace.variable("z")[:, 0] == pytest.approx(found.y[2], abs=1e-9)
