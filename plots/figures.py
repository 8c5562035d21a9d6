"""Composite figures of the paper's two experiments.

Figures are made without pyplot: no global state, no display.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import MissingExtraError
from gms_fsm.files import written_whole
from gms_fsm.trace import Trace
from plots import panels
from plots.style import BLUE, INK, LINE_GREY, RC, TEXT_GREY, VERMILION

try:
    from matplotlib import rc_context
    from matplotlib.figure import Figure
except ImportError:
    raise MissingExtraError(
        'figures need matplotlib; install it with: pip install "gms-fsm[plots]"'
    ) from None

__all__ = ["Measured", "compare_laws", "figure_3", "figure_4", "overview", "residuals", "save"]

SMOOTH = 2000  # points a curve
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
    """
    path = Path(path)
    buffer = BytesIO()
    with rc_context(RC):
        stamp = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(path.suffix[1:], {})
        figure.savefig(buffer, format=path.suffix[1:], metadata=stamp)
    return written_whole(path, lambda file: file.write(buffer.getvalue()))


def figure_3(
    chart: Trace,
    ifelse: Trace,
    lugre: Trace,
    force: NDArray[np.float64],
    *,
    title: str,
    phases: Sequence[tuple[str, float]] = FIG3_PHASES,
    limit: float | None = None,
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

    Returns
    -------
    Figure
        Panels a to d.
    """
    with rc_context(RC):
        figure = Figure(figsize=(9.0, 6.2), layout="constrained")
        axes = figure.subplots(2, 2).ravel()
        axes[0].plot(chart.t, force, color=INK, linewidth=0.9)
        axes[0].set(xlabel="t [s]", ylabel=r"$F_a$ [N]", title="a) applied force (chosen by us)")
        for ax, trace, name in zip(
            axes[1:],
            (chart, ifelse, lugre),
            (f"b) {chart.model.title}; chart", "c) the same; if-else", "d) LuGre"),
            strict=True,
        ):
            panels.hysteresis(ax, trace.refined(SMOOTH), phases)
            ax.set_title(name)
            peak = int(trace.F.argmax())
            x_peak = panels.scaled(trace.x, "m")[0] * (trace.x[peak] - trace.x[0])
            if limit is not None and trace.F[peak] > limit:
                ax.set_ylim(min(0.0, trace.F.min()) - 0.03 * limit, limit)
                ax.annotate(
                    f"peak {trace.F[peak]:.2f} N\nat t = {trace.t[peak]:.3f} s",
                    (x_peak, limit), (-8, -4), textcoords="offset points",
                    ha="right", va="top", color=TEXT_GREY, fontsize=8,
                )  # fmt: skip
        if len(phases) > 1:
            axes[1].legend(loc="upper left")
        figure.suptitle(title, x=0.01, ha="left")
    return figure


def figure_4(chart: Trace, ifelse: Trace, lugre: Trace) -> Figure:
    """Draw Fig. 4: velocity, deflections and forces by chart, if-else and LuGre.

    Parameters
    ----------
    chart, ifelse, lugre : Trace
        The three runs.

    Returns
    -------
    Figure
        Panels a to f.
    """
    chart, ifelse, lugre = (trace.refined(SMOOTH) for trace in (chart, ifelse, lugre))
    with rc_context(RC):
        figure = Figure(figsize=(10.5, 6.2), layout="constrained")
        axes = figure.subplots(2, 3, sharex=True).ravel()
        panels.velocity(axes[0], chart)
        axes[0].set_title("a) velocity (chosen by us)")
        panels.deflections(axes[1], chart)
        axes[1].set_title("b) deflections, GMS")
        axes[1].legend(loc="best", ncols=2)
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
    with rc_context(RC):
        figure = Figure(figsize=(5.2 * len(runs), 7.2), layout="constrained")
        grid = figure.subplots(
            3, len(runs), sharex=True, sharey="row", squeeze=False, height_ratios=(1.2, 1.2, 0.8)
        )
        for column, (title, run) in zip(grid.T, runs.items(), strict=True):
            trace = run.refined(SMOOTH)
            panels.deflections(column[0], trace)
            panels.force(column[1], trace)
            panels.ribbons(column[2], trace)
            for sign in (1, -1):
                column[0].axhline(sign * trace.s.min(), color=LINE_GREY, linewidth=0.7, zorder=0)
            column[0].set_title(title)
            for ax in column[:2]:
                ax.set_xlabel("")
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
    """

    t: NDArray[np.float64]
    x: NDArray[np.float64]
    F: NDArray[np.float64]


def overview(trace: Trace, measured: Measured | None = None, *, title: str = "") -> Figure:
    """Draw a run at a glance: motion, force, states, hysteresis, friction against velocity.

    Parameters
    ----------
    trace : Trace
        The run.
    measured : Measured, optional
        Drawn beside the model.
    title : str
        Of the figure; the model and its law are added.

    Returns
    -------
    Figure
        On the left over time (long records: the last three cycles), on the right F against x and v.
    """
    smooth = trace.refined(SMOOTH)
    begin = _window(smooth)
    with rc_context(RC):
        figure = Figure(figsize=(11.0, 6.6), layout="constrained")
        grid = figure.add_gridspec(1, 2, width_ratios=(1.5, 1))
        left, right = (figure.add_subfigure(grid[0, column]) for column in (0, 1))
        time = left.subplots(3, 1, sharex=True)
        loop, portrait = right.subplots(2, 1)
        panels.velocity(time[0], smooth)
        panels.force(time[1], smooth)
        panels.ribbons(time[2], smooth)
        panels.hysteresis(loop, smooth)
        panels.portrait(portrait, smooth)
        if measured is not None:
            time[1].lines[0].set(color=BLUE, label="model", zorder=3)
            time[1].plot(measured.t, measured.F, color=VERMILION, linewidth=1.0, label="measured")
            time[1].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, borderaxespad=0.1)
            x = measured.x - trace.x[0]
            factor, _ = panels.scaled(trace.x - trace.x[0], "m")
            loop.lines[0].set(linewidth=0.9, zorder=3, rasterized=True)
            loop.plot(
                factor * x, measured.F, color=VERMILION, linewidth=0.5, alpha=0.7, rasterized=True
            )
        if trace.model.chart.transitions:
            time[2].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=5, borderaxespad=0.1)
        time[0].set_xlim(begin, trace.t[-1])
        for ax in time[:2]:
            ax.set_xlabel("")
        part = "" if begin == trace.t[0] else f", last {trace.t[-1] - begin:.3g} s"
        for ax, name in zip(time, ("velocity", "friction", "active states"), strict=True):
            ax.set_title(name + part)
        loop.set_title("hysteresis")
        portrait.set_title("friction against velocity")
        head = f"{title}: {trace.model.title}" if title else trace.model.title
        figure.suptitle(head, x=0.01, ha="left")
    return figure


def _window(trace: Trace) -> float:
    """Return where the time axes begin: all of a short run, the last three cycles of a long one."""
    quiet = 0.05 * np.abs(trace.v).max()
    signs = np.sign(trace.v) * (np.abs(trace.v) > quiet)
    moving = np.flatnonzero(signs)
    turns = moving[1:][np.diff(signs[moving]) != 0]
    if turns.size <= 12:
        return float(trace.t[0])
    return float(trace.t[turns[-7]])


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
        One panel a run.
    """
    with rc_context(RC):
        figure = Figure(figsize=(9.0, 2.4 * len(runs) + 0.4), layout="constrained")
        axes = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
        for ax, (name, (times, difference)) in zip(axes, runs.items(), strict=True):
            panels.residual(ax, times, difference)
            ax.set_title(name)
        figure.suptitle(title, x=0.01, ha="left")
    return figure
