"""A motion that tells the parameters of a friction model apart, for a rig to follow.

Each part answers one question: strokes of growing amplitude, which thresholds there are (an element
slips once the distance from a reversal is twice its threshold); full strokes at several speeds, the
Stribeck curve and the viscous friction; reversals within a stroke, the memory; rests, the offset.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import FloatArray, checked_array, checked_scalar
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import refusing
from gms_fsm.records.record import Record

__all__ = ["excite"]

SMALLEST = 0.01  # first amplitude, as a share of the largest
AMPLITUDES = 10
SHORTEST_RAMP = 10  # rows
# Rules, within which nothing overflows.
LENGTH, SPEED = ">= 1e-9 and <= 1e3", ">= 1e-12 and <= 1e4"
RATE, ACCELERATION = ">= 1e-6 and <= 1e9", ">= 1e-12 and <= 1e9"
DEFAULT_RAMP = 20  # rows of the fastest ramp at the default rate
MOST_ROWS = 2_000_000
START, END = "at rest", "back to the middle"
# Full strokes and reversals within them, as shares of half the stroke.
TO_AND_FRO = (1.0, -1.0, 0.5, 0.0, 1.0, -1.0)


@refusing()
def excite(
    stroke: float,
    speeds: ArrayLike,
    *,
    rate: float | None = None,
    acceleration: float | None = None,
) -> Record:
    """Return a motion for a rig that tells the parameters of a friction model apart.

    It begins and ends at rest in the middle of the stroke: ten strokes to and fro of growing
    amplitude at the lowest speed, from a hundredth of the stroke to all of it; then, for each speed
    from the lowest to the highest, full strokes with reversals within them, and a rest. The
    velocity is a trapezoid with ramps of the form sin**2, so that the acceleration is continuous.

    Parameters
    ----------
    stroke : float
        From the lowest position to the highest, m, 1e-9 to 1e3. To tell the thresholds apart it
        must be more than twice the largest of them.
    speeds : array_like, shape (m,)
        m/s, 1e-12 to 1e4, for example three or more over the range in which the device works.
    rate : float, optional
        Rows per second, Hz; by default a round number at which the fastest ramp has 20 rows or
        more.
    acceleration : float, optional
        The largest of the rig, m/s**2; by default the highest speed is held over half the stroke.

    Returns
    -------
    Record
        With time, position and velocity, ``abs(position) <= stroke / 2``, and notes on its parts;
        `Record.to_csv` writes it for the rig.

    Raises
    ------
    ParameterError
        If a number is not as described, a speed cannot be reached within the stroke (with the
        largest that can), or the motion has more than 2 million rows.

    Examples
    --------
    >>> motion = excite(2e-3, [1e-3, 2e-3, 5e-3], rate=200)
    >>> motion
    <Record 'excitation': 6673 rows, 33.36 s, position, velocity>
    >>> print(motion.notes[1])
    from 1 s: strokes of growing amplitude at 0.001 m/s: the thresholds
    """
    length = checked_scalar("stroke", stroke, LENGTH)
    every = np.unique(checked_array("speeds", speeds, None, SPEED)).tolist()
    limits = _limits(length, every[-1], rate, acceleration)
    moves = list(_moves(length, every, limits))
    duration = math.fsum(move.duration for move in moves)
    rows = duration * limits.rate + 2.0
    if not rows <= MOST_ROWS:
        raise ParameterError(
            f"the motion would have {rows:.3g} rows ({duration:.3g} s at {limits.rate:g} Hz)",
            place="excite",
            advice=f"at most {MOST_ROWS} are made; raise the lowest speed, or lower rate",
        )
    time = np.arange(math.ceil(duration * limits.rate) + 1) / limits.rate
    position, velocity, notes = np.zeros(time.size), np.zeros(time.size), dict[str, float]()
    end = 0.0
    for move in moves:
        notes.setdefault(move.purpose, end)
        inside = slice(*np.searchsorted(time, [end, end + move.duration]))
        position[inside], velocity[inside] = move.at(time[inside] - end)
        end += move.duration
    np.clip(position, -0.5 * length, 0.5 * length, out=position)  # rounding
    made = Record.from_arrays(time=time, position=position, velocity=velocity, name="excitation")
    return replace(
        made, notes=tuple(f"from {start:.6g} s: {purpose}" for purpose, start in notes.items())
    )


@dataclass(frozen=True)
class _Limits:
    """What the rig can do."""

    acceleration: float  # m/s**2
    rate: float  # Hz

    def ramp(self, speed: float) -> float:
        """Return the duration of a ramp from rest to a speed, s.

        The acceleration of ``v = speed * sin(pi t / (2 T))**2`` is at most ``pi speed / (2 T)``.
        """
        return max(0.5 * math.pi * speed / self.acceleration, SHORTEST_RAMP / self.rate)

    def fastest(self, distance: float) -> float:
        """Return the speed at which a distance is all ramps, m/s: ``speed * ramp = distance``."""
        return min(
            math.sqrt(2.0 * self.acceleration * distance / math.pi),
            distance * self.rate / SHORTEST_RAMP,
        )


@dataclass(frozen=True)
class _Move:
    """From rest to rest in one direction; without a distance, a rest as long as the ramp."""

    start: float  # m
    distance: float  # m, signed
    speed: float  # m/s
    ramp: float  # s
    purpose: str

    @property
    def duration(self) -> float:
        """Of both ramps and what is between them, s."""
        return self.ramp + (abs(self.distance) / self.speed if self.distance else 0.0)

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return position and velocity at times since its start."""
        if self.distance == 0.0:
            return np.full(t.size, self.start), np.zeros(t.size)
        last = self.duration - t
        rising = np.minimum(t, self.ramp)
        falling = np.minimum(last, self.ramp)
        # Each ramp covers half of what its time would at full speed.
        way = self.speed * (self._ramped(rising) + np.maximum(t - self.ramp, 0.0))
        left = self.speed * (self._ramped(falling) + np.maximum(last - self.ramp, 0.0))
        total = abs(self.distance)
        covered = np.where(t < last, way, total - left)
        speed = self.speed * np.sin(0.5 * np.pi * np.minimum(rising, falling) / self.ramp) ** 2
        side = math.copysign(1.0, self.distance)
        return self.start + side * covered, side * speed

    def _ramped(self, t: FloatArray) -> FloatArray:
        """Return the integral of ``sin(pi t / (2 ramp))**2``, s."""
        integral: FloatArray = 0.5 * t - self.ramp / (2.0 * np.pi) * np.sin(np.pi * t / self.ramp)
        return integral


