"""Common parts of figures: titles, panel letters, legends, and the time interval shown."""

from __future__ import annotations

from collections.abc import Sequence
from string import ascii_lowercase
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gms_fsm.traces.trace import Trace
from plots import panels
from plots.figures._layout import legend_below
from plots.panels.parts.axes import MANY
from plots.panels.parts.selection import checked_elements
from plots.style.matplotlib import Annotation, Axes, Figure
from plots.style.presets import pt
from plots.views.window import Window

LANE = 0.15  # inches: a row of one element, with its label


class Moving(Protocol):
    """What has a motion: a run, a record compared with a model."""

    @property
    def t(self) -> NDArray[np.float64]:
        """Times, s."""

    @property
    def v(self) -> NDArray[np.float64]:
        """Velocity, m/s."""


def head(trace: Trace, title: str) -> str:
    """Return the title of a figure: the given one, or that of the scenario; the model, its law."""
    first = title or trace.heading
    return f"{first}: {trace.model.title}" if first else trace.model.title


def letter_panels(axes: Sequence[Axes], names: Sequence[str]) -> None:
    """Name the panels of a figure: a bold letter, and the name."""
    for letter, ax, name in zip(ascii_lowercase, axes, names, strict=False):
        # Above the labels of the marks, if there are any.
        marked = any(isinstance(text, Annotation) and text.xy[1] >= 1.0 for text in ax.texts)
        panels.lettered(ax, letter, name, pad=pt(16 if marked else 6))


def over_threshold(
    ax: Axes, trace: Trace, *, window: Window | None, elements: Sequence[int] | None
) -> str:
    """Draw z / s of few elements as curves, of many as grey levels; return the panel's name."""
    many = len(checked_elements(trace, elements)) > MANY and panels.has_threshold(trace)
    (panels.heat if many else panels.ratio)(ax, trace, window=window, elements=elements)
    if many or panels.has_threshold(trace):
        return "deflection / threshold"
    if "s" in trace.model.chart.inputs:
        return "deflection / s(v)"
    return "first variable" if trace.model.chart.variables else "deflection"


def lanes_height(count: int, least: float, lane: float = LANE) -> float:
    """Return the height in which the rows of so many elements can be read, inches."""
    return max(least, lane * count)


def element_legend(figure: Figure, *axes: Axes) -> None:
    """Add one legend of what is in some panels below the figure, if anything is."""
    found = [ax.get_legend_handles_labels() for ax in axes]
    entries = {name: handle for pair in found for handle, name in zip(*pair, strict=True)}
    if entries:
        legend_below(figure, list(entries.values()), list(entries))


def one_time_axis(column: Sequence[Axes]) -> None:
    """Label the time axis only in the lowest panel of a column."""
    for ax in column[:-1]:
        ax.set_xlabel("")
        ax.tick_params(labelbottom=False)


def last_cycles(run: Moving) -> Window:
    """Return the time interval to show: a short run whole, the last three cycles of a long one."""
    quiet = 0.05 * np.nanmax(np.abs(run.v))
    signs = np.sign(run.v) * (np.abs(run.v) > quiet)
    moving = np.flatnonzero(signs)
    turns = moving[1:][np.diff(signs[moving]) != 0]
    begin = run.t[0] if turns.size <= 12 else run.t[turns[-7]]
    return float(begin), float(run.t[-1])
