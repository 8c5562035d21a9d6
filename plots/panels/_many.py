"""Panels for many elements: deflections over thresholds as grey levels, and how many slip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from gms_fsm.traces.trace import Trace
from plots.panels.parts.axes import Artists, lanes, no_threshold, time_axis
from plots.panels.parts.selection import PartOptions, has_threshold, selected
from plots.style import INK, PAPER, ramp
from plots.style.matplotlib import Axes, ListedColormap
from plots.style.presets import font, pt

__all__ = ["heat", "slipping"]

COLUMNS = 900  # of the picture over time
LEVELS = 256
CROWDED = 40  # boundaries per lane that can be told apart


def heat(ax: Axes, trace: Trace, **part: Unpack[PartOptions]) -> Artists:
    """Draw |z| / s of each element as a row in grey levels, from white at 0 to ink at 1.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    **part
        ``window`` and ``elements``.

    Returns
    -------
    list of Artist
        The picture, then a set of lines per element at the changes of its state. For a chart
        without edges, or without the input s, there is no threshold, and only a note is drawn.

    Examples
    --------
    >>> from plots.style.matplotlib import Figure
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> run = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0)
    >>> picture, *boundaries = heat(Figure().subplots(), run)
    >>> len(boundaries), picture.get_clim()
    (4, (0.0, 1.0))
    """
    this = selected(trace, **part)
    chosen, (begin, end) = this.elements, this.window
    if not has_threshold(trace):
        return [no_threshold(ax, trace)]
    rows = this.rows
    values = np.abs(rows.z / rows.s)[:, chosen]
    edges = np.linspace(begin, end, COLUMNS + 1)
    middles = (edges[1:] + edges[:-1]) / 2
    shades = np.array([np.interp(middles, rows.t, column) for column in values.T])
    picture = ax.pcolormesh(
        edges,
        np.arange(len(chosen) + 1) + 0.5,
        shades,
        cmap=ListedColormap(ramp("heat", LEVELS)),
        vmin=0.0,
        vmax=1.0,
        rasterized=True,
    )
    drawn: Artists = [picture]
    log = trace.transitions
    for lane, i in enumerate(chosen):
        times = log.t[(log.element == i) & (log.t >= begin) & (log.t <= end)]
        if times.size > CROWDED:
            times = times[:0]
        ends = lane + 0.58, lane + 1.42
        # White below ink, visible on every grey.
        ax.vlines(times, *ends, color=PAPER, linewidth=pt(2.4))
        drawn.append(ax.vlines(times, *ends, color=INK, linewidth=pt(0.9)))
    lanes(ax, chosen)
    time_axis(ax, begin, end)
    side = ax.inset_axes((1.015, 0.0, 0.02, 1.0))
    scale = ax.figure.colorbar(picture, cax=side, ticks=[0, 0.5, 1], extend="max")
    scale.set_label("$|z| / s(v)$ [–]")
    side.tick_params(length=2)
    return drawn


def slipping(ax: Axes, trace: Trace, **part: Unpack[PartOptions]) -> Artists:
    """Draw how many elements have left their default state.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    **part
        ``window`` and the ``elements`` that are counted.

    Returns
    -------
    list of Artist
        One collection per number from 1, the line, and a text with the number at the end.

    Examples
    --------
    >>> from plots.style.matplotlib import Figure
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> run = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0)
    >>> slipping(Figure().subplots(), run)[-1].get_text()
    'at the end 4 of 4 in slip'
    """
    this = selected(trace, **part)
    rows, count = this.rows, len(this.elements)
    away = counted_away(rows, this.elements)
    changes = np.flatnonzero(np.diff(away)) + 1
    starts = rows.t[np.concatenate([[0], changes])]
    ends = np.concatenate([starts[1:], rows.t[-1:]])
    numbers = away[np.concatenate([[0], changes])]
    shades = ramp("slipping", count + 1)
    drawn: Artists = []
    for number in range(1, count + 1):
        now = numbers == number
        pieces = np.column_stack([starts, ends - starts])[now & (ends > starts)]
        drawn.append(ax.broken_barh(pieces.tolist(), (0, number), facecolor=shades[number]))
    drawn += ax.step(rows.t, away, where="post", color=INK, linewidth=pt(0.9))
    ax.set(ylim=(0, 1.05 * count), ylabel=place_of(trace))
    ax.set_yticks([0, count // 2, count] if count > 1 else [0, 1])
    time_axis(ax, *this.window)
    said = f"at the end {away[-1]} of {count} {place_of(trace)}"
    return [*drawn, ax.set_title(said, loc="right", fontsize=font(8))]


def counted_away(trace: Trace, elements: Sequence[int]) -> NDArray[np.int64]:
    """Return how many of some elements have left their default state, shape (rows,)."""
    chart = trace.model.chart
    counts: NDArray[np.int64] = (
        trace.modes[:, elements] != chart.state_index(chart.default_state.name)
    ).sum(axis=1)
    return counts


def place_of(trace: Trace) -> str:
    """Return where an element is that has left its default state, for example "in slip"."""
    chart = trace.model.chart
    default = chart.default_state.name
    others = [state.name for state in chart.states if state.name != default]
    return f"in {others[0]}" if len(others) == 1 else f"not in {default}"
