"""A loop in real time that measures its own jitter."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_integer

__all__ = ["SampledRun", "run_sampled"]


@dataclass(frozen=True, eq=False)
class SampledRun:
    """What a loop in real time has measured.

    Parameters
    ----------
    period : float
        s.
    ticks : ndarray of int, shape (n,)
        The numbers of the ticks that ran; others were missed.
    late : ndarray, shape (n,)
        s: how long after its time each one began.
    duration : ndarray, shape (n,)
        s: how long its step took.
    """

    period: float
    ticks: NDArray[np.int64]
    late: FloatArray
    duration: FloatArray

    @property
    def missed(self) -> int:
        """The number of ticks that did not run, because a step took too long."""
        return int(self.ticks[-1]) - len(self.ticks)

    def __str__(self) -> str:
        late, spent = 1e6 * self.late, 1e6 * self.duration
        return (
            f"{len(self.ticks):,} ticks of {1e3 * self.period:g} ms, {self.missed:,} missed; "
            f"late by {np.median(late):.1f} us (median), {np.quantile(late, 0.99):.1f} us (99 %), "
            f"{late.max():.1f} us (worst); a step takes {np.median(spent):.1f} us (median), "
            f"{spent.max():.1f} us (worst)"
        )


def run_sampled(
    step: Callable[[int, float], object], period: float, ticks: int, *, spin: float = 2e-4
) -> SampledRun:
    """Call a step at a period, in real time.

    Tick k is due k periods after the call, the first one being 1. The loop sleeps until shortly
    before, and then spins. If a step ends after the next tick but one was due, the ticks in between
    are missed, and the latest one that is due runs at once.

    Parameters
    ----------
    step : callable
        ``step(k, dt)`` with the number of the tick, and the time since the last step began [s], for
        the first one since the call. It is the time measured: a sensor's velocity is that of the
        moment. A step that reads no sensor may use ``k * period``, which does not depend on jitter.
    period : float
        s.
    ticks : int
        The number of the last tick.
    spin : float
        s: how long before a tick it stops sleeping. Should exceed what the operating system
        oversleeps; it keeps a processor core busy.

    Returns
    -------
    SampledRun
        What was measured; print it for a summary.

    Raises
    ------
    ParameterError
        If an argument violates its rule.

    Examples
    --------
    >>> from gms_fsm import GMS, FrictionState, GMSParameters
    >>> friction = FrictionState(GMS(GMSParameters.paper("stick-slip"), law="signed"))
    >>> speeds = [0.0]
    >>> def step(k, dt):
    ...     speeds.append(0.1 * np.sin(1e-3 * k))  # a sensor
    ...     friction.advance(*speeds[-2:], dt)
    >>> run = run_sampled(step, 1e-3, 50)
    >>> len(run.ticks) + run.missed, friction.t > 0.0
    (50, True)
    """
    if not callable(step):
        raise ParameterError("it must be a function of k and dt", place="step", value=step)
    period = checked_scalar("period", period, "> 0")
    last = checked_integer("ticks", ticks, 1)
    spin = checked_scalar("spin", spin, ">= 0")
    clock, rows = time.perf_counter, []
    begin, k = clock(), 1
    before = begin
    while k <= last:
        due = begin + k * period
        if (pause := due - clock() - spin) > 0.0:
            time.sleep(pause)
        while (now := clock()) < due:
            pass
        step(k, now - before)
        end = clock()
        rows.append((k, now - due, end - now))
        before, k = now, max(k + 1, min(int((end - begin) / period), last))
    number, late, duration = zip(*rows, strict=True)
    return SampledRun(period, np.array(number), np.array(late), np.array(duration))
