"""A run that ends where a condition becomes true: a supervisor waits for it, and leaves no trace.

The condition is located as every guard is. That supervisor is the last of all machines, so that
what it adds to modes and log can be taken off again.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import ExpressionError, ParameterError
from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.language import Name, names_in, parse_condition, spell
from gms_fsm.language.normal import renamed_in
from gms_fsm.lowering.log_columns import LogRecord
from gms_fsm.lowering.program import lower
from gms_fsm.lowering.scales import scales_of_system
from gms_fsm.run.problem import Problem, with_waking_times
from gms_fsm.run.recording.moment import Place, Recording
from gms_fsm.systems.mounted import Mounted, mounted
from gms_fsm.systems.parts import COUNTS, Supervisor
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.system_scope import in_si, names_of
from gms_fsm.traces.trace import Trace

NAME = "until"
UNLIKE, WAITS, REACHED = range(3)  # the states of its chart
_STATE = re.compile(rf"\b({'|'.join(COUNTS)})\(\s*(?=\w+\s*\))")


@dataclass(frozen=True)
class Until:
    """What ends a run, and the same run without it.

    Parameters
    ----------
    plain : Problem
        Without the supervisor.
    start : Problem
        With it: what runs.
    """

    plain: Problem
    start: Problem

    @classmethod
    def of(cls, plain: Problem, text: str) -> Until:
        """Read a condition; raise an `ExpressionError` if it is none."""
        system = plain.system
        checked_kind(NAME, text, str, "a condition, such as 'v > 0.2'")
        if plain.output == "end":
            raise ParameterError(
                "output is 'end'", place="until", advice="leave output out, and read the last row"
            )
        named: list[Any] = [*system.machines, *system.bodies, *system.springs, *system.sampled]
        name = NAME
        while name in {each.name for each in named}:
            name += "_"
        machine = _waiting(plain.what, text, name)
        what = mounted(replace(system, supervisors=(*system.supervisors, machine)))
        program = lower(what.system)
        program = with_waking_times(program, what.system, plain.t_start, plain.last)
        program = replace(program, ticks=plain.program.ticks)
        start = replace(
            plain,
            what=what,
            program=program,
            mode=[*plain.mode, UNLIKE],
            options=replace(plain.options, relaxing=scales_of_system(program).relaxing),
        )
        return cls(plain, start)

    @property
    def place(self) -> int:
        """Where its state is among the modes, and its number among all machines."""
        return self.plain.program.layout.n

    def over(self, recording: Recording) -> bool:
        """Return whether the instant at which the condition has become true is over."""
        t, _, mode = recording.latest
        if mode[self.place] != REACHED:
            return False
        fired = (each.t for each in recording.firings(0) if each.contact == self.name)
        return t > max(fired)

    @property
    def name(self) -> str:
        """What the supervisor is called."""
        return self.start.system.machines[-1].name

    def trace(self, found: Trace) -> Trace:
        """Return the run up to there, without the supervisor."""
        mine = found.firings.machine == self.place
        own, others = found.firings.at(mine), found.firings.at(~mine)
        plain, end = self.plain, np.inf
        ended = np.flatnonzero(found.stops.mode[:, self.place] == REACHED)
        if ended.size:
            end = float(own.t[-1])
            others = others.at(others.t <= end)
            plain = replace(plain, t_end=end, last=end, settings={**plain.settings, "t_end": end})
        rows = self._without(found.rows, end)
        stops = rows if found.stops is found.rows else self._without(found.stops, end)
        named = plain.what.named and len(others) > 0
        others = replace(others, layout=plain.program.layout, named=named)
        return plain.trace(rows, stops, others)

    def _without(self, rows: Rows, end: float) -> Rows:
        """Return the rows up to a time, without those of the supervisor."""
        own = rows.mode[:, self.place]
        kept: NDArray[np.bool_] = rows.t <= end
        fired = (rows.microstep > 0) & (np.diff(own, prepend=own[:1]) != 0)
        # Of one instant those after it are earlier by one.
        later = np.zeros(len(rows), dtype=np.int64)
        for row in np.flatnonzero(fired & kept):
            step = row + 1
            while step < len(rows) and rows.t[step] == rows.t[row] and rows.microstep[step] > 0:
                later[step] += 1
                step += 1
        chosen = kept & ~fired
        return Rows(
            rows.t[chosen],
            (rows.microstep - later)[chosen],
            rows.y[chosen],
            np.delete(rows.mode[chosen], self.place, axis=1),
        )


@dataclass(frozen=True)
class SeenUntil:
    """A run in progress as its listeners see it: without the supervisor.

    Parameters
    ----------
    until : Until
        What ends it.
    recording : Recording
        What is recorded, with the supervisor.
    """

    until: Until
    recording: Recording

    @property
    def start(self) -> Problem:
        """The run without the supervisor."""
        return self.until.plain

    @property
    def latest(self) -> Place:
        """Time, state and modes reached; machine code may have gone past the end."""
        if not self.until.over(self.recording):
            return self._seen(self.recording.latest)
        rows = self.trace().whole().rows
        return float(rows.t[-1]), rows.y[-1].tolist(), tuple(rows.mode[-1].tolist())

    def around(self, t: float) -> tuple[Place, Place | None]:
        """Return the last row at or before a time, and the next one."""
        before, after = self.recording.around(t)
        return self._seen(before), after and self._seen(after)

    def firings(self, after: int) -> list[LogRecord]:
        """Return the records of the log from a number on."""
        named = self.start.what.named
        every = self.recording.firings(0)
        others = [each for each in every if each.contact != self.until.name][after:]
        return others if named else [each._replace(contact="") for each in others]

    def trace(self) -> Trace:
        """Return the trace of all recorded data."""
        return self.until.trace(self.recording.trace())

    def _seen(self, place: Place) -> Place:
        t, y, mode = place
        return t, y, (*mode[: self.until.place], *mode[self.until.place + 1 :])


def _waiting(what: Mounted, text: str, name: str) -> Supervisor:
    """Return a supervisor that waits until a condition is false, and then until it is true."""
    system, alias = what.system, dict[str, str]()
    text = in_si(what, text)
    if not what.named:  # of a model on a rig, F is that of its only contact
        (contact,) = system.contacts
        text = _STATE.sub(rf"\1({contact.name}.", text)
        own = [each for each in system.readable if each.startswith(f"{contact.name}.")]
        alias = {each.partition(".")[2]: each for each in own}
        alias = {short: each for short, each in alias.items() if short not in system.names}
    try:
        tree = parse_condition(text, [*system.readable, *alias])
    except ExpressionError as error:
        if any(error.reason.startswith(f"unknown name {each!r}") for each in names_of(what)):
            allowed = f"session.until({text!r}), which sees single elements"
            error = ExpressionError(error.reason, error.text, error.column, allowed)
        raise error.at(NAME) from None
    inputs: Mapping[str, str] = {
        f"u{i}": alias.get(each, each) for i, each in enumerate(sorted(names_in(tree)), start=1)
    }
    names = dict(zip(sorted(names_in(tree)), map(Name, inputs), strict=True))
    guard = spell(renamed_in(tree, names))
    chart = Chart(
        NAME,
        inputs=inputs,
        velocities=(),
        states=(State("unlike"), State("waits"), State("reached")),
        transitions=(
            Transition("begins", "unlike", "waits", guard=f"not ({guard})"),
            Transition("ends", "waits", "reached", guard=guard),
        ),
    )
    return Supervisor(name, chart, inputs=inputs)
