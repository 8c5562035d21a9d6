"""Every SciPy solver class drives the same machines to the same event sequence."""

import functools

import numpy as np
import pytest
from scipy.integrate import BDF, DOP853, LSODA, RK45, Radau

from gms_fsm import simulate
from tests.helpers import FASTEST, event_sequence, open_loop, pulled_mass, stick_slip

SOLVERS = [RK45, DOP853, Radau, BDF, LSODA]
solvers = pytest.mark.parametrize("solver", SOLVERS, ids=lambda s: s.__name__)


@functools.cache
def tight(case, *law):
    """Return our own run with small tolerances."""
    what, t_end = (pulled_mass(), 14.0) if case is pulled_mass else ((case(*law), open_loop()), 21)
    return simulate(*what, t_end, rtol=1e-12, atol=1e-15, engine=FASTEST)


def assert_same_run(trace, reference, t_bound, z_bound):
    assert event_sequence(trace) == event_sequence(reference)
    assert np.abs(trace.transitions.t - reference.transitions.t).max() < t_bound
    assert np.abs(trace.z[-1] - reference.z[-1]).max() < z_bound


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "solver"),
    [*(("signed", each) for each in SOLVERS), ("published", RK45), ("published", BDF)],
)
def test_open_loop(solver, law):
    """One full wave of the sine under both laws: the sequence of our own tight run."""
    model, rig = stick_slip(law), open_loop()
    reference = tight(stick_slip, law)
    trace = simulate(model, rig, 21.0, method=solver, rtol=1e-8, atol=1e-11)
    assert len(reference.transitions) == {"signed": 16, "published": 15}[law]
    assert_same_run(trace, reference, 1e-5, 1e-5)


@pytest.mark.slow
@solvers
def test_pulled_mass(solver):
    """Two stick-slip cycles in closed loop."""
    model, rig = pulled_mass()
    reference = tight(pulled_mass)
    trace = simulate(model, rig, 14.0, method=solver, rtol=1e-7, atol=1e-10)
    assert "arrest" in reference.transitions.edge
    assert_same_run(trace, reference, 1e-3, 1e-4)


@solvers
def test_with_a_step_the_solver_follows_the_grid(solver):
    """With step=h each grid point is among the rows, including the end."""
    h, T = 0.13, 6.0
    trace = simulate(stick_slip("signed"), open_loop(), T, method=solver, step=h)
    grid = np.append(np.arange(0.0, T, h), T)
    distance = np.abs(trace.t[:, None] - grid).min(axis=0)
    assert distance.max() < 1e-12
    assert len(trace.transitions) == 4


@solvers
def test_requested_times(solver):
    """t_eval gives exactly these rows, and the log of the run without it."""
    model, rig = stick_slip("published"), open_loop()
    options = {"method": solver, "rtol": 1e-8, "atol": 1e-11}
    times = np.linspace(0.5, 12.0, 47)
    trace = simulate(model, rig, 12.0, t_eval=times, **options)
    full = simulate(model, rig, 12.0, **options)
    np.testing.assert_array_equal(trace.t, times)
    np.testing.assert_array_equal(trace.transitions, full.transitions)
    reference = simulate(model, rig, 12.0, t_eval=times, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(trace.z, reference.z, rtol=0, atol=1e-5)
    np.testing.assert_array_equal(trace.states, reference.states)


class Unfilled(BDF):
    """As it may be: what its memory has by chance are signalling NaNs."""

    def __init__(self, *given, **options):
        super().__init__(*given, **options)
        self.D[2:].view(np.int64)[:] = 0x7FF0000000000001


def test_rows_that_bdf_has_not_filled_are_no_warning():
    simulate(stick_slip("signed"), open_loop(), 1.0, method=Unfilled)
