"""Friction, or a whole system, as a block of PathSim."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.coupling.stepping import FrictionState
from gms_fsm.coupling.system_state import SystemState
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import listed
from gms_fsm.foundation.extras import require
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact, System

__all__ = ["friction_block", "system_block"]


def friction_block(
    model_or_contact: Model | Contact,
    period: float,
    *,
    initial: Mapping[str, Any] | None = None,
    rtol: float = 1e-6,
    engine: str | None = None,
) -> Any:
    """Return a block with the velocity as input and the friction force as output.

    The velocity is sampled at multiples of the period, and taken as a straight line in between,
    along which every switch is located. Between two samples the output is the force at the present
    velocity, not a held one: the stages of PathSim's solver see a continuous force. A velocity that
    jumps (an impact, an event of yours) is a straight line over that sample.

    Parameters
    ----------
    model_or_contact : Model or Contact
        As for `gms_fsm.FrictionState`. Further inputs of a contact become further ports.
    period : float
        s, > 0. A solver with a fixed step should use it, or a whole fraction of it, as its step.
    initial, rtol, engine
        As for `gms_fsm.FrictionState`.

    Returns
    -------
    pathsim.blocks.Block
        With the input ports ``v`` (0) and those of a contact, and the output port ``F`` (0).
        ``block.switches`` lists every switch since the start, ``block.friction`` is the
        `gms_fsm.FrictionState` at the last sample. It restarts when the simulation is reset, and
        is part of PathSim's checkpoints (the list of switches is not).

    Raises
    ------
    MissingExtraError
        If PathSim is not installed.
    ParameterError
        If the friction cannot be stepped, or an argument violates its rule.

    Examples
    --------
    A mass of 1 kg at 0.1 m/s is braked:

    >>> from pathsim import Connection, Simulation
    >>> from pathsim.blocks import Amplifier, Integrator
    >>> from gms_fsm import GMS, GMSParameters
    >>> pad = friction_block(GMS(GMSParameters.paper("stick-slip"), law="signed"), 1e-3)
    >>> v, inverse_mass = Integrator(0.1), Amplifier(-1.0)
    >>> wires = [Connection(v, pad), Connection(pad, inverse_mass), Connection(inverse_mass, v)]
    >>> _ = Simulation([v, pad, inverse_mass], wires, dt=1e-3, log=False).run(0.5)
    >>> print(f"{pad.friction.t:.1f} s, {pad.outputs['F']:.4f} N")
    0.5 s, 0.1198 N
    """
    period = checked_scalar("period", period, "> 0")
    begin = functools.partial(
        FrictionState, model_or_contact, initial=initial, rtol=rtol, engine=engine
    )
    return _block_class()(_OneFriction(begin), period)


def system_block(
    system: System,
    period: float,
    outputs: Iterable[str],
    *,
    initial: Mapping[str, Any] | None = None,
    rtol: float = 1e-6,
    engine: str | None = None,
) -> Any:
    """Return a block with the inputs of a system as input ports, and some of its values as outputs.

    The inputs are sampled at multiples of the period, and taken as straight lines in between; see
    `friction_block`.

    Parameters
    ----------
    system : System
        With ``inputs=(...)``, as for `gms_fsm.SystemState`.
    period : float
        s, > 0.
    outputs : iterable of str
        Names that `gms_fsm.SystemState.value` knows.
    initial, rtol, engine
        As for `gms_fsm.SystemState`.

    Returns
    -------
    pathsim.blocks.Block
        With ports called as the inputs and the outputs. ``block.switches`` lists every switch since
        the start, ``block.system`` is the `gms_fsm.SystemState` at the last sample. It restarts
        when the simulation is reset, and is not part of PathSim's checkpoints.

    Raises
    ------
    MissingExtraError
        If PathSim is not installed.
    ParameterError
        If the system cannot be stepped, or an argument violates its rule.

    Examples
    --------
    A mass on a dry contact is pulled by a controller:

    >>> from pathsim import Connection, Simulation
    >>> from pathsim.blocks import Amplifier, Constant, Adder
    >>> from gms_fsm import Body, Contact, System
    >>> from gms_fsm.charts import CHARTS
    >>> pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 4.0})
    >>> sled = System("sled", bodies=(Body("sled", inertia=1.0, force="u"),), contacts=(pad,),
    ...               inputs=("u",))
    >>> plant, goal, error, gain = (
    ...     system_block(sled, 1e-2, ["x"]), Constant(1.0), Adder("+-"), Amplifier(10.0))
    >>> wires = [Connection(goal, error[0]), Connection(plant, error[1]), Connection(error, gain),
    ...          Connection(gain, plant)]
    >>> _ = Simulation([plant, goal, error, gain], wires, dt=1e-2, log=False).run(5.0)
    >>> print(f"{plant.system.value('x'):.2f} m, {plant.system.states['pad']}")
    0.97 m, ('stuck',)
    """
    period = checked_scalar("period", period, "> 0")
    names = tuple(listed("outputs", outputs, "names of values"))
    begin = functools.partial(SystemState, system, initial=initial, rtol=rtol, engine=engine)
    return _block_class()(_WholeSystem(begin, names), period)


class _OneFriction:
    """What the block asks of a friction; the first of its inputs is the velocity."""

    def __init__(self, begin: Any) -> None:
        self._begin = begin
        self.restart()
        self.inputs, self.outputs = ("v", *self.it.inputs), ("F",)

    def restart(self, **t: float) -> None:
        self.it: FrictionState = self._begin(**t)

    def peek(self, before: list[float], now: list[float], dt: float) -> tuple[float, ...]:
        return (self.it.peek(before[0], now[0], dt, **self._more(before, now)),)

    def advance_to(self, before: list[float], now: list[float], t: float) -> None:
        self.it.advance_to(before[0], now[0], t, **self._more(before, now))

    def _more(self, before: list[float], now: list[float]) -> dict[str, tuple[float, float]]:
        return dict(zip(self.inputs[1:], zip(before[1:], now[1:], strict=True), strict=True))


class _WholeSystem:
    """What the block asks of a system."""

    def __init__(self, begin: Any, outputs: tuple[str, ...]) -> None:
        self._begin = begin
        self.restart()
        self.inputs, self.outputs = self.it.inputs, outputs
        for name in outputs:
            self.it.value(name)  # or refuse it

    def restart(self, **t: float) -> None:
        self.it: SystemState = self._begin(**t)

    def peek(self, before: list[float], now: list[float], dt: float) -> tuple[float, ...]:
        return self.it.peek(dt, *self.outputs, **self._lines(before, now))

    def advance_to(self, before: list[float], now: list[float], t: float) -> None:
        self.it.advance_to(t, **self._lines(before, now))

    def _lines(self, before: list[float], now: list[float]) -> dict[str, Any]:
        return dict(zip(self.inputs, zip(before, now, strict=True), strict=True))


@functools.cache
def _block_class() -> Any:
    """Return the class of the blocks; PathSim is imported only here."""
    base, schedule = (
        require("pathsim.blocks", "pathsim").Block,
        require("pathsim.events", "pathsim"),
    )

    class Stepped(base):  # type: ignore[misc, valid-type]  # PathSim has no types
        """What is committed at each sample, and asked between two."""

        linearizable = False

        def __init__(self, inner: _OneFriction | _WholeSystem, period: float) -> None:
            self._inner = inner
            self.input_port_labels = {name: port for port, name in enumerate(inner.inputs)}
            self.output_port_labels = {name: port for port, name in enumerate(inner.outputs)}
            super().__init__()
            self._last: list[float] | None = None  # the inputs at the last sample
            self._now = 0.0, [0.0] * len(inner.inputs)
            self.switches: list[Any] = []
            # It acts at the time of the inputs, which the schedule's own time may miss by rounding
            # (or by more, if a fixed step does not divide the period).
            self.events = [schedule.Schedule(t_period=period, func_act=lambda _: self._commit())]

        def update(self, t: float) -> None:
            """Set the outputs to the values at the present inputs."""
            now = self.inputs.to_array().tolist()
            self._now = t, now
            before, dt = (now, 0.0) if self._last is None else (self._last, t - self._inner.it.t)
            for port, value in enumerate(self._inner.peek(before, now, dt)):
                self.outputs[port] = value

        def _commit(self) -> None:
            t, now = self._now
            if self._last is None and t != self._inner.it.t:
                self._inner.restart(t=t)
            self._inner.advance_to(self._last or now, now, t)
            self._last = now
            self.switches += self._inner.it.switches

        @property
        def friction(self) -> FrictionState:
            """The friction at the last sample."""
            friction: FrictionState = self._only(FrictionState)
            return friction

        @property
        def system(self) -> SystemState:
            """The system at the last sample."""
            system: SystemState = self._only(SystemState)
            return system

        def _only(self, kind: type[Any]) -> Any:
            if not isinstance(self._inner.it, kind):
                raise AttributeError(f"it is a {type(self._inner.it).__name__}")
            return self._inner.it

        def reset(self) -> None:
            """Return to the start."""
            super().reset()
            self._inner.restart()
            self._last, self.switches = None, []

        def to_checkpoint(self, prefix: str, recordings: bool = False) -> Any:
            """Return what PathSim saves, with the friction."""
            if not isinstance(self._inner.it, FrictionState):
                raise ParameterError(
                    "it is not part of PathSim's checkpoints",
                    place="system_block",
                    advice="keep block.system.snapshot()",
                )
            data, arrays = super().to_checkpoint(prefix, recordings)
            data["begun"] = self._last is not None
            arrays[f"{prefix}/last"] = np.array(self._last or [])
            arrays[f"{prefix}/friction"] = self.friction.to_array()
            return data, arrays

        def load_checkpoint(self, prefix: str, json_data: Any, npz: Any) -> None:
            """Return to what `to_checkpoint` returned."""
            super().load_checkpoint(prefix, json_data, npz)
            self.friction.from_array(npz[f"{prefix}/friction"])
            self._last = npz[f"{prefix}/last"].tolist() if json_data["begun"] else None
            self.switches = []

    return Stepped
