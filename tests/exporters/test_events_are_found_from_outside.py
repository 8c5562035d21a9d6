"""Claim: whoever integrates from outside and goes to the roots of the indicators sees all switches.

At such a root the comparison has really changed. The importer here is the simplest one: steps of
the classical Runge-Kutta method, and bisection in time where an indicator changes its sign.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gms_fsm import Body, Contact, System, simulate
from gms_fsm.exporters import Subject
from gms_fsm.exporters.fmi.model import FmuArguments, both_of
from gms_fsm.lowering.adapting import adapt
from integrators.loop import ARC, MACHINE_LIVELOCK, START
from integrators.runners import exchange, stepping
from tests.exporters.frictions import KARNOPP_MODEL, servo
from tests.helpers import banging, stick_slip

PAPER = stick_slip("signed")
OPEN_LOOP = System(
    "open loop",
    bodies=(Body("body", velocity="0.2 * sin(2 * pi * t / 20)"),),
    contacts=(Contact("friction", PAPER, v="v"),),
)


def mass(friction: Any, more: str = "") -> System:
    """Return a mass under a force."""
    body = Body("mass", inertia="1.0", force=f"3 * sin(1.5 * t){more}", x="x", v="v")
    return System("mass", bodies=(body,), contacts=(Contact("pad", friction, v="v"),))


# The mass rests where sgn(v) pushes back from both sides: it slides along v = 0.
SLIDING = mass(PAPER, " - sgn(v)")


class Importer:
    """Integrates from outside."""

    def __init__(self, both: FmuArguments) -> None:
        plan = both.buffers.plan._replace(foreign=True)
        b = both.buffers._replace(plan=plan)
        self.functions, self.machines, self.b = both.functions, both.machines, b
        self.clocks, self.x = both.sample.clocks, both.exchange
        self.roots = 0

    def go_to(self, t: float, y: list[float]) -> None:
        """Set time and state."""
        self.b.now.t = t
        self.b.now.y[:] = y

    def settle(self) -> None:
        """Handle an event."""
        before = list(self.b.now.y)
        x = self.x
        assert exchange.settle(self.functions, self.machines, self.b, self.clocks, x) == 0
        assert x.moved == (before != list(self.b.now.y))

    def slope(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return dy/dt."""
        self.go_to(t, y.tolist())
        exchange.slope(self.functions, self.b, self.x)
        return np.array(self.x.slope)

    def step(self, t: float, y: np.ndarray, h: float) -> np.ndarray:
        """Return the state after a step."""
        a = self.slope(t, y)
        b = self.slope(t + h / 2, y + h / 2 * a)
        c = self.slope(t + h / 2, y + h / 2 * b)
        d = self.slope(t + h, y + h * c)
        return y + h / 6 * (a + 2 * b + 2 * c + d)

    def indicators(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the event indicators."""
        self.go_to(t, y.tolist())
        exchange.indicate(self.functions, self.b, self.x)
        return np.array(self.x.indicators)

    def run(self, end: float, h: float) -> None:
        """Integrate."""
        t = self.b.now.t
        self.settle()
        while t < end:
            y = np.array(self.b.now.y)
            stop = min(t + h, end, self.x.next)
            before = self.indicators(t, y)
            y_new = self.step(t, y, stop - t)
            crossed = before * self.indicators(stop, y_new) <= 0.0
            if crossed.any():
                low, high = t, stop
                while (middle := 0.5 * (low + high)) not in (low, high):
                    y_middle = self.step(t, y, middle - t)
                    if (before * self.indicators(middle, y_middle) <= 0.0).any():
                        high = middle
                    else:
                        low = middle
                stop, y_new = high, self.step(t, y, high - t)
                self.go_to(stop, y_new.tolist())
                assert exchange.changed(self.functions, self.b, self.x) == 1
                self.roots += 1
            self.go_to(stop, y_new.tolist())
            if crossed.any() or stop >= self.x.next:
                self.settle()
            t = stop


CASES: dict[str, tuple[System, float, float]] = {
    "open loop": (OPEN_LOOP, 20.0, 0.02),
    "Karnopp": (mass(KARNOPP_MODEL), 6.0, 5e-3),
    "sliding": (SLIDING, 4.0, 5e-3),
    "servo": (servo(), 0.0495, 2e-5),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_all_switches_are_seen(name: str) -> None:
    system, end, h = CASES[name]
    importer = Importer(both_of(Subject.of(system, "fmu2")))
    importer.run(end, h)
    trace = simulate(system, end, engine="ifelse", rtol=1e-9)
    assert importer.x.switches == len(trace.transitions) > 2
    assert (name == "sliding") == (len(trace.sliding) > 0)
    y = trace.rows.y[-1]
    assert importer.roots > 0
    np.testing.assert_allclose(importer.b.now.y, y, rtol=1e-4, atol=1e-5 * np.abs(y).max())


@pytest.mark.slow
def test_looking_changes_no_frozen_sign() -> None:
    importer = Importer(both_of(Subject.of(SLIDING, "fmu2")))
    importer.run(2.0, 5e-3)
    held, y = list(importer.b.now.held), list(importer.b.now.y)
    for sign in (1.0, -1.0):  # an importer tries states far beyond a crossing
        importer.go_to(2.0, [sign * (abs(u) + 1.0) for u in y])
        exchange.observe(importer.functions, importer.machines, importer.b, importer.x)
        assert list(importer.b.now.held) == held


def test_another_start_moves_the_ticks() -> None:
    importer = Importer(both_of(Subject.of(servo(), "fmu2")))
    importer.go_to(3.0, list(importer.b.now.y))
    stepping.restart(importer.b, importer.clocks)
    importer.settle()
    assert importer.x.next == 3.0 + 1e-3
    assert math.isclose(importer.b.now.t, 3.0)


def test_the_slope_before_the_first_event_is_that_behind_it() -> None:
    importer = Importer(both_of(Subject.of(SLIDING, "fmu2")))
    y = np.array(importer.b.now.y)
    before = importer.slope(0.0, y)
    importer.settle()
    assert before.tobytes() == importer.slope(0.0, y).tobytes()


def test_switching_without_end_is_an_error_of_the_event() -> None:
    importer = Importer(both_of(Subject.of(mass(banging(-0.5)), "fmu2")))
    importer.go_to(0.0, [1.2] * len(importer.b.now.y))
    x = importer.x
    error = exchange.settle(importer.functions, importer.machines, importer.b, importer.clocks, x)
    assert error == MACHINE_LIVELOCK


# --------------------------------------------------------------------------- samples
def test_a_sample_goes_over_ticks() -> None:
    both = both_of(Subject.of(servo(), "fmu2"))
    both.sample.end = 2.5e-3
    assert stepping.step_to(both.functions, both.machines, both.buffers, both.sample) == 0
    assert both.buffers.now.t == 2.5e-3
    assert both.buffers.plan.jumps == [2e-3, 3e-3]
    trace = simulate(servo(), 2.5e-3, engine="ifelse")
    np.testing.assert_allclose(both.buffers.now.y, trace.rows.y[-1], rtol=1e-3, atol=1e-9)


@pytest.mark.parametrize("phase", [START, ARC])
def test_all_that_follows_from_the_numbers_follows_again(phase: int) -> None:
    """As source; exports call it as machine code. With the same numbers the same follows."""
    both = both_of(Subject.of(mass(PAPER), "fmu2"))
    b = both.buffers
    b.memory.phase = phase
    followed = (b.plan.control.atol, b.now.floor, b.plan.relaxing, b.memory.anchor)
    right = [list(each) for each in followed]
    for each in followed if phase == START else followed[:-1]:
        each[:] = [0.5] * len(each)
    scale = adapt(both.functions, b, both.sample.seen, b.sliding.live, both.adapting)
    assert scale == b.plan.control.time_scale
    assert [list(each) for each in followed] == right
