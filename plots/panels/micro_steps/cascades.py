"""Panels of break-aways: the time of a cascade, its marks, its margins, the jumps of F."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np

from gms_fsm.errors import ParameterError
from gms_fsm.errors import shown as written
from gms_fsm.traces.trace import Trace
from plots.panels.parts.axes import (
    Artists,
    beside,
    draw_curve,
    element_curves,
    element_look,
    force_title,
    no_threshold,
    time_axis,
)
from plots.panels.parts.selection import PartOptions, RunPart, has_threshold, is_number, selected
from plots.style import INK, LINE_GREY, PAPER
from plots.style.matplotlib import Axes
from plots.style.presets import font, pt
from plots.views.traces import check_trace
from plots.views.window import Window

__all__ = ["cascade", "cascade_window", "margins", "marks"]

CASCADE = 0.02  # s: largest time between break-aways of one cascade
RESOLVED = 1e-4  # s: break-aways at least this far apart are drawn separately


def cascade_window(
    trace: Trace, around: float | None = None, *, within: float = CASCADE
) -> Window | None:
    """Return the time interval of a cascade of break-aways.

    Parameters
    ----------
    trace : Trace
        The run.
    around : float, optional
        Select the break-away nearest to this time, s. By default the first that is followed by
        another one within `within`, preferably not at the same instant; if there is none, the first
        break-away.
    within : float
        Largest time between break-aways of one cascade, s.

    Returns
    -------
    (float, float) or None
        s; None if no element ever leaves its default state and `around` is left out.

    Raises
    ------
    ParameterError
        If `around` is not in the run or `within` is not positive.
    """
    check_trace(trace)
    first, last = float(trace.t[0]), float(trace.t[-1])
    if not is_number(within) or not within > 0:
        raise ParameterError(f"within is {written(within)}", advice="it must be a time > 0 s")
    if around is not None and not (is_number(around) and first <= around <= last):
        raise ParameterError(
            f"around is {written(around)}",
            advice=f"it must be a time in the run, {first:g} to {last:g} s",
        )
    log = trace.transitions
    leaving = log.source == trace.model.chart.default_state.name
    times = log.t[leaving & (log.t >= first) & (log.t <= last)]
    if around is not None:
        start = float(times[np.abs(times - around).argmin()]) if times.size else float(around)
        group = times[np.abs(times - start) <= within]
    elif times.size:
        after = np.searchsorted(times, times + within, side="right")
        spread = times[after - 1] - times
        several = after - np.arange(times.size) > 1
        best = int((np.where(spread >= RESOLVED, 2, several)).argmax())
        group = times[best : after[best]]
    else:
        return None
    if not group.size:
        group = np.array([start])
    width = float(group[-1] - group[0])
    pad = 0.6 * width if width >= RESOLVED else within / 2
    return max(first, float(group[0]) - pad), min(last, float(group[-1]) + pad)


def _in_window(part: RunPart) -> Any:
    """Return the log's records of a part of a run."""
    log, (begin, end) = part.run.transitions, part.window
    return log[(log.t >= begin) & (log.t <= end) & np.isin(log.element, part.elements)]


def marks(ax: Axes, trace: Trace, **part: Unpack[PartOptions]) -> Artists:
    """Draw a vertical line at every transition, labelled with its element, or several together.

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
        One line per transition, then the labels.
    """
    this = selected(trace, **part)
    begin, end = this.window
    log = _in_window(this)
    drawn: Artists = [
        ax.axvline(t, linewidth=pt(0.9), zorder=1, **element_look(int(i), trace.n))
        for t, i in zip(log.t.tolist(), log.element.tolist(), strict=True)
    ]
    if not end > begin:
        return drawn
    wide = 0.9 * ax.bbox.width / ax.figure.dpi * 72  # points; the layout may still move
    letter = 5.5 / 8.0 * font(8) * (end - begin) / wide  # s
    groups: list[list[Any]] = []  # elements, first and last time
    for t, i in zip(log.t.tolist(), log.element.tolist(), strict=True):
        groups.append([[i], t, t])
        while len(groups) > 1 and _meet(groups[-2], groups[-1], letter):
            after = groups.pop()
            groups[-1] = [groups[-1][0] + after[0], groups[-1][1], after[2]]
    top = ax.get_xaxis_transform()
    return drawn + [
        beside(ax, _joined(members), ((t0 + t1) / 2, 1.0), (0, 2), xycoords=top)
        for members, t0, t1 in groups
    ]


