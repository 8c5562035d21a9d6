"""One contact with its stepper: what `FrictionState` and `FrictionBank` have in common."""

from __future__ import annotations

import functools
import hashlib
import sys
import threading
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm._arguments import checked_kind
from gms_fsm.charts.parameters import FloatArray, checked_array, checked_scalar
from gms_fsm.errors import ParameterError
from gms_fsm.lowering.scales import scales_of
from gms_fsm.run._plausible import bounds_of
from gms_fsm.run._steppable import start_of
from gms_fsm.run._stepper import Machine, Plain, Stepper, fast, put_state, state_of
from gms_fsm.run.settings import MOST_STEPS
from gms_fsm.run.start import LATEST, Start
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact
from gms_fsm.traces.failures import (
    LivelockError,
    NotFiniteError,
    NotUniqueError,
    SimulationError,
    StepLimitError,
    StepSizeError,
)
from gms_fsm.traces.rows import Rows
from integrators import advance, hybrid, loop, states
from integrators.stepping import FULL_LOG

__all__ = [
    "Alone",
    "Asked",
    "Joint",
    "Last",
    "Line",
    "Switch",
    "check_inputs",
    "content_of",
    "in_use",
    "later",
    "line_of",
    "made_again",
    "numbers_of",
    "stepper_kind",
    "too_late",
    "too_short",
]

Line = tuple[float, float]  # an input at the start and at the end of a sample
ARGUMENTS = ("self", "v0", "v1", "dt")  # of `FrictionState.advance`
# What the loop keeps only between two events at one time.
TEMPORARY = ("cursor", "edges", "due")
MOST = sys.float_info.max  # stands for infinity in arrays
CHANGE = 1e-4  # of the last velocity, for a derivative by differences
FAILURES: Mapping[int, tuple[type[SimulationError], str]] = {
    loop.MACHINE_LIVELOCK: (LivelockError, "it keeps switching without progress"),
    loop.RELATION_LIVELOCK: (LivelockError, "a comparison keeps changing without progress"),
    advance.TOO_SMALL: (StepSizeError, "the step size fell below the resolution of the clock"),
    loop.TOO_MANY_STEPS: (StepLimitError, f"one sample needs more than {MOST_STEPS:,} steps"),
    advance.NOT_FINITE: (NotFiniteError, "the flow is NaN or infinite"),
    loop.ENTANGLED: (NotUniqueError, "it is between states on surfaces that cross: not unique"),
}


class Switch(NamedTuple):
    """An edge that was taken."""

    t: float  # s
    element: int
    edge: str


class Alone:
    """Lets one thread at a time into a friction, and refuses the others at once.

    The same thread may come in again: after Ctrl-C it may never have left.
    """

    def __init__(self) -> None:
        lock = threading.RLock()
        self.acquire, self.leave = lock.acquire, lock.release

    def __enter__(self) -> None:
        if not self.acquire(False):
            raise in_use()

    def __exit__(self, *_: object) -> None:
        self.leave()


def in_use() -> ParameterError:
    """Return the error for a call while another thread's call is under way."""
    return ParameterError(
        "another thread is in a call of this friction",
        advice="give each thread a friction of its own, or hold a lock during each call; nothing "
        "has changed",
    )


class Asked(NamedTuple):
    """The arguments of a friction, besides the model."""

    t: float
    initial: Mapping[str, Any] | None
    rtol: float


class Part(NamedTuple):
    """A part of the state, and where it is in an array."""

    name: str
    kind: np.dtype[Any]
    where: slice


class Last(NamedTuple):
    """A sample of one joint."""

    v0: float  # m/s
    v1: float
    t: float  # s, at its end
    inputs: Mapping[str, Line]


