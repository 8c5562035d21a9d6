"""Pictures: charts by Graphviz, figures by matplotlib.

Importing this package needs neither a Graphviz program nor matplotlib; drawing does. Figures are
in `plots.figures`, single panels in `plots.panels` (extra ``plots``).
"""

from plots.block_diagram import block_diagram
from plots.render import render
from plots.statechart import statechart

__all__ = ["block_diagram", "render", "statechart"]
