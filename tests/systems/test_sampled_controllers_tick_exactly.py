"""A sampled controller changes its values at its ticks only, in written order, in every engine."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import simulate
from gms_fsm.app.scenario import load_scenario
from gms_fsm.systems.system import Body, Contact, Sampled, System
from tests.helpers import stick_slip


def counting(period: float = 0.1) -> System:
    return System(
        "counter",
        bodies=(Body("slide", velocity="0.2 * cos(3 * t)"),),
        contacts=(Contact("pad", stick_slip("signed")),),
        sampled=(
            Sampled(
                "counter",
                period=period,
                updates={"count": "count + 1", "twice": "2 * count", "at": "t", "seen": "x"},
                initial={"count": -1},
            ),
        ),
    )


def test_updates_run_in_written_order_and_see_the_results_before_them() -> None:
    """At which times is in test_ticks_of_several_rates.py."""
    trace = simulate(counting(), 1.0, engine="ifelse")
    assert (trace.value("twice") == 2 * trace.value("count")).all()
    rows = np.flatnonzero(trace.t == trace.value("at"))
    assert (trace.value("seen")[rows] == trace.x[rows]).all()


def test_a_run_that_starts_later_ticks_from_its_start() -> None:
    trace = simulate(counting(0.25), 3.0, engine="ifelse", t_start=2.1)
    assert sorted(set(trace.value("at").tolist())) == [2.1 + k * 0.25 for k in range(4)]


# --------------------------------------------------------------------------- a servo


def servo() -> System:
    """Two masses on a shaft, friction on the load, a PID controller on the motor's position."""
    system = load_scenario("servo").system
    assert system is not None
    return system


@pytest.mark.slow
def test_the_servo_is_where_an_independent_loop_has_it() -> None:
    """A Runge-Kutta loop written by hand in C tends to 1.32149 mm at 0.2 s."""
    trace = simulate(servo(), 0.2, engine="ifelse")
    assert trace.body("load").x[-1] == pytest.approx(1.32149e-3, abs=1e-8)
    assert len(trace.transitions) == 30
    close = simulate(servo(), 0.2, engine="ifelse", rtol=1e-9)
    assert close.body("load").x[-1] == pytest.approx(trace.body("load").x[-1], rel=1e-6)
