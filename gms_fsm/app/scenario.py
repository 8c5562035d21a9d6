"""Scenario files: a complete run as one TOML file, validated before the run.

Nothing in a scenario is executed: signals are expressions of t, ramps, or measured records, and a
record file must be in the folder of the scenario (or in the data folder named by GMS_FSM_DATA).
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from gms_fsm._files import inside
from gms_fsm._records import explained
from gms_fsm._toml import override, parsed
from gms_fsm.app._tables import (
    PrescribedTable,
    PulledTable,
    Scenario,
    SignalField,
    SignalRecordTable,
    SliderTable,
)
from gms_fsm.app.records import Motion, Record, motion_of, read_record
from gms_fsm.errors import GMSError, RecordError, ScenarioError, UnitError, cut, shown
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Prescribed, PulledSlider, Rig, Slider
from gms_fsm.systems.signals import Corners, SignalLike, as_signal
from gms_fsm.traces.monitors import checked

__all__ = ["DATA_VARIABLE", "Loaded", "Scenario", "load_scenario"]

DATA_VARIABLE = "GMS_FSM_DATA"


@dataclass(frozen=True, eq=False)
class Loaded:
    """A scenario with its files read, ready for `simulate`.

    Parameters
    ----------
    path : Path
        The scenario file.
    scenario : Scenario
        The contents of the file.
    model, rig
        The system to simulate.
    arguments : mapping
        Further arguments of `gms_fsm.simulate`, including ``t_end``.
    record, motion : Record and Motion, or None
        The measurement used by the rig, if any.
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
        """The title of the scenario, or its file name."""
        return self.scenario.title or self.path.stem


def load_scenario(path: str | Path, overrides: Sequence[str] = ()) -> Loaded:
    """Read a scenario file and the records it names.

    Parameters
    ----------
    path : str or Path
        A TOML file.
    overrides : sequence of str
        ``"model.law=published"``: a key path and a TOML value (a bare word is a string).

    Returns
    -------
    Loaded
        Model, rig and arguments.

    Raises
    ------
    ScenarioError
        If the file is invalid; the message names file, key, value, rule, and for a mistyped key the
        nearest valid one.
    RecordError
        If a record is invalid; the message names file, row and column.
    """
    path = Path(path)
    data = parsed(path)
    if not data:
        raise ScenarioError(
            "the file is empty",
            place=str(path),
            advice="a scenario needs at least the tables [model], [rig] and [run] (see the "
            "examples in scenarios/; gms-fsm schema prints all keys)",
        )
    for setting in overrides:
        override(data, setting)
    try:
        scenario = Scenario.model_validate(data)
    except ValidationError as error:
        _, sentence = explained(error, data, Scenario)
        raise ScenarioError(sentence, place=str(path)) from None
    try:
        return _loaded(path, scenario)
    except (RecordError, ScenarioError):
        raise
    except UnitError as error:
        place = f"[record] {error.place}".rstrip()
        raise ScenarioError.of(error).replaced(place=place).inside(path) from None
    except GMSError as error:
        place = f"[rig] {error.place}".rstrip()
        raise ScenarioError.of(error).replaced(place=place).inside(path) from None


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
        wanted = max(0.0, (end - start) / scenario.output.every)  # t_end is checked later
        if wanted > 10_000_000:
            raise ScenarioError(
                f"output.every = {scenario.output.every} s gives {wanted:.4g} rows",
                place=str(path),
                advice="use a larger value",
            )
        count = int(wanted)
        arguments["t_eval"] = np.minimum(start + scenario.output.every * np.arange(count + 1), end)
    arguments |= {"t_start": start, "t_end": end, "initial": initial}
    model = scenario.model.build()
    if run.monitors:
        try:
            arguments["monitors"] = tuple(checked(run.monitors, model).values())
        except GMSError as error:
            raise ScenarioError.of(error).inside("run.monitors").inside(path) from None
    return Loaded(path, scenario, model, rig, arguments, record, motion)


def _signal(path: Path, given: SignalField, key: str, quantity: str) -> SignalLike:
    if isinstance(given, SignalRecordTable):
        file = find_file(path, given.file)
        # The value column is read as the quantity it represents, so that units are checked.
        columns = {"time": given.time.build(), quantity: given.value.build()}
        try:
            record = read_record(file, columns, given.where, given.delimiter)
        except UnitError as error:
            raise ScenarioError.of(error).inside(key).inside(path) from None
        rows = record.chosen
        return Corners(record.columns["time"][rows], record.columns[quantity][rows], held=False)
    try:
        if isinstance(given, list):
            return as_signal([(t, value) for t, value in given])
        return as_signal(given)
    except GMSError as error:
        raise ScenarioError.of(error).inside(f"{key} = {shown(given)}").inside(path) from None


def find_file(scenario: Path, name: str) -> Path:
    """Return the path of a file named in a scenario, in its folder or in the data folder.

    Parameters
    ----------
    scenario : Path
        The scenario file.
    name : str
        A relative path inside the folder.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ScenarioError
        If the path leads outside the folder, or there is no such file.
    """
    folders = [scenario.parent]
    if os.environ.get(DATA_VARIABLE):
        folders.append(Path(os.environ[DATA_VARIABLE]))
    for folder in folders:
        try:
            found = inside(folder, name)
        except (OSError, ValueError) as error:  # too long, or contains a null byte
            raise ScenarioError(
                f"file = {shown(name)} is not a file name ({cut(str(error))})", place=str(scenario)
            ) from None
        if found is None:
            raise ScenarioError(
                f"file = {shown(name)} is outside the folder of the scenario",
                place=str(scenario),
                advice="put the file next to the scenario, or in the folder named by "
                f"{DATA_VARIABLE}",
            )
        if found.is_file():
            return found
    looked = " and ".join(str(folder) for folder in folders)
    hint = "" if len(folders) > 1 else f" (set {DATA_VARIABLE} to name a data folder)"
    raise ScenarioError(
        f"file = {shown(name)}: no such file in {looked}{hint}", place=str(scenario)
    )
