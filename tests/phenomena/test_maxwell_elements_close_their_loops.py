"""Claim: nested loops of parallel Maxwell elements close; in prescribed motion to rounding."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from gms_fsm import Prescribed, measure_phenomena, simulate
from tests.phenomena.cases import MAXWELL, known


@pytest.mark.slow
def test_on_the_bench() -> None:
    maxwell = measure_phenomena({"maxwell": MAXWELL}, ["memory"]).cell("maxwell", "memory")
    lugre = known().cell("lugre", "memory")
    assert maxwell.verdict == "shows"
    assert maxwell.number("gap of the inner loops over their stroke") < 0.05  # %
    assert lugre.number("gap of the inner loops over their stroke") > 10.0


@pytest.mark.slow
def test_in_prescribed_motion_to_rounding() -> None:
    stops = np.array([0.0, 40e-6, 5e-6, 30e-6, 5e-6, 40e-6])  # m
    velocity, t = [], 0.0
    for one, after in itertools.pairwise(stops.tolist()):
        velocity += [(t, np.sign(after - one) * 1e-5)]
        t += abs(after - one) / 1e-5
        velocity += [(t, np.sign(after - one) * 1e-5)]
    ends = np.cumsum(np.abs(np.diff(stops)) / 1e-5)
    trace = simulate(
        MAXWELL, Prescribed(velocity), float(ends[-1]), t_eval=ends, engine="ifelse", rtol=1e-10
    )
    top, bottom, _, bottom_again, top_again = trace.F.tolist()
    assert len(trace.transitions) > 6  # elements do yield, and turn, on the way
    assert bottom_again == pytest.approx(bottom, abs=1e-9)
    assert top_again == pytest.approx(top, abs=1e-9)
