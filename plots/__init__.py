"""Pictures: charts drawn by Graphviz, figures drawn by matplotlib.

Importing this package needs neither a Graphviz program nor matplotlib; drawing does. Figures are in
`plots.figures`, single panels in `plots.panels` (extra ``plots``). What notebooks show of charts,
models, systems and runs is made by `plots.output.notebook`; they need no import of this package.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from gms_fsm.foundation.arguments import refusing
from gms_fsm.foundation.extras import require
from plots.charts.difference import chart_diff
from plots.charts.live_chart import LiveChart, live_statechart
from plots.charts.statechart import layout, statechart
from plots.output.mermaid import mermaid
from plots.output.render import render
from plots.page.live import play
from plots.page.replay import replay, write_replay
from plots.style.presets import preset
from plots.systems.block_diagram import block_diagram
from plots.systems.mechanism import schematic

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gms_fsm.systems.models import Model
    from gms_fsm.systems.rigs import Rig
    from gms_fsm.systems.system import System
    from gms_fsm.traces.trace import Trace
    from plots.figures import landscape, phase, unfold
    from plots.film.animation import animate
    from plots.handouts.page import handout
    from plots.widget.explorer import Explorer

__all__ = [
    "LiveChart",
    "animate",
    "block_diagram",
    "chart_diff",
    "explore",
    "handout",
    "landscape",
    "layout",
    "live_statechart",
    "mermaid",
    "overview",
    "phase",
    "play",
    "preset",
    "render",
    "replay",
    "schematic",
    "statechart",
    "unfold",
    "write_replay",
]

# What needs matplotlib is imported when it is asked for.
_LATE = {
    "animate": "film.animation",
    "handout": "handouts.page",
    "landscape": "figures",
    "phase": "figures",
    "unfold": "figures",
}


def __getattr__(name: str) -> Any:
    if name not in _LATE:
        raise AttributeError(f"module 'plots' has no attribute {name!r}")
    return getattr(import_module(f"plots.{_LATE[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_LATE})


@refusing()
def explore(
    model: Model | System,
    rig: Rig | float,
    t_end: float | None = None,
    *,
    sliders: Mapping[str, tuple[float, float]],
    height: int = 720,
    **options: Any,
) -> Explorer:
    """Explore a run in a notebook: sliders, and branches to poke and compare (extra ``jupyter``).

    The widget contains the replay page. A slider runs the model again; a poke, another slip law or
    *fork* makes a branch, and the fork strip shows the branches as a tree over time.

    Parameters
    ----------
    model, rig, t_end
        As for `gms_fsm.simulate`: ``explore(model, rig, t_end)``, or ``explore(system, t_end)``.
    sliders : mapping of str to (float, float)
        Lowest and highest value by name: ``{"F_s": (1.0, 3.0), "k2": (0.1, 10.0)}``, in a system
        ``{"numbers.m": (0.5, 2.0), "pad.F_s": (1.0, 3.0)}``. A slider is logarithmic if its range
        is positive and covers two decades.
    height : int
        Of the replay page, in pixels.
    **options
        ``t_start``, ``initial``, ``settings`` and the fields of `gms_fsm.Settings` by name. The
        engine is ``"compiled"`` if llvmlite is installed (extra ``fast``).

    Returns
    -------
    Explorer
        The widget. What its controls do can be done from Python: ``w.set(F_s=1.8)``,
        ``w.poke({"z": {0: 0.0}}, t=5.0)``, ``w.fork(law="signed")``, ``w.show(0)``,
        ``w.compare(0, 1)``, ``w.rename(1, "poked")``, ``w.delete(1)``, ``w.export("one.toml")``;
        ``w.branches``, ``w.current``, ``w.values`` and ``w.trace(1)`` say how it stands.

    Raises
    ------
    MissingExtraError
        If anywidget or uPlot is not installed.
    ParameterError
        If there is no such number, or its range does not contain the value of the model.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> w = explore(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...             Prescribed("0.15*sin(2*pi*t/25)"), 30.0, sliders={"F_s": (0.5, 3.0)})
    >>> w.poke({"z": {0: -1.4}}, t=25.0)
    1
    >>> print(w.compare(0, 1))
    branches 0 and 1 until t = 30 s: 15 and 16 transitions
      first different transition at t = 25 s
      largest difference: z 876 mm, F 537 mN
    """
    require("anywidget", "jupyter")
    from plots.widget.explorer import Explorer

    return Explorer(model, rig, t_end, sliders=sliders, height=height, **options)


@refusing()
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
