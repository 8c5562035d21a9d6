"""Scenario files: a whole run as one TOML file, validated before anything happens.

Nothing in a scenario is executed: signals are expressions of t, ramps, or measured records, and a
record's file must lie beside the scenario (or in the data folder named by GMS_FSM_DATA).
"""

from __future__ import annotations

import difflib
import os
import re
import tomllib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
import scipy.integrate
from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    PositiveFloat,
    Tag,
    ValidationError,
    model_validator,
)

from gms_fsm.app.records import Column, Motion, Record, motion_of, read_record
from gms_fsm.charts.parameters import GMSParameters, Stribeck
from gms_fsm.errors import (
    LONGEST_SHOWN,
    GMSError,
    ParameterError,
    RecordError,
    ScenarioError,
    UnitError,
    cut,
    shown,
)
from gms_fsm.run.settings import MOST_STEPS
from gms_fsm.systems.models import GMS, LuGre, Model
from gms_fsm.systems.rigs import Prescribed, PulledSlider, Rig, Slider
from gms_fsm.systems.signals import Corners, SignalLike, as_signal
from gms_fsm.traces.monitors import checked

__all__ = ["DATA_VARIABLE", "Loaded", "Scenario", "load_scenario"]

DATA_VARIABLE = "GMS_FSM_DATA"
LARGEST_FILE = 1_000_000  # bytes
DEEPEST_KEY = 6  # parts
# A key of very many parts keeps tomllib busy for hours (its work grows with their square).
_ENDLESS_KEY = re.compile(
    r"""(?<![\w"'-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){20}"""
)
_TEXT_OR_COMMENT = re.compile(r""""[^"]*"?|'[^']*'?|#.*""")
_HALF_A_NUMBER = re.compile(  # a digit on one side of the point only
    r"(?<![\w.+-])([+-]?)(?:(\d+)\.|\.(\d+))((?:[eE][+-]?\d+)?)(?![\w.])"
)
SCIPY_METHODS = ("RK45", "DOP853", "Radau", "BDF", "LSODA")


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


# --------------------------------------------------------------------------- model
class StribeckTable(_Table):
    """The Stribeck curve, eq. (2)."""

    F_c: float = Field(description="Coulomb friction, N")
    F_s: float = Field(description="stiction, N")
    v_s: float = Field(description="Stribeck velocity, m/s")

    def build(self) -> Stribeck:
        """Return the curve."""
        return Stribeck(self.F_c, self.F_s, self.v_s)


class GMSTable(_Table):
    """A GMS bank: a column of the paper's Table I, or all parameters."""

    kind: Literal["GMS"]
    law: Literal["signed", "published"] = Field(description="slip law; there is no default")
    preset: Literal["non-drifting", "stick-slip"] | None = Field(
        None, description="column of Table I, instead of parameters"
    )
    k: list[float] | None = Field(None, description="stiffness of each element, N/m")
    sigma: list[float] | None = Field(None, description="damping of each element, Ns/m")
    C: list[float] | float | None = Field(
        None, description="attraction: a list [m/s], or with shares one number [N/s]"
    )
    sigma_2: float | None = Field(None, description="viscous friction, Ns/m")
    v_c: float | None = Field(None, description="arrest velocity, m/s")
    stribeck: StribeckTable | None = None
    weights: list[float] | None = Field(None, description="threshold weights, m/N")
    shares: list[float] | None = Field(None, description="share of friction of each element")

    @model_validator(mode="after")
    def _fits(self) -> GMSTable:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it is said when the model is built to be used
            self.build()
        return self

    def build(self) -> GMS:
        """Return the model."""
        own = ("k", "sigma", "C", "sigma_2", "v_c", "stribeck", "shares")
        if self.preset is not None:
            given = [name for name in own if getattr(self, name) is not None]
            if given:
                raise ValueError(f"preset goes with weights only; take out {', '.join(given)}")
            parameters = GMSParameters.paper(self.preset)
            if self.weights is not None:
                parameters = parameters.with_weights(self.weights)
            return GMS(parameters, law=self.law)
        needed = ("k", "C", "v_c", "stribeck")
        missing = [name for name in needed if getattr(self, name) is None]
        if missing:
            raise ValueError(f"missing {', '.join(missing)}; give them, or a preset")
        assert self.k is not None
        assert self.v_c is not None
        assert self.stribeck is not None
        n, sigma_2 = len(self.k), self.sigma_2 or 0.0
        sigma = [0.0] * n if self.sigma is None else self.sigma
        if self.shares is not None:
            if isinstance(self.C, list) or self.weights is not None:
                raise ValueError("shares go with one number C [N/s] and without weights")
            assert self.C is not None
            try:
                parameters = GMSParameters.from_shares(
                    self.shares,
                    self.k,
                    C=self.C,
                    stribeck=self.stribeck.build(),
                    v_c=self.v_c,
                    sigma=sigma,
                    sigma_2=sigma_2,
                )
            except ParameterError as error:
                raise ValueError(str(error).replace("alpha", "shares")) from None
        else:
            if not isinstance(self.C, list):
                raise ValueError("C must be a list, one number [m/s] an element (or give shares)")
            parameters = GMSParameters(
                self.k,
                sigma,
                self.C,
                sigma_2=sigma_2,
                stribeck=self.stribeck.build(),
                v_c=self.v_c,
                weights=self.weights,
            )
        return GMS(parameters, law=self.law)


