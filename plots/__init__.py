"""Pictures: charts drawn by Graphviz, figures drawn by matplotlib.

Importing this package needs neither a Graphviz program nor matplotlib; drawing does. Figures are in
`plots.figures`, single panels in `plots.panels` (extra ``plots``). Once it is imported, charts,
models, systems and traces display themselves in a notebook.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plots.block_diagram import block_diagram
from plots.live_chart import LiveChart, live_statechart
from plots.mermaid import mermaid
from plots.notebook import register
from plots.render import render
from plots.replay import replay, write_replay
from plots.statechart import statechart

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gms_fsm.inspection.prove import Report
    from gms_fsm.traces.trace import Trace

__all__ = [
    "LiveChart",
    "animate",
    "block_diagram",
    "landscape",
    "live_statechart",
    "mermaid",
    "overview",
    "phase",
    "render",
    "replay",
    "statechart",
    "unfold",
    "write_replay",
]

register()


def animate(trace: Trace, path: str | Path, **options: Any) -> Path:
    """Make an animation of the live chart next to the force; see `plots.animation.animate`.

    Parameters
    ----------
    trace : Trace
        The run.
    path : str or Path
        Its file ending selects the format, for example ``.gif``.
    **options
        Options of `plots.animation.animate`: elements, frames, t_start, t_end, fps, notation,
        theme.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    MissingExtraError
        If matplotlib or Pillow is not installed.
    """
    from plots import animation

    return animation.animate(trace, path, **options)


def overview(trace: Trace, title: str = "") -> Figure:
    """Draw an overview of a run; see `plots.figures.overview`.

    Parameters
    ----------
    trace : Trace
        The run.
    title : str
        Of the figure.

    Returns
    -------
    Figure
        A matplotlib figure.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    from plots import figures

    return figures.overview(trace, title=title)


def landscape(
    trace: Trace,
    element: int,
    *,
    row: int = -1,
    t: float | None = None,
    window: tuple[float, float] | None = None,
    checks: Report | None = None,
    title: str = "",
) -> Figure:
    """Draw the guards of an element over v and z, and how far each is; `plots.figures.landscape`.

    Parameters
    ----------
    trace : Trace
        The run.
    element : int
        Which element, counted from 0.
    row : int
        Row of the run; negative rows count from the end.
    t : float, optional
        Instead of a row: the last row at or before this time, s.
    window : (float, float), optional
        Time interval in which the path is drawn, s.
    checks : Report, optional
        From `gms_fsm.prove`: its counterexamples are drawn as pins.
    title : str
        Of the figure.

    Returns
    -------
    Figure
        A matplotlib figure.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    from plots import figures

    return figures.landscape(
        trace, element, row=row, t=t, window=window, checks=checks, title=title
    )


def unfold(
    trace: Trace,
    t0: float,
    t1: float,
    *,
    elements: Sequence[int] | None = None,
    title: str = "",
) -> Figure:
    """Draw the micro-steps in a time interval in equal columns; see `plots.figures.unfold`.

    Parameters
    ----------
    trace : Trace
        The run.
    t0, t1 : float
        The interval, s; both ends belong to it.
    elements : sequence of int, optional
        Which elements, counted from 0; by default all.
    title : str
        Of the figure.

    Returns
    -------
    Figure
        A matplotlib figure.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    from plots import figures

    return figures.unfold(trace, t0, t1, elements=elements, title=title)


def phase(
    trace: Trace,
    *,
    row: int | None = None,
    window: tuple[float, float] | None = None,
    elements: Sequence[int] | None = None,
    title: str = "",
) -> Figure:
    """Draw F over x and over v, with the direction of time; see `plots.figures.phase`.

    Parameters
    ----------
    trace : Trace
        The run.
    row : int, optional
        Row of the dot; by default the last one in the window.
    window : (float, float), optional
        Time interval to show, s; by default the whole run.
    elements : sequence of int, optional
        Elements that are counted by the colour, from 0; by default all.
    title : str
        Of the figure.

    Returns
    -------
    Figure
        A matplotlib figure.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    from plots import figures

    return figures.phase(trace, row=row, window=window, elements=elements, title=title)
