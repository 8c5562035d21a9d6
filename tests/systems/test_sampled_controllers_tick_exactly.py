"""A sampled controller changes its values at its ticks only, in written order, in every engine."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import simulate
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts import CHARTS
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


def test_the_first_step_after_a_tick_at_which_nothing_switches_is_no_small_one() -> None:
    system = System(
        "pulled and damped",
        bodies=(Body("mass", inertia="m", force="u - k * (x - 0.2 * t)"),),
        contacts=(Contact("pad", CHARTS["stiction"], {"F_c": 0.01, "F_s": 0.015, "b": 0.1}),),
        numbers={"m": 1.0, "k": 30.0},
        sampled=(Sampled("damper", period=0.1, updates={"u": "1 - 3 * v"}),),
    )
    trace = simulate(system, 3.0, engine="ifelse")
    assert [each.t for each in trace.transitions] == [0.0]
    steps, tenths = np.diff(trace.t), 10.0 * trace.t[:-1]
    ticks = (np.abs(tenths - np.round(tenths)) < 1e-9) & (tenths > 3.0)
    first = steps[ticks & (steps > 1e-9)]  # rows on both sides of a tick are a clock tick apart
    assert len(first) > 20
    assert first.min() > 0.2 * steps.max()


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
