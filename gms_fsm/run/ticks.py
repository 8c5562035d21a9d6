"""Exact ticks: periods, offsets and starts are decimal numbers, and a tick is the nearest double.

As doubles, ten periods of 0.1 ms are not always one period of 1 ms; as fractions they are.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.systems.system import System
from integrators import Ticks

MOST_TICKS = 10_000_000  # of a clock in a run: their times are kept
MOST_CLOCKS = 62  # each is a bit of an int64
EXACT = 2**53  # up to here doubles hold every whole number


class Clock(NamedTuple):
    """What ticks: a sampler, or a contact with a period."""

    name: str
    period: float  # s
    offset: float  # s, of its first tick from the start
    sampler: bool


class Units(NamedTuple):
    """Periods and first ticks as whole numbers."""

    per_second: int
    first: list[int]
    period: list[int]

    @property
    def largest(self) -> int:
        """The largest of all numbers."""
        return max([self.per_second, *self.first, *self.period])


def clocks_of(system: System) -> tuple[Clock, ...]:
    """Return what ticks: the samplers, then the contacts with a period.

    Bit k of a tick stands for the k-th of them.
    """
    found = [Clock(each.name, each.period, each.offset, True) for each in system.sampled]
    found += [
        Clock(each.name, each.period, 0.0, False)
        for each in system.machines
        if each.period is not None
    ]
    return tuple(found)


def in_units(clocks: Iterable[Clock], origin: float = 0.0) -> Units:
    """Return periods and first ticks of clocks that start at a time, in the largest common unit."""
    first = [_decimal(origin) + _decimal(each.offset) for each in clocks]
    period = [_decimal(each.period) for each in clocks]
    unit = math.lcm(*(each.denominator for each in (*first, *period)))
    return Units(unit, [int(each * unit) for each in first], [int(each * unit) for each in period])


@functools.lru_cache(maxsize=4)
def ticks_of(clocks: tuple[Clock, ...], origin: float, t_start: float, t_end: float) -> Ticks:
    """Return what ticks from t_start on and before t_end.

    Ticks are counted from the origin, which is earlier than t_start if the run continues another:
    samplers that tick exactly at t_start have then done so, contacts with a period tick again.
    """
    if not clocks:
        return Ticks.none()
    if len(clocks) > MOST_CLOCKS:
        raise ParameterError(
            f"{len(clocks)} samplers and contacts with a period are too many",
            advice=f"at most {MOST_CLOCKS} can tick",
        )
    units = in_units(clocks, origin)
    own = []
    for clock, first, period in zip(clocks, units.first, units.period, strict=True):
        begin, end = (_decimal(t) * units.per_second - first for t in (t_start, t_end))
        low, high = max(0, math.floor(begin / period)), math.ceil(end / period) + 1
        if high - low > MOST_TICKS:
            raise ParameterError(
                f"its period of {clock.period!r} s makes {float(end / period):.4g} ticks",
                place=clock.name,
                advice=f"at most {MOST_TICKS:,} fit into a run",
            )
        times = _times(first, period, units.per_second, range(low, high))
        done = origin < t_start and clock.sampler  # a tick at t_start itself
        begun = times > t_start if done else times >= t_start
        own.append(times[begun & (times < t_end)])
    return Ticks.of(own, [1 << bit for bit in range(len(clocks))])


def _times(first: int, period: int, per_second: int, numbers: range) -> NDArray[np.float64]:
    """Return the doubles nearest to (first + k period) / per_second for each number k."""
    largest = max(abs(first), abs(first + numbers.stop * period), per_second)
    if largest < EXACT:  # no number is rounded before the division
        times: NDArray[np.float64] = (
            first + np.arange(numbers.start, numbers.stop, dtype=np.int64) * period
        ) / per_second
        return times
    return np.array([(first + k * period) / per_second for k in numbers], dtype=np.float64)


def _decimal(number: float) -> Fraction:
    """Return the shortest decimal number that is read as a double."""
    return Fraction(repr(float(number)))
