"""While the motion slides on v = 0, v stays there, however far a step goes beyond the slide's end.

Steps of Euler's method that are far too long for these stiff bristles end where no sign between -1
and 1 holds the mass at rest; what a guard reads inside such a step must still be on the surface.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import GMS, GMSParameters, Slider, Stribeck, simulate
from tests.physics.test_hard_random_runs import (
    guards_say_so,
    nothing_is_overdue,
    rows_and_log_agree,
)

MODEL = GMS(
    GMSParameters(
        [17.3, 41.8, 4.16, 33.5],
        [0.292, 1.0, 0.18, 0.133],
        [0.416, 0.187, 0.279, 0.199],
        sigma_2=0.191,
        stribeck=Stribeck(0.154, 0.462, 0.035),
        v_c=1e-4,
        weights=[0.0492, 0.277, 0.0315, 0.0492],
    ),
    law="published",
)


@pytest.mark.parametrize("mass", [0.1, 0.452])
@pytest.mark.parametrize("step", [0.02, 0.055, 0.0629, 0.065, 0.07])
def test_v_is_zero_in_every_row_of_a_slide(step: float, mass: float) -> None:
    trace = simulate(MODEL, Slider(mass, "9*cos(t)"), 6.0, method="euler", step=step)
    slides = trace.rows.mode[:, trace.n :].any(axis=1)
    assert slides.sum() > 10
    np.testing.assert_allclose(trace.v[slides], 0.0, rtol=0.0, atol=1e-14)
    rows_and_log_agree(trace)
    guards_say_so(trace)
    nothing_is_overdue(trace)
