"""A sampled controller changes its values at its ticks only, in written order, in every engine."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Trace, simulate
from gms_fsm.app.scenario import load_scenario
from gms_fsm.errors import ParameterError
from gms_fsm.systems.system import Body, Contact, Sampled, System
from tests.helpers import ROOT, stick_slip

ENGINES = ["ifelse", "machines", "compiled"]


def _run(system: System, t_end: float, engine: str, **options: object) -> Trace:
    if engine == "compiled":
        pytest.importorskip("llvmlite")
    return simulate(system, t_end, engine=engine, **options)  # type: ignore[arg-type]


def counting(offset: float = 0.0, period: float = 0.1) -> System:
    return System(
        "counter",
        bodies=(Body("slide", velocity="0.2 * cos(3 * t)"),),
        contacts=(Contact("pad", stick_slip("signed")),),
        sampled=(
            Sampled(
                "counter",
                period=period,
                offset=offset,
                updates={"count": "count + 1", "twice": "2 * count", "at": "t", "seen": "x"},
                initial={"count": -1},
            ),
        ),
    )


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("offset", [0.0, 0.03])
def test_values_change_at_exact_multiples_of_the_period(engine: str, offset: float) -> None:
    trace = _run(counting(offset), 1.0, engine, t_start=0.0)
    at, count = trace.value("at"), trace.value("count")
    ticks = [round(offset + k * 0.1, 2) for k in range(10)]  # the doubles nearest to them
    first = 0 if offset == 0.0 else 1
    assert sorted(set(at[first:].tolist()) - ({0.0} if offset else set())) == ticks
    for k, tick in enumerate(ticks):
        before, after = trace.t < tick, trace.t >= tick
        assert (count[before] < k).all()
        assert (count[after] >= k).all()


def test_updates_run_in_written_order_and_see_the_results_before_them() -> None:
    trace = _run(counting(), 1.0, "ifelse")
    assert (trace.value("twice") == 2 * trace.value("count")).all()
    rows = np.flatnonzero(trace.t == trace.value("at"))
    assert (trace.value("seen")[rows] == trace.x[rows]).all()


def test_a_run_that_starts_later_ticks_from_its_start() -> None:
    trace = _run(counting(period=0.25), 3.0, "ifelse", t_start=2.1)
    assert sorted(set(trace.value("at").tolist())) == [2.1 + k * 0.25 for k in range(4)]


def test_too_many_ticks_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"counter: its period of 1e-09 s makes 1e\+09 ticks"):
        simulate(counting(period=1e-9), 1.0)


# --------------------------------------------------------------------------- a servo


def servo() -> System:
    """Two masses on a shaft, friction on the load, a PID controller on the motor's position."""
    system = load_scenario(ROOT / "scenarios" / "servo.toml").system
    assert system is not None
    return system


def test_the_servo_is_where_an_independent_loop_has_it() -> None:
    """SciPy with a hand-written loop gave 1.32993 mm at 0.2 s."""
    trace = simulate(servo(), 0.2, engine="ifelse")
    assert trace.body("load").x[-1] == pytest.approx(1.32993e-3, abs=1e-8)
    assert len(trace.transitions) == 24
    close = simulate(servo(), 0.2, engine="ifelse", rtol=1e-9)
    assert close.body("load").x[-1] == pytest.approx(trace.body("load").x[-1], rel=1e-6)
