"""Friction for somebody else's loop: it is given velocities, and returns forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.run._joint import (
    Asked,
    Joint,
    Line,
    Switch,
    check_inputs,
    content_of,
    in_use,
    later,
    line_of,
    made_again,
    numbers_of,
    stepper_kind,
    too_late,
    too_short,
)
from gms_fsm.run._steppable import start_of
from gms_fsm.run.start import LATEST
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

__all__ = ["FrictionState", "Snapshot", "Switch"]


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A state to return to, of a `FrictionState` or a `FrictionBank`.

    Parameters
    ----------
    t : float
        s.
    """

    t: float
    of: tuple[str, str] = field(repr=False)  # which friction, and its engine
    content: Any = field(repr=False)


class FrictionState:
    """The friction of one contact, advanced by somebody else's loop.

    In each sample the velocity is a straight line, along which every switch is located. The result
    is that of `simulate` with ``Prescribed((t, v))``, to the last bit. One thread at a time may
    call it; a call from another one meanwhile is refused and changes nothing.

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
    0.052
    >>> round(friction.peek(0.02, 0.0, 0.5), 6), friction.t
    (0.028, 0.5)
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
        kind, asked = stepper_kind(engine), Asked(t, initial, rtol)
        start = start_of(model_or_contact, *asked)
        self._joint = Joint(model_or_contact, asked, start, kind(start))

    def __repr__(self) -> str:
        return f"<FrictionState of {self.model!r} at t = {self.t!r} s>"

    @property
    def model(self) -> Model | Contact:
        """The model or contact, as given."""
        return self._joint.given

    @property
    def inputs(self) -> tuple[str, ...]:
        """What a contact needs to be given besides its velocity."""
        return self._joint.inputs

    # ------------------------------------------------------------------ steps
    def advance(self, v0: float, v1: float, dt: float, **inputs: Line) -> float:
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
            If a number is not finite, an input is missing, the clock does not resolve dt, or
            another thread's call is under way.
        SimulationError
            If it cannot continue. In both cases the friction is as it was before.
        """
        joint = self._joint
        v0, v1, dt = _checked(v0, v1, dt)
        if inputs or joint.inputs:
            inputs = self._lines(inputs)
        if not joint.alone.acquire(False):  # as `with joint.alone`, in a third of the time
            raise in_use()
        try:
            end = _sum(joint.t, dt)
            if end == joint.t and dt > 0.0:
                raise too_short(dt, end)
            return joint.commit(v0, v1, end, inputs)
        finally:
            joint.alone.leave()

    def advance_to(self, v0: float, v1: float, t: float, **inputs: Line) -> float:
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

        Raises
        ------
        ParameterError, SimulationError
            As in `advance`, or if t is before the present time.
        """
        v0, v1, _ = _checked(v0, v1, 0.0)
        with self._joint.alone:
            t = later(t, self._joint.t)
            return self._joint.commit(v0, v1, _sum(t, 0.0), self._lines(inputs))

    def peek(self, v0: float, v1: float, dt: float, **inputs: Line) -> float:
        """Return what `advance` would return, and stay: for the stages of a Runge-Kutta step.

        Parameters
        ----------
        v0, v1, dt, **inputs
            As in `advance`. With dt = 0 this is the force at v1, now.

        Returns
        -------
        float
            N: the force at the end.

        Raises
        ------
        ParameterError, SimulationError
            As in `advance`.
        """
        joint = self._joint
        v0, v1, dt = _checked(v0, v1, dt)
        if inputs or joint.inputs:
            inputs = self._lines(inputs)
        if not joint.alone.acquire(False):
            raise in_use()
        try:
            return joint.peek(v0, v1, _sum(joint.t, dt), inputs)
        finally:
            joint.alone.leave()

    def _lines(self, inputs: Mapping[str, Any]) -> dict[str, Line]:
        check_inputs(inputs, self._joint.inputs)
        found = {}
        for name, given in inputs.items():
            start, end = (checked_scalar(name, u, "finite") for u in line_of(name, given))
            found[name] = start, end
        return found

    # ------------------------------------------------------------------ what it found
    @property
    def t(self) -> float:
        """The present time, s."""
        return self._joint.t

    @property
    def states(self) -> tuple[str, ...]:
        """The state of each element."""
        return self._joint.states

    @property
    def variables(self) -> dict[str, FloatArray]:
        """The chart's variables, one value per element."""
        return self._joint.variables

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The edges taken in the last sample."""
        return self._joint.switches

    @property
    def mean_force(self) -> float:
        """The mean of the force over the last sample, N, by Simpson's rule between switches.

        It is computed when asked for. A host that applies this force throughout the sample
        exchanges the right impulse.
        """
        with self._joint.alone:
            return self._joint.mean_force

    @property
    def dF_dv(self) -> float:
        """How the force at the end of the last sample depends on the velocity there, Ns/m.

        For hosts that solve for the velocity. It is computed when asked for, from samples with
        slightly other velocities at the end; deflections and switches within the sample follow.
        """
        with self._joint.alone:
            return self._joint.dF_dv

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make a copy: memory of machine code is not copied."""
        joint = self._joint
        arguments = {**joint.asked._asdict(), "engine": joint.engine}
        return made_again, (type(self), self.model, arguments, self.to_array())

    # ------------------------------------------------------------------ going back
    def snapshot(self) -> Snapshot:
        """Return the present state, to return to it with `restore`.

        Returns
        -------
        Snapshot
            For this friction, or another one of the same model and engine.
        """
        joint = self._joint
        with joint.alone:
            return Snapshot(joint.t, joint.identity, joint.stepper.copy())

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
        joint = self._joint
        with joint.alone:
            joint.stepper.take(content_of(snapshot, Snapshot, joint.identity))
            joint.moved_to(snapshot.t)

    def to_array(self) -> FloatArray:
        """Return the present state as finite numbers, for hosts that keep all states in a vector.

        Returns
        -------
        ndarray, shape (m,)
            Its length depends on the model only. It cannot be interpolated.
        """
        with self._joint.alone:
            return self._joint.to_array()

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
        joint = self._joint
        with joint.alone:
            joint.from_array(numbers_of(array, joint.length))


def _checked(v0: Any, v1: Any, dt: Any) -> tuple[float, float, float]:
    """Return the arguments of a sample as floats, or refuse them."""
    usual = isinstance(v0, float) and isinstance(v1, float) and isinstance(dt, float)
    if usual and isfinite(v0) and isfinite(v1) and 0.0 <= dt <= LATEST:
        return v0, v1, dt
    v0, v1 = checked_scalar("v0", v0, "finite"), checked_scalar("v1", v1, "finite")
    dt = checked_scalar("dt", dt, ">= 0")
    if dt > LATEST:
        raise too_late("dt", dt)
    return v0, v1, dt


def _sum(t: float, dt: float) -> float:
    """Return the end of a sample."""
    end = t + dt
    if end > LATEST:
        raise too_late("t", end)
    return end
