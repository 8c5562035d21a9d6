"""The description of a run in its trace file, validated on reading. Reading executes nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import OutputError, SignalError
from gms_fsm.lowering.scales import Setting
from gms_fsm.systems.models import ChartModel, Model
from gms_fsm.systems.rigs import Prescribed, PulledSlider, Rig, Slider
from gms_fsm.systems.signals import Corners, Formula, Function, Signal
from gms_fsm.traces.verdicts import Verdict

__all__ = ["Header"]


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, ser_json_inf_nan="constants")


class ChartRecord(_Record):
    """The texts of a chart."""

    name: str
    inputs: tuple[str, ...]
    variables: tuple[str, ...]
    parameters: tuple[Parameter | str, ...]
    states: tuple[State, ...]
    transitions: tuple[Transition, ...]
    outputs: dict[str, str]
    reference: str

    @classmethod
    def of(cls, chart: Chart) -> ChartRecord:
        """Describe a chart; a parameter without unit and rule is stored as its name only."""
        fields = {name: getattr(chart, name) for name in cls.model_fields}
        plain = [each.name if each == Parameter(each.name) else each for each in chart.parameters]
        return cls(**{**fields, "parameters": plain})


class ModelRecord(_Record):
    """The numbers of a model."""

    title: str
    n: int
    chart: ChartRecord
    values: dict[str, float | list[float]]
    weights: list[float]
    stribeck: Stribeck | None
    sigma_2: float


class FormulaRecord(_Record):
    """A signal given by an expression."""

    kind: Literal["formula"] = "formula"
    text: str


class CornersRecord(_Record):
    """A signal given by corner points: ramps or a measured record."""

    kind: Literal["corners"] = "corners"
    times: list[float]
    values: list[float]
    held: bool


class FunctionRecord(_Record):
    """A Python function, which cannot be stored in a file."""

    kind: Literal["function"] = "function"


SignalRecord = Annotated[
    FormulaRecord | CornersRecord | FunctionRecord, Field(discriminator="kind")
]


RigKind = Literal["Prescribed", "Slider", "PulledSlider"]
RIGS: Mapping[type, RigKind] = {
    Prescribed: "Prescribed",
    Slider: "Slider",
    PulledSlider: "PulledSlider",
}


class RigRecord(_Record):
    """The numbers and signals of a rig."""

    kind: RigKind
    numbers: dict[str, float]
    signals: dict[str, SignalRecord]

    @property
    def prescribed(self) -> bool:
        """Whether the velocity is prescribed."""
        return self.kind == "Prescribed"


class Header(_Record):
    """The complete header of a trace file."""

    format: Literal["gms-fsm trace 1"] = "gms-fsm trace 1"
    model: ModelRecord
    rig: RigRecord
    settings: dict[str, str | float | dict[str, float | list[float]] | None]
    log: str = ""  # in a CSV file: the hash of its transition log
    monitors: dict[str, Annotated[Verdict, Field(discriminator="kind")]] = {}

    @classmethod
    def of(
        cls,
        model: Model,
        rig: Rig,
        settings: Mapping[str, Setting],
        monitors: Mapping[str, Verdict] | None = None,
    ) -> Header:
        """Describe a run; a rig of a user-defined class raises `OutputError`."""
        chart = model.chart
        return cls(
            model=ModelRecord(
                title=model.title,
                n=model.n,
                chart=ChartRecord.of(chart),
                values={
                    name: float(value) if np.ndim(value) == 0 else np.asarray(value).tolist()
                    for name, value in model.values.items()
                },
                weights=model.weights.tolist(),
                stribeck=model.stribeck,
                sigma_2=model.sigma_2,
            ),
            rig=RigRecord(
                kind=_kind(rig),
                numbers=dict(rig.numbers),
                signals={name: _signal_record(signal) for name, signal in rig.signals.items()},
            ),
            settings=dict(settings),
            monitors=dict(monitors or {}),
        )

    def to_model(self) -> ChartModel:
        """Return an equivalent model."""
        record = self.model
        return ChartModel(
            Chart(**vars(record.chart)),
            {
                name: np.array(value) if isinstance(value, list) else value
                for name, value in record.values.items()
            },
            n=record.n,
            stribeck=record.stribeck,
            sigma_2=record.sigma_2,
            weights=np.array(record.weights),
            title=record.title,
        )

    def to_rig(self) -> Rig:
        """Return an equivalent rig, in which a Python function becomes one that raises."""
        signals = {name: _signal(name, record) for name, record in self.rig.signals.items()}
        numbers = self.rig.numbers
        match self.rig.kind:
            case "Prescribed":
                return Prescribed(signals["v"])
            case "Slider":
                return Slider(numbers["mass"], signals["F_a"])
            case "PulledSlider":
                return PulledSlider(**numbers)


def _kind(rig: Rig) -> RigKind:
    # Look up the class, not its name: a user's class may have the same name as ours.
    if type(rig) not in RIGS:
        raise OutputError(
            f"the rig is a {type(rig).__qualname__}, a custom class, which cannot be saved",
            advice=f"a file can store {', '.join(RIGS.values())} of gms_fsm",
        )
    return RIGS[type(rig)]


def _signal_record(signal: Signal) -> FormulaRecord | CornersRecord | FunctionRecord:
    match signal:
        case Formula(text=text):
            return FormulaRecord(text=text)
        case Corners(times=times, values=values, held=held):
            return CornersRecord(times=times.tolist(), values=values.tolist(), held=held)
        case _:
            return FunctionRecord()


def _signal(name: str, record: FormulaRecord | CornersRecord | FunctionRecord) -> Signal:
    match record:
        case FormulaRecord(text=text):
            return Formula(text)
        case CornersRecord(times=times, values=values, held=held):
            return Corners(np.array(times), np.array(values), held)
        case _:
            return Function(_lost(name))


def _lost(name: str) -> Callable[[float], float]:
    def missing(_: float) -> float:
        raise SignalError(
            f"{name!r} was a Python function, which a trace file cannot store",
            advice="sample the trace before saving it, or run with t_eval",
        )

    return missing
