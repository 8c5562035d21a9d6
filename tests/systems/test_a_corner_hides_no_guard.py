"""A guard at v = 0 is asked also where abs(v) has its corner there.

The comparison of the guard and that of the corner are one. Where a step met v = 0 exactly, the
guard was not asked on the other side, and the contact slid backwards in its state for forward.
"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from gms_fsm import Body, Contact, State, System, Trace, simulate
from tests.systems_cases import STICTION

LEVEL = "(F_c + (F_s - F_c) * exp(-abs(v) / b))"  # friction that falls with the speed
FALLING = replace(
    STICTION,
    name="falling",
    states=(
        State("stuck", locked=True),
        State("forward", outputs={"F": LEVEL}),
        State("backward", outputs={"F": f"-{LEVEL}"}),
    ),
)


def _pulled(share: float) -> Trace:
    system = System(
        "pulled mass",
        bodies=(Body("mass", inertia=1.0, force="2 * (A * sin(0.3 * t) - x)"),),
        contacts=(Contact("pad", FALLING, {"F_c": 1.0, "F_s": 1.5, "b": 0.1}),),
        numbers={"A": 3.0 + 0.1 * share},
    )
    return simulate(system, 60.0, engine="ifelse")


@pytest.mark.slow
def test_the_velocity_has_the_sign_of_its_state() -> None:
    """Over 30 runs, in some of which a step meets v = 0 exactly."""
    count = 0
    for share in range(30):
        trace = _pulled(float(share))
        count += len(trace.transitions)
        for state, sign in (("forward", 1.0), ("backward", -1.0)):
            v = sign * trace.v[trace.states[:, 0] == state]
            assert v.min(initial=math.inf) > -1e-12
    assert count > 100
