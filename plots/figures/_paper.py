"""Figures of several runs: the paper's Fig. 3 and 4, comparison of laws, differences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.traces.trace import Trace
from plots import panels
from plots._matplotlib import Figure, rc_context
from plots._window import Window
from plots.figures._layout import fitted, legend_below, narrow, sheet
from plots.figures._parts import element_legend
from plots.panels._held import Lag
from plots.panels._shown import checked_window, scaled, shown
from plots.presets import font, pt, settings
from plots.style import INK, LINE_GREY, REPORTED, TEXT_GREY

__all__ = [
    "FIG3_PHASES",
    "compare_laws",
    "figure_3",
    "figure_4",
    "held_residuals",
    "residuals",
]

FIG3_PHASES = (("rising", 2.0), ("falling", 4.0), ("oscillating", np.inf))


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
    """Draw Fig. 3: the applied force, and F against x for chart, if-else and LuGre.

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
        Upper end of the F axis [N]; a higher peak is given as text.
    window : (float, float), optional
        Time interval to show, s.

    Returns
    -------
    Figure
        Panels a to d.

    Raises
    ------
    ParameterError
        If there is not one force per row, or the window is not within the runs.
    """
    if np.shape(force) != chart.t.shape:
        raise ParameterError(
            f"force has shape {np.shape(force)}",
            advice=f"it must have one value per row of the chart run, shape {chart.t.shape}",
        )
    with rc_context(settings()):
        figure = sheet(4.2, 8.8) if narrow() else sheet(9.0, 6.2)
        axes = figure.subplots(*(4, 1) if narrow() else (2, 2)).ravel()
        axes[0].plot(chart.t, force, color=INK, linewidth=pt(0.9))
        axes[0].set_xlim(*checked_window(chart, window))
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
            x_peak = scaled(trace.x, "m")[0] * (trace.x[peak] - trace.x[0])
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
                    fontsize=font(8),
                )
        if len(phases) > 1:
            axes[1].legend(loc="upper left")
        figure.suptitle(title, x=0.01, ha="left")
    return fitted(figure)


def figure_4(
    chart: Trace,
    ifelse: Trace,
    lugre: Trace,
    *,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
) -> Figure:
    """Draw Fig. 4: velocity, deflections and forces for chart, if-else and LuGre.

    Parameters
    ----------
    chart, ifelse, lugre : Trace
        The three runs.
    window : (float, float), optional
        Time interval to show, s.
    elements : sequence of int, optional
        Elements whose deflections are shown, counted from 0; by default all.

    Returns
    -------
    Figure
        Panels a to f.
    """
    chart, ifelse, lugre = (shown(trace, window) for trace in (chart, ifelse, lugre))
    with rc_context(settings()):
        figure = sheet(4.2, 10.0) if narrow() else sheet(10.5, 6.2)
        axes = figure.subplots(*(6, 1) if narrow() else (2, 3), sharex=True).ravel()
        panels.velocity(axes[0], chart)
        axes[0].set_title("a) velocity (chosen by us)")
        panels.deflections(axes[1], chart, elements=elements)
        axes[1].set_title("b) deflections, GMS")
        element_legend(figure, axes[1])
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
        for ax in axes[: 5 if narrow() else 3]:
            ax.set_xlabel("")
        figure.suptitle(f"Fig. 4, stick-slip: {chart.model.title}", x=0.01, ha="left")
    return fitted(figure)


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
        Time interval to show, s.
    elements : sequence of int, optional
        Which elements, counted from 0; by default all.

    Returns
    -------
    Figure
        Three rows.
    """
    with rc_context(settings()):
        figure = sheet(5.2 * len(runs), 7.2)
        grid = figure.subplots(
            3, len(runs), sharex=True, sharey="row", squeeze=False, height_ratios=(1.2, 1.2, 0.8)
        )
        for column, (title, run) in zip(grid.T, runs.items(), strict=True):
            trace = shown(run, window)
            panels.deflections(column[0], trace, elements=elements)
            panels.force(column[1], trace)
            panels.ribbons(column[2], trace, elements=elements)
            for sign in (1, -1) if panels.has_threshold(trace) else ():
                column[0].axhline(
                    sign * trace.s.min(), color=LINE_GREY, linewidth=pt(0.7), zorder=0
                )
            column[0].set_title(title)
            for ax in column[:2]:
                ax.set_xlabel("")
        if any(panels.has_threshold(run) for run in runs.values()):
            grid[0, 0].annotate(
                "grey lines: ± s(v) away from reversals",
                (0.02, 0.04),
                xycoords="axes fraction",
                color=TEXT_GREY,
                fontsize=font(8),
            )
        handles, labels = (
            a + b
            for a, b in zip(
                grid[0, 0].get_legend_handles_labels(),
                grid[2, 0].get_legend_handles_labels(),
                strict=True,
            )
        )
        legend_below(figure, handles, labels)
    return fitted(figure)


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
        Draw their magnitudes on a logarithmic axis.

    Returns
    -------
    Figure
        One panel per run.
    """
    with rc_context(settings()):
        figure = sheet(9.0, 2.4 * len(runs) + 0.4)
        axes = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
        for ax, (name, (times, difference)) in zip(axes, runs.items(), strict=True):
            panels.difference(ax, times, difference, log=log)
            ax.set_title(name)
        figure.suptitle(title, x=0.01, ha="left")
    return fitted(figure)


def held_residuals(
    lags: Sequence[Lag],
    papers: tuple[float, float],
    *,
    title: str,
    phases: Mapping[str, tuple[float, float]],
    until: float = 6.0,
    zoom: float = 1.5,
) -> Figure:
    """Draw how a chart with held outputs differs from the law evaluated inside the steps.

    Parameters
    ----------
    lags : sequence of Lag
        Differences for at most three sample times, the longest first.
    papers : (float, float)
        Residuals that the paper reports, N and m.
    title : str
        Of the figure.
    phases : mapping of str to (float, float)
        Names and time intervals [s], at most two, in which the largest difference is taken.
    until : float
        s: end of the time shown in a and b.
    zoom : float
        s: begin of the time shown in c, which lasts two of the longest sample times.

    Returns
    -------
    Figure
        Panels a to d.
    """
    with rc_context(settings()):
        figure = sheet(4.2, 9.2) if narrow() else sheet(9.0, 6.2)
        force, place, between, period = figure.subplots(*(4, 1) if narrow() else (2, 2)).ravel()
        lines = panels.lag_over_time(force, lags, papers[0], window=(0.0, until))
        panels.lag_over_time(place, lags, papers[1], window=(0.0, until), place=True)
        panels.lag_between_ticks(between, lags, window=(zoom, zoom + 2 * lags[0].period))
        panels.lag_over_period(period, lags, papers, phases=phases)
        force.set_title("a) friction, at the ticks")
        place.set_title("b) position, at the ticks")
        between.set_title("c) friction; dots: at the ticks")
        period.set_title("d) largest at the ticks; lines: proportional to h")
        period.legend(loc="upper left", ncols=2)
        (paper,) = force.plot([], [], **REPORTED)
        figure.legend(
            [*lines, paper],
            [*(str(line.get_label()) for line in lines), "the paper's residual"],
            loc="outside lower left",
            ncols=4,
        )
        figure.suptitle(title, x=0.01, ha="left")
    return fitted(figure)