class LuGreTable(_Table):
    """The LuGre model."""

    kind: Literal["LuGre"]
    sigma_0: float = Field(description="bristle stiffness, N/m")
    sigma_1: float = Field(description="bristle damping, Ns/m")
    sigma_2: float = Field(description="viscous friction, Ns/m")
    stribeck: StribeckTable

    @model_validator(mode="after")
    def _fits(self) -> LuGreTable:
        self.build()
        return self

    def build(self) -> LuGre:
        """Return the model."""
        return LuGre(
            sigma_0=self.sigma_0,
            sigma_1=self.sigma_1,
            sigma_2=self.sigma_2,
            stribeck=self.stribeck.build(),
        )


# --------------------------------------------------------------------------- records
class ColumnTable(_Table):
    """Where a quantity stands."""

    column: str = Field(description="head of the column")
    unit: str = Field(description='for example "mm"')
    sign: Literal[1, -1] = Field(1, description="-1 turns the quantity around")

    def build(self) -> Column:
        """Return the column."""
        return Column(self.column, self.unit, self.sign)


Delimiter = Literal["\t", ";", ",", "|", " "]


class RecordTable(_Table):
    """A measured motion, with the force measured along with it where there is one."""

    file: str = Field(description="CSV or TSV, beside the scenario or in GMS_FSM_DATA")
    time: ColumnTable
    position: ColumnTable | None = None
    velocity: ColumnTable | None = None
    force: ColumnTable | None = Field(None, description="measured friction, to compare with")
    normal: ColumnTable | None = Field(None, description="normal force")
    where: str = Field("", description='which rows count, for example "normal > 4.5 N"')
    smoothing: float | None = Field(None, ge=0, description="time constant of the spline, s")
    delimiter: Delimiter | None = None

    def columns(self) -> dict[str, Column]:
        """Return the columns that are given."""
        names = ("time", "position", "velocity", "force", "normal")
        tables = {name: getattr(self, name) for name in names}
        return {name: table.build() for name, table in tables.items() if table is not None}


class SignalRecordTable(_Table):
    """One measured signal: a time column and a value column."""

    file: str
    time: ColumnTable
    value: ColumnTable
    where: str = Field("", description='which rows count, for example "time > 0.5 s"')
    delimiter: Delimiter | None = None


def _signal_form(given: Any) -> str:
    if isinstance(given, dict | SignalRecordTable):
        return "table"
    if isinstance(given, list):
        return "ramps"
    return "number" if isinstance(given, int | float) else "text"


SignalField = Annotated[
    Annotated[str, Tag("text")]
    | Annotated[float, Tag("number")]
    | Annotated[list[Annotated[list[float], Field(min_length=2, max_length=2)]], Tag("ramps")]
    | Annotated[SignalRecordTable, Tag("table")],
    Discriminator(_signal_form),
]
_SIGNAL = "expression of t in quotes, ramps [[t, value], ...], or a record {file, time, value}"


