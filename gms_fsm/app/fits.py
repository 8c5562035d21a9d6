"""Fits of a scenario: the record, the model and the table [fit] of a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gms_fsm._toml import parsed
from gms_fsm.app._tables import FitTable, RecordTable
from gms_fsm.app.scenario import find_file, kind_of, load_scenario, read_system
from gms_fsm.errors import GMSError, RecordError, ScenarioError
from gms_fsm.identification.fit import fit
from gms_fsm.identification.result import Fit
from gms_fsm.records.record import Record
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import System

__all__ = ["FitTask", "load_fit"]

EXAMPLE = 'free = ["k"] and further keys of gms_fsm.fit'


@dataclass(frozen=True, eq=False)
class FitTask:
    """A fit that a file describes, with its record read.

    Parameters
    ----------
    path : Path
        The scenario file.
    title : str
        Of the scenario; the name of the file if it has none.
    model : Model or System
        With the values from which the search starts.
    record : Record
        The measurement.
    options : mapping
        Further arguments of `gms_fsm.fit`.
    notes : tuple of str
        What in the file has no effect on a fit.
    """

    path: Path
    title: str
    model: Model | System
    record: Record
    options: Mapping[str, Any]
    notes: tuple[str, ...] = ()

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files that were read."""
        return (self.path,) if self.record.path is None else (self.path, self.record.path)

    def run(self, **options: Any) -> Fit:
        """Search.

        Parameters
        ----------
        **options
            Further arguments of `gms_fsm.fit`.

        Returns
        -------
        Fit
            The result; after Ctrl-C the best so far.

        Raises
        ------
        ScenarioError
            If the table [fit] does not suit the model.
        RecordError
            If the record does not suit a fit.
        """
        try:
            return fit(self.record, self.model, **{**self.options, **options})
        except RecordError:
            raise
        except GMSError as error:
            raise ScenarioError.of(error).inside("[fit]").inside(self.path) from None


def load_fit(path: str | Path, overrides: Sequence[str] = ()) -> FitTask:
    """Read a scenario file with a table [fit], and its record.

    Parameters
    ----------
    path : str or Path
        A TOML file: [model], [rig] of kind "record", [record] and [fit]; or a system file with
        [record] and [fit].
    overrides : sequence of str
        As in `gms_fsm.app.scenario.load_scenario`.

    Returns
    -------
    FitTask
        Ready to run.

    Raises
    ------
    ScenarioError
        If the file is invalid, or has no record or no table [fit].
    RecordError
        If the record is invalid.
    """
    path = Path(path)
    if kind_of(parsed(path)) == "system":
        scenario, system = read_system(path, overrides)
        table = _given(path, scenario.fit, scenario.record)
        assert scenario.record is not None
        record = _read(path, scenario.record)
        model: Model | System = system
        title = scenario.title or system.name
    else:
        loaded = load_scenario(path, overrides)
        scenario_record = getattr(loaded.scenario, "record", None)
        table = _given(path, loaded.scenario.fit, scenario_record)
        assert loaded.record is not None
        scenario, record, model, title = loaded.scenario, loaded.record, loaded.model, loaded.title
    assert scenario.record is not None
    options = table.options()
    if scenario.record.smoothing is not None:
        options["smoothing"] = scenario.record.smoothing
    unused = [f"[{name}]" for name in ("run", "initial") if name in scenario.model_fields_set]
    notes = (f"a fit ignores {' and '.join(unused)}",) if unused else ()
    return FitTask(path, title, model, record, options, notes)


def _given(path: Path, table: FitTable | None, record: RecordTable | None) -> FitTable:
    """Return the table [fit] of a file that has one, and a record."""
    if table is None:
        raise ScenarioError(
            "there is no table [fit]", place=str(path), advice=f"add one with {EXAMPLE}"
        )
    if record is None:
        raise ScenarioError(
            "there is no table [record], and a fit needs a measured force",
            place=str(path),
            advice='add [record] with file, time, position and force; and kind = "record" in [rig]',
        )
    return table


def _read(path: Path, table: RecordTable) -> Record:
    return table.read(find_file(path, table.file), table.columns())
