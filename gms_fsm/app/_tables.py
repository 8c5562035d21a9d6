"""Tables of a scenario file: every key with its type and description."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    PositiveFloat,
    Tag,
    model_validator,
)
from pydantic_core import PydanticKnownError

from gms_fsm.errors import ScenarioError
from gms_fsm.foundation.tables import LIST, ONE, TABLE, TEXT, Numbers, Table
from gms_fsm.records.record import Column, Record
from gms_fsm.run.settings import ENGINES, EVENTS, Settings
from gms_fsm.systems.files.model_tables import ModelTable
from gms_fsm.systems.files.toml import SystemFile
from gms_fsm.systems.rigs import Belt, PulledSlider
from integrators import METHODS

if TYPE_CHECKING:
    from gms_fsm.identification.problem.task import FitOptions

# Tags of union members in pydantic's errors; no key of a file looks like these.
RAMPS = "<ramps>"
SCIPY_METHODS = ("RK45", "DOP853", "Radau", "BDF", "LSODA")


# --------------------------------------------------------------------------- records
class ColumnTable(Table):
    """The column of a quantity."""

    column: str = Field(description="name in the header line")
    unit: str = Field(description='for example "mm"')
    sign: Literal[1, -1] = Field(1, description="-1 to reverse the sign of the quantity")

    def build(self) -> Column:
        """Return the column."""
        return Column(self.column, self.unit, self.sign)


class TextTable(Table):
    """A text table, and how it is written; keys as in `gms_fsm.Record.from_csv`."""

    file: str = Field(description="CSV or TSV, in the folder of the scenario or in GMS_FSM_DATA")
    time: ColumnTable
    where: str = Field(
        "", description='condition for the rows to use, for example "normal > 4.5 N"'
    )
    missing: Literal["error", "drop", "interpolate"] = Field(
        "error", description="what to do where a cell is empty, NaN or a word such as OVR"
    )
    sort: bool = Field(False, description="whether to sort the rows by time")
    duplicates: Literal["error", "mean"] = Field("error", description="rows of the same time")
    delimiter: Literal["\t", ";", ",", "|", " "] | None = None
    decimal: Literal[".", ","] = "."
    thousands: Literal[",", ".", " ", "'"] | None = None
    comment: list[str] = Field(["#", "%"], description="what comment lines begin with")
    header: int | None = Field(
        None, ge=1, description="row of the column names; by default the first that has them"
    )
    columns: list[str] | None = Field(None, description="names of a table that has none")
    encoding: str | None = Field(None, description='for example "cp1252"; by default UTF-8')

    def read(self, path: Path, columns: Mapping[str, Any]) -> Record:
        """Return the record with these columns and the time."""
        given: dict[str, Any] = dict.fromkeys(("position", "velocity", "force", "normal"))
        own = {"file", "time", *given, "smoothing", "inputs", "value"}
        given |= {name: value for name, value in self if name not in own}
        given |= columns
        return Record.from_csv(path, time=self.time.build(), **given)


class RecordTable(TextTable):
    """A measured motion, optionally with the measured force."""

    position: ColumnTable | None = None
    velocity: ColumnTable | None = None
    force: ColumnTable | None = Field(None, description="measured friction, for comparison")
    normal: ColumnTable | None = Field(None, description="normal force")
    inputs: dict[str, ColumnTable] = Field({}, description="columns for inputs of the chart")
    smoothing: float | None = Field(None, ge=0, description="time constant of the spline, s")

    def quantities(self) -> dict[str, Any]:
        """Return the given columns."""
        names = ("position", "velocity", "force", "normal")
        tables = {name: getattr(self, name) for name in names}
        found = {name: table.build() for name, table in tables.items() if table is not None}
        return found | {"inputs": {name: each.build() for name, each in self.inputs.items()}}


class SignalRecordTable(TextTable):
    """One measured signal: a time column and a value column."""

    value: ColumnTable


def _signal_form(given: Any) -> str:
    if isinstance(given, dict | SignalRecordTable):
        return TABLE
    if isinstance(given, list):
        return RAMPS
    return ONE if isinstance(given, int | float) else TEXT


SignalField = Annotated[
    Annotated[str, Tag(TEXT)]
    | Annotated[float, Tag(ONE)]
    | Annotated[list[Annotated[list[float], Field(min_length=2, max_length=2)]], Tag(RAMPS)]
    | Annotated[SignalRecordTable, Tag(TABLE)],
    Discriminator(_signal_form),
]
_SIGNAL = "expression of t in quotes, ramps [[t, value], ...], or a record {file, time, value}"


# --------------------------------------------------------------------------- rigs
_DESCRIBED: Mapping[str, str] = {each.name: each.described for each in PulledSlider.parameters}
_ON_BELT: Mapping[str, str] = {each.name: each.described for each in Belt.parameters}


class PrescribedTable(Table):
    """Open loop: v(t) is prescribed."""

    kind: Literal["prescribed"]
    velocity: SignalField = Field(description=f"m/s: {_SIGNAL}")


class RecordedTable(Table):
    """Open loop: v(t) is the motion of the table [record]."""

    kind: Literal["record"]


class SliderTable(Table):
    """A mass pushed by a force."""

    kind: Literal["slider"]
    mass: float = Field(description=_DESCRIBED["mass"])
    force: SignalField = Field(description=f"N: {_SIGNAL}")


class PulledTable(Table):
    """A mass pulled through a spring."""

    kind: Literal["pulled"]
    mass: float = Field(description=_DESCRIBED["mass"])
    stiffness: float = Field(description=_DESCRIBED["stiffness"])
    speed: float = Field(description=_DESCRIBED["speed"])


class BeltTable(Table):
    """A mass on a moving belt, tied to a wall by a spring and a damper."""

    kind: Literal["belt"]
    mass: float = Field(description=_ON_BELT["mass"])
    stiffness: float = Field(description=_ON_BELT["stiffness"])
    speed: float = Field(description=_ON_BELT["speed"])
    damping: float = Field(0.0, description=_ON_BELT["damping"])


# --------------------------------------------------------------------------- the run
if TYPE_CHECKING:  # the names are those of tables elsewhere
    MethodName: TypeAlias = str
    EventsName: TypeAlias = str
    EngineName: TypeAlias = str
else:
    MethodName = Literal[(*METHODS, *SCIPY_METHODS)]
    EventsName, EngineName = Literal[tuple(EVENTS)], Literal[tuple(ENGINES)]

_DEFAULT = Settings()
_Tolerance = Annotated[
    Annotated[PositiveFloat, Tag(ONE)] | Annotated[list[PositiveFloat], Tag(LIST)],
    Discriminator(lambda given: LIST if isinstance(given, list) else ONE),
]
Tolerances = Annotated[
    Annotated[PositiveFloat, Tag(ONE)] | Annotated[dict[str, _Tolerance], Tag(TABLE)],
    Discriminator(lambda given: TABLE if isinstance(given, dict) else ONE),
]


class RunTable(Table):
    """How to integrate; keys and defaults are those of `gms_fsm.Settings`."""

    t_end: float | None = Field(
        None, description="s; by default the end of the record; a duration if t_start is 0"
    )
    t_start: float | None = Field(None, description="s; by default 0, or the start of the record")
    method: MethodName = Field(_DEFAULT.method_name, description="the solver")
    step: float | None = Field(_DEFAULT.step, gt=0, description="fixed time step dt, s")
    rtol: float = Field(_DEFAULT.rtol, gt=0)
    atol: Tolerances | None = Field(
        None,
        description="absolute tolerance of all components, or by name { x, v, z }; by "
        "default from the scales of the model",
    )
    max_step: float | None = Field(None, gt=0, description="s; no limit by default")
    max_steps: int = Field(_DEFAULT.max_steps, ge=1, description="error if a run needs more")
    events: EventsName = _DEFAULT.events
    engine: EngineName = _DEFAULT.engine
    monitors: list[str] = Field(
        [],
        description='monitors: "chattering", "passivity", "coverage", "all" of these, '
        'and invariants such as "abs(z) <= 2*s"',
    )

    def options(self) -> dict[str, Any]:
        """Return the given settings, by name."""
        given = self.model_dump(include={each.name for each in fields(_DEFAULT)}, exclude_none=True)
        if self.method in SCIPY_METHODS:
            import scipy.integrate  # slow to import

            given["method"] = getattr(scipy.integrate, self.method)
        return given


class InitialTable(Table):
    """Initial values."""

    z: list[float] | None = None
    states: list[str] | None = None
    v: float | None = None
    x: float | None = None


def _figure_ending(value: str) -> str:
    from plots.output import formats

    known = [ending.removeprefix(".") for ending in formats.endings("figure")]
    if value not in known:
        listed = formats.either([repr(ending) for ending in known])
        raise PydanticKnownError("literal_error", {"expected": listed})
    return value


def _with_figure_endings(schema: dict[str, Any]) -> None:
    """Add the file endings to a schema; they are only known when it is generated."""
    from plots.output import formats

    endings = [ending.removeprefix(".") for ending in formats.endings("figure")]
    schema["anyOf"][0]["items"]["enum"] = endings


class OutputTable(Table):
    """The output files."""

    every: float | None = Field(
        None, gt=0, description="distance of rows [s]; by default every accepted step"
    )
    figures: list[Annotated[str, AfterValidator(_figure_ending)]] | None = Field(
        None,
        description="file endings of the overview figure; by default the usual ones",
        json_schema_extra=_with_figure_endings,
    )
    csv: bool = Field(False, description="also write the trace as CSV")


# --------------------------------------------------------------------------- fits
_Pair = Annotated[list[float], Field(min_length=2, max_length=2)]


class FitTable(Table):
    """What `gms-fsm fit` searches; keys and defaults are those of `gms_fsm.fit`."""

    free: list[str] = Field(min_length=1, description='parameters to find, for example ["k", "C"]')
    fixed: dict[str, Numbers] = Field({}, description="values that differ from those of the model")
    tied: list[str] = Field([], description="parameters with one value for all elements")
    nuisance: list[Literal["offset", "drift", "inertia"]] = Field(
        ["offset"], description="offset [N], drift [N/s], inertia [kg]: fitted besides the model"
    )
    linear: list[str] = Field([], description="further parameters in which the force is linear")
    measured: str = Field("F", description='compared with the record: "F", "gear.F", "load.x"')
    drive: str | None = Field(
        None, description="signal of a system that the velocity of the record replaces"
    )
    train: _Pair | None = Field(None, description="rows to fit, from and to, s; all by default")
    test: _Pair | None = Field(None, description="rows to hold out, from and to, s")
    cycles: float | None = Field(None, gt=0, description="period of the record, s")
    search: Literal["hops", "local"] = "hops"
    bounds: dict[str, _Pair] = Field({}, description="lowest and highest value, by parameter")
    seed: int = Field(0, ge=0)
    most_steps: int | None = Field(None, ge=1, description="of the integrator, for each trial run")
    begin: Literal["relaxed", "run in"] | None = Field(
        None, description="state in which a record begins; by default whichever fits better"
    )
    weight: Literal["rows", "records"] | None = Field(None, description="what counts alike")

    @model_validator(mode="after")
    def _fits(self) -> FitTable:
        for name in ("train", "test"):
            pair = getattr(self, name)
            if pair is not None and not pair[0] < pair[1]:
                raise ScenarioError(
                    f"{name} ends at {pair[1]:g} s, not after its start",
                    advice="give from and to, s",
                    key=(name,),
                )
        return self

    def options(self, smoothing: float | None) -> FitOptions:
        """Return the options of a fit, with the smoothing of the record."""
        from gms_fsm.identification.problem.task import FitOptions  # imports SciPy

        given: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in self
            if name != "fixed"
        }
        given["bounds"] = {name: tuple(pair) for name, pair in self.bounds.items()}
        return FitOptions(**given, smoothing=smoothing)


class Scenario(Table):
    """A scenario file."""

    title: str = ""
    notes: str = Field("", description="text for the summary")
    model: ModelTable
    rig: Annotated[
        PrescribedTable | RecordedTable | SliderTable | PulledTable | BeltTable,
        Field(discriminator="kind"),
    ]
    record: RecordTable | None = None
    run: RunTable = RunTable()
    initial: InitialTable = InitialTable()
    output: OutputTable = OutputTable()
    fit: FitTable | None = Field(None, description="for gms-fsm fit; a run ignores it")

    @model_validator(mode="after")
    def _fits(self) -> Scenario:
        if isinstance(self.rig, RecordedTable) and self.record is None:
            raise ScenarioError(
                "rig.kind = 'record' needs a table [record]",
                advice="add one with file, time and position or velocity",
                key=("rig", "kind"),
            )
        if not isinstance(self.rig, RecordedTable):
            if self.record is not None:
                raise ScenarioError(
                    "the table [record] requires rig.kind = 'record'",
                    advice="change the rig, or leave the table out",
                    key=("rig", "kind"),
                )
            if self.run.t_end is None:
                raise ScenarioError(
                    "run.t_end is missing",
                    advice="add t_end in s to [run]; it can be omitted only with a record",
                    key=("run",),
                )
        return self


# --------------------------------------------------------------------------- systems
STATES = "<states>"


def _initial_form(given: Any) -> str:
    if isinstance(given, dict):
        return TABLE
    if isinstance(given, list):
        return STATES if given and isinstance(given[0], str) else LIST
    return ONE


_OneInitial = (
    Annotated[float, Tag(ONE)]
    | Annotated[list[float], Tag(LIST)]
    | Annotated[list[str], Tag(STATES)]
)
InitialValue = Annotated[
    _OneInitial
    | Annotated[
        dict[str, Annotated[_OneInitial, Discriminator(_initial_form)]],
        Tag(TABLE),
    ],
    Discriminator(_initial_form),
]


class SystemScenario(SystemFile):
    """A scenario file of a system: a system file with the tables of a run."""

    title: str = Field("", description="by default the name of the system")
    notes: str = Field("", description="text for the summary")
    run: RunTable = RunTable()
    initial: dict[str, InitialValue] = Field(
        {},
        description="by name: load.x and load.v of a body, gear.z and gear.states of a contact, "
        "and further states; all else starts at 0",
    )
    output: OutputTable = OutputTable()
    record: RecordTable | None = Field(None, description="for gms-fsm fit; a run ignores it")
    fit: FitTable | None = Field(None, description="for gms-fsm fit; a run ignores it")

    @model_validator(mode="after")
    def _fits(self) -> SystemScenario:
        if self.record is not None and self.fit is None:
            raise ScenarioError(
                "the table [record] of a system is for gms-fsm fit",
                advice="add a table [fit]",
                key=("record",),
            )
        if self.run.events == "held":
            raise ScenarioError(
                "run.events = 'held' is for a model on a rig",
                advice="give a contact a period",
                key=("run", "events"),
            )
        return self

    def initial_values(self) -> dict[str, Any]:
        """Return the initial values by name, such as ``"load.x"``."""
        return _flat(self.initial)


def _flat(table: Mapping[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in table.items():
        inner = _flat(value) if isinstance(value, dict) else {"": value}
        flat |= {f"{name}.{key}".removesuffix("."): each for key, each in inner.items()}
    return flat
