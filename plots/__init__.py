"""Pictures: charts by Graphviz, figures by matplotlib.

Importing this package needs neither a Graphviz program nor matplotlib; drawing does. Figures are in
`plots.figures`, single panels in `plots.panels` (extra ``plots``). After the import charts, models
and traces show themselves in a notebook.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plots.block_diagram import block_diagram
from plots.notebook import register
from plots.render import render
from plots.statechart import statechart

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gms_fsm.trace import Trace

__all__ = ["block_diagram", "overview", "render", "statechart"]

register()


def overview(trace: Trace, title: str = "") -> Figure:
    """Draw a run at a glance; see `plots.figures.overview`.

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
