"""The trace of a branch that was poked amid a cascade counts its micro-steps on."""

from __future__ import annotations

import numpy as np

from gms_fsm import Prescribed, Session
from gms_fsm.traces.views import steps_of
from tests.helpers import FIG4_SINE, stick_slip


def test_every_firing_has_the_row_that_it_made() -> None:
    session = Session(stick_slip("signed"), Prescribed(FIG4_SINE), 10.0)
    session.next_transition()
    session.next_transition()  # two of four break-aways at one time
    session.poke({"z": {3: 0.1}})  # the fourth element will not break away there
    session.goto(10.0)
    trace = session.branches[session.current].trace()
    assert (np.diff(trace.t) >= 0).all()
    rows: dict[tuple[float, int], int] = {}
    for row, key in enumerate(zip(trace.t, trace.microstep, strict=True)):
        rows.setdefault(key, row)  # the poked row has the number of the row that was poked
    log = trace.transitions
    assert len(log) > 3
    for record, step in zip(log, steps_of(trace), strict=True):
        made = rows[record.t, step]
        assert trace.states[made, record.element] == record.target
        assert trace.states[made - 1, record.element] == record.source
