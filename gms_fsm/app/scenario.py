"""Scenario files: a complete run as one TOML file, validated before the run.

Nothing in a scenario is executed: signals are expressions of t, ramps, or measured records, and a
record file must be in the folder of the scenario (or in the data folder named by GMS_FSM_DATA).
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
from pydantic import TypeAdapter

from gms_fsm.app._tables import (
    BeltTable,
    PrescribedTable,
    PulledTable,
    RecordTable,
    RunTable,
    Scenario,
    SignalField,
    SignalRecordTable,
    SliderTable,
    SystemScenario,
)
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import GMSError, ParameterError, RecordError, ScenarioError, cut
from gms_fsm.foundation.arguments import no_file, some_of, unknown
from gms_fsm.foundation.files import inside
from gms_fsm.foundation.tables import read
from gms_fsm.foundation.toml import Key, TomlFile, parsed
from gms_fsm.records.motion import Motion
from gms_fsm.records.record import Record
from gms_fsm.run.problem import checked_times
from gms_fsm.run.simulate import simulate
from gms_fsm.scenarios import scenario_path, shipped
from gms_fsm.session.session import Session
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import mounted, mounted_alone
from gms_fsm.systems.rigs import Belt, Prescribed, PulledSlider, Rig, Slider
from gms_fsm.systems.signals import Corners, SignalLike, as_signal
from gms_fsm.systems.system import System
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.monitors import checked
from gms_fsm.traces.trace import Trace

if TYPE_CHECKING:
    from gms_fsm.debugger.dap import Launched

__all__ = [
    "DATA_VARIABLE",
    "Loaded",
    "Scenario",
    "load_scenario",
    "load_system",
]
__all__ += ["schema", "session_of"]

DATA_VARIABLE = "GMS_FSM_DATA"
MOST_ROWS = 10_000_000


@dataclass(frozen=True, eq=False)
class Loaded:
    """A scenario with its files read, ready for `simulate`.

    Parameters
    ----------
    file : TomlFile
        The scenario file.
    scenario : Scenario or SystemScenario
        Its contents.
    model, rig
        What to simulate; of a system its only contact, and the rest.
    arguments : mapping
        Further arguments of `gms_fsm.simulate`, including ``t_end``.
    record, motion : Record and Motion, or None
        The measurement used by the rig, if any.
    system : System, optional
        The system, if the file describes one.
    """

    file: TomlFile
    scenario: Scenario | SystemScenario
    model: Model
    rig: Rig
    arguments: Mapping[str, Any]
    record: Record | None
    motion: Motion | None
    system: System | None = None

    @property
    def path(self) -> Path:
        """The scenario file."""
        return self.file.path

    @property
    def title(self) -> str:
        """The title of the scenario; if it has none, the system's name or the file name."""
        name = self.path.stem if self.system is None else self.system.name
        return self.scenario.title or name

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files that were read."""
        measured = None if self.record is None else self.record.path
        return (self.path,) if measured is None else (self.path, measured)

    @property
    def subject(self) -> tuple[Any, ...]:
        """The first arguments of `gms_fsm.simulate`: model, rig and t_end, or system and t_end."""
        what = (self.model, self.rig) if self.system is None else (self.system,)
        return (*what, self.arguments["t_end"])

    @property
    def contacts(self) -> tuple[str, ...]:
        """The names of the contacts, unless a single one is all that switches."""
        if self.system is None or len(self.system.machines) == 1:
            return ()
        return tuple(each.name for each in self.system.contacts)

    def simulate(self, **options: Any) -> Trace:
        """Run it.

        Parameters
        ----------
        **options
            Further arguments of `gms_fsm.simulate`.

        Returns
        -------
        Trace
            The run.

        Raises
        ------
        ScenarioError
            If `simulate` rejects an argument; the message names the line that gives it.
        SimulationError
            If the run cannot continue.
        """
        given: Any = {**self.arguments, **options}
        what: Any = (*self.subject[:-1], given.pop("t_end"))
        with self.blaming():
            return replace(simulate(*what, **given), heading=self.scenario.title)

    @contextmanager
    def blaming(self) -> Iterator[None]:
        """Errors in the arguments of a run name the line of the file that gives the argument."""
        try:
            yield
        except SimulationError:
            raise
        except GMSError as error:
            first, *rest = error.key or (error.place,)
            key: Key = ("initial", *rest) if first == "initial" else ()
            if first == "t_eval":
                key = ("output", "every")
            elif first in RunTable.model_fields:
                key = ("run", first, *rest)
            raise self.file.blamed(ScenarioError.of(error), key) from None


def load_scenario(path: str | Path, overrides: Sequence[str] = ()) -> Loaded:
    """Read a scenario file and the records it names.

    Parameters
    ----------
    path : str or Path
        A TOML file, or the name of a scenario of the package, such as "servo".
    overrides : sequence of str
        ``"model.law=published"``: a key path and a TOML value (a bare word is a string).

    Returns
    -------
    Loaded
        Model and rig, or system, and arguments.

    Raises
    ------
    ScenarioError
        If the file is invalid; the message names file, key, value, rule, and for a mistyped key the
        nearest valid one.
    RecordError
        If a record is invalid; the message names file, row and column.
    """
    path = scenario_file(path)
    data = parsed(path)
    if not data:
        raise ScenarioError(
            "the file is empty",
            place=str(path),
            advice="a scenario needs at least the tables [model], [rig] and [run], or [[body]], "
            "[[contact]] and [run] (`gms-fsm copy servo` gives an example, `gms-fsm schema` prints "
            "all keys)",
        )
    if kind_of(data) == "chart":
        raise ScenarioError(
            "this is a chart file, which says nothing about bodies",
            place=str(path),
            advice="name it in a [[contact]] of a system file; "
            f"`gms-fsm chart {path}` and `gms-fsm check {path}` take the chart itself",
        )
    if kind_of(data) == "system":
        return _loaded_system(path, overrides)
    file = TomlFile.of(path, overrides=overrides)
    return _loaded(file, read(file, Scenario, ScenarioError, lambda table: table))


@contextmanager
def blaming(file: TomlFile, *key: str) -> Iterator[None]:
    """Errors within name the line of a key of a file, or of one in it.

    One in the rows of a table names the file and the row of the table.
    """
    try:
        yield
    except GMSError as error:
        wrong = error if isinstance(error, RecordError) else ScenarioError.of(error)
        inner = error.key or ((error.place,) if error.place and not error.outer else ())
        if wrong is error and not error.key:
            raise
        raise file.blamed(wrong, (*key, *inner)) from None


def scenario_file(given: str | Path) -> Path:
    """Return the path of a scenario; refuse a file that is none of ours, or a run."""
    path = scenario_path(given)
    if path.is_dir():
        raise ScenarioError(
            "it is a folder",
            place=str(path),
            advice=f"give {some_of(sorted(map(str, path.glob('*.toml'))))}"
            if any(path.glob("*.toml"))
            else "give a scenario (.toml)",
        )
    match path.suffix.lower():
        case ".py":
            raise ScenarioError(
                "it is a Python file, and a scenario (.toml) is wanted",
                place=str(path),
                advice="for a custom model use simulate(model, rig, t_end), or "
                "Debugger(Session(model, rig, t_end)).run(), see docs/howto/debugging.md",
            )
        case ".npz" | ".csv":
            raise ScenarioError(
                "it is a trace or a table, and a scenario (.toml) is wanted",
                place=str(path),
                advice="a table of measurements is named in the [record] of a scenario; a trace "
                f"is drawn by `gms-fsm plot {path}`, and `gms-fsm replay {path}` steps through it",
            )
        case ".md" | ".html" | ".png" | ".svg" | ".pdf" | ".json" if path.exists():
            raise ScenarioError(
                f"it is a {path.suffix} file, and a scenario (.toml) is wanted",
                place=str(path),
                advice="`gms-fsm copy servo` gives an example",
            )
        case ".toml" if path.stem in shipped() and len(path.parts) == 1 and not path.exists():
            raise ScenarioError(
                "no such file", place=path.name, advice=f"that of the package is {path.stem!r}"
            )
        case "" if len(path.parts) == 1 and not path.exists():
            if path.with_suffix(".toml").is_file():
                raise ScenarioError(
                    f"there is no file or scenario {path.name!r}",
                    advice=f"did you mean '{path.name}.toml'?",
                )
            raise unknown("file or scenario", path.name, shipped(), ScenarioError)
    return path


def kind_of(data: Mapping[str, Any]) -> str:
    """Return what a file describes, by its tables."""
    for kind, tables in _TABLES.items():
        if data.keys() & tables:
            return kind
    return ""


_TABLES = {
    "system": {"body", "bodies", "contact", "contacts", "supervisor", "supervisors"},
    "rig": {"model", "rig"},
    "chart": {"state", "states", "edge", "transitions"},
}


def schema() -> dict[str, Any]:
    """Return the JSON schema of scenario files.

    Returns
    -------
    dict
        A model on a rig, or a system.
    """
    both: TypeAdapter[Any] = TypeAdapter(Scenario | SystemScenario)
    return both.json_schema()


# --------------------------------------------------------------------------- systems
def load_system(path: str | Path, overrides: Sequence[str] = ()) -> System:
    """Read the system of a system file or a scenario file.

    Parameters
    ----------
    path : str or Path
        A TOML file, or the name of a scenario of the package, such as "servo".
    overrides : sequence of str
        As in `load_scenario`.

    Returns
    -------
    System
        Checked.

    Raises
    ------
    ScenarioError
        Naming file, line, key and text.
    """
    path = scenario_file(path)
    if kind_of(parsed(path)) == "rig":
        raise ScenarioError(
            "it is a model on a rig, not a system", place=str(path), advice="use load_scenario"
        )
    return read_system(path, overrides)[2]


def read_system(path: Path, overrides: Sequence[str]) -> tuple[TomlFile, SystemScenario, System]:
    """Return a scenario file of a system, its contents, and the system."""

    def build(table: SystemScenario) -> tuple[TomlFile, SystemScenario, System]:
        return file, table, table.chosen(path.parent, System)

    _check_numbers(path, overrides)
    file = TomlFile.of(path, overrides=overrides)
    try:
        return read(file, SystemScenario, ScenarioError, build)
    except GMSError as error:
        raise ScenarioError.of(error) from None


def _check_numbers(path: Path, overrides: Sequence[str]) -> None:
    """Refuse an override of a number that there is not: it would be a new one, never read."""
    numbers = parsed(path).get("numbers", {})
    for each in overrides:
        table, _, name = each.partition("=")[0].strip().partition(".")
        if table == "numbers" and isinstance(numbers, dict) and name not in numbers:
            raise unknown("number", name, numbers, ScenarioError, place=f"--set {cut(each)}")


def _loaded_system(path: Path, overrides: Sequence[str]) -> Loaded:
    file, scenario, system = read_system(path, overrides)
    run = scenario.run
    start, end = run.t_start or 0.0, run.t_end
    if end is None:
        missing = ScenarioError(
            "run.t_end is missing",
            advice="add a table [run] with t_end in s, or give --set run.t_end=10.0",
        )
        raise file.blamed(missing, ("run",))
    _check_end(file, start, end)
    arguments = run.options() | {"t_start": start, "t_end": end}
    if initial := scenario.initial_values():
        arguments["initial"] = initial
    if scenario.output.every is not None:
        arguments["t_eval"] = _rows(file, scenario.output.every, start, end)
    what = mounted(system)
    if run.monitors:
        arguments["monitors"] = tuple(run.monitors)  # checked by the run
    return Loaded(file, scenario, what.model, what.rig, arguments, None, None, system)


def _check_end(file: TomlFile, start: float, end: float) -> None:
    """Refuse a run that ends before it starts, or too late for its clock."""
    if end > start:
        try:
            checked_times(start, end)
        except ParameterError as error:
            raise file.blamed(ScenarioError.of(error), ("run", error.place)) from None
        return
    if "t_end" in file.data.get("run", {}):
        late = f"it must be later than t_start, {start!r}"
        raise file.blamed(ScenarioError(late, place="t_end", value=end), ("run", "t_end"))
    late = f"it must be earlier than the end of the record, {end!r}"
    raise file.blamed(ScenarioError(late, place="t_start", value=start), ("run", "t_start"))


def _rows(file: TomlFile, every: float, start: float, end: float) -> FloatArray:
    """Return the times of the rows."""
    wanted = (end - start) / every
    if wanted < 1.0:
        few = ScenarioError(
            f"it is longer than the run, {end - start:g} s",
            place="every",
            value=every,
            advice=f"it is the time between rows, in s; for 1000 rows {(end - start) / 1000:.3g}",
        )
        raise file.blamed(few, ("output", "every"))
    if wanted > MOST_ROWS:
        many = ScenarioError(
            f"it gives {wanted:.4g} rows, and at most {MOST_ROWS:,} can be kept",
            place="every",
            value=every,
            advice=f"use at least {(end - start) / MOST_ROWS:.1g} s",
        )
        raise file.blamed(many, ("output", "every"))
    times: FloatArray = np.minimum(start + every * np.arange(int(wanted) + 1), end)
    return times


# --------------------------------------------------------------------------- a model on a rig
def _loaded(file: TomlFile, scenario: Scenario) -> Loaded:
    run, record, motion = scenario.run, None, None
    start, end = run.t_start, run.t_end
    initial = scenario.initial.model_dump(exclude_none=True)
    arguments: dict[str, Any] = run.options()
    rig: Rig
    match scenario.rig:
        case PrescribedTable(velocity=velocity):
            rig = Prescribed(_signal(file, velocity, "velocity"))
        case SliderTable(mass=mass, force=force):
            push = _signal(file, force, "force")
            with blaming(file, "rig"):
                rig = Slider(mass, push)
        case PulledTable(mass=mass, stiffness=stiffness, speed=speed):
            with blaming(file, "rig"):
                rig = PulledSlider(mass, stiffness, speed)
        case BeltTable(mass=mass, stiffness=stiffness, speed=speed, damping=damping):
            with blaming(file, "rig"):
                rig = Belt(mass, stiffness, speed, damping)
        case _:
            assert scenario.record is not None
            record = read_record(file, scenario.record)
            with blaming(file, "record"):
                motion = record.motion(scenario.record.smoothing)
            inputs = {
                name: Corners(motion.time, value, held=False)
                for name, value in record.inputs.items()
            }
            rig = Prescribed(Corners(motion.time, motion.velocity, held=False), inputs)
            start = float(motion.time[0]) if start is None else start
            end = float(motion.time[-1]) if end is None else end
            initial.setdefault("x", float(np.interp(start, motion.time, motion.position)))
            inside = (motion.time >= start) & (motion.time <= end)
            if inside.any() and scenario.output.every is None:
                arguments["t_eval"] = motion.time[inside]
    assert end is not None
    start = 0.0 if start is None else start
    _check_end(file, start, end)
    if scenario.output.every is not None:
        arguments["t_eval"] = _rows(file, scenario.output.every, start, end)
    arguments |= {"t_start": start, "t_end": end, "initial": initial}
    model = scenario.model.build()
    loaded = Loaded(file, scenario, model, rig, arguments, record, motion)
    if run.monitors:
        with loaded.blaming():
            arguments["monitors"] = tuple(checked(run.monitors, mounted_alone(model)).values())
    return loaded


def _signal(file: TomlFile, given: SignalField, quantity: str) -> SignalLike:
    with blaming(file, "rig", quantity):
        if isinstance(given, SignalRecordTable):
            path = find_file(file.path, given.file)
            # The value column is read as the quantity it represents, so that units are checked.
            try:
                record = given.read(path, {quantity: given.value.build()})
            except GMSError as error:
                key = ["value" if part == quantity else part for part in error.key]
                raise error.replaced(key=(*key,)) from None
            rows = record.chosen
            return Corners(record.columns["time"][rows], record.columns[quantity][rows], held=False)
        return as_signal([(t, value) for t, value in given] if isinstance(given, list) else given)


def read_record(file: TomlFile, table: RecordTable) -> Record:
    """Read the record of a scenario."""
    with blaming(file, "record"):
        return table.read(find_file(file.path, table.file), table.quantities())


def find_file(scenario: Path, name: str) -> Path:
    """Return the path of a file named in a scenario, in its folder or in the data folder."""
    folders = [scenario.parent]
    if os.environ.get(DATA_VARIABLE):
        folders.append(Path(os.environ[DATA_VARIABLE]))
    for folder in folders:
        try:
            found = inside(folder, name)
        except (OSError, ValueError) as error:  # too long, or contains a null byte
            raise ScenarioError(
                f"it is not a file name ({cut(str(error))})",
                place="file",
                value=name,
                advice="name a table beside the scenario",
            ) from None
        if found is None:
            raise ScenarioError(
                "it is outside the folder of the scenario",
                place="file",
                value=name,
                advice="put the file next to the scenario, or in the folder named by "
                f"{DATA_VARIABLE}",
            )
        if found.is_file():
            return found
    missing = no_file(folders[0] / name, ScenarioError)
    second = f"or in {folders[1]}, the" if len(folders) > 1 else f"or set {DATA_VARIABLE} to a"
    raise missing.replaced(
        place="file",
        value=name,
        advice=f"{missing.advice}; put it beside the scenario, {second} data folder",
    )


def session_of(loaded: Loaded) -> Session:
    """Return a session of a scenario.

    Parameters
    ----------
    loaded : Loaded
        From `load_scenario`. Requested times are ignored: a session has a row
        at every step.

    Returns
    -------
    Session
        At the start of the run.

    Raises
    ------
    ScenarioError
        If the run of the scenario cannot be set up.
    """
    not_here = ("t_end", "t_eval", "monitors")
    options = {name: value for name, value in loaded.arguments.items() if name not in not_here}
    with loaded.blaming():
        return Session(*loaded.subject, **options)


def run_debugger(loaded: Loaded, stdin: TextIO | None = None, stdout: TextIO | None = None) -> int:
    """Open a scenario in the debugger."""
    from gms_fsm.debugger import Debugger

    return Debugger(session_of(loaded), loaded.title, stdin, stdout).run()


def launched(given: Mapping[str, Any]) -> Launched:
    """Return the session that a launch request of an editor asks for."""
    from gms_fsm.debugger.dap import Launched

    program, settings = given.get("program"), given.get("set") or []
    if not isinstance(program, str) or not program:
        raise ScenarioError(
            "give a scenario file, or the name of a scenario of the package",
            place="program",
            value=program,
        )
    if not isinstance(settings, list) or not all(isinstance(each, str) for each in settings):
        raise ScenarioError(
            'give a list of texts, for example ["model.law=signed"]', place="set", value=settings
        )
    engine = [f"run.engine={given['engine']}"] if given.get("engine") else []
    loaded = load_scenario(program, [*settings, *engine])
    return Launched(session_of(loaded), loaded.title, loaded.path)
