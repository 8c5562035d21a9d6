"""Common parts of panels: curves, element styles, axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.language import latex_name
from gms_fsm.traces.trace import Trace
from plots.panels.parts.selection import RunPart, scaled
from plots.style import ELEMENT_DASHES, INK, TEXT_GREY, element_colour
from plots.style.matplotlib import Artist, Axes, MaxNLocator
from plots.style.presets import font

Artists = list[Artist]

MANY = 6  # more elements are drawn as rows and counted, not as curves
VECTOR_ROWS = 6_000  # longer curves are rasterized in an SVG or PDF, which keeps the file small


def first_variable(trace: Trace, values: NDArray[np.float64]) -> tuple[float, str]:
    """Return factor and title of the chart's first variable, with its unit if it is known."""
    chart = trace.model.chart
    return axis_title(chart.variables[0], chart.unit(chart.variables[0]), values)


def force_title(trace: Trace) -> str:
    """Return the title of an axis of the force."""
    return f"$F$ [{trace.model.chart.force}]"


def axis_title(name: str, unit: str | None, values: NDArray[np.float64]) -> tuple[float, str]:
    """Return factor and title of a quantity: its symbol, and a unit in which its values fit."""
    symbol = f"${latex_name(name)}$"
    if not unit:
        return 1.0, symbol
    factor, prefixed = scaled(values, unit)
    return factor, f"{symbol} [{prefixed}]"


def element_look(i: int, n: int) -> dict[str, Any]:
    """Return colour and dash of element i of n."""
    return {
        "color": element_colour(i, n),
        "linestyle": ELEMENT_DASHES[i % len(ELEMENT_DASHES)],
    }


def draw_curve(ax: Axes, x: NDArray[np.float64], y: NDArray[np.float64], **look: Any) -> Artists:
    """Draw a line; a very long one is rasterized."""
    return list(ax.plot(x, y, rasterized=x.size > VECTOR_ROWS, **look))


def element_curves(ax: Axes, part: RunPart, values: NDArray[np.float64], label: str) -> Artists:
    """Draw a column of values for each element over time; labels have its number from 1."""
    lines: Artists = []
    for i in part.elements:
        look = element_look(i, part.run.n)
        lines += draw_curve(ax, part.rows.t, values[:, i], label=label.format(i + 1), **look)
    return lines


def time_axis(ax: Axes, begin: float, end: float) -> None:
    """Label the time axis; in a very narrow window, ticks are relative to a time inside it."""
    ax.set_xlabel("$t$ [s]")
    width = end - begin
    if not width > 0:
        return
    ax.set_xlim(begin, end)
    if width > 1e-4 * max(abs(begin), abs(end)):
        ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        return
    origin = round((begin + end) / 2, int(np.ceil(-np.log10(width))) + 1)
    factor, unit = scaled(np.array([width]), "s")
    low, high = factor * (begin - origin), factor * (end - origin)
    ticks = np.asarray(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    ticks = ticks[(ticks >= low) & (ticks <= high)]
    ax.set_xticks(origin + ticks / factor, [f"{tick:g}".replace("-", "−") for tick in ticks])
    ax.set_xlabel(f"$t$ − {origin:.12g} s [{unit}]")


def log_axis(ax: Axes, values: NDArray[np.float64], axis: str) -> None:
    """Make an axis logarithmic, over at most six decades: v passes through zero at reversals."""
    positive = values[np.isfinite(values) & (values > 0)]
    top = float(positive.max()) if positive.size else 1.0
    low = max(float(positive.min()) if positive.size else 0.1, 1e-6 * top)
    limits = (0.8 * low, 1.25 * top)
    ax.set(**{f"{axis}scale": "log", f"{axis}lim": limits})


def lanes(ax: Axes, elements: Sequence[int]) -> None:
    """Label the rows of a panel with one row per element, the first one on top."""
    ax.set(
        ylim=(len(elements) + 0.5, 0.5),
        yticks=range(1, len(elements) + 1),
        yticklabels=[f"E{i + 1}" for i in elements],
    )
    ax.tick_params(axis="y", length=0, labelsize=font(9 if len(elements) <= MANY else 8))


def beside(
    ax: Axes, text: str, at: tuple[float, float], shift: tuple[float, float], **look: Any
) -> Artist:
    """Write a text at a distance from a point, in points; by default above it."""
    plain: dict[str, Any] = {"ha": "center", "va": "bottom", "fontsize": font(8), "color": INK}
    return ax.annotate(text, at, shift, textcoords="offset points", **(plain | look))


def no_threshold(ax: Axes, trace: Trace) -> Artist:
    """Write why a panel of thresholds is empty."""
    missing = "input s" if trace.model.chart.transitions else "edges"
    return note(ax, f"no threshold:\nthis chart has no {missing}")


def note(ax: Axes, text: str) -> Artist:
    """Write in the middle of an empty panel why it is empty."""
    ax.set_yticks([])
    return ax.text(
        0.5, 0.5, text, ha="center", va="center", transform=ax.transAxes, color=TEXT_GREY
    )
