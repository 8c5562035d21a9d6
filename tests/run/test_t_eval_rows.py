"""With t_eval the rows are exactly the requested times, right-continuous; the run is the same."""

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Transition, simulate
from tests.helpers import FASTEST, non_drifting, open_loop, pulled_mass, stick_slip

CASES = {
    "open loop, signed": (stick_slip("signed"), open_loop(), 31.0),
    "open loop, published": (stick_slip("published"), open_loop(), 31.0),
    "pulled mass": (*pulled_mass(), 20.0),
    "fig. 3, slipping": (*non_drifting("signed", slipping=True), 10.0),
}
cases = pytest.mark.parametrize("case", CASES)


@cases
def test_rows_on_steps_are_the_steps_rows(case):
    """The times of the accepted steps give the accepted steps' values."""
    model, rig, T = CASES[case]
    full = simulate(model, rig, T, engine=FASTEST)
    times, last = np.unique(full.t[::-1], return_index=True)
    last = len(full) - 1 - last
    trace = simulate(model, rig, T, engine=FASTEST, t_eval=times)
    np.testing.assert_allclose(trace.z, full.z[last], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(trace.states, full.states[last])


@cases
def test_rows_between_steps_are_as_accurate_as_the_steps(case):
    """Dense output: rows inside steps are as close to a run at rtol 1e-12 as its steps are."""
    model, rig, T = CASES[case]
    times = np.linspace(0, T, 1501)
    trace = simulate(model, rig, T, engine=FASTEST, t_eval=times)
    exact = simulate(model, rig, T, engine=FASTEST, t_eval=times, rtol=1e-12, atol=1e-15)
    # Rows within the error of an event's time may be on its other side.
    near = np.abs(times[:, None] - exact.transitions.t).min(axis=1) < 1e-4
    assert near.mean() < 0.1
    assert np.abs(trace.z - exact.z)[~near].max() < 5e-5
    np.testing.assert_array_equal(trace.states[~near], exact.states[~near])


def test_a_transition_at_the_end_is_in_the_last_row():
    """t_end on a transition: the row at t_end comes after the firing."""
    chart = Chart(
        "by the clock",
        ("t",),
        ("z",),
        ("k",),
        (State("early", {"z": "1"}), State("late", {"z": "0"})),
        (Transition("go", "early", "late", guard="t >= 2"),),
        {"F": "k * z"},
    )
    model, rig = ChartModel(chart, {"k": 1.0}, n=2), Prescribed("0.1")
    full = simulate(model, rig, 2.0)
    trace = simulate(model, rig, 2.0, t_eval=[0.0, 2.0])
    assert full.transitions.t.tolist() == trace.transitions.t.tolist() == [2.0, 2.0]
    assert trace.states[-1].tolist() == full.states[-1].tolist() == ["late"] * 2
