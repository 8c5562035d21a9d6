"""Composite figures: the paper's Fig. 3 and 4, a run at a glance, ribbons and cascades.

Figures are made without pyplot: no global state, no display.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gms_fsm._files import written_whole
from gms_fsm.errors import OutputError, ParameterError
from gms_fsm.traces.trace import Trace, check_trace
from plots import panels
from plots._matplotlib import Axes, Figure, LineCollection, rc_context
from plots.panels import SMOOTH, Window, shown
from plots.style import BLUE, INK, LINE_GREY, PALE_GREY, RC, TEXT_GREY, VERMILION

__all__ = [
    "FIG3_PHASES",
    "SMOOTH",
    "Measured",
    "cascade_figure",
    "compare_laws",
    "figure_3",
    "figure_4",
    "overview",
    "residuals",
    "ribbons_figure",
    "save",
]

MOST_SPANS = 30  # an element: more states than that are not read side by side
FORMATS = ("png", "svg", "pdf")
FIG3_PHASES = (("rising", 2.0), ("falling", 4.0), ("oscillating", np.inf))


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure; the suffix chooses the format.

    Parameters
    ----------
    figure : Figure
        What.
    path : str or Path
        Ends in ``.png``, ``.svg`` or ``.pdf``.

    Returns
    -------
    Path
        The file, written whole.

    Raises
    ------
    OutputError
        If the ending is another, or the folder cannot be written.
    """
    path = Path(path)
    ending = path.suffix[1:].lower()
    if ending not in FORMATS:
        raise OutputError(f"{path}: a figure is saved as .png, .svg or .pdf, not {path.suffix!r}")
    buffer = BytesIO()
    with rc_context(RC):
        stamp = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(ending, {})
        figure.savefig(buffer, format=ending, metadata=stamp)
    picture = buffer.getvalue()
    if ending == "svg":
        picture = _named_clips(picture)
    return written_whole(path, lambda file: file.write(picture))


def _named_clips(svg: bytes) -> bytes:
    """Return an SVG with its clips numbered, so that the same trace gives the same file.

    matplotlib names them by a hash of their corners, which the layout finds to 13 digits only.
    """
    names: dict[bytes, bytes] = {}

    def name(match: re.Match[bytes]) -> bytes:
        return names.setdefault(match[0], b"clip%d" % len(names))

    return re.sub(rb'(?<=[#"])p[0-9a-f]{10}(?=[")])', name, svg)


def figure_3(
    chart: Trace,
    ifelse: Trace,
    lugre: Trace,
    force: NDArray[np.float64],
    *,
    title: str,
    phases: Sequence[tuple[str, float]] = FIG3_PHASES,
    limit: float | None = None,
    window: Window | None = None,
) -> Figure:
    """Draw Fig. 3: the applied force, and F against x by chart, if-else and LuGre.

    Parameters
    ----------
    chart, ifelse, lugre : Trace
        The three runs.
    force : ndarray, shape (rows,), N
        Applied force at the chart run's rows.
    title : str
        Of the figure.
    phases : sequence of (str, float)
        Names and end times [s] of the parts of the experiment.
    limit : float, optional
        Where the axis of F ends [N]; a higher peak is written beside it.
    window : (float, float), optional
        From when to when, s.

    Returns
    -------
    Figure
        Panels a to d.

    Raises
    ------
    ParameterError
        If there is not one force a row, or the window is not a part of the runs.
    """
    if np.shape(force) != chart.t.shape:
        raise ParameterError(
            f"force has shape {np.shape(force)}; it must have one value a row of the chart run, "
            f"shape {chart.t.shape}"
        )
    with rc_context(RC):
        figure = Figure(figsize=(9.0, 6.2), layout="constrained")
        axes = figure.subplots(2, 2).ravel()
        axes[0].plot(chart.t, force, color=INK, linewidth=0.9)
        axes[0].set_xlim(*panels.checked_window(chart, window))
        axes[0].set(xlabel="t [s]", ylabel=r"$F_a$ [N]", title="a) applied force (chosen by us)")
        for ax, trace, name in zip(
            axes[1:],
            (chart, ifelse, lugre),
            (f"b) {chart.model.title}; chart", "c) the same; if-else", "d) LuGre"),
            strict=True,
        ):
            panels.hysteresis(ax, trace, phases, window=window)
            ax.set_title(name)
            peak = int(trace.F.argmax())
            x_peak = panels.scaled(trace.x, "m")[0] * (trace.x[peak] - trace.x[0])
            if limit is not None and trace.F[peak] > limit:
                ax.set_ylim(min(0.0, trace.F.min()) - 0.03 * limit, limit)
                ax.annotate(
                    f"peak {trace.F[peak]:.2f} N\nat t = {trace.t[peak]:.3f} s",
                    (x_peak, limit),
                    (-8, -4),
                    textcoords="offset points",
                    ha="right",
                    va="top",
                    color=TEXT_GREY,
                    fontsize=8,
                )
        if len(phases) > 1:
            axes[1].legend(loc="upper left")
        figure.suptitle(title, x=0.01, ha="left")
    return figure


