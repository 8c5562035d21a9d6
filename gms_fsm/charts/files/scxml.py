"""How a chart is written in SCXML: names, and the texts of conditions and assignments.

The export writes them, and the import compares with them what it finds.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from gms_fsm.charts.nesting import written_guard
from gms_fsm.language import ECMASCRIPT, Condition, Value, renamed, spell
from gms_fsm.language.normal import renamed_in

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Chart

SCXML = "http://www.w3.org/2005/07/scxml"
OURS = "urn:gms-fsm:chart:1"  # the namespace of what SCXML has no word for
VALUES = "values"  # the event that brings the present values of what comes from outside
STEP = "step"  # the event at which one transition is taken, the first whose condition holds


def written_out(lets: Mapping[str, Value]) -> dict[str, Value]:
    """Return named expressions without names of other ones, which SCXML does not have.

    Examples
    --------
    >>> from gms_fsm.language import parse_value, spell
    >>> lets = {"a": parse_value("2 * v", ["v"]), "b": parse_value("a + 1", ["a"])}
    >>> spell(written_out(lets)["b"])
    '2.0 * v + 1.0'
    """
    done: dict[str, Value] = {}
    for name, tree in lets.items():
        done[name] = renamed(tree, done)
    return done


def conditions(chart: Chart) -> dict[str, str]:
    """Return the guard of each edge as a condition in ECMAScript."""
    lets = written_out(chart.lets)

    def text(guard: Condition) -> str:
        return spell(renamed_in(guard, lets), ECMASCRIPT)

    written = {edge.name: edge for edge in chart.nesting.transitions}
    return {
        name: text(written_guard(guard, chart.nesting, written[name]))
        for name, guard in chart.guards.items()
        if name in written
    }


def assignments(chart: Chart, kind: str, owner: str) -> dict[str, str]:
    """Return what a state or an edge assigns, as expressions in ECMAScript, by name."""
    lets, trees = written_out(chart.lets), chart.assignments[kind, owner]
    kept = {*chart.variables, *chart.velocities} - {*chart.nesting.histories}
    return {
        name: spell(renamed(tree, lets), ECMASCRIPT) for name, tree in trees.items() if name in kept
    }
