"""Friction for somebody else's loop: it is given velocities, and returns forces."""

from __future__ import annotations

import functools
import hashlib
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm._arguments import checked_kind
from gms_fsm.charts.parameters import FloatArray, checked_array, checked_scalar
from gms_fsm.errors import ParameterError
from gms_fsm.lowering.scales import scales_of
from gms_fsm.run._plausible import check_state
from gms_fsm.run._steppable import start_of
from gms_fsm.run._stepper import Machine, Plain, Stepper, fast, state_of
from gms_fsm.run.settings import MOST_STEPS
from gms_fsm.run.start import LATEST, Start
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact
from gms_fsm.traces.failures import (
    LivelockError,
    NotFiniteError,
    SimulationError,
    StepLimitError,
    StepSizeError,
)
from gms_fsm.traces.rows import Rows
from integrators import advance, hybrid, loop
from integrators.stepping import FULL_LOG, MEAN, RESUMED, SWITCHES
from integrators.steps import T

__all__ = ["FrictionState", "Snapshot", "Switch", "stepper_kind"]

_Sample: TypeAlias = tuple[float, float, float, Mapping[str, tuple[float, float]]]

# What the loop keeps only between two events of one time.
TEMPORARY = ("cursor", "edges", "due")
MOST = sys.float_info.max  # stands for infinity in arrays
# Of the velocities of a sample: their change for a derivative by differences.
CHANGE = 1e-4