# --------------------------------------------------------------------------- rigs
class PrescribedTable(_Table):
    """Open loop: v(t) is given."""

    kind: Literal["prescribed"]
    velocity: SignalField = Field(description=f"m/s: {_SIGNAL}")


class RecordedTable(_Table):
    """Open loop: the motion of the table [record]."""

    kind: Literal["record"]


class SliderTable(_Table):
    """A mass pushed by a force."""

    kind: Literal["slider"]
    mass: float = Field(description="kg")
    force: SignalField = Field(description=f"N: {_SIGNAL}")


class PulledTable(_Table):
    """A mass pulled through a spring."""

    kind: Literal["pulled"]
    mass: float = Field(description="kg")
    stiffness: float = Field(description="N/m")
    speed: float = Field(description="m/s")


# --------------------------------------------------------------------------- the run
class RunTable(_Table):
    """How to integrate; see `gms_fsm.simulate`."""

    t_end: float | None = Field(None, description="s; the record's end when left out")
    t_start: float | None = Field(None, description="s; 0, or the record's start")
    method: Literal[
        "dp45", "bs23", "rk4", "heun", "euler", "RK45", "DOP853", "Radau", "BDF", "LSODA"
    ] = "dp45"
    step: float | None = Field(None, gt=0, description="fixed step, s")
    rtol: float = Field(1e-6, gt=0)
    atol: PositiveFloat | dict[str, PositiveFloat | list[PositiveFloat]] | None = Field(
        None,
        description="absolute tolerance of all components, or by name { x, v, z }; from the "
        "model's own scales where left out",
    )
    max_step: float | None = Field(None, gt=0, description="s")
    max_steps: int = Field(MOST_STEPS, ge=1, description="a run that needs more is an error")
    events: Literal["located", "step"] = "located"
    engine: Literal["machines", "ifelse", "compiled"] = "machines"
    monitors: list[str] = Field(
        [],
        description='what to watch for: "chattering", "passivity", "coverage", "all" of these, '
        'and invariants such as "abs(z) <= 2*s"',
    )

    def options(self) -> dict[str, Any]:
        """Return the options for `simulate`."""
        scipy_method = self.method in SCIPY_METHODS
        options: dict[str, Any] = {
            "method": getattr(scipy.integrate, self.method) if scipy_method else self.method,
            "step": self.step,
            "rtol": self.rtol,
            "atol": self.atol,
            "max_steps": self.max_steps,
            "events": self.events,
            "engine": self.engine,
        }
        if self.max_step is not None:
            options["max_step"] = self.max_step
        return options


class InitialTable(_Table):
    """Where the run starts."""

    z: list[float] | None = None
    states: list[str] | None = None
    v: float | None = None
    x: float | None = None


class OutputTable(_Table):
    """What is written."""

    every: float | None = Field(
        None, gt=0, description="rows this far apart [s]; every accepted step when left out"
    )
    figures: list[Literal["png", "svg", "pdf"]] = ["png", "svg"]
    csv: bool = Field(False, description="write the trace as CSV too")


class Scenario(_Table):
    """A scenario file."""

    title: str = ""
    notes: str = Field("", description="said in the summary")
    model: Annotated[GMSTable | LuGreTable, Field(discriminator="kind")]
    rig: Annotated[
        PrescribedTable | RecordedTable | SliderTable | PulledTable, Field(discriminator="kind")
    ]
    record: RecordTable | None = None
    run: RunTable = RunTable()
    initial: InitialTable = InitialTable()
    output: OutputTable = OutputTable()

    @model_validator(mode="after")
    def _fits(self) -> Scenario:
        if isinstance(self.rig, RecordedTable) and self.record is None:
            raise ValueError("rig.kind = 'record' needs a table [record]")
        if not isinstance(self.rig, RecordedTable):
            if self.record is not None:
                raise ValueError("the table [record] goes with rig.kind = 'record'")
            if self.run.t_end is None:
                raise ValueError("run.t_end is missing; only a record knows its own end")
        return self


