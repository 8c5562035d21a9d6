"""Panels of F against v and against x."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from gms_fsm.foundation.quantities import per_second
from gms_fsm.traces.trace import Trace
from plots.panels._many import counted_away, place_of
from plots.panels.parts.axes import VECTOR_ROWS, Artists, draw_curve, force_title, log_axis
from plots.panels.parts.selection import PartOptions, RunPart, scaled, selected
from plots.style import INK, LINE_GREY, TEXT_GREY, ramp
from plots.style.matplotlib import Axes, BoundaryNorm, LineCollection, ListedColormap
from plots.style.presets import pt, to_scale

__all__ = ["arrows", "hysteresis", "portrait", "slip_bar"]

# Phases; the third one may cover itself many times.
PHASES: tuple[dict[str, Any], ...] = (
    {"color": INK, "linestyle": "-", "linewidth": 1.6},
    {"color": TEXT_GREY, "linestyle": "--", "linewidth": 1.6},
    {"color": LINE_GREY, "linestyle": "-", "linewidth": 0.9},
)
MOST_ARROWS = 500  # looked at along one path
APART = 1.1  # inches along the path, between arrows
OVERLAP, REPEATED = 0.22, 0.7  # inches between arrows, and between those of the same direction
SHAFT = 0.05  # inches of the path whose direction an arrow has
STRAIGHT = 0.8  # cosine of the angle between an arrow and the path around it, at least


def _by_slipping(ax: Axes, x: NDArray[np.float64], part: RunPart) -> LineCollection:
    """Draw F against x in pieces, coloured by how many elements have left their default state."""
    away = counted_away(part.rows, part.elements)
    points = np.column_stack([x, part.rows.F])
    # A piece has one colour; the next piece begins where it ends.
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(away)) + 1, [len(points)]])
    pieces = [points[a : b + 1] for a, b in pairwise(cuts)]
    count = len(part.elements)
    # The more elements slip, the darker, also in grey.
    shades = ListedColormap(ramp("slipping", count + 1))
    lines = LineCollection(
        pieces,
        cmap=shades,
        norm=BoundaryNorm(np.arange(-0.5, count + 1.0), count + 1),
        array=away[cuts[:-1]],
        linewidths=pt(1.6),
        capstyle="round",
        rasterized=len(points) > VECTOR_ROWS,
    )
    if not part.run.model.chart.transitions:  # one state: nothing to count
        lines.set_array(None)
        lines.set_color(INK)
    ax.add_collection(lines)
    ax.autoscale_view()
    return lines


def slip_bar(lines: LineCollection, trace: Trace, axes: Axes | Sequence[Axes]) -> None:
    """Add the colour bar of a portrait; a chart without edges does not need one.

    Parameters
    ----------
    lines : LineCollection
        From `portrait` or `hysteresis`.
    trace : Trace
        The run.
    axes : Axes or sequence of Axes
        Axes next to which the bar is placed.
    """
    chart = trace.model.chart
    if not chart.transitions:
        return
    first = axes if isinstance(axes, Axes) else axes[0]
    norm = lines.norm
    assert isinstance(norm, BoundaryNorm)
    most = norm.N - 2
    step = 1 + most // 10
    ticks = [*range(0, most - step // 2, step), most]
    bar = first.figure.colorbar(lines, ax=axes, ticks=ticks, aspect=30, fraction=0.05)
    bar.set_label(f"elements {place_of(trace)}")
    bar.ax.tick_params(length=0)
    bar.ax.minorticks_off()


def portrait(
    ax: Axes,
    trace: Trace,
    *,
    log: bool = False,
    bar: bool = True,
    **part: Unpack[PartOptions],
) -> Artists:
    """Draw F against v, darker where more elements have left their default state.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    **part
        ``window`` and the ``elements`` that are counted.
    log : bool
        Draw against |v| on a logarithmic axis.
    bar : bool
        Add a colour bar.

    Returns
    -------
    list of Artist
        The collection of lines.
    """
    this = selected(trace, **part)
    factor, unit = scaled(this.rows.v, per_second(trace.model.chart.length))
    v = factor * this.rows.v
    if log:
        v = np.abs(v)
        v[v == 0] = np.nan
        log_axis(ax, v, "x")
    lines = _by_slipping(ax, v, this)
    ax.set(xlabel=f"{'$|v|$' if log else '$v$'} [{unit}]", ylabel=force_title(trace))
    if bar:
        slip_bar(lines, trace, ax)
    return [lines]


def hysteresis(
    ax: Axes,
    trace: Trace,
    phases: Sequence[tuple[str, float]] = (),
    *,
    slipping: bool = False,
    scale: tuple[float, str] | None = None,
    **part: Unpack[PartOptions],
) -> Artists:
    """Draw F against x, in one colour, in phases, or by the number of elements slipping.

    Parameters
    ----------
    ax : Axes
        Axes to draw on; x is relative to the start of the run.
    trace : Trace
        The run.
    phases : sequence of (str, float), optional
        Names and end times [s] of parts drawn in separate colours; by default one part.
    **part
        ``window`` and the ``elements`` that are counted with `slipping`.
    slipping : bool
        Colour as in `portrait`, instead of phases.
    scale : (float, str), optional
        Factor and unit of x, for panels that are compared; by default those that suit the run.

    Returns
    -------
    list of Artist
        One line per phase, or the collection of lines.
    """
    this = selected(trace, **part)
    rows = this.rows
    x = rows.x - trace.x[0]
    factor, unit = scaled(x, trace.model.chart.length) if scale is None else scale
    ax.set(xlabel=f"$x$ [{unit}]", ylabel=force_title(trace))
    if slipping:
        return [_by_slipping(ax, factor * x, this)]
    begin = -np.inf
    lines: Artists = []
    for number, (name, end) in enumerate(phases or [("", np.inf)]):
        now = (rows.t >= begin) & (rows.t <= end)
        lines += draw_curve(
            ax,
            factor * x[now],
            rows.F[now],
            label=name,
            zorder=3 - number % 3,
            **to_scale(PHASES[number % len(PHASES)]),
        )
        begin = end
    return lines


def arrows(ax: Axes, lines: LineCollection) -> Artists:
    """Draw arrowheads along a portrait, in the direction of time.

    Where a path repeats itself, only the first arrow of several close ones is drawn.

    Parameters
    ----------
    ax : Axes
        Axes with the portrait, as large as they will be.
    lines : LineCollection
        From `portrait` or `hysteresis`; its pieces are in the order of time.

    Returns
    -------
    list of Artist
        One annotation per arrow, from a point of the path to a later one.
    """
    pieces = [np.asarray(piece) for piece in lines.get_segments()]
    path = np.concatenate([*pieces, np.empty((0, 2))])
    path = path[np.isfinite(path).all(axis=1)]
    if len(path) < 2:
        return []
    inches = ax.transData.transform(path) / ax.figure.dpi
    steps = np.hypot(*np.diff(inches, axis=0).T)
    moved = np.concatenate([[True], steps > 0])
    path, length = path[moved], np.concatenate([[0.0], np.cumsum(steps[steps > 0])])
    if not length[-1] > 0:
        return []
    apart = max(APART, length[-1] / MOST_ARROWS)
    look: dict[str, Any] = {"arrowstyle": "-|>,head_length=0.5,head_width=0.25"}
    look |= {"color": INK, "linewidth": pt(0.0), "shrinkA": 0, "shrinkB": 0, "mutation_scale": 11}
    drawn: Artists = []
    known: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []  # tips, directions; inches
    for end in np.arange(apart / 2, length[-1], apart).tolist():
        # The arrow ends on the path, and begins where the path was just before.
        near = [_at(path, length, end + step * SHAFT) for step in (-3, -2, -1, 0, 1)]
        ways = np.diff(ax.transData.transform(near) / ax.figure.dpi, axis=0)
        sizes = np.hypot(*ways.T)
        if sizes[2] < 0.5 * SHAFT:  # the path turns back here
            continue
        way, tail, tip = ways[2] / sizes[2], near[2], near[3]
        here = ax.transData.transform(tip) / ax.figure.dpi
        if (ways @ way < STRAIGHT * sizes).any():  # on a corner
            continue
        if any(_alike(here - other, float(way @ theirs)) for other, theirs in known):
            continue
        known.append((here, way))
        drawn.append(ax.annotate("", tip, tail, arrowprops=look, zorder=5))
    return drawn


def _at(path: NDArray[np.float64], length: NDArray[np.float64], at: float) -> tuple[float, float]:
    """Return the point of a path at a length along it."""
    x, y = (float(np.interp(at, length, column)) for column in path.T)
    return x, y


def _alike(between: NDArray[np.float64], cosine: float) -> bool:
    """Return whether two arrows are so close that one of them is enough."""
    away = float(np.hypot(*between))
    return away < OVERLAP or (away < REPEATED and cosine > 0.8)