class Joint:
    """One contact, its stepper, and the time.

    Parameters
    ----------
    given : Model or Contact
        What steps.
    asked : Asked
        Its other arguments.
    start : Start
        The same, as a start.
    stepper : Machine or Plain
        Of that start.
    """

    def __init__(
        self, given: Model | Contact, asked: Asked, start: Start, stepper: Stepper
    ) -> None:
        self.given, self.asked, self.start, self.stepper = given, asked, start, stepper
        self.t = start.t_start
        self.alone = Alone()
        self.last: Last | None = None
        self.more: list[Switch] = []  # that did not fit into the log
        (self._bank,) = start.program.layout.banks
        self._chart = start.system.contacts[0].chart
        self.inputs = tuple(start.system.signals)[1:]
        if taken := [name for name in self.inputs if name in ARGUMENTS]:
            raise ParameterError(
                f"its texts name {taken[0]!r}, which is an argument of advance",
                place=f"contact {start.system.contacts[0].name!r}",
                advice="give it another name",
            )
        self._sampled = stepper.sample
        # A view: an item of a memoryview is written in half the time of one of an array.
        self._v = _view(stepper.sample.inputs[0])
        # The entry of its default state sees the first velocity.
        self.enters = bool(self._chart.assignments["entry", self._chart.default_state.name])

    # ------------------------------------------------------------------ samples
    def run(self, v0: float, v1: float, t: float, inputs: Mapping[str, Line]) -> float:
        """Advance the stepper, but not the time of this object; return the force."""
        if self.inputs:
            self._give(inputs)
        if self.enters:
            self.enter(Last(v0, v1, t, inputs))
        v, sample = self._v, self._sampled
        sample.end, v[0], v[1] = t, v0, v1
        sample.resumed = False
        self.more = []
        if code := self.stepper.run():
            self.finish(code)
        return sample.force

    def finish(self, code: int) -> None:
        """Complete a sample that ended early, or raise its error."""
        sample = self._sampled
        while code:
            if code != FULL_LOG:
                raise self._failure(code)
            self.more += self._logged()
            sample.switches, sample.resumed = 0, True
            code = self.stepper.run()

    def commit(self, v0: float, v1: float, t: float, inputs: Mapping[str, Line]) -> float:
        """Advance by a sample; if that fails everything is as before."""
        more, now, last = self.more, self.t, self.last
        self.stepper.keep()
        try:
            force = self.run(v0, v1, t, inputs)
            self.t, self.last = t, Last(v0, v1, t, inputs)
        except BaseException:  # Ctrl-C, too
            self.stepper.undo()
            self.more, self.t, self.last = more, now, last
            raise
        return force

    def peek(self, v0: float, v1: float, t: float, inputs: Mapping[str, Line]) -> float:
        """Return the force at the end of a sample, and stay."""
        stepper, before, more = self.stepper, self.stepper.copy(), self.more
        try:
            return self.run(v0, v1, t, inputs)
        finally:
            stepper.take(before)
            self.more = more

    def _give(self, inputs: Mapping[str, Line]) -> None:
        """Write the further inputs."""
        for place, name in zip(self.stepper.sample.inputs[1:], self.inputs, strict=True):
            place[0], place[1] = inputs[name]

    def enter(self, sample: Last) -> None:
        """Enter the default states with the first inputs, if that has not been done yet."""
        b: Any = self.stepper.buffers
        if b.memory.phase == loop.START:
            lines = {**sample.inputs, "v": (sample.v0, sample.v1)}
            # Of a sample without length only its end matters.
            first = 0 if sample.t > b.now.t else 1
            values = {name: line[first] for name, line in lines.items()}
            start = start_of(self.given, *self.asked, values)
            b.now.y[:], b.memory.anchor[:] = start.y, start.y

    def _logged(self) -> list[Switch]:
        sample, edges = self.stepper.sample, self._chart.transitions
        count = sample.switches
        log = zip(sample.t[:count], sample.machine[:count], sample.edge[:count], strict=True)
        return [Switch(float(t), int(i), edges[int(edge)].name) for t, i, edge in log]

    def _failure(self, code: int) -> SimulationError:
        """Return the error for a sample that cannot be completed."""
        b, start = self.stepper.buffers, self.start
        t, modes = b.now.t, hybrid.modes_of(b)
        where = np.array([t]), np.zeros(1, dtype=np.int64), np.array([b.now.y]), np.array([modes])
        row = Rows(*where)
        kind, reason = FAILURES[code]
        element = f"element {b.memory.machine + 1}"
        error = kind(
            reason,
            start.trace(row, row, start.firings([])),
            t=t,
            place=element if code == loop.MACHINE_LIVELOCK else "",
            advice=f"the friction is as it was before the call, at t = {self.t!r} s",
        )
        error.kept = ""  # a sample has no rows
        return error

    # ------------------------------------------------------------------ what it found
    @property
    def states(self) -> tuple[str, ...]:
        """The state of each element."""
        return tuple(self._chart.states[int(i)].name for i in self.stepper.buffers.now.mode)

    @property
    def variables(self) -> dict[str, FloatArray]:
        """The chart's variables, one value per element."""
        places, y = self.start.program.layout.y, np.array(self.stepper.buffers.now.y)
        return {name: y[list(places.all_of(self._bank.of(name)))] for name in self._bank.variables}

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The edges taken in the last sample."""
        return (*self.more, *self._logged()) if self._sampled.switches or self.more else ()

    @property
    def mean_force(self) -> float:
        """The mean of the force over the last sample."""
        return self._again(0.0, mean=True)

    @property
    def dF_dv(self) -> float:
        """The derivative of the last force with respect to the velocity there."""
        last = self._sample()
        change = CHANGE * max(abs(float(last.v0)), abs(float(last.v1)), self._speed)
        return (self._again(change) - self._again(-change)) / (2.0 * change)

    @functools.cached_property
    def _speed(self) -> float:
        """A small speed, m/s."""
        scales = scales_of(self.start.system.contacts[0])
        return scales.speed or scales.v or 1.0

    def _sample(self) -> Last:
        if self.last is None:
            raise ParameterError("there is no last sample", advice="call advance first")
        return self.last

    def _again(self, change: float, *, mean: bool = False) -> float:
        """Return the force, or its mean, had the last velocity been different."""
        v0, v1, t, inputs = self._sample()
        stepper, more = self.stepper, self.more
        now = stepper.copy()
        stepper.back()
        length = t - stepper.buffers.now.t
        mean = mean and length > 0.0
        self._sampled.mean = mean
        try:
            force = self.run(v0, v1 + change, t, inputs)
            impulse = self._sampled.impulse
        finally:
            stepper.take(now)
            self.more = more
        return impulse / length if mean else force

    # ------------------------------------------------------------------ going back
    def moved_to(self, t: float) -> None:
        """Forget the last sample: the stepper has been given another state."""
        self.t, self.last, self.more = t, None, []
        self._sampled.switches = 0

    @property
    def engine(self) -> str:
        """The name of its engine."""
        return "compiled" if isinstance(self.stepper, Machine) else "ifelse"

    @functools.cached_property
    def identity(self) -> tuple[str, str]:
        """What states can be exchanged with: the same numbers, and the same engine."""
        program, options = self.start.program, self.start.options
        what: tuple[Any, ...] = program.source, program.p[:2], options.rtol, options.atol
        if self.enters:  # what is entered depends on the initial values, too
            what = *what, self.start.y, self.start.mode
        return hashlib.sha256(repr(what).encode()).hexdigest(), self.engine

    def to_array(self) -> FloatArray:
        """Return the present state as finite numbers."""
        flat, state = np.empty(self.length), state_of(self.stepper)
        for part in self._parts:
            flat[part.where] = state[part.name]
        found: FloatArray = np.clip(flat, -MOST, MOST)
        return found

    @property
    def length(self) -> int:
        """Of an array."""
        stop: int = self._parts[-1].where.stop
        return stop

    def from_array(self, given: FloatArray) -> None:
        """Return to what `to_array` returned; it has the right length."""
        least, most, whole = self._limits
        flat = np.where(np.abs(given) < MOST, given, np.copysign(np.inf, given))
        y = next(part for part in self._parts if part.name == "y")
        if (
            self.enters
            and flat[self._phase] == loop.START
            and self.start.y != flat[y.where].tolist()
        ):
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
        put_state(
            self.stepper,
            {part.name: flat[part.where].astype(part.kind).tolist() for part in self._parts},
        )
        self.moved_to(self.stepper.buffers.now.t)

    @functools.cached_property
    def _parts(self) -> list[Part]:
        """The arrays that make up the state between two samples."""
        parts, start = [], 0
        for name, place in state_of(self.stepper).items():
            if name not in TEMPORARY and len(place) > 0:
                where = slice(start, start + len(place))
                parts.append(Part(name, np.asarray(place).dtype, where))
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
        least, most = np.full(self.length, -np.inf), np.full(self.length, np.inf)
        whole = np.zeros(self.length, dtype=np.bool_)
        bounds = bounds_of(self.start, self.stepper.buffers)
        for part in self._parts:
            whole[part.where] = part.kind.kind != "f"
            if part.name == "floor":  # tolerances only grow
                least[part.where] = self.stepper.buffers.now.floor
            if part.name in bounds:
                least[part.where], most[part.where] = bounds[part.name]
            if part.name == "clock":  # it may be of a friction that began earlier
                t = part.where.start + states.CLOCK.index("t")
                least[t], most[t] = -LATEST, LATEST
        most[whole] = np.minimum(most[whole], 2.0**53)
        least[whole] = np.maximum(least[whole], -(2.0**53))
        return least, most, whole


def _view(place: Any) -> Any:
    return memoryview(place) if isinstance(place, np.ndarray) else place  # type: ignore[arg-type]


def made_again(kind: Any, given: Any, arguments: Mapping[str, Any], array: FloatArray) -> Any:
    """Return a copy of a `FrictionState` or a `FrictionBank`, also in another process."""
    new = kind(given, **arguments)
    new.from_array(array)
    return new


# --------------------------------------------------------------------------- arguments
def stepper_kind(engine: object) -> type[Machine] | type[Plain]:
    """Return what carries out the steps of an engine; None is machine code, where it can be made.

    Raises
    ------
    ParameterError, MissingExtraError
        If it is no engine, or llvmlite is missing.
    """
    if engine is None:
        return Machine if fast() else Plain
    if not isinstance(engine, str) or engine not in ("compiled", "ifelse"):
        raise ParameterError("it must be 'compiled' or 'ifelse'", place="engine", value=engine)
    return Machine if engine == "compiled" else Plain


def too_late(name: str, value: object) -> ParameterError:
    """Return the error for a time that the clock cannot resolve."""
    return ParameterError(
        "it is too large", place=name, value=value, advice=f"at most {LATEST:g} s"
    )


def too_short(dt: float, t: float) -> ParameterError:
    """Return the error for a sample that the clock cannot resolve."""
    return ParameterError(
        f"it is below the resolution of the clock at t = {t!r} s",
        place="dt",
        value=dt,
        advice="start at a smaller t=...",
    )


def later(t: Any, now: float) -> float:
    """Return a time if it is not before the present one."""
    time = checked_scalar("t", t, "finite")
    if time < now:
        raise ParameterError(
            f"it is before the present time {now!r} s",
            place="t",
            value=time,
            advice="restore a snapshot to go back",
        )
    return time


def line_of(name: str, given: Any) -> tuple[Any, Any]:
    """Return an input at the start and at the end of a sample."""
    flat = isinstance(given, np.ndarray) and given.ndim == 0
    if isinstance(given, tuple | list | np.ndarray) and not flat and len(given) == 2:
        return given[0], given[1]
    raise ParameterError(
        "it must be a pair, its value at the start and at the end of the sample",
        place=name,
        value=given,
    )


def check_inputs(given: Mapping[str, object], known: Iterable[str]) -> None:
    """Refuse inputs unless they are exactly the known ones."""
    names = sorted({*known})
    if sorted(given) != names:
        raise ParameterError(
            f"the further inputs given are {', '.join(sorted(given)) or 'none'}",
            advice=f"give {', '.join(f'{name}=(start, end)' for name in names)}"
            if names
            else "this friction has no inputs but its velocity",
        )


def content_of(snapshot: object, kind: type[Any], identity: tuple[str, str]) -> Any:
    """Return the content of a snapshot if it is of the same friction."""
    checked: Any = checked_kind("snapshot", snapshot, kind, "what snapshot() returned")
    if checked.of != identity:
        reason = "it is of a friction with another engine"
        if checked.of[0] != identity[0]:
            reason = "it is of another model, or of one with other numbers"
        raise ParameterError(
            reason, place="snapshot", advice="take it from a friction made in the same way"
        )
    return checked.content


def numbers_of(array: ArrayLike, length: int) -> FloatArray:
    """Return an array of a given length."""
    given = checked_array("array", array, None, "finite")
    if given.size != length:
        raise ParameterError(
            f"it has {given.size} numbers", place="array", advice=f"it must have {length}"
        )
    return given
