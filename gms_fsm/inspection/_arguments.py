"""Checks of the arguments of a session: settings, counts, rows, branches."""

from __future__ import annotations

from collections.abc import Sequence

from gms_fsm._arguments import checked_integer
from gms_fsm.errors import ParameterError, SessionError
from gms_fsm.run.settings import SettingOptions, Settings

__all__ = ["check_branch", "check_count", "check_row", "checked_settings", "chosen_pair"]


def checked_settings(settings: Settings | None, options: SettingOptions) -> Settings:
    """Return the settings of a session; raise `ParameterError` for those it does not support."""
    for name in ("progress", "checkpoint"):
        if name in options:
            raise ParameterError(
                f"{name} cannot be used with a session, which has a row at every step"
            )
    if "monitors" in options:
        raise ParameterError(
            "monitors are evaluated on a finished run: "
            "gms_fsm.traces.monitors.examine(session.branch.trace(), ...)"
        )
    if not isinstance(options.get("engine", ""), str):
        raise ParameterError(
            "engine: every branch of a session makes its own machines",
            advice="use 'machines' or 'ifelse'",
        )
    chosen = Settings.of(settings, "a session", **options)
    if chosen.output != "all":
        raise ParameterError(
            f"output={chosen.output!r} cannot be used with a session, which has a row at every step"
        )
    return chosen


def check_count(count: int) -> None:
    """Raise `SessionError` unless the argument is a count."""
    checked_integer("count", count, 0, SessionError)


def check_branch(number: int, branches: int) -> None:
    """Raise `SessionError` unless a branch has this number."""
    if not 0 <= checked_integer("branch", number, None, SessionError) < branches:
        raise SessionError(f"no branch {number}", advice=f"there are 0 to {branches - 1}")


def chosen_pair(
    a: int | None, b: int | None, current: int, parents: Sequence[int | None]
) -> tuple[int, int]:
    """Return the branches to compare: by default the current one and its parent."""
    for number in (a, b):
        if number is not None:
            check_branch(number, len(parents))
    b = current if b is None else b
    a = parents[b] if a is None else a
    if a is None:
        raise SessionError(f"branch {b} has no parent", advice="give two branch numbers")
    return a, b


def check_row(row: int, rows: int) -> None:
    """Raise `SessionError` unless this row has been computed."""
    if not 0 <= checked_integer("row", row, None, SessionError) < rows:
        raise SessionError(f"no row {row}", advice=f"rows 0 to {rows - 1} have been computed")
