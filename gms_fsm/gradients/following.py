"""The variational equations along a run, and what a switch does to them.

The loop of the engines is run once more, and between two of its rows the state and its tangents are
integrated together. They take no part in the choice of its steps, so that the run has its bits; an
error estimate of their own divides a step where the tangents need it.

At a switch the time itself has a derivative: that of the zero of the margin that has just changed.
There tangents are followed at the moving instant (``y_t + dy/dt t_t``), taken through every edge
and every tick as they happened, and then brought back to a fixed time with the flow behind it
(saltation).
"""

from __future__ import annotations

import dataclasses
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.gradients.arcs import Arcs
from gms_fsm.gradients.linear import Directions, Linear
from gms_fsm.language import comparisons, split
from gms_fsm.lowering.program import Program, equations
from integrators import Arc, Firing, Held, LoopOptions, Slide, Stop, hybrid
from integrators.advance import CROSSED, REACHED, raise_floor, tick_at
from integrators.crossings import any_changed, listed
from integrators.sliding import margins_on
from integrators.steps import time_of

Modes = tuple[int, ...]
ALIKE = 1e-7  # times of switches that differ by less have one derivative
ROUNDING = 1e-12  # of the length of a run
SHORT = 64.0  # ticks: an arc that a switch has ended at once
NOTHING = 1e-9  # of the natural size of a margin's derivative
BACK = 1e-8  # of the last step: just before a switch
GRAZING = 1e-4  # of the mean rate of a margin over its last step


@dataclass(frozen=True)
class DerivativeDoubt:
    """A switch whose derivative is not the ordinary one.

    Parameters
    ----------
    kind : str
        ``"grazing"``, ``"tie"``, or ``"none"`` where a rate has no slope.
    t : float
        s.
    place : str
        What happens there.
    reason : str
        What follows.
    """

    kind: str
    t: float
    place: str
    reason: str


@dataclass(frozen=True, eq=False)
class Followed:
    """Tangents of a run.

    Parameters
    ----------
    t : ndarray, shape (rows,)
        Times of the rows, s.
    rows : ndarray, shape (rows, m, directions)
        Of the state at the rows of the run, at fixed times.
    times : ndarray, shape (firings, directions)
        Of the time of each firing.
    end : ndarray, shape (m, directions)
        Of the state at the end.
    doubts : tuple of Doubt
        Switches whose derivative is one-sided, or does not exist.
    """

    t: FloatArray
    rows: FloatArray
    times: FloatArray
    end: FloatArray
    doubts: tuple[DerivativeDoubt, ...]


@dataclass(eq=False)
class _Operation:
    """Something that changes the state at an instant: an edge, or a tick."""

    name: str
    numbers: tuple[int, ...]
    t: float
    y: list[float]  # before it
    mode: list[int]


@dataclass(eq=False)
class _Recording:
    """The machines of the if-else text, which note what they do."""

    functions: Any
    done: list[_Operation] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.ask, self.jolts = self.functions["switch"], self.functions["jolts"]

    def act(
        self, edge: int, machine: int, t: float, y: list[float], mode: list[int], p: Any
    ) -> None:
        self.done.append(_Operation("act", (edge, machine), t, list(y), list(mode)))
        self.functions["act"](edge, machine, t, y, mode, p)

    def tick(self, bits: int, t: float, y: list[float], mode: list[int], p: Any) -> None:
        self.done.append(_Operation("tick", (bits,), t, list(y), list(mode)))
        self.functions["tick"](bits, t, y, mode, p)


@dataclass(eq=False)
class _Crossing:
    """Where an arc ended because comparisons changed."""

    relations: list[int]
    t: float
    y: list[float]
    mode: Modes
    held: list[float]


@dataclass(frozen=True, eq=False)
class RunAsRecorded:
    """A run as it was recorded.

    Parameters
    ----------
    times, states : list of float, and ndarray
        Its rows.
    stop_times, stop_states : list of float, and ndarray
        Both sides of all its stops.
    """

    times: list[float]
    states: FloatArray
    stop_times: list[float]
    stop_states: FloatArray


