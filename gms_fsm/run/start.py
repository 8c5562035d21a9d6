"""The arguments of a simulation, checked and completed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import integrators
from gms_fsm.charts.parameters import as_floats, checked_array, checked_scalar
from gms_fsm.errors import ParameterError, SignalError, shown
from gms_fsm.lowering._pulses import waking_times
from gms_fsm.lowering.layout import Layout
from gms_fsm.lowering.program import Program, arguments, lower
from gms_fsm.lowering.scales import Setting, Tolerance, scales_of
from gms_fsm.run.settings import Settings
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Corners, Formula
from integrators import Options

__all__ = ["Start"]

LATEST = 1e9  # s; one tick of a double is then 1e-7 s


@dataclass(frozen=True, eq=False)
class Start:
    """A model on a rig, ready to run.

    Parameters
    ----------
    model, rig
        The model and the rig.
    program : Program
        Their generated text.
    t_start, t_end, last : float
        s; `last` is earlier than t_end where a sampled signal ends.
    y : list of float, shape (m,)
        Initial state.
    mode : list of int, shape (n,)
        Initial states of the elements.
    options : integrators.Options
        How to integrate.
    settings : mapping
        As recorded in the trace.
    chosen : Settings
        As given.
    """

    model: Model
    rig: Rig
    program: Program
    t_start: float
    t_end: float
    last: float
    y: list[float]
    mode: list[int]
    options: Options
    settings: Mapping[str, Setting]
    chosen: Settings

    @property
    def output(self) -> str:
        """What to record: ``"all"``, ``"t_eval"`` or ``"end"``."""
        assert self.chosen.output is not None  # set by Settings
        return self.chosen.output

    @classmethod
    def of(
        cls,
        model: Model,
        rig: Rig,
        t_end: float,
        settings: Settings | None = None,
        *,
        t_start: float = 0.0,
        initial: Mapping[str, Any] | None = None,
        rows_at_once: int = integrators.ROWS_AT_ONCE,
    ) -> Start:
        """Check the arguments of `gms_fsm.simulate`.

        Parameters
        ----------
        model, rig, t_end, t_start, initial
            See `gms_fsm.simulate`.
        settings : Settings, optional
            How to integrate; the defaults if omitted.
        rows_at_once : int
            Maximum number of steps in an arc.

        Returns
        -------
        Start
            Ready to run.

        Raises
        ------
        ParameterError, SignalError
            If an argument violates its rule.
        """
        for what, given, mark, example in (
            ("model", model, "chart", "GMS(parameters, law='signed')"),
            ("rig", rig, "signals", "Prescribed('0.1*sin(t)')"),
        ):
            if not hasattr(given, mark):
                raise ParameterError(
                    f"it must be a {what}, for example {example}", place=what, value=given
                )
        chosen = Settings() if settings is None else settings
        t_start, t_end = _times(t_start, t_end)
        _check_resolution(chosen, t_start, t_end)
        scales = scales_of(model)
        tolerances, used = _tolerances(model, rig, chosen.atol, scales.tolerances(chosen.rtol))
        method = chosen.method
        if not isinstance(method, str) and min(tolerances) == 0.0:
            raise ParameterError(
                f"method {method.__name__} needs an absolute tolerance, and the chart "
                "gives no scale for some component",
                advice="give one, for example atol=1e-9, or by name atol={'x': 1e-9}",
            )
        options = Options(
            integrators.METHODS[method] if isinstance(method, str) else method,
            chosen.step,
            chosen.rtol,
            tolerances,
            chosen.max_step,
            scales.time,
            chosen.max_steps,
            chosen.events == "located",
            [] if chosen.output == "end" else _wanted(chosen, t_start, t_end),
            rows_at_once,
        )
        last = _covered(rig, t_start, t_end)
        program = _with_waking_times(lower(model, rig), rig, t_start, last)
        y, mode = _initial(model, rig, {} if initial is None else initial)
        kept: dict[str, Setting] = {
            "method": chosen.method_name,
            "step": chosen.step,
            "rtol": chosen.rtol,
            "atol": used,
            "max_step": chosen.max_step if math.isfinite(chosen.max_step) else None,
            "max_steps": chosen.max_steps,
            "events": chosen.events,
            "engine": chosen.engine,
            "t_start": t_start,
            "t_end": t_end,
        }
        return cls(model, rig, program, t_start, t_end, last, y, mode, options, kept, chosen)

    def with_numbers(self, model: Model, rig: Rig) -> Start:
        """Return the same start with different numbers; signals and initial values stay.

        Parameters
        ----------
        model, rig
            Of the same kind as the previous ones.

        Returns
        -------
        Start
            With the tolerances of the new model.
        """
        scales = scales_of(model)
        default = scales.tolerances(self.options.rtol)
        tolerances, used = _tolerances(model, rig, self.chosen.atol, default)
        return replace(
            self,
            model=model,
            rig=rig,
            program=replace(self.program, p=arguments(model, rig)),
            options=replace(self.options, atol=tolerances, time_scale=scales.time),
            settings={**self.settings, "atol": used},
        )


def _times(t_start: float, t_end: float) -> tuple[float, float]:
    t_start = checked_scalar("t_start", t_start, "finite")
    t_end = checked_scalar("t_end", t_end, "finite")
    for name, time in (("t_start", t_start), ("t_end", t_end)):
        if abs(time) > LATEST:
            raise ParameterError(
                f"{name} is {time!r} s", advice=f"beyond {LATEST:g} s time is resolved too coarsely"
            )
    if t_end <= t_start:
        raise ParameterError(
            f"t_end is {t_end!r}, t_start is {t_start!r}", advice="t_end must be later"
        )
    return t_start, t_end


def _check_resolution(chosen: Settings, t_start: float, t_end: float) -> None:
    """Refuse steps too short to be resolved at these times."""
    tick = 16.0 * math.ulp(max(abs(t_start), abs(t_end)))
    for name, length in (("step", chosen.step), ("max_step", chosen.max_step)):
        if length is not None and length <= tick:
            raise ParameterError(
                f"{name} is {length!r} s, below the resolution of the clock ({tick:.2g} s here)",
                advice="give a larger value",
            )


def _wanted(chosen: Settings, t_start: float, t_end: float) -> list[float] | None:
    """Return the requested times, if any, after checking that all lie within the run."""
    if chosen.t_eval is None:
        return None
    times = as_floats(np.asarray(chosen.t_eval))
    for time in times:
        if not t_start <= time <= t_end:
            raise ParameterError(
                f"t_eval has {time!r}, outside of t_start = {t_start!r} to t_end = {t_end!r}"
            )
    return times


def _tolerances(
    model: Model, rig: Rig, atol: Tolerance, default: Mapping[str, list[float]]
) -> tuple[list[float], float | dict[str, float | list[float]]]:
    """Return the absolute tolerance of each component, and how to record them in the settings."""
    places = Layout.state(model, rig)
    if atol is not None and not isinstance(atol, Mapping):
        return [atol] * places.size, atol
    rows = {name: default[name] for name in (*places.shared, *places.own)}
    by_name: Mapping[str, Any] = {} if atol is None else atol
    for name, given in by_name.items():
        if name not in rows:
            raise ParameterError(
                f"atol has the key {shown(name)}", advice=f"known are {', '.join(map(repr, rows))}"
            )
        if np.ndim(given) == 0:
            rows[name] = [checked_scalar(f"atol[{name!r}]", given, "> 0")] * len(rows[name])
        else:
            rows[name] = as_floats(checked_array(f"atol[{name!r}]", given, len(rows[name]), "> 0"))
    used: dict[str, float | list[float]] = {
        name: row if name in places.own else row[0] for name, row in rows.items()
    }
    return places.joined(used), used


def _with_waking_times(program: Program, rig: Rig, t_start: float, t_end: float) -> Program:
    """Return the program with the times at which its formulas start to change as knots."""
    times = {
        time
        for signal in rig.signals.values()
        if isinstance(signal, Formula)
        for time in waking_times(signal.tree, t_start, t_end)
    }
    return replace(program, knots=sorted({*program.knots, *times})) if times else program


def _covered(rig: Rig, t_start: float, t_end: float) -> float:
    """Return the last time covered by all sampled signals."""
    last = t_end
    for name, signal in rig.signals.items():
        if isinstance(signal, Corners) and not signal.held:
            if not signal.times[0] <= t_start < signal.times[-1]:
                raise SignalError(
                    f"signal {name!r} covers {float(signal.times[0])!r} to "
                    f"{float(signal.times[-1])!r} s, but the run starts at {t_start!r} s",
                    advice="choose t_start within the record",
                )
            last = min(last, float(signal.times[-1]))
    return last


def _initial(model: Model, rig: Rig, initial: Mapping[str, Any]) -> tuple[list[float], list[int]]:
    """Build the state vector and the modes."""
    chart, n = model.chart, model.n
    known = ("x", "v", *chart.variables, "states")
    if not isinstance(initial, Mapping):
        raise ParameterError(
            "it must be a mapping, for example {'x': 0}", place="initial", value=initial
        )
    for name in initial:
        if name not in known:
            raise ParameterError(
                f"initial has the key {shown(name)}",
                advice=f"known are {', '.join(map(repr, known))}",
            )
    places = Layout.state(model, rig)
    y: dict[str, Any] = {
        name: checked_scalar(f"initial[{name!r}]", initial.get(name, 0.0), "finite")
        for name in places.shared
    }
    if "v" in initial and "v" not in y:
        raise ParameterError(
            f"initial has 'v' = {shown(initial['v'])}, but the rig prescribes the velocity",
            advice="leave it out",
        )
    for name in chart.variables:
        values = checked_array(f"initial[{name!r}]", initial.get(name, [0.0] * n), None, "finite")
        if values.size != n:
            raise ParameterError(
                f"initial[{name!r}] has {values.size} entries", advice=f"the model has {n} elements"
            )
        y[name] = as_floats(values)
    names: Any = initial.get("states", [chart.default_state.name] * n)
    if isinstance(names, str) or np.ndim(names) != 1 or len(names) != n:
        raise ParameterError(
            f"it must list {n} state names", place="initial['states']", value=names
        )
    return places.joined(y), [chart.state_index(str(name)) for name in names]
