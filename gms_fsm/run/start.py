"""What a simulation is started with, checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import integrators
from gms_fsm.charts.parameters import as_floats, checked_array, checked_scalar
from gms_fsm.errors import ParameterError, SignalError, shown
from gms_fsm.lowering._pulses import waking_times
from gms_fsm.lowering.layout import Layout
from gms_fsm.lowering.program import Program, arguments, lower
from gms_fsm.lowering.scales import Setting, Tolerance, scales_of
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Corners, Formula
from integrators import Options

__all__ = ["ENGINES", "MOST_STEPS", "Start"]

LATEST = 1e9  # s; one tick of a double is then 1e-7 s
MOST_STEPS = 1_000_000  # of a run, unless told otherwise
ENGINES = ("machines", "ifelse", "compiled")


@dataclass(frozen=True, eq=False)
class Start:
    """A model on a rig, ready to run.

    Parameters
    ----------
    model, rig
        What runs.
    program : Program
        Its generated text.
    t_start, t_end, last : float
        s; `last` is earlier than t_end where a sampled signal ends.
    y : list of float, shape (m,)
        Initial state.
    mode : list of int, shape (n,)
        Initial states of the elements.
    options : integrators.Options
        How to integrate.
    output : {"all", "t_eval", "end"}
        What to keep.
    settings : mapping
        As they are kept in the trace.
    atol : float or mapping, optional
        As it was given.
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
    output: str
    settings: Mapping[str, Setting]
    atol: Tolerance

    @classmethod
    def of(
        cls,
        model: Model,
        rig: Rig,
        t_end: float,
        *,
        t_start: float = 0.0,
        method: str | type[Any] = "dp45",
        step: float | None = None,
        rtol: float = 1e-6,
        atol: Tolerance = None,
        max_step: float = math.inf,
        max_steps: int = MOST_STEPS,
        events: str = "located",
        engine: str = "machines",
        output: str | None = None,
        t_eval: ArrayLike | None = None,
        initial: Mapping[str, Any] | None = None,
        rows_at_once: int = integrators.ROWS_AT_ONCE,
    ) -> Start:
        """Check the arguments of `gms_fsm.simulate`.

        Parameters
        ----------
        model, rig, t_end, t_start, method, step, rtol, atol, max_step, max_steps, events, engine
            See `gms_fsm.simulate`.
        output, t_eval, initial
            See `gms_fsm.simulate`.
        rows_at_once : int
            How many steps an arc holds at most.

        Returns
        -------
        Start
            Complete.

        Raises
        ------
        ParameterError, SignalError
            If an argument breaks its rule.
        """
        for what, given, mark, example in (
            ("model", model, "chart", "GMS(parameters, law='signed')"),
            ("rig", rig, "signals", "Prescribed('0.1*sin(t)')"),
        ):
            if not hasattr(given, mark):
                raise ParameterError(
                    f"{what} is {shown(given)}; it must be a {what}, for example {example}"
                )
        t_start = checked_scalar("t_start", t_start, "finite")
        t_end = checked_scalar("t_end", t_end, "finite")
        for name, time in (("t_start", t_start), ("t_end", t_end)):
            if abs(time) > LATEST:
                raise ParameterError(
                    f"{name} is {time!r} s; beyond {LATEST:g} s the clock is too coarse"
                )
        if t_end <= t_start:
            raise ParameterError(f"t_end is {t_end!r}, t_start is {t_start!r}; t_end must be later")
        if engine not in ENGINES:
            raise ParameterError(
                f"engine is {shown(engine)}; it must be {', '.join(map(repr, ENGINES))}, or an "
                "ElementMachines"
            )
        if engine == "compiled" and isinstance(method, type):
            raise ParameterError(
                f"engine 'compiled' runs our own methods ({', '.join(integrators.METHODS)}), not "
                f"{method.__name__}; use engine='machines' for SciPy's solvers"
            )
        output = _output(output, t_eval)
        rtol = checked_scalar("rtol", rtol, "> 0")
        scales = scales_of(model)
        tolerances, used = _tolerances(model, rig, atol, scales.tolerances(rtol))
        options = _options(
            method,
            step,
            rtol,
            tolerances,
            max_step,
            scales.time,
            _count(max_steps),
            events,
            t_eval,
            output,
            t_start,
            t_end,
            rows_at_once,
        )
        last = _covered(rig, t_start, t_end)
        program = _watchful(lower(model, rig), rig, t_start, last)
        y, mode = _initial(model, rig, {} if initial is None else initial)
        settings: dict[str, Setting] = {
            "method": method if isinstance(method, str) else method.__name__,
            "step": step,
            "rtol": rtol,
            "atol": used,
            "max_step": max_step if math.isfinite(max_step) else None,
            "max_steps": max_steps,
            "events": events,
            "engine": engine,
            "t_start": t_start,
            "t_end": t_end,
        }
        return cls(
            model, rig, program, t_start, t_end, last, y, mode, options, output, settings, atol
        )

    def with_numbers(self, model: Model, rig: Rig) -> Start:
        """Return the same start with other numbers; signals and initial values stay.

        Parameters
        ----------
        model, rig
            Of the same kind as those before.

        Returns
        -------
        Start
            With the tolerances of the new model.
        """
        scales = scales_of(model)
        default = scales.tolerances(self.options.rtol)
        tolerances, used = _tolerances(model, rig, self.atol, default)
        return replace(
            self,
            model=model,
            rig=rig,
            program=replace(self.program, p=arguments(model, rig)),
            options=replace(self.options, atol=tolerances, time_scale=scales.time),
            settings={**self.settings, "atol": used},
        )


