"""A run continued from its own last row equals the uninterrupted run."""

import numpy as np
import pytest

from gms_fsm import Slider, simulate
from tests.helpers import event_sequence, non_drifting, open_loop, pulled_mass, stick_slip

TIGHT = {"rtol": 1e-11, "atol": 1e-13}
CASES = {
    "open loop, signed": (stick_slip("signed"), open_loop(), 31.0),
    "open loop, published": (stick_slip("published"), open_loop(), 31.0),
    "pulled mass": (*pulled_mass(), 20.0),
    "slider": (pulled_mass()[0], Slider(1.0, "2.5*sin(0.7*t)"), 12.0),
    "non-drifting": (*non_drifting("signed", slipping=True), 8.0),
}


def last_row(trace):
    """Return the last row in the form that `initial` takes."""
    values = {"z": trace.z[-1], "states": trace.states[-1].tolist(), "x": trace.x[-1]}
    return values if trace.rig.acceleration is None else values | {"v": trace.v[-1]}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "share"), [*zip(CASES, [0.31, 0.5, 0.77, 0.31, 0.77], strict=True)]
)
def test_continued(case, share):
    """z, x, v, states and the joined log equal those of the whole run."""
    model, rig, T = CASES[case]
    whole = simulate(model, rig, T, **TIGHT)
    first = simulate(model, rig, share * T, **TIGHT)
    second = simulate(model, rig, T, t_start=share * T, initial=last_row(first), **TIGHT)
    assert event_sequence(first) + event_sequence(second) == event_sequence(whole)
    assert len(whole.transitions) > 0
    for name in ("x", "v", "z", "F"):
        np.testing.assert_allclose(
            getattr(second, name)[-1], getattr(whole, name)[-1], rtol=0, atol=1e-9, err_msg=name
        )
    np.testing.assert_array_equal(second.states[-1], whole.states[-1])


def test_cut_on_a_transition():
    """Cut exactly at a break-away: the first part ends after the firing, nothing fires twice."""
    model, rig, T = CASES["open loop, signed"]
    whole = simulate(model, rig, T, **TIGHT)
    cut = float(whole.transitions.t[8])
    first = simulate(model, rig, cut, **TIGHT)
    second = simulate(model, rig, T, t_start=cut, initial=last_row(first), **TIGHT)
    assert event_sequence(first) + event_sequence(second) == event_sequence(whole)
    np.testing.assert_allclose(second.z[-1], whole.z[-1], rtol=0, atol=1e-9)


def test_without_the_states_it_is_another_run():
    """The cut carries the states too: a continuation without them takes another course."""
    model, rig, _ = CASES["open loop, signed"]
    first = simulate(model, rig, 7.0, **TIGHT)
    assert (first.states[-1] == "slip").all()
    # Table I, s = 0.4 m while sliding: in stick the elements would break away at once, so
    # they are taken where z is smaller.
    start = last_row(first) | {"z": 0.5 * first.z[-1]}
    kept = simulate(model, rig, 8.0, t_start=7.0, initial=start)
    start.pop("states")
    lost = simulate(model, rig, 8.0, t_start=7.0, initial=start)
    assert np.abs(kept.z[-1] - lost.z[-1]).max() > 0.01
