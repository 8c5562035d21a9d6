"""A system whose inputs come sample by sample: its memory, and what advances it.

A sample ends before what happens just there. Whether an input jumps there is known only when the
next sample begins, and a run ends its last step before a jump one clock tick earlier. If that can
make a difference the last sample is then advanced again, as one that ends so. Hence all bits are
those of a run over the same samples.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from gms_fsm.charts.parameters import as_floats
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.language import EVENT
from gms_fsm.lowering.generated import reads_time
from gms_fsm.lowering.pulses import step_times
from gms_fsm.run.problem import LATEST, Problem, with_waking_times
from gms_fsm.run.settings import Settings
from gms_fsm.run.stepped.beginning import begin, usable
from gms_fsm.run.stepped.failing import failure
from gms_fsm.run.stepped.going_back import Alone, Snapshot, content_of
from gms_fsm.run.stepped.memory import BlockMemory, ListMemory
from gms_fsm.systems.reading.values import numbers_of
from gms_fsm.systems.signals import Corners, Function
from gms_fsm.systems.system import System
from gms_fsm.traces.system_scope import SystemScope, system_names
from integrators import hybrid, loop
from integrators.runners.stepping import FULL_LOG

CORNERS = 3  # of a straight line: what was before it, its start and its end
AHEAD = 1.0  # s: how far the times are computed at which texts jump


class SystemSwitch(NamedTuple):
    """An edge that was taken."""

    t: float  # s
    contact: str  # or supervisor
    element: int
    edge: str


# A sample: its begin and its end, its inputs at both, and a copy of the state before it.
LastSample = tuple[float, float, list[float], list[float], Any]
# Where a system is, besides its memory: the time, the last sample, the switches for which its log
# had no room, and those in its log that were told with the sample before.
Standing = tuple[float, LastSample | None, tuple[SystemSwitch, ...], frozenset[SystemSwitch]]


NONE = frozenset[SystemSwitch]()


class Plant:
    """A system in memory."""

    def __init__(
        self,
        system: System,
        t: float,
        initial: Mapping[str, Any] | None,
        settings: Settings,
        engine: str,
        t_end: float | None = None,
    ) -> None:
        self.system, self.initial, self.settings, self.engine = system, initial, settings, engine
        self.inputs, self.t_start, self.t_end = system.inputs, t, t_end
        count = len(self.inputs)
        self.start = self.started([0.0] * count)
        kind = BlockMemory if engine == "compiled" else ListMemory
        memory = kind([self.start], waits=True)
        (self.memory,) = memory.each
        self._copy, self._take, self._run = memory.copy, memory.take, memory.run
        self._sample: Any = memory.sample
        self._rows: list[Any] = [*memory.lines][:count]
        layout = self.start.program.layout
        self.events = {name.removeprefix(EVENT): layout.y.index(name) for name in layout.events}
        self.alone = Alone()
        self.t, self.lost = t, tuple[SystemSwitch, ...]()
        self.told = frozenset[SystemSwitch]()
        self.last: LastSample | None = None
        self._sees_ends = _sees_ends(self.start)
        # Where the first inputs matter: what entries compute, and whether a lock holds at once.
        self._enters = any(each.chart.assigned() for each in system.machines) or any(
            body.driven for body in system.bodies
        )
        self._steps = self.start.program.plan.steps
        self._knots: tuple[float, list[float]] = -np.inf, []  # up to when, and they
        if t_end is not None:
            program = dataclasses.replace(self.start.program, knots=[])
            self._knots = t_end, with_waking_times(program, self.start.system, t, t_end).knots
        self._in_parts = bool(self._steps or self._knots[1])
        self._sample.waits = True  # except in a sample without length

    def started(self, values: Sequence[float]) -> Problem:
        """Return the start of a run in which the inputs have their first values."""
        t, end = begin(self.t_start)
        signals: dict[str, Any] = {
            name: Corners(np.array([t, end]), np.full(2, values[k]), held=True)
            for k, name in enumerate(self.inputs)
        }
        for name, signal in self.system.signals.items():
            if name in signals:
                continue
            function = isinstance(signal, Function) and self.engine == "compiled"
            if function or (isinstance(signal, Corners) and np.ptp(signal.values)):
                raise ParameterError(
                    "it is a Python function" if function else "it is a record or has ramps",
                    place=f"signal {name!r}",
                    advice="name it among the inputs of the system, and give it in each call; or "
                    "write it as an expression in t",
                )
            signals[name] = signal
        system = dataclasses.replace(self.system, signals=signals)
        chosen = usable(self.settings, "located", "held")
        start = Problem.of(system, None, end, chosen, t_start=t, initial=self.initial)
        shared, own, tables = start.program.p
        padded = [row + row[-1:] * (CORNERS - len(row)) for row in tables]
        program = dataclasses.replace(start.program, p=(shared, own, padded))
        return dataclasses.replace(start, program=program)

    # ------------------------------------------------------------------ samples
    def commit(self, end: float, first: list[float], last: list[float]) -> None:
        """Advance by a sample, in which inputs go from first to last; if that fails, stay."""
        t, before, told = self.t, self.last, NONE
        backup = state = self._copy()
        try:
            # Of a sample without length only its end matters.
            if (
                self._sees_ends
                and before is not None
                and before[3] != (first if end > t else last)
                and before[0] < before[1]
            ):
                state, told = self._again(before, backup)
            lost = self._advanced(t, end, first, last)
            self.t, self.last, self.lost, self.told = end, (t, end, first, last, state), lost, told
        except BaseException:  # Ctrl-C, too
            self._take(backup)
            self.t, self.last = t, before
            raise

    def _again(self, last: LastSample, now: Any) -> tuple[Any, frozenset[SystemSwitch]]:
        """Advance by the last sample again, as inputs jump at its end.

        Return its end, and what it has told of that comes later now.
        """
        memory, plan = self.memory.buffers.memory, self.memory.buffers.plan
        if memory.phase == loop.JUMPING and plan.ticks[memory.jump]:
            return now, NONE  # it waits at a tick in any case
        told, y = frozenset(self.logged), self.memory.buffers.now.y
        sent = {place: y[place] for place in self.events.values()}  # since then
        self._take(last[4])
        self._advanced(*last[:4], jumps=True)
        for place, waits in sent.items():
            y[place] = waits
        return self._copy(), told.difference(self.logged)

    def _advanced(
        self, t: float, end: float, first: list[float], last: list[float], *, jumps: bool = False
    ) -> tuple[SystemSwitch, ...]:
        """Advance to the end of a sample; return the switches that did not fit into its log."""
        sample = self._sample
        sample.end = end
        for k, row in enumerate(self._rows):
            row[0], row[1] = first[k], last[k]
        if self.last is None or self._in_parts or not end > t:
            return self._unusual(t, end, first, last, jumps)
        if jumps:
            sample.jumps = True
            failed = self._run()
            sample.jumps = False
        else:
            failed = self._run()
        return self._finished() if failed else ()

    def _unusual(
        self, t: float, end: float, first: list[float], last: list[float], jumps: bool
    ) -> tuple[SystemSwitch, ...]:
        """Do what `_advanced` does for the first sample, one without length, or one in parts."""
        sample, b, lost = self._sample, self.memory.buffers, tuple[SystemSwitch, ...]()
        if b.memory.phase == loop.START and self._enters:
            self._enter(first if end > t else last)
        knots = self.knots(t, end) if self._in_parts else []
        sample.until = end
        for part in (*knots, end):
            sample.end = part
            sample.waits = part == end > t
            sample.jumps = jumps and sample.waits
            if sample.resumed:
                b.now.pause = part
                b.plan.knots[0] = part
                b.out.next_knot = 0
            if self._run():
                lost += self._finished()
            sample.resumed = True
        sample.resumed, sample.waits, sample.jumps, sample.until = False, True, False, -LATEST
        return lost

    def _finished(self) -> tuple[SystemSwitch, ...]:
        """Complete a sample that ended early; return what its log lost; or raise its error."""
        sample, lost = self._sample, list[SystemSwitch]()
        while code := sample.code:
            if code != FULL_LOG:
                machine = self.memory.buffers.memory.machine
                bank = self.start.program.layout.bank(machine)
                element = f"contact {bank.name!r}, element {machine - bank.first + 1}"
                raise failure(self.start, self.memory, code, element, "system", self.t)
            lost += self.logged
            sample.switches, sample.resumed = 0, True
            self._run()
            sample.resumed = False
        return tuple(lost)

    def _enter(self, values: list[float]) -> None:
        """Enter the default states with the first inputs."""
        b: Any = self.memory.buffers
        start = self.started(values)
        sent = {k: b.now.y[k] for k in self.events.values()}
        b.now.y[:], b.memory.anchor[:] = start.y, start.y
        for place, value in sent.items():
            b.now.y[place] = value

    def knots(self, t: float, end: float) -> list[float]:
        """Return the times within a sample at which texts jump, such as floor(t)."""
        until, known = self._knots
        if end > until:
            shared, own = numbers_of(self.system)
            rows = {name: as_floats(row) for name, (_, row) in own.items()}
            until = end + AHEAD
            known = sorted(step_times(self._steps, shared, rows, self.t_start, until))
            self._knots = until, known
        return known[bisect_right(known, t) : bisect_left(known, end)]

    def peek(
        self, end: float, first: list[float], last: list[float], names: Sequence[str]
    ) -> list[float]:
        """Return values at the end of a sample, and stay."""
        now, copy = self._standing, self._copy()
        try:
            self.commit(end, first, last)
            return [self.value(name) for name in names]
        finally:
            self._take(copy)
            self._standing = now

    def send(self, event: str) -> None:
        """Let an event wait for the next sample."""
        if not isinstance(event, str) or event not in self.events:
            raise unknown("event", event, self.events)
        self.memory.buffers.now.y[self.events[event]] = 1.0

    # ------------------------------------------------------------------ what it found
    @property
    def logged(self) -> list[SystemSwitch]:
        """The switches in the log of the sample."""
        sample, layout = self._sample, self.start.program.layout
        count = sample.switches
        found = []
        for t, i, edge in zip(
            sample.t[:count], sample.machine[:count], sample.edge[:count], strict=True
        ):
            bank = layout.bank(int(i))
            name = layout.edges[int(edge)][0]
            found.append(SystemSwitch(float(t), bank.name, int(i) - bank.first, name))
        return found

    @property
    def states(self) -> dict[str, tuple[str, ...]]:
        """Of each contact and supervisor the states of its elements."""
        mode = [*map(int, self.memory.buffers.now.mode)]
        return {
            bank.name: tuple(each.chart.states[i].name for i in mode[bank.elements])
            for bank, each in zip(
                self.start.program.layout.banks, self.system.machines, strict=True
            )
        }

    @functools.cached_property
    def names(self) -> list[str]:
        """The names that `value` knows."""
        layout = self.start.program.layout
        more = (key for key, name in layout.keys.items() if name in layout.y.shared)
        return [*dict.fromkeys([*system_names(self.system), *more])]

    def value(self, name: str) -> float:
        """Return the present value of a name."""
        try:
            found = self._places.get(name)
        except TypeError:  # a list, for example
            raise unknown("name", name, self.names) from None
        if found is None:
            if name not in self.names:
                raise unknown("name", name, self.names)
            found = self._place(name)
            self._places[name] = found
        values, k = found
        if values is None or self.last is None:
            return self._read(name)
        value: float = values[k]
        return value

    @functools.cached_property
    def _places(self) -> dict[str, tuple[Any, int]]:
        """Where values are that need not be computed."""
        return {}

    def _place(self, name: str) -> tuple[Any, int]:
        """Return where a value is; none if it is computed when asked for."""
        layout = self.start.program.layout
        b = self.memory.buffers
        here = layout.keys.get(name, name)
        if here in layout.y.shared:
            return _viewed(b.now.y), layout.y.index(here)
        if here in layout.observed.shared:
            return _viewed(self._sample.seen), layout.observed.index(here)
        return None, 0

    def _read(self, name: str) -> float:
        """Return a value as the trace of a run computes it."""
        b, start = self.memory.buffers, self.start
        lines = {} if self.last is None else dict(zip(self.inputs, self.last[3], strict=True))
        if name in lines:
            return lines[name]
        shared, own, _ = start.program.p
        p = shared, own, [[*map(float, row)] for row in self.memory.tables]
        program = dataclasses.replace(start.program, p=p)
        given = {
            each: Corners(np.array([-1.0, 0.0]), np.full(2, value), held=True)
            for each, value in lines.items()
        }
        system = dataclasses.replace(start.system, signals={**start.system.signals, **given})
        y = [*map(float, b.now.y)]
        scope = SystemScope.of(system, program, self.t, y, hybrid.modes_of(b))
        layout = start.program.layout
        if name in layout.y.shared or name in layout.keys:
            return y[layout.y.index(layout.keys.get(name, name))]
        return float(scope.watches()[name])

    # ------------------------------------------------------------------ going back
    @functools.cached_property
    def identity(self) -> tuple[str, str]:
        """What states can be exchanged with: the same numbers, and the same engine."""
        program, options = self.start.program, self.start.options
        method = getattr(options.method, "name", str(options.method))
        what = program.source, program.p[:2], options.rtol, options.atol, method, options.step
        return hashlib.sha256(repr(what).encode()).hexdigest(), self.engine

    @property
    def _standing(self) -> Standing:
        return self.t, self.last, self.lost, self.told

    @_standing.setter
    def _standing(self, standing: Standing) -> None:
        self.t, self.last, self.lost, self.told = standing

    def snapshot(self) -> Snapshot:
        """Return the present state."""
        return Snapshot(self.t, self.identity, (self._copy(), self._standing))

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        copy, self._standing = content_of(snapshot, Snapshot, self.identity)
        self._take(copy)

    def packed(self) -> tuple[Any, Standing]:
        """Return the present state as lists, without addresses in memory."""
        copy, here = self._copy(), _lists(self.memory.whole())

        def listed(before: Any) -> Any:
            self._take(before)
            return _lists(self.memory.whole())

        try:
            return here, _with(self._standing, listed)
        finally:
            self._take(copy)

    def unpack(self, state: tuple[Any, Standing]) -> None:
        """Return to what `packed` returned."""
        here, standing = state

        def taken(before: Any) -> Any:
            self.memory.put_whole(before)
            return self._copy()

        self._standing = _with(standing, taken)
        self.memory.put_whole(here)


def _with(standing: Standing, copied: Callable[[Any], Any]) -> Standing:
    """Return the same with another copy of the state before the last sample."""
    t, last, *told = standing
    return t, None if last is None else (*last[:4], copied(last[4])), *told  # type: ignore[return-value]


def _sees_ends(start: Problem) -> bool:
    """Return whether a run depends on whether inputs jump at the end of a sample.

    That is so if it reads the time, or compares velocities across a jump.
    """
    program = start.program
    return bool(program.velocities or program.lasting) or reads_time(program.source)


def _viewed(array: Any) -> Any:
    """Return a view whose items are read in half the time of those of an array."""
    given: Any = array
    return memoryview(given) if isinstance(array, np.ndarray) else array


def _lists(state: Mapping[str, Any]) -> dict[str, list[float]]:
    return {
        name: place.tolist() if isinstance(place, np.ndarray) else list(place)
        for name, place in state.items()
    }
