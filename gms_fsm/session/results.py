"""Results of a session: data with fields, which print as the text of the debugger."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import SessionError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.foundation.display import displayed, short_repr
from gms_fsm.foundation.quantities import Scale, in_words, trimmed
from gms_fsm.traces.system_scope import units_of
from gms_fsm.traces.trace import Trace
from integrators.advance import tick_at

SAMPLES = 2000  # number of common times at which two branches are compared
Part = TypeVar("Part")
MANY = 4  # contacts; with more, a row prints only those that fired


@dataclass(frozen=True)
class Fired:
    """The firing that made a row.

    Parameters
    ----------
    element : int
        Element index, from 0.
    edge, source, target : str
        The edge taken, the state left and the state entered.
    contact : str
        The contact, in the run of a system; else empty.
    """

    element: int
    edge: str
    source: str
    target: str
    contact: str = ""

    def __str__(self) -> str:
        who = f"{self.contact or 'element'} {self.element + 1}"
        return f"{who}: {self.source} -> {self.target} by {self.edge}"


@dataclass(frozen=True)
class BodyHere:
    """A body at one row.

    Parameters
    ----------
    x, v : float
        Position, m; velocity, m/s.
    """

    x: float
    v: float


@short_repr
@dataclass(frozen=True)
class ContactHere:
    """A contact at one row.

    Parameters
    ----------
    x, v, F : float
        Relative position, m; relative velocity, m/s; force, N: the first of each.
    z, s, F_elements : tuple of float
        One per element: first variable of the chart, m (NaN if it has none); threshold, m (NaN if
        there is none); force, N.
    states : tuple of str
        Active states, one per element.
    more : mapping of str to float
        Further velocities and forces of the chart, by name (a planar contact).
    shared : bool
        Whether F is that of a lock which other locks share; see the trace's ``F shared``.
    scales : mapping of str to Scale
        How x, v and F are written: in units that suit the largest so far.
    """

    x: float
    v: float
    F: float
    z: tuple[float, ...]
    s: tuple[float, ...]
    F_elements: tuple[float, ...]
    states: tuple[str, ...]
    more: Mapping[str, float]
    shared: bool
    scales: Mapping[str, Scale] = field(compare=False, repr=False)

    def written(self, *names: str) -> str:
        """Return values as text: ``v = 150 mm/s, F = 1.5 N``."""
        values = {"x": self.x, "v": self.v, "F": self.F} | dict(self.more)
        # Further names are of velocities, and of forces along them (`Chart.force_names`).
        kinds = {name: "F" if name.startswith("F_") else "v" for name in self.more}
        found = []
        for name in names:
            scale = self.scales[kinds.get(name, name)].near(values[name])
            found.append(f"{name} = {trimmed(scale.text(values[name], 6))}")
        return ", ".join(found)

    @property
    def said(self) -> str:
        """What it gives out, and the velocity, as text; a supervisor has outputs only."""
        if math.isnan(self.v):
            return ", ".join(f"{name} = {value:.6g}" for name, value in self.more.items())
        return self.written("v", "F", *self.more)

    def __str__(self) -> str:
        share = " (shared with other locks)" if self.shared else ""
        text = f"{self.said}{share}"
        if len(self.states) == 1:
            return ", ".join(filter(None, [text, self.states[0]]))
        counts = [(self.states.count(name), name) for name in dict.fromkeys(self.states)]
        return f"{text}, {', '.join(f'{count} {name}' for count, name in counts)}"


@displayed("html")
@short_repr
@dataclass(frozen=True)
class Here:
    """One row of a branch; printed, the text of the debugger after a move.

    ``x, v, F, z, s, F_elements`` and ``states`` are those of the contact, if there is one only.

    Parameters
    ----------
    row : int
        Row number in the branch.
    t : float
        Time, s.
    microstep : int
        Micro-step; 0 before the firings at this time.
    contacts : mapping of str to ContactHere
        By name; that of a model on a rig is called ``friction``.
    bodies : mapping of str to BodyHere
        By name; that of a model on a rig is called ``body``.
    values : mapping of str to float
        Further states and sampled values of a system, by name.
    located : bool
        Whether this is a point between rows, where a condition became true.
    fired : Fired or None
        The firing that made the row, if any.
    system : bool
        Whether the run is that of a system, and not of a model on a rig.
    """

    row: int
    t: float
    microstep: int
    contacts: Mapping[str, ContactHere]
    bodies: Mapping[str, BodyHere]
    values: Mapping[str, float]
    located: bool
    fired: Fired | None
    system: bool

    def contact(self, name: str) -> ContactHere:
        """Return what belongs to a contact; raise `SessionError` if there is no such one."""
        return _found(self.contacts, name, "contact")

    def body(self, name: str) -> BodyHere:
        """Return the motion of a body; raise `SessionError` if there is no such one."""
        return _found(self.bodies, name, "body")

    @property
    def only(self) -> ContactHere:
        """The contact; raises `SessionError` if there are several."""
        if len(self.contacts) > 1:
            some, known = next(iter(self.contacts)), ", ".join(map(repr, self.contacts))
            raise SessionError(
                f"the system has the contacts {known}", advice=f"say which one: .contact({some!r})"
            )
        return next(iter(self.contacts.values()))

    @property
    def x(self) -> float:
        """Position, m."""
        return self.only.x

    @property
    def v(self) -> float:
        """Velocity, m/s."""
        return self.only.v

    @property
    def F(self) -> float:
        """Friction force, N."""
        return self.only.F

    @property
    def z(self) -> tuple[float, ...]:
        """First variable of each element, m."""
        return self.only.z

    @property
    def s(self) -> tuple[float, ...]:
        """Threshold of each element, m."""
        return self.only.s

    @property
    def F_elements(self) -> tuple[float, ...]:
        """Force of each element, N."""
        return self.only.F_elements

    @property
    def states(self) -> tuple[str, ...]:
        """Active state of each element."""
        return self.only.states

    def __str__(self) -> str:
        place = f"between rows {self.row} and {self.row + 1}" if self.located else f"row {self.row}"
        step = f", micro-step {self.microstep}" if self.microstep else ""
        lead = f"{place}, t = {self.t:.9g} s{step}"
        fired = "" if self.fired is None else f"\n  {self.fired}"
        if not self.system:
            return f"{lead}: {self.only.written('v', 'F')}{fired}"
        shown_of = self.contacts
        if len(shown_of) > MANY:
            who = "" if self.fired is None else self.fired.contact
            shown_of = {name: each for name, each in shown_of.items() if name == who}
        return lead + fired + "".join(f"\n  {name}: {each}" for name, each in shown_of.items())


def _found(parts: Mapping[str, Part], name: str, kind: str) -> Part:
    if name not in parts:
        raise unknown(kind, name, parts, SessionError)
    return parts[name]


@displayed("html")
@short_repr
@dataclass(frozen=True)
class BranchComparison:
    """A comparison of two branches; printed, the text of the debugger.

    Parameters
    ----------
    branches : tuple of int
        Numbers of the branches.
    t : float
        End of the compared time, s (that of the shorter branch).
    transitions : tuple of int
        Number of transitions of each branch until then.
    first_difference : float or None
        Time of the first transition that differs, s, or None.
    differences : mapping of str to float
        Largest differences at common times. Of a model on a rig: its first variable, if it has one,
        and F. Of a system: the position of each body, and first variable and force of each contact
        (``pad.z``, ``pad.F``).
    """

    branches: tuple[int, int]
    t: float
    transitions: tuple[int, int]
    first_difference: float | None
    differences: Mapping[str, float]
    units: Mapping[str, str] = field(default_factory=dict, repr=False)

    @property
    def z(self) -> float:
        """Largest difference of the first variable of a model on a rig."""
        return next(iter(self.differences.values()))

    @property
    def F(self) -> float:
        """Largest difference of the friction force of a model on a rig, N."""
        return self.differences["F"]

    def __str__(self) -> str:
        (a, b), (p, q) = self.branches, self.transitions
        largest = ", ".join(
            f"{name} {in_words(value, self.units.get(name, ''), 3)}"
            for name, value in self.differences.items()
        )
        return (
            f"branches {a} and {b} until t = {self.t:.9g} s: {p} and {q} transitions\n"
            + (
                "  the same transitions\n"
                if self.first_difference is None
                else f"  first different transition at t = {self.first_difference:.9g} s\n"
            )
            + f"  largest difference: {largest}"
        )


def compared(numbers: tuple[int, int], first: Trace, second: Trace) -> BranchComparison:
    """Compare two branches that have been computed to their ends."""
    t = min(float(first.t[-1]), float(second.t[-1]))
    logs = [trace.transitions[trace.transitions.t <= t] for trace in (first, second)]
    fired, moments = [[*map(_who, log)] for log in logs], [log.t.tolist() for log in logs]
    number = first_unlike(fired, moments, 2.0 * tick_at(t))  # a switch is located to a tick
    differs = None
    if number is not None:
        differs = min(float(each[number]) for each in moments if number < len(each))
    times = np.linspace(float(first.t[0]), t, SAMPLES)
    columns = [_compared_columns(trace.sample(times)) for trace in (first, second)]
    differences = {
        name: float(np.abs(column - columns[1][name]).max()) for name, column in columns[0].items()
    }
    counts, units = (len(logs[0]), len(logs[1])), units_of(first.what, differences)
    return BranchComparison(numbers, t, counts, differs, differences, units)


def first_unlike(
    fired: Sequence[Sequence[object]], times: Sequence[Sequence[float]], within: float = 0.0
) -> int | None:
    """Return the number, from 0, of the first firing that two logs do not share; None if all.

    Examples
    --------
    >>> first_unlike((["slip", "stick"], ["slip", "stick"]), ([1.0, 2.0], [1.0, 2.5]))
    1
    >>> first_unlike((["slip", "stick"], ["slip"]), ([1.0, 2.0], [1.01]), within=0.1)
    1
    """
    pairs = enumerate(zip(*fired, strict=False))
    unlike = (i for i, (one, other) in pairs if one != other or _apart(times, i) > within)
    shorter, longer = sorted(map(len, fired))
    return next(unlike, None if shorter == longer else shorter)


def _apart(times: Sequence[Sequence[float]], number: int) -> float:
    return abs(times[0][number] - times[1][number])


def _who(record: np.record) -> tuple[object, ...]:
    columns = record.dtype.names or ()
    names = [name for name in ("contact", "element", "edge") if name in columns]
    return tuple(record[name].item() for name in names)


def _compared_columns(trace: Trace) -> dict[str, FloatArray]:
    """Return what is compared of a run."""
    if trace.system is None:
        return _of_contact(trace, "")
    columns = {body.x: trace.body(body.name).x for body in trace.system.bodies}
    for name in trace.contacts:
        columns |= _of_contact(trace.contact(name), f"{name}.")
    return columns


def _of_contact(trace: Trace, lead: str) -> dict[str, FloatArray]:
    first = {f"{lead}{name}": trace.variable(name) for name in trace.model.chart.variables[:1]}
    return first | {f"{lead}F": trace.F}