@dataclass(frozen=True, eq=False)
class Loaded:
    """A scenario with its files read: all that `simulate` needs.

    Parameters
    ----------
    path : Path
        The scenario file.
    scenario : Scenario
        As written.
    model, rig
        What runs.
    arguments : mapping
        Further arguments of `gms_fsm.simulate`, ``t_end`` included.
    record, motion : Record and Motion, or None
        The measurement behind the rig, where there is one.
    """

    path: Path
    scenario: Scenario
    model: Model
    rig: Rig
    arguments: Mapping[str, Any]
    record: Record | None
    motion: Motion | None

    @property
    def title(self) -> str:
        """The scenario's title, or its file's name."""
        return self.scenario.title or self.path.stem


def load_scenario(path: str | Path, overrides: Sequence[str] = ()) -> Loaded:
    """Read a scenario file and the records it names.

    Parameters
    ----------
    path : str or Path
        A TOML file.
    overrides : sequence of str
        ``"model.law=published"``: a key path and a TOML value (a bare word is a text).

    Returns
    -------
    Loaded
        Model, rig and arguments.

    Raises
    ------
    ScenarioError
        Naming file, key, value, rule, and for a mistyped key the nearest valid one.
    RecordError
        Naming file, row and column.
    """
    path = Path(path)
    data = _parse(path)
    if not data:
        raise ScenarioError(
            f"{path}: the file is empty; a scenario has at least the tables [model], [rig] and "
            "[run] (the folder scenarios/ has examples, gms-fsm schema prints all keys)"
        )
    for override in overrides:
        _override(data, override)
    try:
        scenario = Scenario.model_validate(data)
    except ValidationError as error:
        raise ScenarioError(f"{path}: {_explained(error, data)}") from None
    try:
        return _loaded(path, scenario)
    except (RecordError, ScenarioError):
        raise
    except UnitError as error:
        raise ScenarioError(f"{path}: [record] {error}") from None
    except GMSError as error:
        raise ScenarioError(f"{path}: [rig] {error}") from None


def _loaded(path: Path, scenario: Scenario) -> Loaded:
    run, record, motion = scenario.run, None, None
    start, end = run.t_start, run.t_end
    initial = scenario.initial.model_dump(exclude_none=True)
    arguments: dict[str, Any] = run.options()
    rig: Rig
    match scenario.rig:
        case PrescribedTable(velocity=velocity):
            rig = Prescribed(_signal(path, velocity, "rig.velocity", "velocity"))
        case SliderTable(mass=mass, force=force):
            rig = Slider(mass, _signal(path, force, "rig.force", "force"))
        case PulledTable(mass=mass, stiffness=stiffness, speed=speed):
            rig = PulledSlider(mass, stiffness, speed)
        case _:
            assert scenario.record is not None
            table = scenario.record
            record = read_record(
                find_file(path, table.file), table.columns(), table.where, table.delimiter
            )
            motion = motion_of(record, table.smoothing)
            rig = Prescribed(Corners(motion.time, motion.velocity, held=False))
            start = float(motion.time[0]) if start is None else start
            end = float(motion.time[-1]) if end is None else end
            initial.setdefault("x", float(np.interp(start, motion.time, motion.position)))
            inside = (motion.time >= start) & (motion.time <= end)
            if inside.any() and scenario.output.every is None:
                arguments["t_eval"] = motion.time[inside]
    assert end is not None
    start = 0.0 if start is None else start
    if scenario.output.every is not None:
        wanted = max(0.0, (end - start) / scenario.output.every)  # t_end is checked with the rest
        if wanted > 10_000_000:
            raise ScenarioError(
                f"{path}: output.every = {scenario.output.every} s makes {wanted:.4g} rows; take "
                "more"
            )
        count = int(wanted)
        arguments["t_eval"] = np.minimum(start + scenario.output.every * np.arange(count + 1), end)
    arguments |= {"t_start": start, "t_end": end, "initial": initial}
    model = scenario.model.build()
    if run.monitors:
        try:
            arguments["monitors"] = tuple(checked(run.monitors, model).values())
        except GMSError as error:
            raise ScenarioError(f"{path}: run.monitors: {error}") from None
    return Loaded(path, scenario, model, rig, arguments, record, motion)


