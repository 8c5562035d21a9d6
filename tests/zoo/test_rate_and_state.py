"""Rate-and-state friction: velocity steps and steady states in closed form, critical stiffness."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from scipy.integrate import Radau, solve_ivp

from gms_fsm import ChartModel, Prescribed, PulledSlider, Trace, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.charts.registry import entry
from gms_fsm.errors import ParameterError
from gms_fsm.traces.failures import StepLimitError
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
@functools.cache
def pulled(law: str, share: float, t_end: float, method: object = "dp45") -> Trace:
    """Pull a mass at V_0 through a spring of a share of the critical stiffness, 1 % too fast.

    The critical stiffness is that of Rice and Ruina (1983), inertia included.
    """
    critical = N * (B - A) / D_C * (1 + MASS * V_0**2 / (N * A * D_C))
    spring = share * critical
    start = {"v": 1.01 * V_0, "x": -force(V_0, D_C / V_0) / spring}
    rig = PulledSlider(MASS, spring, V_0)
    atol = None if method == "dp45" else {"x": 1e-12, "v": 1e-10, "psi": 1e-7}
    engine = FASTEST if share == 0.5 and method == "dp45" else "ifelse"  # a long run
    return simulate(model(law), rig, t_end, initial=start, engine=engine, method=method, atol=atol)


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_steady_sliding_is_stable_above_the_critical_stiffness_only(law: str) -> None:
    stiff, soft = pulled(law, 1.2, 1.0), pulled(law, 0.8, 1.0)
    assert abs(stiff.v[stiff.t > 0.9] / V_0 - 1).max() < 0.1 * 0.01
    assert abs(soft.v[soft.t > 0.9] / V_0 - 1).max() > 2 * 0.01


@pytest.mark.slow
def test_far_below_it_sticks_and_slips() -> None:
    trace = pulled("ageing", 0.5, 1.0)
    assert trace.v.max() > 20 * V_0
    assert trace.v.min() < 0.1 * V_0


@pytest.mark.slow
def test_an_implicit_method_takes_few_steps_where_the_mass_rests() -> None:
    explicit, implicit = pulled("ageing", 0.5, 1.0), pulled("ageing", 0.5, 1.0, Radau)
    assert implicit.v.min() == pytest.approx(explicit.v.min(), rel=1e-2)
    assert 10 * len(implicit) < len(explicit)


# --------------------------------------------------------------------------- stiff
# Of each: parameters; mass, spring and speed of the rig; start; end [s]; the tolerance of v.
STIFF: dict[str, tuple[dict[str, float], PulledSlider, dict[str, float], float, float]] = {
    "from rest past the break-away": (P, PulledSlider(1.0, 2.0, 0.1), {"v": 0.0}, 6.0, 1e-12),
    "from rest, with a creep of 2e-32 m/s": (
        {"N": 1e3, "mu_0": 0.6, "a": 0.01, "b": 0.015, "D_c": 1e-5, "V_0": 1e-6},
        PulledSlider(100.0, 2e5, 1e-6),
        {"v": 0.0},
        500.0,
        1e-40,
    ),
    "a stiff spring": (
        {"N": 1e3, "mu_0": 0.6, "a": 0.01, "b": 0.015, "D_c": 1e-5, "V_0": 1e-6},
        PulledSlider(1.0, 1e7, 1e-6),
        {"v": 1e-6, "x": -6.12e-5},
        100.0,
        1e-12,
    ),
    "slip events, then nearly at rest": (
        {"N": 1e3, "mu_0": 0.6, "a": 0.01, "b": 0.015, "D_c": 1e-5, "V_0": 1e-6},
        PulledSlider(100.0, 2e5, 1e-6),
        {"v": 1e-6, "x": -3.06e-3},
        100.0,
        1e-12,
    ),
}


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize(("name", "law"), [*zip(STIFF, 2 * LAWS, strict=True)])
def test_radau_with_absolute_tolerances_follows_a_stiff_run(name: str, law: str) -> None:
    values, rig, start, t_end, least_v = STIFF[name]
    n, mu_0, a, b, d_c, v_0 = (values[each] for each in ("N", "mu_0", "a", "b", "D_c", "V_0"))

    def flow(t: float, state: np.ndarray) -> list[float]:
        """Return the derivatives, written by hand."""
        x, v, psi = state
        force = a * n * np.arcsinh(v / (2 * v_0) * np.exp((mu_0 + b * psi) / a))
        slip, theta = abs(v) / d_c, d_c / v_0 * np.exp(psi)
        change = 1 / theta - slip
        if law == "slip":
            change = -slip * math.log(slip * theta) if v else 0.0
        return [v, (rig.stiffness * (rig.speed * t - x) - force) / rig.mass, change]

    first = [start.get("x", 0.0), start["v"], 0.0]
    atol = [1e-15, 1e-4 * least_v, 1e-11]
    wanted = solve_ivp(flow, (0.0, t_end), first, method="Radau", rtol=1e-10, atol=atol)
    assert wanted.success
    trace = simulate(
        ChartModel(CHARTS[f"rate-state-{law}"], values),
        rig,
        t_end,
        initial=start,
        engine="ifelse",
        method=Radau,
        atol={"x": 1e-12, "v": least_v, "psi": 1e-8},
    )
    assert len(trace) < 2000
    np.testing.assert_allclose(trace.rows.y[-1], wanted.y[:, -1], rtol=1e-4, atol=1e-9)
    assert trace.v[-1] == pytest.approx(wanted.y[1, -1], rel=1e-3)


@pytest.mark.matrix
@pytest.mark.slow
def test_an_explicit_run_that_is_stiff_names_the_method_and_its_tolerances() -> None:
    rig = PulledSlider(1.0, 2.0, 0.1)
    with pytest.raises(StepLimitError) as caught:
        simulate(model("ageing"), rig, 20.0, engine="ifelse", max_steps=20_000)
    atol = {"x": 1e-12, "v": 1e-12, "psi": 1e-12}
    assert f"method=scipy.integrate.Radau, atol={atol}" in str(caught.value)
    with pytest.raises(ParameterError, match=r"no scale for x, v, psi; .*atol={'x': 1e-12"):
        simulate(model("ageing"), rig, 20.0, method=Radau, engine="ifelse")
    trace = simulate(model("ageing"), rig, 20.0, engine="ifelse", method=Radau, atol=atol)
    assert trace.t[-1] == 20.0
