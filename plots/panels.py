"""Single panels: each takes an Axes and a Trace, draws, and returns its artists."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import MissingExtraError
from gms_fsm.trace import Trace
from plots.style import (
    BLUE,
    BLUE_TINT,
    ELEMENT_COLOURS,
    ELEMENT_DASHES,
    HATCHES,
    INK,
    LINE_GREY,
    VERMILION,
    VERMILION_TINT,
)

try:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
except ImportError:
    raise MissingExtraError(
        'figures need matplotlib; install it with: pip install "gms-fsm[plots]"'
    ) from None

__all__ = [
    "deflections",
    "force",
    "hysteresis",
    "portrait",
    "residual",
    "ribbons",
    "velocity",
]

Artists = list[Artist]
SCALES = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"))


def scaled(values: NDArray[np.float64], unit: str) -> tuple[float, str]:
    """Return the factor and the unit in which values read well.

    Parameters
    ----------
    values : ndarray
        In the unit.
    unit : str
        For example ``"m/s"``.

    Returns
    -------
    (float, str)
        Factor and prefixed unit.

    Examples
    --------
    >>> scaled(np.array([0.0, 2e-4]), "m/s")
    (1000.0, 'mm/s')
    """
    finite = np.abs(values[np.isfinite(values)])
    largest = float(finite.max()) if finite.size else 0.0
    for factor, prefix in SCALES:
        if largest * factor >= 0.1 or largest == 0.0:
            return factor, prefix + unit
    return SCALES[-1][0], SCALES[-1][1] + unit


def velocity(ax: Axes, trace: Trace) -> Artists:
    """Draw v(t).

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.

    Returns
    -------
    list of Artist
        The line.
    """
    factor, unit = scaled(trace.v, "m/s")
    ax.set(xlabel="t [s]", ylabel=f"v [{unit}]")
    return list(ax.plot(trace.t, factor * trace.v, color=INK))


def force(ax: Axes, trace: Trace) -> Artists:
    """Draw the friction force F(t); at a transition both one-sided values are drawn.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.

    Returns
    -------
    list of Artist
        The line.
    """
    ax.set(xlabel="t [s]", ylabel="F [N]")
    return list(ax.plot(trace.t, trace.F, color=INK))


def deflections(ax: Axes, trace: Trace) -> Artists:
    """Draw z_i(t) of every element.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.

    Returns
    -------
    list of Artist
        One line an element.
    """
    factor, unit = scaled(trace.z, "m")
    ax.set(xlabel="t [s]", ylabel=f"z [{unit}]")
    lines: Artists = []
    for i in range(trace.n):
        lines += ax.plot(
            trace.t,
            factor * trace.z[:, i],
            color=ELEMENT_COLOURS[i % len(ELEMENT_COLOURS)],
            linestyle=ELEMENT_DASHES[i % len(ELEMENT_DASHES)],
            label=f"$z_{{{i + 1}}}$",
        )
    return lines


def hysteresis(ax: Axes, trace: Trace, phases: Sequence[tuple[str, float]] = ()) -> Artists:
    """Draw F against x, in phases.

    Parameters
    ----------
    ax : Axes
        Where; x is shown from where the run starts.
    trace : Trace
        What.
    phases : sequence of (str, float), optional
        Names and end times [s] of parts drawn in colours of their own; one part when left out.

    Returns
    -------
    list of Artist
        One line a phase.
    """
    x = trace.x - trace.x[0]
    factor, unit = scaled(x, "m")
    ax.set(xlabel=f"x [{unit}]", ylabel="F [N]")
    looks = ((BLUE, "-"), (VERMILION, "-"), (LINE_GREY, "-"))
    begin = -np.inf
    lines: Artists = []
    for number, (name, end) in enumerate(phases or [("", np.inf)]):
        part = (trace.t >= begin) & (trace.t <= end)
        colour, dash = looks[number % len(looks)]
        lines += ax.plot(
            factor * x[part], trace.F[part], color=colour, linestyle=dash, label=name,
            zorder=3 - number % 3, linewidth=1.6 if number < 2 else 0.9,
        )  # fmt: skip
        begin = end
    return lines


def portrait(ax: Axes, trace: Trace) -> Artists:
    """Draw F against v; rows with more elements away from their default state are darker.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.

    Returns
    -------
    list of Artist
        The line and the points.
    """
    factor, unit = scaled(trace.v, "m/s")
    v = factor * trace.v
    ax.set(xlabel=f"v [{unit}]", ylabel="F [N]")
    away = (trace.rows.mode != 0).sum(axis=1)
    line = ax.plot(v, trace.F, color=LINE_GREY, linewidth=0.5, rasterized=True)
    points = ax.scatter(
        v, trace.F, c=away, s=5, cmap="viridis_r", vmin=0, vmax=max(1, trace.n),
        zorder=3, linewidths=0, rasterized=True,
    )  # fmt: skip
    if trace.model.chart.transitions:
        name = trace.model.chart.states[0].name
        bar = ax.figure.colorbar(points, ax=ax, ticks=range(trace.n + 1))
        bar.set_label(f"elements not in {name}")
    return [*line, points]


def ribbons(ax: Axes, trace: Trace) -> Artists:
    """Draw the active state of every element as a ribbon, like a logic analyser.

    Parameters
    ----------
    ax : Axes
        Where.
    trace : Trace
        What.

    Returns
    -------
    list of Artist
        One collection a state and element.
    """
    names = [state.name for state in trace.model.chart.states]
    fills = (BLUE_TINT, VERMILION_TINT, "#D9F0E7", "#F6E3EE", "#FBF0D5")
    edges = (BLUE, VERMILION, "#009E73", "#CC79A7", "#E69F00")
    drawn: Artists = []
    for i in range(trace.n):
        mode = trace.rows.mode[:, i]
        starts = np.concatenate([[0], np.flatnonzero(np.diff(mode)) + 1])
        ends = np.append(trace.t[starts[1:]], trace.t[-1])
        for state, name in enumerate(names):
            spans = [
                (trace.t[a], b - trace.t[a])
                for a, b in zip(starts, ends, strict=True)
                if mode[a] == state
            ]
            drawn.append(
                ax.broken_barh(
                    spans,
                    (i + 0.6, 0.8),
                    facecolor=fills[state % len(fills)],
                    edgecolor=edges[state % len(edges)],
                    hatch=HATCHES[state % len(HATCHES)],
                    linewidth=0.6,
                    label=name if i == 0 else None,
                )
            )
    ax.set(
        xlabel="t [s]",
        ylim=(trace.n + 0.5, 0.5),
        yticks=range(1, trace.n + 1),
        yticklabels=[f"E{i + 1}" for i in range(trace.n)],
        xlim=(trace.t[0], trace.t[-1]),
    )
    return drawn


def residual(
    ax: Axes, times: NDArray[np.float64], difference: NDArray[np.float64], floor: float = 1e-12
) -> Artists:
    """Draw the size of a difference of forces on a logarithmic scale.

    Parameters
    ----------
    ax : Axes
        Where.
    times : ndarray, shape (m,), s
        When.
    difference : ndarray, shape (m,), N
        What; smaller values than `floor` are drawn at the floor.
    floor : float
        N.

    Returns
    -------
    list of Artist
        The line.
    """
    ax.set(
        xlabel="t [s]",
        ylabel="|difference of F| [N]",
        yscale="log",
        xlim=(times[0], times[-1]),
    )
    return list(ax.plot(times, np.maximum(np.abs(difference), floor), color=INK, linewidth=0.8))
