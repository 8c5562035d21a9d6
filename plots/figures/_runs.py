"""Figures of one run: an overview, its ribbons, one cascade of break-aways."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.traces.trace import Trace, check_trace
from plots import panels
from plots._matplotlib import Axes, Figure, LineCollection, MaxNLocator, rc_context
from plots._window import Window
from plots.figures._layout import fitted, low, narrow, sheet
from plots.figures._parts import (
    element_legend,
    head,
    last_cycles,
    legend_above,
    letter_panels,
    one_time_axis,
)
from plots.panels._axes import VECTOR_ROWS
from plots.panels._cascades import CASCADE
from plots.panels._shown import checked_window, scaled, shown
from plots.presets import pt, settings
from plots.style import LINE_GREY, PALE_GREY

__all__ = ["Measured", "cascade_figure", "overview", "ribbons_figure"]

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


def overview(
    trace: Trace,
    measured: Measured | None = None,
    *,
    title: str = "",
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Figure:
    """Draw an overview of a run: motion, force, states, hysteresis, friction against velocity.

    Parameters
    ----------
    trace : Trace
        The run.
    measured : Measured, optional
        Drawn together with the model.
    title : str
        Of the figure; the model and its law are added.
    window : (float, float), optional
        Time interval, s. Default: on the right the whole run, on the left the last three
        cycles of a long one.
    elements : sequence of int, optional
        Elements whose states are shown, counted from 0; by default all.

    Returns
    -------
    Figure
        On the left over time, on the right F against x and v.
    """
    check_trace(trace)
    begin, end = last_cycles(trace) if window is None else checked_window(trace, window)
    whole = window is None and begin == trace.t[0]
    part = shown(trace, window)
    left_part = part if whole or window is not None else shown(trace, (begin, end))
    with rc_context(settings()):
        figure, time, (loop, portrait) = _overview_axes()
        panels.velocity(time[0], left_part, window=(begin, end))
        panels.force(time[1], left_part, window=(begin, end))
        panels.ribbons(time[2], left_part, window=(begin, end), elements=elements)
        panels.hysteresis(loop, trace, window=window)
        panels.portrait(portrait, part, elements=elements)
        if measured is not None:
            _add_measured(time[1], loop, measured, trace, (begin, end))
        if trace.model.chart.transitions:
            legend_above(time[2])
        for ax in time[:2]:
            ax.set_xlabel("")
        note = "" if whole or window is not None else f", last {end - begin:.3g} s"
        for ax, name in zip(time, ("velocity", "friction", "active states"), strict=True):
            ax.set_title(name + note)
        loop.set_title("hysteresis")
        portrait.set_title("friction against velocity")
        for ax in (loop, portrait):  # narrow, and labels such as -0.35 are wide
            ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
        figure.suptitle(head(trace, title), x=0.01, ha="left")
    return fitted(figure)


def _overview_axes() -> tuple[Figure, Sequence[Axes], Sequence[Axes]]:
    """Return an empty figure, its panels over time, and the others: next to or below them."""
    if narrow():
        figure = sheet(4.2, 8.6)
        axes = figure.subplots(5, 1, height_ratios=(1, 1, 1, 1.3, 1.3))
        for ax in axes[1:3]:
            ax.sharex(axes[0])
        for ax in axes[:2]:
            ax.tick_params(labelbottom=False)
        return figure, axes[:3], axes[3:]
    figure = sheet(11.0, 6.6)
    grid = figure.add_gridspec(1, 2, width_ratios=(1.5, 1))
    left, right = (figure.add_subfigure(grid[0, column]) for column in (0, 1))
    return figure, left.subplots(3, 1, sharex=True), right.subplots(2, 1)


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
    factor, _ = scaled(trace.x - trace.x[0], "m")
    loop.lines[0].set(linewidth=pt(0.9), zorder=3, rasterized=True)
    loop.plot(
        factor * (measured.x - trace.x[0]),
        measured.F,
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
    """Draw what happens in a run, why, and in which order: ribbons, a cascade, portraits.

    Parameters
    ----------
    trace : Trace
        The run.
    around : float, optional
        The break-away that the middle column shows, s; see `plots.panels.cascade_window`.
    window : (float, float), optional
        Of the left and right columns, s. By default the whole run; if it has too many states to
        read, the last three cycles on the left.
    elements : sequence of int, optional
        Which elements, counted from 0; by default all.
    within : float
        Largest time between break-aways of one cascade, s.
    title : str
        Of the figure; the model and its law are added.

    Returns
    -------
    Figure
        Left: v, z / s, F and states over time. Middle: the zoom (omitted if nothing ever breaks
        away and `around` is not given). Right: F against v and x. On a slide there is room for four
        panels: v and z / s are left out, and with a zoom also what is on the right.
    """
    limits = checked_window(trace, window)
    crowded = window is None and len(trace.transitions) > MOST_SPANS * trace.n
    if crowded:
        limits = last_cycles(trace)
    part = shown(trace, limits)
    # Prefer a cascade that the left column also shows.
    zoom = panels.cascade_window(part if around is None else trace, around, within=within)
    if zoom is None and window is None:
        zoom = panels.cascade_window(trace, around, within=within)
    with rc_context(settings()):
        figure, left, middle, right = _ribbon_axes(zoom is not None)
        if len(left) > LOW:
            panels.velocity(left[0], part, window=limits)
            panels.ratio(left[1], part, window=limits, elements=elements)
        panels.force(left[-2], part, window=limits)
        panels.ribbons(left[-1], part, window=limits, elements=elements)
        one_time_axis(left)
        second = "first variable" if trace.model.chart.variables else "deflection"
        if "s" in trace.model.chart.inputs:
            second = (
                "deflection / threshold" if panels.has_threshold(trace) else "deflection / s(v)"
            )
        names = ["velocity", second, "friction", "active states"]
        if limits[0] > trace.t[0] and crowded:
            names = [f"{name}, last {limits[1] - limits[0]:.3g} s" for name in names]
        names = names[-len(left) :]
        if zoom:
            _cascade_column(middle, trace, zoom, elements)
            for ax in left:
                ax.axvspan(*zoom, color=PALE_GREY, linewidth=pt(1.0), alpha=0.6, zorder=0)
            names += _zoom_names(zoom)[-len(middle) :]
        if right:
            (lines,) = panels.portrait(right[0], trace, window=window, elements=elements, bar=False)
            panels.hysteresis(right[1], trace, window=window, elements=elements, slipping=True)
            assert isinstance(lines, LineCollection)
            panels.slip_bar(lines, trace, right)
            names += ["friction against velocity", "hysteresis"]
        letter_panels([*left, *middle, *right], names)
        figure.align_ylabels(left)
        figure.suptitle(head(trace, title), x=0.01, ha="left")
        element_legend(figure, *left[1:4:2])
    return fitted(figure)


def _ribbon_axes(zoom: bool) -> tuple[Figure, list[Axes], list[Axes], list[Axes]]:
    """Return an empty figure and its panels: over time, of the zoom, and F against v and x.

    On a slide there is room for four panels.
    """
    rows = LOW if low() else 4
    heights = (1, 1.2, 1.2, 1)[:rows]
    if narrow() and not low():
        figure = sheet(4.2, 11.3 if zoom else 7.4)
        count = 2 * rows if zoom else rows
        halves = figure.add_gridspec(2, 1, height_ratios=(count, 1.8))
        column = list(figure.add_subfigure(halves[0, 0]).subplots(count, 1))
        pair = list(figure.add_subfigure(halves[1, 0]).subplots(1, 2))
        return figure, column[:rows], column[rows:], pair
    figure = sheet(13.2 if zoom else 9.6, 9.2)
    beside = not (zoom and low())
    halves = figure.add_gridspec(
        1, 1 + beside, width_ratios=(2.1 if zoom else 1.3, 1)[: 1 + beside]
    )
    grid = figure.add_subfigure(halves[0, 0]).subplots(
        rows,
        2 if zoom else 1,
        squeeze=False,
        width_ratios=(1.45, 1) if zoom else None,
        height_ratios=heights,
    )
    right = list(figure.add_subfigure(halves[0, 1]).subplots(2, 1)) if beside else []
    return figure, list(grid[:, 0]), list(grid[:, 1]) if zoom else [], right


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
        figure = sheet(6.4, 9.2)
        if low():  # two columns, with a time axis each
            axes = list(figure.subplots(2, 2, height_ratios=(1.2, 1)).T.ravel())
            _cascade_column(axes, trace, limits, elements)
            axes[1].set_xlabel(axes[3].get_xlabel())
            axes[1].tick_params(labelbottom=True)
        else:
            axes = list(figure.subplots(4, 1, height_ratios=(1, 1.2, 1.2, 1)))
            _cascade_column(axes, trace, limits, elements)
        names = _zoom_names(limits)
        letter_panels(axes, names if zoom else ["velocity", "margin", "friction", "active states"])
        figure.suptitle(head(trace, title), x=0.01, ha="left")
        element_legend(figure, axes[1], axes[3])
    return fitted(figure)


def _cascade_column(
    axes: Sequence[Axes], trace: Trace, zoom: Window, elements: Sequence[int] | None
) -> None:
    part = shown(trace, zoom)
    if len(axes) > LOW:
        panels.velocity(axes[0], part, window=zoom)
        panels.margins(axes[1], part, window=zoom, elements=elements)
    panels.cascade(axes[-2], part, window=zoom, elements=elements)
    panels.ribbons(axes[-1], part, window=zoom, elements=elements)
    one_time_axis(axes)


def _zoom_names(zoom: Window) -> list[str]:
    middle, width = (zoom[0] + zoom[1]) / 2, zoom[1] - zoom[0]
    factor, unit = scaled(np.array([width]), "s")
    return [
        f"velocity, {factor * width:.3g} {unit} at t = {middle:.5g} s",
        "margin to the threshold",
        "jumps of F (open: before, filled: after)",
        "order of slipping",
    ]
