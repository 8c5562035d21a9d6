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
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.gradients.linear import Directions, Linear
from gms_fsm.language import comparisons, split
from gms_fsm.lowering.program import Program, equations
from integrators import METHODS, Arc, Firing, LoopOptions, Slide, Stop, hybrid
from integrators.advance import CROSSED, tick_at

Modes = tuple[int, ...]
METHOD = METHODS["dp45"]
ORDER = 5
SAFE, LEAST, MOST = 0.9, 0.2, 5.0  # of the step control
SMALLEST = 1e-300
ALIKE = 1e-7  # times of switches that differ by less have one derivative
GRAZING = 1e-5  # of the mean rate of a margin over its last step


@dataclass(frozen=True)
class DerivativeDoubt:
    """A switch whose derivative is not the ordinary one.

    Parameters
    ----------
    kind : str
        ``"grazing"`` or ``"tie"``.
    t : float
        s.
    place : str
        The comparisons that changed there.
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
    """

    def __init__(
        self,
        program: Program,
        options: LoopOptions,
        start: tuple[float, list[float], list[int], float],
        directions: Directions,
    ) -> None:
        self.program, self.directions = program, directions
        self.linear = Linear(program, directions)
        t, y, mode, self.last = start
        self.wanted = None if options.times is None else [float(u) for u in options.times]
        self.options = dataclasses.replace(options, times=None)
        self.start = t, y, mode
        made = equations(program)
        self.switch = _Recording(program.ieee)
        self.buffers = hybrid.buffers(made, t, y, mode, self.last, self.options)
        self.events = hybrid.events(made, self.switch, self.buffers, self.options)
        self.t, self.y = t, list(y)
        self.mode: Modes = program.layout.not_sliding(mode)
        self.S = directions.y.copy()
        self.size = np.abs(np.array(y))
        self.row_times: list[float] = []
        self.rows: list[FloatArray] = []
        self.times: list[FloatArray] = []
        self.doubts: list[DerivativeDoubt] = []
        self.at_instant = True
        self.crossing: _Crossing | None = None
        self.waiting: list[tuple[int, list[float], Modes]] = []  # rows of this instant
        self.taken = 0  # of the requested times
        self.h = np.inf
        self.arc: tuple[Modes, list[float]] | None = None
        self.slope: FloatArray | None = None
        self.before: tuple[float, list[float]] = t, list(y)

    # ------------------------------------------------------------------ the run
    def follow(self) -> Followed:
        """Follow the run to its end."""
        for event in self.events:
            match event:
                case Arc(t=times, y=states, mode=mode):
                    for t, y in zip(times, states, strict=True):
                        self.row(t, y, mode)
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

    def row(self, t: float, y: list[float], mode: Modes) -> None:
        """Go on to a row."""
        if t <= self.t:
            self.hold(y, mode)
            return
        if self.at_instant:
            self.mode = mode
            held = list(self.buffers.now.held)
            self.settle(held)
            self.arc, self.slope, self.h = (mode, held), None, np.inf
        self.before = self.t, self.y
        self.integrate(t, y)
        if self.wanted is None:
            self.keep(t, self.S)

    def keep(self, t: float, S: FloatArray) -> None:
        """Keep a row."""
        self.row_times.append(t)
        self.rows.append(S.copy())

    def stop(self, event: Stop) -> None:
        """Note the end of an arc, or either side of a jump."""
        b = self.buffers
        if event.t > self.t:  # an arc without a row of its end
            self.row(event.t, event.y, event.mode)
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
        if event.t > self.t:
            self.t = event.t

    # ------------------------------------------------------------------ arcs
    def integrate(self, t: float, y: list[float]) -> None:
        """Integrate the tangents to the next row."""
        wanted, knots = self.wanted or [], self.program.knots
        stops = [u for u in knots if self.t < u < t]
        while self.taken < len(wanted) and wanted[self.taken] < t:
            u = wanted[self.taken]
            self.taken += 1
            if u <= self.t:
                self.keep(u, self.S)
                continue
            for stop in [*(s for s in stops if self.t < s < u), u]:
                self._to(stop)
            self.keep(u, self.S)
        for stop in [*(s for s in stops if self.t < s), t]:
            self._to(stop)
        self.y = list(y)
        self.size = np.maximum(self.size, np.abs(np.array(y)))

    def _to(self, t_end: float) -> None:
        """Integrate state and tangents together, with steps of their own if need be."""
        assert self.arc is not None
        mode, held = self.arc
        zero = np.zeros(self.directions.count)
        linear, options = self.linear, self.options

        def rate(t: float, z: FloatArray) -> FloatArray:
            f, slope = linear.flow(t, z[:, 0].tolist(), mode, held, zero, z[:, 1:])
            return np.column_stack([f, slope])

        A, B, C, E = METHOD.A, METHOD.B, METHOD.C, METHOD.E
        t, z = self.t, np.column_stack([self.y, self.S])
        k0 = rate(t, z) if self.slope is None else self.slope
        tick = tick_at(max(abs(t), abs(t_end)))
        floor = np.maximum(np.array(options.atol), SMALLEST)
        sizes = np.maximum(self.size, SMALLEST)[:, None] / self.directions.scales
        while t < t_end:
            h = min(self.h, t_end - t)
            if t_end - t - h <= tick:
                h = t_end - t
            k = [k0]
            for i in range(1, len(B)):
                inner = z + h * sum(a * u for a, u in zip(A[i], k, strict=True) if a)
                k.append(rate(min(t + C[i] * h, t_end), inner))
            new = z + h * sum(b * u for b, u in zip(B, k, strict=True) if b)
            k.append(rate(t + h, new))
            error = h * np.abs(sum(e * u for e, u in zip(E, k, strict=True) if e))
            size = np.maximum(np.abs(z), np.abs(new))
            wide = np.max(size[:, 1:], axis=0, initial=0.0)
            scale = np.column_stack(
                [
                    options.rtol * np.maximum(size[:, 0], self.size) + floor,
                    options.rtol * (size[:, 1:] + 1e-3 * sizes) + 1e-16 * wide,
                ]
            )
            ratios = (error / scale)[:, np.isfinite(new).all(axis=0)]  # not of what has grazed
            worst = float(np.max(ratios, initial=0.0))
            if worst <= 1.0 or h <= 4 * tick:
                z, k0, t = new, k[-1], t + h
            factor = SAFE * max(worst, 1e-10) ** (-1 / ORDER)
            self.h = h * min(max(factor, LEAST), MOST)
            if worst <= 1.0 and h >= t_end - self.t - tick:
                self.h = np.inf  # the run's own step is short enough
        self.t, self.y, self.S, self.slope = t_end, z[:, 0].tolist(), z[:, 1:], k0

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
        self.switch.done.clear()
        self.waiting.clear()
        self.crossing, self.at_instant = None, False

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
        self.check(c, t_t, rates)
        return self.S + f[:, None] * t_t[0], t_t[0]

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
        """Return for each relation how its zero moves, shape (relations, directions); its rate."""
        places = [self.place(r) for r in relations]
        _, g_t = self.linear.margins(
            places, self.t, y, mode, held, np.append(t_t, 1.0), np.column_stack([S, f])
        )
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
        edge, machine = each.numbers
        plan = self.program.plan
        place = self.program.layout.bank(machine)
        bank = next(b for b in plan.read.banks if b.name == place.name)
        found = []
        for comparison in comparisons(split(bank.edges[edge - place.first_edge].guard)):
            if comparison in plan.relations.shared or comparison in plan.relations.own:
                found.append(plan.relations.index(comparison, machine - place.first))
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
            if (np.abs(rates) < GRAZING * mean).any():
                self.doubts.append(
                    DerivativeDoubt(
                        "grazing", c.t, names[0], "it only touches: no derivative from here on"
                    )
                )
                t_t[:] = np.nan
        apart = np.ptp(t_t, axis=0) if len(t_t) else np.zeros(0)
        if (apart > ALIKE * np.max(np.abs(t_t), axis=0)).any():
            self.doubts.append(
                DerivativeDoubt("tie", c.t, " and ".join(dict.fromkeys(names)), "one-sided")
            )