def _signal(path: Path, given: SignalField, key: str, quantity: str) -> SignalLike:
    if isinstance(given, SignalRecordTable):
        file = find_file(path, given.file)
        # The value column is read as the quantity it stands for, so that units are checked.
        columns = {"time": given.time.build(), quantity: given.value.build()}
        try:
            record = read_record(file, columns, given.where, given.delimiter)
        except UnitError as error:
            raise ScenarioError(f"{path}: {key}: {error}") from None
        rows = record.chosen
        return Corners(record.columns["time"][rows], record.columns[quantity][rows], held=False)
    try:
        if isinstance(given, list):
            return as_signal([(t, value) for t, value in given])
        return as_signal(given)
    except GMSError as error:
        raise ScenarioError(f"{path}: {key} = {shown(given)}: {error}") from None


def find_file(scenario: Path, name: str) -> Path:
    """Return the file a scenario names: beside it, or in the data folder.

    Parameters
    ----------
    scenario : Path
        The scenario file.
    name : str
        A relative path that stays inside the folder.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ScenarioError
        If the path leads outside, or there is no such file.
    """
    wanted = Path(name)
    folders = [scenario.parent]
    if os.environ.get(DATA_VARIABLE):
        folders.append(Path(os.environ[DATA_VARIABLE]))
    for folder in folders:
        try:
            place = (folder / wanted).resolve()
            there = place.is_file()
        except (OSError, ValueError) as error:  # too long, or with a null byte
            raise ScenarioError(
                f"{scenario}: file = {shown(name)} is not a file name ({cut(str(error))})"
            ) from None
        if wanted.is_absolute() or not place.is_relative_to(folder.resolve()):
            raise ScenarioError(
                f"{scenario}: file = {shown(name)} leads outside of the scenario's folder; put "
                f"the file beside the scenario, or in the folder named by {DATA_VARIABLE}"
            )
        if there:
            return folder / wanted
    looked = " and ".join(str(folder) for folder in folders)
    hint = "" if len(folders) > 1 else f" (a data folder can be named by {DATA_VARIABLE})"
    raise ScenarioError(f"{scenario}: file = {shown(name)}: no such file in {looked}{hint}")


