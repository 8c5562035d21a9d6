"""Every SciPy solver class drives the same machines to the same event sequence."""

import functools

import numpy as np
import pytest
from scipy.integrate import BDF, DOP853, LSODA, RK45, Radau

from gms_fsm import simulate
from tests.helpers import FASTEST, event_sequence, open_loop, pulled_mass, stick_slip

pytestmark = pytest.mark.slow

SOLVERS = [RK45, DOP853, Radau, BDF, LSODA]
solvers = pytest.mark.parametrize("solver", SOLVERS, ids=lambda s: s.__name__)


RUNS = {  # two stick-slip cycles in closed loop; a full wave in open loop; tolerances and bounds
    "pulled mass": (pulled_mass(), 14.0, 1e-7, 1e-3, 1e-4),
    "signed": ((stick_slip("signed"), open_loop()), 21.0, 1e-8, 1e-5, 1e-5),
    "published": ((stick_slip("published"), open_loop()), 21.0, 1e-8, 1e-5, 1e-5),
}
CASES = [("pulled mass", each) for each in SOLVERS]
CASES += [("signed", DOP853), ("signed", Radau), ("published", RK45), ("published", BDF)]


@functools.cache
def tight(name):
    """Return our own run with small tolerances."""
    what, t_end, *_ = RUNS[name]
    return simulate(*what, t_end, rtol=1e-12, atol=1e-15, engine=FASTEST)


@pytest.mark.every(2)
@pytest.mark.parametrize(("name", "solver"), CASES)
def test_the_sequence_is_that_of_our_own_tight_run(name, solver):
    what, t_end, rtol, t_bound, z_bound = RUNS[name]
    reference = tight(name)
    assert {"arrest", "break_away_forward"} <= {*reference.transitions.edge}
    trace = simulate(*what, t_end, method=solver, rtol=rtol, atol=1e-3 * rtol)
    assert event_sequence(trace) == event_sequence(reference)
    assert np.abs(trace.transitions.t - reference.transitions.t).max() < t_bound
    assert np.abs(trace.z[-1] - reference.z[-1]).max() < z_bound


@solvers
def test_with_a_step_the_solver_follows_the_grid(solver):
    """With step=h each grid point is among the rows, including the end."""
    h, T = 0.13, 6.0
    trace = simulate(stick_slip("signed"), open_loop(), T, method=solver, step=h)
    grid = np.append(np.arange(0.0, T, h), T)
    assert np.abs(trace.t[:, None] - grid).min(axis=0).max() < 1e-12
    assert len(trace.transitions) == 4


@pytest.mark.parametrize("solver", [RK45, BDF])
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
