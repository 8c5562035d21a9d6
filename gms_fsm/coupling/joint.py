"""One contact in the memory in which it is advanced: what can be read there, and written."""

from __future__ import annotations

import functools
import hashlib
import sys
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.coupling.steppable import start_of
from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.language import EVENT
from gms_fsm.lowering.scales import scales_of
from gms_fsm.run.plausible import bounds_of
from gms_fsm.run.problem import LATEST, Problem
from gms_fsm.run.stepped.failing import failure
from gms_fsm.run.stepped.memory import JointMemory
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact
from gms_fsm.traces.failures import (
    SimulationError,
)
from integrators import loop
from integrators.runners import states
from integrators.runners.stepping import FULL_LOG

Line = tuple[Any, Any]  # an input at the start and at the end of a sample
ARGUMENTS = ("self", "v0", "v1", "dt")  # of `FrictionState.advance`
# What the loop keeps only between two events at one time.
TEMPORARY = ("cursor", "edges", "heard")
MOST = sys.float_info.max  # stands for infinity in arrays


class ElementSwitch(NamedTuple):
    """An edge that was taken."""

    t: float  # s
    element: int
    edge: str


class Asked(NamedTuple):
    """The arguments of a friction, besides the model."""

    t: float
    initial: Mapping[str, Any] | None
    rtol: float


class StatePart(NamedTuple):
    """A part of the state, and where it is in an array."""

    name: str
    kind: np.dtype[Any]
    where: slice


