"""Friction for a co-simulation: it is given velocities, and returns forces."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, nan
from typing import Any

from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.coupling.joint import Asked, ElementSwitch, Line
from gms_fsm.coupling.joints import Joints, input_lines, made_again
from gms_fsm.foundation.arguments import refusing
from gms_fsm.run.stepped.going_back import Snapshot
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

__all__ = ["ElementSwitch", "FrictionState", "Snapshot"]


@refusing(quick=("advance", "advance_to", "peek"))
class FrictionState:
    """The friction of one contact, advanced by a co-simulation.

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
        asked = Asked(t, initial, rtol)
        self._joints = Joints([model_or_contact], [asked], engine, several=False)
        (self._joint,) = self._joints.each
        self._alone = self._joints.alone
        self._given, self._advance, self._peek, *_ = self._joints.short

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
        usual = isinstance(v0, float) and isinstance(v1, float) and isinstance(dt, float)
        # From here to the end of the call of machine code no other thread can come between.
        if usual and not inputs and not self._alone.inside:
            given = self._given
            given[0], given[1], given[2], given[3] = v0, v1, dt, nan
            force = self._advance()
            if force < inf:
                return force
        v0, v1, dt = _checked(v0, v1, dt)
        found: float = self._joints.advance(v0, v1, dt, self._lines(inputs))
        return found

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
        usual = isinstance(v0, float) and isinstance(v1, float) and isinstance(t, float)
        if usual and not inputs and not self._alone.inside:
            given = self._given
            given[0], given[1], given[2], given[3] = v0, v1, nan, t
            force = self._advance()
            if force < inf:
                return force
        v0, v1, _ = _checked(v0, v1, 0.0)
        found: float = self._joints.advance(v0, v1, nan, self._lines(inputs), t)
        return found

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
        usual = isinstance(v0, float) and isinstance(v1, float) and isinstance(dt, float)
        if usual and not inputs and not self._alone.inside:
            given = self._given
            given[0], given[1], given[2] = v0, v1, dt
            force = self._peek()
            if force < inf:
                return force
        v0, v1, dt = _checked(v0, v1, dt)
        found: float = self._joints.peek(v0, v1, dt, self._lines(inputs))
        return found

    def send(self, event: str) -> None:
        """Send an event: edges that wait for it are asked at the beginning of the next sample.

        Parameters
        ----------
        event : str
            One that the chart waits for.

        Raises
        ------
        ParameterError
            If there is no such event.
        """
        self._joints.send(event)

    def _lines(self, inputs: Mapping[str, Any]) -> dict[str, Line]:
        return input_lines(inputs, self._joint.inputs, _finite)

    # ------------------------------------------------------------------ what it found
    @property
    def t(self) -> float:
        """The present time, s."""
        return self._joints.t

    @property
    def states(self) -> tuple[str, ...]:
        """The state of each element."""
        return self._joint.states

    @property
    def variables(self) -> dict[str, FloatArray]:
        """The chart's variables, one value per element."""
        return self._joint.variables

    @property
    def switches(self) -> tuple[ElementSwitch, ...]:
        """The edges taken in the last sample."""
        return self._joints.switches[0]

    @property
    def mean_force(self) -> float:
        """The mean of the force over the last sample, N, by Simpson's rule between switches.

        It is computed when asked for. A host that applies this force throughout the sample
        exchanges the right impulse.
        """
        force: float = self._joints.mean_force
        return force

    @property
    def dF_dv(self) -> float:
        """How the force at the end of the last sample depends on the velocity there, Ns/m.

        For hosts that solve for the velocity. It is computed when asked for, from samples with
        slightly other velocities at the end; deflections and switches within the sample follow.
        """
        slope: float = self._joints.dF_dv
        return slope

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make a copy: memory of machine code is not copied."""
        arguments = {**self._joint.asked._asdict(), "engine": self._joints.engine}
        return made_again, (type(self), self.model, arguments, self.to_array())

    # ------------------------------------------------------------------ going back
    def snapshot(self) -> Snapshot:
        """Return the present state, to return to it with `restore`.

        Returns
        -------
        Snapshot
            For this friction, or another one of the same model and engine.
        """
        return self._joints.snapshot()

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
        self._joints.restore(snapshot)

    def to_array(self) -> FloatArray:
        """Return the present state as finite numbers, for hosts that keep all states in a vector.

        Returns
        -------
        ndarray, shape (m,)
            Its length depends on the model only. It cannot be interpolated.
        """
        return self._joints.to_array()

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
        self._joints.from_array(array)


def _checked(v0: Any, v1: Any, dt: Any) -> tuple[float, float, float]:
    """Return the arguments of a sample as floats, or refuse them."""
    return _finite("v0", v0), _finite("v1", v1), checked_scalar("dt", dt, ">= 0")


def _finite(name: str, value: Any) -> float:
    return checked_scalar(name, value, "finite")
