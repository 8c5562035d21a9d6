"""With ``events="held"`` the chart is asked at ticks, and what it gives out is held between them.

The difference to the located run is a lag: proportional to the sample time.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Trace, simulate
from tests.helpers import non_drifting, open_loop, stick_slip

T = np.linspace(0.0, 8.0, 1601)


def _fig3(**options: object) -> Trace:
    model, rig = non_drifting("published")
    return simulate(model, rig, 8.0, t_eval=T, engine="ifelse", **options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_lag_is_proportional_to_the_sample_time() -> None:
    exact = _fig3(rtol=1e-9)
    ramp = T < 2.0
    force, place = [], []
    for h in (2e-3, 1e-3, 5e-4):
        held = _fig3(events="held", step=h)
        force.append(np.abs(held.F - exact.F)[ramp].max())
        place.append(np.abs(held.x - exact.x)[ramp].max())
    np.testing.assert_allclose(np.array(force[:-1]) / force[1:], 2.0, rtol=0.05)
    np.testing.assert_allclose(np.array(place[:-1]) / place[1:], 2.0, rtol=0.05)
    assert force[1] == pytest.approx(1.7e-4, rel=0.2)
    assert place[1] == pytest.approx(2.3e-6, rel=0.2)


def test_the_force_changes_at_ticks_only() -> None:
    trace = simulate(
        stick_slip("signed"), open_loop(), 3.0, events="held", step=0.25, engine="ifelse"
    )
    ticks = np.arange(12) * 0.25
    for start, end in zip(ticks, [*ticks[1:], 3.0], strict=True):
        inside = (trace.t > start) & (trace.t < end)
        assert inside.sum() > 0
        assert np.ptp(trace.F[inside]) == 0.0
        assert np.ptp(trace.dz[inside], axis=0).max() == 0.0


def test_machines_fire_at_ticks_only_and_once_each() -> None:
    trace = simulate(
        stick_slip("signed"), open_loop(), 61.0, events="held", step=0.25, engine="ifelse"
    )
    log = trace.transitions
    assert len(log) > 20
    assert (log.t % 0.25 == 0.0).all()
    pairs = list(zip(log.t.tolist(), log.element.tolist(), strict=True))
    assert len(set(pairs)) == len(pairs)
