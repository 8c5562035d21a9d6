"""A fitted model as a scenario that runs, and a whole fit as a file that is read back."""

from __future__ import annotations

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gms_fsm.errors import RecordError
from gms_fsm.foundation.files import output_folder, write_text, write_whole
from gms_fsm.foundation.tables import Table
from gms_fsm.foundation.text import encoded
from gms_fsm.identification.certainty.assess import Assessed, Estimate
from gms_fsm.identification.certainty.statistics import Certainty
from gms_fsm.identification.problem.task import FitOptions, Task
from gms_fsm.records.record import Record
from gms_fsm.systems.files.tables import ModelTable, SignalField, SystemTable, signal_table
from gms_fsm.systems.files.toml import FileTable, SystemFile, save_as
from gms_fsm.systems.mounted import mounted_alone
from gms_fsm.systems.signals import Corners, Signal
from gms_fsm.systems.system import System

if TYPE_CHECKING:
    from gms_fsm.identification.result import Fit

FORMAT = "gms-fsm fit 1"
LONGEST = 5000  # corners of a signal in the file itself


class Times(Table):
    """The run: a part of the table that scenario files have under this name."""

    t_start: float
    t_end: float


class Fitted(SystemFile):
    """A system file with the tables of a run."""

    title: str
    notes: str
    run: Times


def save(fit: Fit, path: Path) -> Path:
    """Write the fitted model, driven by the first record, with its run-in if it has one.

    A long motion is written to a table beside it, with the same name and the ending ``.csv``.
    """
    course = fit.task.along(fit.records[0], None)[0]
    start = fit.task.fine.driver.start(fit.task.subject, course)
    signals = {name: _signal(signal, name, path) for name, signal in start.system.signals.items()}
    return save_as(
        Fitted,
        start.system,
        path,
        signals=signals,
        title=f"{fit.title} fitted to {fit.records[0].name}",
        notes=f"{_terms(fit)}{fit.weakest}",
        run=Times(t_start=start.t_start, t_end=start.t_end),
    )


def _signal(signal: Signal | str, name: str, path: Path) -> FileTable | SignalField:
    """Describe a signal; the corners of a long one are written to a table beside the file."""
    if not isinstance(signal, Corners) or signal.held or signal.times.size <= LONGEST:
        return signal_table(signal)
    if not (np.diff(signal.times) > 0.0).all():  # a jump, which a table of a record has not
        return signal_table(signal)
    table = path.with_suffix(".csv")
    rows = (f"{t!r},{u!r}" for t, u in np.stack([signal.times, signal.values], axis=1).tolist())
    text = encoded("\n".join([f"t_s,{name}", *rows, ""]))
    output_folder(table.parent, [table.name])
    write_whole(table, lambda file: file.write(text))
    return FileTable(file=table.name, value=name)


def _terms(fit: Fit) -> str:
    """Say which terms of the measurement are no part of the scenario."""
    terms = (each for each in fit.table if each.name in fit.nuisance)
    found = ", ".join(f"{each.name} {each.value:.6g} {each.unit}" for each in terms)
    return f"Without terms of the measurement that were fitted besides: {found}. " * bool(found)


# --------------------------------------------------------------------------- whole fits
def save_whole(fit: Fit, path: Path) -> Path:
    """Write a fit with its records; `loaded` reads it back."""
    task, subject = fit.task, fit.task.subject
    system = subject.given
    kind, table = (
        ("model", ModelTable.of(subject.model))
        if system is None
        else ("system", SystemTable.of(system))
    )
    data = {
        "format": FORMAT,
        kind: table.model_dump(mode="json"),
        "options": asdict(task.options) | {"bounds": dict(task.options.bounds)},
        "begin": task.begin,
        "starts": [[*place, _lists(start)] for place, start in task.starts.items()],
        "records": [
            {
                "name": each.name,
                "columns": _lists(each.columns),
                "chosen": each.chosen.tolist(),
                "rows": each.rows.tolist(),
                "notes": list(each.notes),
                "licence": each.licence,
            }
            for each in task.records
        ],
        "table": [asdict(each) for each in fit.table],
        "covariance": fit.covariance.tolist(),
        "correlation_time": fit.correlation_time,
        "effective_rows": fit.effective_rows,
        "weakest": fit.weakest,
        "notes": list(fit.notes),
        "runs": fit.runs,
        "seconds": fit.seconds,
        "stopped": fit.stopped,
    }
    output_folder(path.parent, [path.name])
    return write_text(path, json.dumps(data) + "\n")


def _lists(arrays: Any) -> dict[str, Any]:
    return {name: np.asarray(values).tolist() for name, values in arrays.items()}


def loaded(kind: type[Fit], path: Path) -> Fit:
    """Read a fit; its class is given, as it imports this module."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if data["format"] != FORMAT:
            raise ValueError(f"its format is {data['format']!r}")
        return _built(kind, data)
    except OSError as error:
        raise RecordError(f"cannot be read ({error.strerror})", place=str(path)) from None
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise RecordError(
            f"this is not a fit ({error})",
            place=str(path),
            advice="give a file that Fit.save wrote, with a name ending in .json",
        ) from None


def _built(kind: type[Fit], data: dict[str, Any]) -> Fit:
    model: Any = (
        SystemTable.model_validate(data["system"]).build(System)
        if "system" in data
        else ModelTable.model_validate(data["model"]).build()
    )
    records = tuple(_record(each) for each in data["records"])
    names = {name for record in records for name in record.inputs}
    given = {each.name: data["options"][each.name] for each in fields(FitOptions)}
    given |= {name: tuple(value) for name, value in given.items() if isinstance(value, list)}
    given["bounds"] = {name: tuple(pair) for name, pair in given["bounds"].items()}
    starts = {
        (i, j): {name: np.array(values) for name, values in start.items()}
        for i, j, start in data["starts"]
    }
    subject = mounted_alone(model, inputs=names)
    task = Task(subject, records, FitOptions(**given), data["begin"], starts)
    covariance, count = np.array(data["covariance"]), len(data["table"])
    nothing, none = np.full(count, np.nan), np.zeros(count, dtype=bool)
    sure = Certainty(
        covariance,
        nothing,
        none,
        np.eye(count),
        nothing,
        nothing,
        data["correlation_time"],
        data["effective_rows"],
    )
    table = tuple(Estimate(**each) for each in data["table"])
    point = task.fine.at(task.fine.coordinates.start)
    assessed = Assessed(table, covariance, sure, data["weakest"])
    kept = {name: data[name] for name in ("runs", "seconds", "stopped")}
    return kind(task, point, assessed, tuple(data["notes"]), **kept)


def _record(given: dict[str, Any]) -> Record:
    columns = {name: np.array(values, dtype=float) for name, values in given["columns"].items()}
    chosen, rows = np.array(given["chosen"], dtype=bool), np.array(given["rows"], dtype=int)
    for array in (*columns.values(), chosen, rows):
        array.flags.writeable = False
    notes, licence = tuple(given["notes"]), given["licence"]
    return Record(given["name"], columns, chosen, rows, notes, licence=licence)