class Switch(NamedTuple):
    """An edge that was taken."""

    t: float  # s
    element: int
    edge: str


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A state of a `FrictionState`, to return to.

    Parameters
    ----------
    t : float
        s.
    """

    t: float
    _of: tuple[str, str]  # the friction and its engine
    _content: Any


class FrictionState:
    """The friction of one contact, advanced by somebody else's loop.

    In each sample the velocity is a straight line, along which every switch is located. The result
    is that of `simulate` with ``Prescribed((t, v))``, to the last bit.

    Parameters
    ----------
    model_or_contact : Model or Contact
        Friction with one velocity and without locks. What the texts of a contact name, other than
        t, x and v, become further inputs; x is the integral of v.
    t : float
        s: the beginning.
    initial : mapping, optional
        As for `gms_fsm.simulate`: ``z``, ``x``, ``states``.
    rtol : float
        Relative tolerance of the deflections within a sample.
    engine : {"compiled", "ifelse"}, optional
        Machine code, or the same functions in Python, with the same bits. Machine code if
        llvmlite is installed (extra ``fast``).

    Raises
    ------
    ParameterError
        If it cannot be stepped, or an argument violates its rule.

    Examples
    --------
    >>> from gms_fsm import GMS, FrictionState, GMSParameters
    >>> friction = FrictionState(GMS(GMSParameters.paper("stick-slip"), law="signed"))
    >>> round(friction.advance(0.0, 0.02, 0.5), 6)
    0.0058
    >>> friction.peek(0.02, 0.0, 0.5) > 0.0058, friction.t
    (True, 0.5)
    """

    def __init__(
        self,
        model_or_contact: Model | Contact,
        *,
        t: float = 0.0,
        initial: Mapping[str, Any] | None = None,
        rtol: float = 1e-6,
        engine: str | None = None,
    ) -> None:
        self.model = model_or_contact
        self._arguments = t, initial, rtol
        start = start_of(model_or_contact, t, initial, rtol)
        self._set(start, stepper_kind(engine)(start))

    def _set(self, start: Start, stepper: Stepper) -> None:
        self._start, self._stepper, self._t = start, stepper, start.t_start
        self._last: _Sample | None = None
        self._more: list[Switch] = []  # that did not fit into the log
        (bank,) = start.program.layout.banks
        chart = start.system.contact(bank.name).chart
        self._chart, self._bank = chart, bank
        self.inputs = tuple(start.system.signals)
        # Views: an item of a memoryview is written in half the time of one of an array.
        sample = stepper.sample
        self._end, self._force = _view(sample.end), _view(sample.force)
        self._counts, self._v = _view(sample.counts), _view(sample.inputs[0])
        enters = bool(chart.assignments["entry", chart.default_state.name])
        self._enters = enters and "v" in chart.inputs  # its entry sees the first velocity

    def __repr__(self) -> str:
        return f"<FrictionState of {self.model!r} at t = {self._t!r} s>"

    # ------------------------------------------------------------------ steps
    def advance(self, v0: float, v1: float, dt: float, **inputs: tuple[float, float]) -> float:
        """Advance by a sample in which the velocity goes from v0 to v1 on a straight line.

        Parameters
        ----------
        v0, v1 : float
            m/s: at the beginning and at the end. If v0 is not where the last sample ended, the
            velocity jumps, and the guards are evaluated again.
        dt : float
            s, >= 0.
        **inputs : (float, float)
            Further inputs of a contact at the beginning and at the end.

        Returns
        -------
        float
            N: the force at the end.

        Raises
        ------
        ParameterError
            If a number is not finite or an input is missing.
        SimulationError
            If it cannot continue. In both cases the friction is as it was before.
        """
        try:
            good = 0.0 <= dt <= LATEST and isfinite(v0) and isfinite(v1)
        except TypeError:
            good = False
        if not good:
            v0, v1, dt = _checked_sample(v0, v1, dt)
        return self._advance(v0, v1, self._t + dt, inputs)

    def advance_to(self, v0: float, v1: float, t: float, **inputs: tuple[float, float]) -> float:
        """Advance to a time; see `advance`.

        Parameters
        ----------
        v0, v1, **inputs
            As in `advance`.
        t : float
            s: not before the present time.

        Returns
        -------
        float
            N: the force at the end.
        """
        v0, v1, t = _checked_sample(v0, v1, t, "t")
        if t < self._t:
            raise ParameterError(
                f"it is {t!r} s, before the present time {self._t!r} s",
                place="t",
                advice="restore a snapshot to go back",
            )
        return self._advance(v0, v1, t, inputs)

    def peek(self, v0: float, v1: float, dt: float, **inputs: tuple[float, float]) -> float:
        """Return what `advance` would return, and stay: for the stages of a Runge-Kutta step.

        Parameters
        ----------
        v0, v1, dt, **inputs
            As in `advance`. With dt = 0 this is the force at v1, now.

        Returns
        -------
        float
            N: the force at the end.
        """
        v0, v1, dt = _checked_sample(v0, v1, dt)
        before, more = self._stepper.copy(), self._more
        try:
            self._run(v0, v1, self._t + dt, inputs)
            force: float = self._force[0]
        finally:
            self._stepper.take(before)
            self._more = more
        return force

    def _advance(
        self, v0: float, v1: float, t: float, inputs: Mapping[str, tuple[float, float]]
    ) -> float:
        self._stepper.keep()
        try:
            self._run(v0, v1, t, inputs)
        except BaseException:
            self._stepper.back()
            raise
        self._t, self._last = t, (v0, v1, t, inputs)
        force: float = self._force[0]
        return force

    def _run(
        self, v0: float, v1: float, t: float, inputs: Mapping[str, tuple[float, float]]
    ) -> None:
        if t > LATEST:
            raise ParameterError(
                f"it would be {t!r}", place="t", advice=f"beyond {LATEST:g} s time is too coarse"
            )
        if inputs or len(self.inputs) > 1:
            self._give(inputs)
        if self._enters:
            self._enter(v0, inputs)
        v, counts = self._v, self._counts
        self._end[0], v[0], v[1] = t, v0, v1
        counts[RESUMED] = 0
        self._more = []
        while code := self._stepper.run():
            if code != FULL_LOG:
                raise self._failure(code)
            self._more += self._logged()
            counts[SWITCHES], counts[RESUMED] = 0, 1

    def _give(self, inputs: Mapping[str, tuple[float, float]]) -> None:
        """Write the further inputs."""
        names = self.inputs[1:]
        if {*inputs} != {*names}:
            raise ParameterError(
                f"the inputs given are {', '.join(inputs) or 'none'}",
                advice=f"give {', '.join(f'{name}=(start, end)' for name in names)}"
                if names
                else "this friction has no inputs but the velocity",
            )
        lines = {name: _line(name, given) for name, given in inputs.items()}
        for place, name in zip(self._stepper.sample.inputs[1:], names, strict=True):
            place[0], place[1] = lines[name]

    def _enter(self, v0: float, inputs: Mapping[str, tuple[float, float]]) -> None:
        """Enter the default states with the first velocity, if they have not been left yet."""
        b = self._stepper.buffers
        if b.memory.counts[loop.PHASE] == loop.START:
            first = {name: _line(name, given)[0] for name, given in inputs.items()}
            start = start_of(self.model, *self._arguments, {**first, "v": v0})
            b.now.y[:] = b.memory.anchor[:] = start.y

    def _logged(self) -> list[Switch]:
        sample, edges = self._stepper.sample, self._chart.transitions
        count = int(self._counts[SWITCHES])
        log = zip(sample.t[:count], sample.machine[:count], sample.edge[:count], strict=True)
        return [Switch(float(t), int(i), edges[int(edge)].name) for t, i, edge in log]

    def _failure(self, code: int) -> SimulationError:
        """Return the error for a sample that cannot be completed."""
        b, start = self._stepper.buffers, self._start
        t, modes = float(b.now.clock[T]), hybrid.modes_of(b)
        row = Rows(
            np.array([t]), np.zeros(1, dtype=np.int64), np.array([b.now.y]), np.array([modes])
        )
        trace = start.trace(row, row, start.firings([]))
        kind, reason = _FAILURES.get(code, _FAILURES[advance.NOT_FINITE])
        return kind(
            reason,
            trace,
            t=t,
            place=f"element {int(b.memory.counts[loop.MACHINE]) + 1}"
            if code == loop.MACHINE_LIVELOCK
            else "",
            advice=f"the friction is at t = {self._t!r} s, as before the call",
        )

    # ------------------------------------------------------------------ what it found
    @property
    def t(self) -> float:
        """s: the present time."""
        return self._t

    @property
    def states(self) -> tuple[str, ...]:
        """The state of each element."""
        return tuple(self._chart.states[int(i)].name for i in self._stepper.buffers.now.mode)

    @property
    def variables(self) -> dict[str, FloatArray]:
        """The chart's variables, one value per element."""
        places, y = self._start.program.layout.y, np.array(self._stepper.buffers.now.y)
        return {name: y[places.all_of(self._bank.of(name))] for name in self._bank.variables}

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The edges taken in the last sample."""
        return (*self._more, *self._logged())

    @property
    def mean_force(self) -> float:
        """N: the mean of the force over the last sample, by Simpson's rule between switches.

        It is computed when asked for. A host that holds the force during a sample, and uses this
        one, exchanges the right impulse.
        """
        return self._again(0.0, mean=True)

    @property
    def dF_dv(self) -> float:
        """Ns/m: how the force at the end of the last sample depends on the velocity there.

        For hosts that solve for the velocity. Computed when asked for, from samples with slightly
        other velocities at the end; element deflections and switches within the sample follow.
        """
        change = CHANGE * max(*map(abs, self._samples()[:2]), self._speed)
        return (self._again(change) - self._again(-change)) / (2.0 * change)

    @functools.cached_property
    def _speed(self) -> float:
        """m/s: a speed that is not large."""
        scales = scales_of(self._start.system.contacts[0])
        return scales.speed or scales.v or 1.0

    def _samples(self) -> _Sample:
        if self._last is None:
            raise ParameterError("there is no last sample", advice="call advance first")
        return self._last

    def _again(self, change: float, *, mean: bool = False) -> float:
        """Return the force, or its mean, had the last velocity been different."""
        v0, v1, t, inputs = self._samples()
        stepper, more = self._stepper, self._more
        now = stepper.copy()
        stepper.back()
        begin = float(stepper.buffers.now.clock[T])
        self._counts[MEAN] = int(mean and t > begin)
        try:
            self._run(v0, v1 + change, t, inputs)
            force, impulse = map(float, self._force)
        finally:
            stepper.take(now)
            self._more = more
        return impulse / (t - begin) if mean and t > begin else force

    # ------------------------------------------------------------------ going back
    def snapshot(self) -> Snapshot:
        """Return the present state, to return to it with `restore`.

        Returns
        -------
        Snapshot
            For this friction, or another one of the same model and engine.
        """
        return Snapshot(self._t, self._identity, self._stepper.copy())

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot.

        Parameters
        ----------
        snapshot : Snapshot
            From `snapshot`, of this friction or another one of the same model and engine.

        Raises
        ------
        ParameterError
            If it is of another model; the state stays as it was.
        """
        checked_kind("snapshot", snapshot, Snapshot, "what snapshot() returned")
        if snapshot._of != self._identity:
            reason = "it is of a friction with another engine"
            if snapshot._of[0] != self._identity[0]:
                reason = "it is of another model, or of one with other numbers"
            raise ParameterError(
                reason, place="snapshot", advice="take it from a friction made in the same way"
            )
        self._stepper.take(snapshot._content)
        self._t, self._last, self._more = snapshot.t, None, []

    @functools.cached_property
    def _identity(self) -> tuple[str, str]:
        start = self._start
        program, options = start.program, start.options
        what = program.source, program.p[:2], options.rtol, options.atol
        stamp = hashlib.sha256(repr(what).encode()).hexdigest()
        return stamp, type(self._stepper).__name__

    def to_array(self) -> FloatArray:
        """Return the present state as finite numbers, for hosts that keep all states in a vector.

        Returns
        -------
        ndarray, shape (m,)
            Its length depends on the model only. It is no state that can be interpolated.
        """
        places = self._places().values()
        flat = np.concatenate([np.asarray(place, dtype=np.float64).ravel() for place in places])
        return np.nan_to_num(flat, nan=math.nan, posinf=MOST, neginf=-MOST)

    def from_array(self, array: ArrayLike) -> None:
        """Return to what `to_array` returned, also of another friction of the same model.

        Parameters
        ----------
        array : array_like, shape (m,)
            All of its numbers as they were.

        Raises
        ------
        ParameterError
            If it cannot be such an array; the state stays as it was.
        """
        places = self._places()
        sizes = [np.size(place) for place in places.values()]
        given = checked_array("array", array, None, "finite")
        if given.size != sum(sizes):
            raise ParameterError(
                f"it has {given.size} numbers", place="array", advice=f"it must have {sum(sizes)}"
            )
        flat = np.where(np.abs(given) < MOST, given, np.copysign(np.inf, given))
        parts = np.split(flat, np.cumsum(sizes)[:-1])
        state: dict[str, Any] = dict(state_of(self._stepper))
        try:
            for (name, place), part in zip(places.items(), parts, strict=True):
                kind = np.asarray(place).dtype
                with np.errstate(invalid="ignore"):
                    state[name] = part.astype(kind)
                if not np.array_equal(state[name].astype(np.float64), part):
                    raise ValueError(f"{name}: not of type {kind}")
            check_state(self._start, self._stepper.buffers, _as_arrays(state))
        except ValueError as error:
            raise ParameterError(
                f"it is no state of this friction ({error})",
                place="array",
                advice="give what to_array returned, unchanged",
            ) from None
        for name, place in places.items():
            place[:] = state[name] if isinstance(place, np.ndarray) else state[name].tolist()
        t = float(self._stepper.buffers.now.clock[T])
        self._t, self._last, self._more = t, None, []
        self._counts[SWITCHES] = 0

    def _places(self) -> dict[str, Any]:
        """Return the arrays that make up the state between two samples."""
        return {n: place for n, place in state_of(self._stepper).items() if n not in TEMPORARY}


