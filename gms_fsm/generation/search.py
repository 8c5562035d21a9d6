"""The search for motions: legs are added to runs that have just taken an edge.

Every run counts for all goals, and each run that takes an edge is a place to go on from. What to
try next are the levels at which guards turn, those of the edge wanted first; then random ones of
them; then the attempt that came closest, changed a little.
"""

from __future__ import annotations

import importlib.util
import itertools
import math
import random
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from gms_fsm.charts.nesting import AGE
from gms_fsm.generation.stand import Drive, Leg, Stand
from gms_fsm.language import names_in, truths, values_of
from gms_fsm.traces.coverage.counting import of_view
from gms_fsm.traces.coverage.decisions import decisions
from gms_fsm.traces.scope import clause_text, guard_columns
from gms_fsm.traces.trace import Trace
from gms_fsm.verification.reaching.points import GuardPoints, TurningPoint

MOST_NODES = 5  # runs to go on from, for each edge
PLANNED, RANDOM, GUIDED = 60, 60, 40  # attempts for each of them
MANY = 800  # runs after which compiling pays; all engines give the same bits
STRIKES = (2.0, -2.0, 1.0, -1.0, 0.0)  # shares of a speed
LOADS = (0.0, 1.0, -1.0, 2.0, -2.0)  # N, if no guard says more
FAST = "compiled" if importlib.util.find_spec("llvmlite") else "ifelse"
MOST_TOLD = 4  # edges in a title
LONG = 1e4  # usual durations; nothing takes longer
SHORT = 1e-3  # share of a usual duration that a run from a turning point lasts


class Taken(NamedTuple):
    """An edge from one of its sources."""

    edge: str
    source: str


class Goal(NamedTuple):
    """What a motion should show: an edge, two that follow each other, or a comparison that decides.

    A comparison has a number, and ``"true"``, ``"false"``, ``"equal"`` or ``"across"``.
    """

    edges: tuple[Taken, ...]
    number: int = -1
    side: str = ""


class TakenAt(NamedTuple):
    """An edge taken by an element."""

    t: float
    element: int
    taken: Taken


@dataclass(frozen=True, eq=False)
class Tried:
    """A motion with what it showed."""

    motion: Drive
    trace: Trace
    ended: str
    firings: tuple[TakenAt, ...]
    point: TurningPoint | None = None

    @property
    def title(self) -> str:
        """What it is for: a comparison held where it turns, or the edges that are taken."""
        chart, point = self.trace.model.chart, self.point
        if point is not None:
            text = clause_text(chart, decisions(chart)[point.edge.name].comparisons[point.number])
            how = "both sides equal" if point.equal else "just across"
            return f"{point.edge.name} from {self.motion.state}: {text}, {how}"
        first = self.firings[0].element if self.firings else 0
        taken = [each.taken.edge for each in self.firings if each.element == first]
        more = f", and {len(taken) - MOST_TOLD} more" if len(taken) > MOST_TOLD else ""
        return f"{', '.join(taken[:MOST_TOLD])}{more}" or f"stays in {self.motion.state}"


def firings_of(trace: Trace) -> tuple[TakenAt, ...]:
    """Return the log of a contact."""
    log, places, chart = trace.firings, trace.places, trace.model.chart
    found = []
    rows = zip(log.t.tolist(), log.machine.tolist(), log.edge.tolist(), strict=True)
    for t, machine, edge in rows:
        each = chart.transitions[edge - places.first_edge]
        found.append(TakenAt(t, machine - places.first, Taken(each.name, each.source)))
    return tuple(found)


def followed(firings: Sequence[TakenAt]) -> Iterator[tuple[TakenAt | None, TakenAt]]:
    """Yield each firing with that of the same element before it."""
    before: dict[int, TakenAt] = {}
    for each in firings:
        yield before.get(each.element), each
        before[each.element] = each


def goals_of(chart: Any) -> tuple[Goal, ...]:
    """Return the edges of a chart, and the pairs of edges that can follow each other."""
    edges = {Taken(e.name, e.source): e for e in chart.transitions}
    single = [Goal((each,)) for each in edges]
    pairs = [Goal((a, b)) for a in edges for b in edges if edges[a].target == b.source]
    return (*single, *pairs)


def shown(tried: Tried) -> set[Goal]:
    """Return everything that a run shows."""
    found = set[Goal]()
    for before, each in followed(tried.firings):
        found.add(Goal((each.taken,)))
        if before is not None:
            found.add(Goal((before.taken, each.taken)))
    for asked, decision, number in of_view(tried.trace).asked():
        sides = decision.shown(asked.asked, number)
        taken = (Taken(asked.edge, asked.source),)
        found |= {
            Goal(taken, number, side)
            for side, seen in zip(("true", "false"), sides, strict=True)
            if seen
        }
    return found | _turned(tried)


