"""The motion of a handout's hysteresis loop: a sine whose amplitude makes the model slip."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.foundation.quantities import in_words, quantity
from gms_fsm.run.simulate import simulate
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Prescribed, Rig, TextRig
from gms_fsm.traces.trace import Trace
from plots.systems.system_diagram import signal_text

PERIOD, CYCLES = 10.0, 2.25  # s; the first quarter leaves the origin
SMALLEST, FACTOR, TRIES = 1e-7, 4.0, 14  # m: amplitudes that are tried, up to 6.7 m
UNSCALED = 0.1  # m: of a model that does the same at every amplitude
SATURATED = 1.6  # growth of F by FACTOR times the amplitude; an elastic contact has FACTOR
PEAK = 1e3  # of the median of F
MOVES = 0.3  # of the amplitude of the spring's end: a body that slips
MASS, STIFFNESS = 1.0, 2.0  # kg, N/m


@dataclass(frozen=True, eq=False)
class Excited:
    """A run and what moved it.

    Parameters
    ----------
    trace : Trace
        The run.
    about : str
        In words.
    """

    trace: Trace
    about: str


def of_rig(trace: Trace) -> Excited:
    """Return a run of one's own, with what moved it."""
    rig = trace.rig
    units = {each.name: each.unit for each in getattr(rig, "parameters", ())}
    numbers = {} if trace.system is not None else rig.numbers
    given = [f"{name} = {quantity(u, units.get(name, ''), 3)}" for name, u in numbers.items()]
    given += [signal_text(name, signal) for name, signal in rig.signals.items()]
    return Excited(trace, f"{rig.title}: {', '.join(given)}" if given else rig.title)


def excited(model: Model) -> Excited:
    """Return a run for the hysteresis loop of a model."""
    pulled = model.chart.locks or model.chart.sets_velocity
    found, before = [], 0.0
    for step in range(TRIES):
        amplitude = SMALLEST * FACTOR**step
        trace = _run(model, amplitude, 1.0, pulled=pulled)
        if trace is None:
            break
        found.append(amplitude)
        if pulled:
            acts = float(np.nanmax(np.abs(trace.F))) > 0
            enough = acts and bool(np.ptp(trace.x) > 2 * MOVES * amplitude)
        elif model.chart.transitions:
            enough = np.unique(trace.transitions.element).size == model.n
        else:
            force = _at_rest(trace)
            enough, before = 0 < force < SATURATED * before, force
        if enough:
            if step == 0 and _any_size(model, pulled=pulled):
                found.append(UNSCALED)
            break
    smaller = ""
    for amplitude in reversed(found):
        trace = _run(model, amplitude, CYCLES, pulled=pulled)
        if trace is not None and _bounded(trace):
            return Excited(trace, _about(amplitude, pulled=pulled) + smaller)
        smaller = "; F grows without limit if A is four times as large"
    largest = SMALLEST * FACTOR ** (TRIES - 1)
    raise ParameterError(
        f"no sine between {SMALLEST:g} and {largest:.2g} m gives a loop of {model.title}",
        advice="give a run, for example simulate(model, Prescribed('0.1*cos(t)'), 7.0)",
    )


def _any_size(model: Model, *, pulled: bool) -> bool:
    """Return whether a model that acts at the smallest amplitude also does at a usual one."""
    trace = _run(model, UNSCALED, CYCLES, pulled=pulled)
    return trace is not None and _bounded(trace)


def _bounded(trace: Trace) -> bool:
    """Return whether there is a force, and it does not run away, as the published law may do."""
    forces = np.abs(trace.F[np.isfinite(trace.F) & (trace.F != 0)])
    return bool(forces.size and forces.max() < PEAK * np.median(forces))


def _at_rest(trace: Trace) -> float:
    """Return the force at the second turning point, where v is 0 and nothing viscous acts."""
    return float(abs(np.interp(0.75 * PERIOD, trace.t, trace.F)))


def _run(model: Model, amplitude: float, cycles: float, *, pulled: bool) -> Trace | None:
    """Return a run with a sine; None if it fails."""
    rate = 2 * math.pi / PERIOD
    rig: Rig = Prescribed(f"{amplitude!r} * {rate!r} * cos({rate!r} * t)")
    if pulled:
        numbers = {"mass": MASS, "stiffness": STIFFNESS}
        end = f"{amplitude!r} * sin({rate!r} * t)"
        text = "(stiffness * (end - x) - F) / mass"
        rig = TextRig("mass pulled through a spring", text, {"end": end}, numbers)
    try:
        return simulate(model, rig, cycles * PERIOD)
    except GMSError:
        return None


def _about(amplitude: float, *, pulled: bool) -> str:
    sine = f"A sin(2πt/T), A = {in_words(amplitude, 'm', 3)}, T = {PERIOD:g} s"
    if not pulled:
        return f"x(t) = {sine}"
    return (
        f"A mass of {MASS:g} kg pulled through a spring of {STIFFNESS:g} N/m, whose end moves as "
        f"{sine}"
    )
