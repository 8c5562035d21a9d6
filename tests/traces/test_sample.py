"""Trace.sample interpolates inside arcs only: never across a transition or a jump of the input."""

import numpy as np
import pytest

from gms_fsm import Prescribed, Slider, simulate
from tests.helpers import non_drifting, one_element, open_loop, pulled_mass, stick_slip

TIGHT = {"rtol": 1e-9, "atol": 1e-12}
STEPS = Slider(1.0, [(0, 0.0), (1, 0.0), (1, 0.4), (3, 0.4)])
CASES = {
    "open loop, signed": (stick_slip("signed"), open_loop(), 31.0),
    "open loop, published": (stick_slip("published"), open_loop(), 31.0),
    "pulled mass": (*pulled_mass(), 20.0),
    "fig. 3, slipping": (*non_drifting("signed", slipping=True), 10.0),
    "a force that jumps": (non_drifting("signed")[0], STEPS, 3.0),
}


def assert_close(sampled, wanted, bound):
    np.testing.assert_array_equal(sampled.t, wanted.t)
    np.testing.assert_array_equal(sampled.states, wanted.states)
    np.testing.assert_array_equal(sampled.transitions, wanted.transitions)
    for name in ("x", "v", "z"):
        np.testing.assert_allclose(
            getattr(sampled, name), getattr(wanted, name), rtol=0, atol=bound, err_msg=name
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "dense"),
    [("open loop, signed", False), ("pulled mass", True), ("a force that jumps", False)],
)
def test_a_sample_is_what_t_eval_gives(case, dense):
    """From all accepted steps, and from a run with requested rows only (a fine grid)."""
    model, rig, T = CASES[case]
    # The nearest transition may be a clock tick away from a requested time, so check all sides.
    run = simulate(model, rig, T, **TIGHT)
    at = np.unique(run.transitions.t)
    times = np.unique(
        np.concatenate(
            [np.linspace(0, T, 777), at, np.nextafter(at, 0), at - 1e-6, at + 1e-6, at + 1e-3]
        )
    )
    times = times[times <= T]
    wanted = simulate(model, rig, T, t_eval=times, **TIGHT)
    trace = run
    if dense:
        trace = simulate(model, rig, T, t_eval=np.linspace(0, T, 10007), **TIGHT)
    assert_close(trace.sample(times), wanted, 1e-6)


@pytest.mark.parametrize("case", ["open loop, published", "pulled mass", "fig. 3, slipping"])
def test_a_straight_line_across_an_event_would_be_wrong(case):
    """Naive interpolation with numpy.interp over rows of a t_eval run smears F at break-aways."""
    model, rig, T = CASES[case]
    trace = simulate(model, rig, T, t_eval=np.linspace(0, T, 1001), **TIGHT)
    log = trace.transitions
    step = np.abs(log.F_after - log.F_before)
    worst = int(step.argmax())
    t = float(log.t[worst])
    assert step[worst] > 1e-3
    # All firings of that instant, first to last.
    first, last = np.flatnonzero(log.t == t)[[0, -1]]
    before, after = trace.sample([np.nextafter(t, 0), t]).F
    assert before == pytest.approx(log.F_before[first], abs=1e-7)
    assert after == pytest.approx(log.F_after[last], abs=1e-12)
    smeared = np.interp([np.nextafter(t, 0), t], trace.t, trace.F)
    assert abs(smeared[0] - before) + abs(smeared[1] - after) > 0.5 * step[worst]


@pytest.mark.parametrize("t_eval", [None, [0.0, 3.0], [0.0, 1.4, 3.0]])
def test_two_straight_lines(t_eval):
    """z = 0.5 t until it breaks away at 2 s, then z = s: exact from any rows."""
    model = one_element("signed", v_s=1e-3)
    trace = simulate(model, Prescribed(0.5), 3.0, t_eval=t_eval)
    times = np.linspace(0, 3, 301)
    z = trace.sample(times).z[:, 0]
    np.testing.assert_allclose(z, np.minimum(0.5 * times, 1.0), rtol=0, atol=1e-9)
    states = trace.sample([1.999999, 2.000001]).states[:, 0]
    assert states.tolist() == ["stick", "slip"]


@pytest.mark.parametrize("t_eval", [None, [0.0, 2.0]])
def test_a_jump_of_the_velocity(t_eval):
    """v steps from 0.1 to 0.3 m/s at 1 s: x is two straight lines, whatever rows were kept."""
    ramps = [(0, 0.1), (1, 0.1), (1, 0.3), (2, 0.3)]
    trace = simulate(one_element("signed"), Prescribed(ramps), 2.0, t_eval=t_eval)
    times = np.array([0.0, 0.5, 0.9, 0.999, 1.0, 1.001, 1.5, 2.0])
    x = np.where(times < 1, 0.1 * times, 0.1 + 0.3 * (times - 1))
    np.testing.assert_allclose(trace.sample(times).x, x, rtol=0, atol=1e-9)
    assert trace.sample([0.999999, 1.0]).v.tolist() == [0.1, 0.3]


@pytest.mark.parametrize("t_eval", [None, np.linspace(0, 31, 62)])
def test_rows_are_in_the_given_order_and_nothing_is_extrapolated(t_eval):
    model, rig, T = CASES["open loop, signed"]
    trace = simulate(model, rig, T, t_eval=t_eval)
    rows = trace.sample([7.0, 3.0, 7.0])
    np.testing.assert_array_equal(rows.t, [7.0, 3.0, 7.0])
    np.testing.assert_array_equal(rows.z[0], rows.z[2])
    assert rows.states[:, 0].tolist() == ["slip", "stick", "slip"]
    for t in (-1e-9, T + 1e-9, np.nan):
        with pytest.raises(ValueError, match="outside"):
            trace.sample([1.0, t])
