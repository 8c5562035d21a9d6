"""Panels of differences between forces: of two runs, or of a run and a measurement."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.errors import shown as written
from gms_fsm.traces.trace import Trace
from plots.panels.parts.axes import Artists, draw_curve, time_axis
from plots.panels.parts.selection import SMOOTH, checked_window, is_number
from plots.style import INK, PALE_GREY
from plots.style.matplotlib import Axes
from plots.style.presets import pt
from plots.views.window import Window

__all__ = ["difference", "residual"]

Floats = NDArray[np.float64]
COLUMNS = 500  # of an envelope


class ForceOverTime(Protocol):
    """Friction over time: a trace or a measurement."""

    @property
    def t(self) -> NDArray[np.float64]:
        """Times, s."""

    @property
    def F(self) -> NDArray[np.float64]:
        """Friction, N."""


def difference(
    ax: Axes,
    times: NDArray[np.float64],
    values: NDArray[np.float64],
    floor: float = 1e-12,
    *,
    log: bool = True,
) -> Artists:
    """Draw a difference of forces over time.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    times : ndarray, shape (m,), s
        Times.
    values : ndarray, shape (m,), N
        Differences.
    floor : float
        N; on a logarithmic axis, smaller values are drawn at this value.
    log : bool
        Draw its magnitude on a logarithmic axis.

    Returns
    -------
    list of Artist
        The line; of more than 1,000 points the band between the lowest and the highest value of
        every 1/500 of the time, and its ends as lines (only the upper one on a logarithmic axis).
    """
    if not is_number(floor) or not 0 < floor < np.inf:
        raise ParameterError(f"floor is {written(floor)}", advice="it must be a force > 0 N")
    if np.shape(times) != np.shape(values) or np.ndim(times) != 1 or not np.size(times):
        raise ParameterError(
            f"times has shape {np.shape(times)}, the difference {np.shape(values)}",
            advice="they must be one-dimensional, equally long and not empty",
        )
    if log:
        ax.set(yscale="log")
        ax.minorticks_off()
        values = np.maximum(np.abs(values), floor)
    ax.set_ylabel("|difference of $F$| [N]" if log else "difference of $F$ [N]")
    time_axis(ax, float(times[0]), float(times[-1]))
    look: dict[str, Any] = {"color": INK, "linewidth": pt(0.8)}
    if len(times) <= 2 * COLUMNS:
        return draw_curve(ax, times, values, **look)
    middles, low, high = _envelope(times, values)
    label = f"lowest to highest in each 1/{COLUMNS} of the time"
    band = ax.fill_between(middles, low, high, color=PALE_GREY, linewidth=0.0, label=label)
    drawn: Artists = [band, *draw_curve(ax, middles, high, label="highest in it", **look)]
    return drawn if log else [*drawn, *draw_curve(ax, middles, low, **look)]


def _envelope(times: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Return times, and the lowest and the highest value in every part of the time."""
    edges = np.linspace(times[0], times[-1], COLUMNS + 1)
    first = np.searchsorted(times, edges[:-1])
    filled = np.diff(np.append(first, len(times))) > 0
    first = first[filled]
    middles = (edges[1:] + edges[:-1])[filled] / 2
    return middles, np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)


def residual(
    ax: Axes,
    trace: Trace,
    reference: ForceOverTime,
    floor: float = 1e-12,
    *,
    window: Window | None = None,
    log: bool = True,
) -> Artists:
    """Draw the difference between the friction of a run and that of another run or a measurement.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    reference : Trace or Measured
        The reference. A trace is compared at evenly spaced times and at its transitions, a
        measurement at its times.
    floor : float
        N; on a logarithmic axis, smaller values are drawn at this value.
    window : (float, float), optional
        Time interval to show, s.
    log : bool
        Draw its magnitude on a logarithmic axis.

    Returns
    -------
    list of Artist
        As for `difference`.

    Raises
    ------
    ParameterError
        If the two do not overlap in time.
    """
    begin, end = checked_window(trace, window)
    first, last = max(begin, float(reference.t[0])), min(end, float(reference.t[-1]))
    if not first < last:
        raise ParameterError(
            f"reference runs from {reference.t[0]:g} to {reference.t[-1]:g} s",
            advice=f"it must overlap {begin:g} to {end:g} s",
        )
    if isinstance(reference, Trace):
        grid = np.union1d(np.linspace(first, last, SMOOTH), reference.transitions.t)
        times = grid[(grid >= first) & (grid <= last)]
        other = reference.sample(times).F
    else:
        inside = (reference.t >= first) & (reference.t <= last)
        times, other = reference.t[inside], reference.F[inside]
    same = np.array_equal(times, trace.t)
    mine = trace.F if same else trace.sample(times).F
    return difference(ax, times, mine - other, floor, log=log)
