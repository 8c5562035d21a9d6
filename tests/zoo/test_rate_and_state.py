"""Rate-and-state friction: velocity steps and steady states in closed form, critical stiffness."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import Radau

from gms_fsm import ChartModel, Prescribed, PulledSlider, Trace, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.charts.registry import entry
from tests.helpers import FASTEST

LAWS = ("ageing", "slip")
P = dict(entry("rate-state-ageing").demonstration.values)
N, MU_0, A, B, D_C, V_0 = (float(P[name]) for name in ("N", "mu_0", "a", "b", "D_c", "V_0"))  # type: ignore[arg-type]
MASS = 0.01  # kg


def model(law: str) -> ChartModel:
    return ChartModel(CHARTS[f"rate-state-{law}"], P)


def force(v: float, theta: float) -> float:
    """Return the force, by its formula."""
    return (
        A * N * math.asinh(v / (2 * V_0) * math.exp((MU_0 + B * math.log(V_0 * theta / D_C)) / A))
    )


def theta_after_a_step(law: str, v: float, t: float) -> float:
    """Return theta after a time at v, from the steady state at V_0."""
    before, after, decay = D_C / V_0, D_C / v, math.exp(-v * t / D_C)
    if law == "ageing":
        return after + (before - after) * decay
    return after * math.exp(math.log(before / after) * decay)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("v", [1e-2, 1e-4])
def test_a_velocity_step_is_that_of_the_closed_form(law: str, v: float) -> None:
    trace = simulate(model(law), Prescribed(repr(v)), 5 * D_C / v, rtol=1e-10, engine="ifelse")
    wanted = [force(v, theta_after_a_step(law, v, t)) for t in trace.t]
    assert abs(wanted[0] - wanted[-1]) > 0.3  # it relaxes
    np.testing.assert_allclose(trace.F, wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_the_steady_force_falls_with_the_logarithm_of_the_speed(law: str) -> None:
    for v in (1e-4, 1e-2, 1e-1):
        trace = simulate(model(law), Prescribed(repr(v)), 40 * D_C / v, engine="ifelse")
        assert trace.F[-1] == pytest.approx(N * (MU_0 + (A - B) * math.log(v / V_0)), abs=1e-5)


def test_only_the_ageing_law_heals_at_rest() -> None:
    ends = {}
    for law in LAWS:
        trace = simulate(model(law), Prescribed("0"), 10.0, engine="ifelse")
        assert (trace.F == 0.0).all()
        ends[law] = trace.variable("psi")[-1, 0]
    assert ends["slip"] == 0.0
    assert ends["ageing"] == pytest.approx(math.log(V_0 / D_C * (D_C / V_0 + 10.0)), abs=1e-6)


# --------------------------------------------------------------------------- on a spring
def pulled(law: str, share: float, t_end: float, method: object = "dp45") -> Trace:
    """Pull a mass at V_0 through a spring of a share of the critical stiffness, 1 % too fast.

    The critical stiffness is that of Rice and Ruina (1983), inertia included.
    """
    critical = N * (B - A) / D_C * (1 + MASS * V_0**2 / (N * A * D_C))
    spring = share * critical
    start = {"v": 1.01 * V_0, "x": -force(V_0, D_C / V_0) / spring}
    rig = PulledSlider(MASS, spring, V_0)
    engine = FASTEST if method == "dp45" else "ifelse"
    atol = None if method == "dp45" else {"x": 1e-12, "v": 1e-10, "psi": 1e-7}
    return simulate(model(law), rig, t_end, initial=start, engine=engine, method=method, atol=atol)


@pytest.mark.parametrize("law", LAWS)
def test_steady_sliding_is_stable_above_the_critical_stiffness_only(law: str) -> None:
    stiff, soft = pulled(law, 1.2, 1.0), pulled(law, 0.8, 1.0)
    assert abs(stiff.v[stiff.t > 0.9] / V_0 - 1).max() < 0.1 * 0.01
    assert abs(soft.v[soft.t > 0.9] / V_0 - 1).max() > 2 * 0.01


def test_far_below_it_sticks_and_slips() -> None:
    trace = pulled("slip", 0.5, 1.0)
    assert trace.v.max() > 20 * V_0
    assert trace.v.min() < 0.1 * V_0


def test_an_implicit_method_takes_few_steps_where_the_mass_rests() -> None:
    explicit, implicit = (pulled("ageing", 0.5, 1.0, each) for each in ("dp45", Radau))
    assert implicit.v.min() == pytest.approx(explicit.v.min(), rel=1e-2)
    assert 10 * len(implicit) < len(explicit)
