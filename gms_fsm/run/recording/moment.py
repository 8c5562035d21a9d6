"""A point of a run in progress, as its listeners see it; values are computed on demand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from gms_fsm.lowering.log_columns import LogRecord
from gms_fsm.run.problem import Problem
from gms_fsm.traces.between import interpolated
from gms_fsm.traces.scope import Scope, unit_of
from gms_fsm.traces.trace import Trace

Place = tuple[float, list[float], tuple[int, ...]]  # time, state and modes


class Recording(Protocol):
    """What listeners may read from a run in progress."""

    @property
    def start(self) -> Problem:
        """The model, rig and settings of the run."""

    @property
    def latest(self) -> Place:
        """Time, state and modes reached."""

    def around(self, t: float) -> tuple[Place, Place | None]:
        """Return the last row at or before a time, and the next one."""

    def firings(self, after: int) -> list[LogRecord]:
        """Return the records of the log from a number on."""

    def trace(self) -> Trace:
        """Return the trace of all recorded data."""


@dataclass(frozen=True, eq=False)
class Moment:
    """The point reached by a running simulation, or an earlier one.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> moments = []
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.15"), 6.0, progress=moments.append)
    >>> moments[-1].t, moments[-1].states[0], round(moments[-1].at(1.0).values["x"], 6)
    (6.0, 'slip', 0.15)
    """

    _recording: Recording
    _place: Place | None = None

    def at(self, t: float) -> Moment:
        """Return an earlier point, between rows by interpolation.

        Parameters
        ----------
        t : float
            Time, s; after the point reached it is that point.

        Returns
        -------
        Moment
            The point.
        """
        recording = self._recording
        if t >= recording.latest[0] or recording.start.output == "end":
            return Moment(recording)
        before, after = recording.around(t)
        if after is None or recording.start.output != "all" or not before[0] < t < after[0]:
            return Moment(recording, (max(t, before[0]), *before[1:]))
        ends = before[0], np.array(before[1]), after[0], np.array(after[1])
        y = interpolated(recording.start.program, list(before[2]), *ends, t)
        return Moment(recording, (t, y.tolist(), before[2]))

    @property
    def _row(self) -> Place:
        return self._recording.latest if self._place is None else self._place

    @property
    def t(self) -> float:
        """Time, s."""
        return self._row[0]

    @property
    def states(self) -> list[str]:
        """Active state of each element."""
        start, places = self._recording.start, iter(self.modes)
        return [
            start.system.contact(bank.name).chart.states[next(places)].name
            for bank in start.program.layout.banks
            for _ in range(bank.n)
        ]

    @property
    def modes(self) -> list[int]:
        """The place of the active state of each element in its chart, from 0."""
        mode = self._row[2]
        banks = self._recording.start.program.layout.banks
        return [each for bank in banks for each in mode[bank.elements]]

    @property
    def values(self) -> dict[str, Any]:
        """``x`` [m], ``v`` [m/s] and ``F`` [N]; ``z`` and ``s`` [m], one per element.

        With several contacts they have the contact's name before them: ``gear.F``.
        """
        start, found = self._recording.start, {}
        banks = start.program.layout.banks
        for bank in banks:
            here = scope_of(start, *self._row, bank.name)
            lead = f"{bank.name}." if len(banks) > 1 else ""
            for name in ("x", "v", "F", "z", "s"):
                found[f"{lead}{name}"] = getattr(here, name)
        return found

    @property
    def units(self) -> dict[str, str]:
        """The units of `values`."""
        start, found = self._recording.start, dict[str, str]()
        banks = start.program.layout.banks
        for bank in banks:
            lead = f"{bank.name}." if len(banks) > 1 else ""
            chart = start.system.contact(bank.name).chart
            own = chart.unit(chart.variables[0]) if chart.variables else ""
            found |= {f"{lead}{name}": unit_of(chart, name) for name in ("x", "v", "F")}
            found |= dict.fromkeys((f"{lead}z", f"{lead}s"), own)
        return found

    def transitions(self, after: int = 0) -> list[LogRecord]:
        """Return the transitions until this time.

        Parameters
        ----------
        after : int
            How many to leave out: those that were read before.

        Returns
        -------
        list of LogRecord
            Each has the fields of ``Trace.transitions``.
        """
        return [each for each in self._recording.firings(after) if each.t <= self.t]


def scope_of(
    start: Problem, t: float, y: list[float], mode: Sequence[int], contact: str = ""
) -> Scope:
    """Return the values of a contact at a state of a run; without a name of the only one."""
    bank = start.program.layout.contact(contact)
    return Scope.of(start.system.contact(bank.name), start.program, t, y, mode, bank.name)