class Joint:
    """One contact, and the memory in which it is advanced; errors name its place."""

    def __init__(
        self,
        given: Model | Contact,
        asked: Asked,
        start: Problem,
        memory: JointMemory,
        place: str,
    ) -> None:
        self.given, self.asked, self.start = given, asked, start
        self.memory, self.place = memory, place
        (self._bank,) = start.program.layout.banks
        contact = start.system.contacts[0]
        self._chart = contact.chart
        self.inputs = tuple(start.system.signals)[1:]
        if taken := [name for name in self.inputs if name in ARGUMENTS]:
            raise ParameterError(
                f"its texts name {taken[0]!r}, which is an argument of advance",
                place=f"contact {contact.name!r}",
                advice="give it another name",
            )
        layout = start.program.layout
        self.events = {name.removeprefix(EVENT): layout.y.index(name) for name in layout.events}
        # The entry of its default state sees the first velocity.
        self.enters = bool(self._chart.assigned())

    # ------------------------------------------------------------------ samples
    def enter(self, t: float, lines: Mapping[str, Line]) -> None:
        """Enter the default states with the first inputs, if that has not been done yet."""
        b: Any = self.memory.buffers
        if b.memory.phase == loop.START:
            # Of a sample without length only its end matters.
            first = 0 if t > b.now.t else 1
            values = {name: line[first] for name, line in lines.items()}
            try:
                start = start_of(self.given, *self.asked, values)
            except GMSError as error:
                raise self._within(error) from None
            sent = {k: b.now.y[k] for k in self.events.values()}
            b.now.y[:], b.memory.anchor[:] = start.y, start.y
            for place, value in sent.items():
                b.now.y[place] = value

    def send(self, event: str) -> None:
        """Let an event wait for the next sample."""
        self.memory.buffers.now.y[self.events[event]] = 1.0

    def finish(self, now: float) -> list[ElementSwitch]:
        """Complete a sample that ended early, and return what its log lost; or raise its error."""
        sample, lost = self.memory.sample, list[ElementSwitch]()
        while code := sample.code:
            if code != FULL_LOG:
                raise self._within(self._failure(code, now))
            lost += self.logged
            sample.switches, sample.resumed = 0, True
            self.memory.run()
            sample.resumed = False
        return lost

    def _within(self, error: GMSError) -> GMSError:
        """Return an error that names this joint, if there are several."""
        return error.inside(self.place) if self.place else error

    def _failure(self, code: int, now: float) -> SimulationError:
        """Return the error for a sample that cannot be completed."""
        machine = self.memory.buffers.memory.machine
        return failure(self.start, self.memory, code, f"element {machine + 1}", "friction", now)

    # ------------------------------------------------------------------ what it found
    @property
    def states(self) -> tuple[str, ...]:
        """The state of each element."""
        return tuple(self._chart.states[int(i)].name for i in self.memory.buffers.now.mode)

    @property
    def variables(self) -> dict[str, FloatArray]:
        """The chart's variables, one value per element."""
        places, y = self.start.program.layout.y, np.array(self.memory.buffers.now.y)
        return {name: y[list(places.all_of(self._bank.of(name)))] for name in self._bank.variables}

    @property
    def logged(self) -> list[ElementSwitch]:
        """The switches in the log of the sample."""
        sample, edges = self.memory.sample, self._chart.transitions
        count = sample.switches
        log = zip(sample.t[:count], sample.machine[:count], sample.edge[:count], strict=True)
        return [ElementSwitch(float(t), int(i), edges[int(edge)].name) for t, i, edge in log]

    def forget(self, t: float) -> None:
        """Empty the log; the present time is another."""
        self.memory.sample.switches, self.memory.sample.end = 0, t

    @property
    def speed(self) -> float:
        """A small speed, m/s."""
        scales = scales_of(self.start.system.contacts[0])
        return scales.speed or scales.v or 1.0

    # ------------------------------------------------------------------ its state as numbers
    @functools.cached_property
    def stamp(self) -> str:
        """The same for joints that can exchange their states: those with the same numbers."""
        program, options = self.start.program, self.start.options
        what: tuple[Any, ...] = program.source, program.p[:2], options.rtol, options.atol
        if self.enters:  # what is entered depends on the initial values, too
            what = *what, self.start.y, self.start.mode
        return hashlib.sha256(repr(what).encode()).hexdigest()

    @property
    def numbers(self) -> FloatArray:
        """The present state as finite numbers."""
        state = self.memory.state()
        flat = np.concatenate([np.asarray(state[part.name], float) for part in self._parts])
        found: FloatArray = np.clip(flat, -MOST, MOST)
        return found

    @property
    def size(self) -> int:
        """How many numbers there are."""
        stop: int = self._parts[-1].where.stop
        return stop

    def checked(self, given: FloatArray) -> tuple[float, FloatArray]:
        """Return the time and the state that numbers mean, or refuse them."""
        least, most, whole = self._limits
        flat = np.where(np.abs(given) < MOST, given, np.copysign(np.inf, given))
        part = next(part for part in self._parts if part.name == "y")
        y = flat[part.where].tolist()
        for place in self.events.values():  # one may have been sent
            y[place] = 0.0
        if self.enters and flat[self._phase] == loop.START and self.start.y != y:
            raise ParameterError(
                "it is of a friction that begins with other initial values",
                place="array",
                advice="make this one with the same ones",
            )
        wrong = (flat < least) | (flat > most) | (whole & (flat != np.rint(flat)))
        phase = flat[self._phase]
        if wrong.any() or phase not in (loop.START, loop.SETTLED, loop.ARC):
            at = int(np.argmax(wrong)) if wrong.any() else self._phase
            name = next(part.name for part in self._parts if at < part.where.stop)
            raise ParameterError(
                f"it is no state of this friction ({name}: {float(flat[at])!r})",
                place="array",
                advice="give what to_array returned, unchanged",
            )
        clock = next(part.where.start for part in self._parts if part.name == "clock")
        return float(flat[clock + states.CLOCK.index("t")]), flat

    def write(self, flat: FloatArray) -> None:
        """Return to a state that is checked."""
        parts = self._parts
        self.memory.put({each.name: flat[each.where].astype(each.kind).tolist() for each in parts})

    @functools.cached_property
    def _parts(self) -> list[StatePart]:
        """The arrays that make up the state between two samples."""
        parts, start = [], 0
        for name, place in self.memory.state().items():
            if name not in TEMPORARY and len(place) > 0:
                where = slice(start, start + len(place))
                parts.append(StatePart(name, np.asarray(place).dtype, where))
                start = where.stop
        return parts

    @functools.cached_property
    def _phase(self) -> int:
        """The place of the loop's phase in an array."""
        start: int = next(part.where.start for part in self._parts if part.name == "counts")
        return start + states.COUNTS.index("phase")

    @functools.cached_property
    def _limits(self) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """The least and largest values in an array, and which are integers."""
        least, most = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        whole = np.zeros(self.size, dtype=np.bool_)
        bounds = bounds_of(self.start, self.memory.buffers)
        for part in self._parts:
            whole[part.where] = part.kind.kind != "f"
            if part.name == "floor":  # tolerances only grow
                least[part.where] = self.memory.buffers.now.floor
            if part.name in bounds:
                least[part.where], most[part.where] = bounds[part.name]
            if part.name == "clock":  # it may be of a friction that began earlier
                t = part.where.start + states.CLOCK.index("t")
                least[t], most[t] = -LATEST, LATEST
        most[whole] = np.minimum(most[whole], 2.0**53)
        least[whole] = np.maximum(least[whole], -(2.0**53))
        return least, most, whole
