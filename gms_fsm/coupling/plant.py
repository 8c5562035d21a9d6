"""A system whose inputs come sample by sample: its memory, and what advances it.

A sample ends before what happens just there. Whether an input jumps there is known only when the
next sample begins, and a run ends its last step before a jump one clock tick earlier. So a sample
supposes what the one before it had; if that was wrong, it is advanced again. Then all bits are
those of a run over the same samples.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from gms_fsm.charts.parameters import as_floats
from gms_fsm.coupling.joint import failure
from gms_fsm.coupling.joints import Alone, Snapshot, content_of
from gms_fsm.coupling.memory import BlockMemory, ListMemory
from gms_fsm.coupling.steppable import begin, usable
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.language import EVENT
from gms_fsm.lowering.pulses import step_times
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import Settings
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


class LastSample(NamedTuple):
    """A sample, and a copy of the state before it."""

    t: float
    end: float
    lines: Sequence[float]
    before: Any


class Standing(NamedTuple):
    """Where a system is, besides its memory."""

    t: float
    fresh: bool  # no sample yet
    jumps: bool  # the last sample supposed that inputs jump at its end
    last: LastSample | None
    lost: tuple[SystemSwitch, ...]  # those for which the log had no room


class Plant:
    """A system in memory; lines are a start and an end for each input, one after the other."""

    def __init__(
        self,
        system: System,
        t: float,
        initial: Mapping[str, Any] | None,
        settings: Settings,
        engine: str,
    ) -> None:
        self.system, self.initial, self.settings, self.engine = system, initial, settings, engine
        self.inputs, self.t_start = system.inputs, t
        count = len(self.inputs)
        self.start = self.started([0.0] * (2 * count))
        kind = BlockMemory if engine == "compiled" else ListMemory
        memory = kind([self.start], waits=True)
        (self.memory,) = memory.each
        self._copy, self._take, self._run = memory.copy, memory.take, memory.run
        self._sample: Any = memory.sample
        self._rows: list[Any] = [*memory.lines][:count]
        layout = self.start.program.layout
        self.events = {name.removeprefix(EVENT): layout.y.index(name) for name in layout.events}
        self.alone = Alone()
        self.now = Standing(t, True, False, None, ())
        self._spare: Any = None
        self._steps = self.start.program.plan.steps
        self._knots: tuple[float, list[float]] = -np.inf, []  # up to when, and they

    def started(self, lines: Sequence[float], first: int = 0) -> Problem:
        """Return the start of a run in which the inputs have their first values."""
        t, end = begin(self.t_start)
        signals: dict[str, Any] = {
            name: Corners(np.array([t, end]), np.full(2, lines[2 * k + first]), held=True)
            for k, name in enumerate(self.inputs)
        }
        for name, signal in self.system.signals.items():
            if name in signals:
                continue
            if isinstance(signal, Function) or (
                isinstance(signal, Corners) and np.ptp(signal.values)
            ):
                raise ParameterError(
                    "it is a Python function"
                    if isinstance(signal, Function)
                    else "it is a record or has ramps",
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
    def commit(self, end: float, lines: Sequence[float]) -> None:
        """Advance by a sample; if that fails everything is as before."""
        now = self.now
        backup = self._copy(self._spare)
        try:
            before = self._supposed(now, end, lines, backup)
            lost = self._advanced(now.t, end, lines, jumps=self.jumped)
            last = LastSample(now.t, end, lines, before)
            self.now = Standing(end, False, self.jumped and end > now.t, last, lost)
            self._spare = None if now.last is None else now.last.before
        except BaseException:  # Ctrl-C, too
            self._take(backup)
            self.now, self._spare = now, None
            raise

    jumped = False  # whether inputs jumped at the beginning of the present sample

    def _supposed(self, now: Standing, end: float, lines: Sequence[float], backup: Any) -> Any:
        """Return a copy of the state from which a sample begins.

        If inputs jump although the last sample did not suppose it, or the other way round, that is
        advanced again.
        """
        last = now.last
        if last is None:
            self.jumped = False
            return backup
        first = 0 if end > now.t else 1  # of a sample without length only its end matters
        ends, jumped = last.lines, False
        for k in range(0, len(lines), 2):
            jumped = jumped or lines[k + first] != ends[k + 1]
        self.jumped = jumped
        if jumped == now.jumps or last.end == last.t:
            return backup
        memory, plan = self.memory.buffers.memory, self.memory.buffers.plan
        if memory.phase == loop.JUMPING and plan.ticks[memory.jump]:
            return backup  # it waits at a tick in any case
        self._take(last.before)
        self._advanced(last.t, last.end, last.lines, jumps=jumped)
        return self._copy()

    def _advanced(
        self, t: float, end: float, lines: Sequence[float], *, jumps: bool
    ) -> tuple[SystemSwitch, ...]:
        """Advance to the end of a sample; return the switches that did not fit into its log."""
        sample = self._sample
        sample.end = sample.until = end
        sample.waits = end > t
        sample.jumps = jumps and end > t
        sample.resumed = False
        k = 0
        for row in self._rows:
            row[0], row[1] = lines[k], lines[k + 1]
            k += 2
        if self.now.fresh:
            self._enter(end, lines)
        lost: list[SystemSwitch] = []
        if self._steps and end > t:
            for knot in self.knots(t, end):
                self._part(knot, lost)
            self._part(end, lost)
        elif self._run():
            self._finish(lost)
        return tuple(lost)

    def _part(self, end: float, lost: list[SystemSwitch]) -> None:
        """Advance to a knot within a sample, or to its end."""
        b, sample = self.memory.buffers, self._sample
        waits, jumps = sample.waits, sample.jumps
        if end < sample.until:
            sample.waits = sample.jumps = False
        sample.end = end
        if sample.resumed:
            b.now.pause = end
            b.plan.knots[0] = end
            b.out.next_knot = 0
        if self._run():
            self._finish(lost)
        sample.resumed, sample.waits, sample.jumps = True, waits, jumps

    def _finish(self, lost: list[SystemSwitch]) -> None:
        """Complete a sample that ended early; keep what its log lost; or raise its error."""
        sample, now = self._sample, self.now.t
        while code := sample.code:
            if code != FULL_LOG:
                machine = self.memory.buffers.memory.machine
                bank = self.start.program.layout.bank(machine)
                element = f"contact {bank.name!r}, element {machine - bank.first + 1}"
                raise failure(self.start, self.memory, code, element, "system", now)
            lost += self.logged
            sample.switches, sample.resumed = 0, True
            self._run()

    def _enter(self, end: float, lines: Sequence[float]) -> None:
        """Enter the default states with the first inputs."""
        b: Any = self.memory.buffers
        start = self.started(lines, 0 if end > b.now.t else 1)
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
        return [knot for knot in known if t < knot < end]

    def peek(self, end: float, lines: Sequence[float], names: Sequence[str]) -> list[float]:
        """Return values at the end of a sample, and stay."""
        now, spare = self.now, self._spare
        backup = self._copy()
        try:
            self._spare = None
            self.commit(end, lines)
            return [self.value(name) for name in names]
        finally:
            self._take(backup)
            self.now, self._spare = now, spare

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
        return [*dict.fromkeys([*system_names(self.system), *layout.keys])]

    def value(self, name: str) -> float:
        """Return the present value of a name."""
        found = self._places.get(name)
        if found is None:
            if name not in self.names:
                raise unknown("name", name, self.names)
            found = self._place(name)
            self._places[name] = found
        values, k = found
        if values is None or self.now.fresh:
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
        if name in self.inputs:
            return self._rows[self.inputs.index(name)], 1
        return None, 0

    def _read(self, name: str) -> float:
        """Return a value as the trace of a run computes it."""
        b, start = self.memory.buffers, self.start
        shared, own, tables = start.program.p
        now = [list(map(float, row)) for row in self.memory.tables]
        program = dataclasses.replace(start.program, p=(shared, own, now or tables))
        lines = {} if self.now.fresh else dict(zip(self.inputs, self._rows, strict=True))
        given = {
            each: Corners(np.array([-1.0, 0.0]), np.full(2, float(row[1])), held=True)
            for each, row in lines.items()
        }
        system = dataclasses.replace(start.system, signals={**start.system.signals, **given})
        y = [*map(float, b.now.y)]
        scope = SystemScope.of(system, program, self.now.t, y, hybrid.modes_of(b))
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

    def snapshot(self) -> Snapshot:
        """Return the present state."""
        now = self.now
        if now.last is not None:  # its memory is used again
            now = now._replace(last=now.last._replace(before=_copied(now.last.before)))
        return Snapshot(now.t, self.identity, (self._copy(), now))

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        copy, now = content_of(snapshot, Snapshot, self.identity)
        self._take(copy)
        if now.last is not None:
            now = now._replace(last=now.last._replace(before=_copied(now.last.before)))
        self.now, self._spare = now, None

    def packed(self) -> tuple[dict[str, list[float]], Standing]:
        """Return the present state as lists, without addresses in memory."""
        now = self.now
        here = _lists(self.memory.whole())
        if now.last is not None:
            copy = self._copy()
            self._take(now.last.before)
            before = _lists(self.memory.whole())
            self._take(copy)
            now = now._replace(last=now.last._replace(before=before))
        return here, now

    def unpack(self, state: tuple[dict[str, list[float]], Standing]) -> None:
        """Return to what `packed` returned."""
        here, now = state
        if now.last is not None:
            self.memory.put_whole(now.last.before)
            now = now._replace(last=now.last._replace(before=self._copy()))
        self.memory.put_whole(here)
        self.now, self._spare = now, None


def _viewed(array: Any) -> Any:
    """Return a view whose items are read in half the time of those of an array."""
    given: Any = array
    return memoryview(given) if isinstance(array, np.ndarray) else array


def _copied(before: Any) -> Any:
    return before.copy() if isinstance(before, np.ndarray) else before


def _lists(state: Mapping[str, Any]) -> dict[str, list[float]]:
    return {
        name: place.tolist() if isinstance(place, np.ndarray) else list(place)
        for name, place in state.items()
    }
