"""What callers of a session may ask for: settings, counts, elements, edges, branches."""

from __future__ import annotations

import numpy as np

from gms_fsm._arguments import checked_integer
from gms_fsm.charts.chart import Chart
from gms_fsm.errors import ParameterError, SessionError, shown
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.systems.models import Model

__all__ = ["check_branch", "check_count", "check_element", "checked_settings", "source_of"]


def checked_settings(settings: Settings | None, options: SettingOptions) -> Settings:
    """Return the settings of a session; raise a `ParameterError` for what does not go with one."""
    for name in ("progress", "checkpoint"):
        if name in options:
            raise ParameterError(f"{name} does not go with a session: it stops at every row")
    if "monitors" in options:
        raise ParameterError(
            "monitors look at a finished run: "
            "gms_fsm.traces.monitors.examine(session.branch.trace(), ...)"
        )
    if not isinstance(options.get("engine", ""), str):
        raise ParameterError(
            "engine: every branch of a session makes machines of its own",
            advice="use 'machines' or 'ifelse'",
        )
    chosen = Settings.of(settings, "a session", **options)
    if chosen.output != "all":
        raise ParameterError(
            f"output={chosen.output!r} does not go with a session: it stops at every row"
        )
    return chosen


def check_count(count: int) -> None:
    """Raise a `SessionError` for what is no count."""
    checked_integer("count", count, 0, SessionError)


def check_branch(number: int, branches: int) -> None:
    """Raise a `SessionError` unless there is a branch of this number."""
    if not 0 <= checked_integer("branch", number, None, SessionError) < branches:
        raise SessionError(f"no branch {number}", advice=f"there are 0 to {branches - 1}")


def check_row(row: int, rows: int) -> None:
    """Raise a `SessionError` unless a row of this number has been computed."""
    if not 0 <= checked_integer("row", row, None, SessionError) < rows:
        raise SessionError(f"no row {row}", advice=f"0 to {rows - 1} are computed")


def check_element(element: int, model: Model) -> None:
    """Raise a `SessionError` unless a model has this element."""
    whole = isinstance(element, int | np.integer) and not isinstance(element, bool)
    if not whole or not 0 <= element < model.n:
        said = shown(element)
        if said in [repr(edge.name) for edge in model.chart.transitions]:
            said += f" (an edge is asked for by edge={said})"
        raise SessionError(
            f"no element {said}",
            advice=f"there are 0 to {model.n - 1} (counted from 0 in Python, from 1 in text)",
        )


def source_of(edge: str, chart: Chart) -> str:
    """Return the state that an edge leaves; raise a `SessionError` if there is no such edge."""
    sources = {each.name: each.source for each in chart.transitions}
    if edge not in sources:
        raise SessionError(f"no edge {edge!r}", advice=f"there are {', '.join(sources) or 'none'}")
    return sources[edge]
