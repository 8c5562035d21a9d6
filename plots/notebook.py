"""Charts, models, systems and traces display themselves in a notebook once `plots` is imported.

The core knows nothing about pictures, so this module adds the display methods to its classes.
"""

from __future__ import annotations

from io import BytesIO
from typing import Any

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import MissingExtraError
from gms_fsm.systems.models import GMS, ChartModel, LuGre, Model
from gms_fsm.systems.system import Contact, Several, System
from gms_fsm.traces.trace import Trace
from plots.block_diagram import block_diagram
from plots.render import drawn
from plots.statechart import statechart

__all__ = ["register"]

MOST_ELEMENTS = 4  # a larger bank is shown as one element, because all have the same chart


def chart_svg(chart: Chart) -> str | None:
    """Return a chart as SVG, or None without Graphviz (a notebook then shows text)."""
    picture = drawn(statechart(chart), "svg")
    return None if picture is None else picture.decode()


def model_svg(model: Model | Contact) -> str | None:
    """Return a model's or a contact's bank of elements as SVG, or None without Graphviz."""
    picture = drawn(statechart(model.chart, model.n if model.n <= MOST_ELEMENTS else 1), "svg")
    return None if picture is None else picture.decode()


def system_svg(system: System) -> str | None:
    """Return a system's block diagram as SVG, or None without Graphviz."""
    picture = drawn(block_diagram(system), "svg")
    return None if picture is None else picture.decode()


def trace_png(trace: Trace) -> bytes | None:
    """Return a run's overview as PNG, or None without matplotlib or with several contacts."""
    if isinstance(trace.model, Several):
        return None
    try:
        from plots.figures import overview
    except MissingExtraError:
        return None
    buffer = BytesIO()
    overview(trace).savefig(buffer, format="png", dpi=100)
    return buffer.getvalue()


def register() -> None:
    """Add the display methods to the classes."""
    methods: tuple[tuple[type[Any], str, Any], ...] = (
        (Chart, "_repr_svg_", chart_svg),
        *((model, "_repr_svg_", model_svg) for model in (GMS, LuGre, ChartModel, Contact)),
        (System, "_repr_svg_", system_svg),
        (Trace, "_repr_png_", trace_png),
    )
    for kind, name, method in methods:
        setattr(kind, name, method)
