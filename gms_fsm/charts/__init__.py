"""Friction models as charts: each module is data for one model, with its reference.

``CHARTS`` maps the name of each included chart to the chart.

>>> from gms_fsm.charts import CHARTS
>>> CHARTS["stiction"].guard_text("release_forward")
'F > F_s'
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gms_fsm.charts.gms import GMS_ELEMENT, LAWS, SLIP_LAWS, gms_element
from gms_fsm.charts.timetable import timetable
from gms_fsm.charts.zoo.bristles.lugre import LUGRE

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Chart

    CHARTS: Mapping[str, Chart]

__all__ = ["CHARTS", "GMS_ELEMENT", "LAWS", "LUGRE", "SLIP_LAWS", "gms_element", "timetable"]


def __getattr__(name: str) -> Any:
    """Read the registry when CHARTS is first wanted: it imports every module of this package."""
    if name != "CHARTS":
        raise AttributeError(f"module 'gms_fsm.charts' has no attribute {name!r}")
    from gms_fsm.charts.registry import charts

    return charts()
