"""Pictures: charts drawn by Graphviz, figures drawn by matplotlib.

Importing this package needs neither a Graphviz program nor matplotlib; drawing does. Figures are in
`plots.figures`, single panels in `plots.panels` (extra ``plots``). What notebooks show of charts,
models, systems and runs is made by `plots.output.notebook`; they need no import of this package.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from plots.charts.difference import chart_diff as chart_diff
    from plots.charts.live_chart import LiveChart as LiveChart
    from plots.charts.live_chart import live_statechart as live_statechart
    from plots.charts.statechart import layout as layout
    from plots.charts.statechart import statechart as statechart
    from plots.figures import landscape as landscape
    from plots.figures import overview as overview
    from plots.figures import phase as phase
    from plots.figures import unfold as unfold
    from plots.film.animation import animate as animate
    from plots.handouts.page import handout as handout
    from plots.output.mermaid import mermaid as mermaid
    from plots.output.render import render as render
    from plots.page.live import play as play
    from plots.page.replay import replay as replay
    from plots.page.replay import write_replay as write_replay
    from plots.style.presets import preset as preset
    from plots.systems.block_diagram import block_diagram as block_diagram
    from plots.systems.mechanism import schematic as schematic
    from plots.widget.explore import explore as explore

# The same names again, for run time: each is imported when it is asked for.
_HOMES = {
    "charts.difference": "chart_diff",
    "charts.live_chart": "LiveChart live_statechart",
    "charts.statechart": "layout statechart",
    "figures": "landscape overview phase unfold",
    "film.animation": "animate",
    "handouts.page": "handout",
    "output.mermaid": "mermaid",
    "output.render": "render",
    "page.live": "play",
    "page.replay": "replay write_replay",
    "style.presets": "preset",
    "systems.block_diagram": "block_diagram",
    "systems.mechanism": "schematic",
    "widget.explore": "explore",
}
_HOME = {name: home for home, names in _HOMES.items() for name in names.split()}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'plots' has no attribute {name!r}")
    return getattr(import_module(f"plots.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
