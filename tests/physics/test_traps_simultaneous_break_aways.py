"""Elements that break away at the same instant fire as one set, in element order, as micro-steps.

m firings give m + 1 rows at one time with one-sided forces. The naive way, one firing per stop
and then continuing, loses the others: their comparison is already true.
"""

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from tests.helpers import FIG4_SINE, event_sequence, stick_slip

SIGMA = np.array([0.3, 0.4, 0.5, 0.6])


def naive_break_aways(T, h=1e-3):
    """Fire the first enabled element at each change of z_i >= s; return how many fire."""
    z, slipping, fired = np.zeros(4), np.zeros(4, dtype=bool), 0
    truth = z >= 0.4
    for j in range(round(T / h)):
        z = z + h * np.where(slipping, 0.0, 0.15 * np.sin(2 * np.pi * j * h / 25))
        now = z >= 0.4
        if (now != truth).any():  # a stop
            enabled = np.flatnonzero(now & ~slipping)
            slipping[enabled[:1]] = True
            fired += enabled.size > 0
        truth = now
    return fired


@pytest.mark.parametrize("engine", ["machines", "ifelse"])
@pytest.mark.parametrize("law", ["signed", "published"])
def test_four_at_once(law, engine):
    """Fig. 4: all four break away at t = 4.91 s, all at the same float."""
    trace = simulate(stick_slip(law), Prescribed(FIG4_SINE), 6.0, engine=engine)
    assert event_sequence(trace) == [(i, "break_away_forward") for i in range(4)]
    assert naive_break_aways(6.0) == 1
    t = trace.transitions.t
    assert (t == t[0]).all()
    rows = np.flatnonzero(trace.t == t[0])
    np.testing.assert_array_equal(trace.microstep[rows], np.arange(5))
    np.testing.assert_array_equal(rows, np.arange(rows[0], rows[0] + 5))
    for m, row in enumerate(rows):
        assert trace.states[row].tolist() == ["slip"] * m + ["stick"] * (4 - m)
    # z and x do not move; F steps by sigma_i (dz_slip - v), one element after the other.
    assert np.ptp(trace.z[rows], axis=0).tolist() == [0.0] * 4
    dz_slip = np.array([0.1, 0.05, 0.025, 1e-4]) * (1 - trace.z[rows[0]] / trace.s[rows[0]])
    np.testing.assert_allclose(
        np.diff(trace.F[rows]), SIGMA * (dz_slip - trace.v[rows[0]]), rtol=0, atol=1e-12
    )
    np.testing.assert_array_equal(trace.transitions.F_before, trace.F[rows[:-1]])
    np.testing.assert_array_equal(trace.transitions.F_after, trace.F[rows[1:]])
    assert trace.microstep[rows[-1] + 1] == 0
    assert (trace.microstep[: rows[0]] == 0).all()


def test_at_the_start_of_a_run():
    """Elements that may break away at t = 0 do so before the first step."""
    start = {"z": [0.4, 0.1, 0.5, 0.4]}
    trace = simulate(stick_slip("signed"), Prescribed(0.2), 1.0, initial=start)
    assert event_sequence(trace) == [(i, "break_away_forward") for i in (0, 2, 3)]
    assert trace.t[:4].tolist() == [0.0] * 4
    assert trace.microstep[:5].tolist() == [0, 1, 2, 3, 0]
    assert trace.states[0].tolist() == ["stick"] * 4
