"""The motion of a measured record: velocity from positions by a smoothing spline.

It comes with a note on the smoothing, and with the velocity noise at standstill.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import RecordError, cut, shown

if TYPE_CHECKING:
    from gms_fsm.records.record import Record

__all__ = ["GAP", "Motion", "motion_of", "pieces"]

GAP = 5.0  # time steps longer than this many median steps are gaps
FEWEST = 5  # rows of a spline

STRETCH = 40  # rows per interval when searching for standstill


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion of a record, ready to prescribe.

    Parameters
    ----------
    time, velocity, position : ndarray, shape (rows,)
        Time, s; velocity, m/s; position, m.
    smoothing : float
        Time constant of the smoothing spline, s; 0 for a measured velocity used unchanged.
    standstill : float
        Velocity noise at standstill, m/s (standard deviation); 0 if there is no standstill.
    notes : tuple of str
        How the velocity was obtained.
    """

    time: FloatArray
    velocity: FloatArray
    position: FloatArray
    smoothing: float
    standstill: float
    notes: tuple[str, ...] = field(default=())

    def fitting_v_c(self) -> float:
        """Return a v_c [m/s] that this record can resolve: three times its noise at standstill."""
        if self.standstill <= 0.0:
            return 0.0
        digit = 10.0 ** math.floor(math.log10(3.0 * self.standstill))
        return float(f"{math.ceil(3.0 * self.standstill / digit) * digit:.1g}")


@np.errstate(all="ignore")  # overflow is reported as an error
def motion_of(record: Record, smoothing: float | None = None) -> Motion:
    """Return the motion of a record, from positions by a smoothing spline.

    The spline minimises ``sum (x_j - f(t_j))**2 + lambda * integral f''**2`` with ``lambda =
    smoothing**4 / dt``: motion slower than the time constant is kept, faster noise is removed
    (half amplitude at the angular frequency 1 / smoothing).

    Parameters
    ----------
    record : Record
        A record with a column for position or velocity.
    smoothing : float, optional
        Time constant, s; by default four median time steps (0 for a measured velocity).

    Returns
    -------
    Motion
        Time, velocity and position at the rows of the record.

    Raises
    ------
    RecordError
        If there is neither position nor velocity, or the smoothing is negative.
    """
    time = record.columns["time"]
    if smoothing is not None and not smoothing >= 0.0:
        raise RecordError(
            f"smoothing is {shown(smoothing)} s",
            place=record.place,
            advice="it must be >= 0",
            key=("smoothing",),
        )
    interval = float(np.median(np.diff(time)))
    if smoothing is not None and smoothing > time[-1] - time[0]:
        raise RecordError(
            f"smoothing is {shown(smoothing)} s, longer than the record ({time[-1] - time[0]:.6g} "
            "s)",
            place=record.place,
            advice="use a smaller value",
            key=("smoothing",),
        )
    if "velocity" in record.columns:
        raw, given = record.columns["velocity"], "velocity"
        tau = 0.0 if smoothing is None else smoothing
    elif "position" in record.columns:
        raw, given = record.columns["position"], "position"
        tau = 4.0 * interval if smoothing is None else smoothing
    else:
        raise RecordError(
            "neither a position nor a velocity column is given",
            place=record.place,
            advice="give one of them: position = { column = ..., unit = ... } in a scenario, "
            "position=(name, unit) in Python",
        )
    try:
        parts = [_smoothed(time[p], raw[p], tau**4 / interval) for p in pieces(time)]
    except (ArithmeticError, ValueError) as error:  # LinAlgError is a ValueError
        raise RecordError(
            f"no smoothing spline fits the {given} column ({cut(str(error))})",
            place=record.place,
            advice="look for outliers in values or times and exclude their rows with "
            "where = ..., or change smoothing = ... (s)",
        ) from None
    smooth, slope = (np.concatenate(each) for each in zip(*parts, strict=True))
    if given == "position":
        velocity, position = slope, smooth
        rest = float(np.std(raw - smooth))
        notes = [
            f"velocity: derivative of a smoothing spline through the positions, time constant "
            f"{tau:.4g} s (half amplitude at {1 / (2 * np.pi * tau) if tau else math.inf:.3g} Hz); "
            f"the residual of the positions is {rest:.2g} m (standard deviation)"
        ]
    else:
        velocity = smooth if tau else raw
        steps = np.diff(time) * 0.5 * (velocity[1:] + velocity[:-1])
        origin = record.columns["position"][:1] if "position" in record.columns else [0.0]
        position = np.concatenate([origin, origin + np.cumsum(steps)])
        notes = [
            "velocity: as measured"
            + (f", smoothed with a time constant of {tau:.4g} s" if tau else "")
        ]
    if not np.isfinite([velocity, position]).all():
        raise RecordError(
            f"the {given} column has values too large for a motion, up to "
            f"{float(np.abs(raw).max()):.3g} (SI)",
            place=record.place,
            advice="look for outliers, and exclude their rows with where = ...",
        )
    return Motion(time, velocity, position, tau, _standstill(velocity), tuple(notes))


def usual_speed(velocity: FloatArray) -> float:
    """Return the median speed in motion.

    >>> usual_speed(np.array([0.0, 0.0, -2.0, 0.0, 3.0, 2.0, 0.0]))
    2.0
    """
    speed = np.abs(velocity)
    return float(np.median(speed[speed > 0.1 * np.quantile(speed, 0.99)]))


def pieces(time: FloatArray) -> list[slice]:
    """Return the stretches of rows without a gap in time.

    >>> pieces(np.array([0.0, 1.0, 2.0, 9.0, 10.0]))
    [slice(0, 3, None), slice(3, 5, None)]
    """
    steps = np.diff(time)
    if not steps.size:
        return [slice(0, time.size)]
    ends = np.flatnonzero(steps > GAP * np.median(steps)) + 1
    return [
        slice(int(a), int(b))
        for a, b in zip([0, *ends.tolist()], [*ends.tolist(), time.size], strict=True)
    ]


def _smoothed(time: FloatArray, raw: FloatArray, weight: float) -> tuple[FloatArray, FloatArray]:
    """Return values and slopes of a smoothing spline through a stretch of rows."""
    if time.size < FEWEST:
        return raw, np.gradient(raw, time) if time.size > 1 else np.zeros(1)
    from scipy.interpolate import make_smoothing_spline  # slow to import

    # The spline does not depend on the origin; subtracting the offset avoids cancellation.
    shift = float(raw[0])
    spline = make_smoothing_spline(time, raw - shift, lam=weight)
    return spline(time) + shift, spline.derivative()(time)


def _standstill(velocity: FloatArray) -> float:
    """Return the scatter of v about a line in intervals with almost no mean motion."""
    fastest = float(np.quantile(np.abs(velocity), 0.99))
    count = velocity.size // STRETCH
    if count == 0 or fastest == 0.0:
        return 0.0
    stretches = velocity[: count * STRETCH].reshape(count, STRETCH)
    # About a line, so that a slow reversal is not mistaken for noise.
    place = np.linspace(-1.0, 1.0, STRETCH)
    slope = stretches @ place / (place @ place)
    mean = stretches.mean(axis=1)
    quiet = (np.abs(mean) < 0.05 * fastest) & (np.abs(slope) < 0.1 * fastest)
    if not quiet.any():
        return 0.0
    scatter = (stretches - mean[:, None] - slope[:, None] * place)[quiet]
    # The median interval, because in some of them the motion starts or ends.
    return float(np.sqrt(np.median((scatter**2).sum(axis=1)) / (STRETCH - 2)))
