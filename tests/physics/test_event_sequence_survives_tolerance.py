"""Default tolerances give the event sequence of rtol 1e-12 in 25 random pulled masses."""

import numpy as np
import pytest

from gms_fsm import simulate
from tests.helpers import FASTEST, event_sequence, pulled_mass

SHARES = np.random.default_rng(20251203).uniform(0.8, 1.2, size=(25, 4))


@pytest.mark.slow
@pytest.mark.parametrize("shares", SHARES, ids=range(len(SHARES)))
def test_sequence_and_times(shares):
    """k within 20 % of (40, 30, 20, 10) N/m, w = 1/(4 k), 60 s."""
    model, rig = pulled_mass(np.array([40.0, 30.0, 20.0, 10.0]) * shares)
    trace = simulate(model, rig, 60.0, engine=FASTEST)
    tight = simulate(model, rig, 60.0, rtol=1e-12, atol=1e-15, engine=FASTEST)
    assert len(trace.transitions) > 40
    assert event_sequence(trace) == event_sequence(tight)
    assert np.abs(trace.transitions.t - tight.transitions.t).max() < 1e-3
