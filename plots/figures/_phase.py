"""The figure of F over x and over v, with the direction of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gms_fsm.errors import ParameterError
from gms_fsm.errors import shown as written
from gms_fsm.foundation.arguments import refusing
from gms_fsm.foundation.quantities import per_second
from gms_fsm.traces.trace import Trace
from plots import panels
from plots.figures._layout import fitted, narrow, sheet
from plots.figures._parts import head, letter_panels
from plots.panels.parts.axes import Artists
from plots.panels.parts.selection import (
    checked_elements,
    checked_row,
    checked_window,
    scaled,
    shown,
)
from plots.style import PAPER, VERMILION
from plots.style.matplotlib import Annotation, Axes, Figure, LineCollection, rc_context
from plots.style.presets import pt, settings
from plots.views.traces import check_trace
from plots.views.window import Window

BESIDE = 0.25  # inches from the dot to the tip of an arrow, at least


@refusing()
def phase(
    trace: Trace,
    *,
    row: int | None = None,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    title: str = "",
) -> Figure:
    """Draw F over x and over v, with arrows in the direction of time and a dot at a row.

    Parameters
    ----------
    trace : Trace
        The run; of a system with several contacts, ``trace.contact(name)``.
    row : int, optional
        Row of the dot; negative rows count from the end. By default the last one in the window.
    window : (float, float), optional
        Time interval to show, s; by default the whole run.
    elements : sequence of int, optional
        Elements that are counted by the colour, from 0; by default all.
    title : str
        Of the figure; the model and its law are added.

    Returns
    -------
    Figure
        Both panels are coloured by how many elements have left their default state.

    Raises
    ------
    ParameterError
        If there is no such row, window or element, or the row is outside the window.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> from plots.figures import phase
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> figure = phase(simulate(model, Prescribed("0.2*sin(t)"), 10.0))
    >>> [ax.get_xlabel() for ax in figure.axes[:2]]
    ['$x$ [mm]', '$v$ [mm/s]']
    """
    check_trace(trace)
    limits = checked_window(trace, window)
    checked_elements(trace, elements)
    row = checked_row(trace, row, limits[1] if row is None else None)
    if not limits[0] <= trace.t[row] <= limits[1]:
        raise ParameterError(
            f"row {row} is at t = {trace.t[row]:g} s, outside the window {written(limits)}",
            advice="choose a row inside it",
        )
    with rc_context(settings()):
        figure = sheet(4.2, 6.6) if narrow() else sheet(11.0, 4.6)
        loop, portrait = figure.subplots(*(2, 1) if narrow() else (1, 2), sharey=True)
        over_x = panels.hysteresis(loop, trace, window=window, elements=elements, slipping=True)
        over_v = panels.portrait(portrait, trace, window=window, elements=elements, bar=False)
        x, v = trace.x[row] - trace.x[0], trace.v[row]
        part, length = shown(trace, window), trace.model.chart.length
        dots = [
            _dot(loop, x, part.x - trace.x[0], length, float(trace.F[row])),
            _dot(portrait, v, part.v, per_second(length), float(trace.F[row])),
        ]
        (lines,) = over_v
        assert isinstance(lines, LineCollection)
        panels.slip_bar(lines, trace, [loop, portrait])
        if not narrow():
            portrait.set_ylabel("")
        portrait.tick_params(labelleft=True)
        letter_panels([loop, portrait], ["friction over position", "friction over velocity"])
        note = f"from {limits[0]:.6g} to {limits[1]:.6g} s, dot at {_place(trace, row)}"
        figure.suptitle(f"{head(trace, title)}\n{note}", x=0.01, ha="left")
        figure.draw_without_rendering()  # arrows are evenly spaced in the laid out picture
        for ax, drawn, dot in zip((loop, portrait), (over_x, over_v), dots, strict=True):
            _arrows(ax, drawn, dot)
    return fitted(figure)


def _place(trace: Trace, row: int) -> str:
    """Return the time of a row, and what fires there, if one edge does."""
    log = trace.transitions
    fired = log[log.t == trace.t[row]]
    what = f": E{fired.element[0] + 1} {fired.edge[0]}" if fired.size == 1 else ""
    return f"$t$ = {trace.t[row]:.6g} s{what}"


def _dot(ax: Axes, here: float, values: np.ndarray, unit: str, F: float) -> tuple[float, float]:
    """Draw the dot in the unit of the axis, which is that of the values shown; return its place."""
    factor, _ = scaled(values, unit)
    look: Any = {"color": VERMILION, "markersize": pt(9), "markeredgecolor": PAPER}
    ax.plot(factor * here, F, "o", zorder=8, clip_on=False, **look)
    return factor * here, F


def _arrows(ax: Axes, drawn: Artists, dot: tuple[float, float]) -> None:
    """Draw arrows along the path, but not at the dot."""
    (lines,) = drawn
    assert isinstance(lines, LineCollection)
    for arrow in panels.arrows(ax, lines):
        assert isinstance(arrow, Annotation)
        apart = np.subtract(*ax.transData.transform([arrow.xy, dot])) / ax.figure.dpi
        if np.hypot(*apart) < BESIDE:
            arrow.remove()
