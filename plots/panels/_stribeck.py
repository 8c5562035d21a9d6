"""The panel of the Stribeck curve, with the run and measured points."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.errors import ParameterError
from gms_fsm.errors import shown as written
from gms_fsm.foundation.quantities import per_second
from gms_fsm.systems.system import loaded
from gms_fsm.traces.trace import Trace
from plots.panels.parts.axes import Artists, draw_curve
from plots.panels.parts.selection import scaled, shown
from plots.style import INK, PALE_GREY, PAPER
from plots.style.matplotlib import Axes
from plots.style.presets import pt
from plots.views.window import Window

__all__ = ["stribeck"]


def stribeck(
    ax: Axes,
    trace: Trace,
    measured: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    window: Window | None = None,
    log: bool = True,
) -> Artists:
    """Draw the Stribeck curve, the run's steady sliding, and measured points.

    Steady sliding means rows at which no deflection changes faster than a hundredth of v; there
    the friction of elements whose shares add up to one is ``s(v) + sigma_2 |v|``.

    Parameters
    ----------
    ax : Axes
        Axes to draw on.
    trace : Trace
        The run; its model's curve and its rows are drawn.
    measured : (array_like, array_like), optional
        Velocities [m/s] and friction [N], each of shape (m,).
    window : (float, float), optional
        Time interval from which rows are taken, s.
    log : bool
        Use a logarithmic axis for |v|.

    Returns
    -------
    list of Artist
        s(v); s(v) + sigma_2 |v| if there is viscous friction; the steady rows; the measured points.
    """
    model, part = trace.model, shown(trace, window)
    if model.stribeck is None:
        raise ParameterError(
            "its chart has no input s, and therefore no Stribeck curve to draw", place=model.title
        )
    if loaded(model):
        raise ParameterError(
            "its thresholds follow a load besides the velocity: they are no curve over v",
            place=model.title,
        )
    points = None if measured is None else checked_points(measured)
    speeds = np.abs(part.v)
    steady = (np.abs(part.dz) < 0.01 * speeds[:, None]).all(axis=1)
    top = max(
        [float(np.nanmax(speeds)), 4 * model.stribeck.v_s, *(() if points is None else points[0])]
    )
    every = np.concatenate([speeds[speeds > 0], [0.1 * model.stribeck.v_s]])
    low = max(1e-6 * top, float(np.nanmin(every)))
    v = np.geomspace(low, top, 400) if log else np.linspace(0.0, top, 2000)
    factor, unit = scaled(v, per_second(trace.model.chart.length))
    curve = model.stribeck(v)
    drawn = draw_curve(ax, factor * v, curve, color=INK, linestyle="--", label="$s(v)$")
    if model.sigma_2 > 0:
        drawn += draw_curve(
            ax, factor * v, curve + model.sigma_2 * v, color=INK, label=r"$s(v) + \sigma_2 |v|$"
        )
    look: dict[str, Any] = {"color": PALE_GREY, "markeredgewidth": 0, "zorder": 1}
    look |= {"markersize": pt(5), "rasterized": True, "label": "run, steady sliding"}
    drawn += ax.plot(factor * speeds[steady], np.abs(part.F[steady]), "s", **look)
    if points is not None:
        look = {"color": INK, "markerfacecolor": PAPER, "zorder": 4}
        look |= {"markersize": pt(4.5), "label": "measured"}
        drawn += ax.plot(factor * points[0], points[1], "o", **look)
    ax.set(xlabel=f"$|v|$ [{unit}]", ylabel=f"$|F|$ [{trace.model.chart.force}]")
    if log:
        ax.set(xscale="log", xlim=(factor * low, 1.15 * factor * top))
    return drawn


def checked_points(measured: tuple[ArrayLike, ArrayLike]) -> tuple[Any, Any]:
    """Return the magnitudes of measured velocities and forces."""
    try:
        v, F = (np.abs(np.asarray(values, dtype=np.float64)) for values in measured)
        good = v.ndim == 1 and v.size > 0 and v.shape == F.shape
        good = good and bool(np.isfinite(v).all() and np.isfinite(F).all())
    except (TypeError, ValueError):
        good = False
    if not good:
        raise ParameterError(
            f"measured is {written(measured)}",
            advice="it must be two one-dimensional lists of finite numbers of equal length: "
            "velocities [m/s] and friction [N]",
        )
    return v, F
