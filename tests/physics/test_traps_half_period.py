"""Steps never exceed half a period of the input, though a sliding element does not limit them.

A sliding element rests at z = s. x, the integral of v, is a state under error control and keeps
the steps short; a solver that integrates z alone steps over reversals.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gms_fsm import Prescribed, simulate
from tests.helpers import one_element

F_c, F_s, v_s, C, A, T = 0.4, 1.5, 1e-3, 0.1, 0.2, 20.0
WAVES = 12


def test_a_solver_without_x_steps_over_reversals():
    """z alone, slip law with events at v = 0: SciPy misses reversals in twelve waves."""

    def slip(t, z):
        v = A * math.sin(2 * math.pi * t / T)
        s = F_c + (F_s - F_c) * math.exp(-((v / v_s) ** 2))
        return [C * (1 - z[0] / s)]

    def reversal(t, z):
        return math.sin(2 * math.pi * t / T)

    run = solve_ivp(slip, (5.0, WAVES * T), [F_c], events=reversal, rtol=1e-6, atol=1e-9)
    assert len(run.t_events[0]) < 2 * WAVES - 5
    assert np.diff(run.t).max() > T / 2


@pytest.mark.parametrize("method", ["dp45", "bs23"])
@pytest.mark.parametrize("T", [0.5, 7.3, 20.0, 300.0])
@pytest.mark.parametrize("law", ["signed", "published"])
def test_every_half_wave_has_its_arrest(law, T, method):
    """n half waves: an arrest at each reversal, a break-away in each half wave."""
    A = 4.0 / T  # the same stroke of 4/pi m in every wave
    trace = simulate(
        one_element(law, F_c=F_c, F_s=F_s, v_s=v_s, C=1e-3 / T),
        Prescribed(f"{A}*sin(2*pi*t/{T})"),
        (WAVES + 0.45) * T,
        method=method,
    )
    log = trace.transitions
    arrests = log.t[log.edge == "arrest"]
    np.testing.assert_allclose(arrests, T / 2 * np.arange(1, 2 * WAVES + 1), rtol=0, atol=1e-4 * T)
    assert len(log) == 4 * WAVES + 1
    assert np.diff(trace.t).max() < T / 2
