"""Bouc-Wen against its closed forms for the exponents 1 and 2, to 1e-7 of the saturated z.

Between reversals and zeros of z the rate dz/dx is 1 - c w^p with w = |z| / D and a constant c.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from gms_fsm import ChartModel, Prescribed, simulate
from gms_fsm.charts import CHARTS

D, K, BETA, GAMMA = 1e-5, 1e5, 0.7, 0.2
AMPLITUDE, OMEGA = 4e-5, 2.0  # m, rad/s


def advanced(w: float, travel: float, p: int) -> float:
    """Return z / D after a travel / D in one direction, which is positive."""
    if w < 0.0:  # towards zero: dw/dx = 1 + (beta - gamma) |w|^p
        c = BETA - GAMMA
        if p == 1:
            needed = math.log(1.0 - c * w) / c
            if travel < needed:
                return (1.0 - (1.0 - c * w) * math.exp(-c * travel)) / c if c else w + travel
        else:
            root = math.sqrt(c)
            needed = -math.atan(root * w) / root
            if travel < needed:
                return math.tan(math.atan(root * w) + root * travel) / root
        return advanced(0.0, travel - needed, p)
    c = BETA + GAMMA  # away from zero: dw/dx = 1 - (beta + gamma) w^p
    if p == 1:
        return (1.0 - (1.0 - c * w) * math.exp(-c * travel)) / c
    root = math.sqrt(c)
    return math.tanh(math.atanh(root * w) + root * travel) / root


def on_paper(times: np.ndarray, p: int) -> Iterator[float]:
    """Yield z at each time, for x = AMPLITUDE sin(OMEGA t)."""
    x = lambda t: AMPLITUDE * math.sin(OMEGA * t)  # noqa: E731
    w, last, turn = 0.0, 0.0, 0
    for t in times:
        while (at := (turn + 0.5) * math.pi / OMEGA) <= t:
            w, last, turn = _moved(w, x(at) - last, p), x(at), turn + 1
        yield D * _moved(w, x(t) - last, p)


def _moved(w: float, dx: float, p: int) -> float:
    return math.copysign(1.0, dx) * advanced(math.copysign(1.0, dx) * w, abs(dx) / D, p)


@pytest.mark.parametrize("p", [1, 2])
def test_z_is_that_of_the_closed_form(p: int) -> None:
    values = {"k": K, "alpha": 0.1, "D": D, "A": 1.0, "beta": BETA, "gamma": GAMMA, "p": p}
    drive = Prescribed(f"{AMPLITUDE * OMEGA!r} * cos({OMEGA!r} * t)")
    trace = simulate(
        ChartModel(CHARTS["bouc-wen"], values), drive, 10.0, rtol=1e-10, engine="ifelse"
    )
    limit = D * (1.0 / (BETA + GAMMA)) ** (1.0 / p)
    wanted = np.array(list(on_paper(trace.t, p)))
    assert abs(wanted).max() > 0.95 * limit
    np.testing.assert_allclose(trace.z[:, 0], wanted, rtol=0, atol=1e-7 * limit)
    np.testing.assert_allclose(
        trace.F, 0.1 * K * trace.x + 0.9 * K * wanted, rtol=0, atol=1e-7 * K * limit
    )


@pytest.mark.parametrize("p", [1.0, 1.5, 2.0, 4.0])
def test_z_saturates_where_the_docstring_says(p: float) -> None:
    values = {"k": K, "alpha": 0.0, "D": D, "A": 1.3, "beta": BETA, "gamma": GAMMA, "p": p}
    trace = simulate(
        ChartModel(CHARTS["bouc-wen"], values), Prescribed("1e-3"), 1.0, engine="ifelse"
    )
    assert trace.z[-1, 0] == pytest.approx(D * (1.3 / (BETA + GAMMA)) ** (1 / p), rel=1e-6)
