"""A run as a scenario file: the tables of its system, how to integrate, and the initial values."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

from gms_fsm.errors import OutputError
from gms_fsm.foundation.arguments import checked_path
from gms_fsm.foundation.files import write_text
from gms_fsm.foundation.toml import written
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import Settings
from gms_fsm.session.tree.branch import BranchRow
from gms_fsm.session.tree.poking import initial_values

NAMES = ("step", "rtol", "atol", "max_step", "max_steps")  # any engine gives the same run


def save_scenario(path: str | Path, start: Problem, title: str, notes: str) -> Path:
    """Write a run as a scenario file of its system."""
    path = checked_path("path", path)
    if path.suffix != ".toml":
        raise OutputError("the ending must be .toml", place=str(path))
    with tempfile.TemporaryDirectory() as folder:
        tables = start.system.save(Path(folder, "system.toml")).read_text(encoding="utf-8")
    head = {"title": title, "notes": notes} if notes else {"title": title}
    more: dict[str, Any] = {"run": _run(start)}
    if start.initial:
        here = BranchRow(start.t_start, 0, list(start.y), tuple(start.mode))
        more["initial"] = _nested(initial_values(start, here))
    text = f"{written(head)}{tables}\n{written(more)}"
    return write_text(path, text)


def _run(start: Problem) -> dict[str, Any]:
    """Return the settings that are not the defaults, and the times."""
    chosen, usual = start.chosen, Settings()
    table: dict[str, Any] = {"t_start": float(start.t_start), "t_end": float(start.t_end)}
    if chosen.method_name != usual.method_name:
        table["method"] = chosen.method_name
    for name in NAMES:
        value = getattr(chosen, name)
        if value != getattr(usual, name) and value != math.inf:
            table[name] = value
    if chosen.events == "step":  # held events are periods of contacts
        table["events"] = chosen.events
    return table


def _nested(values: dict[str, Any]) -> dict[str, Any]:
    """Return values as tables: those of the contact gear are in the table gear."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        owner, _, own = name.rpartition(".")
        table = found.setdefault(owner, {}) if owner else found
        table[own] = value if isinstance(value, float | int) else list(value)
    return found