def _limits(
    stroke: float, highest: float, rate: float | None, acceleration: float | None
) -> _Limits:
    if acceleration is None:
        most = math.pi * highest**2 / stroke
    else:
        most = checked_scalar("acceleration", acceleration, ACCELERATION)
    if rate is None:
        # A ramp over all of the stroke, where the highest speed cannot be reached.
        speed = min(highest, math.sqrt(2.0 * most * stroke / math.pi))
        sampled = _round(DEFAULT_RAMP / (0.5 * math.pi * speed / most))
    else:
        sampled = checked_scalar("rate", rate, RATE)
    limits = _Limits(most, sampled)
    possible = limits.fastest(stroke)
    if highest > possible:
        raise ParameterError(
            f"{highest:g} m/s cannot be reached in a stroke of {stroke:g} m with {most:.4g} m/s**2 "
            f"and ramps of at least {SHORTEST_RAMP} rows at {sampled:g} Hz",
            place="speeds",
            advice=f"the largest possible speed is {_down(possible):g} m/s; a longer stroke, or a "
            "higher rate or acceleration, allows more",
        )
    return limits


def _round(value: float) -> float:
    """Return the next of 1, 2, 5, 10, ... times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value)


def _down(value: float) -> float:
    """Return a number rounded down to three digits, so that it is still possible."""
    digit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / digit) * digit


class _Leg(NamedTuple):
    """A part of the plan: where to go, at most how fast, and why; to stay is to rest."""

    to: float  # m
    speed: float  # m/s
    purpose: str


def _plan(half: float, speeds: list[float]) -> Iterator[_Leg]:
    yield _Leg(0.0, 0.0, START)
    slowest = speeds[0]
    growing = f"strokes of growing amplitude at {slowest:g} m/s: the thresholds"
    for amplitude in np.geomspace(SMALLEST * half, half, AMPLITUDES).tolist():
        yield _Leg(amplitude, slowest, growing)
        yield _Leg(-amplitude, slowest, growing)
    for speed in speeds:
        full = f"full strokes and reversals at {speed:g} m/s: the Stribeck curve, the memory"
        for share in TO_AND_FRO:
            yield _Leg(share * half, speed, full)
        yield _Leg(TO_AND_FRO[-1] * half, 0.0, full)
    yield _Leg(0.0, slowest, END)
    yield _Leg(0.0, 0.0, END)


def _moves(stroke: float, speeds: list[float], limits: _Limits) -> Iterator[_Move]:
    rest = stroke / speeds[len(speeds) // 2]
    place = 0.0
    for leg in _plan(0.5 * stroke, speeds):
        way = leg.to - place
        speed = min(leg.speed, limits.fastest(abs(way)))
        yield _Move(place, way, speed, limits.ramp(speed) if way else rest, leg.purpose)
        place = leg.to
