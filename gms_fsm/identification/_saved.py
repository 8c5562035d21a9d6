"""A fitted model as a scenario that runs: a system file with motion and times of the run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gms_fsm._records import Table
from gms_fsm.systems._file import SystemFile, save_as
from gms_fsm.systems.system import System

if TYPE_CHECKING:
    from gms_fsm.identification.result import Fit

__all__ = ["save"]


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

    Parameters
    ----------
    fit : Fit
        The fit.
    path : Path
        Ending in ``.toml``.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    course = fit.task.course(fit.records[0], None)
    start = fit.task.fine.driver.start(fit.task.subject, course)
    return save_as(
        Fitted,
        start.system,
        path,
        title=f"{_name(fit)} fitted to {fit.records[0].name}",
        notes=fit.weakest,
        run=Times(t_start=start.t_start, t_end=start.t_end),
    )


def _name(fit: Fit) -> str:
    what = fit.model
    return what.name if isinstance(what, System) else what.title
