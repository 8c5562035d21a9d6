"""The reference of the random trials is checked by a witness that shares no code with it.

The witness itself is checked on two cases with independently known outcomes: a carriage that never
breaks away, and a mass that is held at v = 0 for a tenth of a millisecond.
"""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from gms_fsm import PulledSlider
from tests.corpus import HELD, MICROMETRES, PUSHED
from tests.helpers import pulled_mass
from tests.trials import JUDGED, Trial, reference, trial
from tests.witness import witness

pytestmark = pytest.mark.slow

HAS_FAST = bool(importlib.util.find_spec("llvmlite"))
ENGINE = "compiled" if HAS_FAST else "ifelse"

CARRIAGE = Trial("a carriage", 0, 0, MICROMETRES, PulledSlider(40, 1600, 1.8e-3), 8.0)
STANDSTILL = Trial("held on v = 0", 0, 0, HELD, PUSHED, 4.0)


def agrees(one: Trial) -> None:
    """Assert the same edges at the same times, and the same end."""
    exact, seen = reference(one, ENGINE), witness(one.model, one.rig, one.t_end)
    assert not exact.failed
    assert exact.sequence == tuple((element, edge) for _, element, edge in seen.transitions)
    times = np.array([t for t, _, _ in seen.transitions])
    np.testing.assert_allclose(exact.t, times, rtol=0, atol=1e-8 * one.t_end)
    np.testing.assert_allclose(exact.end, [seen.x, seen.v, *seen.z], rtol=1e-5, atol=1e3 * one.atol)


def test_a_carriage_that_never_breaks_away() -> None:
    seen = witness(CARRIAGE.model, CARRIAGE.rig, CARRIAGE.t_end)
    assert seen.transitions == []
    assert seen.v == pytest.approx(7.197e-7, rel=1e-3)
    assert seen.peak == pytest.approx(1.198e-6, rel=1e-3)
    agrees(CARRIAGE)


def test_a_mass_held_at_standstill() -> None:
    seen = witness(HELD, PUSHED, 4.0)
    assert len(seen.transitions) == 14
    ((begin, end),) = seen.sliding
    assert begin == pytest.approx(0.3322785, abs=5e-8)
    assert end == pytest.approx(0.3323773, abs=5e-8)
    assert (end, 2, "arrest") in seen.transitions
    agrees(STANDSTILL)


def test_the_pulled_mass() -> None:
    agrees(Trial("pulled mass", 0, 0, *pulled_mass(), 60.0))


@pytest.mark.skipif(not HAS_FAST, reason="needs the extra fast: Python takes half a minute")
@pytest.mark.parametrize("family", JUDGED)
def test_a_trial_of_each_family(family: str) -> None:
    sample = (trial(family, 14, index) for index in range(100))
    agrees(next(one for one in sample if 6 <= len(reference(one, ENGINE).sequence) <= 20))