# --------------------------------------------------------------------------- reading and explaining
def _parse(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            raw = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise ScenarioError(f"{path}: no such file; check its name and the folder") from None
    except OSError as error:
        raise ScenarioError(
            f"{path}: cannot be read ({error.strerror}); give a file that can"
        ) from None
    if len(raw) > LARGEST_FILE:
        raise ScenarioError(f"{path}: larger than {LARGEST_FILE} bytes; records go in own files")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ScenarioError(f"{path}: not UTF-8 text; a scenario is a TOML file") from None
    if endless := _ENDLESS_KEY.search(text):
        line = text.count("\n", 0, endless.start()) + 1
        raise ScenarioError(
            f"{path}: line {line}: a key of more than 20 parts; no key lies this deep"
        )
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number of 5,000 digits is a ValueError
        hint = _with_digits(text)
        raise ScenarioError(f"{path}: not valid TOML: {cut(str(error))}{hint}") from None


def _with_digits(text: str) -> str:
    """Return advice on the first number of a text that TOML does not take: .25 or 5."""
    for number, line in enumerate(text.splitlines(), start=1):
        found = _HALF_A_NUMBER.search(_TEXT_OR_COMMENT.sub("", line))
        if found:
            sign, whole, part, exponent = found.groups()
            better = f"{sign}{whole or 0}.{part or 0}{exponent}"
            return f"; line {number}: write {better}, not {found[0]}"
    return ""


def _override(data: dict[str, Any], override: str) -> None:
    key, equals, text = override.partition("=")
    parts = [part.strip() for part in key.split(".")]
    if not equals or not all(parts):
        raise ScenarioError(
            f"--set {cut(override)}: give it as key=value, for example run.t_end=10"
        )
    if "\n" in override:
        line = override.partition("\n")[0]
        raise ScenarioError(f"--set {cut(line)}: one key and one value, on one line")
    if len(parts) > DEEPEST_KEY:
        raise ScenarioError(f"--set {cut(override)}: no key lies this deep")
    if _ENDLESS_KEY.search(text):
        raise ScenarioError(f"--set {cut(override)}: no key lies this deep")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
        hint = _with_digits(text)
        if hint and (value[0] in "[{" or _HALF_A_NUMBER.fullmatch(value)):
            raise ScenarioError(f"--set {cut(override)}: not valid TOML{hint}") from None
    except (ValueError, RecursionError) as error:
        raise ScenarioError(f"--set {cut(override)}: {cut(str(error))}") from None
    table = data
    for part in parts[:-1]:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise ScenarioError(f"--set {cut(override)}: {shown(part)} is a value, not a table")
    table[parts[-1]] = value


_TAGS = {"GMS", "LuGre", "prescribed", "record", "slider", "pulled"}
_FORMS = {"text", "number", "ramps", "table"}


def _written_key(loc: tuple[int | str, ...]) -> list[str]:
    """Return a finding's place as the user wrote it: without the tags of the forms chosen."""
    places: list[str] = []
    for number, part in enumerate(loc):
        after = str(loc[number - 1]) if number else ""
        tag = (after in ("model", "rig") and part in _TAGS) or (
            after in ("velocity", "force") and part in _FORMS
        )
        optional = after == "C" and part in ("float", "list[float]")
        if not tag and not optional:
            places.append(str(part))
    return places


def _explained(error: ValidationError, data: dict[str, Any]) -> str:
    """Put the first finding of a validation into one sentence, and count the rest."""
    findings = error.errors(include_url=False)
    # An unknown key is most often the cause of a missing one: say it first.
    first = min(findings, key=lambda f: f["type"] != "extra_forbidden")
    places = _written_key(first["loc"])
    key = cut(".".join(places))
    value = first.get("input")
    rest = len(findings) - 1
    more = f" (and {rest} more)" if rest else ""
    kind = first["type"]
    if kind == "extra_forbidden":
        valid = _valid_keys(places[:-1], data)
        wanted = places[-1][:LONGEST_SHOWN]
        near = difflib.get_close_matches(wanted, valid, n=1) or _elsewhere(wanted, data)
        hint = f"did you mean {near[0]!r}? " if near else ""
        return f"{key} = {shown(value)}: unknown key; {hint}valid here: {', '.join(valid)}{more}"
    if kind == "missing":
        return f"{key} is missing{more}"
    if kind == "union_tag_not_found":
        return f"{key}.kind is missing{more}"
    if kind == "union_tag_invalid":
        allowed = first["ctx"]["expected_tags"]
        return f"{key}.kind = {shown(first['ctx']['tag'])}: it must be one of {allowed}{more}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{key} = {shown(value)}: it must be a table, [{key}]{more}"
    text = first["msg"].removeprefix("Value error, ")
    text = text.replace("Input should be", "it must be")
    if isinstance(value, dict):
        return f"[{key}] {text}{more}" if key else f"{text}{more}"
    return f"{key} = {shown(value)}: {text}{more}"


def _elsewhere(key: str, data: dict[str, Any]) -> list[str]:
    """Return the nearest key of another table, with its table."""
    everywhere = ("run", "initial", "output")
    tables = [name for name in Scenario.model_fields if name in data or name in everywhere]
    places = {name: f"{table}.{name}" for table in tables for name in _valid_keys([table], data)}
    return [places[name] for name in difflib.get_close_matches(key, places, n=1)]


def _valid_keys(places: list[str], data: dict[str, Any]) -> list[str]:
    """Return the keys that are valid in a table of the file."""
    kind: Any = Scenario
    table: Any = data
    for place in places:
        if place.isdigit():
            return []
        annotation = kind.model_fields[place].annotation
        table = table.get(place, {}) if isinstance(table, dict) else {}
        options = _tables_in(annotation)
        wanted = table.get("kind") if isinstance(table, dict) else None
        fitting = [t for t in options if wanted in _kinds(t)]
        if not (fitting or options):
            return []
        kind = (fitting or options)[0]
    return list(kind.model_fields)


def _tables_in(annotation: Any) -> list[type[BaseModel]]:
    """Return the tables an annotation allows, inside unions and annotations too."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [table for part in get_args(annotation) for table in _tables_in(part)]


def _kinds(table: type[BaseModel]) -> tuple[Any, ...]:
    found = table.model_fields.get("kind")
    return get_args(found.annotation) if found else (None,)
