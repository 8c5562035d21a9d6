"""A fitted model as a scenario that runs: a system file with motion and times of the run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm.foundation.files import output_folder, write_whole
from gms_fsm.foundation.tables import Table
from gms_fsm.foundation.text import encoded
from gms_fsm.systems.files.tables import SignalField, signal_table
from gms_fsm.systems.files.toml import FileTable, SystemFile, save_as
from gms_fsm.systems.signals import Corners, Signal

if TYPE_CHECKING:
    from gms_fsm.identification.result import Fit

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
