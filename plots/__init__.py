"""Pictures: charts drawn by Graphviz, figures drawn by matplotlib.

Importing this package needs neither a Graphviz program nor matplotlib; drawing does. Figures are in
`plots.figures`, single panels in `plots.panels` (extra ``plots``). What notebooks show of charts,
models, systems and runs is made by `plots.notebook`; they need no import of this package.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from plots.block_diagram import block_diagram
from plots.live_chart import LiveChart, live_statechart
from plots.mermaid import mermaid
from plots.render import render
from plots.replay import replay, write_replay
from plots.statechart import statechart

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gms_fsm.traces.trace import Trace

__all__ = [
    "LiveChart",
    "animate",
    "block_diagram",
    "live_statechart",
    "mermaid",
    "overview",
    "render",
    "replay",
    "statechart",
    "write_replay",
]


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
