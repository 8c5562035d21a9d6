"""Charts as data for files: the tables of a chart file, which the headers of traces contain too."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import (
    ConfigDict,
    Discriminator,
    Field,
    SerializerFunctionWrapHandler,
    Tag,
    model_serializer,
    model_validator,
)

from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.parts import NO_GUARD, State, Transition
from gms_fsm.errors import ChartError
from gms_fsm.foundation.tables import ONE, TABLE, Table, Texts, built, read_file, write_file

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Chart


class ParameterTable(Table):
    """A parameter with its unit and rule."""

    name: str
    unit: str = ""
    rule: str = "finite"
    per_element: bool = True
    meaning: str = ""
    assumed: str = ""


class StateTable(Table):
    """A state, with those inside it."""

    model_config = ConfigDict(populate_by_name=True)

    name: str
    flow: dict[str, str] = Field({})
    entry: dict[str, str] = Field({})
    exit: dict[str, str] = Field({})
    outputs: dict[str, str] = Field({})
    locked: bool = False
    initial: str = ""
    history: bool = False
    states: list[StateTable] = Field([], alias="state", description="the states inside it")

    @model_serializer(mode="wrap")
    def _without_nesting(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what only a composite state has."""
        data: dict[str, Any] = write(self)
        if not self.states:
            for name in ("initial", "history", "states", "state"):
                data.pop(name, None)
        return data

    @classmethod
    def of(cls, state: State) -> StateTable:
        """Describe a state."""
        inside = [cls.of(each) for each in state.states]
        initial = state.initial if inside and state.initial != inside[0].name else ""
        return cls.model_validate({**vars(state), "states": inside, "initial": initial})

    def build(self) -> State:
        """Return the state."""
        inside = [built(each.build, "states", i) for i, each in enumerate(self.states)]
        return State(**{**vars(self), "states": inside})


class EdgeTable(Table):
    """An edge, which may leave several states."""

    model_config = ConfigDict(populate_by_name=True)

    name: str
    source: Texts = Field(alias="from", description="the state it leaves, its source")
    target: str = Field(alias="to", description="the state it enters, its target")
    guard: str = Field(NO_GUARD, description="the condition under which it is taken")
    event: str = Field("", description="the event that it waits for; the guard may be left out")
    emit: Texts = Field([], description="events for the machines of the system")
    actions: dict[str, str] = Field({}, alias="do", description="actions: new values of variables")
    impulse: bool = False


def _form(given: Any) -> str:
    return ONE if isinstance(given, str) else TABLE


ParameterField = Annotated[
    Annotated[str, Tag(ONE)] | Annotated[ParameterTable, Tag(TABLE)], Discriminator(_form)
]


class ChartTable(Table):
    """A chart: keys of files as aliases, names of `Chart` as names, which headers of traces use."""

    model_config = ConfigDict(populate_by_name=True)

    name: str
    reference: str = ""
    inputs: list[str] = Field(["v"])
    velocities: list[str] = Field(["v"])
    variables: list[str] = Field([])
    parameters: list[ParameterField] = Field([], alias="parameter")
    let: dict[str, str] = Field({})
    outputs: dict[str, str] = Field({})
    contact_outputs: dict[str, str] = Field({})
    initial: dict[str, float] = Field({})
    states: list[StateTable] = Field(alias="state")
    transitions: list[EdgeTable] = Field([], alias="edge")
    layout: dict[str, list[float]] = Field({})

    @model_validator(mode="before")
    @classmethod
    def _of_a_chart(cls, given: Any) -> Any:
        if isinstance(given, dict) and given.keys() & {"model", "rig", "body", "contact"}:
            raise ValueError(
                "it is a scenario or a system, not a chart; `gms-fsm chart` draws the chart in it, "
                "and gms_fsm.app.scenario.load_scenario reads it"
            )
        if isinstance(given, dict) and {"parameters", "parameter"} <= given.keys():
            raise ValueError("it has parameters = [...] and [[parameter]]; give only one of them")
        return given

    @model_serializer(mode="wrap")
    def _plain_names(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Write plain names of parameters as one list; else each as a table."""
        data: dict[str, Any] = write(self)
        for name in ("initial", "layout"):  # most charts have none
            if not getattr(self, name):
                data.pop(name, None)
        given = data.get("parameter", [])
        if not all(isinstance(each, str) for each in given):
            data["parameter"] = [
                {"name": each} if isinstance(each, str) else each for each in given
            ]
            return data
        return {"parameters" if key == "parameter" else key: each for key, each in data.items()}

    @classmethod
    def of(cls, chart: Chart) -> ChartTable:
        """Describe a chart."""
        edges = [
            {name: getattr(edge, name) for name in EdgeTable.model_fields}
            | {"source": [*edge.sources] if len(edge.sources) > 1 else edge.source}
            | {"emit": list(edge.emit)}
            for edge in chart.nesting.transitions
        ]
        return cls.model_validate(
            {
                "name": chart.name,
                "reference": chart.reference,
                "inputs": list(chart.inputs),
                "velocities": list(chart.velocities),
                # The age is there because a text reads it.
                "variables": [name for name in chart.variables if name not in chart.hidden],
                "parameters": [
                    each.name if each == Parameter(each.name) else dict(vars(each))
                    for each in chart.parameters
                ],
                "let": chart.let,
                "outputs": chart.outputs,
                "contact_outputs": chart.contact_outputs,
                "initial": chart.initial,
                "states": [StateTable.of(state) for state in chart.nesting.states],
                "transitions": edges,
                "layout": {name: list(place) for name, place in chart.layout.items()},
            }
        )

    def build(self, kind: type[Chart]) -> Chart:
        """Return the chart."""
        parameters = [
            each if isinstance(each, str) else built(Parameter, "parameters", i, **vars(each))
            for i, each in enumerate(self.parameters)
        ]
        states = [built(each.build, "states", i) for i, each in enumerate(self.states)]
        edges = [
            built(Transition, "transitions", i, **vars(each))
            for i, each in enumerate(self.transitions)
        ]
        return kind(
            **{
                **vars(self),
                "parameters": parameters,
                "states": states,
                "transitions": edges,
            }
        )


def load(path: Path, kind: type[Chart]) -> Chart:
    """Read a chart file; errors name file, line, key and text."""
    return read_file(path, ChartTable, ChartError, lambda table: table.build(kind))


def save(chart: Chart, path: Path) -> Path:
    """Write a chart file, unless something else is there."""
    return write_file(path, ChartTable.of(chart))
