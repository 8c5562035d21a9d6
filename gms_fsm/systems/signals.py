"""Input signals: functions of time that drive a rig.

A signal is given as an expression in t (``"0.2*sin(2*pi*t/20)"``), as ramps (a list of
``(t, value)`` corners, with the last value held), as sampled arrays ``(times, values)``
(interpolated linearly, undefined outside), or as any Python callable of t.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ExpressionError, SignalError, shown
from gms_fsm.foundation.display import short_repr
from gms_fsm.foundation.equality import by_value
from gms_fsm.language import Value, parse_value

__all__ = ["Corners", "Formula", "Function", "Signal", "SignalLike", "as_signal", "piecewise_slope"]


@dataclass(frozen=True)
class Formula:
    """An expression in t [s].

    Parameters
    ----------
    text : str
        In the expression language; the only name is ``t``.

    Examples
    --------
    >>> Formula("0.15*sin(2*pi*t/25)").text
    '0.15*sin(2*pi*t/25)'
    """

    text: str
    tree: Value = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "tree", parse_value(self.text, ["t"]))
        except ExpressionError as error:
            raise error.at("signal") from None


@short_repr
@by_value()
@dataclass(frozen=True, eq=False)
class Corners:
    """Straight lines between corners; two corners at the same time make a jump.

    Parameters
    ----------
    times : array_like, shape (m,)
        Times in s, not decreasing.
    values : array_like, shape (m,)
        In the signal's unit.
    held : bool
        Whether the first and the last value are held outside (ramps) or not (a record).

    Raises
    ------
    SignalError
        If the lengths differ, a number is not finite, or time goes backward; rows count from 0.

    Examples
    --------
    >>> Corners([0, 1], [0, 5], held=True).times.tolist()
    [0.0, 1.0]
    """

    times: FloatArray
    values: FloatArray
    held: bool

    def __post_init__(self) -> None:
        for name in ("times", "values"):
            try:
                array = np.array(getattr(self, name), dtype=np.float64)
            except (TypeError, ValueError, OverflowError):
                raise SignalError(
                    f"the {name} {shown(getattr(self, name))} are not numbers",
                    place="signal",
                    advice="give numbers that fit into a float",
                ) from None
            if array.ndim != 1:
                raise SignalError(
                    f"the {name} have shape {array.shape}",
                    place="signal",
                    advice="give a flat list",
                )
            for i in np.flatnonzero(~np.isfinite(array))[:1]:
                raise SignalError(
                    f"{name}[{i}] is {array[i]}", place="signal", advice="it must be finite"
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if self.times.size != self.values.size:
            raise SignalError(
                f"{self.times.size} times but {self.values.size} values",
                place="signal",
                advice="give one value per time",
            )
        if self.times.size < 2:
            raise SignalError(
                f"{self.times.size} point(s)", place="signal", advice="give at least 2"
            )
        back = np.flatnonzero(np.diff(self.times) < 0)
        if back.size:
            i = int(back[0])
            raise SignalError(
                f"time goes backward from times[{i}] = {self.times[i]} to times[{i + 1}] "
                f"= {self.times[i + 1]}",
                place="signal",
                advice="sort the rows",
            )

    @property
    def jumps(self) -> FloatArray:
        """Times [s] at which the value jumps."""
        times, first = np.unique(self.times, return_index=True)
        last = np.append(first[1:], self.times.size) - 1
        found: FloatArray = times[self.values[first] != self.values[last]]
        return found


REST = Corners(np.array([-1.0, 0.0]), np.zeros(2), held=True)  # an input that nobody gives


@short_repr
@dataclass(frozen=True)
class Function:
    """A Python callable of t [s] that returns a number.

    Parameters
    ----------
    call : callable
        ``call(t) -> float``.

    Examples
    --------
    >>> Function(lambda t: 0.1).call(3.0)
    0.1
    """

    call: Callable[[float], float]


Signal: TypeAlias = Formula | Corners | Function
SignalLike: TypeAlias = (
    Signal
    | str
    | float
    | Sequence[tuple[float, float]]
    | tuple[ArrayLike, ArrayLike]
    | Callable[[float], float]
)


def as_signal(given: SignalLike) -> Signal:
    """Return the signal that an argument describes.

    Parameters
    ----------
    given : str, number, list of (t, value), (times, values), callable or Signal
        A pair of two arrays is a record; a list of pairs gives ramps.

    Returns
    -------
    Signal
        The signal, checked.

    Raises
    ------
    SignalError
        If it is none of these, or its numbers do not form a signal.
    ExpressionError
        If its text cannot be parsed.

    Examples
    --------
    >>> as_signal([(0, 0), (2, 0.5)]).held
    True
    >>> as_signal(([0, 1, 2], [0.0, 0.1, 0.0])).held
    False
    """
    form: Any = given
    if isinstance(form, Formula | Corners | Function):
        return form
    if isinstance(form, str):
        return Formula(form)
    if isinstance(form, bool):
        raise SignalError(
            f"{form!r} is not a signal", place="signal", advice="give a number, for example 1.0"
        )
    if isinstance(form, Real | np.generic):
        try:
            level = float(form)
        except OverflowError:
            raise SignalError(
                f"{shown(form)} is too large", place="signal", advice="it must be finite"
            ) from None
        return Corners(np.array([-1.0, 0.0]), np.array([level, level]), held=True)
    if callable(form):
        return Function(form)
    pair = form if isinstance(form, tuple) and len(form) == 2 else ()
    if pair and all(isinstance(part, tuple) and len(part) == 2 for part in pair):
        raise SignalError(
            f"{shown(form)} can mean two ramp corners or a record of two samples",
            place="signal",
            advice="give a list [(t, value), (t, value)] or arrays (times, values)",
        )
    if pair:
        return Corners(pair[0], pair[1], held=False)
    if isinstance(form, list | np.ndarray | tuple):
        try:
            corners = np.array(form, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            corners = np.empty(0)
        if corners.ndim == 2 and corners.shape[1] == 2:
            return Corners(corners[:, 0], corners[:, 1], held=True)
    if callable(getattr(form, "motion", None)) or hasattr(form, "velocity"):
        raise SignalError(
            f"{shown(form)} is not a signal",
            place="signal",
            advice="give the velocity of its motion: motion = record.motion(), "
            "Prescribed((motion.time, motion.velocity))",
        )
    raise SignalError(
        f"{shown(form)} is not a signal",
        place="signal",
        advice="give an expression in t in quotes, a list of (t, value) pairs, a pair "
        "(times, values), or a function of t",
    )


def first_after(t: float, times: Sequence[float]) -> int:
    """Return the number of the first corner after t; how many there are if none is.

    Corners that are evenly spaced, as in most records, are found at once; to look at a few takes
    less time than to divide.

    Examples
    --------
    >>> first_after(1.0, [0.0, 1.0, 1.0, 2.0])
    3
    """
    low, high = 0, len(times)
    since, whole = t - times[0], times[high - 1] - times[0]
    if high > 4 and since >= 0.0 and since < whole:
        near = int(since / whole * (high - 1))
        if times[near] <= t:
            low = near + 1
            if times[low] > t:
                high = low
        else:
            high = near
            if times[near - 1] <= t:
                low = near
    while low < high:
        middle = (low + high) // 2
        if times[middle] <= t:
            low = middle + 1
        else:
            high = middle
    return low


def piecewise_linear(t: float, times: Sequence[float], values: Sequence[float]) -> float:
    """Interpolate corners linearly at t; values are held outside, right-continuous at jumps.

    One clock tick before a corner the value is that of the corner: what a jump there comes from.
    Written as plain loops because the compiled engine runs this same function.

    Examples
    --------
    >>> piecewise_linear(0.5, [0.0, 1.0, 1.0], [0.0, 2.0, 5.0])
    1.0
    >>> piecewise_linear(1.0, [0.0, 1.0, 1.0], [0.0, 2.0, 5.0])
    5.0
    """
    low = first_after(t, times)
    if low == 0:
        return values[0]
    before = values[low - 1]
    if low == len(times):
        return before
    t0, end = times[low - 1], times[low]
    halfway = t + 0.5 * (end - t)
    if t0 < t and (halfway <= t or halfway >= end):  # no number lies between them
        return values[low]
    share = (t - t0) / (end - t0)
    return before + share * (values[low] - before)


def piecewise_slope(t: float, times: Sequence[float], values: Sequence[float]) -> float:
    """Return the slope at t of lines through corners; 0 outside, right-continuous at corners.

    Parameters
    ----------
    t : float
        s.
    times, values : sequence of float, shape (m,)
        The corners, in order of time.

    Returns
    -------
    float
        The slope.

    Examples
    --------
    >>> piecewise_slope(0.5, [0.0, 1.0, 1.0], [0.0, 2.0, 5.0])
    2.0
    """
    low = first_after(t, times)
    if low == 0 or low == len(times):
        return 0.0
    return (values[low] - values[low - 1]) / (times[low] - times[low - 1])
