"""Claim: a sampled loop keeps to the clock, measures itself, and says which ticks it missed.

The clock of these tests goes on only when it is asked, by the sleep, or by the step.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import FrictionState, Prescribed, simulate
from gms_fsm.adapters import sampled
from gms_fsm.adapters.sampled import run_sampled
from gms_fsm.errors import ParameterError
from tests.adapters.loops import PULLED_END, exact_pulled_mass, sequence
from tests.helpers import pulled_mass

TICK = 2.0**-10  # s


class Clock:
    """A clock that needs no time."""

    def __init__(self) -> None:
        self.now, self.slept = 100.0, 0.0

    def perf_counter(self) -> float:
        self.now += TICK / 1024
        return self.now

    def sleep(self, pause: float) -> None:
        self.now += pause
        self.slept += pause


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(sampled, "time", made)
    return made


def test_every_tick_runs_on_time(clock: Clock) -> None:
    calls: list[tuple[int, float]] = []
    run = run_sampled(lambda k, dt: calls.append((k, dt)), TICK, 20, spin=TICK / 8)
    assert run.ticks.tolist() == [k for k, _ in calls] == list(range(1, 21))
    assert run.missed == 0
    assert np.all(run.late >= 0.0)
    assert np.all(run.late <= TICK / 256)
    assert np.all(run.duration > 0.0)
    assert np.cumsum([dt for _, dt in calls]) == pytest.approx(TICK * run.ticks + run.late)
    assert 0.5 < clock.slept / (20 * TICK) < 0.9  # it spins for an eighth of each period


def test_a_slow_step_misses_ticks(clock: Clock) -> None:
    calls: list[tuple[int, float]] = []

    def step(k: int, dt: float) -> None:
        calls.append((k, dt))
        clock.now += TICK * (3.25 if k == 4 else 1.5 if k == 12 else 0.25)

    run = run_sampled(step, TICK, 15)
    # At 7.25 periods tick 7 is due; at 13.5 tick 13 is late by a half.
    assert run.ticks.tolist() == [1, 2, 3, 4, 7, 8, 9, 10, 11, 12, 13, 14, 15]
    assert run.missed == 2
    late = dict(zip(run.ticks.tolist(), (run.late / TICK).tolist(), strict=True))
    assert late[7] == pytest.approx(0.25, abs=0.05)
    assert late[13] == pytest.approx(0.5, abs=0.05)
    assert run.duration.max() == pytest.approx(3.25 * TICK, rel=0.05)
    assert dict(calls)[7] == pytest.approx(3.25 * TICK, rel=0.05)
    assert str(run).startswith("13 ticks of 0.976562 ms, 2 missed; late by ")


def test_the_last_tick_always_runs(clock: Clock) -> None:
    def step(k: int, dt: float) -> None:
        clock.now += 10 * TICK if k == 3 else 0.0

    run = run_sampled(step, TICK, 5)
    assert (run.ticks.tolist(), run.missed) == ([1, 2, 3, 5], 1)


def test_friction_at_the_times_measured_is_that_of_simulate() -> None:
    model, _ = pulled_mass()
    friction, t, v, F = FrictionState(model), [0.0], [0.0], [0.0]

    def step(k: int, dt: float) -> None:
        t.append(t[-1] + dt)
        v.append(0.2 * float(np.sin(40.0 * t[-1])))
        F.append(friction.advance_to(v[-2], v[-1], t[-1]))

    run = run_sampled(step, 1e-3, 200)
    exact = simulate(model, Prescribed((np.array(t), np.array(v))), t[-1])
    assert F[-1] == exact.F[-1]
    assert len(run.ticks) + run.missed == 200


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
    assert len(switches) == 72
    assert sequence(switches) == sequence(exact_pulled_mass().transitions)


def test_wrong_arguments_are_named() -> None:
    for given, words in (
        ((None, 1e-3, 5), "step is None; it must be a function"),
        ((print, 0.0, 5), "period is 0.0; it must be > 0"),
        ((print, np.nan, 5), "period"),
        ((print, 1e-3, 0), "ticks is 0; it must be an integer, at least 1"),
        ((print, 1e-3, 5, -1.0), r"spin is -1\.0"),
    ):
        with pytest.raises(ParameterError, match=words):
            run_sampled(*given[:3], **dict(zip(["spin"], given[3:], strict=False)))
