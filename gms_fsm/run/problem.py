"""The arguments of a simulation, checked and completed."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import integrators
from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.charts.parameters import FloatArray, as_floats, checked_array, checked_scalar, is_list
from gms_fsm.errors import ParameterError, SignalError, keyed, shown
from gms_fsm.foundation.arguments import there_are, unknown
from gms_fsm.foundation.equality import ByIdentity
from gms_fsm.gradients.sensitivities import Sensitivities
from gms_fsm.lowering.floor import floor_of
from gms_fsm.lowering.layout import BankPlaces, SystemLayout
from gms_fsm.lowering.log_columns import LogRecord
from gms_fsm.lowering.program import Program, arguments, lower
from gms_fsm.lowering.pulses import step_times, waking_times
from gms_fsm.lowering.scales import Setting, Tolerance, scales_of_system
from gms_fsm.run.settings import Settings
from gms_fsm.run.ticks import clocks_of, ticks_of
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted, mounted
from gms_fsm.systems.reading.values import numbers_of
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import REST, Corners, Formula
from gms_fsm.systems.system import System
from gms_fsm.traces.firings import Firings
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.trace import Trace
from integrators import LoopOptions

IMPLICIT = ("Radau", "BDF", "LSODA")  # methods of SciPy for stiff runs
STEPS_A_TICK = 4  # after each tick the steps begin anew
LATEST = 1e9  # s; one tick of a double is then 1e-7 s


@dataclass(frozen=True, eq=False)
class Problem:
    """A system ready to run.

    Parameters
    ----------
    what : Mounted
        What runs.
    program : Program
        Its generated program.
    t_start, t_end, last : float
        s; `last` is earlier than t_end if a sampled signal ends earlier.
    y : list of float, shape (m,)
        Initial state.
    mode : list of int, shape (n,)
        Initial states of the elements.
    options : integrators.LoopOptions
        Options of the integration.
    settings : mapping
        As recorded in the trace.
    chosen : Settings
        As given.
    initial : mapping
        As given.
    """

    what: Mounted
    program: Program
    t_start: float
    t_end: float
    last: float
    y: list[float]
    mode: list[int]
    options: LoopOptions
    settings: Mapping[str, Setting]
    chosen: Settings
    initial: Mapping[str, Any]

    @property
    def system(self) -> System:
        """What runs."""
        return self.what.system

    @property
    def model(self) -> Model:
        """The model; of a system of the user's its only contact."""
        return self.what.model

    @property
    def rig(self) -> Rig:
        """What moves it."""
        return self.what.rig

    def before_entry(self) -> tuple[list[float], list[int]]:
        """Return the state vector before any entry, and 1 for what the initial values give."""
        layout = self.program.layout
        y, _, given = _given(self.what, layout, self.initial)
        return y, [int(name in given) for name, _ in layout.y]

    def chosen_tolerances(self) -> list[float]:
        """Return the absolute tolerance of each component that was given; 0 for the others."""
        layout = self.program.layout
        none = {
            name: [0.0] * len(layout.y.all_of(name)) for name in (*layout.y.shared, *layout.y.own)
        }
        return _tolerances(layout, self.chosen.atol, none)[0]

    def trace(
        self, rows: Rows, stops: Rows, firings: Firings, derived: Sensitivities | None = None
    ) -> Trace:
        """Return the trace of a run."""
        more: Any = {"initial": self.initial, "derived": derived}
        trace = Trace(rows, stops, firings, self.what, self.settings, **more)
        vars(trace)["program"] = self.program  # it need not be generated again
        return trace

    def firings(self, records: Iterable[LogRecord]) -> Firings:
        """Return the firings of a run from its records."""
        return Firings.of(records, self.program.layout, of_system=self.what.named)

    def fired(self, t: Any, machine: Any, edge: Any, numbers: Any) -> Firings:
        """Return the firings of a run from the columns of its log."""
        layout, of_system = self.program.layout, self.what.named
        return Firings.counted(t, machine, edge, numbers, layout, of_system=of_system)

    def edge(self, machine: int, edge: int) -> tuple[BankPlaces, Transition]:
        """Return the contact of a machine and one of its edges, by their numbers in the run."""
        bank = self.program.layout.bank(machine)
        chart = self.system.contact(bank.name).chart
        return bank, chart.transitions[edge - bank.first_edge]

    @property
    def output(self) -> str:
        """Rows to keep: ``"all"``, ``"t_eval"`` or ``"end"``."""
        assert self.chosen.output is not None  # Settings fills it in
        return self.chosen.output

    @property
    def implicit(self) -> str:
        """An implicit method and the tolerances it needs, as one writes them; "" if one is used."""
        if self.chosen.method_name in IMPLICIT:
            return ""
        missing = _without_scale(self.program.layout, self.options.atol)
        return f"method=scipy.integrate.Radau{f', atol={missing}' if missing else ''}"

    @classmethod
    def of(
        cls,
        model: Model | System,
        rig: Rig | None,
        t_end: float,
        settings: Settings | None = None,
        **more: Any,
    ) -> Problem:
        """Return the start of a model on a rig, or of a system; the rest is as for `on`."""
        chosen = Settings() if settings is None else settings
        return cls.on(mounted(model, rig, chosen.held_period), t_end, chosen, **more)

    @classmethod
    def on(
        cls,
        what: Mounted,
        t_end: float,
        settings: Settings,
        *,
        t_start: float = 0.0,
        initial: Mapping[str, Any] | None = None,
        rows_at_once: int = integrators.ROWS_AT_ONCE,
        ticks_from: float | None = None,
    ) -> Problem:
        """Check the arguments of `gms_fsm.simulate`."""
        chosen, system = settings, what.system
        t_start, t_end = checked_times(t_start, t_end)
        _check_resolution(chosen, t_start, t_end)
        program = lower(system)
        scales = scales_of_system(program)
        default = scales.tolerances(chosen.rtol)
        tolerances, used = _tolerances(program.layout, chosen.atol, default)
        method = chosen.method
        if not isinstance(method, str) and min(tolerances) == 0.0:
            missing = _without_scale(program.layout, tolerances)
            raise ParameterError(
                f"method {method.__name__} needs an absolute tolerance, and the chart "
                f"gives no scale for {', '.join(missing)}",
                key=("method",),
                advice=f"give one far below the values that matter, for example atol={missing}",
            )
        options = LoopOptions(
            integrators.METHODS[method] if isinstance(method, str) else method,
            None if chosen.events == "held" else chosen.step,
            chosen.rtol,
            tolerances,
            chosen.max_step,
            scales.time,
            chosen.max_steps,
            chosen.events != "step",
            [] if chosen.output == "end" else _wanted(chosen, t_start, t_end),
            rows_at_once,
            relaxing=scales.relaxing,
        )
        last = _covered(system, t_start, t_end)
        program = with_waking_times(program, system, t_start, last)
        origin = t_start if ticks_from is None else ticks_from
        if clocks := clocks_of(system):
            program = replace(program, ticks=ticks_of(clocks, origin, t_start, last))
            most = chosen.max_steps + STEPS_A_TICK * len(program.ticks)
            options = replace(options, max_steps=most)
        initial = {} if initial is None else initial
        y, mode = _initial(what, program, t_start, initial)
        floor = _floor(system, program, tolerances, (t_start, last), y, mode)
        options = replace(options, floor=floor)
        return cls(
            what=what,
            program=program,
            t_start=t_start,
            t_end=t_end,
            last=last,
            y=y,
            mode=mode,
            options=options,
            settings=_recorded(chosen, used, t_start, t_end),
            chosen=chosen,
            initial=initial,
        )

    def with_numbers(self, what: Mounted) -> Problem:
        """Return the same start with different numbers."""
        program = replace(self.program, p=arguments(what.system))
        scales = scales_of_system(program)
        default = scales.tolerances(self.options.rtol)
        tolerances, used = _tolerances(self.program.layout, self.chosen.atol, default)
        y, _ = _initial(what, program, self.t_start, self.initial)
        floor = _floor(what.system, program, tolerances, (self.t_start, self.last), y, self.mode)
        return replace(
            self,
            what=what,
            program=program,
            y=y,
            options=replace(
                self.options,
                atol=tolerances,
                time_scale=scales.time,
                relaxing=scales.relaxing,
                floor=floor,
            ),
            settings={**self.settings, "atol": used},
        )


