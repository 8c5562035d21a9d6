"""Figures of one run: an overview, its ribbons, one cascade of break-aways."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind, refusing
from gms_fsm.traces.trace import Trace
from plots import panels
from plots.figures._layout import fitted, legend_above, low, narrow, sheet
from plots.figures._parts import (
    element_legend,
    head,
    lanes_height,
    last_cycles,
    letter_panels,
    one_time_axis,
    over_threshold,
)
from plots.panels.micro_steps.cascades import CASCADE
from plots.panels.parts.axes import MANY, VECTOR_ROWS
from plots.panels.parts.selection import checked_elements, checked_window, scaled, shown
from plots.style import LINE_GREY, PALE_GREY
from plots.style.matplotlib import Axes, Figure, LineCollection, MaxNLocator, rc_context
from plots.style.presets import pt, settings
from plots.views.traces import check_trace
from plots.views.window import Window

LOW = 2  # panels below each other, on a slide
MOST_SPANS = 30  # per element: more states are not readable side by side


@dataclass(frozen=True, eq=False)
class Measured:
    """A measured friction to compare with a run.

    Parameters
    ----------
    t, x, F : ndarray, shape (m,)
        s, m, N.

    Raises
    ------
    ParameterError
        If they are not one-dimensional with the same length, or times go backward.
    """

    t: NDArray[np.float64]
    x: NDArray[np.float64]
    F: NDArray[np.float64]

    def __post_init__(self) -> None:
        shapes = [np.shape(values) for values in (self.t, self.x, self.F)]
        if len(shapes[0]) != 1 or len(set(shapes)) > 1 or shapes[0] == (0,):
            raise ParameterError(
                f"t, x and F of a measurement have the shapes {shapes}",
                advice="they must be one-dimensional, equally long and not empty",
            )
        if not (np.diff(self.t) >= 0).all():
            raise ParameterError("t of a measurement goes backward", advice="times must increase")


@refusing()
def overview(
    trace: Trace,
    measured: Measured | None = None,
    *,
    title: str = "",
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Figure:
    """Draw an overview of a run: motion, force, states, friction over position and velocity.

    Parameters
    ----------
    trace : Trace
        The run.
    measured : Measured, optional
        Drawn together with the model.
    title : str
        Of the figure; the model and its law are added.
    window : (float, float), optional
        Time interval of all panels, s; by default the last three cycles of a long run.
    elements : sequence of int, optional
        Elements whose states are shown, counted from 0; by default all.

    Returns
    -------
    Figure
        On the left over time, on the right F against x and v.
    """
    check_trace(trace)
    if measured is not None:
        checked_kind("measured", measured, Measured, "a plots.figures.Measured")
    window = last_cycles(trace) if window is None else checked_window(trace, window)
    part = shown(trace, window)
    count = len(checked_elements(trace, elements))
    tall = [1.6, 1.6, *([1.0] if count > MANY else []), lanes_height(count, 1.6)]  # inches
    with rc_context(settings()):
        figure, time, (loop, portrait) = _overview_axes(tall)
        panels.velocity(time[0], part, window=window)
        panels.force(time[1], part, window=window)
        if count > MANY:
            panels.slipping(time[2], part, window=window, elements=elements)
        panels.ribbons(time[-1], part, window=window, elements=elements)
        alone = measured is None  # else ink is the model, grey the measurement
        panels.hysteresis(loop, trace, window=window, elements=elements, slipping=alone)
        (lines,) = panels.portrait(portrait, part, elements=elements, bar=False)
        assert isinstance(lines, LineCollection)
        panels.slip_bar(lines, trace, [loop, portrait] if alone else portrait)
        if measured is not None:
            _add_measured(time[1], loop, measured, trace, window)
        if trace.model.chart.transitions:
            legend_above(time[-1])
        for ax in time[:-1]:
            ax.set_xlabel("")
        names = ["velocity", "friction", "active states"]
        names[2:2] = ["how many slip"] if count > MANY else []
        letter_panels(
            [*time, loop, portrait], [*names, "friction over position", "friction over velocity"]
        )
        for ax in (loop, portrait):  # narrow, and labels such as -0.35 are wide
            ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
        figure.suptitle(f"{head(trace, title)}{_left_out(trace, window)}", x=0.01, ha="left")
    return fitted(figure)


def _left_out(trace: Trace, window: Window) -> str:
    """Return which part of a run is shown, if not all of it."""
    (begin, end), first, last = window, trace.t[0], trace.t[-1]
    if (begin, end) == (first, last):
        return ""
    if end == last:
        return f"; last {end - begin:.3g} s of {last - first:.3g} s"
    return f"; {begin:.4g} s to {end:.4g} s"


def _overview_axes(tall: Sequence[float]) -> tuple[Figure, Sequence[Axes], Sequence[Axes]]:
    """Return an empty figure, its panels over time, and the others: next to or below them."""
    if narrow():
        figure = sheet(4.2, sum(tall) + 3.8)
        axes = figure.subplots(len(tall) + 2, 1, height_ratios=(*tall, 2.0, 2.0))
        time = axes[:-2]
        for ax in time[1:]:
            ax.sharex(time[0])
        for ax in time[:-1]:
            ax.tick_params(labelbottom=False)
        return figure, time, axes[-2:]
    figure = sheet(11.0, sum(tall) + 1.8)
    grid = figure.add_gridspec(1, 2, width_ratios=(1.5, 1))
    left, right = (figure.add_subfigure(grid[0, column]) for column in (0, 1))
    over_time = left.subplots(len(tall), 1, sharex=True, height_ratios=tall)
    return figure, over_time, right.subplots(2, 1)


def _add_measured(ax: Axes, loop: Axes, measured: Measured, trace: Trace, window: Window) -> None:
    """Draw the measured friction over time and over x."""
    inside = (measured.t >= window[0]) & (measured.t <= window[1])
    ax.lines[0].set(label="model", zorder=3)
    ax.plot(
        measured.t[inside],
        measured.F[inside],
        color=LINE_GREY,
        linewidth=pt(2.4),
        label="measured",
        rasterized=bool(inside.sum() > VECTOR_ROWS),
    )
    legend_above(ax)
    factor, _ = scaled(shown(trace, window).x - trace.x[0], trace.model.chart.length)
    loop.lines[0].set(linewidth=pt(0.9), zorder=3, rasterized=True)
    loop.plot(
        factor * (measured.x[inside] - trace.x[0]),
        measured.F[inside],
        color=LINE_GREY,
        linewidth=pt(0.5),
        alpha=0.7,
        rasterized=True,
    )


def ribbons_figure(
    trace: Trace,
    around: float | None = None,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    within: float = CASCADE,
    title: str = "",
) -> Figure:
    """Draw what happens in a run, why, and in which order: ribbons, and a cascade or portraits.

    Parameters
    ----------
    trace : Trace
        The run.
    around : float, optional
        The break-away that the right column shows, s; see `plots.panels.cascade_window`.
    window : (float, float), optional
        Of the left column, s. By default the whole run; if it has too many states to
        read, its last three cycles.
    elements : sequence of int, optional
        Which elements, counted from 0; by default all.
    within : float
        Largest time between break-aways of one cascade, s.
    title : str
        Of the figure; the model and its law are added.

    Returns
    -------
    Figure
        Left: v, z / s, F and states over time. Right: the zoom, or if nothing ever breaks away and
        `around` is not given F against v and x. On a slide there is room for four panels: v and
        z / s are left out.
    """
    limits = checked_window(trace, window)
    if window is None and len(trace.transitions) > MOST_SPANS * trace.n:
        limits = last_cycles(trace)
    part = shown(trace, limits)
    # Prefer a cascade that the left column also shows.
    zoom = panels.cascade_window(part if around is None else trace, around, within=within)
    if zoom is None and window is None:
        zoom = panels.cascade_window(trace, around, within=within)
    with rc_context(settings()):
        tall = _heights(len(checked_elements(trace, elements)))
        figure, left, middle, right = _ribbon_axes(tall, zoom=zoom is not None)
        second = ""
        if len(left) > LOW:
            panels.velocity(left[0], part, window=limits)
            second = over_threshold(left[1], part, window=limits, elements=elements)
        panels.force(left[-2], part, window=limits)
        panels.ribbons(left[-1], part, window=limits, elements=elements)
        one_time_axis(left)
        names = ["velocity", second, "friction", "active states"][-len(left) :]
        if zoom:
            margin = _cascade_column(middle, trace, zoom, elements)
            for ax in left:
                ax.axvspan(*zoom, color=PALE_GREY, linewidth=pt(1.0), alpha=0.6, zorder=0)
            names += _zoom_names(zoom, margin)[-len(middle) :]
        if right:
            (lines,) = panels.portrait(right[0], part, elements=elements, bar=False)
            panels.hysteresis(right[1], trace, window=limits, elements=elements, slipping=True)
            assert isinstance(lines, LineCollection)
            panels.slip_bar(lines, trace, right)
            names += ["friction over velocity", "friction over position"]
        letter_panels([*left, *middle, *right], names)
        figure.suptitle(f"{head(trace, title)}{_left_out(trace, limits)}", x=0.01, ha="left")
        element_legend(figure, *left[1:4:2])
    return fitted(figure)


def _ribbon_axes(
    tall: Sequence[float], *, zoom: bool
) -> tuple[Figure, list[Axes], list[Axes], list[Axes]]:
    """Return an empty figure and its panels: over time, and of the zoom or F against v and x.

    On a slide there is room for four panels.
    """
    rows = LOW if low() else len(tall)
    heights = list(tall[-rows:])
    if narrow():
        column = [0.75 * each for each in heights] * (2 if zoom else 1)
        figure = sheet(4.2, sum(column) + (0.0 if zoom else 2.1) + 0.3 * len(column))
        parts = 1 if zoom else 2
        halves = figure.add_gridspec(parts, 1, height_ratios=(len(column), 1.8)[:parts])
        axes = list(
            figure.add_subfigure(halves[0, 0]).subplots(len(column), 1, height_ratios=column)
        )
        pair = [] if zoom else list(figure.add_subfigure(halves[1, 0]).subplots(1, 2))
        return figure, axes[:rows], axes[rows:], pair
    figure = sheet(9.6, sum(tall) + 2.2)
    if zoom:
        grid = figure.subplots(rows, 2, width_ratios=(1.45, 1), height_ratios=heights)
        return figure, list(grid[:, 0]), list(grid[:, 1]), []
    halves = figure.add_gridspec(1, 2, width_ratios=(1.3, 1))
    axes = list(figure.add_subfigure(halves[0, 0]).subplots(rows, 1, height_ratios=heights))
    return figure, axes, [], list(figure.add_subfigure(halves[0, 1]).subplots(2, 1))


def cascade_figure(
    trace: Trace,
    around: float | None = None,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    within: float = CASCADE,
    title: str = "",
) -> Figure:
    """Draw one cascade of break-aways: velocity, margins, the jumps of F, the order of slipping.

    Parameters
    ----------
    trace : Trace
        The run.
    around, within : float, optional
        Which break-away, s; see `plots.panels.cascade_window`.
    window : (float, float), optional
        Time interval to show instead, s.
    elements : sequence of int, optional
        Which elements, counted from 0; by default all.
    title : str
        Of the figure; the model and its law are added.

    Returns
    -------
    Figure
        Four panels over the same time; over the whole run if nothing ever breaks away.
    """
    zoom = window or panels.cascade_window(trace, around, within=within)
    limits = checked_window(trace, zoom)
    with rc_context(settings()):
        tall = _heights(len(checked_elements(trace, elements)))
        figure = sheet(6.4, sum(tall) + 2.2)
        if low():  # two columns, with a time axis each
            axes = list(figure.subplots(2, 2, height_ratios=(1.2, 1)).T.ravel())
            margin = _cascade_column(axes, trace, limits, elements)
            axes[1].set_xlabel(axes[3].get_xlabel())
            axes[1].tick_params(labelbottom=True)
        else:
            axes = list(figure.subplots(4, 1, height_ratios=tall))
            margin = _cascade_column(axes, trace, limits, elements)
        names = _zoom_names(limits, margin)
        letter_panels(axes, names if zoom else ["velocity", margin, "friction", "active states"])
        figure.suptitle(head(trace, title), x=0.01, ha="left")
        element_legend(figure, axes[1], axes[3])
    return fitted(figure)


def _cascade_column(
    axes: Sequence[Axes], trace: Trace, zoom: Window, elements: Sequence[int] | None
) -> str:
    """Draw the panels of a cascade; return the name of the second one."""
    part = shown(trace, zoom)
    name = "margin to the threshold"
    if len(axes) > LOW:
        panels.velocity(axes[0], part, window=zoom)
        if len(checked_elements(trace, elements)) > MANY:
            name = over_threshold(axes[1], part, window=zoom, elements=elements)
        else:
            panels.margins(axes[1], part, window=zoom, elements=elements)
    panels.cascade(axes[-2], part, window=zoom, elements=elements)
    panels.ribbons(axes[-1], part, window=zoom, elements=elements)
    one_time_axis(axes)
    return name


def _heights(count: int) -> tuple[float, ...]:
    """Return the heights of velocity, deflections, friction and states, inches."""
    return 1.6, lanes_height(count, 1.9), 1.9, lanes_height(count, 1.6)


def _zoom_names(zoom: Window, margin: str) -> list[str]:
    middle, width = (zoom[0] + zoom[1]) / 2, zoom[1] - zoom[0]
    factor, unit = scaled(np.array([width]), "s")
    return [
        f"velocity, {factor * width:.3g} {unit} at $t$ = {middle:.5g} s",
        margin,
        "jumps of $F$ (open before, filled after)",
        "order of slipping",
    ]
