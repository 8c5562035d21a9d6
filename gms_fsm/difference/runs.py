"""Two runs: the first transition at which they differ by more than the tolerances explain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gms_fsm.difference.result import PartChange, RunsDiff
from gms_fsm.session.results import SAMPLES, first_unlike
from gms_fsm.traces.trace import Trace

SLACK = 100.0  # times the relative tolerance, of what runs computed differently may differ by
DECIDING = ("method", "rtol", "atol", "step", "max_step", "events")
Names = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class Translation:
    """What the first run's contacts call their states and edges, in the second.

    Parameters
    ----------
    edges : mapping of str to mapping of str to str
        By contact, those that have another name.
    """

    edges: Names = field(default_factory=dict)

    def of(self, contact: str, edge: str) -> str:
        """Return what an edge of a contact is called in the second run."""
        return self.edges.get(contact, {}).get(edge, edge)


def settings_changes(a: Trace, b: Trace, same: bool) -> tuple[PartChange, ...]:
    """Return the settings that two runs, of the same charts and numbers or not, differ in."""
    # Absolute tolerances follow from charts and numbers.
    names = [name for name in {**a.settings, **b.settings} if same or name != "atol"]
    values = ((n, a.settings.get(n), b.settings.get(n)) for n in names)
    return tuple(
        PartChange("changed", "setting", name, _said(one), _said(other))
        for name, one, other in values
        if one != other
    )


def _said(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {float(np.min(each)):.3g}" for name, each in value.items())
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def within(a: Trace, b: Trace, same: bool) -> float:
    """Return by how much times may differ, s: not at all if the same was computed alike."""
    alike = all(a.settings.get(name) == b.settings.get(name) for name in DECIDING)
    if same and alike:
        return 0.0
    settings: list[Mapping[str, Any]] = [a.settings, b.settings]
    span = max(float(np.ptp(run.t)) for run in (a, b))
    steps = [float(each.get("step") or 0.0) for each in settings]
    return SLACK * max(float(each["rtol"]) for each in settings) * span + max(steps)


def runs_diff(
    a: Trace, b: Trace, about: str, *, same: bool, names: Translation | None = None
) -> RunsDiff:
    """Return the first transition at which two whole runs differ in edge, element or time.

    `same` says whether charts and numbers are the same, so that equal settings give the same bits.
    """
    called, slack = names or Translation(), within(a, b, same)
    end = min(float(a.t[-1]), float(b.t[-1]))
    logs = [[*run.transitions[run.transitions.t <= end]] for run in (a, b)]
    fired = [
        [_who(record, called if run is a else Translation(), run) for record in log]
        for run, log in zip((a, b), logs, strict=True)
    ]
    times = [[float(record.t) for record in log] for log in logs]
    number = first_unlike(fired, times, slack)
    if number is not None and number >= min(map(len, logs)):  # at the very end it may be missing
        longer = times[0] if len(times[0]) > number else times[1]
        number = None if longer[number] > end - slack else number
    t = None
    if number is not None:
        t = min(each[number] for each in times if number < len(each))
    until = end if t is None else t
    largest, apart = _largest(a, b, until, slack == 0.0)
    return RunsDiff(
        about,
        None if number is None else number + 1,
        t,
        (_told(a, logs[0], number), _told(b, logs[1], number)),
        (len(logs[0]), len(logs[1])),
        end,
        slack,
        largest,
        number is not None or apart,
    )


def _who(record: Any, called: Translation, run: Trace) -> tuple[object, ...]:
    columns = record.dtype.names or ()
    contact = str(record.contact) if "contact" in columns else run.what.system.machines[0].name
    return contact, int(record.element), called.of(contact, str(record.edge))


def _told(run: Trace, log: Sequence[Any], number: int | None) -> str:
    """Return what fires at a place of the log, in words."""
    if number is None or number >= len(log):
        return "nothing"
    record = log[number]
    contact = str(record.contact) if "contact" in (record.dtype.names or ()) else ""
    who = run.what.element(contact or run.what.system.machines[0].name, int(record.element))
    return f"{record.edge} of {who} at t = {float(record.t):.9g} s"


def _largest(a: Trace, b: Trace, until: float, exact: bool) -> tuple[dict[str, float], bool]:
    """Return the largest differences of x, v and F until a time, and whether one is too large."""
    times = np.linspace(max(float(a.t[0]), float(b.t[0])), until, SAMPLES)
    columns = [_columns(run.sample(times)) for run in (a, b)]
    rtol = max(float(run.settings["rtol"]) for run in (a, b))  # type: ignore[arg-type]
    found, apart = {}, False
    for name, one in columns[0].items():
        if name not in columns[1]:
            continue
        other = columns[1][name]
        known = np.isfinite(one) & np.isfinite(other)
        found[name] = float(np.abs(one - other)[known].max(initial=0.0))
        size = max(float(np.abs(u[known]).max(initial=0.0)) for u in (one, other))
        apart |= found[name] > (0.0 if exact else SLACK * rtol * size)
    return found, apart


def _columns(run: Trace) -> dict[str, Any]:
    named = len(run.contacts) > 1
    found: dict[str, Any] = {}
    for contact in run.contacts:
        seen, lead = run.contact(contact), f"{contact}." if named else ""
        found |= {f"{lead}x": seen.x, f"{lead}v": seen.v, f"{lead}F": seen.F}
    return found