SOON = 1.0  # s: how far a run looks ahead whose inputs come from outside


def _floor(
    system: System,
    program: Program,
    tolerances: list[float],
    span: tuple[float, float],
    y: list[float],
    mode: list[int],
) -> list[float] | None:
    """Return what `floor_of` does; of a system with inputs what is known without them."""
    if system.inputs and min(tolerances, default=1.0) == 0.0:
        calm = replace(system, signals={**system.signals, **dict.fromkeys(system.inputs, REST)})
        program, span = lower(calm), (span[0], span[0] + SOON)
    return floor_of(program, tolerances, span, y, mode)


def _recorded(chosen: Settings, atol: Setting, t_start: float, t_end: float) -> dict[str, Setting]:
    """Return the settings as a trace records them."""
    return {
        "method": chosen.method_name,
        "step": chosen.step,
        "rtol": chosen.rtol,
        "atol": atol,
        "max_step": chosen.max_step if math.isfinite(chosen.max_step) else None,
        "max_steps": chosen.max_steps,
        "events": chosen.events,
        "engine": chosen.engine,
        "t_start": t_start,
        "t_end": t_end,
    }


def checked_times(t_start: float, t_end: float) -> tuple[float, float]:
    """Return start and end of a run, which a clock of floats can resolve."""
    t_start = checked_scalar("t_start", t_start, "finite")
    if is_list(t_end):
        raise ParameterError(
            "it must be a number",
            place="t_end",
            value=t_end,
            advice="t_eval=... is for times",
        )
    t_end = checked_scalar("t_end", t_end, "finite")
    for name, time in (("t_start", t_start), ("t_end", t_end)):
        if abs(time) > LATEST:
            raise ParameterError(
                f"beyond {LATEST:g} s time is resolved too coarsely",
                place=name,
                value=time,
                advice="give times from the start of the run",
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
                f"it is below the resolution of the clock ({tick:.2g} s here)",
                place=name,
                value=length,
                advice="give a larger value",
            )


