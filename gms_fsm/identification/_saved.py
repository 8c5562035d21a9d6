"""A fitted model as a scenario that runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gms_fsm.systems.rigs import Prescribed
from gms_fsm.systems.system import System, system_of

if TYPE_CHECKING:
    from gms_fsm.identification.result import Fit

__all__ = ["save"]


def save(fit: Fit, path: Path) -> Path:
    """Write a system file with the fitted values, the motion, and the times of the run.

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
    """
    what, course = fit.model, fit.task.courses[0]
    system = what if isinstance(what, System) else system_of(what, Prescribed(course.signal))
    return system.save(path)
