"""The description of a run in its trace file, validated on reading. Reading executes nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from gms_fsm.foundation.tables import Table
from gms_fsm.lowering.scales import Setting
from gms_fsm.systems.files.tables import (
    ModelTable,
    SignalField,
    SystemTable,
    signal_of,
    signal_table,
)
from gms_fsm.systems.mounted import Mounted, mounted
from gms_fsm.systems.rigs import Belt, Prescribed, PulledSlider, Rig, Slider, TextRig
from gms_fsm.systems.system import System
from gms_fsm.traces.verdicts import Verdict

FORMATS = ("gms-fsm trace 1", "gms-fsm trace 2")  # CSV files are of the first

RigKind = Literal["Prescribed", "Slider", "PulledSlider", "Belt", "custom"]
RIGS: Mapping[type, RigKind] = {
    Prescribed: "Prescribed",
    Slider: "Slider",
    PulledSlider: "PulledSlider",
    Belt: "Belt",
}


class RigTable(Table):
    """The numbers and signals of a rig; of one of a custom class also its texts."""

    kind: RigKind
    numbers: dict[str, float]
    signals: dict[str, SignalField]
    title: str = ""
    acceleration: str | None = None

    @model_validator(mode="after")
    def _has_texts(self) -> RigTable:
        if self.kind != "custom" and (self.title or self.acceleration):
            raise ValueError(f"the texts of a {self.kind} are not in a file")
        return self

    @classmethod
    def of(cls, rig: Rig) -> RigTable:
        """Describe a rig."""
        # Look up the class, not its name: a user's class may have the same name as ours.
        kind = RIGS.get(type(rig), "custom")
        texts: Any = {"title": rig.title, "acceleration": rig.acceleration}
        return cls(
            kind=kind,
            numbers={name: float(value) for name, value in rig.numbers.items()},
            signals={name: signal_table(signal) for name, signal in rig.signals.items()},
            **(texts if kind == "custom" else {}),
        )

    def build(self) -> Rig:
        """Return an equivalent rig, in which a Python function becomes one that raises."""
        signals: Any = {name: signal_of(name, each) for name, each in self.signals.items()}
        match self.kind:
            case "Prescribed":
                return Prescribed(signals.pop("v"), signals)
            case "Slider":
                return Slider(self.numbers["mass"], signals["F_a"])
            case "PulledSlider":
                return PulledSlider(**self.numbers)
            case "Belt":
                return Belt(**self.numbers)
            case _:
                return TextRig(self.title, self.acceleration, signals, self.numbers)


class Header(BaseModel):
    """The complete header of a trace file: a model on a rig, or a system."""

    model_config = ConfigDict(extra="forbid", frozen=True, ser_json_inf_nan="constants")

    format: Literal["gms-fsm trace 1", "gms-fsm trace 2"] = "gms-fsm trace 1"
    model: ModelTable | None = None
    rig: RigTable | None = None
    system: SystemTable | None = None
    heading: str = ""
    settings: dict[str, str | float | dict[str, float | list[float]] | None]
    log: str = ""  # in a CSV file: the hash of its transition log
    monitors: dict[str, Annotated[Verdict, Field(discriminator="kind")]] = {}

    @model_validator(mode="after")
    def _one_run(self) -> Header:
        given = [each is not None for each in (self.model, self.rig, self.system)]
        if given not in ([True, True, False], [False, False, True]):
            raise ValueError("it must have a model and a rig, or a system")
        return self

    @classmethod
    def of(
        cls,
        what: Mounted,
        settings: Mapping[str, Setting],
        monitors: Mapping[str, Verdict] | None = None,
        heading: str = "",
    ) -> Header:
        """Describe a run."""
        rest: Any = {"settings": dict(settings), "monitors": dict(monitors or {})}
        rest["heading"] = heading
        if what.named:
            return cls(system=SystemTable.of(what.system), **rest)
        return cls(model=ModelTable.of(what.model), rig=RigTable.of(what.rig), **rest)

    @property
    def chosen(self) -> dict[str, Setting]:
        """The settings as the run had them; in the file every number is a float."""
        steps: Any = self.settings.get("max_steps")
        whole = isinstance(steps, float) and steps.is_integer()
        return {**self.settings, "max_steps": int(steps)} if whole else {**self.settings}

    def to_mounted(self) -> Mounted:
        """Return an equivalent of what ran, in which a Python function becomes one that raises."""
        if self.system is not None:
            return mounted(self.system.build(System))
        assert self.model is not None
        assert self.rig is not None
        step = self.settings.get("step")
        held = self.settings.get("events") == "held" and isinstance(step, float)
        return mounted(self.model.build(), self.rig.build(), step if held else None)  # type: ignore[arg-type]
