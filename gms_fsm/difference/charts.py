"""Two charts: what differs in them, and whether it makes a difference."""

from __future__ import annotations

from gms_fsm.charts.chart import Chart
from gms_fsm.difference.changes import ChartPair, changes_of
from gms_fsm.difference.result import Diff
from gms_fsm.verification.sameness.same import sameness


def chart_diff(a: Chart, b: Chart, names: tuple[str, str]) -> tuple[Diff, ChartPair]:
    """Return what two charts differ in, and what of one stands for what of the other.

    Examples
    --------
    >>> from gms_fsm.charts import LUGRE
    >>> chart_diff(LUGRE, LUGRE, ("one", "other"))[0].summary
    'equal'
    """
    found, matching = sameness(a, b)
    pair = ChartPair(a, b, matching)
    changes = changes_of(pair)
    if not changes and found.verdict == "equivalent" and a == b:
        return Diff(names, (), "equal", "", states=matching.states), pair
    return Diff(names, changes, found.verdict, found.reason, found.point, matching.states), pair
