"""Calls of `adapters.scipy.solve_ivp` go on where the last one ended: a controller between them.

The servo of scenarios/servo.toml with its PID controller in Python: the load is at 1.3299 mm.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import GMSError
from gms_fsm.adapters.scipy import solve_ivp
from gms_fsm.app.scenario import load_scenario
from tests.helpers import ROOT, pulled_mass

PERIOD = 1e-3  # s


def _servo(**options: Any) -> tuple[float, int]:
    """Return where the load is after 0.2 s, in mm, and the number of switches."""
    friction: Any = load_scenario(ROOT / "scenarios" / "servo.toml").model
    y, integral, before, switches = np.zeros(4), 0.0, 0.0, 0
    for tick in range(200):
        e = 2e-3 - y[0]
        u = 400.0 * e + integral + 40.0 * (e - before) / PERIOD
        integral, before = integral + 500.0 * PERIOD * e, e

        def rates(t: float, y: Any, F: float, u: float = u) -> list[float]:
            x_m, v_m, x_l, v_l = y
            shaft = 2e4 * (x_m - x_l) + 5.0 * (v_m - v_l)
            return [v_m, (u - shaft) / 0.5, v_l, shaft - F]

        span = tick * PERIOD, (tick + 1) * PERIOD
        found = solve_ivp(rates, span, y, friction, 3, **options)
        assert found.success, found.message
        y, friction = found.y[:, -1], found.friction
        switches += len(found.switches)
    assert friction.states == {"bearing": ("stick",) * 4}
    return 1e3 * float(y[2]), switches


@pytest.mark.slow
@pytest.mark.parametrize("method", ["RK45", "Radau", "LSODA"])
def test_the_servo(method: str) -> None:
    where, switches = _servo(method=method)
    assert where == pytest.approx(1.32993, abs=5e-5)
    assert switches == 24


@pytest.mark.slow
def test_the_servo_by_samples() -> None:
    where, switches = _servo(sample=PERIOD)
    assert where == pytest.approx(1.3299, rel=5e-3)
    assert switches == 24
    where, _ = _servo(sample=PERIOD / 10)
    assert where == pytest.approx(1.32993, abs=5e-5)


def _mass(t: float, y: Any, F: float) -> list[float]:
    return [y[1], 2.0 * (0.1 * t - y[0]) - F]


@pytest.mark.parametrize("options", [{}, {"sample": 0.05}])
def test_a_call_changes_nothing_of_an_earlier_one(options: dict[str, Any]) -> None:
    model, _ = pulled_mass()
    first = solve_ivp(_mass, (0.0, 9.0), [0.0, 0.0], model, 1, **options)
    once, again = (
        solve_ivp(_mass, (9.0, 12.0), first.y[:, -1], first.friction, 1, **options)
        for _ in range(2)
    )
    assert len(once.switches) > 0
    assert once.switches == again.switches
    assert np.array_equal(once.y, again.y)


def test_the_way_of_stepping_stays() -> None:
    model, _ = pulled_mass()
    located = solve_ivp(_mass, (0.0, 1.0), [0.0, 0.0], model, 1)
    sampled = solve_ivp(_mass, (0.0, 1.0), [0.0, 0.0], model, 1, sample=0.1)
    for friction, options in ((located.friction, {"sample": 0.1}), (sampled.friction, {})):
        with pytest.raises(GMSError, match="friction: it is from a call with"):
            solve_ivp(_mass, (1.0, 2.0), [0.0, 0.0], friction, 1, **options)
    with pytest.raises(GMSError, match=r"begins at 3\.0 s, but the friction has come to 1\.0 s"):
        solve_ivp(_mass, (3.0, 4.0), [0.0, 0.0], sampled.friction, 1, sample=0.1)
