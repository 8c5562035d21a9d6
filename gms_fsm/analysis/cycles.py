"""limit_cycle(): a periodic motion found by Newton's method, and whether it is stable."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from gms_fsm.analysis.energy import EnergyBalance, balance_of
from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.errors import ExpressionError, ParameterError
from gms_fsm.foundation.arguments import checked_kind, refusing
from gms_fsm.foundation.extras import has_machine_code
from gms_fsm.gradients.directions import INITIAL, Directions
from gms_fsm.gradients.linear import Linear
from gms_fsm.lowering.observing import armed
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.run.simulate import check_derivable, simulated
from gms_fsm.run.ticks import clocks_of
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted, mounted
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.system import System
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.trace import Trace

__all__ = ["LimitCycle", "limit_cycle"]

MOST_ITERATIONS = 15
RESIDUAL = 1e-10  # of the size of each component
AT_REST = 1e-6  # of the sizes: what moves by less in a period stands still
INVARIANT = 1e-7  # a rate that changes by less does not change
PERIODS = 30  # that a driven system runs before the search, if nothing near is given
SAMPLES = 60  # rows at which it is asked what the motion depends on
LAST = 60  # switches among which a return is looked for
ROUGHLY = 0.02  # a return of this part of the size is one, if none is better


@dataclass(frozen=True, eq=False, repr=False)
class LimitCycle:
    """A periodic motion.

    Parameters
    ----------
    period : float
        s.
    multipliers : ndarray of complex
        Of the linear map over one period, the largest first: what becomes of a small deviation.
        Without that of a shift along the cycle, which is 1, and without those of quantities on
        which nothing depends, such as the distance a belt has run.
    trace : Trace
        One period, with its switches; it begins within the longest arc.
    residual : float
        By what the state does not return, relative to the sizes of its components.
    iterations : int
        Runs that Newton's method took.
    driven : bool
        Whether the period is that of what drives the system.

    Examples
    --------
    >>> from gms_fsm import Belt, ChartModel, simulate
    >>> from gms_fsm.charts import CHARTS
    >>> pad = ChartModel(CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0})
    >>> cycle = limit_cycle(pad, Belt(1.0, 2.0, 0.1),
    ...                     near=simulate(pad, Belt(1.0, 2.0, 0.1), 40.0))
    >>> cycle, cycle.stable
    (<LimitCycle: period 7.61 s, 2 switches, stable>, True)
    """

    period: float
    multipliers: NDArray[np.complex128]
    trace: Trace
    residual: float
    iterations: int
    driven: bool
    states: FloatArray = field(repr=False)  # at the start

    @cached_property
    def energy(self) -> EnergyBalance:
        """What one period takes, and from where."""
        return balance_of(self.trace)

    @property
    def stable(self) -> bool:
        """Whether every small deviation dies out."""
        return bool((np.abs(self.multipliers) < 1.0).all())

    def __repr__(self) -> str:
        count = len(self.trace.transitions)
        word = "stable" if self.stable else "unstable"
        return f"<LimitCycle: period {self.period:.3g} s, {count} switches, {word}>"


@refusing(rig="limit_cycle(model, rig, near=trace), or limit_cycle(system, near=trace)")
def limit_cycle(
    model: Model | System,
    rig: Rig | None = None,
    *,
    near: Trace | None = None,
    period: float | None = None,
    section: str | None = None,
    initial: Mapping[str, Any] | None = None,
    settings: Settings | None = None,
    **options: Unpack[SettingOptions],
) -> LimitCycle:
    """Find a periodic motion of a system, or of a model on a rig, by Newton's method.

    The derivative of the state after one period by that at its start is exact, through all
    switches. It also tells whether the motion is stable.

    Parameters
    ----------
    model, rig
        As in `simulate`.
    near : Trace, optional
        A run that ends near the cycle. Without it the system is run for some periods.
    period : float, optional
        s: that of what drives the system, or that of the cycle if this shows a multiple of it. Of a
        system that nothing drives the period is found; this is where to begin.
    section : str, optional
        Where the cycle begins: a condition that becomes true once a period, such as "v > 0". Its
        names are those of `until` in `simulate`. Without it the cycle begins within its longest
        arc, and a return is looked for among switches.
    initial : mapping, optional
        Initial values of the run without `near`.
    settings : Settings, optional
        How to integrate; ``rtol=1e-10`` if omitted, and machine code if it is installed.
    **options
        Fields of `Settings` by name.

    Returns
    -------
    LimitCycle
        The motion, its period and its multipliers.

    Raises
    ------
    ParameterError
        If nothing says where to begin, or the motion is not near a cycle.
    SimulationError
        If a run cannot continue.

    Examples
    --------
    >>> from gms_fsm import LuGre, Slider, Stribeck
    >>> model = LuGre(sigma_0=1e3, sigma_1=30.0, sigma_2=4.0, stribeck=Stribeck(1.0, 1.5, 0.1))
    >>> cycle = limit_cycle(model, Slider(1.0, "20*sin(2*pi*t)"), period=1.0)
    >>> cycle.driven, cycle.stable, bool(abs(cycle.multipliers[0]) < 0.5)
    (True, True, True)
    """
    if settings is None:
        options = {
            "rtol": 1e-10,
            "engine": "compiled" if has_machine_code() else "ifelse",
            **options,
        }
    chosen = Settings.of(settings, "limit_cycle", **options)
    check_derivable(chosen)
    what = mounted(model, rig, chosen.held_period)
    if period is not None:
        period = checked_scalar("period", period, "> 0")
    if near is None:
        if period is None:
            raise ParameterError(
                "nothing says where to begin",
                place="near",
                advice="give a run that ends near the cycle, or the period of what drives it",
            )
        start = Problem.on(what, PERIODS * period, chosen, initial=initial)
        near = simulated(start)
    checked_kind("near", near, Trace, "a trace")
    search = _Search.of(what, near, chosen, period, section)
    return search.cycle()


@dataclass(frozen=True, eq=False)
class _Search:
    """Newton's method for the state at the start, and for the period if nothing drives the system.

    A system may be driven only in that it moves along with what drives it, as a mass that is pulled
    at constant speed: `drift` is the velocity of that motion, and the state returns but for it.
    """

    what: Mounted
    chosen: Settings
    initial: Mapping[str, Any]
    t: float
    period: float
    y: FloatArray
    mode: list[int]
    sizes: FloatArray
    basis: FloatArray  # of all components on which something depends, shape (m, kept)
    drift: FloatArray | None  # None if the period is given by what drives the system
    section: str | None

    @classmethod
    def of(
        cls,
        what: Mounted,
        near: Trace,
        chosen: Settings,
        period: float | None,
        section: str | None,
    ) -> _Search:
        """Return where to begin."""
        whole = near.whole()
        basis, drift = _dependence(whole)
        if drift is None and period is None:
            raise ParameterError(
                "the system is driven by something that changes with time",
                place="period",
                advice="give the period of that",
            )
        sizes = np.maximum(np.abs(whole.rows.y).max(axis=0), 1e-300)
        if clocks := clocks_of(what.system):
            drift = None
            if period is None or any(_is_broken(period / each.period) for each in clocks):
                raise ParameterError(
                    "samples drive the system, and a cycle has a whole number of them",
                    place="period",
                    value=period,
                    advice=f"give the period, a multiple of {clocks[0].period:g} s",
                )
        span, first = period, -1
        if section is not None and period is None:
            most = float(near.t[-1] - near.t[0])
            there = _crossing(what, near, chosen, section, most)
            whole = _crossing(what, there, chosen, section, most).whole()
            span = float(whole.t[-1] - whole.t[0])
        elif drift is not None:
            span, first = _return(whole, drift, basis, sizes, period)
        assert span is not None
        begin = float(whole.t[first]) if first >= 0 else max(whole.t[0], whole.t[-1] - span)
        row = _calm(whole, begin, begin + span)
        count = near.program.layout.n
        t, y = float(whole.t[row]), np.array(whole.rows.y[row])
        mode = whole.rows.mode[row, :count].tolist()
        return cls(what, chosen, near.initial or {}, t, span, y, mode, sizes, basis, drift, section)

    def problem(self, y: FloatArray, period: float) -> Problem:
        """Return one period as a run."""
        end = self.t + period
        start = Problem.on(self.what, end, self.chosen, t_start=self.t, initial=self.initial)
        return replace(start, y=y.tolist(), mode=list(self.mode))

    def cycle(self) -> LimitCycle:
        """Search."""
        y, period, residual = self.y, self.period, np.inf
        Q, drift = self.basis, self.drift
        size = y.size
        names = tuple(f"{INITIAL}{k}" for k in range(size))
        every = Directions(names, {}, {}, np.eye(size), np.maximum(self.sizes, 1e-12))
        back: tuple[FloatArray, float] | None = None  # half the last step, the other way
        for iteration in range(1, MOST_ITERATIONS + 1):
            start = self.problem(y, period)
            try:
                trace = simulated(start, wanted=every)
            except SimulationError:
                if back is None:
                    raise
                y, period = y + back[0], period + back[1]
                back = 0.5 * back[0], 0.5 * back[1]
                continue
            assert trace.derived is not None
            M, trace = trace.derived.followed.end, replace(trace, derived=None)
            end = np.array(trace.rows.y[-1])
            moved = np.zeros(size) if drift is None else drift * period
            R = Q.T @ ((end - y - moved) / self.sizes)
            before, residual = residual, float(np.abs(R).max(initial=0.0))
            same = trace.rows.mode[-1, : len(self.mode)].tolist() == self.mode
            scaled = M * self.sizes / self.sizes[:, None]
            A = Q.T @ scaled @ Q
            if not np.isfinite(A).all():
                raise ParameterError(
                    "a switch of the motion grazes, and it has no derivative there",
                    place="near",
                    advice="trace.trust() of a run with sensitivities says where",
                )
            f = self.rate(start) - (0.0 if drift is None else drift)
            along = Q.T @ (f / self.sizes)
            if drift is not None and np.abs(along).max(initial=0.0) * period < AT_REST:
                raise ParameterError(
                    "Newton's method ends where nothing moves, which is no cycle",
                    place="near",
                    advice="give a longer run that ends closer to the cycle",
                )
            if same and (residual < RESIDUAL or (residual < 1e3 * RESIDUAL and residual >= before)):
                multipliers = _multipliers(A, along if drift is not None else None)
                if self.section is not None:  # the same from there on
                    there = _crossing(self.what, trace, self.chosen, self.section, 2.0 * period)
                    trace = simulated(_onward(self.what, there, self.chosen, period))
                    y = np.array(trace.rows.y[0])
                return LimitCycle(period, multipliers, trace, residual, iteration, drift is None, y)
            step, dT = _newton(A, R, along if drift is not None else None)
            moves = self.sizes * (Q @ step)
            y, period, back = y + moves, period + dT, (-0.5 * moves, -0.5 * dT)
            if not (0.2 * self.period < period < 5.0 * self.period):
                break
        raise ParameterError(
            f"Newton's method does not find a cycle near it: the state misses by {residual:.2g} of "
            "its size",
            place="near",
            advice="give a longer run that ends closer to the cycle, or another period",
        )

    def rate(self, start: Problem) -> FloatArray:
        """Return the rate of the state at the start, which is that at the end."""
        program = start.program
        mode = program.layout.not_sliding(start.mode)
        dy = [0.0] * len(start.y)
        held = armed(program, start.t_start, start.y, mode)
        program.ieee["flow"](start.t_start, start.y, list(mode), held, program.p, dy)
        return np.array(dy)


def _is_broken(number: float) -> bool:
    return abs(number - round(number)) > 1e-9 * number


def _onward(what: Mounted, trace: Trace, chosen: Settings, span: float) -> Problem:
    """Return the start of a run from the end of another one."""
    rows, t, count = trace.whole().rows, float(trace.t[-1]), trace.program.layout.n
    start = Problem.on(what, t + span, chosen, t_start=t, initial=trace.initial or {})
    return replace(start, y=rows.y[-1].tolist(), mode=rows.mode[-1, :count].tolist())


def _crossing(what: Mounted, near: Trace, chosen: Settings, section: str, most: float) -> Trace:
    """Go on until the section is crossed."""
    start = _onward(what, near, chosen, most)
    try:
        found = simulated(start, section)
    except (ExpressionError, ParameterError) as error:
        raise error.replaced(place="section") from None
    if found.t[-1] >= start.t_end:
        raise ParameterError(
            "it does not become true in the time of the run near the cycle",
            place="section",
            value=section,
            advice="give a condition that the motion crosses once a period, or a longer run",
        )
    return found


def _newton(A: FloatArray, R: FloatArray, along: FloatArray | None) -> tuple[FloatArray, float]:
    """Return the step of the state, across the motion, and of the period."""
    eye = np.eye(len(R))
    if along is None:
        whole: Any = np.linalg.lstsq(A - eye, -R, rcond=None)[0]
        return whole, 0.0
    size = float(np.linalg.norm(along)) or 1.0
    unit = along[:, None] / size
    matrix = np.block([[A - eye, unit], [unit.T, np.zeros((1, 1))]])
    whole = np.linalg.lstsq(matrix, np.append(-R, 0.0), rcond=None)[0]
    return whole[:-1], float(whole[-1]) / size


def _multipliers(A: FloatArray, along: FloatArray | None) -> NDArray[np.complex128]:
    """Return the multipliers, without that along the motion."""
    if along is not None and along.any():  # what is left across it
        unit = along / np.linalg.norm(along)
        full = np.linalg.svd(unit[None, :])[2]
        across = full[1:].T
        A = across.T @ A @ across
    found = np.linalg.eigvals(A).astype(np.complex128)
    return found[np.argsort(-np.abs(found), kind="stable")]


def _dependence(trace: Trace) -> tuple[FloatArray, FloatArray | None]:
    """Return which directions of the state matter, and the drift that time is equivalent to."""
    program, rows = trace.program, trace.rows
    size = program.layout.y.size
    sizes = np.maximum(np.abs(rows.y).max(axis=0), 1e-300)
    none = Directions(tuple(map(str, range(size))), {}, {}, np.eye(size), np.ones(size))
    linear = Linear(program, none)
    slopes, rates = [np.zeros((0, size))], [np.zeros(0)]
    chosen = np.unique(np.linspace(len(rows) // 2, len(rows) - 1, SAMPLES).astype(int))
    seed = np.column_stack([np.diag(sizes), np.zeros(size)])
    time = np.append(np.zeros(size), 1.0)
    relations = list(range(len(program.strict)))
    for row in chosen.tolist():
        t, y = float(rows.t[row]), rows.y[row].tolist()
        mode = tuple(rows.mode[row].tolist())
        held = armed(program, t, y, mode)
        tables = [linear.flow(t, y, mode, held, time, seed)[1]]
        with contextlib.suppress(ArithmeticError):  # a comparison that is not defined here
            tables.append(linear.margins(relations, t, y, mode, held, time, seed)[1])
        for table in tables:
            lengths = np.linalg.norm(table, axis=1)
            table = table[np.isfinite(lengths) & (lengths > 0.0)]
            table = table / np.linalg.norm(table, axis=1)[:, None]
            slopes.append(table[:, :-1])
            rates.append(table[:, -1])
    A, b = np.vstack(slopes), np.concatenate(rates)
    _, weights, V = np.linalg.svd(A, full_matrices=True)
    kept = int((weights > 1e-9 * weights.max(initial=0.0)).sum())
    basis: FloatArray = V[:kept].T
    drift = np.linalg.lstsq(A, -b, rcond=1e-9)[0]
    if np.abs(A @ drift + b).max(initial=0.0) > INVARIANT:
        return basis, None
    return basis, drift * sizes


def _return(
    trace: Trace, drift: FloatArray, Q: FloatArray, sizes: FloatArray, period: float | None
) -> tuple[float, int]:
    """Return the time after which the motion has nearly returned, and the row from which on."""
    rows = trace.rows
    fired = np.flatnonzero(rows.microstep > 0)
    fired = fired[np.append(rows.t[fired][1:] > rows.t[fired][:-1], True)] if fired.size else fired
    if period is not None:
        return period, int(np.searchsorted(rows.t, rows.t[-1] - period))
    found: list[tuple[float, float, int]] = []
    if fired.size > 1:
        last = int(fired[-1])
        for k in fired[-LAST:-1].tolist()[::-1]:
            if (rows.mode[k] == rows.mode[last]).all():
                span = float(rows.t[last] - rows.t[k])
                miss = Q.T @ ((rows.y[last] - rows.y[k] - drift * span) / sizes)
                found.append((float(np.abs(miss).max(initial=0.0)), span, k))
    if not found:
        raise ParameterError(
            "the run near the cycle has no switch that returns",
            place="near",
            advice="give a longer run, or where to begin: period=...",
        )
    best = min(found)[0]
    return min((span, k) for miss, span, k in found if miss <= max(ROUGHLY, 1.5 * best))


def _calm(trace: Trace, begin: float, end: float) -> int:
    """Return a row in the middle of the longest time without a switch."""
    rows = trace.rows
    switched = np.unique(rows.t[rows.microstep > 0])
    marks = np.concatenate([[begin], switched[(switched > begin) & (switched < end)], [end]])
    longest = int(np.argmax(np.diff(marks)))
    middle = 0.5 * (marks[longest] + marks[longest + 1])
    free = ~rows.mode[:, trace.program.layout.slides].any(axis=1)
    inside = np.flatnonzero(free & (rows.t > marks[longest]) & (rows.t < marks[longest + 1]))
    if not inside.size:
        raise ParameterError(
            "the run near the cycle has no row between two switches",
            place="near",
            advice="give a run with all its rows",
        )
    return int(inside[np.argmin(np.abs(rows.t[inside] - middle))])
