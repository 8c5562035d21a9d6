"""The Stribeck dip, a few milliseconds around a reversal, is integrated and not stepped over.

z at the arrest carries the effect of the dip. Solvers that do not know of it step over it whatever
their tolerance; a run with default tolerances and no maximum step is correct.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, simulate
from tests.helpers import event_sequence, one_element


def z_at_arrest(F_c, F_s, v_s, C, A, T):
    """Return z where v = A sin(2 pi t / T) has fallen to v_c, after slipping for a long time.

    The linear flow dz = C (1 - z/s) from z = F_c, by its integral formula:
    z = F_c + integral of g(t) exp(-G(t)) dt with u = z - F_c, du = C (1 - F_c/s) - C u / s.
    """
    w = 2 * math.pi / T
    start, end = (T / 2 - math.asin(v / A) / w for v in (7 * v_s, 1e-6))

    def s(t):
        return F_c + (F_s - F_c) * math.exp(-((A * math.sin(w * t) / v_s) ** 2))

    def rate(t):
        return C / s(t)

    def integrand(t):
        return C * (1 - F_c / s(t)) * math.exp(-quad(rate, t, end, epsabs=1e-13)[0])

    return F_c + quad(integrand, start, end, epsabs=1e-13)[0]


# Table I's first element; then dips that are shorter relative to everything else in the run.
CASES = {
    "Table I, element 1": (0.4, 1.5, 1e-3, 0.1, 0.2, 20.0),
    "fast pass": (0.16, 1.26, 1.3e-3, 0.57, 1.7, 10.0),
    "faster pass": (0.05, 0.12, 8.5e-4, 0.068, 0.61, 18.0),
    "narrow dip": (0.29, 0.86, 4.7e-4, 0.47, 1.4, 17.0),
    "shallow and fast": (0.26, 0.75, 2e-3, 0.014, 1.3, 8.1),
    "slow input": (0.4, 1.5, 1e-3, 0.1, 0.2, 200.0),
    "quick input": (0.4, 1.5, 1e-3, 0.1, 0.6, 4.0),
}
cases = pytest.mark.parametrize("case", CASES.values(), ids=CASES)


def located(case, **options):
    F_c, F_s, v_s, C, A, T = case
    model = one_element("signed", F_c=F_c, F_s=F_s, v_s=v_s, C=C)
    trace = simulate(model, Prescribed(f"{A}*sin(2*pi*t/{T})"), 0.55 * T, **options)
    assert event_sequence(trace)[:2] == [(0, "break_away_forward"), (0, "arrest")]
    return float(trace.transitions.z[1])


@cases
@pytest.mark.parametrize("method", ["dp45", "bs23"])
def test_default_tolerances_resolve_the_dip(case, method):
    """rtol 1e-6, atol 1e-9, no longest step: z is right to 2e-5 m."""
    exact = z_at_arrest(*case)
    assert exact - case[0] > 1e-5  # the dip has an effect
    assert abs(located(case, method=method) - exact) < 2e-5


@cases
def test_tight_tolerances_resolve_the_dip(case):
    """rtol 1e-10: z is right to 1e-8 m."""
    assert abs(located(case, rtol=1e-10, atol=1e-13) - z_at_arrest(*case)) < 1e-8


@pytest.mark.parametrize("solver", ["RK45", "LSODA"])
def test_a_solver_without_the_stop_steps_over_it(solver):
    """SciPy's solvers, with the sign frozen but no stop at the dip, are wrong by over 1e-3 m."""
    case = CASES["Table I, element 1"]
    F_c, F_s, v_s, C, A, T = case

    def slip(t, z):
        v = A * math.sin(2 * math.pi * t / T)
        return [C * (1 - z[0] / (F_c + (F_s - F_c) * math.exp(-((v / v_s) ** 2))))]

    exact = z_at_arrest(*case)
    for rtol in (1e-6, 1e-9):
        run = solve_ivp(
            slip, (3.8, 13.0), [F_c], method=solver, rtol=rtol, atol=1e-3 * rtol, dense_output=True
        )
        assert abs(run.sol(T / 2)[0] - exact) > 1e-3
    assert abs(located(case) - exact) < 2e-5


def test_the_previous_step_length_steps_over_it():
    """A step that was right before the dip passes it in one go: the first one must be small.

    At |v| = 6.1 v_s the sliding element is at rest (z = s), so a controller that keeps its old
    step of a second or so has no reason to resolve the dip of 0.1 s.
    """
    case = CASES["Table I, element 1"]
    F_c, F_s, v_s, C, A, T = case
    t_dip = T / 2 - math.asin(6.1 * v_s / A) * T / (2 * math.pi)

    def slip(t, z):
        v = A * math.sin(2 * math.pi * t / T)
        return [C * (1 - z[0] / (F_c + (F_s - F_c) * math.exp(-((v / v_s) ** 2))))]

    exact = z_at_arrest(*case)
    old = solve_ivp(
        slip, (t_dip, T / 2 + 1), [F_c], first_step=1.0, rtol=1e-6, atol=1e-9, dense_output=True
    )
    small = solve_ivp(slip, (t_dip, T / 2), [F_c], first_step=1e-3, rtol=1e-6, atol=1e-9)
    assert abs(old.sol(T / 2)[0] - exact) > 1e-3
    assert abs(small.y[0, -1] - exact) < 2e-5


def test_the_error_norm_is_a_maximum():
    """One slipping element among 49 at rest is integrated as well as alone."""
    F_c, F_s, v_s, C, A, T = CASES["Table I, element 1"]
    n = 50
    parameters = GMSParameters(
        np.ones(n),
        np.zeros(n),
        np.full(n, C),
        sigma_2=0.0,
        stribeck=Stribeck(F_c, F_s, v_s),
        v_c=1e-6,
        weights=np.append(np.full(n - 1, 100.0), 1.0),
    )
    trace = simulate(GMS(parameters, law="signed"), Prescribed(f"{A}*sin(2*pi*t/{T})"), 11.0)
    assert event_sequence(trace) == [(n - 1, "break_away_forward"), (n - 1, "arrest")]
    assert abs(trace.transitions.z[1] - z_at_arrest(F_c, F_s, v_s, C, A, T)) < 2e-5
