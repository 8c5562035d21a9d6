"""Friction in python-control: as a discrete-time system, and a run's linear system."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.coupling.stepping import FrictionState
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind
from gms_fsm.foundation.extras import require
from gms_fsm.linear.linearize import LinearSystem
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

__all__ = ["friction_system", "state_space"]


def state_space(linear: LinearSystem, *, name: str = "plant") -> Any:
    """Return what `gms_fsm.linearize` found as a system of python-control.

    Parameters
    ----------
    linear : LinearSystem
        From `gms_fsm.linearize`.
    name : str
        Of the system.

    Returns
    -------
    control.StateSpace
        With the names of states, inputs and outputs; a point in a name becomes an underscore,
        because python-control separates systems and signals by points.

    Raises
    ------
    MissingExtraError
        If python-control is not installed.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Slider, linearize, simulate
    >>> model = GMS(GMSParameters.paper("non-drifting"), law="signed")
    >>> linear = linearize(simulate(model, Slider(1.0, "0.1*t"), 1.0), 1.0)
    >>> plant = state_space(linear)
    >>> plant.input_labels, [f"{w:.2f}" for w in plant.damp()[0]]
    (['F_a'], ['10.54', '10.54'])
    """
    control = require("control", "control")
    checked_kind("linear", linear, LinearSystem, "what linearize returns")
    labels = {
        each: [label.replace(".", "_") for label in getattr(linear, each)]
        for each in ("states", "inputs", "outputs")
    }
    return control.ss(*linear, name=name, **labels)


def friction_system(
    model_or_contact: Model | Contact,
    dt: float,
    *,
    name: str = "friction",
    initial: Mapping[str, Any] | None = None,
    rtol: float = 1e-6,
    engine: str | None = None,
) -> Any:
    """Return a discrete-time system with the velocity as input and the friction force as output.

    From sample to sample the velocity is a straight line, along which every switch is located. The
    output is the force at the present velocity, without a sample of delay: if the velocity is a
    state of the rest, no algebraic loop arises. python-control then holds the force for one sample,
    so the error of a closed loop is of first order in dt.

    Parameters
    ----------
    model_or_contact : Model or Contact
        As for `gms_fsm.FrictionState`. Further inputs of a contact become further inputs.
    dt : float
        s, > 0: the sample time.
    name : str
        Of the system; its signals are ``NAME.v`` and ``NAME.F`` in connections.
    initial, rtol, engine
        As for `gms_fsm.FrictionState`.

    Returns
    -------
    control.NonlinearIOSystem
        All memory of the friction is in its state x, as python-control wants it. x = 0, the default
        of `control.input_output_response`, is the friction before its first sample, at any time;
        any other x must be one that the system returned. It is no state to linearize about.

    Raises
    ------
    MissingExtraError
        If python-control is not installed.
    ParameterError
        If the friction cannot be stepped, or an argument violates its rule.

    Examples
    --------
    >>> import control, numpy as np
    >>> from gms_fsm import GMS, GMSParameters
    >>> friction = friction_system(GMS(GMSParameters.paper("stick-slip"), law="signed"), 0.01)
    >>> t = np.arange(0, 5, 0.01)
    >>> response = control.input_output_response(friction, t, 0.02 * np.sin(t))
    >>> print(f"{response.outputs[-1]:.4f} N")
    0.0041 N
    """
    control = require("control", "control")
    if isinstance(dt, bool):  # python-control's mark for an unknown sample time
        raise ParameterError("the friction needs a sample time", place="dt", value=dt)
    dt = checked_scalar("dt", dt, "> 0")
    begin = functools.partial(
        FrictionState, model_or_contact, initial=initial, rtol=rtol, engine=engine
    )
    friction, memory = begin(), _Memory(begin, dt)
    return control.nlsys(
        memory.update,
        memory.output,
        inputs=["v", *friction.inputs],
        outputs=["F"],
        states=memory.size,
        dt=dt,
        name=name,
    )


class _Memory:
    """The functions of the system: whether it has begun, its last inputs and the friction are x.

    The friction itself is only a place to compute in. What it holds is remembered, so that an x
    which comes back unchanged need not be read again.
    """

    def __init__(self, begin: Callable[..., FrictionState], dt: float) -> None:
        self._begin, self._dt = begin, dt
        self._friction = friction = begin()
        self._more = friction.inputs
        self._own = 2 + len(self._more)  # number of x that belongs to the friction
        self.size = self._own + friction.to_array().size
        self._held: FloatArray = np.zeros(self.size)

    def update(self, t: float, state: FloatArray, u: FloatArray, _params: Any) -> FloatArray:
        """Return the next x."""
        before, dt = self._go_to(t, state, u)
        self._friction.advance(before[0], u[0], dt, **self._lines(before, u))
        self._held = np.concatenate([[1.0], u, self._friction.to_array()])
        return self._held.copy()

    def output(self, t: float, state: FloatArray, u: FloatArray, _params: Any) -> float:
        """Return the force."""
        before, dt = self._go_to(t, state, u)
        return self._friction.peek(before[0], u[0], dt, **self._lines(before, u))

    def _go_to(self, t: float, state: FloatArray, u: FloatArray) -> tuple[FloatArray, float]:
        """Bring the friction to x, and return the inputs there and the time since."""
        same = np.array_equal(state, self._held)
        if not state.any() and not (same and self._friction.t == t):
            self._friction = self._begin(t=t)
        elif not same:
            self._friction.from_array(state[self._own :])
        self._held = self._held if same else state.copy()
        return (state[1 : self._own], self._dt) if state[0] else (u, 0.0)

    def _lines(self, before: FloatArray, now: FloatArray) -> dict[str, tuple[float, float]]:
        ends = zip(before[1:].tolist(), now[1:].tolist(), strict=True)
        return dict(zip(self._more, ends, strict=True))
