"""Systems whose controllers are Python functions: called once, then their outputs are records.

A system steps from tick to tick, and the functions see what the run has then, up to the last bits
where texts read the time. What they returned is a signal of the system that runs.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.errors import ParameterError, SignalError, shown
from gms_fsm.foundation.arguments import unknown
from gms_fsm.run.settings import Settings
from gms_fsm.run.stepped.plant import Plant
from gms_fsm.run.ticks import Clock, ticks_of
from gms_fsm.systems.models import Model
from gms_fsm.systems.parts import Sampled
from gms_fsm.systems.signals import Corners, Function, piecewise_linear
from gms_fsm.systems.system import System
from gms_fsm.traces.failures import SimulationError
from integrators import Ticks

NAMED = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)


def controlled(
    model: Model | System,
    t_end: float,
    settings: Settings,
    *,
    t_start: float = 0.0,
    initial: Mapping[str, Any] | None = None,
) -> Model | System:
    """Return a system in which what Python functions return is a record; all else as it is."""
    if not getattr(model, "controllers", ()):
        return model
    system: Any = model
    outputs = tuple(name for each in system.controllers for name in each.outputs)
    start = checked_scalar("t_start", t_start, "finite")
    end = checked_scalar("t_end", t_end, "finite")
    plain: System = replace(system, controllers=(), inputs=(*system.inputs, *outputs))
    given = {
        name: each
        for name, each in plain.signals.items()
        if isinstance(each, Corners) and np.ptp(each.values)
    }
    inputs = tuple(dict.fromkeys((*plain.inputs, *given)))
    functions = any(isinstance(each, Function) for each in plain.signals.values())
    engine = "compiled" if settings.engine == "compiled" and not functions else "ifelse"
    last = min([end, *(float(each.times[-1]) for each in given.values() if not each.held)])
    plant = Plant(replace(plain, inputs=inputs), start, initial, settings, engine, last)
    called = [(each, _arguments(each, plant)) for each in system.controllers]
    ticks = _ticks(system, start, end)
    values = {name: each.initial[name] for each in system.controllers for name in each.outputs}
    records = {name: ([start], [value]) for name, value in values.items()}
    corners = {float(t) for each in given.values() for t in each.times if start < t < end}
    stops = sorted({start, *ticks.times.tolist(), *corners})
    known = math.inf
    try:
        for t, after in zip(stops, [*stops[1:], end], strict=True):
            bits = ticks.at(t)
            for k, (sampler, names) in enumerate(called):
                if bits & 1 << k:
                    _call(sampler, names, t, plant, given, values)
            for name, value in values.items():
                _put(*records[name], t, value, begins=t == start)
            if after > t:
                held = {name: (value, value) for name, value in values.items()}
                lines = {**held, **{u: _line(each, t, after) for u, each in given.items()}}
                ends = [lines[name] for name in inputs]
                plant.commit(after, [each[0] for each in ends], [each[1] for each in ends])
    except SimulationError:  # the run says so, with what there was before, or that the records end
        known = after
    kept = {name: _record(*each, known) for name, each in records.items()}
    return replace(plain, signals={**plain.signals, **kept})


def _ticks(system: System, start: float, end: float) -> Ticks:
    """Return when functions are called, each with the bit of its place."""
    clocks = tuple(Clock(each.name, each.period, each.offset, True) for each in system.controllers)
    return ticks_of(clocks, start, start, end)


def _arguments(sampler: Sampled, plant: Plant) -> tuple[str, ...]:
    """Return the names of the values that a function takes, or refuse it."""
    here = f"sampled {sampler.name!r}"
    function: Any = sampler.updates
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        raise ParameterError(
            "its parameters have no names", place=here, advice="give a function of named values"
        ) from None
    known = [*plant.names, "period"]
    # A parameter with a default that names no value keeps its default.
    asked = [each for each in parameters if each.name in known or each.default is each.empty]
    for each in asked:
        if each.kind not in NAMED:
            raise ParameterError(
                f"its parameter {each} names no value", place=here, advice="name each value"
            )
        if each.name not in known:
            raise unknown("value", each.name, known, place=here)
    return tuple(each.name for each in asked)


def _call(
    sampler: Sampled,
    names: tuple[str, ...],
    t: float,
    plant: Plant,
    given: Mapping[str, Corners],
    values: dict[str, float],
) -> None:
    """Call a function at a tick, and put what it returns among the values."""
    now = {"t": t, "period": sampler.period, **values}
    for name in names:
        if name in given:
            now[name] = _line(given[name], t, math.inf)[0]
        elif name not in now:
            now[name] = plant.value(name)
    here = f"sampled {sampler.name!r}"
    try:
        found = sampler.updates(**{name: now[name] for name in names})
    except Exception as error:
        raise SignalError(
            f"the function raised {type(error).__name__} at t = {t!r} s: {error}", place=here
        ) from error
    try:
        returned = np.atleast_1d(np.asarray(found))
        numbers = returned.astype(float, casting="same_kind").tolist() if returned.ndim == 1 else []
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != len(sampler.outputs) or not all(map(math.isfinite, numbers)):
        raise SignalError(
            f"the function returned {shown(found)} at t = {t!r} s",
            place=here,
            advice=f"it must return a finite number for each of {', '.join(sampler.outputs)}",
        )
    values.update(zip(sampler.outputs, numbers, strict=True))


def _put(times: list[float], values: list[float], t: float, value: float, *, begins: bool) -> None:
    """Let a record jump to a value, if it has another one."""
    if begins:
        values[0] = value
    elif values[-1] != value:
        times += t, t
        values += values[-1], value


def _record(times: list[float], values: list[float], known: float) -> Corners:
    """Return a record that keeps its last value, up to where it is known."""
    if math.isfinite(known):
        times, values = [*times, known], [*values, values[-1]]
    elif len(times) == 1:
        times, values = [times[0] - 1.0, *times], [values[0], *values]
    return Corners(np.array(times), np.array(values), held=not math.isfinite(known))


def _line(signal: Corners, t: float, after: float) -> tuple[float, float]:
    """Return a record just after a time, and just before another one."""
    record: Any = signal.times, signal.values
    before = math.nextafter(after, -math.inf)
    return float(piecewise_linear(t, *record)), float(piecewise_linear(before, *record))
