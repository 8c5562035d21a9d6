"""Checks of the arguments of a session: settings, counts, rows."""

from __future__ import annotations

from gms_fsm.errors import ParameterError, SessionError
from gms_fsm.foundation.arguments import checked_integer
from gms_fsm.run.settings import SettingOptions, Settings


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


def check_row(row: int, rows: int) -> None:
    """Raise `SessionError` unless this row has been computed."""
    if not 0 <= checked_integer("row", row, None, SessionError) < rows:
        raise SessionError(f"no row {row}", advice=f"rows 0 to {rows - 1} have been computed")
