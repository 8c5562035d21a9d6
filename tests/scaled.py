"""The same run in other units: all lengths, forces or times scaled by a power of two.

A power of two changes no digit of a binary number, so a run that is right at one scale is right at
every scale, and a program without scales of its own gives the same bits but for the factors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm import GMS, GMSParameters, LuGre, Prescribed, PulledSlider, Slider, Stribeck, Trace
from gms_fsm.language import Binary, Call, Name, Negative, Number, Value, spell
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Corners, Formula, Signal
from tests.corpus import Run

AXES = ("length", "force", "time")


def factors(axis: str, exponent: int) -> dict[str, float]:
    """Return the arguments of `scaled` for one axis.

    >>> factors("time", -2)
    {'time': 0.25}
    """
    assert axis in AXES
    return {axis: 2.0**exponent}


def scaled(run: Run, *, length: float = 1.0, force: float = 1.0, time: float = 1.0) -> Run:
    """Return a run with all its lengths [m], forces [N] and times [s] multiplied.

    Parameters
    ----------
    run : Run
        Of a GMS or LuGre model on a shipped rig. ``atol`` must not be given: it has no unit.
    length, force, time : float
        Powers of two, so that nothing is rounded.

    Returns
    -------
    Run
        The same run in other units.
    """
    assert "atol" not in run.how, "one number cannot be scaled as m and as m/s"
    units, (model, rig) = _Units(length, force, time), run.subject
    subject = _model(model, units), _rig(rig, units)
    return Run(subject, time * run.t_end, _arguments(run.how, units))


@dataclass(frozen=True)
class _Units:
    """Factors of the units in use."""

    length: float
    force: float
    time: float

    @property
    def speed(self) -> float:
        return self.length / self.time

    @property
    def stiffness(self) -> float:
        return self.force / self.length

    @property
    def damping(self) -> float:
        return self.force / self.speed

    @property
    def mass(self) -> float:
        return self.force * self.time / self.speed


def _curve(curve: Stribeck, u: _Units) -> Stribeck:
    return Stribeck(u.force * curve.F_c, u.force * curve.F_s, u.speed * curve.v_s)


def _model(model: Model, u: _Units) -> Model:
    curve = _curve(model.stribeck, u)
    if isinstance(model, LuGre):
        return LuGre(
            sigma_0=u.stiffness * model.sigma_0,
            sigma_1=u.damping * model.sigma_1,
            sigma_2=u.damping * model.sigma_2,
            stribeck=curve,
        )
    assert isinstance(model, GMS)
    p = model.parameters
    parameters = GMSParameters(
        u.stiffness * p.k,
        u.damping * p.sigma,
        u.speed * p.C,
        sigma_2=u.damping * p.sigma_2,
        stribeck=curve,
        v_c=u.speed * p.v_c,
        weights=p.weights / u.stiffness,
    )
    return GMS(parameters, law=model.law)


def _rig(rig: Rig, u: _Units) -> Rig:
    match rig:
        case PulledSlider():
            return PulledSlider(u.mass * rig.mass, u.stiffness * rig.stiffness, u.speed * rig.speed)
        case Slider():
            return Slider(u.mass * rig.mass, _signal(rig.signals["F_a"], u.force, u.time))
        case Prescribed():
            return Prescribed(_signal(rig.signals["v"], u.speed, u.time))
    raise TypeError(f"{rig!r} is no shipped rig")


def _signal(signal: Signal, value: float, time: float) -> Signal:
    if isinstance(signal, Corners):
        return Corners(time * signal.times, value * signal.values, held=signal.held)
    assert isinstance(signal, Formula)
    tree = signal.tree if time == 1 else _slower(signal.tree, time)
    return Formula(spell(tree if value == 1 else Binary("*", Number(value), tree)))


def _slower(tree: Value, time: float) -> Value:
    """Return a tree with t / time in place of t."""
    match tree:
        case Name("t"):
            return Binary("*", Name("t"), Number(1 / time))
        case Negative(operand):
            return Negative(_slower(operand, time))
        case Binary(op, left, right):
            return Binary(op, _slower(left, time), _slower(right, time))
        case Call(function, arguments):
            return Call(function, tuple(_slower(u, time) for u in arguments))
    return tree


def _arguments(given: Mapping[str, Any], u: _Units) -> dict[str, Any]:
    times = ("t_start", "t_eval", "step", "max_step")
    initial = {"x": u.length, "z": u.length, "v": u.speed}
    changed = {name: u.time * given[name] for name in times if given.get(name) is not None}
    if "initial" in given:
        changed["initial"] = {
            name: np.multiply(initial[name], value) if name in initial else value
            for name, value in given["initial"].items()
        }
    return {**given, **changed}


# --------------------------------------------------------------------------- comparing
def other_bits(
    trace: Trace, base: Trace, *, length: float = 1.0, force: float = 1.0, time: float = 1.0
) -> list[str]:
    """Return which columns of a scaled run are not those of the base but for the factors."""
    scales = {"t": time, "x": length, "v": length / time, "z": length, "F": force}
    if len(trace) != len(base):
        return [f"{len(trace)} rows instead of {len(base)}"]
    differ = [
        name
        for name, factor in scales.items()
        if not np.array_equal(getattr(trace, name), factor * getattr(base, name))
    ]
    log = {"t": time, "z": length, "v": length / time}
    return differ + [
        f"log.{name}"
        for name, factor in log.items()
        if not np.array_equal(trace.transitions[name], factor * base.transitions[name])
    ]