def _turned(tried: Tried) -> set[Goal]:
    """Return the comparisons that the first row holds to the last bit, and that decide there."""
    trace, point, found = tried.trace, tried.point, set[Goal]()
    chart, shape = trace.model.chart, trace.modes.T.shape
    for place, edge in chart.leaving(tried.motion.state) if len(trace) else ():
        decision = decisions(chart)[edge.name]
        columns = guard_columns(trace, frozenset().union(*map(names_in, decision.comparisons)))
        vector = "".join(
            "01"[int(truths(each, {n: columns[n] for n in names_in(each)}, shape)[0, 0])]
            for each in decision.comparisons
        )
        taken = (Taken(edge.name, edge.source),)
        for number, each in enumerate(decision.comparisons):
            if not decision.decides(vector, number):
                continue
            left, right = (_at_first(side, columns, shape) for side in (each.left, each.right))
            meant = point is not None and (point.edge.name, point.number) == (edge.name, number)
            if left == right:
                found.add(Goal(taken, number, "equal"))
            elif meant and point is not None and not point.equal:
                found.add(Goal(taken, number, "across"))
        if decision.holds(vector) and place not in chart.arrests:
            break  # it goes first
    return found


def _at_first(side: Any, columns: Mapping[str, Any], shape: tuple[int, ...]) -> float:
    here = {name: np.broadcast_to(columns[name], shape) for name in names_in(side)}
    return float(np.broadcast_to(values_of(side, here), shape)[0, 0])


@dataclass(frozen=True, eq=False)
class Sizes:
    """Levels of signals and durations to try."""

    levels: Mapping[str, tuple[float, ...]]
    lengths: tuple[float, ...]
    speeds: tuple[float, ...]
    times: tuple[float, ...]


def sizes_of(stand: Stand, guards: GuardPoints) -> Sizes:
    """Return what follows from the levels at which guards turn."""
    known, chart = guards.levels, stand.chart
    lengths = _positive(u for name in ("x", *chart.variables) for u in known.get(name, ()))
    lengths = lengths or (1.0,)
    at = [u for v in chart.velocities for u in known.get(v, ())]
    speeds = _positive(at)
    levels: dict[str, tuple[float, ...]] = {}
    loads = dict(zip(stand.drives, guards.loads, strict=False))
    for v, name in stand.drives.items():
        if stand.free:
            levels[name] = guards.within(name, known.get(loads.get(v, ""), LOADS))
        else:
            more = [s * k * lengths[-1] for k in (1.0, 10.0) for s in (1.0, -1.0)]
            levels[name] = guards.within(v, (*known.get(v, (0.0,)), *more))
    levels |= {name: guards.within(name, known.get(name, (0.0, 1.0))) for name in stand.inputs}
    times = [u for u in known.get("t", ()) if u > 0.0]
    for pairs in guards.pairs.values():
        for _, each in pairs:
            if AGE in names_in(each.left):
                here = guards.at({})
                times.append(1.5 * abs(guards.margin(each, here)))
    if stand.free:
        forces = _positive(u for name in stand.drives.values() for u in levels[name])
        F = forces[-1] if forces else 1.0
        times += [3.0 * v / F for v in speeds] + [2.0 * math.sqrt(x / F) for x in lengths]
    else:
        fast = max((abs(u) for name in stand.drives.values() for u in levels[name]), default=1.0)
        times += [lengths[0] / (fast or 1.0), 3.0 * lengths[-1] / (fast or 1.0)]
    return Sizes(levels, lengths, speeds or (1.0,), _positive(times))


def _positive(values: Any) -> tuple[float, ...]:
    return tuple(sorted({float(f"{abs(u):.6g}") for u in values if 0.0 < abs(u) < math.inf}))


