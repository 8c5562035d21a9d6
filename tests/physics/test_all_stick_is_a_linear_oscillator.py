"""While every element sticks, the slider is a linear oscillator, and Fig. 3 is one throughout.

m x'' + (sum sigma_i + sigma_2) x' + (sum k_i) x = F_a(t): a ramp up, a ramp down and a sine on a
constant, each solved by a matrix exponential.
"""

import numpy as np
import pytest
from scipy.linalg import expm

from gms_fsm import Slider, simulate
from tests.helpers import FASTEST, FIG3_FORCE, non_drifting

pytestmark = pytest.mark.slow

K, D, m = 111.1, 12.1 + 4.0, 1.0
w = 4 * np.pi
# State (x, v, 1, t, sin wt, cos wt), t counted from the start of a piece: x'' = row @ state.
# Pieces: start, and F_a = a + b t + A sin wt.
PIECES = [(0.0, 0.0, 0.25, 0.0), (2.0, 0.5, -0.125, 0.0), (4.0, 0.25, 0.0, 0.1)]


def closed_form(times: np.ndarray) -> np.ndarray:
    """Return x and v, shape (2, m)."""
    out = np.empty((2, times.size))
    x, v = 0.0, 0.0
    ends = [2.0, 4.0, np.inf]
    for (start, a, b, A), end in zip(PIECES, ends, strict=True):
        M = np.zeros((6, 6))
        M[0, 1] = 1.0
        M[1] = np.array([-K, -D, a, b, A, 0.0]) / m
        M[3, 2] = 1.0
        M[4, 5], M[5, 4] = w, -w
        first = np.array([x, v, 1.0, 0.0, 0.0, 1.0])
        for j in np.flatnonzero((times >= start) & (times <= end)):
            out[:, j] = (expm(M * (times[j] - start)) @ first)[:2]
        if end < np.inf:
            x, v = (expm(M * (end - start)) @ first)[:2]
    return out


@pytest.mark.parametrize("law", ["signed", "published"])
def test_fig_3_is_the_closed_form(law):
    """x, v, all z and F follow it over 30 s; nothing slips."""
    model, rig = non_drifting(law)
    times = np.linspace(0.0, 30.0, 301)
    trace = simulate(model, rig, 30.0, t_eval=times, rtol=1e-11, atol=1e-14, engine=FASTEST)
    x, v = closed_form(times)
    assert len(trace.transitions) == 0
    np.testing.assert_allclose(trace.x, x, rtol=0, atol=1e-9 * np.abs(x).max())
    np.testing.assert_allclose(trace.v, v, rtol=0, atol=1e-9 * np.abs(v).max())
    np.testing.assert_allclose(trace.z, np.tile(x, (4, 1)).T, rtol=0, atol=1e-9 * np.abs(x).max())
    np.testing.assert_allclose(trace.F, K * x + D * v, rtol=0, atol=1e-9)


def test_default_tolerances_are_accurate_to_1e_8_m():
    """At rtol 1e-6, atol 1e-9 the run stays within 1e-8 m of the closed form."""
    model, _ = non_drifting("signed")
    times = np.linspace(0.0, 30.0, 301)
    trace = simulate(model, Slider(m, FIG3_FORCE), 30.0, t_eval=times)
    assert np.abs(trace.x - closed_form(times)[0]).max() < 1e-8


def test_x_stays_in_the_known_range():
    """In every cycle x oscillates between 1.769 and 2.732 mm: the spring does not drift."""
    model, rig = non_drifting("published")
    for first in (10.0, 29.0):
        times = np.linspace(first, first + 1.0, 2001)
        x = simulate(model, rig, 30.0, t_eval=times).x
        assert x.min() == pytest.approx(1.769e-3, abs=1e-6)
        assert x.max() == pytest.approx(2.732e-3, abs=1e-6)
