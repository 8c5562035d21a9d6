"""Panels of a chart with held outputs, compared with the same law evaluated inside the steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from plots.panels.parts.axes import Artists, draw_curve, time_axis
from plots.style import INK, LINE_GREY, REPORTED, TEXT_GREY, compared_look
from plots.style.matplotlib import Axes, LogLocator
from plots.style.presets import pt, to_scale

__all__ = ["lag_between_ticks", "lag_over_period", "lag_over_time"]

MILLI, MICRO = 1e3, 1e6


class HeldLag(Protocol):
    """Differences of two runs at the ticks of one of them; see `gms_fsm.app.paper.held.Lag`."""

    @property
    def period(self) -> float:
        """Sample time, s."""

    @property
    def t(self) -> NDArray[np.float64]:
        """Ticks, s."""

    @property
    def force(self) -> NDArray[np.float64]:
        """Difference of F at the ticks, N."""

    @property
    def before(self) -> NDArray[np.float64]:
        """Difference of F just before the next tick, N."""

    @property
    def place(self) -> NDArray[np.float64]:
        """Difference of x at the ticks, m."""


def lag_over_time(
    ax: Axes,
    lags: Sequence[HeldLag],
    paper: float,
    *,
    window: tuple[float, float],
    place: bool = False,
) -> Artists:
    """Draw the differences at the ticks over time, one line per sample time.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    lags : sequence of HeldLag
        The differences, the longest sample time first.
    paper : float
        Residual that the paper reports, N or m: dashed lines.
    window : (float, float)
        Time interval to show, s.
    place : bool
        Draw x instead of F.

    Returns
    -------
    list of Artist
        One line per sample time.
    """
    factor = MICRO if place else MILLI
    lines: Artists = []
    for number, lag in enumerate(lags):
        shown = (lag.t >= window[0]) & (lag.t <= window[1])
        values = factor * (lag.place if place else lag.force)[shown]
        name = f"$h$ = {MILLI * lag.period:g} ms"
        lines += draw_curve(ax, lag.t[shown], values, label=name, **to_scale(compared_look(number)))
    for sign in (1, -1):
        ax.axhline(sign * factor * paper, **to_scale(REPORTED))
    time_axis(ax, *window)
    ax.set_ylabel("difference of $x$ [µm]" if place else "difference of $F$ [mN]")
    return lines


def lag_between_ticks(
    ax: Axes, lags: Sequence[HeldLag], paper: float, *, window: tuple[float, float]
) -> Artists:
    """Draw the difference of F within a few sample times: held, it falls behind until a tick.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    lags : sequence of HeldLag
        The differences, the longest sample time first.
    paper : float
        Residual that the paper reports, N.
    window : (float, float)
        Time interval to show, s.

    Returns
    -------
    list of Artist
        One line per sample time.
    """
    lines: Artists = []
    for number, lag in enumerate(lags):
        shown = (lag.t > window[0] - lag.period) & (lag.t < window[1])
        begin = lag.t[shown]
        t = np.column_stack([begin, begin + lag.period]).ravel()
        both = np.column_stack([lag.force[shown], lag.before[shown]]).ravel()
        lines += ax.plot(MILLI * (t - window[0]), MILLI * both, **to_scale(compared_look(number)))
        ink = compared_look(number)["color"]
        ax.plot(MILLI * (begin - window[0]), MILLI * lag.force[shown], "o", color=ink, ms=pt(4))
    for sign in (1, -1):
        ax.axhline(sign * MILLI * paper, **to_scale(REPORTED))
    ax.set(
        xlabel=f"time after $t$ = {window[0]:g} s [ms]",
        ylabel="difference of $F$ [mN]",
        xlim=(0, MILLI * (window[1] - window[0])),
    )
    return lines


def lag_over_period(
    ax: Axes,
    lags: Sequence[HeldLag],
    papers: tuple[float, float],
    *,
    phases: Mapping[str, tuple[float, float]],
) -> Artists:
    """Draw the largest differences at the ticks over the sample time, as multiples of the paper's.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    lags : sequence of HeldLag
        The differences.
    papers : (float, float)
        Residuals that the paper reports, N and m.
    phases : mapping of str to (float, float)
        Names and time intervals [s] in which the largest difference is taken.

    Returns
    -------
    list of Artist
        One set of marks for F and one for x per phase.
    """
    periods = MILLI * np.array([lag.period for lag in lags])
    marks: Artists = []
    found: list[float] = []
    for (name, (begin, end)), fill in zip(phases.items(), ("full", "none"), strict=False):
        for quantity, marker in enumerate("os"):
            sizes = []
            for lag in lags:
                inside = (lag.t >= begin) & (lag.t < end)
                values = (lag.force, lag.place)[quantity]
                sizes.append(float(np.abs(values[inside]).max()) / papers[quantity])
            found += [size for size in sizes if size > 0]
            line = sizes[0] * periods / periods[0]  # a slope of exactly one
            ax.plot(periods, line, color=LINE_GREY, linewidth=pt(0.9), zorder=1)
            marks += ax.plot(
                periods,
                sizes,
                marker,
                color=(INK, TEXT_GREY)[quantity],
                fillstyle=fill,
                markersize=pt(6),
                label=f"${'Fx'[quantity]}$, {name}",
            )
    ax.axhline(1.0, **to_scale(REPORTED))
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="sample time $h$ [ms]",
        ylabel="largest / the paper's [–]",
    )
    ax.set_ylim(0.7 * min([0.9, *found]), 1.5 * max([13.0, *found]))
    ax.set_xticks(periods, [f"{period:g}" for period in periods])
    ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.minorticks_off()
    return marks
