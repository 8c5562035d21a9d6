"""simulate agrees with a hand-written loop of the guards and flows, on random small models.

`tests.soak.witness` shares no code with the packages: plain if-else, SciPy's DOP853 between all
points where the equations change.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, simulate
from tests.helpers import event_sequence
from tests.soak.witness import Witnessed, witness

pytestmark = pytest.mark.slow


def rig_of(case: dict[str, Any]) -> Prescribed:
    return Prescribed(list(zip(case["times"], case["speeds"], strict=True)))


def model_of(case: dict[str, Any], nudge: float = 1.0) -> GMS:
    weights = [w * nudge for w in case["weights"]]
    n = len(weights)
    parameters = GMSParameters(
        [1.0] * n,
        [0.1] * n,
        case["C"],
        sigma_2=0.1,
        stribeck=Stribeck(case["F_c"], case["F_s"], case["v_s"]),
        v_c=1e-4,
        weights=weights,
    )
    return GMS(parameters, law=case["law"])


def witnessed(case: dict[str, Any], nudge: float = 1.0) -> Witnessed:
    return witness(model_of(case, nudge), rig_of(case), case["times"][-1])


def compared(case: dict[str, Any]) -> list[str]:
    """Assert the same sequence of (element, edge), times and z to 1e-6; return the edges."""
    seen, t_end = witnessed(case), case["times"][-1]
    trace = simulate(model_of(case), rig_of(case), t_end, rtol=1e-9, atol=1e-12)
    assert event_sequence(trace) == [(i, edge) for _, i, edge in seen.transitions]
    found = [t for t, _, _ in seen.transitions]
    np.testing.assert_allclose(trace.transitions.t, found, rtol=0, atol=1e-6 * t_end)
    np.testing.assert_allclose(
        trace.z[-1], seen.z, rtol=0, atol=1e-6 * max(1.0, np.abs(seen.z).max())
    )
    return [edge for _, _, edge in seen.transitions]


@st.composite
def cases(draw: st.DrawFn) -> dict[str, Any]:
    """Draw moderate numbers; the odd fractions avoid ties (v resting on a level)."""

    def number(low: float, high: float) -> float:
        return low + (high - low) * (draw(st.integers(1, 998)) + 0.382) / 1000

    n = draw(st.integers(1, 3))
    F_c = number(0.3, 1.0)
    waits = [number(0.5, 2.5) for _ in range(draw(st.integers(2, 6)))]
    return {
        "law": draw(st.sampled_from(["signed", "published"])),
        "C": [number(0.02, 0.4) for _ in range(n)],
        "weights": [number(0.15, 0.6) for _ in range(n)],
        "F_c": F_c,
        "F_s": F_c * number(1.1, 2.5),
        "v_s": number(0.01, 0.1),
        "times": [0.0, *np.cumsum(waits).tolist()],
        "speeds": [number(-0.6, 0.6) for _ in range(len(waits) + 1)],
    }


# No shrinking: the witness is slow, and the example as drawn is just as informative.
@settings(
    max_examples=8,
    deadline=None,
    derandomize=True,
    phases=[Phase.generate],
    suppress_health_check=[HealthCheck.too_slow],  # of the witness, on a busy machine
)
@given(cases())
def test_same_events_same_deflections(case: dict[str, Any]) -> None:
    # A case decided by a millionth of the threshold tests neither side.
    sequences = [
        [each[1:] for each in witnessed(case, nudge).transitions] for nudge in (1 - 1e-6, 1 + 1e-6)
    ]
    assume(sequences[0] == sequences[1])
    compared(case)


# All three edges; and a break-away near a reversal in one long step: while it sticks, z is a
# parabola, so steps have any length, and s has a narrow peak.
ALL_EDGES = {
    "law": "signed",
    "C": [0.1, 0.3],
    "weights": [0.2, 0.4],
    "F_c": 0.5,
    "F_s": 1.0,
    "v_s": 0.05,
    "times": [0.0, 2.0, 4.0, 6.0],
    "speeds": [0.5, 0.4, -0.6, 0.5],
}
NEAR_A_REVERSAL = {
    "law": "signed",
    "C": [0.17100516],
    "weights": [0.3288219],
    "F_c": 0.3345674,
    "F_s": 0.49560633256551995,
    "v_s": 0.02461438,
    "times": [0.0, 1.712764, 3.425528, 4.690292],
    "speeds": [0.4468584, -0.1231416, 0.1276584, -0.1831416],
}


def test_known_cases() -> None:
    assert {*compared(ALL_EDGES)} == {"break_away_forward", "break_away_backward", "arrest"}
    assert len(compared(NEAR_A_REVERSAL)) == 4
