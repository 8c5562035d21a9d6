"""scenarios/drill_string.toml against an independent loop around SciPy.

At rtol 1e-10: the same sequence, and times to 1e-7 s.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gms_fsm.app.scenario import load_scenario
from tests.helpers import ROOT
from tests.hybrid_reference import Modes, Switch, Way, reference

J_T, J_B, K, C, C_R, C_B, U = 2122.0, 471.9698, 861.5336, 172.3067, 425.0, 50.0, 5800.0
W, R_B, MU_C, MU_S, GAMMA = 50000.0, 0.155575, 0.5, 0.8, 0.9
SIGNS = {"stuck": 0.0, "forward": 1.0, "backward": -1.0}


def on_paper() -> list[Switch]:
    """Return the switches; the state is the twist and both speeds."""

    def load(y: Any) -> float:
        return float(C * (y[1] - y[2]) + K * y[0] - C_B * y[2])

    def flow(modes: Modes) -> Any:
        sign = SIGNS[modes[0]]

        def rates(_: float, y: Any) -> list[float]:
            twist, w_t, w_b = y
            rock = W * R_B * (MU_C + (MU_S - MU_C) * math.exp(-GAMMA * abs(w_b)))
            table = (U - C_R * w_t - C * (w_t - w_b) - K * twist) / J_T
            return [w_t - w_b, table, (load(y) - sign * rock) / J_B if sign else 0.0]

        return rates

    def ways(modes: Modes) -> list[Way]:
        sign = SIGNS[modes[0]]
        if sign:
            return [Way(0, "stuck", lambda _, y: -sign * y[2], lambda _, y: [y[0], y[1], 0.0])]
        limit = W * R_B * MU_S
        return [
            Way(0, "forward", lambda _, y: load(y) - limit),
            Way(0, "backward", lambda _, y: -load(y) - limit),
        ]

    return reference(flow, ways, [0.0] * 3, ("stuck",), 60.0)[0]


@pytest.mark.slow
def test_the_bit_sticks_and_slips_as_in_an_independent_loop() -> None:
    loaded = load_scenario(ROOT / "scenarios" / "drill_string.toml", ["run.rtol=1e-10"])
    wanted, log = on_paper(), loaded.simulate(engine="ifelse").transitions
    assert len(wanted) == 25
    assert [(row.source, row.target) for row in log] == [(w.source, w.target) for w in wanted]
    np.testing.assert_allclose(log.t, [each.t for each in wanted], rtol=0, atol=1e-7)