def _wanted(chosen: Settings, t_start: float, t_end: float) -> FloatArray | None:
    """Return the requested times, if any, after checking that all lie within the run."""
    if chosen.t_eval is None:
        return None
    times: FloatArray = np.asarray(chosen.t_eval)  # increasing
    for time in (float(times[0]), float(times[-1])):
        if not t_start <= time <= t_end:
            raise ParameterError(
                f"t_eval has {time!r}, outside of t_start = {t_start!r} to t_end = {t_end!r}"
            )
    return times


def _tolerances(
    layout: SystemLayout, atol: Tolerance, default: Mapping[str, list[float]]
) -> tuple[list[float], float | dict[str, float | list[float]]]:
    """Return the absolute tolerance of each component, and how to record them in the settings."""
    places = layout.y
    if atol is not None and not isinstance(atol, Mapping):
        return [atol] * places.size, atol
    rows = {name: default[name] for name in (*places.shared, *places.own)}
    for key, given in (atol or {}).items():
        with keyed("atol", key):
            name = _component(layout, key, "atol")
            here, size = f"atol[{key!r}]", len(rows[name])
            if np.ndim(given) == 0:
                rows[name] = [checked_scalar(here, given, "> 0")] * size
            else:
                rows[name] = as_floats(checked_array(here, given, size, "> 0"))
    joined = [rows[name][i or 0] for name, i in places]
    return joined, layout.labelled(joined)


def _without_scale(layout: SystemLayout, tolerances: list[float]) -> dict[str, float]:
    """Return the components without an absolute tolerance, each with an example of one."""
    places = layout.y
    names = [*places.shared, *places.own]
    return {
        layout.label(name): 1e-12
        for name in names
        if not all(tolerances[k] for k in places.all_of(name))
    }


def _component(layout: SystemLayout, key: object, owner: str) -> str:
    """Return the name in the layout of what a user calls a component."""
    if not isinstance(key, str) or key not in layout.keys:
        known = [layout.label(name) for name in (*layout.y.shared, *layout.y.own)]
        raise unknown("key", key, known, place=owner)
    return layout.keys[key]


def with_waking_times(program: Program, system: System, t_start: float, t_end: float) -> Program:
    """Return the program with the times at which formulas jump or start to change as knots."""
    times = {
        time
        for signal in system.signals.values()
        if isinstance(signal, Formula)
        for time in waking_times(signal.tree, t_start, t_end)
    }
    if program.plan.steps:
        shared, own = numbers_of(system)
        rows = {name: as_floats(row) for name, (_, row) in own.items()}
        times |= step_times(program.plan.steps, shared, rows, t_start, t_end)
    return replace(program, knots=sorted({*program.knots, *times})) if times else program


