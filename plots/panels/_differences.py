"""Panels of differences between forces."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.errors import shown as written
from plots.panels.parts.axes import Artists, draw_curve, time_axis
from plots.panels.parts.selection import is_number
from plots.style import INK, PALE_GREY
from plots.style.matplotlib import Axes
from plots.style.presets import pt

__all__ = ["difference"]

Floats = NDArray[np.float64]
COLUMNS = 500  # of an envelope


def difference(
    ax: Axes,
    times: NDArray[np.float64],
    values: NDArray[np.float64],
    floor: float = 1e-12,
) -> Artists:
    """Draw the magnitude of a difference of forces over time, on a logarithmic axis.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    times : ndarray, shape (m,), s
        Times.
    values : ndarray, shape (m,), N
        Differences.
    floor : float
        N; smaller values are drawn at this value.

    Returns
    -------
    list of Artist
        The line; of more than 1,000 points the band between the lowest and the highest value of
        every 1/500 of the time, and its upper end as a line.
    """
    if not is_number(floor) or not 0 < floor < np.inf:
        raise ParameterError(f"floor is {written(floor)}", advice="it must be a force > 0 N")
    if np.shape(times) != np.shape(values) or np.ndim(times) != 1 or not np.size(times):
        raise ParameterError(
            f"times has shape {np.shape(times)}, the difference {np.shape(values)}",
            advice="they must be one-dimensional, equally long and not empty",
        )
    ax.set(yscale="log", ylabel="|difference of $F$| [N]")
    ax.minorticks_off()
    values = np.maximum(np.abs(values), floor)
    time_axis(ax, float(times[0]), float(times[-1]))
    look: dict[str, Any] = {"color": INK, "linewidth": pt(0.8)}
    if len(times) <= 2 * COLUMNS:
        return draw_curve(ax, times, values, **look)
    middles, low, high = _envelope(times, values)
    label = f"lowest to highest in each 1/{COLUMNS} of the time"
    band = ax.fill_between(middles, low, high, color=PALE_GREY, linewidth=0.0, label=label)
    return [band, *draw_curve(ax, middles, high, label="highest in it", **look)]


def _envelope(times: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Return times, and the lowest and the highest value in every part of the time."""
    edges = np.linspace(times[0], times[-1], COLUMNS + 1)
    first = np.searchsorted(times, edges[:-1])
    filled = np.diff(np.append(first, len(times))) > 0
    first = first[filled]
    middles = (edges[1:] + edges[:-1])[filled] / 2
    return middles, np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)