def figure_4(
    chart: Trace,
    ifelse: Trace,
    lugre: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Figure:
    """Draw Fig. 4: velocity, deflections and forces by chart, if-else and LuGre.

    Parameters
    ----------
    chart, ifelse, lugre : Trace
        The three runs.
    window : (float, float), optional
        From when to when, s.
    elements : sequence of int, optional
        Whose deflections, counted from 0; all when left out.

    Returns
    -------
    Figure
        Panels a to f.
    """
    chart, ifelse, lugre = (shown(trace, window) for trace in (chart, ifelse, lugre))
    with rc_context(RC):
        figure = Figure(figsize=(10.5, 6.2), layout="constrained")
        axes = figure.subplots(2, 3, sharex=True).ravel()
        panels.velocity(axes[0], chart)
        axes[0].set_title("a) velocity (chosen by us)")
        panels.deflections(axes[1], chart, elements=elements)
        axes[1].set_title("b) deflections, GMS")
        _element_legend(figure, axes[1])
        panels.deflections(axes[2], lugre)
        axes[2].set_title("c) deflection, LuGre")
        for ax, trace, title in zip(
            axes[3:],
            (chart, ifelse, lugre),
            ("d) friction, chart", "e) friction, if-else", "f) friction, LuGre"),
            strict=True,
        ):
            panels.force(ax, trace)
            ax.set_title(title)
        for ax in axes[:3]:
            ax.set_xlabel("")
        figure.suptitle(f"Fig. 4, stick-slip: {chart.model.title}", x=0.01, ha="left")
    return figure


def compare_laws(
    runs: Mapping[str, Trace],
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Figure:
    """Draw runs side by side, one column each: deflections, friction, states.

    Parameters
    ----------
    runs : mapping of str to Trace
        Column titles and runs.
    window : (float, float), optional
        From when to when, s.
    elements : sequence of int, optional
        Which elements, counted from 0; all when left out.

    Returns
    -------
    Figure
        Three rows.
    """
    with rc_context(RC):
        figure = Figure(figsize=(5.2 * len(runs), 7.2), layout="constrained")
        grid = figure.subplots(
            3, len(runs), sharex=True, sharey="row", squeeze=False, height_ratios=(1.2, 1.2, 0.8)
        )
        for column, (title, run) in zip(grid.T, runs.items(), strict=True):
            trace = shown(run, window)
            panels.deflections(column[0], trace, elements=elements)
            panels.force(column[1], trace)
            panels.ribbons(column[2], trace, elements=elements)
            for sign in (1, -1) if panels.has_threshold(trace) else ():
                column[0].axhline(sign * trace.s.min(), color=LINE_GREY, linewidth=0.7, zorder=0)
            column[0].set_title(title)
            for ax in column[:2]:
                ax.set_xlabel("")
        if any(panels.has_threshold(run) for run in runs.values()):
            grid[0, 0].annotate(
                "grey lines: ± s(v) away from reversals",
                (0.02, 0.04),
                xycoords="axes fraction",
                color=TEXT_GREY,
                fontsize=8,
            )
        handles, labels = (
            a + b
            for a, b in zip(
                grid[0, 0].get_legend_handles_labels(),
                grid[2, 0].get_legend_handles_labels(),
                strict=True,
            )
        )
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


@dataclass(frozen=True, eq=False)
class Measured:
    """A measured friction beside a run.

    Parameters
    ----------
    t, x, F : ndarray, shape (m,)
        s, m, N.

    Raises
    ------
    ParameterError
        If they are not equally long flat lists, or times go backward.
    """

    t: NDArray[np.float64]
    x: NDArray[np.float64]
    F: NDArray[np.float64]

    def __post_init__(self) -> None:
        shapes = [np.shape(values) for values in (self.t, self.x, self.F)]
        if len(shapes[0]) != 1 or len(set(shapes)) > 1 or shapes[0] == (0,):
            raise ParameterError(
                f"t, x and F of a measurement have the shapes {shapes}; they must be equally long "
                "flat lists, not empty"
            )
        if not (np.diff(self.t) >= 0).all():
            raise ParameterError("t of a measurement goes backward; times must grow")


def overview(
    trace: Trace,
    measured: Measured | None = None,
    *,
    title: str = "",
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Figure:
    """Draw a run at a glance: motion, force, states, hysteresis, friction against velocity.

    Parameters
    ----------
    trace : Trace
        The run.
    measured : Measured, optional
        Drawn beside the model.
    title : str
        Of the figure; the model and its law are added.
    window : (float, float), optional
        From when to when, s. When left out: on the right the whole run, on the left the last three
        cycles of a long one.
    elements : sequence of int, optional
        Whose states, counted from 0; all when left out.

    Returns
    -------
    Figure
        On the left over time, on the right F against x and v.
    """
    check_trace(trace)
    begin, end = _last_cycles(trace) if window is None else panels.checked_window(trace, window)
    whole = window is None and begin == trace.t[0]
    part = shown(trace, window)
    left_part = part if whole or window is not None else shown(trace, (begin, end))
    with rc_context(RC):
        figure = Figure(figsize=(11.0, 6.6), layout="constrained")
        grid = figure.add_gridspec(1, 2, width_ratios=(1.5, 1))
        left, right = (figure.add_subfigure(grid[0, column]) for column in (0, 1))
        time = left.subplots(3, 1, sharex=True)
        loop, portrait = right.subplots(2, 1)
        panels.velocity(time[0], left_part, window=(begin, end))
        panels.force(time[1], left_part, window=(begin, end))
        panels.ribbons(time[2], left_part, window=(begin, end), elements=elements)
        panels.hysteresis(loop, trace, window=window)
        panels.portrait(portrait, part, elements=elements)
        if measured is not None:
            _add_measured(time[1], loop, measured, trace, (begin, end))
        if trace.model.chart.transitions:
            _legend_above(time[2])
        for ax in time[:2]:
            ax.set_xlabel("")
        note = "" if whole or window is not None else f", last {end - begin:.3g} s"
        for ax, name in zip(time, ("velocity", "friction", "active states"), strict=True):
            ax.set_title(name + note)
        loop.set_title("hysteresis")
        portrait.set_title("friction against velocity")
        figure.suptitle(_head(trace, title), x=0.01, ha="left")
    return figure


def _add_measured(ax: Axes, loop: Axes, measured: Measured, trace: Trace, window: Window) -> None:
    """Draw the measured friction over time and over x."""
    inside = (measured.t >= window[0]) & (measured.t <= window[1])
    ax.lines[0].set(color=BLUE, label="model", zorder=3)
    ax.plot(
        measured.t[inside],
        measured.F[inside],
        color=VERMILION,
        linewidth=1.0,
        label="measured",
        rasterized=bool(inside.sum() > panels.VECTOR_ROWS),
    )
    _legend_above(ax)
    factor, _ = panels.scaled(trace.x - trace.x[0], "m")
    loop.lines[0].set(linewidth=0.9, zorder=3, rasterized=True)
    loop.plot(
        factor * (measured.x - trace.x[0]),
        measured.F,
        color=VERMILION,
        linewidth=0.5,
        alpha=0.7,
        rasterized=True,
    )


def _head(trace: Trace, title: str) -> str:
    return f"{title}: {trace.model.title}" if title else trace.model.title


def _legend_above(ax: Axes) -> None:
    """Put the legend beside the title, where no curve is."""
    ax.legend(
        loc="lower right",
        bbox_to_anchor=(1, 1),
        ncols=6,
        borderaxespad=0.1,
        columnspacing=1.2,
        handlelength=2.2,
        handletextpad=0.5,
    )


def _last_cycles(trace: Trace) -> Window:
    """Return what of the time is shown: all of a short run, the last three cycles of a long one."""
    quiet = 0.05 * np.nanmax(np.abs(trace.v))
    signs = np.sign(trace.v) * (np.abs(trace.v) > quiet)
    moving = np.flatnonzero(signs)
    turns = moving[1:][np.diff(signs[moving]) != 0]
    begin = trace.t[0] if turns.size <= 12 else trace.t[turns[-7]]
    return float(begin), float(trace.t[-1])


def ribbons_figure(
    trace: Trace,
    around: float | None = None,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    within: float = panels.CASCADE,
    title: str = "",
) -> Figure:
    """Draw what a run does, why, and in which order: ribbons, a cascade, portraits.

    Parameters
    ----------
    trace : Trace
        The run.
    around : float, optional
        Which break-away the middle column zooms at, s; see `plots.panels.cascade_window`.
    window : (float, float), optional
        Of the left and right columns, s. When left out the whole run; where its states would be too
        many to read, the last three cycles on the left.
    elements : sequence of int, optional
        Which elements, counted from 0; all when left out.
    within : float
        How near to each other break-aways make one cascade, s.
    title : str
        Of the figure; the model and its law are added.

    Returns
    -------
    Figure
        Left: v, z / s, F and states over time. Middle: the zoom (left out if nothing ever breaks
        away and `around` is not given). Right: F against v and x.
    """
    limits = panels.checked_window(trace, window)
    crowded = window is None and len(trace.transitions) > MOST_SPANS * trace.n
    if crowded:
        limits = _last_cycles(trace)
    part = shown(trace, limits)
    # Rather a cascade that the left column shows too.
    zoom = panels.cascade_window(part if around is None else trace, around, within=within)
    if zoom is None and window is None:
        zoom = panels.cascade_window(trace, around, within=within)
    with rc_context(RC):
        figure = Figure(figsize=(13.2 if zoom else 9.6, 9.2), layout="constrained")
        halves = figure.add_gridspec(1, 2, width_ratios=(2.1, 1) if zoom else (1.3, 1))
        parts = [figure.add_subfigure(halves[0, column]) for column in (0, 1)]
        grid = parts[0].subplots(
            4,
            2 if zoom else 1,
            squeeze=False,
            width_ratios=(1.45, 1) if zoom else None,
            height_ratios=(1, 1.2, 1.2, 1),
        )
        left, right = list(grid[:, 0]), list(parts[1].subplots(2, 1))
        panels.velocity(left[0], part, window=limits)
        panels.ratio(left[1], part, window=limits, elements=elements)
        panels.force(left[2], part, window=limits)
        panels.ribbons(left[3], part, window=limits, elements=elements)
        _one_time_axis(left)
        axes = left + right
        second = "first variable"
        if "s" in trace.model.chart.inputs:
            second = "threshold ratio" if panels.has_threshold(trace) else "deflection over s(v)"
        names = ["velocity", second, "friction", "active states"]
        if limits[0] > trace.t[0] and crowded:
            names = [f"{name}, last {limits[1] - limits[0]:.3g} s" for name in names]
        if zoom:
            middle = list(grid[:, 1])
            _cascade_column(middle, trace, zoom, elements)
            for ax in left:
                ax.axvspan(*zoom, color=PALE_GREY, linewidth=1.0, alpha=0.6, zorder=0)
            axes = left + middle + right
            names += _zoom_names(zoom)
        (lines,) = panels.portrait(right[0], trace, window=window, elements=elements, bar=False)
        panels.hysteresis(right[1], trace, window=window, elements=elements, slipping=True)
        assert isinstance(lines, LineCollection)
        panels.slip_bar(lines, trace, right)
        _letter(axes, [*names, "friction against velocity", "hysteresis"])
        parts[0].align_ylabels(left)
        figure.suptitle(_head(trace, title), x=0.01, ha="left")
        _element_legend(figure, left[1], left[3])
    return figure


def cascade_figure(
    trace: Trace,
    around: float | None = None,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    within: float = panels.CASCADE,
    title: str = "",
) -> Figure:
    """Draw one cascade of break-aways: velocity, margins, the steps of F, the order of slipping.

    Parameters
    ----------
    trace : Trace
        The run.
    around, within : float, optional
        Which break-away, s; see `plots.panels.cascade_window`.
    window : (float, float), optional
        From when to when instead, s.
    elements : sequence of int, optional
        Which elements, counted from 0; all when left out.
    title : str
        Of the figure; the model and its law are added.

    Returns
    -------
    Figure
        Four panels over the same time; over the whole run if nothing ever breaks away.
    """
    zoom = window or panels.cascade_window(trace, around, within=within)
    limits = panels.checked_window(trace, zoom)
    with rc_context(RC):
        figure = Figure(figsize=(6.4, 9.2), layout="constrained")
        axes = list(figure.subplots(4, 1, height_ratios=(1, 1.2, 1.2, 1)))
        _cascade_column(axes, trace, limits, elements)
        names = _zoom_names(limits)
        _letter(axes, names if zoom else ["velocity", "margin", "friction", "active states"])
        figure.suptitle(_head(trace, title), x=0.01, ha="left")
        _element_legend(figure, axes[1], axes[3])
    return figure


def _cascade_column(
    axes: Sequence[Axes], trace: Trace, zoom: Window, elements: Sequence[int] | None
) -> None:
    part = shown(trace, zoom)
    panels.velocity(axes[0], part, window=zoom)
    panels.margins(axes[1], part, window=zoom, elements=elements)
    panels.cascade(axes[2], part, window=zoom, elements=elements)
    panels.ribbons(axes[3], part, window=zoom, elements=elements)
    _one_time_axis(axes)


def _one_time_axis(column: Sequence[Axes]) -> None:
    """Let the lowest panel of a column tell the time for all."""
    for ax in column[:-1]:
        ax.set_xlabel("")
        ax.tick_params(labelbottom=False)


def _zoom_names(zoom: Window) -> list[str]:
    middle, width = (zoom[0] + zoom[1]) / 2, zoom[1] - zoom[0]
    factor, unit = panels.scaled(np.array([width]), "s")
    return [
        f"velocity, {factor * width:.3g} {unit} at t = {middle:.5g} s",
        "margin to the threshold",
        "steps of F (open: before, full: after)",
        "order of slipping",
    ]


def _letter(axes: Sequence[Axes], names: Sequence[str]) -> None:
    for number, (ax, name) in enumerate(zip(axes, names, strict=True)):
        # Above the labels of the marks, where there are any.
        ax.set_title(f"{chr(ord('a') + number)}) {name}", pad=16 if ax.texts else 6)


def _element_legend(figure: Figure, *axes: Axes) -> None:
    """Explain elements and states under the figure, each once."""
    found = [ax.get_legend_handles_labels() for ax in axes]
    entries = {name: handle for pair in found for handle, name in zip(*pair, strict=True)}
    figure.legend(
        list(entries.values()),
        list(entries),
        loc="outside lower left",
        ncols=min(10, len(entries)),
        handlelength=2.6,
    )


def residuals(
    runs: Mapping[str, tuple[NDArray[np.float64], NDArray[np.float64]]],
    title: str,
    *,
    log: bool = True,
) -> Figure:
    """Draw differences of forces over time.

    Parameters
    ----------
    runs : mapping of str to (times, difference)
        Panel titles, times [s] and differences [N].
    title : str
        Of the figure.
    log : bool
        Draw their sizes on a logarithmic axis.

    Returns
    -------
    Figure
        One panel a run.
    """
    with rc_context(RC):
        figure = Figure(figsize=(9.0, 2.4 * len(runs) + 0.4), layout="constrained")
        axes = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
        for ax, (name, (times, difference)) in zip(axes, runs.items(), strict=True):
            panels.difference(ax, times, difference, log=log)
            ax.set_title(name)
        figure.suptitle(title, x=0.01, ha="left")
    return figure
