"""A contact that begins without load never gives back more work than it has taken.

Of rigid friction the power itself is not negative; bristles and springs store some of the work. By
the monitor, which knows what each spring stores, no element of a passive law makes energy.
"""

from __future__ import annotations

import numpy as np

from gms_fsm.traces.monitors import examine
from tests.corpus import CORPUS, KINDS, each, trace

LOADED = {"started", "scenario brake_squeal", "runs down"}  # springs are wound up at the start
COARSE = {"fig. 3, slipping, loose", "hit, by step"}
RIGID = ("Coulomb", "Karnopp", "Modelica", "Rate-and-state")
NO_FRICTION = {"conditions that last", "functions that jump", "states in states"}
MAKES_ENERGY = {  # the law as published does, for v < 0; the others are relays
    "open loop, published", "fig. 4, published", "scenario paper_fig4_stick_slip",
    "random system 0", "sliding", "conditions that last",
}  # fmt: skip
KEPT = {*KINDS, *MAKES_ENERGY}


@each(sorted({*CORPUS} - LOADED - COARSE - NO_FRICTION), KEPT)
def test_work_that_was_taken(name: str) -> None:
    whole = trace(name)
    for contact in whole.contacts if whole.what.named else ("",):
        part = whole.contact(contact) if contact else whole
        power = part.F * part.v
        steps = 0.5 * (power[1:] + power[:-1]) * np.diff(whole.t)
        taken = np.concatenate([[0.0], np.cumsum(steps)])
        assert taken.min() >= -1e-6 * np.abs(steps).sum(), contact
        if part.model.chart.name.startswith(RIGID):  # between the micro-steps of impacts
            settled = power[np.append(np.diff(whole.t) > 0, True)]
            assert settled.min() >= -1e-9 * np.abs(power).max(), contact


@each(sorted({*CORPUS} - LOADED), KEPT)
def test_no_element_makes_energy(name: str) -> None:
    verdicts = examine(trace(name), "passivity")
    assert all(verdict.ok for verdict in verdicts.values()) == (name not in MAKES_ENERGY)