def _joined(members: list[int]) -> str:
    if len(members) > 5:
        return f"{len(members)} switches"
    return " ".join(f"E{i + 1}" for i in members)


def _meet(a: list[Any], b: list[Any], letter: float) -> bool:
    gap = (b[1] + b[2]) / 2 - (a[1] + a[2]) / 2
    return bool(gap < letter * (len(_joined(a[0])) + len(_joined(b[0])) + 1) / 2)


def margins(ax: Axes, trace: Trace, **part: Unpack[PartOptions]) -> Artists:
    """Draw the relative margin of each element to its threshold, 1 - |z| / s.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    **part
        ``window``, by default a cascade (see `cascade_window`), and ``elements``.

    Returns
    -------
    list of Artist
        One line per element, the line at zero, one set of dots per element that switches (at its
        switches), then the marks. For a chart without edges, or without the input s, there is no
        threshold, and only a note is drawn.
    """
    window = part.get("window")
    this = selected(
        trace, cascade_window(trace) if window is None else window, part.get("elements")
    )
    if not has_threshold(trace):
        return [no_threshold(ax, trace)]
    values = 1 - np.abs(this.rows.z / this.rows.s)
    largest = float(np.nanmax(np.abs(values[:, this.elements])))
    power = max(0, int(np.ceil(-np.log10(largest)))) if largest > 0 else 0
    power = 3 * -(-power // 3) if power > 1 else 0
    factor = 10.0**power
    log = _in_window(this)
    lines = element_curves(ax, this, factor * values, "E{}")
    dots: Artists = []
    look: dict[str, Any] = {"markersize": pt(4), "clip_on": False, "zorder": 4}
    for i in this.elements:
        mine, ink = log[log.element == i], element_look(i, trace.n)["color"]
        if mine.size:
            dots += ax.plot(mine.t, factor * (1 - np.abs(mine.z / mine.s)), "o", color=ink, **look)
    lines.append(ax.axhline(0.0, color=LINE_GREY, linewidth=pt(0.8), zorder=1))
    ax.set_ylabel(f"10$^{power}$ $(1 − |z|/s)$ [–]" if power else "$1 − |z|/s$ [–]")
    time_axis(ax, *this.window)
    return [*lines, *dots, *marks(ax, trace, window=this.window, elements=this.elements)]


def cascade(
    ax: Axes,
    trace: Trace,
    *,
    around: float | None = None,
    within: float = CASCADE,
    **part: Unpack[PartOptions],
) -> Artists:
    """Draw the jumps of F at a break-away, with both one-sided values of every jump.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run.
    around, within : float, optional
        Which cascade; see `cascade_window`. A run without break-aways is drawn whole.
    **part
        ``window`` to show instead, and the ``elements`` whose jumps are marked.

    Returns
    -------
    list of Artist
        The line; the values before (open dots); the values after (filled dots); then the marks.
    """
    window = part.get("window")
    if window is None:
        window = cascade_window(trace, around, within=within)
    this = selected(trace, window, part.get("elements"))
    log = _in_window(this)
    lines = draw_curve(ax, this.rows.t, this.rows.F, color=INK)
    look: dict[str, Any] = {"markersize": pt(4.5), "color": INK}
    before, after = look | {"markerfacecolor": PAPER, "zorder": 3}, look | {"zorder": 4}
    dots = [
        *ax.plot(log.t, log.F_before, "o", label="F before", **before),
        *ax.plot(log.t, log.F_after, "o", label="F after", **after),
    ]
    ax.set_ylabel(force_title(trace))
    time_axis(ax, *this.window)
    return [*lines, *dots, *marks(ax, trace, window=this.window, elements=this.elements)]
