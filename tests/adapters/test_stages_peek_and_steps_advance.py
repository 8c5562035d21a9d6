"""Claim: a loop with Runge-Kutta stages is right if its stages peek and its steps advance."""

from __future__ import annotations

import pytest

from gms_fsm import FrictionState
from tests.adapters.loops import (
    LOAD,
    PULLED_END,
    by_element,
    exact_pulled_mass,
    exact_servo,
    sequence,
    servo_by_runge_kutta,
)
from tests.helpers import pulled_mass


@pytest.mark.slow
def test_the_servo_stops_where_it_should() -> None:
    exact = exact_servo()
    assert exact.body("load").x[-1] == pytest.approx(LOAD, rel=1e-4)
    x_l, switches = servo_by_runge_kutta(2e-5)
    assert x_l == pytest.approx(LOAD, rel=5e-5)
    for mine, true in zip(by_element(switches), by_element(exact.transitions), strict=True):
        assert mine[1] == true[1]
        assert mine[2] == pytest.approx(true[2], abs=1e-5)


def test_a_millisecond_is_short_enough_for_the_servo() -> None:
    x_l, switches = servo_by_runge_kutta(1e-3)
    assert x_l == pytest.approx(LOAD, rel=5e-3)
    assert len(switches) == 24


@pytest.mark.slow
def test_the_pulled_mass_takes_all_its_edges_at_1_khz() -> None:
    """Even by the simplest scheme: the last force gives the next velocity."""
    dt, x, v, F, switches = 1e-3, 0.0, 0.0, 0.0, []
    friction = FrictionState(pulled_mass()[0])
    for step in range(round(PULLED_END / dt)):
        v_next = v + dt * (2.0 * (0.1 * step * dt - x) - F)
        F = friction.advance(v, v_next, dt)
        x += dt * (v + v_next) / 2
        v = v_next
        switches += friction.switches
    exact = exact_pulled_mass()
    assert len(exact.transitions) == 72
    assert sequence(switches) == sequence(exact.transitions)


def test_a_step_that_is_given_up_leaves_nothing_behind() -> None:
    """A host with step control: try, look, go back, do."""
    friction, other = (FrictionState(pulled_mass()[0]) for _ in range(2))
    friction.advance(0.0, 0.1, 1.0)
    other.advance(0.0, 0.1, 1.0)
    before = friction.snapshot()
    tried = friction.advance(0.1, -0.3, 2.0)
    assert friction.switches
    friction.restore(before)
    assert friction.advance(0.1, 0.05, 0.5) == other.advance(0.1, 0.05, 0.5) != tried
    assert friction.switches == other.switches
