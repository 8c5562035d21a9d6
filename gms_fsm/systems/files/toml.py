"""System files: a system as one TOML file, whose contacts may name charts and models."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, Discriminator, Field, Tag

import gms_fsm.systems.files.model_tables as model_tables
from gms_fsm.charts.chart import Chart
from gms_fsm.charts.files.tables import ChartTable
from gms_fsm.charts.registry import chart_named, charts
from gms_fsm.charts.timetable import timetable
from gms_fsm.errors import OutputError, ParameterError, ScenarioError
from gms_fsm.foundation.files import inside
from gms_fsm.foundation.tables import ONE, TABLE, Numbers, Table, built, read_file, write_file
from gms_fsm.foundation.toml import parsed
from gms_fsm.records.record import Record
from gms_fsm.scenarios import shipped
from gms_fsm.systems.files.tables import (
    ContactTable,
    CornersTable,
    FunctionTable,
    ModelTable,
    SignalField,
    StribeckTable,
    SupervisorTable,
    SystemTable,
    contact_from,
    described,
    numbers_table,
    plain,
    system_from,
)
from gms_fsm.systems.gms_parameters import GMSParameters
from gms_fsm.systems.models import GMS, LuGre, Model
from gms_fsm.systems.parts import Contact, Supervisor

if TYPE_CHECKING:
    from gms_fsm.systems.system import System

KNOWN, OWN = "<known>", "<own>"
FILE, HERE = "<file>", "<here>"
# Keys of scenario files, by what reads them.
OF_A_SCENARIO = {
    "load_scenario": ("model", "rig"),
    "load_system": ("title", "notes", "run", "initial", "output", "record", "fit"),
}


def _chart_form(given: Any) -> str:
    return TABLE if isinstance(given, dict | BaseModel) else ONE


def _model_form(given: Any) -> str:
    inside = dict(given) if isinstance(given, dict | BaseModel) else {}
    return OWN if isinstance(inside.get("chart"), dict | BaseModel) else KNOWN


ChartField = Annotated[
    Annotated[str, Tag(ONE)] | Annotated[ChartTable, Tag(TABLE)], Discriminator(_chart_form)
]
ModelField = Annotated[
    Annotated[model_tables.ModelTable, Tag(KNOWN)] | Annotated[ModelTable, Tag(OWN)],
    Discriminator(_model_form),
]


class ContactInFile(ContactTable):
    """A contact of a system file."""

    chart: ChartField | None = Field(  # type: ignore[assignment]
        None,
        description="a chart file next to this one, the name of an included chart, or a table",
    )
    model: ModelField | None = Field(  # type: ignore[assignment]
        None, description="a model, as in scenario files, instead of a chart and values"
    )

    def chosen(self, folder: Path) -> Contact:
        """Return the contact; its chart may be a file in a folder."""
        chart: Chart | None = None
        model: Model | None = None
        if (self.chart is None) == (self.model is None):
            raise ParameterError(
                "it needs a chart or a model, not both"
                if self.chart is not None
                else "it has neither a chart nor a model",
                place=f"contact {self.name!r}",
                advice='give chart = "own.toml" and values, or a table [contact.model]',
            )
        if self.chart is not None:
            chart = built(_chart, "chart", given=self.chart, folder=folder)
        if self.model is not None:
            build: Callable[[], Model] = self.model.build
            model = built(build, "model")
        return contact_from(self, chart, model)


class SupervisorInFile(SupervisorTable):
    """A supervisor of a system file."""

    chart: ChartField | None = Field(  # type: ignore[assignment]
        None, description="a chart file next to this one, the name of an included chart, or a table"
    )
    times: dict[str, Numbers] = Field({}, description="when it sends events, s, instead of a chart")

    def chosen(self, folder: Path) -> Supervisor:
        """Return the supervisor; its chart may be a file in a folder."""
        if (self.chart is None) == (not self.times):
            raise ParameterError(
                f"it has {'a chart and' if self.times else 'neither a chart nor'} times",
                place=f"supervisor {self.name!r}",
                advice='give chart = "own.toml", or times = { press = [0.5, 2.0] }',
            )
        if self.chart is None:
            return self.build(built(timetable, "times", times=self.times))
        return self.build(built(_chart, "chart", given=self.chart, folder=folder))


def _chart(given: str | ChartTable, folder: Path) -> Chart:
    if isinstance(given, ChartTable):
        return given.build(Chart)
    if not given.endswith(".toml"):
        return chart_named(given)
    return Chart.load(_beside(folder, given, "chart"))


def _beside(folder: Path, given: str, place: str) -> Path:
    """Return the path of a file in the folder of a system file."""
    try:
        path = inside(folder, given)
    except (OSError, ValueError) as error:
        raise ScenarioError(f"it is no file name ({error})", place=place, value=given) from None
    if path is None:
        raise ScenarioError(
            "it is outside the folder of the system file",
            place=place,
            value=given,
            advice=f"put the {place} next to the system file",
        )
    return path


class FileTable(Table):
    """A signal from two columns of a table next to the system file, in SI units."""

    file: str = Field(description="CSV or TSV, in the folder of the system file")
    time: str = Field("t_s", description="column of the times, s")
    value: str = Field(description="column of the values")

    def read(self, folder: Path) -> CornersTable:
        """Return the signal; its file is in a folder."""
        path = _beside(folder, self.file, "file")
        record = Record.from_csv(
            path, time=self.time, position=None, velocity=self.value, force=None
        )
        columns = record.columns
        return CornersTable(times=columns["time"].tolist(), values=columns["velocity"].tolist())


def _signal_form(given: Any) -> str:
    read = isinstance(given, FileTable) or (isinstance(given, dict) and "file" in given)
    return FILE if read else HERE


SignalInFile = Annotated[
    Annotated[FileTable, Tag(FILE)] | Annotated[SignalField, Tag(HERE)],
    Discriminator(_signal_form),
]


class SystemFile(SystemTable):
    """A system file."""

    signals: dict[str, SignalInFile] = Field({})  # type: ignore[assignment]
    contacts: list[ContactInFile] = Field([], alias="contact")  # type: ignore[assignment]
    supervisors: list[SupervisorInFile] = Field([], alias="supervisor")  # type: ignore[assignment]

    def chosen(self, folder: Path, kind: type[System]) -> System:
        """Return the system; its charts may be files in a folder."""
        for name, signal in self.signals.items():
            if isinstance(signal, FunctionTable):
                raise ScenarioError(
                    "a file cannot define a Python function",
                    place=f"signal {name!r}",
                    key=("signals", name),
                )
        contacts = [
            built(each.chosen, "contacts", i, folder=folder) for i, each in enumerate(self.contacts)
        ]
        signals = {
            name: built(each.read, "signals", name, folder=folder)
            if isinstance(each, FileTable)
            else each
            for name, each in self.signals.items()
        }
        machines = [
            built(each.chosen, "supervisors", i, folder=folder)
            for i, each in enumerate(self.supervisors)
        ]
        table = self.model_copy(update={"signals": signals})
        return system_from(kind, table, contacts, machines)


def load(path: Path, kind: type[System]) -> System:
    """Read a system file; errors name file, line, key and text."""
    if not path.exists() and str(path) in shipped():
        raise _scenario(path, f"load_system({str(path)!r})")
    given = parsed(path)
    for reader, keys in OF_A_SCENARIO.items():
        if found := [name for name in given if name in keys]:
            raise _scenario(path, f"{reader}({str(path)!r})", f", with the key {found[0]!r}")
    build = functools.partial(SystemFile.chosen, folder=path.parent, kind=kind)
    return read_file(path, SystemFile, ScenarioError, build)


def _scenario(path: Path, call: str, why: str = "") -> ScenarioError:
    """Return the error of a scenario file, which has more than a system."""
    return ScenarioError(
        f"it is a scenario{why}",
        place=str(path),
        advice=f"read it with gms_fsm.app.scenario.{call}",
    )


def save(system: System, path: Path) -> Path:
    """Write a system file, unless a signal is a Python function or something else is there."""
    return save_as(SystemFile, system, path)


def save_as(kind: type[SystemFile], system: System, path: Path, **further: Any) -> Path:
    """Write a file that holds a system and more."""
    contacts = [ContactInFile(**described(each), **_numbers(each)) for each in system.contacts]
    machines = [SupervisorInFile.of(each, **_numbers(each)) for each in system.supervisors]
    for sampler in system.controllers:
        raise OutputError(
            f"sampled {sampler.name!r} is a Python function, which a file cannot store",
            place=str(path),
            advice="write its updates as texts",
        )
    table = kind(**{**plain(system), "contacts": contacts, "supervisors": machines, **further})
    for name, signal in table.signals.items():
        if isinstance(signal, FunctionTable):
            raise OutputError(
                f"signal {name!r} is a Python function, which a file cannot store",
                place=str(path),
                advice="give an expression in t, ramps, or arrays (times, values)",
            )
    return write_file(path, table)


def _numbers(contact: Contact) -> dict[str, Any]:
    """Describe what a contact has, by name where the name says it all."""
    if contact.model is not None:
        return {"model": _model(contact.model) or ModelTable.of(contact.model)}
    found = numbers_table(contact)
    for name, chart in charts().items():
        if chart == contact.chart:
            found["chart"] = name
    return found


def _model(model: Model) -> Any:
    """Describe a model of this package by its kind; None for any other."""
    if type(model) is LuGre:
        return model_tables.LuGreTable(
            kind="LuGre",
            sigma_0=model.sigma_0,
            sigma_1=model.sigma_1,
            sigma_2=model.sigma_2,
            stribeck=StribeckTable.of(model.stribeck),
        )
    if type(model) is GMS and type(model.parameters) is GMSParameters:
        p = model.parameters
        return model_tables.GMSTable(
            kind="GMS",
            law=model.law,
            k=p.k.tolist(),
            sigma=p.sigma.tolist(),
            C=p.C.tolist(),
            sigma_2=p.sigma_2,
            v_c=p.v_c,
            stribeck=StribeckTable.of(p.stribeck),
            weights=p.weights.tolist(),
        )
    return None
