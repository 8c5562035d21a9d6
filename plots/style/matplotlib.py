"""The matplotlib names that the pictures use; without it, the import names the missing extra.

Modules of `plots` import these names from here and not from matplotlib, so that this is the only
place that handles a missing matplotlib.
"""

# ruff: noqa: E402, F401  require() must come before the imports that it checks; all are handed on
# mypy: implicit-reexport

from __future__ import annotations

from gms_fsm.foundation.extras import require

require("matplotlib", "plots")
require("PIL", "plots")  # comes with matplotlib

from matplotlib import patches, rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap, to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, Rectangle
from matplotlib.path import Path as Curve
from matplotlib.quiver import Quiver
from matplotlib.text import Annotation, Text
from matplotlib.ticker import AutoLocator, LogLocator, MaxNLocator, NullLocator
from matplotlib.transforms import Bbox, IdentityTransform, ScaledTranslation
from PIL import Image
