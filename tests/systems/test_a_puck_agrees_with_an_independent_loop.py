"""A puck in the plane switches at the times of an independent loop around SciPy.

The loop (`tests.hybrid_reference`) and the equations are written by hand. Systems whose motion is
linear between events have an exact reference (test_random_systems_are_exact.py).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from gms_fsm import Trace
from tests.hybrid_reference import Modes, Switch, Way, reference
from tests.systems_cases import PUCK, puck

TIMES = 1e-7  # s


def agree(trace: Trace, names: Sequence[str], wanted: list[Switch]) -> None:
    """Assert the same switches in the same order, and equal times."""
    log = trace.transitions
    got = [(names.index(str(row.contact)), str(row.source), str(row.target)) for row in log]
    assert len(got) == len(wanted)
    assert got == [(each.contact, each.source, each.target) for each in wanted]
    np.testing.assert_allclose(log.t, [each.t for each in wanted], rtol=0, atol=TIMES)


# --------------------------------------------------------------------------- a puck in the plane
def puck_on_paper() -> list[Switch]:
    A, F_c, F_s, e = 1.4, PUCK["F_c"], PUCK["F_s"], PUCK["v_c"]

    def push(t: float) -> tuple[float, float]:
        return A * math.cos(0.2 * t), A * math.sin(0.4 * t)

    def flow(modes: Modes) -> Any:
        def rates(t: float, y: Any) -> list[float]:
            if modes == ("stuck",):
                return [0.0] * 6
            h, g = y[4:6]
            if modes == ("slip",):
                speed = math.hypot(y[2], y[3])
                h, g = y[2] / speed, y[3] / speed
            f, q = push(t)
            return [y[2], y[3], f - F_c * h, q - F_c * g, 0.0, 0.0]

        return rates

    def direction(t: float, y: Any) -> list[float]:
        size = math.hypot(*push(t))
        return [*y[:4], *(each / size for each in push(t))]

    def ways(modes: Modes) -> list[Way]:
        speed = lambda y: math.hypot(y[2], y[3])  # noqa: E731
        return {
            "stuck": [Way(0, "start", lambda t, _: math.hypot(*push(t)) - F_s, direction)],
            "start": [Way(0, "slip", lambda _, y: speed(y) - e)],
            "slip": [
                Way(
                    0, "stuck", lambda _, y: 0.5 * e - speed(y), lambda _, y: [*y[:2], 0, 0, *y[4:]]
                )
            ],
        }[modes[0]]

    return reference(flow, ways, [0.0] * 6, ("stuck",), 60.0, max_step=0.01)[0]


@pytest.mark.slow
def test_coulomb_friction_in_the_plane() -> None:
    wanted = puck_on_paper()
    assert sum(each.target == "stuck" for each in wanted) >= 4
    agree(puck().run(), ("pad",), wanted)