def _output(output: str | None, t_eval: ArrayLike | None) -> str:
    if output is None:
        return "all" if t_eval is None else "t_eval"
    if output not in ("all", "t_eval", "end"):
        raise ParameterError(f"output is {shown(output)}; it must be 'all', 't_eval' or 'end'")
    if (output == "t_eval") != (t_eval is not None):
        raise ParameterError(
            "output='t_eval' needs t_eval=..., the times of the rows"
            if t_eval is None
            else f"output is {output!r}, but t_eval asks for rows at given times; leave one out"
        )
    return output


def _count(max_steps: Any) -> int:
    if isinstance(max_steps, bool) or not isinstance(max_steps, int) or max_steps < 1:
        raise ParameterError(
            f"max_steps is {shown(max_steps)}; it must be a whole number of steps, at least 1"
        )
    return max_steps


def _tolerances(
    model: Model, rig: Rig, atol: Tolerance, default: Mapping[str, list[float]]
) -> tuple[list[float], float | dict[str, float | list[float]]]:
    """Return the absolute tolerance of each component, and what to say of them."""
    places = Layout.state(model, rig)
    if atol is not None and not isinstance(atol, Mapping):
        number = checked_scalar("atol", atol, "> 0")
        return [number] * places.size, number
    rows = {name: default[name] for name in (*places.shared, *places.own)}
    by_name: Mapping[str, Any] = {} if atol is None else atol
    for name, given in by_name.items():
        if name not in rows:
            raise ParameterError(
                f"atol has the key {shown(name)}; known are {', '.join(map(repr, rows))}"
            )
        if np.ndim(given) == 0:
            rows[name] = [checked_scalar(f"atol[{name!r}]", given, "> 0")] * len(rows[name])
        else:
            rows[name] = as_floats(checked_array(f"atol[{name!r}]", given, len(rows[name]), "> 0"))
    used: dict[str, float | list[float]] = {
        name: row if name in places.own else row[0] for name, row in rows.items()
    }
    return places.joined(used), used


