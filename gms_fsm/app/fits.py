"""Fits of a scenario: the record, the model and the table [fit] of a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gms_fsm.app._tables import FitTable, RecordTable, Scenario, SystemScenario
from gms_fsm.app.scenario import (
    blaming,
    kind_of,
    load_scenario,
    read_record,
    read_system,
    scenario_file,
)
from gms_fsm.errors import ScenarioError
from gms_fsm.foundation.toml import parsed
from gms_fsm.identification.fit import task_of
from gms_fsm.identification.problem.task import Task
from gms_fsm.scenarios import shipped
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import System

__all__ = ["LoadedFit", "load_fit"]

EXAMPLE = 'free = ["k"] and further keys of gms_fsm.fit'


@dataclass(frozen=True, eq=False)
class LoadedFit:
    """A fit that a file describes, with its record read."""

    path: Path  # the scenario file
    task: Task  # model, record and options, checked; for `gms_fsm.identification.fit.fitted`
    notes: tuple[str, ...] = ()  # what in the file has no effect on a fit

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files that were read."""
        read = (each.path for each in self.task.records)
        return (self.path, *(path for path in read if path is not None))


def load_fit(path: str | Path, overrides: Sequence[str] = ()) -> LoadedFit:
    """Read a scenario file with a table [fit], and its record."""
    path = scenario_file(path)
    scenario: Scenario | SystemScenario
    model: Model | System
    if kind_of(parsed(path)) == "system":
        file, scenario, model = read_system(path, overrides)
        table, columns = _given(path, scenario)
        record = read_record(file, columns)
    else:
        loaded = load_scenario(path, overrides)
        file, scenario, model = loaded.file, loaded.scenario, loaded.model
        table, columns = _given(path, scenario)
        assert loaded.record is not None
        record = loaded.record
    unused = [f"[{name}]" for name in ("run", "initial") if name in scenario.model_fields_set]
    notes = (f"a fit ignores {' and '.join(unused)}",) if unused else ()
    with blaming(file, "fit"):
        task = task_of(record, model, table.fixed, table.options(columns.smoothing))
    return LoadedFit(path, task, notes)


def _given(path: Path, scenario: Scenario | SystemScenario) -> tuple[FitTable, RecordTable]:
    """Return the tables [fit] and [record] of a file that has both."""
    if scenario.fit is None and path in shipped().values():
        raise ScenarioError(
            "a scenario of the package has no [record] and no [fit]",
            place=path.stem,
            advice=f"copy it with `gms-fsm copy {path.stem}`, and add them to the copy",
        )
    if scenario.fit is None:
        raise ScenarioError(
            "there is no table [fit]", place=str(path), advice=f"add one with {EXAMPLE}"
        )
    if scenario.record is None:
        raise ScenarioError(
            "there is no table [record], and a fit needs a measured force",
            place=str(path),
            advice='add [record] with file, time, position and force; and kind = "record" in [rig]',
        )
    return scenario.fit, scenario.record
