"""Numbers for a chart: those of its demonstration, the first that its rules allow, another's."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import Parameter, checked_values
from gms_fsm.charts.parts import SUPPLIED
from gms_fsm.charts.registry import registered
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import GMSError
from gms_fsm.systems.models import ChartModel, demonstration
from gms_fsm.systems.parts import Contact, Supervisor


def any_model(chart: Chart) -> ChartModel:
    """Return a model of a chart with some numbers; a program has them as arguments.

    Examples
    --------
    >>> from gms_fsm.charts import CHARTS
    >>> any_model(CHARTS["stiction"]).values
    {'F_c': 1.0, 'F_s': 1.0, 'b': 1.0}
    """
    values = any_values(chart)
    curve = Stribeck(1.0, 1.0, 1.0) if "s" in chart.inputs else None
    inputs = {name: 1.0 for name in chart.inputs if name not in SUPPLIED}
    return ChartModel(chart, dict(values), stribeck=curve, inputs=inputs)


def any_values(chart: Chart) -> dict[str, float]:
    """Return a number for each parameter of a chart.

    Examples
    --------
    >>> from gms_fsm.charts import CHARTS
    >>> any_values(CHARTS["dog-clutch"])
    {'t_on': 1.0, 't_off': 2.0}
    """
    values: dict[str, float] = {}
    for each in chart.parameters:
        values[each.name] = next(_satisfying(each, values, chart.parameters), 1.0)
    return values


def any_contact(chart: Chart, name: str = "contact") -> Contact:
    """Return a contact of a chart alone; an included one has the numbers of its demonstration.

    Examples
    --------
    >>> from gms_fsm.charts import CHARTS
    >>> any_contact(CHARTS["planar-coulomb"]).values["F_s"]
    1.5
    """
    for each in registered().values():
        for law in each.laws or ("",):
            if each.chart(law) == chart and len(chart.velocities) == 1:
                return Contact(name, demonstration(each, law))
            if each.chart(law) == chart:
                return Contact(name, chart, each.demonstration.values, v=chart.velocities)
    if len(chart.velocities) == 1:
        return Contact(name, any_model(chart))
    inputs = {each: 1.0 for each in chart.inputs if each not in SUPPLIED}
    if not chart.velocities:
        return Supervisor(name, chart, any_values(chart), inputs=inputs)
    return Contact(name, chart, any_values(chart), v=chart.velocities, inputs=inputs)


def with_chart(contact: Contact, chart: Chart) -> Contact:
    """Return a contact with another chart of the same names.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT
    >>> contact = any_contact(GMS_ELEMENT["signed"])
    >>> with_chart(contact, GMS_ELEMENT["published"]).chart.name
    'GMS element, published law'
    """
    model = contact.model
    if model is None:
        return contact.replaced(chart=chart)
    return contact.with_model(
        ChartModel(
            chart,
            model.values,
            n=model.n,
            stribeck=model.stribeck,
            sigma_2=model.sigma_2,
            weights=model.weights,
            inputs=getattr(model, "inputs", {}),
        )
    )


def _satisfying(
    parameter: Parameter, before: dict[str, float], every: tuple[Parameter, ...]
) -> Iterator[float]:
    """Yield numbers that satisfy a rule, given those of the parameters before it."""
    limits = sorted(
        {
            before.get(bound.limit, 1.0) if isinstance(bound.limit, str) else bound.limit
            for bound in parameter.bounds
        }
    )
    between = [0.5 * (a + b) for a, b in itertools.pairwise(limits)]
    known = [each for each in every if each.name in before] + [parameter]
    for value in (1.0, *limits, *between, *(u + d for u in limits for d in (1.0, -1.0))):
        try:
            checked_values(known, {**before, parameter.name: value})
        except GMSError:
            continue
        yield value