ROUNDING = 1e-9  # of a velocity, relative to those of the bodies


def _covered(system: System, t_start: float, t_end: float) -> float:
    """Return the last time covered by all sampled signals."""
    last = t_end
    for name, signal in system.signals.items():
        if isinstance(signal, Corners) and not signal.held:
            if not signal.times[0] <= t_start < signal.times[-1]:
                raise SignalError(
                    f"signal {name!r} covers {float(signal.times[0])!r} to "
                    f"{float(signal.times[-1])!r} s, but the run starts at {t_start!r} s",
                    advice="choose t_start within the record",
                    key=("t_start",),
                )
            last = min(last, float(signal.times[-1]))
    return last


def _initial(
    what: Mounted, program: Program, t_start: float, initial: Mapping[str, Any]
) -> tuple[list[float], list[int]]:
    """Build the state vector and the modes."""
    system, layout = what.system, program.layout
    if initial == {} and _is_plain(ByIdentity(system.shape)):
        return [0.0] * layout.y.size, [0] * layout.n
    y, mode, given = _given(what, layout, initial)
    y = _entered(system, program, t_start, y, mode, given)
    _check_locks(system, program, t_start, y, mode)
    return y, mode


def _given(
    what: Mounted, layout: SystemLayout, initial: Mapping[str, Any]
) -> tuple[list[float], list[int], set[str]]:
    """Return the state vector and the modes before any entry, and what has been given."""
    system = what.system
    if not isinstance(initial, Mapping):
        raise ParameterError(
            "it must be a mapping, for example {'x': 0}", place="initial", value=initial
        )
    names: dict[str, Any] = {}
    given: dict[str, Any] = {}
    called: dict[str, Any] = {}  # as the user calls it
    for key, value in initial.items():
        contact = key.removesuffix("states").removesuffix(".") if isinstance(key, str) else ""
        if key == "states" and len(layout.banks) == 1:
            names[layout.banks[0].name] = value
        elif isinstance(key, str) and key == f"{contact}.states":
            names[system.contact(contact).name] = value
        elif key in layout.keys:
            given[layout.keys[key]] = value
            called[layout.keys[key]] = key
        else:
            reason, advice = _unknown_initial(what, layout, key, value)
            raise ParameterError(reason, advice=advice, key=("initial", key))
    y: dict[str, Any] = dict.fromkeys(layout.y.shared, 0.0)
    for each in system.sampled:
        y |= each.initial
    for name in layout.y.shared:
        if name in given:
            with keyed("initial", called[name]):
                y[name] = checked_scalar(f"initial[{name!r}]", given[name], "finite")
    for each in system.sampled:
        for name, source in each.delayed.items():
            if source in given and name not in given:
                y[name] = y[source]
    for bank, part in zip(layout.banks, system.machines, strict=True):
        for variable in bank.variables:
            start = part.chart.initial.get(variable, 0.0)
            name, label = bank.of(variable), layout.label(bank.of(variable))
            here = f"initial[{label!r}]"
            with keyed("initial", called.get(name, label)):
                values = checked_array(here, given.get(name, [start] * bank.n), None, "finite")
                if values.size != bank.n:
                    raise ParameterError(
                        f"{here} has {values.size} entries",
                        advice=f"give one number for each of the {bank.n} elements",
                    )
            y[name] = as_floats(values)
        y |= {
            name: [0.0] * bank.n
            for name in layout.y.own
            if name not in y and name.startswith(bank.of(""))
        }
    mode = list[int]()
    for bank, part in zip(layout.banks, system.machines, strict=True):
        chart = part.chart
        default = [chart.default_state.name] * bank.n
        wanted = names.get(bank.name, default)
        label = "states" if len(layout.banks) == 1 else f"{bank.name}.states"
        with keyed("initial", label):
            if isinstance(wanted, str) or np.ndim(wanted) != 1 or len(wanted) != bank.n:
                raise ParameterError(
                    f"it must list {bank.n} state names",
                    place=f"initial[{label!r}]",
                    value=wanted,
                    advice=f"the states are {', '.join(each.name for each in chart.states)}",
                )
            active = [chart.state_index(str(name)) for name in wanted]
        for level in chart.nesting.composite:
            if level.state.history and bank.of(level.last) not in given:
                leaves = (chart.states[k].name for k in active)
                y[bank.of(level.last)] = [chart.nesting.remembered(level, each) for each in leaves]
        mode += active
    return layout.y.joined(y), mode, {*given}