class MotionSearch:
    """Motions found so far, and runs to go on from."""

    def __init__(self, stand: Stand, guards: GuardPoints, seed: int, never: Set[Goal]) -> None:
        self.stand, self.guards, self.chart = stand, guards, stand.chart
        self.dice = random.Random(seed)
        self.sizes = sizes_of(stand, guards)
        self.goals = tuple(goal for goal in goals_of(self.chart) if goal not in never)
        self.found: dict[Goal, Drive] = {}
        self.points: list[tuple[TurningPoint, Drive]] = []
        edges = (Taken(each.name, each.source) for each in self.chart.transitions)
        self.nodes: dict[Taken, list[Drive]] = {each: [] for each in edges}
        self.runs = 0

    @property
    def idle(self) -> Drive:
        """A motion of a chart in which nothing is to be found."""
        start = self.stand.start(self.guards, self.chart.default_state.name, {})
        return start.then(Leg(1.0, start.level, start.level))

    @property
    def strikes(self) -> bool:
        """Whether some motion needs an impact."""
        return any(motion.strike is not None for motion in self.found.values())

    @property
    def wanted(self) -> list[Goal]:
        """What is still to be found."""
        return [goal for goal in self.goals if goal not in self.found]

    def explore(self) -> None:
        """Search."""
        default = self.chart.default_state.name
        start = self.stand.start(self.guards, default, dict(self.chart.initial))
        for attempt in itertools.islice(self._attempts(start), 2 * PLANNED):
            if not self.wanted:
                break
            self.tried(attempt)
        for state in self.chart.states:
            for point in self.guards.turning(state.name):
                motion = self.stand.start(self.guards, state.name, point.values)
                level = motion.level
                self.points.append((point, motion.then(Leg(self._short, level, level))))
        for _, motion in self.points:
            self.tried(motion)
        for _ in range(2):
            for goal in self.wanted:
                if self._possible(goal):
                    self._reach(goal)

    def awaited(self, goal: Goal) -> str:
        """Return the event that an edge waits for, which nobody sends; empty if there is none."""
        named = {(each.name, each.source): each.event for each in self.chart.transitions}
        return next((named[each] for each in goal.edges if named[each]), "")

    def _possible(self, goal: Goal) -> bool:
        """Return whether it makes sense to try: an edge that is never taken is in no pair."""
        alone = len(goal.edges) == 1 or all(Goal((each,)) in self.found for each in goal.edges)
        return alone and not self.awaited(goal)

    @property
    def _short(self) -> float:
        return SHORT * self.sizes.times[-1]

    # ------------------------------------------------------------------ one run
    def tried(self, motion: Drive) -> Tried:
        """Run a motion, and keep what it shows first."""
        trace, ended = self.stand.run(motion, engine=FAST if self.runs > MANY else "ifelse")
        self.runs += 1
        firings = firings_of(trace)
        tail = min(self._short, SHORT * (motion.t_end - motion.t))
        end = motion.t_end if not ended or not len(trace) else float(trace.t[-1])
        for before, each in followed(firings):
            if ended and each.t + tail > end:
                break
            pair = () if before is None else (before.taken,)
            for goal in (Goal((each.taken,)), Goal((*pair, each.taken))):
                if goal not in self.found:
                    self.found[goal] = motion.cut(min(each.t + tail, motion.t_end))
            nodes = self.nodes[each.taken]
            if len(nodes) < MOST_NODES and each.t < motion.t_end:
                nodes.append(motion.cut(each.t))
        return Tried(motion, trace, ended, firings)

    # ------------------------------------------------------------------ one goal
    def _reach(self, goal: Goal) -> None:
        """Try to reach an edge, alone or after another one, from all runs by turns."""
        *first, last = goal.edges
        starts = list(self.nodes[first[0]]) if first else self._starts(last)
        best: tuple[tuple[float, float], Drive, int] | None = None
        for start, motion in _by_turns({i: self._tries(s, last) for i, s in enumerate(starts)}):
            tried = self.tried(motion)
            if goal in self.found:
                return
            close = self._closeness(tried, last)
            if close is not None and (best is None or close < best[0]):
                best = close, motion, len(starts[start].legs)
        for _ in range(GUIDED if best is not None else 0):
            assert best is not None
            motion = self._changed(best[1], best[2])
            tried = self.tried(motion)
            if goal in self.found:
                return
            close = self._closeness(tried, last)
            if close is not None and close < best[0]:
                best = close, motion, best[2]

    def _tries(self, start: Drive, last: Taken) -> Iterator[Drive]:
        """Yield what is tried from a start: what aims at the edge, plans, and chance, mixed."""
        planned = [*self._aimed(start, last), *itertools.islice(self._attempts(start), PLANNED)]
        self.dice.shuffle(planned)
        for pair in itertools.zip_longest(planned, self._random(start)):
            yield from filter(None, pair)

    def _starts(self, last: Taken) -> list[Drive]:
        """Return runs that are in the source of an edge."""
        into = [e for e in self.chart.transitions if e.target == last.source]
        found = [self.nodes[Taken(e.name, e.source)] for e in into]
        here = self.stand.start(self.guards, last.source, dict(self.chart.initial))
        return [here, *(motion for each in found for motion in each)][: 2 * MOST_NODES]

    def _closeness(self, tried: Tried, last: Taken) -> tuple[float, float] | None:
        """Return how close a run came to an edge that it never took: what was false, how far."""
        found = of_view(tried.trace).edge(*last)
        if not found.closest:
            return None
        return min((float(u.count("0")), sum(margins)) for u, margins in found.closest.items())

    def _changed(self, motion: Drive, kept: int) -> Drive:
        """Return a motion whose later legs are changed a little."""
        legs, level = list(motion.legs[:kept]), motion.legs[kept - 1].last
        for leg in motion.legs[kept:]:
            last = {name: self._near(name, u) for name, u in leg.last.items()}
            hold = leg.duration * self.dice.choice((1.0, 1.0, 0.3, 0.7, 1.4, 3.0))
            hold = min(hold, LONG * self.sizes.times[-1])
            first = level if not self.stand.free else last
            legs.append(Leg(hold, first, last))
            level = last
        return replace(motion, legs=tuple(legs))

    def _near(self, name: str, u: float) -> float:
        """Return a level near another one, within the bounds."""
        levels = self.sizes.levels[name]
        return min(max(u * self.dice.choice((1.0, 1.0, 0.7, 1.4)), levels[0]), levels[-1])

    # ------------------------------------------------------------------ what is tried
    def _attempts(self, start: Drive) -> Iterator[Drive]:
        """Yield motions that go on at one level, the largest first."""
        for level in self._levels(start.level):
            for hold in self._holds(level):
                yield from self._ways(start, level, hold)

    def _aimed(self, start: Drive, last: Taken) -> Iterator[Drive]:
        """Yield motions that go to where a guard turns; a free body is struck to its velocity."""
        drives = self.stand.drives
        strikes = self.stand.free and len(drives) == 1 and start.strike is None
        for point, there in self.points:
            if (point.edge.name, point.edge.source) != last:
                continue
            for hold in self._holds(there.level):
                yield from itertools.islice(self._ways(start, dict(there.level), hold), 2)
                for name in drives.values() if strikes else ():
                    strike = (start.t_end, point.values.get(self.chart.velocities[0], 0.0))
                    calm = Leg(hold, *(({**start.level, name: 0.0},) * 2))
                    for level in (there.level, {**there.level, name: 0.0}):
                        leg = Leg(hold, level, level)
                        yield start.then(leg, strike=strike)
                        yield start.then(calm, leg, strike=strike)

    def _levels(self, base: Mapping[str, float]) -> Iterator[dict[str, float]]:
        seen = set[tuple[float, ...]]()
        for name in base:
            for u in sorted(self.sizes.levels[name], key=lambda u: (-abs(u), u)):
                level = {**base, name: u}
                key = tuple(level.values())
                if key not in seen:
                    seen.add(key)
                    yield level

    def _holds(self, level: Mapping[str, float]) -> tuple[float, ...]:
        """Return how long a level is held."""
        if self.stand.free or not self.stand.drives:
            return self.sizes.times[-1:] + self.sizes.times[:1]
        speed = max(abs(level[name]) for name in self.stand.drives.values())
        if speed == 0.0:
            return self.sizes.times[-1:]
        usual = self.sizes.times[-1]
        return min(3.0 * self.sizes.lengths[-1] / speed, LONG * usual), usual

    def _ways(self, start: Drive, level: dict[str, float], hold: float) -> Iterator[Drive]:
        before = start.level
        if self.stand.free:
            yield start.then(Leg(hold, level, level))
            yield start.then(Leg(0.3 * hold, before, before), Leg(hold, level, level))
            if start.strike is None and len(self.stand.drives) == 1:
                v = self.sizes.speeds[-1]
                for u in self.guards.within(self.chart.velocities[0], (2.0 * v, -2.0 * v, 0.0)):
                    yield start.then(Leg(hold, level, level), strike=(start.t_end, u))
        else:
            yield start.then(Leg(0.01 * hold, before, level), Leg(hold, level, level))

    def _random(self, start: Drive) -> Iterator[Drive]:
        """Yield motions of one or two random legs."""
        dice = self.dice
        for _ in range(RANDOM):
            legs, level, strike = [], dict(start.level), None
            t = start.t_end
            for _ in range(dice.choice((1, 2, 2, 3))):
                last = {
                    name: dice.choice(self.sizes.levels[name]) if dice.random() < 0.7 else u
                    for name, u in level.items()
                }
                hold = dice.choice(self._holds(last)) * dice.choice((0.1, 0.3, 1.0, 1.0))
                if self.stand.free:
                    legs.append(Leg(hold, last, last))
                    if start.strike is None and strike is None and dice.random() < 0.3:
                        v = dice.choice(self.sizes.speeds) * dice.choice(STRIKES)
                        if self.guards.within(self.chart.velocities[0], (v,)):
                            strike = (t, v)
                else:
                    ramp = dice.choice((0.01, 0.3, 1.0)) * hold
                    legs += [Leg(ramp, level, last), Leg(hold, last, last)]
                    t += ramp
                t, level = t + hold, last
            yield start.then(*legs, strike=strike)


def _by_turns(several: Mapping[int, Iterator[Drive]]) -> Iterator[tuple[int, Drive]]:
    """Yield from several iterators by turns, with the number of each."""
    left = dict(several)
    while left:
        for number in list(left):
            motion = next(left[number], None)
            if motion is None:
                del left[number]
            else:
                yield number, motion
