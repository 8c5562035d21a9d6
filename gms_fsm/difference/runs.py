"""Two runs: the first transition at which they differ by more than the tolerances explain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gms_fsm.difference.result import PartChange, RunsDiff
from gms_fsm.difference.wording import both
from gms_fsm.session.results import SAMPLES, first_unlike
from gms_fsm.traces.system_scope import units_of
from gms_fsm.traces.trace import Trace

SLACK = 100.0  # times the relative tolerance, of what runs computed differently may differ by
# What the bits of a run depend on: steps depend on its length, too.
DECIDING = ("method", "rtol", "atol", "step", "max_step", "events", "t_start", "t_end")
Names = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class Translation:
    """What the first run's contacts, their edges, quantities and states are called in the second.

    Parameters
    ----------
    contacts : mapping of str to str
        The contacts and supervisors.
    edges, names, states : mapping of str to mapping of str to str
        By contact of the first run, those that have another name.
    """

    contacts: Mapping[str, str] = field(default_factory=dict)
    edges: Names = field(default_factory=dict)
    names: Names = field(default_factory=dict)
    states: Names = field(default_factory=dict)

    def of(self, contact: str, edge: str) -> str:
        """Return what an edge of a contact is called in the second run."""
        return self.edges.get(contact, {}).get(edge, edge)


def settings_changes(a: Trace, b: Trace, same: bool) -> tuple[PartChange, ...]:
    """Return the settings that two runs, of the same charts and numbers or not, differ in."""
    # Absolute tolerances follow from charts and numbers.
    names = [name for name in {**a.settings, **b.settings} if same or name != "atol"]
    values = ((n, a.settings.get(n), b.settings.get(n)) for n in names)
    return tuple(
        PartChange("changed", "setting", name, *_told_apart(one, other))
        for name, one, other in values
        if one != other
    )


def _told_apart(one: object, other: object) -> tuple[str, str]:
    least = _least(one), _least(other)
    return both(*least) if least[0] != least[1] else both(one, other)


def _least(value: object) -> object:
    """Return tolerances with the smallest of each component, with a few digits."""
    if isinstance(value, Mapping):
        return {name: float(f"{float(np.min(each)):.3g}") for name, each in value.items()}
    return value


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
    end, open_end = min(float(a.t[-1]), float(b.t[-1])), bool(a.t[-1] != b.t[-1])
    logs = [[*run.transitions[run.transitions.t <= end]] for run in (a, b)]
    fired = [
        [_who(record, called if run is a else Translation(), run) for record in log]
        for run, log in zip((a, b), logs, strict=True)
    ]
    times = [[float(record.t) for record in log] for log in logs]
    number = first_unlike(fired, times, slack)
    if number is not None and number >= min(map(len, logs)):  # at the very end it may be missing
        longer = times[0] if len(times[0]) > number else times[1]
        late = longer[number] > end - slack or (longer[number] == end and open_end)
        number = None if late else number
    t = None
    if number is not None:
        t = min(each[number] for each in times if number < len(each))
    until = end if t is None else t
    start = max(float(a.t[0]), float(b.t[0]))
    found = Quantities()
    if start <= until:
        grid = np.linspace(start, until, SAMPLES)
        near = sorted(t for each in times for t in each) if slack and number is None else []
        near += [end] * (number is None and (open_end or slack > 0.0))
        rows = _rows_of_both(a, b, start, until)
        if slack == 0.0 and rows.size:  # what lies between other rows is interpolated otherwise
            found = _compared(a, b, rows[_clear(rows, near, slack)], called, True)
        if not found.count or found.beyond:
            found = _compared(a, b, grid[_clear(grid, near, slack)], called, slack == 0.0)
    return RunsDiff(
        about,
        None if number is None else number + 1,
        t,
        _told(a, b, logs, number),
        (len(logs[0]), len(logs[1])),
        end,
        slack,
        found.largest,
        number is not None or bool(found.beyond),
        beyond=tuple(found.beyond),
        compared=found.count,
        units=units_of(a.what, found.largest),
    )


def _who(record: Any, called: Translation, run: Trace) -> tuple[object, ...]:
    columns = record.dtype.names or ()
    contact = str(record.contact) if "contact" in columns else run.what.system.machines[0].name
    its = called.contacts.get(contact, contact)
    return its, int(record.element), called.of(contact, str(record.edge))


def _told(a: Trace, b: Trace, logs: Sequence[Sequence[Any]], number: int | None) -> tuple[str, str]:
    """Return what fires at a place of both logs, in words."""
    records = [None if number is None or number >= len(log) else log[number] for log in logs]
    known = [0.0 if each is None else float(each.t) for each in records]
    digits = both(*known) if known[0] != known[1] else (f"{known[0]:.9g}",) * 2
    texts = []
    for run, record, t in zip((a, b), records, digits, strict=True):
        if record is None:
            texts.append("nothing")
            continue
        contact = str(record.contact) if "contact" in (record.dtype.names or ()) else ""
        who = run.what.element(contact or run.what.system.machines[0].name, int(record.element))
        texts.append(f"{record.edge} of {who} at t = {t} s")
    return texts[0], texts[1]


# --------------------------------------------------------------------------- quantities
@dataclass
class Quantities:
    """What was compared, its largest differences, and what differs by too much."""

    count: int = 0
    largest: dict[str, float] = field(default_factory=dict)
    beyond: list[str] = field(default_factory=list)


def _rows_of_both(a: Trace, b: Trace, start: float, until: float) -> Any:
    """Return the times in a span that are rows of both runs; none if all rows are."""
    one, other = a.whole().t, b.whole().t
    common = np.array([]) if np.array_equal(one, other) else np.intersect1d(one, other)
    return common[(common >= start) & (common <= until)]


def _clear(grid: Any, near: Sequence[float], slack: float) -> Any:
    """Return which times are not so near a transition that only one run may have made it."""
    if not near:
        return np.ones(grid.size, dtype=bool)
    after = np.searchsorted(near, grid + slack, side="right")
    clear = after == np.searchsorted(near, grid - slack, side="left")
    return clear if clear.any() else ~clear


def _compared(a: Trace, b: Trace, times: Any, called: Translation, exact: bool) -> Quantities:
    """Compare all quantities that both runs have, at some times."""
    runs = [run.sample(times) for run in (a, b)]
    columns = [_columns(runs[0], called), _columns(runs[1], Translation())]
    rtol = max(float(run.settings["rtol"]) for run in (a, b))  # type: ignore[arg-type]
    found = Quantities()
    for name, (one, least) in columns[0].items():
        other, also = columns[1].get(name, (None, 0.0))
        if other is None or one.shape != other.shape:
            continue
        if one.dtype.kind == "U":
            found.count += 1
            found.beyond += [name] * bool((one != other).any())
            continue
        known = np.isfinite(one) & np.isfinite(other)
        uneven = bool((np.isfinite(one) != np.isfinite(other)).any())
        if not known.any() and not uneven:
            continue
        found.count += 1
        found.largest[name] = float(np.abs(one - other)[known].max(initial=0.0))
        size = max(float(np.abs(u[known]).max(initial=0.0)) for u in (one, other))
        allowed = 0.0 if exact else SLACK * (rtol * size + max(least, also))
        found.beyond += [name] * (uneven or found.largest[name] > allowed)
    return found


def _columns(run: Trace, called: Translation) -> dict[str, tuple[Any, float]]:
    """Return what a run has, by the names of the second, each with its absolute tolerance."""
    layout, system = run.program.layout, run.what.system
    named = len(layout.banks) > 1
    found: dict[str, tuple[Any, float]] = {}
    for machine in system.machines:
        bank, seen = layout.contact(machine.name), run.contact(machine.name)
        lead = f"{called.contacts.get(bank.name, bank.name)}." if named else ""
        new, states = (each.get(bank.name, {}) for each in (called.names, called.states))
        if bank.velocity:
            found |= {f"{lead}x": (seen.x, 0.0), f"{lead}v": (seen.v, 0.0)}
            found |= {f"{lead}F": (seen.F, 0.0)}
        chart = machine.chart
        for name in chart.variables:
            if name not in chart.hidden:
                least = _tolerance(run, bank.of(name))
                found[f"{lead}{new.get(name, name)}"] = seen.variable(name), least
        for name in (*chart.velocities[1:], *chart.force_names):
            if bank.of(name) in layout.observed.shared:
                found.setdefault(f"{lead}{new.get(name, name)}", (run.seen[bank.of(name)], 0.0))
        paths = np.array([states.get(each.name, each.name) for each in chart.states])
        found[f"{lead}state"] = paths[seen.modes], 0.0
    if run.what.named:
        moved: dict[str, Any] = {u.v: run.body(u.name).v for u in system.bodies if u.driven}
        own = {*layout.events} | {n for n in layout.y.shared if "." in n}
        moved |= {n: run.value(n) for n in layout.y.shared if n not in own}
        for name, column in moved.items():
            key = f"{name} of the system" if name in found else name
            found[key] = column, _tolerance(run, name)
    return found


def _tolerance(run: Trace, name: str) -> float:
    """Return the absolute tolerance of a component of the state vector; 0 of anything else."""
    given: Any = run.settings.get("atol")
    if isinstance(given, Mapping):
        given = given.get(run.program.layout.label(name))
    return 0.0 if given is None else float(np.max(given))