@functools.lru_cache(maxsize=64)
def _is_plain(key: ByIdentity[System]) -> bool:
    """Return whether systems of a shape start with 0 everywhere unless something else is given."""
    charts = [contact.chart for contact in key.it.machines]
    special = any(chart.default_state.locked or chart.initial for chart in charts)
    return not (key.it.sampled or special or _enters(key.it))


def _check_locks(
    system: System, program: Program, t_start: float, y: list[float], mode: list[int]
) -> None:
    """Refuse a start in a state that holds a velocity at 0 while this is not 0."""
    layout, out = program.layout, [0.0] * program.layout.shown.size
    locked = [
        (bank, contact.chart, state)
        for bank, contact in zip(layout.banks, system.machines, strict=True)
        for state in [contact.chart.states[i] for i in mode[bank.elements]]
        if state.locked
    ]
    if not locked:
        return
    program.ieee["values"](t_start, y, mode, program.p, program.calm, out)
    free = [body for body in system.bodies if not body.driven]
    fastest = max((abs(y[layout.y.index(body.v)]) for body in free), default=0.0)
    for bank, chart, state in locked:
        for name in chart.velocities:
            v = out[layout.shown.index(bank.of(name))]
            if not abs(v) <= ROUNDING * fastest:
                key = "states" if len(layout.banks) == 1 else f"{bank.name}.states"
                raise ParameterError(
                    f"contact {bank.name!r} starts in state {state.name!r}, which holds {name} at "
                    f"0, with {name} = {v:.6g}",
                    place="initial",
                    key=("initial", key),
                    advice=f"give velocities for which {name} is 0, or another state, for example "
                    f"initial={{{key!r}: [{_not_locked(chart)!r}]}}",
                )


def _not_locked(chart: Chart) -> str:
    """Return the name of a state that holds nothing, or of any."""
    return next((each for each in chart.states if not each.locked), chart.states[0]).name


def _enters(system: System) -> bool:
    """Return whether the default state of some chart has an entry."""
    charts = (contact.chart for contact in system.machines)
    return any(chart.assigned() for chart in charts)


def _entered(
    system: System,
    program: Program,
    t_start: float,
    y: list[float],
    mode: list[int],
    given: set[str],
) -> list[float]:
    """Perform the entry of each element's default state, as when a chart is first entered.

    What the initial values give stays.
    """
    if not _enters(system):
        return y
    layout = program.layout
    for bank, contact in zip(layout.banks, system.machines, strict=True):
        chart = contact.chart
        for name, _ in chart.assigned():
            if name in chart.velocities and 0 in mode[bank.elements]:
                raise ParameterError(
                    f"the entry of the default state {chart.states[0].name!r} sets {name!r}",
                    key=("initial",),
                    place=f"chart {chart.name!r}",
                    advice="give the initial velocity instead",
                )
    kept = [int(name in given) for name, _ in layout.y]
    new = list(y)
    program.adaptive.functions["enter"](t_start, new, [*layout.not_sliding(mode)], program.p, kept)
    return new


def _unknown_initial(
    what: Mounted, layout: SystemLayout, key: object, value: object
) -> tuple[str, str]:
    """Say what is wrong with a key of the initial values, and what to do."""
    for body in what.system.bodies:
        if body.driven and key in (body.v, f"{body.name}.v"):
            whose = (
                "the rig prescribes the velocity"
                if body.velocity == "v"
                else (f"the velocity of {body.name} is given")
            )
            return f"initial has {key!r} = {shown(value)}, but {whose}", "leave it out"
    known = [layout.label(name) for name in (*layout.y.shared, *layout.y.own)]
    known += ["states"] * (len(layout.banks) == 1)
    if what.named:
        known += [*layout.keys, *(f"{bank.name}.states" for bank in layout.banks)]
    return f"initial has the key {shown(key)}", there_are(key, known, every=True)
