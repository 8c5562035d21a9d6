"""While a state locks a contact, its velocity is exactly 0, not 1e-17.

An impact moves a locked contact for no time: the next micro-step lets go.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.corpus import SYSTEM_RUNS, each, trace


@pytest.mark.every(2)
@each(SYSTEM_RUNS)
def test_its_velocity_is_zero(name: str) -> None:
    whole = trace(name)
    for contact in whole.system.contacts:
        seen = whole.contact(contact.name)
        locked = [state.name for state in contact.chart.states if state.locked]
        rows = np.isin(seen.states[:, 0], locked) & (np.diff(whole.t, append=np.inf) > 0)
        assert not seen.v[rows].any(), contact.name
