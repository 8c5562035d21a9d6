"""The frictions of many joints, advanced together by a co-simulation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import isfinite, nan
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import FloatArray, checked_array, checked_scalar
from gms_fsm.coupling.joint import Asked, ElementSwitch, Line
from gms_fsm.coupling.joints import Joints, input_lines, made_again
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import listed, refusing
from gms_fsm.run.stepped.going_back import Snapshot
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

FLOAT = np.dtype(np.float64)


@refusing(quick=("advance", "advance_to", "peek"))
class FrictionBank:
    """The frictions of m joints, as `FrictionState` does it for one.

    Joints whose models differ in numbers only are advanced by one call of machine code. One thread
    at a time may call it, as with `FrictionState`.

    Parameters
    ----------
    models : sequence of Model or Contact
        One per joint.
    t : float
        s: the beginning.
    initial : mapping or sequence of mapping, optional
        As for `FrictionState`, for all joints or one per joint.
    rtol : float
        Relative tolerance.
    engine : {"compiled", "ifelse"}, optional
        As for `FrictionState`.

    Raises
    ------
    ParameterError
        If a joint cannot be stepped, or an argument violates its rule.

    Examples
    --------
    >>> from gms_fsm import GMS, FrictionBank, GMSParameters
    >>> bank = FrictionBank([GMS(GMSParameters.paper("stick-slip"), law="signed")] * 3)
    >>> bank.advance([0.0, 0.0, 0.0], [0.02, 0.0, -0.02], 0.5).round(6)
    array([ 0.052,  0.   , -0.052])
    """

    def __init__(
        self,
        models: Iterable[Model | Contact],
        *,
        t: float = 0.0,
        initial: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
        rtol: float = 1e-6,
        engine: str | None = None,
    ) -> None:
        given = listed("models", models, "a sequence of models or contacts")
        if not given:
            raise ParameterError("it has no entries", place="models", advice="give one per joint")
        firsts: list[Any] = [initial] * len(given)
        if initial is not None and not isinstance(initial, Mapping):
            firsts = listed("initial", initial, "a mapping, or one per joint")
            if len(firsts) != len(given):
                raise ParameterError(
                    f"it has {len(firsts)} entries", place="initial", advice=f"give {len(given)}"
                )
        asked = [Asked(t, first, rtol) for first in firsts]
        self._joints = Joints(given, asked, engine, several=True)
        self._shape = (len(given),)

    def __len__(self) -> int:
        return len(self._joints.each)

    def __repr__(self) -> str:
        return f"<FrictionBank of {len(self)} joints at t = {self.t!r} s>"

    @property
    def inputs(self) -> tuple[str, ...]:
        """What contacts need to be given besides their velocities."""
        return self._joints.inputs

    # ------------------------------------------------------------------ steps
    def advance(
        self, v0: ArrayLike, v1: ArrayLike, dt: float, **inputs: tuple[ArrayLike, ArrayLike]
    ) -> FloatArray:
        """Advance all joints by a sample; see `FrictionState.advance`.

        Parameters
        ----------
        v0, v1 : array_like, shape (m,)
            m/s: at the beginning and at the end.
        dt : float
            s, >= 0.
        **inputs : (array_like, array_like)
            Further inputs of contacts at the beginning and at the end, each a number or of shape
            (m,). Joints without that input do not read it.

        Returns
        -------
        ndarray, shape (m,)
            N: the forces at the end.

        Raises
        ------
        ParameterError
            If a number is not finite, an array has another length, an input is missing, or the
            clock does not resolve dt.
        SimulationError
            If a joint cannot continue. In both cases all joints are as they were before.
        """
        v0, v1 = self._checked(v0, v1)
        forces: FloatArray = self._joints.advance(
            v0, v1, checked_scalar("dt", dt, ">= 0"), self._lines(inputs)
        )
        return forces

    def advance_to(
        self, v0: ArrayLike, v1: ArrayLike, t: float, **inputs: tuple[ArrayLike, ArrayLike]
    ) -> FloatArray:
        """Advance all joints to a time; see `advance`.

        Parameters
        ----------
        v0, v1, **inputs
            As in `advance`.
        t : float
            s: not before the present time.

        Returns
        -------
        ndarray, shape (m,)
            N: the forces at the end.

        Raises
        ------
        ParameterError, SimulationError
            As in `advance`, or if t is before the present time.
        """
        v0, v1 = self._checked(v0, v1)
        forces: FloatArray = self._joints.advance(v0, v1, nan, self._lines(inputs), t)
        return forces

    def peek(
        self, v0: ArrayLike, v1: ArrayLike, dt: float, **inputs: tuple[ArrayLike, ArrayLike]
    ) -> FloatArray:
        """Return what `advance` would return, and stay.

        Parameters
        ----------
        v0, v1, dt, **inputs
            As in `advance`. With dt = 0 these are the forces at v1, now.

        Returns
        -------
        ndarray, shape (m,)
            N: the forces at the end.

        Raises
        ------
        ParameterError, SimulationError
            As in `advance`.
        """
        v0, v1 = self._checked(v0, v1)
        forces: FloatArray = self._joints.peek(
            v0, v1, checked_scalar("dt", dt, ">= 0"), self._lines(inputs)
        )
        return forces

    def send(self, event: str) -> None:
        """Send an event: edges that wait for it are asked at the beginning of the next sample.

        Parameters
        ----------
        event : str
            One that the chart of a joint waits for.

        Raises
        ------
        ParameterError
            If there is no such event.
        """
        self._joints.send(event)

    def _checked(self, v0: Any, v1: Any) -> tuple[FloatArray, FloatArray]:
        """Return copies with one finite number per joint."""
        if type(v0) is type(v1) is np.ndarray:
            first, last = v0.copy(), v1.copy()
            usual = first.dtype is last.dtype is FLOAT and first.shape == last.shape == self._shape
            # A sum in which all numbers are is not finite if one of them is not.
            if usual and isfinite(first.dot(last)):
                return first, last
        return self._row("v0", v0), self._row("v1", v1)

    def _lines(self, inputs: Mapping[str, Any]) -> dict[str, Line]:
        def full(name: str, given: Any) -> FloatArray:
            return self._row(name, np.full(len(self), given) if np.ndim(given) == 0 else given)

        return input_lines(inputs, self.inputs, full) if inputs or self.inputs else {}

    def _row(self, name: str, given: ArrayLike) -> FloatArray:
        """Return a copy with one finite number per joint."""
        made = checked_array(name, given, None, "finite")
        if made.size != len(self):
            raise ParameterError(
                f"it has {made.size} entries", place=name, advice=f"give {len(self)}, one per joint"
            )
        return made

    # ------------------------------------------------------------------ what it found
    @property
    def t(self) -> float:
        """The present time, s."""
        return self._joints.t

    @property
    def states(self) -> tuple[tuple[str, ...], ...]:
        """Of each joint the states of its elements."""
        return tuple(joint.states for joint in self._joints.each)

    @property
    def variables(self) -> tuple[dict[str, FloatArray], ...]:
        """Of each joint the chart's variables."""
        return tuple(joint.variables for joint in self._joints.each)

    @property
    def switches(self) -> tuple[tuple[ElementSwitch, ...], ...]:
        """Of each joint the edges taken in the last sample."""
        return tuple(self._joints.switches)

    @property
    def mean_force(self) -> FloatArray:
        """Of each joint the mean of its force over the last sample, N, shape (m,)."""
        forces: FloatArray = self._joints.mean_force
        return forces

    @property
    def dF_dv(self) -> FloatArray:
        """How each force depends on its velocity at the last end, Ns/m, shape (m,)."""
        slopes: FloatArray = self._joints.dF_dv
        return slopes

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make a copy: memory of machine code is not copied."""
        joints = self._joints.each
        arguments = {
            "t": joints[0].asked.t,
            "initial": [joint.asked.initial for joint in joints],
            "rtol": joints[0].asked.rtol,
            "engine": self._joints.engine,
        }
        given = [joint.given for joint in joints]
        return made_again, (type(self), given, arguments, self.to_array())

    # ------------------------------------------------------------------ going back
    def snapshot(self) -> Snapshot:
        """Return the present state, to return to it with `restore`.

        Returns
        -------
        Snapshot
            For this bank, or another one of the same models and engine.
        """
        return self._joints.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot.

        Parameters
        ----------
        snapshot : Snapshot
            From `snapshot`, of this bank or another one of the same models and engine.

        Raises
        ------
        ParameterError
            If it is of other models; the state stays as it was.
        """
        self._joints.restore(snapshot)

    def to_array(self) -> FloatArray:
        """Return the present state as finite numbers; see `FrictionState.to_array`.

        Returns
        -------
        ndarray, shape (k,)
            Those of the joints, one after the other.
        """
        return self._joints.to_array()

    def from_array(self, array: ArrayLike) -> None:
        """Return to what `to_array` returned, also of another bank of the same models.

        Parameters
        ----------
        array : array_like, shape (k,)
            All of its numbers as they were.

        Raises
        ------
        ParameterError
            If it cannot be such an array; the state stays as it was.
        """
        self._joints.from_array(array)
