"""A corner under a root or a fractional power is crossed: z is the integral of v, computed by quad.

With the sign at the corner frozen through the step, abs(u) would become negative beyond it, where a
root is not defined.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from gms_fsm import Prescribed, simulate
from tests.helpers import one_element

CORNERS = {
    "sqrt(abs(cos(t)))": (lambda t: math.sqrt(abs(math.cos(t))), np.pi / 2 + np.pi * np.arange(3)),
    "abs(sin(t))**0.5": (lambda t: math.sqrt(abs(math.sin(t))), np.pi * np.arange(1, 4)),
    "max(0, sin(t))**1.5": (lambda t: max(0.0, math.sin(t)) ** 1.5, np.pi * np.arange(1, 4)),
    "sqrt(2 - min(2, t)) - 1": (lambda t: math.sqrt(2.0 - min(2.0, t)) - 1.0, np.array([2.0])),
    "sqrt(abs(abs(t - 3) - 1))": (
        lambda t: math.sqrt(abs(abs(t - 3.0) - 1.0)),
        np.array([2.0, 3.0, 4.0]),
    ),
}


@pytest.mark.parametrize("engine", ["machines", "ifelse"])
@pytest.mark.parametrize("text", CORNERS)
def test_the_deflection_is_the_integral_of_the_velocity(text, engine):
    """An element that never breaks away, over corners where the root has an infinite slope."""
    v, corners = CORNERS[text]
    model = one_element("signed", F_c=100.0, F_s=100.0, v_s=1.0, C=1.0, sigma=0.1, k=1.0)
    trace = simulate(model, Prescribed(text), 10.0, engine=engine, rtol=1e-8, atol=1e-10)
    places = [0.0, *corners, 10.0]
    expected = sum(quad(v, a, b)[0] for a, b in pairwise(places))
    assert trace.z[-1, 0] == pytest.approx(expected, abs=1e-5)
