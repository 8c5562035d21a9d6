"""Panels over time: velocity, force, deflections, and deflections relative to thresholds."""

from __future__ import annotations

from typing import Unpack

import numpy as np

from gms_fsm.foundation.quantities import per_second
from gms_fsm.language import latex_name
from gms_fsm.traces.trace import Trace
from plots.panels.parts.axes import (
    Artists,
    draw_curve,
    element_curves,
    element_look,
    first_variable,
    force_title,
    log_axis,
    note,
    time_axis,
)
from plots.panels.parts.selection import (
    PartOptions,
    checked_window,
    has_threshold,
    scaled,
    selected,
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
    rows = shown(trace, window)
    factor, unit = scaled(rows.v, per_second(trace.model.chart.length))
    v = factor * (np.abs(rows.v) if log else rows.v)
    ax.set_ylabel(f"{'$|v|$' if log else '$v$'} [{unit}]")
    lines = draw_curve(ax, rows.t, v, color=INK)
    if log:
        log_axis(ax, v, "y")
    time_axis(ax, *checked_window(trace, window))
    return lines


def force(ax: Axes, trace: Trace, **part: Unpack[PartOptions]) -> Artists:
    """Draw the friction force F(t); at a transition both one-sided values are drawn.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    **part
        ``window``, and ``elements`` whose forces F_i are also drawn; by default none.

    Returns
    -------
    list of Artist
        The line of F, then one per element.
    """
    this = selected(trace, **part)
    rows = this.rows
    lines = draw_curve(ax, rows.t, rows.F, color=INK, label="$F$")
    for i in this.elements if part.get("elements") is not None else ():
        look = element_look(i, trace.n)
        lines += draw_curve(ax, rows.t, rows.F_elements[:, i], label=f"$F_{{{i + 1}}}$", **look)
    ax.set_ylabel(force_title(trace))
    time_axis(ax, *this.window)
    return lines


def deflections(
    ax: Axes,
    trace: Trace,
    *,
    scale: tuple[float, str] | None = None,
    **part: Unpack[PartOptions],
) -> Artists:
    """Draw z_i(t) of every element, or the chart's first variable if it has another name.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    **part
        ``window`` and ``elements``.
    scale : (float, str), optional
        Factor and title of the axis, for panels that are compared; by default those that suit the
        run.

    Returns
    -------
    list of Artist
        One line per element; for a chart without variables only a note.
    """
    this = selected(trace, **part)
    time_axis(ax, *this.window)
    if not trace.model.chart.variables:
        return [note(ax, NO_VARIABLE)]
    z, name = this.rows.z, trace.model.chart.variables[0]
    factor, title = first_variable(trace, z[:, this.elements]) if scale is None else scale
    ax.set_ylabel(title)
    pattern = "$z_{{{}}}$" if name == "z" else f"{name}{{}}"
    return element_curves(ax, this, factor * z, pattern)


def ratio(ax: Axes, trace: Trace, **part: Unpack[PartOptions]) -> Artists:
    """Draw the deflection of each element over its threshold, z_i / s_i(v), with lines at ±1.

    A chart without edges has no threshold: its z / s(v) is drawn with its unit, without the lines.

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
        One line per element, then the lines at +1 and -1; for a chart without variables only a
        note.
    """
    this = selected(trace, **part)
    time_axis(ax, *this.window)
    if not trace.model.chart.variables:
        return [note(ax, NO_VARIABLE)]
    values, threshold = this.rows.z, has_threshold(trace)
    if "s" in trace.model.chart.inputs:
        values = this.rows.z / this.rows.s
        factor, unit = (1.0, "–") if threshold else scaled(values, "m/N")
        title = f"${latex_name(trace.model.chart.variables[0])} / s(v)$ [{unit}]"
    else:
        factor, title = first_variable(trace, values)
    lines = element_curves(ax, this, factor * values, "E{}")
    if threshold:
        lines += [
            ax.axhline(level, color=LINE_GREY, linewidth=pt(0.8), zorder=1) for level in (1.0, -1.0)
        ]
    ax.set_ylabel(title)
    return lines
