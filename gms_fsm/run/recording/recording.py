"""Recording of a run, and the wording of its errors."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import integrators
from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.language import rough_points
from gms_fsm.lowering.layout import SystemLayout
from gms_fsm.lowering.log_columns import CONTACT, LogRecord
from gms_fsm.run.machines import Interference
from gms_fsm.run.problem import STEPS_A_TICK, Problem
from gms_fsm.run.recording.moment import Place, Recording, scope_of
from gms_fsm.run.recording.not_finite import culprit, state_there
from gms_fsm.traces.failures import (
    CallbackError,
    LivelockError,
    LockError,
    NotFiniteError,
    NotUniqueError,
    SignalEndError,
    SimulationError,
    StepLimitError,
    StepSizeError,
)
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.scope import Scope
from gms_fsm.traces.trace import Trace
from integrators import (
    Arc,
    Entangled,
    Firing,
    HybridError,
    Livelock,
    NotFinite,
    Refused,
    Slide,
    StepTooSmall,
    TooManySteps,
)

SHRINKING = 4  # intervals that must shrink alike before they are said to shrink without end
STEEP = 0.01  # ratio of each second interval below which there are fewer, and fewer will do
CLEAR = 1e6  # ticks of the clock: shorter intervals are known too roughly
ALIKE = 0.01  # largest difference of their ratios, relative to what is missing to 1


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

    def rows(self, layout: SystemLayout) -> Rows:
        count = min(map(len, vars(self).values()))  # Ctrl-C may arrive between two columns
        return Rows(
            np.array(self.t[:count], dtype=np.float64),
            np.array(self.microstep[:count], dtype=np.int64),
            np.array(self.y[:count], dtype=np.float64).reshape(count, layout.y.size),
            np.array(self.mode[:count], dtype=np.int64).reshape(count, layout.modes),
        )


class Recorder:
    """Records what the loop yields.

    Parameters
    ----------
    start : Problem
        The run.
    count : callable, optional
        ``count(t, y, mode)``, called for every row instead of keeping it.
    """

    def __init__(
        self,
        start: Problem,
        count: Callable[[float, list[float], Sequence[int]], None] | None = None,
    ) -> None:
        self.start, self.count = start, count
        self.rows = _Columns([], [], [], [])
        self.stops = _Columns([], [], [], [])
        self.log: list[LogRecord] = []
        mode = start.program.layout.not_sliding(start.mode)
        self.latest = start.t_start, start.y, mode
        if start.output == "t_eval":
            self.stops.add(start.t_start, 0, list(start.y), mode)

    def take(self, event: integrators.Event) -> None:
        """Record one event."""
        output = self.start.output
        match event:
            case Arc(t=times, y=states, mode=mode):
                if self.count is None:
                    self.rows.t.extend(times)
                    self.rows.microstep.extend([0] * len(times))
                    self.rows.y.extend(states)
                    self.rows.mode.extend([mode] * len(times))
                else:
                    for t, y in zip(times, states, strict=True):
                        self.count(t, y, mode)
                if times:
                    self.latest = (times[-1], states[-1], mode)
            case Firing() | Slide():
                # The log first: no row may show a firing that is not in it.
                if isinstance(event, Firing):
                    self.log.append(self._record(event))
                if self.count is not None:
                    self.count(event.t, event.y, event.mode)
                if output != "end":
                    side = self.stops if output == "t_eval" else self.rows
                    side.add(event.t, event.microstep, event.y, event.mode)
                self.latest = (event.t, event.y, event.mode)
            case integrators.Stop(t=t, y=y, mode=mode):
                if output == "t_eval":
                    self.stops.add(t, 0, y, mode)
                self.latest = (t, y, mode)

    def around(self, t: float) -> tuple[Place, Place | None]:
        """Return the last row at or before a time, and the next one."""
        rows, mode = self.rows, self.start.program.layout.not_sliding(self.start.mode)
        row = bisect_right(rows.t, t) - 1
        places = [
            (rows.t[i], rows.y[i], rows.mode[i]) for i in (row, row + 1) if 0 <= i < len(rows.t)
        ]
        if row < 0:
            places.insert(0, (self.start.t_start, list(self.start.y), mode))
        return places[0], (*places, None)[1]

    def firings(self, after: int) -> list[LogRecord]:
        """Return the records of the log from a number on."""
        return self.log[after:]

    def state(self) -> dict[str, Any]:
        """Return the contents as arrays, for a checkpoint."""
        layout = self.start.program.layout
        tables = {"rows": self.rows, "stops": self.stops}
        kept = {
            f"{name}_{column}": values
            for name, table in tables.items()
            for column, values in vars(table.rows(layout)).items()
        }
        return kept | {"log": np.asarray(self.start.firings(self.log).records)}

    def restore(
        self, state: Mapping[str, Any], latest: tuple[float, list[float], tuple[int, ...]]
    ) -> None:
        """Restore what `state` returned, and the state reached."""
        for name in ("rows", "stops"):
            t, microstep, y, mode = (
                state[f"{name}_{column}"].tolist() for column in ("t", "microstep", "y", "mode")
            )
            setattr(self, name, _Columns(t, microstep, y, [tuple(row) for row in mode]))
        self.log = [LogRecord(*record) for record in state["log"].tolist()]
        self.latest = latest

    def _record(self, firing: Firing) -> LogRecord:
        start = self.start
        bank, edge = start.edge(firing.machine, firing.edge)
        i, contact = firing.machine - bank.first, start.system.contact(bank.name)
        before, after = (
            Scope.of(contact, start.program, firing.seen, y, mode, bank.name)
            for y, mode in ((firing.y_before, firing.mode_before), (firing.y, firing.mode))
        )
        return LogRecord(
            t=firing.t,
            element=i,
            edge=edge.name,
            source=edge.source,
            target=edge.target,
            z=before.z[i] if bank.variables else math.nan,
            v=before.v,
            s=before.s[i],
            F_before=before.F,
            F_after=after.F,
            contact=start.what.whose(bank.name),
        )

    def trace(self) -> Trace:
        """Return the trace of all recorded data."""
        start = self.start
        layout = start.program.layout
        if start.output == "end":
            self.rows = _Columns([], [], [], [])
            t, y, mode = self.latest
            self.rows.add(t, 0, y, mode)
        rows = self.rows.rows(layout)
        stops = self.stops.rows(layout) if start.output == "t_eval" else rows
        return start.trace(rows, stops, start.firings(self.log))


# --------------------------------------------------------------------------- wording of errors
def explained(error: HybridError, recorder: Recording) -> SimulationError:
    """Translate an error of the loop into the terms of the model."""
    trace, start = recorder.trace(), recorder.start
    if isinstance(error, NotFinite):
        return NotFiniteError(
            f"{culprit(start, error)} ({state_there(start, error)}): {error}",
            trace,
            t=error.t,
            advice="look at the signals and parameters there",
        )
    if isinstance(error, StepTooSmall):
        stiff = f"try a stiff method ({start.implicit}), " if start.implicit else "give "
        return StepSizeError(
            "the step size fell below the resolution of the clock: the flow changes too fast for "
            "this method",
            trace,
            t=error.t,
            advice=f"{stiff}a larger rtol/atol, or look for a singular parameter",
        )
    if isinstance(error, TooManySteps):
        reason, advice = _slow(recorder)
        ticks = len(start.program.ticks)
        besides = f", besides {STEPS_A_TICK} for each of {ticks:,} ticks," if ticks else ""
        return StepLimitError(
            f"the run has taken max_steps = {start.chosen.max_steps} steps{besides} before "
            f"reaching t_end = {start.t_end!r} s{reason}",
            trace,
            t=error.t,
            advice=advice,
        )
    if isinstance(error, Refused):
        return _refused(error, start, trace)
    if isinstance(error, Entangled):
        names = start.program.surface_names
        crossing = " and ".join(f"{names[k]} = 0" for k in error.surfaces)
        if len(error.surfaces) == 1:
            return NotUniqueError(
                f"it starts at {crossing}, from where the flows on both sides lead away: where it "
                "goes is not unique",
                trace,
                t=error.t,
                advice="start on one side, or look at the sign of a parameter",
            )
        return NotUniqueError(
            f"the motion is pushed onto the surfaces {crossing} at once, and they depend on each "
            "other: how it slides along where they cross is not unique",
            trace,
            t=error.t,
            advice="separate the guards of one of them by a gap, or put both switches into one "
            "chart",
        )
    if not isinstance(error, Livelock):
        return SimulationError(str(error), trace, t=error.t)
    return _livelock(error, start, trace)


def _refused(error: Refused, start: Problem, trace: Trace) -> LockError:
    """Say which lock would take a velocity, or cannot let go of it."""
    bank = start.program.layout.bank(error.machine)
    chart = start.system.contact(bank.name).chart
    v = scope_of(start, error.t, error.y, error.mode, bank.name).v
    if error.edge is None:
        state = chart.states[error.mode[error.machine]].name
        return LockError(
            f"an impulse has moved it to v = {v:.6g} m/s, and no edge leaves its locked state "
            f"{state!r}",
            trace,
            t=error.t,
            place=f"contact {bank.name!r}",
            advice="give the state an edge whose guard holds for a large F of either sign",
        )
    edge = chart.transitions[error.edge - bank.first_edge]
    return LockError(
        f"its velocity has jumped to {v:.6g} m/s at this instant, and to lock the contact would "
        "take this velocity away",
        trace,
        t=error.t,
        place=f"contact {bank.name!r}, edge {edge.name!r}",
        advice=f"add an edge after it that leaves {edge.source!r} for the state of the opposite "
        "motion with the same guard, or, if it takes the impulse on purpose, "
        f"Transition({edge.name!r}, ..., impulse=True)",
    )


def _livelock(error: Livelock, start: Problem, trace: Trace) -> LivelockError:
    """Say which element switches without progress, and why."""
    layout, machine = start.program.layout, error.machine
    if machine is None:
        machine = _pushed_back(error, start)
    bank = layout.bank(machine)
    i, chart = machine - bank.first, start.system.contact(bank.name).chart
    scope = scope_of(start, error.t, error.y, error.mode, bank.name)
    z = {chart.variables[0]: scope.z[i]} if chart.variables else {}
    s = {"s": scope.s[i]} if "s" in chart.inputs and chart.velocities else {}
    v = {"v": scope.v} if chart.velocities else {}
    shown = ", ".join(f"{name} = {value:.6g}" for name, value in {**z, **s, **v}.items())
    values = f" ({shown})" if shown else ""
    place = start.what.element(bank.name, i)
    if error.machine is not None:
        log = trace.transitions
        mine = log.element == i
        if len(layout.banks) > 1:
            mine &= log.contact == bank.name
        taken = log[mine][-error.times :]
        last = taken[-1]
        guard = next(edge.guard for edge in chart.transitions if edge.name == last.edge)
        time = float(last.t - taken[0].t)
        shrinking = _shrinking(log[mine].t)
        if time == 0.0:
            cause = f"guard [{guard}] {_opposite_edge(chart, taken)} hold together"
            advice = "make the guards exclude each other"
        elif shrinking is None:
            cause = f"the flows on both sides of guard [{guard}] push back across it (chattering)"
            advice = "separate the guards of the two directions by a gap"
        else:
            factor, end = shrinking
            cause = (
                f"the intervals between switches shrink, each to {factor:.4g} of the one before, "
                f"and end at t = {end:.9g} s (Zeno): a state of rest is missing"
            )
            advice = (
                "add a locked state that is entered where the speed is below a rest speed, and left"
                " by a force, as in the chart 'end-stop'"
            )
        return LivelockError(
            f"switched {len(taken)} times{f' in {time:.3g} s' if time else ''}, "
            f"last by {str(last.edge)!r} from {last.source} to {last.target}"
            f"{values}: {cause}",
            trace,
            t=error.t,
            place=place,
            advice=advice,
        )
    state = chart.states[error.mode[machine]]
    edges = ", ".join(f"{edge.name} [{edge.guard}]" for _, edge in chart.leaving(state.name))
    return LivelockError(
        f"{' and '.join(error.relations)} changed {error.times} times: "
        f"the element is in {state.name}{values}, its flow pushes back on both sides, "
        f"no edge leaves ({edges or 'it has none'}), and no value of the sign between -1 and 1 "
        f"holds it there",
        trace,
        t=error.t,
        place=place,
        advice=f"look at the parameters and at the flow of {state.name}",
    )


def _shrinking(times: FloatArray) -> tuple[float, float] | None:
    """Return the factor by which the intervals between times shrink, and where they end.

    None if they do not shrink. Two in turn may have two lengths (a hit on either side), so each is
    compared with the last but one. The shortest are no guide: rounding decides when they end.
    """
    times = np.unique(times)
    gaps = np.diff(times)
    clear = np.flatnonzero(gaps > CLEAR * np.spacing(times[1:]))
    for last in clear[:2:-1].tolist():  # rounding of the state blurs the shortest
        seen = gaps[max(last - SHRINKING, 0) : last + 1]
        ratios = seen[2:] / seen[:-2]
        square = float(np.median(ratios))
        largest = 1.0 if len(seen) > SHRINKING else STEEP
        alike = square < largest and np.abs(ratios - square).max() < ALIKE * (1.0 - square)
        if alike and gaps[last:].max() == gaps[last]:
            rest = (gaps[last - 1] + gaps[last]) * square / (1.0 - square)
            return math.sqrt(square), float(times[last + 1] + rest)
    return None


def _pushed_back(error: Livelock, start: Problem) -> int:
    """Return the first machine whose flow jumps or has a corner; the first one if none has."""
    for bank in start.program.layout.banks:
        chart = start.system.contact(bank.name).chart
        for i, state in enumerate(error.mode[bank.elements]):
            flows = (chart.flows[chart.states[state].name, name] for name in chart.variables)
            if any(rough_points(flow) for flow in flows):
                return bank.first + i
    return 0


def _slow(recorder: Recording) -> tuple[str, str]:
    """Return a reason for a run's many steps, as far as it can be determined, and advice."""
    log = recorder.trace().transitions
    most = recorder.start.options.max_steps
    if 10 * len(log) > most:
        whose = log.contact.tolist() if CONTACT in log.dtype.names else ["element"] * len(log)
        pairs = Counter(zip(whose, log.element.tolist(), strict=True))
        (who, element), count = pairs.most_common(1)[0]
        return (
            f": {who} {element + 1} has switched {count} times (chattering)",
            "separate its guards for the two directions by a gap, or give a larger max_steps",
        )
    start, more = recorder.start, "give a larger max_steps, a larger rtol"
    return "", f"{more}, or for a stiff run {start.implicit}" if start.implicit else more


def interference_error(error: Interference, recorder: Recording) -> CallbackError:
    """Return an error with the trace for a callback that changed something."""
    return CallbackError(
        error.reason, recorder.trace(), t=error.t, place=error.place, advice=error.advice
    )


def _opposite_edge(chart: Chart, taken: Any) -> str:
    """Name the other edge of an endless back and forth."""
    other = next((edge for edge in chart.transitions if edge.name == taken[-2].edge), None)
    if len(set(taken.edge.tolist())) != 2 or other is None:
        return "and a way back"
    return f"and that of {other.name}, [{other.guard}],"


def check_end(recorder: Recording) -> None:
    """Raise an error if a sampled signal ended before the run was meant to."""
    last, t_end = recorder.start.last, recorder.start.t_end
    if last < t_end:
        raise SignalEndError(
            f"it ends before t_end = {t_end!r} s",
            recorder.trace(),
            t=last,
            place="a sampled signal",
            advice=f"give a longer record or t_end <= {last!r}",
        )
