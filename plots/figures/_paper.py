"""Figures of several runs: the paper's Fig. 3 and 4, comparison of laws, differences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError
from gms_fsm.traces.trace import Trace
from plots import panels
from plots.figures._layout import fitted, legend_below, low, narrow, sheet
from plots.figures._parts import element_legend, lanes_height, letter_panels
from plots.panels.held_outputs import HeldLag
from plots.panels.parts.axes import MANY, beside, first_variable
from plots.panels.parts.selection import scaled
from plots.style import INK, LINE_GREY, REPORTED, TEXT_GREY
from plots.style.matplotlib import Axes, Figure, rc_context
from plots.style.presets import font, pt, settings, to_scale

Floats = NDArray[np.float64]
REACHED = "$±s(v)$ away from reversals"
INSET = (0.48, 0.81, 0.51, 0.18)  # of a panel: left, bottom, width, height
ALIKE = 0.01  # of the largest deflection: curves that are closer look like one
HELD_UNTIL, HELD_ZOOM = 6.0, 1.5  # s: end of what is shown, and where it is seen closer
ZOOM = 0.012  # half of the time of an inset, of the whole time
FIG3_PHASES = (("$F_a$ rises", 2.0), ("$F_a$ falls", 4.0), ("$F_a$ oscillates", np.inf))


def figure_3(
    chart: Trace,
    ifelse: Trace,
    lugre: Trace,
    force: NDArray[np.float64],
    *,
    title: str,
    phases: Sequence[tuple[str, float]] = FIG3_PHASES,
    limit: float | None = None,
    reason: str = "",
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
    reason : str
        Why there is such a peak, added to this text.

    Returns
    -------
    Figure
        Panels a to d; b to d have the same axes.

    Raises
    ------
    ParameterError
        If there is not one force per row.
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
        axes[0].set_xlim(chart.t[0], chart.t[-1])
        axes[0].set(xlabel="$t$ [s]", ylabel=r"$F_a$ [N]")
        runs = chart, ifelse, lugre
        # Drift is compared: one unit and the same axes.
        scale = scaled(np.concatenate([trace.x - trace.x[0] for trace in runs]), "m")
        for ax, trace in zip(axes[1:], runs, strict=True):
            panels.hysteresis(ax, trace, phases, scale=scale)
            ax.sharex(axes[1])
            ax.sharey(axes[1])
            ax.margins(x=0.08)  # the last mark is not at the end
            peak = int(trace.F.argmax())
            x_peak = scale[0] * (trace.x[peak] - trace.x[0])
            if limit is not None and trace.F[peak] > limit:
                ax.set_ylim(min(0.0, trace.F.min()) - 0.03 * limit, limit)
                said = f"peak {trace.F[peak]:.2f} N at $t$ = {trace.t[peak]:.3f} s\n{reason}"
                beside(ax, said, (x_peak, limit), (-8, -4), ha="right", va="top", color=TEXT_GREY)
        names = ["applied force (chosen by us)", f"{chart.model.title}; chart"]
        letter_panels(axes, [*names, "the same from if-else code", "LuGre"])
        if len(phases) > 1:
            legend_below(figure, *axes[1].get_legend_handles_labels())
        figure.suptitle(title, x=0.01, ha="left")
    return fitted(figure)


def figure_4(chart: Trace, ifelse: Trace, lugre: Trace) -> Figure:
    """Draw Fig. 4: velocity, deflections and forces for chart, if-else and LuGre.

    Parameters
    ----------
    chart, ifelse, lugre : Trace
        The three runs.

    Returns
    -------
    Figure
        Panels a to f. Insets show the first peak of F, except on a slide.
    """
    with rc_context(settings()):
        figure = sheet(4.2, 10.0) if narrow() else sheet(10.5, 6.2)
        axes = figure.subplots(*(6, 1) if narrow() else (2, 3), sharex=True).ravel()
        panels.velocity(axes[0], chart)
        panels.deflections(axes[1], chart)
        element_legend(figure, axes[1])
        panels.deflections(axes[2], lugre)
        for ax, trace in zip(axes[3:], (chart, ifelse, lugre), strict=True):
            panels.force(ax, trace)
            _make_room(ax)
            _zoom(ax, trace)
        names = ["velocity (chosen by us)", "deflections, GMS", "deflection, LuGre"]
        kinds = ("chart", "if-else", "LuGre")
        letter_panels(axes, [*names, *(f"friction, {kind}" for kind in kinds)])
        for ax in axes[: 5 if narrow() else 3]:
            ax.set_xlabel("")
        figure.suptitle(f"Fig. 4, stick-slip: {chart.model.title}", x=0.01, ha="left")
    return fitted(figure)


def _common_scale(*runs: Trace) -> tuple[float, str] | None:
    """Return factor and title of the deflections of all runs; None if a chart has none.

    The unit suits their geometric mean: deflections of runs may differ by orders of magnitude.
    """
    if not all(trace.model.chart.variables for trace in runs):
        return None
    largest = np.array([np.nanmax(np.abs(trace.z), initial=0.0) for trace in runs])
    middle = np.exp(np.log(largest).mean(keepdims=True)) if largest.all() else largest
    return first_variable(runs[0], middle)


def _first_peak(trace: Trace) -> int:
    """Return the row of the largest force up to the first reversal."""
    back = np.flatnonzero(trace.v < 0)
    last = int(back[0]) + 1 if back.size and back[0] > 0 else len(trace)
    return int(np.nanargmax(np.abs(trace.F[:last])))


def _zoom(ax: Axes, trace: Trace) -> None:
    """Show the first peak of a force in an inset."""
    if low():
        return
    peak, values = _first_peak(trace), trace.F
    half = ZOOM * float(trace.t[-1] - trace.t[0])
    t0, t1 = max(trace.t[0], trace.t[peak] - half), min(trace.t[-1], trace.t[peak] + half)
    near = values[(trace.t >= t0) & (trace.t <= t1)]
    high = float(near.max())
    # A fall that is much larger than the rise to the peak leaves the inset.
    bottom = max(float(near.min()), high - 3 * float(high - near[0]))
    edge = 0.1 * (high - bottom) or 1.0
    inset = ax.inset_axes(INSET)
    inset.plot(trace.t, values, color=ax.lines[0].get_color(), linewidth=pt(1.0))
    inset.set(xlim=(t0, t1), ylim=(bottom - edge, high + edge))
    inset.tick_params(labelsize=font(7), length=2)
    inset.locator_params(axis="x", nbins=3, prune="both")
    ticks = 1 if narrow() else 2
    inset.locator_params(axis="y", nbins=ticks, min_n_ticks=ticks)
    at = (0.02, INSET[1] + INSET[3] / 2)
    look: dict[str, Any] = {"va": "center", "fontsize": font(7), "color": TEXT_GREY}
    ax.text(*at, "first\npeak", transform=ax.transAxes, **look)
    inset.spines[:].set(visible=True, color=LINE_GREY)
    bounds = (t0, bottom - edge, t1 - t0, high - bottom + 2 * edge)
    frame = ax.indicate_inset(bounds, inset, edgecolor=LINE_GREY, alpha=1.0)
    for line in frame.connectors or ():
        line.set_visible(False)


def _make_room(ax: Axes) -> None:
    """Leave the upper part of a panel free for an inset; the axis of F ends below it."""
    bottom, top = ax.get_ylim()
    ax.set_yticks([tick for tick in ax.get_yticks() if bottom <= tick <= top])
    ax.set_ylim(bottom, bottom + (top - bottom) / 0.74)


def compare_laws(runs: Mapping[str, Trace]) -> Figure:
    """Draw runs side by side, one column each: deflections, friction, states.

    Parameters
    ----------
    runs : mapping of str to Trace
        Column titles and runs.

    Returns
    -------
    Figure
        Three rows.
    """
    with rc_context(settings()):
        count = max(run.n for run in runs.values())
        tall = lanes_height(count, 2.1) if count > MANY else 2.1, 2.1, lanes_height(count, 1.4)
        figure = sheet(5.2 * len(runs), sum(tall) + 1.6)
        grid = figure.subplots(
            3, len(runs), sharex=True, sharey="row", squeeze=False, height_ratios=tall
        )
        scale = _common_scale(*runs.values())
        for column, trace in zip(grid.T, runs.values(), strict=True):
            many = count > MANY and all(map(panels.has_threshold, runs.values()))
            if many:
                panels.heat(column[0], trace)
            else:
                panels.deflections(column[0], trace, scale=scale)
            panels.force(column[1], trace)
            panels.ribbons(column[2], trace)
            for sign in (1, -1) if panels.has_threshold(trace) and not many else ():
                level = sign * float(np.nanmin(trace.s)) * (scale[0] if scale else 1.0)
                column[0].axhline(
                    level, color=LINE_GREY, linewidth=pt(0.9), zorder=0, label=REACHED
                )
            if not many:
                _coinciding(column[0], trace)
            for ax in column[:2]:
                ax.set_xlabel("")
        letter_panels(grid[0], list(runs))
        element_legend(figure, grid[0, 0], grid[2, 0])
    return fitted(figure)


def _coinciding(ax: Axes, trace: Trace) -> None:
    """Say so, if the deflections of all elements cannot be told apart."""
    if trace.n < 2 or not trace.model.chart.variables:
        return
    if np.nanmax(np.ptp(trace.z, axis=1)) < ALIKE * np.nanmax(np.abs(trace.z)):
        said = f"$z_{{1}}$ to $z_{{{trace.n}}}$ coincide"
        look: dict[str, Any] = {"ha": "right", "va": "bottom", "color": TEXT_GREY}
        ax.text(0.98, 0.04, said, transform=ax.transAxes, **look)


def residuals(
    runs: Mapping[str, tuple[NDArray[np.float64], NDArray[np.float64]]], title: str
) -> Figure:
    """Draw differences of forces over time.

    Parameters
    ----------
    runs : mapping of str to (times, difference)
        Panel titles, times [s] and differences [N].
    title : str
        Of the figure.

    Returns
    -------
    Figure
        One panel per run.
    """
    with rc_context(settings()):
        figure = sheet(9.0, 2.4 * len(runs) + 0.4)
        axes = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
        for ax, (times, difference) in zip(axes, runs.values(), strict=True):
            panels.difference(ax, times, difference)
        letter_panels(list(axes), list(runs))
        element_legend(figure, *axes)
        figure.suptitle(title, x=0.01, ha="left")
    return fitted(figure)


def held_residuals(
    lags: Sequence[HeldLag],
    papers: tuple[float, float],
    *,
    title: str,
    phases: Mapping[str, tuple[float, float]],
) -> Figure:
    """Draw how a chart with held outputs differs from the law evaluated inside the steps.

    Parameters
    ----------
    lags : sequence of HeldLag
        Differences for at most three sample times, the longest first.
    papers : (float, float)
        Residuals that the paper reports, N and m.
    title : str
        Of the figure.
    phases : mapping of str to (float, float)
        Names and time intervals [s], at most two, in which the largest difference is taken.

    Returns
    -------
    Figure
        Panels a to d; c lasts two of the longest sample times.
    """
    with rc_context(settings()):
        figure = sheet(4.2, 9.2) if narrow() else sheet(9.0, 6.2)
        force, place, between, period = figure.subplots(*(4, 1) if narrow() else (2, 2)).ravel()
        lines = panels.lag_over_time(force, lags, papers[0], window=(0.0, HELD_UNTIL))
        panels.lag_over_time(place, lags, papers[1], window=(0.0, HELD_UNTIL), place=True)
        closer = HELD_ZOOM, HELD_ZOOM + 2 * lags[0].period
        panels.lag_between_ticks(between, lags, papers[0], window=closer)
        panels.lag_over_period(period, lags, papers, phases=phases)
        letter_panels(
            [force, place, between, period],
            [
                "friction, at the ticks",
                "position, at the ticks",
                "friction; dots: at the ticks",
                "largest at the ticks; lines: proportional to $h$",
            ],
        )
        period.legend(loc="upper left", ncols=2)
        (paper,) = force.plot([], [], **to_scale(REPORTED))
        entries = [*(str(line.get_label()) for line in lines), "the paper's residual"]
        legend_below(figure, [*lines, paper], entries)
        figure.suptitle(title, x=0.01, ha="left")
    return fitted(figure)
