"""Panels over time: velocity, force, deflections, and deflections relative to thresholds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gms_fsm.traces.trace import Trace
from plots.panels.parts.axes import (
    Artists,
    draw_curve,
    element_look,
    first_variable,
    log_axis,
    note,
    time_axis,
)
from plots.panels.parts.selection import (
    checked_elements,
    checked_window,
    has_threshold,
    scaled,
    shown,
)
from plots.style import INK, LINE_GREY
from plots.style.matplotlib import Axes
from plots.style.presets import pt
from plots.views.window import Window

NO_VARIABLE = "no deflection:\nthis chart has no variables"

__all__ = ["deflections", "force", "ratio", "velocity"]


def velocity(ax: Axes, trace: Trace, *, window: Window | None = None, log: bool = False) -> Artists:
    """Draw v(t).

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    window : (float, float), optional
        Time interval to show, s.
    log : bool
        Draw |v| on a logarithmic axis.

    Returns
    -------
    list of Artist
        The line.
    """
    part = shown(trace, window)
    factor, unit = scaled(part.v, "m/s")
    v = factor * (np.abs(part.v) if log else part.v)
    ax.set_ylabel(f"{'|v|' if log else 'v'} [{unit}]")
    lines = draw_curve(ax, part.t, v, color=INK)
    if log:
        log_axis(ax, v, "y")
    time_axis(ax, *checked_window(trace, window))
    return lines


def force(
    ax: Axes,
    trace: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Artists:
    """Draw the friction force F(t); at a transition both one-sided values are drawn.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    window : (float, float), optional
        Time interval to show, s.
    elements : sequence of int, optional
        Elements whose forces F_i are also drawn; by default none.

    Returns
    -------
    list of Artist
        The line of F, then one per element.
    """
    chosen = [] if elements is None else checked_elements(trace, elements)
    part = shown(trace, window)
    lines = draw_curve(ax, part.t, part.F, color=INK, label="F")
    for i in chosen:
        lines += draw_curve(
            ax, part.t, part.F_elements[:, i], label=f"$F_{{{i + 1}}}$", **element_look(i, trace.n)
        )
    ax.set_ylabel("F [N]")
    time_axis(ax, *checked_window(trace, window))
    return lines


def deflections(
    ax: Axes,
    trace: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    scale: tuple[float, str] | None = None,
) -> Artists:
    """Draw z_i(t) of every element, or the chart's first variable if it has another name.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    window : (float, float), optional
        Time interval to show, s.
    elements : sequence of int, optional
        Which elements, counted from 0; by default all.
    scale : (float, str), optional
        Factor and title of the axis, for panels that are compared; by default those that suit the
        run.

    Returns
    -------
    list of Artist
        One line per element; for a chart without variables only a note.
    """
    chosen = checked_elements(trace, elements)
    if not trace.model.chart.variables:
        time_axis(ax, *checked_window(trace, window))
        return [note(ax, NO_VARIABLE)]
    part = shown(trace, window)
    factor, title = first_variable(trace, part.z[:, chosen]) if scale is None else scale
    name = trace.model.chart.variables[0]
    lines: Artists = []
    for i in chosen:
        label = f"$z_{{{i + 1}}}$" if name == "z" else f"{name}{i + 1}"
        lines += draw_curve(
            ax, part.t, factor * part.z[:, i], label=label, **element_look(i, trace.n)
        )
    ax.set_ylabel(title)
    time_axis(ax, *checked_window(trace, window))
    return lines


def ratio(
    ax: Axes,
    trace: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Artists:
    """Draw the deflection of each element over its threshold, z_i / s_i(v), with lines at ±1.

    A chart without edges has no threshold: its z / s(v) is drawn with its unit, without the lines.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    window : (float, float), optional
        Time interval to show, s.
    elements : sequence of int, optional
        Which elements, counted from 0; by default all.

    Returns
    -------
    list of Artist
        One line per element, then the lines at +1 and -1; for a chart without variables only a
        note.
    """
    chosen = checked_elements(trace, elements)
    if not trace.model.chart.variables:
        time_axis(ax, *checked_window(trace, window))
        return [note(ax, NO_VARIABLE)]
    part = shown(trace, window)
    values, threshold = part.z, has_threshold(trace)
    if "s" in trace.model.chart.inputs:
        values = part.z / part.s
        factor, unit = (1.0, "–") if threshold else scaled(values, "m/N")
        title = f"{trace.model.chart.variables[0]} / s(v) [{unit}]"
    else:
        factor, title = first_variable(trace, values)
    lines: Artists = []
    for i in chosen:
        lines += draw_curve(
            ax, part.t, factor * values[:, i], label=f"E{i + 1}", **element_look(i, trace.n)
        )
    if threshold:
        lines += [
            ax.axhline(level, color=LINE_GREY, linewidth=pt(0.8), zorder=1) for level in (1.0, -1.0)
        ]
    ax.set_ylabel(title)
    time_axis(ax, *checked_window(trace, window))
    return lines