class Follower:
    """Follows one run.

    Parameters
    ----------
    program : Program
        Its program.
    options : LoopOptions
        How it integrates, and which rows it keeps.
    start : tuple
        Time, state and modes at the start, and the last time.
    directions : Directions
        Those of the tangents.
    recorded : RunAsRecorded, optional
        What machine code has recorded of the run: the loop then goes from stop to stop.
    """

    def __init__(
        self,
        program: Program,
        options: LoopOptions,
        start: tuple[float, list[float], list[int], float],
        directions: Directions,
        recorded: RunAsRecorded | None = None,
    ) -> None:
        self.program, self.directions = program, directions
        self.linear = Linear(program, directions)
        t, y, mode, self.last = start
        self.wanted = None if options.times is None else [float(u) for u in options.times]
        self.options = dataclasses.replace(options, times=None)
        self.start = t, y, mode
        made = equations(program)
        self.switch = _Recording(program.ieee)
        b = hybrid.buffers(made, t, y, mode, self.last, self.options)
        self.recorded = recorded
        if recorded is not None:
            b = b._replace(plan=b.plan._replace(foreign=True))
        self.buffers = b
        solver = None if recorded is None else self
        self.on = Held(made.functions(True), b.now.held, b.sliding)
        self.events = hybrid.events(made, self.switch, b, self.options, solver)
        self.t, self.y = t, list(y)
        self.mode: Modes = program.layout.not_sliding(mode)
        self.S = directions.y.copy()
        self.size = np.abs(np.array(y))
        self.row_times: list[float] = []
        self.rows: list[FloatArray] = []
        self.times: list[FloatArray] = []
        self.doubts: list[DerivativeDoubt] = []
        self.at_instant = True
        self.settled = -np.inf, np.zeros(directions.count)  # the last instant, and how it moves
        self.crossing: _Crossing | None = None
        self.waiting: list[tuple[int, list[float], Modes]] = []  # rows of this instant
        self.taken = 0  # of the requested times
        self.arc: tuple[Modes, list[float]] | None = None
        self.arcs = Arcs(self.linear, self.options)
        self.guarded: dict[tuple[int, ...], list[int]] = {}
        self.before: tuple[float, list[float]] = t, list(y)

    # ------------------------------------------------------------------ the run
    def follow(self) -> Followed:
        """Follow the run to its end."""
        for event in self.events:
            match event:
                case Arc(t=times, y=states, mode=mode):
                    self.rows_of(times, states, mode)
                case Firing() | Slide():
                    self.hold(event.y, event.mode)
                case Stop():
                    self.stop(event)
        self.settle(None)
        wanted = self.wanted
        while wanted is not None and self.taken < len(wanted):
            self.keep(wanted[self.taken], self.S)
            self.taken += 1
        count = self.directions.count
        shape = (-1, len(self.y), count)
        return Followed(
            np.array(self.row_times),
            np.array(self.rows).reshape(shape),
            np.array(self.times).reshape(-1, count),
            self.S,
            tuple(self.doubts),
        )

    def hold(self, y: list[float], mode: Modes) -> None:
        """Note a row of an instant."""
        self.y, self.mode = list(y), mode
        self.at_instant = True
        self.waiting.append((len(self.switch.done), list(y), mode))

    def rows_of(self, times: list[float], states: list[list[float]], mode: Modes) -> None:
        """Go on along rows of one arc; those at its very start belong to the instant before."""
        passed = 0
        while passed < len(times) and times[passed] <= self.t:
            self.hold(states[passed], mode)
            passed += 1
        if passed == len(times):
            return
        self.begin(mode)
        self.integrate(times[passed:], states[passed:])

    def begin(self, mode: Modes) -> None:
        """Begin an arc, if one does."""
        if self.at_instant:
            self.mode = mode
            held = list(self.buffers.now.held)
            self.settle(held)
            self.arc = mode, held

    def advance(self, _: int) -> None:
        """Go to the end of an arc as it was recorded, in place of a solver."""
        b, recorded = self.buffers, self.recorded
        assert recorded is not None
        now = b.now
        end = bisect_right(recorded.stop_times, self.t)
        t, y = recorded.stop_times[end], recorded.stop_states[end].tolist()
        rows = slice(bisect_right(recorded.times, self.t), bisect_left(recorded.times, t))
        self.begin(hybrid.modes_of(b))
        times, states = recorded.times[rows], recorded.states[rows].tolist()
        self.integrate([*times, t], [*states, y])
        now.t = t
        now.y[:] = y
        w = listed(b.relations, b.memory.active)
        margins_on(time_of(now), now.y, now.mode, self.on, w.watch, w.search.probe)
        b.memory.status = CROSSED if any_changed(w, w.search.probe) else REACHED
        raise_floor(b.plan.control, now)

    def keep(self, t: float, S: FloatArray) -> None:
        """Keep a row."""
        self.row_times.append(t)
        self.rows.append(S.copy())

    def stop(self, event: Stop) -> None:
        """Note the end of an arc, or either side of a jump."""
        b = self.buffers
        if not self.at_instant and self.arc is not None:
            self.switch.done.clear()
            if b.memory.status == CROSSED and event.t >= b.now.t:
                active = b.relations.room[: b.memory.active]
                changed = [r for r in active if b.relations.changed[r]]
                if changed:
                    mode, held = self.arc
                    self.crossing = _Crossing(changed, self.t, list(self.y), mode, held)
        self.at_instant = True
        self.y, self.mode = list(event.y), event.mode
        self.t = max(self.t, event.t)  # a jump is one clock tick later

    # ------------------------------------------------------------------ arcs
    def integrate(self, times: list[float], states: list[list[float]]) -> None:
        """Integrate the tangents along rows of an arc, and keep what is wanted."""
        assert self.arc is not None
        wanted, end = self.wanted, times[-1]
        kept = times if wanted is None else []
        if wanted is not None:
            while self.taken < len(wanted) and wanted[self.taken] < end:
                kept.append(wanted[self.taken])
                self.taken += 1
        knots = self.program.knots
        between = knots[bisect_right(knots, self.t) : bisect_left(knots, end)]
        nodes: dict[float, list[float] | None] = dict.fromkeys([*kept, *between])
        nodes |= {self.t: self.y, **dict(zip(times, states, strict=True))}
        t = sorted(nodes)
        self.size = np.maximum(self.size, np.abs(np.array([self.y, *states])).max(axis=0))
        table = self.arcs.integrate(*self.arc, t, [nodes[u] for u in t], self.S, self.size)
        places = {u: place for place, u in enumerate(t)}
        known: Any = np.isfinite(table).all(axis=(1, 2))
        if known[0] and not known[-1]:
            first = t[int(np.argmin(known))]
            reason = "nothing has a derivative from then on"
            self.doubts.append(
                DerivativeDoubt("none", first, "the slope of a rate is not finite", reason)
            )
        for u in kept:
            self.keep(u, table[places[u]])
        self.before = ([self.t, *times][-2], [self.y, *states][-2])
        self.t, self.y, self.S = end, list(states[-1]), table[-1].copy()

    # ------------------------------------------------------------------ switches
    def settle(self, held: list[float] | None) -> None:
        """Take the tangents through everything that happened at this instant."""
        done, waiting = self.switch.done, self.waiting
        total, t_t = self.S, np.zeros(self.directions.count)
        c = self.crossing
        if c is not None:
            total, t_t = self.arrive(c)
        changed = [] if c is None else c.relations
        after: list[tuple[FloatArray, FloatArray]] = [(total, t_t)]
        for each in done:
            if each.name == "act":
                if changed:
                    total, t_t = self.awaited(each, changed, total, t_t)
                self.times.append(t_t)
            total = self.through(each, total, t_t)
            after.append((total, t_t))
        for number, y, mode in waiting:
            total, t_t = after[number]
            if self.wanted is None:
                signs = self.linear.armed(self.t, y, mode)
                self.keep(self.t, self.fixed(y, mode, signs, total, t_t))
        total, t_t = after[-1]
        signs = self.linear.armed(self.t, self.y, self.mode) if held is None else held
        self.S = self.fixed(self.y, self.mode, signs, total, t_t)
        self.S = self.linear.onto(self.t, self.y, self.mode, signs, self.S)
        if self.program.velocities:  # what locks hold is not free
            states = (self.t, list(self.y), list(self.mode), list(signs), self.program.p)
            self.S = self.linear.call("follow", states, np.zeros(self.S.shape[1]), self.S)[1]
        self.switch.done.clear()
        self.waiting.clear()
        self.crossing, self.at_instant = None, False
        self.settled = self.t, t_t

    def fixed(
        self, y: list[float], mode: Modes, held: list[float], total: FloatArray, t_t: FloatArray
    ) -> FloatArray:
        """Bring tangents back from the moving instant to a fixed time."""
        if not t_t.any():
            return total
        f = self.rate(y, mode, held)
        return total - f[:, None] * t_t

    def rate(self, y: list[float], mode: Modes, held: list[float]) -> FloatArray:
        """Return dy/dt at this instant."""
        none = np.zeros(0)
        return self.linear.flow(self.t, y, mode, held, none, np.zeros((len(y), 0)))[0]

    def through(self, each: _Operation, total: FloatArray, t_t: FloatArray) -> FloatArray:
        """Take tangents through an edge or a tick."""
        p = self.program.p
        arguments = (*each.numbers, each.t, list(each.y), list(each.mode), p)
        return self.linear.call(each.name, arguments, t_t, total)[1]

    def arrive(self, c: _Crossing) -> tuple[FloatArray, FloatArray]:
        """Return the tangents at the moving instant of a crossing, and those of its time."""
        f = self.rate(c.y, c.mode, c.held)
        none = np.zeros(self.S.shape[1])
        t_t, rates = self.instants(c.relations, c.y, c.mode, c.held, f, self.S, none)
        if c.t - self.settled[0] <= SHORT * tick_at(c.t):
            self.at_once(c, t_t, rates)
        else:
            self.check(c, t_t, rates)
        return self.S + f[:, None] * t_t[0], t_t[0]

    def at_once(self, c: _Crossing, t_t: FloatArray, rates: FloatArray) -> None:
        """Let what changes right after a switch, because of it, change with it.

        Its margin is zero at that switch, also after a change of the numbers. From there it may
        grow as the square of the time, so that its rate says nothing.
        """
        _, before = self.settled
        still = np.zeros(len(c.y))
        places = [self.place(r) for r in c.relations]
        _, slopes = self.linear.margins(
            places, c.t, c.y, c.mode, c.held, still, np.diag(self.size), [self.linear.numbers[-1]]
        )
        natural = np.abs(slopes).sum(axis=1)[:, None] / self.directions.scales
        left = np.abs(rates[:, None] * (before - t_t))
        same = ~(left > NOTHING * natural)
        t_t[same] = np.broadcast_to(before, t_t.shape)[same]

    def instants(
        self,
        relations: Sequence[int],
        y: list[float],
        mode: Modes,
        held: list[float],
        f: FloatArray,
        S: FloatArray,
        t_t: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Return for each relation how its zero moves, shape (relations, directions); its rate.

        What is flat behind its zero, as max(N, 0), is taken from just before it.
        """
        places = [self.place(r) for r in relations]
        t, columns = np.append(t_t, 1.0), np.column_stack([S, f])
        _, g_t = self.linear.margins(places, self.t, y, mode, held, t, columns)
        flat = g_t[:, -1] == 0.0
        back = max(BACK * (self.t - self.before[0]), SHORT * tick_at(self.t))
        if flat.any() and back < self.t - self.settled[0]:
            earlier, y = self.t - back, (np.array(y) - back * f).tolist()
            g_t[flat] = self.linear.margins(places, earlier, y, mode, held, t, columns)[1][flat]
        with np.errstate(all="ignore"):
            moved = -g_t[:, :-1] / g_t[:, -1:]
        moved[g_t[:, :-1] == 0.0] = 0.0
        return moved, g_t[:, -1]

    def place(self, relation: int) -> int:
        """Return the number of a relation where surfaces slid on are counted in their order."""
        own = len(self.program.strict)
        if relation < own:
            return relation
        c, side = divmod(relation - own, 2)
        which = self.buffers.sliding.which
        return own + 2 * sorted(which[: self.slid()]).index(which[c]) + side

    def slid(self) -> int:
        """Return on how many surfaces the arc before slid."""
        return 0 if self.crossing is None else sum(self.crossing.mode[self.program.layout.slides])

    def awaited(
        self, each: _Operation, changed: list[int], total: FloatArray, t_t: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Go on to the instant of an edge, where it does not wait for what came first."""
        own = [r for r in self.guards(each) if r in changed]
        if not own or len(changed) == 1:
            return total, t_t
        mode: Modes = (*each.mode, *[0] * self.program.layout.surfaces)
        held = self.linear.armed(self.t, each.y, mode)
        f = self.rate(each.y, mode, held)
        S = total - f[:, None] * t_t
        later = self.instants(own[:1], each.y, mode, held, f, S, np.zeros_like(t_t))[0][0] - t_t
        size = np.maximum(np.abs(t_t), np.abs(t_t + later))
        if not (np.abs(later) > ALIKE * size).any():
            return total, t_t
        return total + f[:, None] * later, t_t + later

    def guards(self, each: _Operation) -> list[int]:
        """Return the relations in the guard of an edge."""
        if each.numbers in self.guarded:
            return self.guarded[each.numbers]
        edge, machine = each.numbers
        plan = self.program.plan
        place = self.program.layout.bank(machine)
        bank = next(b for b in plan.read.banks if b.name == place.name)
        found = []
        for comparison in comparisons(split(bank.edges[edge - place.first_edge].guard)):
            if comparison in plan.relations.shared or comparison in plan.relations.own:
                found.append(plan.relations.index(comparison, machine - place.first))
        self.guarded[each.numbers] = found
        return found

    def check(self, c: _Crossing, t_t: FloatArray, rates: FloatArray) -> None:
        """Note a crossing that grazes, or that is several ones at once."""
        names = [
            self.program.relations[r] if r < len(self.program.relations) else "the end of a slide"
            for r in c.relations
        ]
        t0, y0 = self.before
        if c.t > t0 and self.directions.count:
            places = [self.place(r) for r in c.relations]
            none, nothing = np.zeros(0), np.zeros((len(y0), 0))
            start, end = (
                self.linear.margins(places, t, y, c.mode, c.held, none, nothing)[0]
                for t, y in ((t0, y0), (c.t, c.y))
            )
            mean = np.abs(end - start) / (c.t - t0)
            slow = np.abs(rates) < GRAZING * mean
            if slow.any():
                name = names[int(np.argmax(slow))]
                why = "grazes" if rates[slow].any() else "jumps"
                reason = f"it {why} there, so that nothing has a derivative from then on"
                self.doubts.append(DerivativeDoubt("grazing", c.t, f"{name} changes", reason))
                t_t[:] = np.nan
        apart = np.ptp(t_t, axis=0) if len(t_t) else np.zeros(0)
        least = ROUNDING * (self.last - self.start[0]) / self.directions.scales
        if (apart > ALIKE * np.max(np.abs(t_t), axis=0) + least).any():
            self.doubts.append(
                DerivativeDoubt(
                    "tie",
                    c.t,
                    f"{' and '.join(dict.fromkeys(names))} changes",
                    "they hold on the side on which these follow each other as they did",
                )
            )