_FAILURES: dict[int, tuple[type[SimulationError], str]] = {
    loop.MACHINE_LIVELOCK: (LivelockError, "it keeps switching without progress"),
    loop.RELATION_LIVELOCK: (LivelockError, "a comparison keeps changing without progress"),
    advance.TOO_SMALL: (StepSizeError, "the step size fell below the resolution of the clock"),
    loop.TOO_MANY_STEPS: (StepLimitError, f"one sample needs more than {MOST_STEPS:,} steps"),
    advance.NOT_FINITE: (NotFiniteError, "the flow is NaN or infinite"),
}


def _as_arrays(state: Mapping[str, Any]) -> dict[str, Any]:
    return {name: np.asarray(place) for name, place in state.items()}


def _view(place: Any) -> Any:
    return memoryview(place) if isinstance(place, np.ndarray) else place


def _line(name: str, given: Any) -> tuple[float, float]:
    """Return an input at the start and at the end of a sample."""
    pair = given if isinstance(given, tuple | list) and len(given) == 2 else (given, given)
    start, end = (checked_scalar(name, each, "finite") for each in pair)
    return start, end


def _checked_sample(v0: Any, v1: Any, time: Any, name: str = "dt") -> tuple[float, float, float]:
    """Return the velocities and the time of a sample as floats, or refuse them."""
    rule = ">= 0" if name == "dt" else "finite"
    made = (
        checked_scalar("v0", v0, "finite"),
        checked_scalar("v1", v1, "finite"),
        checked_scalar(name, time, rule),
    )
    if abs(made[2]) > LATEST:
        raise ParameterError(
            "it is too large", place=name, value=made[2], advice=f"at most {LATEST:g} s"
        )
    return made


def stepper_kind(engine: object) -> type[Machine] | type[Plain]:
    """Return what carries out the steps of an engine.

    Parameters
    ----------
    engine : {"compiled", "ifelse"} or None
        None is the first one if llvmlite is installed, else the second.

    Returns
    -------
    type
        One of the classes of `gms_fsm.run._stepper`.

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
