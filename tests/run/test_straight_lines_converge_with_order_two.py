"""Claim: sampled on straight lines, forces and switch times of a smooth motion converge as dt²."""

from __future__ import annotations

from math import sin

import numpy as np
import pytest

from gms_fsm import FrictionState, Prescribed, simulate
from tests.helpers import FASTEST, pulled_mass

T_END = 20.0  # s
ENDS = np.arange(1.0, 21.0)  # s


@pytest.mark.slow
def test_order_of_forces_and_switch_times() -> None:
    model, _ = pulled_mass()
    rig = Prescribed("0.1*sin(0.63*t)")
    exact = simulate(model, rig, T_END, t_eval=ENDS, engine=FASTEST, rtol=1e-12, atol=1e-15)
    log = [(int(each.element), str(each.edge)) for each in exact.transitions]
    assert len(log) == 32
    per_second, wrong, late = [8, 16, 32, 64, 128, 256, 512], [], []
    for n in per_second:
        friction = FrictionState(model, rtol=1e-10, engine=FASTEST)
        forces, switches, v0 = [], [], 0.0
        for step in range(1, n * 20 + 1):
            v1 = 0.1 * sin(0.63 * step / n)
            forces.append(friction.advance_to(v0, v1, step / n))
            switches += friction.switches
            v0 = v1
        assert [(each.element, each.edge) for each in switches] == log
        wrong.append(np.abs(forces[n - 1 :: n] - exact.F).max())
        late.append(np.abs([each.t for each in switches] - exact.transitions.t).max())
    for errors in (wrong, late):
        order = -np.polyfit(np.log(per_second), np.log(errors), 1)[0]
        assert order == pytest.approx(2.0, abs=0.15)
