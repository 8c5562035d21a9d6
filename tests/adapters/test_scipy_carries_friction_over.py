"""Calls of `adapters.scipy.solve_ivp` go on where the last one ended: a controller between them.

The scenario servo with its PID controller in Python: the load is at 1.3215 mm.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import GMSError
from gms_fsm.adapters.scipy import solve_ivp
from tests.adapters.loops import PERIOD, PID, d_s, k_s, m_l, m_m, servo_friction
from tests.helpers import pulled_mass


def _servo(**options: Any) -> tuple[float, int]:
    """Return where the load is after 0.2 s, in mm, and the number of switches."""
    friction, pid, y, switches = servo_friction(), PID(), np.zeros(4), 0
    for tick in range(200):
        u = pid(y[0])

        def rates(t: float, y: Any, F: float, u: float = u) -> list[float]:
            x_m, v_m, x_l, v_l = y
            shaft = k_s * (x_m - x_l) + d_s * (v_m - v_l)
            return [v_m, (u - shaft) / m_m, v_l, (shaft - F) / m_l]

        span = tick * PERIOD, (tick + 1) * PERIOD
        found = solve_ivp(rates, span, y, friction, 3, **options)
        assert found.success, found.message
        y, friction = found.y[:, -1], found.friction
        switches += len(found.switches)
    assert set(friction.states.values()) == {("stick",) * 4}
    return float(y[2]), switches


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "error"),
    [
        ({"method": "RK45"}, 4e-5),
        ({"method": "Radau"}, 4e-5),
        ({"sample": PERIOD}, 5e-3),
        ({"sample": PERIOD / 10}, 4e-5),
    ],
)
def test_the_servo(how: dict[str, Any], error: float) -> None:
    where, switches = _servo(**how)
    assert where == pytest.approx(1.32149e-3, rel=error)
    assert switches == 30


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


def test_two_of_one_model_are_it_twice() -> None:
    model = pulled_mass()[0]

    def both(t: float, y: Any, F: Any) -> list[float]:
        return [*_mass(t, y[:2], F[0]), *_mass(t, y[2:], F[1])]

    one = solve_ivp(_mass, (0.0, 2.0), [0.0, 0.0], model, 1)
    two = solve_ivp(both, (0.0, 2.0), [0.0] * 4, [model, model], [1, 3])
    assert [*two.friction.states] == ["friction1", "friction2"]
    for part in (two.y[:2, -1], two.y[2:, -1]):
        assert part == pytest.approx(one.y[:, -1], rel=1e-3)


def test_the_way_of_stepping_stays() -> None:
    model, _ = pulled_mass()
    located = solve_ivp(_mass, (0.0, 1.0), [0.0, 0.0], model, 1)
    sampled = solve_ivp(_mass, (0.0, 1.0), [0.0, 0.0], model, 1, sample=0.1)
    for friction, options in ((located.friction, {"sample": 0.1}), (sampled.friction, {})):
        with pytest.raises(GMSError, match="friction: it is from a call with"):
            solve_ivp(_mass, (1.0, 2.0), [0.0, 0.0], friction, 1, **options)
    with pytest.raises(GMSError, match=r"begins at 3\.0 s, but the friction has come to 1\.0 s"):
        solve_ivp(_mass, (3.0, 4.0), [0.0, 0.0], sampled.friction, 1, sample=0.1)