def _options(
    method: str | type[Any],
    step: float | None,
    rtol: float,
    atol: list[float],
    max_step: float,
    time_scale: float,
    max_steps: int,
    events: str,
    t_eval: ArrayLike | None,
    output: str,
    t_start: float,
    t_end: float,
    rows_at_once: int,
) -> Options:
    chosen: Any = method
    if isinstance(method, str):
        if method not in integrators.METHODS:
            raise ParameterError(
                f"method is {shown(method)}; it must be one of {', '.join(integrators.METHODS)}, "
                "or a scipy.integrate.OdeSolver class"
            )
        chosen = integrators.METHODS[method]
        if step is None and not chosen.adaptive:
            raise ParameterError(
                f"method {method!r} has no error estimate; give step=..., or use 'dp45' or 'bs23'"
            )
    elif not (isinstance(method, type) and hasattr(method, "TOO_SMALL_STEP")):
        raise ParameterError(
            f"method is {shown(method)}; it must be a name ({', '.join(integrators.METHODS)}) or a "
            "scipy.integrate.OdeSolver class"
        )
    elif min(atol) == 0.0:
        raise ParameterError(
            f"method {method.__name__} needs an absolute tolerance, and the chart gives no scale "
            "for every component; give one, for example atol=1e-9, or by name atol={'x': 1e-9}"
        )
    if step is not None:
        step = checked_scalar("step", step, "> 0")
    if max_step != math.inf:
        max_step = checked_scalar("max_step", max_step, "> 0")
    tick = 16.0 * math.ulp(max(abs(t_start), abs(t_end)))
    for name, length in (("step", step), ("max_step", max_step)):
        if length is not None and length <= tick:
            raise ParameterError(
                f"{name} is {length!r} s, under the resolution of the clock ({tick:.2g} s here); "
                "give a longer one"
            )
    if events not in ("located", "step"):
        raise ParameterError(f"events is {shown(events)}; it must be 'located' or 'step'")
    if events == "step" and step is None and not math.isfinite(max_step):
        raise ParameterError(
            "events='step' looks at the guards once a step: give step=... or a finite max_step"
        )
    times: list[float] | None = [] if output == "end" else None
    if t_eval is not None:
        wanted = checked_array("t_eval", t_eval, None, "finite")
        for outside in wanted[(wanted < t_start) | (wanted > t_end)][:1]:
            raise ParameterError(
                f"t_eval has {float(outside)!r}, outside of t_start = {t_start!r} to "
                f"t_end = {t_end!r}"
            )
        if (np.diff(wanted) <= 0).any():
            i = int(np.flatnonzero(np.diff(wanted) <= 0)[0])
            raise ParameterError(
                f"t_eval[{i}] = {wanted[i]} is not before t_eval[{i + 1}] = {wanted[i + 1]}; "
                "times must increase"
            )
        times = as_floats(wanted)
    located = events == "located"
    return Options(
        chosen, step, rtol, atol, max_step, time_scale, max_steps, located, times, rows_at_once
    )


def _watchful(program: Program, rig: Rig, t_start: float, t_end: float) -> Program:
    """Return the program with the places where its formulas wake up as knots."""
    times = {
        time
        for signal in rig.signals.values()
        if isinstance(signal, Formula)
        for time in waking_times(signal.tree, t_start, t_end)
    }
    return replace(program, knots=sorted({*program.knots, *times})) if times else program


def _covered(rig: Rig, t_start: float, t_end: float) -> float:
    """Return the last time all sampled signals cover."""
    last = t_end
    for name, signal in rig.signals.items():
        if isinstance(signal, Corners) and not signal.held:
            if not signal.times[0] <= t_start < signal.times[-1]:
                raise SignalError(
                    f"signal {name!r} covers {float(signal.times[0])!r} to "
                    f"{float(signal.times[-1])!r} s, but the run starts at {t_start!r} s; "
                    "choose t_start within the record"
                )
            last = min(last, float(signal.times[-1]))
    return last


def _initial(model: Model, rig: Rig, initial: Mapping[str, Any]) -> tuple[list[float], list[int]]:
    """Build the state vector and the modes."""
    chart, n = model.chart, model.n
    known = ("x", "v", *chart.variables, "states")
    if not isinstance(initial, Mapping):
        raise ParameterError(
            f"initial is {shown(initial)}; it must be a mapping, for example {{'x': 0}}"
        )
    for name in initial:
        if name not in known:
            raise ParameterError(
                f"initial has the key {shown(name)}; known are {', '.join(map(repr, known))}"
            )
    places = Layout.state(model, rig)
    y: dict[str, Any] = {
        name: checked_scalar(f"initial[{name!r}]", initial.get(name, 0.0), "finite")
        for name in places.shared
    }
    if "v" in initial and "v" not in y:
        raise ParameterError(
            f"initial has 'v' = {shown(initial['v'])}, but the rig prescribes the velocity; leave "
            "it out"
        )
    for name in chart.variables:
        values = checked_array(f"initial[{name!r}]", initial.get(name, [0.0] * n), None, "finite")
        if values.size != n:
            raise ParameterError(
                f"initial[{name!r}] has {values.size} entries; the model has {n} elements"
            )
        y[name] = as_floats(values)
    names: Any = initial.get("states", [chart.default_state.name] * n)
    if isinstance(names, str) or np.ndim(names) != 1 or len(names) != n:
        raise ParameterError(f"initial['states'] is {shown(names)}; it must list {n} state names")
    return places.joined(y), [chart.state_index(str(name)) for name in names]
