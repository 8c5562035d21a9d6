"""Systems as data: the tables of a system, as headers of traces contain them.

Every chart is written out and every model is one of numbers over a chart. A system file may have
more: names of charts and of models (`gms_fsm.systems.files.toml`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.files.tables import ChartTable
from gms_fsm.charts.parameters import STRIBECK, FloatArray
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import SignalError
from gms_fsm.foundation.tables import ONE, TABLE, TEXT, Numbers, Table, Texts, Value, built
from gms_fsm.systems.models import ChartModel, Model
from gms_fsm.systems.parts import Body, Contact, Motion, Sampled, Supervisor
from gms_fsm.systems.signals import Corners, Formula, Function, Signal, as_signal
from gms_fsm.systems.springs import Spring

if TYPE_CHECKING:
    from gms_fsm.systems.system import System


# --------------------------------------------------------------------------- signals
class FormulaTable(Table):
    """A signal given by an expression, as older traces have it."""

    kind: Literal["formula"]
    text: str


class CornersTable(Table):
    """A signal given by corner points: a record, or ramps if its ends are held."""

    kind: Literal["corners"] = "corners"
    times: list[float]
    values: list[float]
    held: bool = False


class FunctionTable(Table):
    """A Python function, which cannot be stored in a file."""

    kind: Literal["function"] = "function"


RAMPS, FORMULA, FUNCTION = "<ramps>", "<formula>", "<function>"


def _signal_form(given: Any) -> str:
    if isinstance(given, Mapping | BaseModel):
        kind = getattr(given, "kind", None) or dict(given).get("kind")
        return {"formula": FORMULA, "function": FUNCTION}.get(str(kind), TABLE)
    if isinstance(given, list):
        return RAMPS
    return TEXT if isinstance(given, str) else ONE


SignalField = Annotated[
    Annotated[str, Tag(TEXT)]
    | Annotated[float, Tag(ONE)]
    | Annotated[list[Annotated[list[float], Field(min_length=2, max_length=2)]], Tag(RAMPS)]
    | Annotated[CornersTable, Tag(TABLE)]
    | Annotated[FormulaTable, Tag(FORMULA)]
    | Annotated[FunctionTable, Tag(FUNCTION)],
    Discriminator(_signal_form),
]


def signal_table(signal: Signal | str) -> SignalField:
    """Describe a signal."""
    match signal:
        case str(text) | Formula(text=text):
            return text
        case Corners(times=times, values=values, held=held):
            pairs = np.stack([times, values], axis=1).tolist()
            return pairs if held else CornersTable(times=times.tolist(), values=values.tolist())
        case _:
            return FunctionTable()


def signal_of(name: str, table: SignalField) -> Signal | str:
    """Return the signal that a table describes."""
    match table:
        case str(text) | FormulaTable(text=text):
            return text
        case CornersTable(times=times, values=values, held=held):
            return Corners(np.array(times), np.array(values), held)
        case FunctionTable():
            return Function(_lost(name))
        case pairs_or_number:
            return as_signal(pairs_or_number)  # type: ignore[arg-type]


def _lost(name: str) -> Callable[[float], float]:
    def missing(_: float) -> float:
        raise SignalError(
            f"{name!r} was a Python function, which a trace file cannot store",
            advice="sample the trace before saving it, or run with t_eval",
        )

    return missing


# --------------------------------------------------------------------------- models
_DESCRIBED = {each.name: each.described for each in STRIBECK}


class StribeckTable(Table):
    """The Stribeck curve, eq. (2)."""

    F_c: float = Field(description=_DESCRIBED["F_c"])
    F_s: float = Field(description=_DESCRIBED["F_s"])
    v_s: float = Field(description=_DESCRIBED["v_s"])
    delta: float = Field(2.0, description=_DESCRIBED["delta"])

    @model_validator(mode="after")
    def _fits(self) -> StribeckTable:
        self.build()
        return self

    @classmethod
    def of(cls, curve: Stribeck) -> StribeckTable:
        """Describe a curve."""
        return cls(**asdict(curve))

    def build(self) -> Stribeck:
        """Return the curve."""
        return Stribeck(self.F_c, self.F_s, self.v_s, self.delta)


class ModelTable(Table):
    """A model: the numbers of a chart, and what its elements share."""

    title: str = ""
    n: int = 1
    chart: ChartTable
    values: dict[str, Numbers]
    weights: list[float] | None = None
    stribeck: StribeckTable | None = None
    sigma_2: float = 0.0
    inputs: dict[str, Value] = Field({})

    @classmethod
    def of(cls, model: Model) -> ModelTable:
        """Describe a model by its numbers, whatever its class."""
        return cls(
            title=model.title,
            n=model.n,
            chart=ChartTable.of(model.chart),
            values=values_table(model.values),
            weights=model.weights.tolist(),
            stribeck=None if model.stribeck is None else StribeckTable.of(model.stribeck),
            sigma_2=model.sigma_2,
            inputs=dict(getattr(model, "inputs", {})),
        )

    def build(self) -> ChartModel:
        """Return an equivalent model."""
        return ChartModel(
            built(self.chart.build, "chart", kind=Chart),
            values_of(self.values),
            n=self.n,
            stribeck=None if self.stribeck is None else self.stribeck.build(),
            sigma_2=self.sigma_2,
            weights=None if self.weights is None else np.array(self.weights),  # type: ignore[arg-type]
            title=self.title,
            inputs=self.inputs,
        )


def values_table(values: Mapping[str, float | FloatArray]) -> dict[str, float | list[float]]:
    """Describe the numbers of a chart."""
    return {
        name: float(value) if np.ndim(value) == 0 else np.asarray(value).tolist()
        for name, value in values.items()
    }


def values_of(values: Mapping[str, float | list[float]]) -> dict[str, float | FloatArray]:
    """Return the numbers of a chart, with arrays."""
    return {
        name: np.array(value) if isinstance(value, list) else value
        for name, value in values.items()
    }


# --------------------------------------------------------------------------- systems
class BodyTable(Table):
    """A body."""

    name: str
    inertia: Value | None = Field(None, description="mass in kg, or moment of inertia in kg m^2")
    force: Value = Field("0", description="sum of forces in N, or torques in Nm")
    velocity: Value | None = Field(None, description="of a driven body, instead of an inertia")
    x: str = Field("x", description="what texts call its position")
    v: str = Field("v", description="what texts call its velocity")
    motion: Motion = Field("along", description="along the surface, normal to it, or turning")
    rotary: bool = Field(False, description="whether it turns: rad, Nm; the same as turning")


class SpringTable(Table):
    """A spring, a damper, or both, between two bodies, or a body and the ground."""

    name: str
    first: str = Field(description="a body")
    second: str | None = Field(None, description="another body; without it, the ground")
    k: Value = Field(0.0, description="stiffness")
    d: Value = Field(0.0, description="damping")
    ratio: Value = Field(1.0, description="gear ratio of the second body")
    rest: Value = Field(0.0, description="x_1 - ratio x_2 without a force")


class ContactTable(Table):
    """A contact: a chart with values, or a model."""

    name: str
    v: Texts = "v"
    n: int = 1
    inputs: dict[str, Value] = Field({})
    period: float | None = None
    chart: ChartTable | None = None
    values: dict[str, Numbers] | None = None
    model: ModelTable | None = None

    @classmethod
    def of(cls, contact: Contact) -> ContactTable:
        """Describe a contact."""
        return cls(**described(contact), **numbers_table(contact))

    def build(self) -> Contact:
        """Return an equivalent contact."""
        chart = built(self.chart.build, "chart", kind=Chart) if self.chart else None
        model = built(self.model.build, "model") if self.model else None
        return contact_from(self, chart, model)


class SupervisorTable(Table):
    """A supervisor: a chart without velocity, with values."""

    name: str
    inputs: dict[str, Value] = Field({})
    period: float | None = None
    chart: ChartTable
    values: dict[str, Numbers] = Field({})

    @classmethod
    def of(cls, machine: Supervisor, **more: Any) -> SupervisorTable:
        """Describe a supervisor; its chart may be given, as a name."""
        numbers = {**numbers_table(machine), **more}
        return cls(name=machine.name, inputs=dict(machine.inputs), period=machine.period, **numbers)

    def build(self, chart: Chart | None = None) -> Supervisor:
        """Return an equivalent supervisor, with its chart if that is known."""
        made = built(self.chart.build, "chart", kind=Chart) if chart is None else chart
        values = values_of(self.values)
        return Supervisor(self.name, made, values, inputs=self.inputs, period=self.period)


def described(contact: Contact) -> dict[str, Any]:
    """Describe a contact without its chart or model."""
    return {
        "name": contact.name,
        "v": contact.v[0] if len(contact.v) == 1 else list(contact.v),
        "n": contact.n if contact.model is None else 1,
        "inputs": dict(contact.inputs),
        "period": contact.period,
    }


def numbers_table(contact: Contact) -> dict[str, Any]:
    """Describe the chart and the values of a contact, or its model."""
    if contact.model is not None:
        return {"model": ModelTable.of(contact.model)}
    return {"chart": ChartTable.of(contact.chart), "values": values_table(contact.values)}


def value_table(value: str | float) -> str | float:
    """Return an expression or a number of plain types."""
    return value if isinstance(value, str) else float(value)


class SampledTable(Table):
    """A sampled controller."""

    name: str
    period: float = Field(description="time between samples, s; elsewhere sample_time")
    updates: dict[str, Value]
    initial: dict[str, float] = Field({})
    offset: float = 0.0


class SystemTable(Table):
    """A system: keys of files as aliases, names of `System` as names."""

    model_config = ConfigDict(populate_by_name=True)

    name: str
    numbers: dict[str, float] = Field({}, description="parameters that texts name")
    signals: dict[str, SignalField] = Field({})
    inputs: list[str] = Field([], description="signals that come from outside")
    flow: dict[str, Value] = Field({})
    let: dict[str, Value] = Field({}, description="named expressions that texts can use")
    units: dict[str, str] = Field({}, description="SI units of numbers, such as m/rad")
    bodies: list[BodyTable] = Field([], alias="body")
    springs: list[SpringTable] = Field([], alias="spring")
    contacts: list[ContactTable] = Field([], alias="contact")
    supervisors: list[SupervisorTable] = Field([], alias="supervisor")
    sampled: list[SampledTable] = Field([])

    @classmethod
    def of(cls, system: System) -> SystemTable:
        """Describe a system; a Python function as a signal is named as such."""
        return cls(
            **plain(system),
            contacts=[ContactTable.of(each) for each in system.contacts],
            supervisors=[SupervisorTable.of(each) for each in system.supervisors],
        )

    def build(self, kind: type[System]) -> System:
        """Return an equivalent system; its class is given, as it imports this module."""
        contacts = [built(each.build, "contacts", i) for i, each in enumerate(self.contacts)]
        machines = [built(each.build, "supervisors", i) for i, each in enumerate(self.supervisors)]
        return system_from(kind, self, contacts, machines)


def plain(system: System) -> dict[str, Any]:
    """Describe a system without its contacts."""
    return {
        "name": system.name,
        "numbers": dict(system.numbers),
        "signals": {name: signal_table(signal) for name, signal in system.signals.items()},
        "inputs": [*system.inputs],
        "flow": dict(system.flow),
        "let": dict(system.let),
        "units": dict(system.units),
        "bodies": [
            BodyTable(
                name=each.name,
                inertia=None if each.inertia is None else value_table(each.inertia),
                force=value_table(each.force),
                velocity=None if each.velocity is None else value_table(each.velocity),
                x=each.x,
                v=each.v,
                motion="along" if each.rotary else each.motion,
                rotary=each.rotary,
            )
            for each in system.bodies
        ],
        "springs": [
            SpringTable(
                name=each.name,
                first=each.first,
                second=each.second,
                k=value_table(each.k),
                d=value_table(each.d),
                ratio=value_table(each.ratio),
                rest=value_table(each.rest),
            )
            for each in system.springs
        ],
        "sampled": [
            SampledTable(
                name=each.name,
                period=each.period,
                updates=dict(each.updates),
                initial=dict(each.initial),
                offset=each.offset,
            )
            for each in system.sampled
        ],
    }


def system_from(
    kind: type[System], table: SystemTable, contacts: list[Contact], machines: list[Supervisor]
) -> System:
    """Return the system that a table describes, with its contacts and its supervisors."""
    return kind(
        table.name,
        bodies=tuple(built(Body, "bodies", i, **vars(each)) for i, each in enumerate(table.bodies)),
        springs=tuple(
            built(Spring, "springs", i, **vars(each)) for i, each in enumerate(table.springs)
        ),
        contacts=tuple(contacts),
        supervisors=tuple(machines),
        signals={
            name: built(signal_of, "signals", name, name=name, table=each)
            for name, each in table.signals.items()
        },
        numbers=table.numbers,
        inputs=tuple(table.inputs),
        flow=table.flow,  # type: ignore[arg-type]  # numbers become texts there
        let=table.let,  # type: ignore[arg-type]
        units=table.units,
        sampled=tuple(
            built(Sampled, "sampled", i, **vars(each)) for i, each in enumerate(table.sampled)
        ),
    )


def contact_from(table: ContactTable, chart: Any, model: Model | None) -> Contact:
    """Return the contact that a table describes, with its chart or its model."""
    return Contact(
        table.name,
        chart if model is None else model,
        None if table.values is None else values_of(table.values),
        v=table.v,
        n=table.n,
        inputs=table.inputs,
        period=table.period,
    )
