"""Under the signed law the negated input gives the negated response: (v, z, F) -> (-v, -z, -F)."""

import numpy as np
import pytest

from gms_fsm import Prescribed, PulledSlider, Slider, simulate
from tests.helpers import FIG4_SINE, SINE, pulled_mass, stick_slip

MIRRORED = {
    "break_away_forward": "break_away_backward",
    "break_away_backward": "break_away_forward",
    "arrest": "arrest",
}


def assert_mirrored(trace, mirror):
    """Compare two runs row by row."""
    assert len(trace) == len(mirror)
    np.testing.assert_allclose(mirror.t, trace.t, rtol=0, atol=1e-12)
    for name in ("x", "v", "z", "F", "F_elements"):
        np.testing.assert_allclose(
            getattr(mirror, name), -getattr(trace, name), rtol=0, atol=1e-12, err_msg=name
        )
    np.testing.assert_array_equal(mirror.states, trace.states)
    assert [MIRRORED[edge] for edge in trace.transitions.edge.tolist()] == (
        mirror.transitions.edge.tolist()
    )


SIGNALS = [SINE, FIG4_SINE, "0.6*sin(t) + 0.3*sin(2.7*t)", "0.7*cos(t)*exp(-t/20)", "0.05*t - 0.3"]


@pytest.mark.parametrize("signal", SIGNALS)
def test_open_loop(signal):
    """Formula signals, 30 s, Table I."""
    model = stick_slip("signed")
    trace = simulate(model, Prescribed(signal), 30.0)
    assert len(trace.transitions) > 0
    assert_mirrored(trace, simulate(model, Prescribed(f"-({signal})"), 30.0))


def test_the_published_law_is_not_symmetric():
    """The comparison can fail: eq. (1) as printed breaks the symmetry by metres."""
    model = stick_slip("published")
    a = simulate(model, Prescribed(SINE), 30.0)
    b = simulate(model, Prescribed(f"-({SINE})"), 30.0)
    assert np.abs(a.z[-1] + b.z[-1]).max() > 0.1


def test_pulled_mass():
    """Closed loop: the spring's end runs backward."""
    model, rig = pulled_mass()
    mirror = PulledSlider(rig.mass, rig.stiffness, -rig.speed)
    assert_mirrored(simulate(model, rig, 40.0), simulate(model, mirror, 40.0))


def test_slider():
    """Closed loop: a force that makes the elements slip both ways."""
    model, _ = pulled_mass()
    force = "2.5*sin(0.7*t)"
    trace = simulate(model, Slider(1.0, force), 20.0)
    assert set(trace.transitions.edge) == set(MIRRORED)
    assert_mirrored(trace, simulate(model, Slider(1.0, f"-({force})"), 20.0))
