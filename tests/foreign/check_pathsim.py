"""Claim: in PathSim whole runs agree with `simulate`: the servo, and the pulled mass at 1 kHz."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pathsim import solvers

from tests.adapters.loops import (
    LOAD,
    PULLED_END,
    T_END,
    by_element,
    exact_pulled_mass,
    exact_servo,
    pulled_mass_in_pathsim,
    sequence,
    servo_in_pathsim,
)

SOLVERS = [solvers.SSPRK33, solvers.RK4, solvers.RKDP54, solvers.ESDIRK43]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("period", "error"), [(1e-3, 5e-3), (1e-4, 5e-5)])
def test_the_servo(solver: Any, period: float, error: float) -> None:
    simulation, friction, x_l = servo_in_pathsim(period, Solver=solver)
    simulation.run(T_END)
    assert x_l.state[0] == pytest.approx(LOAD, rel=error)
    logs = zip(by_element(friction.switches), by_element(exact_servo().transitions), strict=True)
    for mine, true in logs:
        assert mine[1] == true[1]
        assert mine[2] == pytest.approx(true[2], abs=1e-3 if period == 1e-3 else 1e-4)


@pytest.mark.parametrize("solver", [solvers.RK4, solvers.RKDP54])
def test_the_pulled_mass_takes_all_its_edges_at_1_khz(solver: Any) -> None:
    simulation, friction, x = pulled_mass_in_pathsim(1e-3, Solver=solver)
    simulation.run(PULLED_END)
    exact = exact_pulled_mass()
    assert len(friction.switches) == 72
    assert sequence(friction.switches) == sequence(exact.transitions)
    late = [each.t for each in friction.switches] - exact.transitions.t
    assert np.abs(late).max() < 2e-4
    assert x.state[0] == pytest.approx(exact.x[-1], abs=1e-4)
