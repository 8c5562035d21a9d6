"""simulate(): a model on a rig, run by its state machines."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import integrators
from gms_fsm.errors import (
    LivelockError,
    NotFiniteError,
    ParameterError,
    SignalEndError,
    SignalError,
    SimulationError,
    StepSizeError,
)
from gms_fsm.expression import rough_points
from gms_fsm.machines import ElementMachines, IfElse, MachineEngine
from gms_fsm.models import Model
from gms_fsm.parameters import as_floats, checked_array, checked_scalar
from gms_fsm.program import Program, lower
from gms_fsm.rigs import Rig
from gms_fsm.signals import Corners
from gms_fsm.trace import Rows, Trace, log_of
from integrators import Arc, Firing, HybridError, Livelock, NotFinite, Options, StepTooSmall

__all__ = ["Moment", "Run", "simulate"]

LATEST = 1e9  # s; one tick of a double is then 1e-7 s


def simulate(
    model: Model,
    rig: Rig,
    t_end: float,
    *,
    t_start: float = 0.0,
    method: str | type[Any] = "dp45",
    step: float | None = None,
    rtol: float = 1e-6,
    atol: float = 1e-9,
    max_step: float = math.inf,
    events: str = "located",
    engine: str | ElementMachines = "machines",
    t_eval: ArrayLike | None = None,
    initial: Mapping[str, Any] | None = None,
    progress: Callable[[Moment], object] | None = None,
) -> Trace:
    """Run a friction model on a rig.

    The driver asks the machines, freezes their states, integrates until a watched comparison
    changes its truth, and asks again.

    Parameters
    ----------
    model : GMS, LuGre or ChartModel
        What rubs.
    rig : Prescribed, Slider or PulledSlider
        What it is mounted on.
    t_end, t_start : float
        s.
    method : {"dp45", "bs23", "rk4", "heun", "euler"} or OdeSolver class
        dp45 and bs23 choose their steps, the others need `step`. Any `scipy.integrate.OdeSolver`
        class (Radau, BDF, LSODA ...) for stiff cases.
    step : float, optional
        Fixed steps of this length [s], the last one cut to t_end; at a located crossing a step is
        cut and the grid is met again after it. A SciPy class is led from grid point to grid point.
    rtol, atol : float
        Tolerances of adaptive steps; the error is the largest component's.
    max_step : float
        Longest adaptive step, s. Accuracy does not need it.
    events : {"located", "step"}
        ``"located"`` finds the place of each switch. ``"step"`` looks at the guards once at the end
        of a step, at most one edge per element, like an if-else in a block diagram: it loses
        switches and is here to show that. It needs `step` or a finite `max_step`.
    engine : {"machines", "ifelse"} or ElementMachines
        Who decides: the `transitions` machines, the generated if-else text, or machines of your own
        with callbacks.
    t_eval : array_like, shape (m,), optional
        Wanted times [s], increasing; the trace has exactly these rows. All accepted steps and
        micro-steps otherwise.
    initial : mapping, optional
        Any of ``z`` (n,) [m], ``states`` (n,) names, ``v`` [m/s] (not with a prescribed velocity)
        and ``x`` [m].
    progress : callable, optional
        Called now and then with the `Moment` reached.

    Returns
    -------
    Trace
        Rows, transition log and what they were made from.

    Raises
    ------
    ParameterError, SignalError
        If an argument breaks its rule.
    SimulationError
        If the run cannot go on (`LivelockError`, `StepSizeError`, `NotFiniteError`,
        `SignalEndError`); its ``trace`` holds the part before.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2*sin(2*pi*t/20)"), 61.0)
    >>> len(trace.transitions)
    48
    """
    run = Run(
        model, rig, t_end, t_start=t_start, method=method, step=step, rtol=rtol, atol=atol,
        max_step=max_step, events=events, engine=engine, t_eval=t_eval, initial=initial,
    )  # fmt: skip
    while run.advance():
        if progress is not None:
            progress(Moment(run.recorder))
    return run.trace()


class Run:
    """A simulation under way: what `simulate` drives to its end and a session step by step.

    Parameters are those of `simulate`.

    Parameters
    ----------
    model, rig, t_end, t_start, method, step, rtol, atol, max_step, events, engine, t_eval, initial
        See `simulate`.
    rows_at_once : int
        How many steps `advance` takes at most; 1 to stop at every row.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> run = Run(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0,
    ...           rows_at_once=1)
    >>> run.advance(), len(run.trace())
    (True, 1)
    """

    def __init__(
        self,
        model: Model,
        rig: Rig,
        t_end: float,
        *,
        t_start: float = 0.0,
        method: str | type[Any] = "dp45",
        step: float | None = None,
        rtol: float = 1e-6,
        atol: float = 1e-9,
        max_step: float = math.inf,
        events: str = "located",
        engine: str | ElementMachines = "machines",
        t_eval: ArrayLike | None = None,
        initial: Mapping[str, Any] | None = None,
        rows_at_once: int = integrators.ROWS_AT_ONCE,
    ) -> None:
        t_start = checked_scalar("t_start", t_start, "finite")
        t_end = checked_scalar("t_end", t_end, "finite")
        for name, time in (("t_start", t_start), ("t_end", t_end)):
            if abs(time) > LATEST:
                raise ParameterError(
                    f"{name} is {time!r} s; beyond {LATEST:g} s the clock is too coarse"
                )
        if t_end <= t_start:
            raise ParameterError(f"t_end is {t_end!r}, t_start is {t_start!r}; t_end must be later")
        options = _options(
            method, step, rtol, atol, max_step, events, t_eval, t_start, t_end, rows_at_once
        )
        self.t_end, self.last = t_end, _covered(rig, t_start, t_end)
        program = lower(model, rig)
        y, mode = _initial(model, rig, {} if initial is None else initial)
        switch, engine_name = _engine(engine, model, program, mode)
        settings: dict[str, str | float | None] = {
            "method": method if isinstance(method, str) else method.__name__,
            "step": step, "rtol": rtol, "atol": atol,
            "max_step": max_step if math.isfinite(max_step) else None,
            "events": events, "engine": engine_name, "t_start": t_start, "t_end": t_end,
        }  # fmt: skip
        self.recorder = _Recorder(model, rig, program, settings, wanted=t_eval is not None)
        self.recorder.start(t_start, y, mode)
        self.happening: Arc | Firing | integrators.Stop | None = None  # the latest
        self.happenings = integrators.run(
            _system(program), switch, t_start, y, mode, self.last, options
        )

    def advance(self) -> bool:
        """Let the next thing happen.

        Returns
        -------
        bool
            False when the run has reached its end.

        Raises
        ------
        SimulationError
            If it cannot go on.
        """
        recorder = self.recorder
        try:
            happening = next(self.happenings, None)
        except HybridError as error:
            raise _explained(error, recorder) from None
        except SignalError as error:
            raise SimulationError(
                f"{error}; the run up to there is kept", recorder.trace()
            ) from None
        if happening is None:
            if self.last < self.t_end:
                raise SignalEndError(
                    f"a sampled signal ends at t = {self.last!r} s, before t_end = {self.t_end!r} "
                    f"s; give a longer record or t_end <= {self.last!r}; the run up to there is "
                    "kept",
                    recorder.trace(),
                )
            return False
        self.happening = happening
        recorder.take(happening)
        return True

    def trace(self) -> Trace:
        """Return the run so far."""
        return self.recorder.trace()


def _engine(
    engine: str | ElementMachines, model: Model, program: Program, mode: list[int]
) -> tuple[MachineEngine | IfElse, str]:
    if isinstance(engine, ElementMachines):
        if engine.model is not model:
            raise ParameterError("engine: these ElementMachines were made for another model")
        return MachineEngine(engine, program, mode), "machines"
    if engine == "machines":
        return MachineEngine(ElementMachines(model), program, mode), engine
    if engine == "ifelse":
        return IfElse(program), engine
    raise ParameterError(
        f"engine is {engine!r}; it must be 'machines', 'ifelse' or an ElementMachines"
    )


def _system(program: Program) -> integrators.System:
    functions = program.ieee
    return integrators.System(
        flow=functions["flow"],
        flow_live=functions["flow_live"],
        arm=functions["arm"],
        margins=functions["margins"],
        p=program.p,
        held=program.held,
        strict=program.strict,
        relations=program.relations,
        knots=program.knots,
        jumps=program.jumps,
    )


# --------------------------------------------------------------------------- checking
def _options(
    method: str | type[Any],
    step: float | None,
    rtol: float,
    atol: float,
    max_step: float,
    events: str,
    t_eval: ArrayLike | None,
    t_start: float,
    t_end: float,
    rows_at_once: int,
) -> Options:
    chosen: Any = method
    if isinstance(method, str):
        if method not in integrators.METHODS:
            raise ParameterError(
                f"method is {method!r}; it must be one of {', '.join(integrators.METHODS)}, or a "
                "scipy.integrate.OdeSolver class"
            )
        chosen = integrators.METHODS[method]
        if step is None and not chosen.adaptive:
            raise ParameterError(
                f"method {method!r} has no error estimate; give step=..., or use 'dp45' or 'bs23'"
            )
    elif not (isinstance(method, type) and hasattr(method, "TOO_SMALL_STEP")):
        raise ParameterError(
            f"method is {method!r}; it must be a name ({', '.join(integrators.METHODS)}) or a "
            "scipy.integrate.OdeSolver class"
        )
    if step is not None:
        step = checked_scalar("step", step, "> 0")
    checked_scalar("rtol", rtol, "> 0")
    checked_scalar("atol", atol, "> 0")
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
        raise ParameterError(f"events is {events!r}; it must be 'located' or 'step'")
    if events == "step" and step is None and not math.isfinite(max_step):
        raise ParameterError(
            "events='step' looks at the guards once a step: give step=... or a finite max_step"
        )
    times = None
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
    return Options(chosen, step, rtol, atol, max_step, events == "located", times, rows_at_once)


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
            f"initial is {initial!r}; it must be a mapping, for example {{'x': 0}}"
        )
    for name in initial:
        if name not in known:
            raise ParameterError(
                f"initial has the key {name!r}; known are {', '.join(map(repr, known))}"
            )
    y = [checked_scalar("initial['x']", initial.get("x", 0.0), "finite")]
    if rig.acceleration is not None:
        y.append(checked_scalar("initial['v']", initial.get("v", 0.0), "finite"))
    elif "v" in initial:
        raise ParameterError(
            f"initial has 'v' = {initial['v']!r}, but the rig prescribes the velocity; leave it out"
        )
    for name in chart.variables:
        values = checked_array(f"initial[{name!r}]", initial.get(name, [0.0] * n), None, "finite")
        if values.size != n:
            raise ParameterError(
                f"initial[{name!r}] has {values.size} entries; the model has {n} elements"
            )
        y += as_floats(values)
    names: Any = initial.get("states", [chart.default_state.name] * n)
    if isinstance(names, str) or np.ndim(names) != 1 or len(names) != n:
        raise ParameterError(f"initial['states'] is {names!r}; it must list {n} state names")
    return y, [chart.state_index(str(name)) for name in names]


# --------------------------------------------------------------------------- recording
@dataclass(frozen=True, eq=False)
class _Columns:
    """Growing lists behind one `Rows`."""

    t: list[float]
    microstep: list[int]
    y: list[list[float]]
    mode: list[tuple[int, ...]]

    def add(self, t: float, microstep: int, y: list[float], mode: tuple[int, ...]) -> None:
        self.t.append(t)
        self.microstep.append(microstep)
        self.y.append(y)
        self.mode.append(mode)

    def rows(self, size: int, n: int) -> Rows:
        return Rows(
            np.array(self.t, dtype=np.float64),
            np.array(self.microstep, dtype=np.int64),
            np.array(self.y, dtype=np.float64).reshape(len(self.t), size),
            np.array(self.mode, dtype=np.int64).reshape(len(self.t), n),
        )


class _Recorder:
    """Keeps what the loop yields."""

    def __init__(
        self,
        model: Model,
        rig: Rig,
        program: Program,
        settings: Mapping[str, str | float | None],
        wanted: bool,
    ) -> None:
        self.model, self.rig, self.program, self.settings = model, rig, program, settings
        self.wanted = wanted
        self.rows = _Columns([], [], [], [])
        self.stops = _Columns([], [], [], [])
        self.log: list[tuple[Any, ...]] = []
        self.latest: tuple[float, list[float], tuple[int, ...]]
        self.size = 2 + (2 + len(model.chart.variables)) * model.n

    def start(self, t: float, y: list[float], mode: list[int]) -> None:
        """Keep the initial state as the first stop."""
        self.latest = (t, y, tuple(mode))
        if self.wanted:
            self.stops.add(t, 0, list(y), tuple(mode))

    def take(self, happening: Arc | Firing | integrators.Stop) -> None:
        """Keep one happening."""
        match happening:
            case Arc(t=times, y=states, mode=mode):
                self.rows.t.extend(times)
                self.rows.microstep.extend([0] * len(times))
                self.rows.y.extend(states)
                self.rows.mode.extend([mode] * len(times))
                self.latest = (times[-1], states[-1], mode)
            case Firing():
                side = self.stops if self.wanted else self.rows
                side.add(happening.t, happening.microstep, happening.y, happening.mode)
                self.log.append(self._record(happening))
                self.latest = (happening.t, happening.y, happening.mode)
            case integrators.Stop(t=t, y=y, mode=mode):
                if self.wanted:
                    self.stops.add(t, 0, y, mode)
                self.latest = (t, y, mode)

    def _record(self, firing: Firing) -> tuple[Any, ...]:
        chart, i = self.model.chart, firing.machine
        edge = chart.transitions[firing.edge]
        before, after = (
            self.observe(firing.t, y, mode)
            for y, mode in ((firing.y_before, firing.mode_before), (firing.y, firing.mode))
        )
        z = firing.y_before[self.program.first + i]
        return (
            firing.t, i, edge.name, edge.source, edge.target,
            z, before[0], before[2 + i], before[1], after[1],
        )  # fmt: skip

    def observe(self, t: float, y: list[float], mode: Sequence[int]) -> list[float]:
        """Return v, F, s, F_i, dz of a state."""
        out = [0.0] * self.size
        self.program.ieee["observe"](t, y, mode, self.program.p, out)
        return out

    def trace(self) -> Trace:
        """Return all that was kept."""
        size, n = self.program.size, self.model.n
        rows = self.rows.rows(size, n)
        stops = self.stops.rows(size, n) if self.wanted else rows
        return Trace(rows, stops, log_of(self.log), self.model, self.rig, self.settings)


@dataclass(frozen=True, eq=False)
class Moment:
    """The latest row of a running simulation; computed only when asked."""

    _recorder: _Recorder

    @property
    def t(self) -> float:
        """Time, s."""
        return self._recorder.latest[0]

    @property
    def states(self) -> list[str]:
        """Active state of each element."""
        states = self._recorder.model.chart.states
        return [states[mode].name for mode in self._recorder.latest[2]]

    @property
    def values(self) -> dict[str, Any]:
        """``v`` [m/s] and ``F`` [N]; ``z`` and ``s`` [m], one an element."""
        recorder, n = self._recorder, self._recorder.model.n
        t, y, mode = recorder.latest
        seen = recorder.observe(t, y, mode)
        first = recorder.program.first
        return {"v": seen[0], "F": seen[1], "z": y[first : first + n], "s": seen[2 : 2 + n]}


# --------------------------------------------------------------------------- explaining
def _explained(error: HybridError, recorder: _Recorder) -> SimulationError:
    """Put an error of the loop into the words of the model."""
    trace = recorder.trace()
    chart, kept = recorder.model.chart, "the run up to there is kept in .trace"
    scene = f"t = {error.t!r} s"
    if isinstance(error, NotFinite):
        return NotFiniteError(
            f"a signal or a flow is not finite at or just after {scene} "
            f"(x, v, z ... = {[float(f'{u:.6g}') for u in error.y]}): {error}; look at the signals "
            f"and parameters there; {kept}",
            trace,
        )
    if isinstance(error, StepTooSmall):
        return StepSizeError(
            f"the step size fell under the resolution of the clock at {scene}: the flow changes "
            "too fast there for this method; try a stiff method (method=scipy.integrate.Radau), a "
            f"larger rtol/atol, or look for a singular parameter; {kept}",
            trace,
        )
    if not isinstance(error, Livelock):
        return SimulationError(f"{error} at {scene}; {kept}", trace)
    seen = recorder.observe(error.t, error.y, error.mode)

    def values(i: int) -> str:
        z = error.y[recorder.program.first + i]
        return f"z = {z:.6g}, s = {seen[2 + i]:.6g}, v = {seen[0]:.6g}"

    if error.machine is not None and error.edge is not None:
        edge = chart.transitions[error.edge]
        return LivelockError(
            f"element {error.machine + 1} switched {integrators.MOST_SWITCHES} times at {scene}, "
            f"last by {edge.name!r} from {edge.source} to {edge.target} ({values(error.machine)}): "
            f"guard [{edge.guard}] and a way back hold together; make the guards exclude each "
            f"other; {kept}",
            trace,
        )
    rough = [
        i
        for i, state in enumerate(error.mode)
        if any(rough_points(chart.flows[chart.states[state].name, u]) for u in chart.variables)
    ]
    i = rough[0] if rough else 0
    state = chart.states[error.mode[i]]
    edges = ", ".join(f"{edge.name} [{edge.guard}]" for _, edge in chart.leaving(state.name))
    return LivelockError(
        f"{' and '.join(error.relations)} changed {integrators.MOST_SWITCHES} times at {scene}: "
        f"element {i + 1} is in {state.name} ({values(i)}), its flow pushes back on both sides and "
        f"no edge leaves ({edges or 'it has none'}): a sliding mode (Filippov); try the signed "
        f"law, a larger v_c, or other parameters; {kept}",
        trace,
    )
