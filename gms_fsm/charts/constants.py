"""Numbers that stand in guards, as parameters: so that they can be changed like any other."""

from __future__ import annotations

from contextlib import suppress

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.files.tables import ChartTable, ParameterTable
from gms_fsm.charts.nesting import is_age
from gms_fsm.charts.parameters import QUANTITIES, Parameter, adapted
from gms_fsm.errors import GMSError
from gms_fsm.language import Call, Name, Negative, Node, Number, numbers_named, relations


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
    table = ChartTable.of(chart)
    edge, units = table.transitions[i], _units(chart, chart.nesting.transitions[i].name)
    guard, numbers = numbers_named(edge.guard, f"{edge.name}_at")
    values = {name: float(text) for name, text in numbers.items()}
    for name, text in numbers.items():
        meaning, unit = f"{text} in {edge.guard}", units.get(values[name], "")
        table.parameters.append(ParameterTable(name=name, unit=unit, meaning=meaning))
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
