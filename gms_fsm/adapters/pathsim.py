"""Friction as a block of PathSim."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.coupling.stepping import ElementSwitch, FrictionState
from gms_fsm.foundation.extras import require
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

__all__ = ["friction_block"]


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
    return _block_class()(begin, period)


@functools.cache
def _block_class() -> Any:
    """Return the class of the blocks; PathSim is imported only here."""
    base, schedule = (
        require("pathsim.blocks", "pathsim").Block,
        require("pathsim.events", "pathsim"),
    )

    class Friction(base):  # type: ignore[misc, valid-type]  # PathSim has no types
        """Friction that is committed at each sample, and asked between two."""

        linearizable = False

        def __init__(self, begin: Any, period: float) -> None:
            self._begin = begin
            self.friction: FrictionState = begin()
            self._more = self.friction.inputs
            names = "v", *self._more
            self.input_port_labels = {name: port for port, name in enumerate(names)}
            self.output_port_labels = {"F": 0}
            super().__init__()
            self._last: list[float] | None = None  # the inputs at the last sample
            self._now = 0.0, [0.0] * len(names)
            self.switches: list[ElementSwitch] = []
            # It acts at the time of the inputs, which the schedule's own time may miss by rounding
            # (or by more, if a fixed step does not divide the period).
            self.events = [schedule.Schedule(t_period=period, func_act=lambda _: self._commit())]

        def update(self, t: float) -> None:
            """Set the output to the force at the present inputs."""
            now = self.inputs.to_array().tolist()
            self._now = t, now
            before, dt = (now, 0.0) if self._last is None else (self._last, t - self.friction.t)
            more = self._lines(before, now)
            self.outputs[0] = self.friction.peek(before[0], now[0], dt, **more)

        def _commit(self) -> None:
            t, now = self._now
            if self._last is None and t != self.friction.t:
                self.friction = self._begin(t=t)
            before = self._last or now
            self.friction.advance_to(before[0], now[0], t, **self._lines(before, now))
            self._last = now
            self.switches += self.friction.switches

        def _lines(self, before: list[float], now: list[float]) -> dict[str, tuple[float, float]]:
            ends = zip(before[1:], now[1:], strict=True)
            return dict(zip(self._more, ends, strict=True))

        def reset(self) -> None:
            """Return to the start."""
            super().reset()
            self.friction, self._last, self.switches = self._begin(), None, []

        def to_checkpoint(self, prefix: str, recordings: bool = False) -> Any:
            """Return what PathSim saves, with the friction."""
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

    return Friction
