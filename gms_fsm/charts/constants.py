"""Numbers that stand in guards, as parameters: so that they can be changed like any other."""

from __future__ import annotations

import re
from contextlib import suppress

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.files.tables import ChartTable, ParameterTable
from gms_fsm.charts.nesting import is_age
from gms_fsm.charts.parameters import QUANTITIES, Parameter, adapted
from gms_fsm.errors import GMSError
from gms_fsm.language import Call, Name, Negative, Node, Number, relations

_NUMBER = re.compile(r"(?<![\w.])(?<!\*\*)(?<!\*\* )(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![\w.])")


def named_constants(chart: Chart) -> tuple[Chart, dict[str, float]]:
    """Return a chart whose guards read parameters where they had numbers, and their values.

    Zeros stay, and exponents, and what only a number can be.

    Examples
    --------
    >>> from gms_fsm import Chart, State, Transition
    >>> edges = (Transition("opens", "shut", "open", guard="abs(v) > 0.3 and v**2 > 0"),)
    >>> states = State("shut"), State("open")
    >>> door = Chart("door", states=states, transitions=edges, outputs={"F": "0"})
    >>> named, values = named_constants(door)
    >>> named.transitions[0].guard, values, named.unit("opens_at")
    ('abs(v) > opens_at and v**2 > 0', {'opens_at': 0.3}, 'm/s')
    """
    values: dict[str, float] = {}
    for i in range(len(chart.nesting.transitions)):
        with suppress(GMSError):
            chart, more = _named(chart, i)
            values |= more
    return chart, values


def _named(chart: Chart, i: int) -> tuple[Chart, dict[str, float]]:
    """Return the same for one edge, as it is written."""
    table, values = ChartTable.of(chart), dict[str, float]()
    edge, units = table.transitions[i], _units(chart, chart.nesting.transitions[i].name)

    def name_of(found: re.Match[str]) -> str:
        if not (value := float(found[0])):
            return found[0]
        name = f"{edge.name}_at{f'_{len(values) + 1}' if values else ''}"
        values[name] = value
        meaning, unit = f"{found[0]} in {edge.guard}", units.get(value, "")
        table.parameters.append(ParameterTable(name=name, unit=unit, meaning=meaning))
        return name

    guard = _NUMBER.sub(name_of, edge.guard)
    table.transitions[i] = edge.model_copy(update={"guard": guard})
    return (table.build(Chart), values) if values else (chart, {})


def _units(chart: Chart, edge: str) -> dict[float, str]:
    """Return the units of the numbers in a guard that are all that something is compared with."""
    found: dict[float, str] = {}
    for each in relations(chart.guards[edge]):
        for side, other in ((each.left, each.right), (each.right, each.left)):
            match side:
                case Number(value) | Negative(Number(value)):
                    found[abs(value)] = _unit(chart, other)
    return found


def _unit(chart: Chart, side: Node) -> str:
    match side:
        case Call("abs", (Name(name),)) | Name(name):
            if is_age(name) or name in chart.durations:
                return "s"
            return chart.unit(name) or adapted(QUANTITIES.get(name, Parameter(name)), chart).unit
    return ""
