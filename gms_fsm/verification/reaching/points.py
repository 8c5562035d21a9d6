"""Points where a comparison of a guard turns, to the last bit, and decides which edge is taken.

Theory of operation. The guards of a state are evaluated in floats, with the numbers of one element.
For each name that a comparison reads, the others are held at some levels, and the comparison is
bisected until its truth turns between neighbouring floats. A float at which both sides are equal
tells ``<`` from ``<=``; the next one across, on the side of the other truth, tells constants apart.
Levels are the values found like this, their halves and doubles, and 0.
"""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from gms_fsm.charts.chart import Transition
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.language import Condition, Relation, evaluate, names_in
from gms_fsm.language.tree import walk
from gms_fsm.lowering.scales import scales_of
from gms_fsm.systems.parts import Contact
from gms_fsm.traces.coverage.decisions import Decision
from gms_fsm.verification._subject import force_name, subject_of
from gms_fsm.verification._switching import earlier
from gms_fsm.verification.facts import facts_of

POWERS = range(-9, 8)  # of ten, at which a name is tried before anything is known of its size
MOST_COMBINATIONS = 300  # of the other names
FEW = 40  # of them, while levels are searched
PATIENCE = 60  # points that decide, among which there is none where both sides are equal
NEAR_ZERO = 1e-9  # share of a level that stands for the float next to 0
Levels: TypeAlias = Mapping[str, tuple[float, ...]]
Bounds: TypeAlias = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class TurningPoint:
    """Values at which a comparison of a guard decides.

    Parameters
    ----------
    edge : Transition
        Whose guard.
    number : int
        Of the comparison, as coverage counts them.
    equal : bool
        Whether both sides are equal; else it is the next float, where the truth is the other.
    values : mapping of str to float
        By name.
    """

    edge: Transition
    number: int
    equal: bool
    values: Mapping[str, float]


class GuardPoints:
    """The guards of one element of a contact, as functions of numbers."""

    def __init__(
        self, contact: Contact, mass: float, bounds: Bounds, seed: int, drives: Mapping[str, str]
    ) -> None:
        self.contact, self.chart = contact, contact.chart
        self.dice, self._curve = random.Random(seed), dict[float, float]()
        self.subject = subject = subject_of(replace(facts_of(contact), n=1))
        self.curve: Stribeck | None = contact.stribeck if "s" in self.chart.inputs else None
        self.fixed = {name: float(np.ravel(u)[0]) for name, u in contact.values.items()}
        self.fixed |= dict.fromkeys(self.chart.hidden, 0.0)
        if subject.moves:
            self.fixed[subject.mobility] = 1.0 / mass
            viscous = subject.inputs[-1]
            if viscous.startswith("sigma_2") and viscous not in self.chart.inputs:
                self.fixed[viscous] = contact.sigma_2
        self.loads = tuple(
            force_name(subject.load, self.chart, each)
            for each in self.chart.force_names
            if subject.moves
        )
        loads = zip(self.chart.velocities, self.loads, strict=False)
        named = {load: bounds[drives[v]] for v, load in loads if drives[v] in bounds}
        self.bounds = {**bounds, **named}
        self.pairs = {(e.source, e.name): self._pairs(e) for e in self.chart.transitions}
        read = {name for e in self.chart.transitions for name in self.names(subject.guard(e))}
        self.free = tuple(
            name
            for name in (
                *self.chart.inputs,
                *self.chart.velocities,
                *self.chart.variables,
                *self.loads,
            )
            if name in read and name not in self.fixed and not (name == "s" and self.curve)
        )
        self.free = tuple(dict.fromkeys(self.free))
        self.levels = self._levels()

    def names(self, tree: Condition) -> frozenset[str]:
        """Return what a guard reads; of a curve its velocity."""
        found = names_in(tree)
        return found | {"v"} if self.curve is not None and "s" in found else found

    def _pairs(self, edge: Transition) -> tuple[tuple[Relation, Relation], ...]:
        """Return the comparisons of a guard as written and with everything written out."""
        written, full = (
            [node for node in walk(tree) if isinstance(node, Relation)]
            for tree in (self.chart.guards[edge.name], self.subject.guard(edge))
        )
        return tuple(dict(zip(written, full, strict=False)).items())

    # ------------------------------------------------------------------ in numbers
    def at(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return all names at a point."""
        found = {**dict.fromkeys(self.free, 0.0), **self.fixed, **values}
        if self.curve is not None:
            v = found.get("v", 0.0)
            if v not in self._curve:
                self._curve[v] = float(self.contact.weights[0] * self.curve(v))
            found["s"] = self._curve[v]
        return found

    def margin(self, relation: Relation, values: Mapping[str, float]) -> float:
        """Return the left side minus the right one; nan where they are not defined."""
        here = self.at(values)
        try:
            return evaluate(relation.left, here) - evaluate(relation.right, here)
        except (ArithmeticError, ValueError, KeyError):
            return math.nan

    def holds(self, condition: Condition, values: Mapping[str, float]) -> bool:
        """Return whether a guard is true; where it is not defined it is not."""
        try:
            return bool(evaluate(condition, self.at(values)))
        except (ArithmeticError, ValueError, KeyError):
            return False

    def first(self, state: str, values: Mapping[str, float]) -> str:
        """Return the edge that is taken; a start counts as a jump, at which arrests are not."""
        for _, edge in self.chart.leaving(state):
            if not self.subject.arrests(edge) and self.holds(self.subject.guard(edge), values):
                return edge.name
        return ""

    # ------------------------------------------------------------------ levels
    def within(self, name: str, found: Iterable[float]) -> tuple[float, ...]:
        """Return values within the bounds of a name, in order."""
        low, high = self.bounds.get(name, (-math.inf, math.inf))
        return tuple(sorted({u for u in found if low <= u <= high} or {low, high}))

    def _levels(self) -> dict[str, tuple[float, ...]]:
        """Return the values of each name that matter, in order."""
        tried = [0.0, *(s * 10.0**k for k in POWERS for s in (1.0, -1.0))]
        probes = {name: self.within(name, tried) for name in self.free}
        sizes = self._sizes()
        found = {name: self._chosen(name, sizes.get(name, ()), ()) for name in self.free}
        relations = {full for pairs in self.pairs.values() for _, full in pairs}
        for _ in range(2):
            alone: dict[str, set[float]] = {name: set() for name in self.free}
            beside: dict[str, set[float]] = {name: set() for name in self.free}
            for relation in relations:
                mine = self.names(relation) & {*self.free}
                for name, values in self._turns(relation, found, probes, FEW):
                    (alone if len(mine) == 1 else beside)[name].add(values[name])
            found = {
                name: self._chosen(name, [*alone[name], *sizes.get(name, ())], beside[name])
                for name in self.free
            }
        return found

    def _sizes(self) -> dict[str, list[float]]:
        """Return the scales of a model by name."""
        scales = scales_of(self.contact)
        found = {name: [*row] for name, row in scales.variables.items()}
        speeds = [scales.v, scales.speed, *([] if self.curve is None else [self.curve.v_s])]
        found |= dict.fromkeys(self.chart.velocities, speeds)
        return {**found, "x": [scales.x]}

    def _chosen(
        self, name: str, sure: Iterable[float], other: Iterable[float]
    ) -> tuple[float, ...]:
        """Return what is tried of a name: what is critical, its halves and doubles, and 0."""
        sizes = _sizes(sure)[:3]
        more = [u for u in _sizes(other) if u not in sizes]
        sizes += more[:: max(1, len(more) // 2)][:2] if len(sizes) < 3 else []
        sizes = sizes or [1.0]
        found = [0.0, *(s * k * u for u in sizes for k in (1.0, 0.5, 2.0) for s in (1.0, -1.0))]
        low, high = self.bounds.get(name, (-math.inf, math.inf))
        found += [u for u in (low, high, 0.5 * (low + high)) if math.isfinite(u)]
        return self.within(name, found)

    def _combinations(
        self, names: Sequence[str], levels: Mapping[str, Sequence[float]], most: int
    ) -> Iterator[dict[str, float]]:
        """Yield values of names, at most so many, in a random order if there are more."""
        if math.prod(len(levels[name]) for name in names) <= most:
            for values in itertools.product(*(levels[name] for name in names)):
                yield dict(zip(names, values, strict=True))
            return
        for _ in range(most):
            yield {name: self.dice.choice(levels[name]) for name in names}

    def _turns(
        self,
        relation: Relation,
        levels: Mapping[str, Sequence[float]],
        probes: Mapping[str, Sequence[float]],
        most: int,
        beside: Iterable[str] = (),
    ) -> Iterator[tuple[str, dict[str, float]]]:
        """Yield points at which a comparison turns, and the name along which."""
        mine = [name for name in self.free if name in self.names(relation)]
        every = [name for name in self.free if name in {*mine, *beside}]
        for name in mine:
            others = [each for each in every if each != name]
            for values in self._combinations(others, levels, most):
                signs = [self._sign(relation, {**values, name: u}) for u in probes[name]]
                for i, j in itertools.pairwise(range(len(signs))):
                    if signs[i] * signs[j] < 0 or (signs[i] != 0) != (signs[j] != 0):
                        a, b = probes[name][i], probes[name][j]
                        for place in self._bisected(relation, values, name, a, b):
                            yield name, {**values, name: place}

    def _sign(self, relation: Relation, values: Mapping[str, float]) -> float:
        margin = self.margin(relation, values)
        return math.nan if math.isnan(margin) else float((margin > 0) - (margin < 0))

    def _bisected(
        self, relation: Relation, values: Mapping[str, float], name: str, a: float, b: float
    ) -> list[float]:
        """Return neighbouring floats between which a comparison turns; about 0, small ones."""

        def sign(u: float) -> float:
            return self._sign(relation, {**values, name: u})

        smallest, ends, found = NEAR_ZERO * max(abs(a), abs(b)), (sign(a), sign(b)), list[float]()
        for wanted in [each for each in ends if each != 0.0 and each == each]:
            low, high = (a, b) if ends[0] == wanted else (b, a)
            while abs(high - low) > smallest or (low and high and abs(low) > smallest):
                middle = 0.5 * (low + high)
                if middle in (low, high):
                    break
                low, high = (middle, high) if sign(middle) == wanted else (low, middle)
            found += [high, low]
        return list(dict.fromkeys(found))

    # ------------------------------------------------------------------ what is asked for
    def turning(self, state: str) -> Iterator[TurningPoint]:
        """Yield for each comparison of each guard of a state where it decides, as far as found."""
        edges = [edge for _, edge in self.chart.leaving(state)]
        beside = {name for edge in edges for name in self.names(self.subject.guard(edge))}
        for edge in edges:
            held = (True, False) if self.subject.arrests(edge) else (False,)
            for number in range(len(self.pairs[edge.source, edge.name])):
                for still in held:  # an arrest is taken where the velocity is 0
                    points = self._turning(edge, number, self._levels_in(state, still), beside)
                    yield from points
                    if points:
                        break

    def _turning(
        self, edge: Transition, number: int, levels: Levels, beside: Set[str]
    ) -> list[TurningPoint]:
        """Return where a comparison decides; behind an earlier edge only if nowhere else."""
        alone: dict[bool, dict[str, float]] = {}
        behind: dict[bool, dict[str, float]] = {}
        relation, seen = self.pairs[edge.source, edge.name][number][1], 0
        for _, values in self._turns(relation, levels, levels, MOST_COMBINATIONS, beside):
            equal = self.margin(relation, values) == 0.0
            if (not equal and self._same(relation, values)) or not self._decides(
                edge, number, values
            ):
                continue
            seen += 1
            found = behind if self._earlier(edge, values) else alone
            found.setdefault(equal, values)
            if len(alone) == 2 or seen > PATIENCE:
                break
        both = {**behind, **alone}
        return [TurningPoint(edge, number, equal, values) for equal, values in both.items()]

    def _same(self, relation: Relation, values: Mapping[str, float]) -> bool:
        """Return whether a comparison is as true as where both sides are equal."""
        return self.holds(relation, values) == (relation.op in ("<=", ">="))

    def _levels_in(self, state: str, still: bool) -> Levels:
        """Return the levels in a state; a lock holds the velocities at 0."""
        zero = self.chart.velocities if still or self.subject.locked(state) else ()
        return {name: (0.0,) if name in zero else each for name, each in self.levels.items()}

    def _decides(self, edge: Transition, number: int, values: Mapping[str, float]) -> bool:
        """Return whether a comparison alone decides a guard."""
        decision = Decision.of(self.chart.guards[edge.name])
        vector = "".join(
            "1" if self.holds(full, values) else "0"
            for _, full in self.pairs[edge.source, edge.name]
        )
        return len(vector) == len(decision.comparisons) and decision.decides(vector, number)

    def _earlier(self, edge: Transition, values: Mapping[str, float]) -> bool:
        """Return whether an earlier edge is taken instead."""
        return any(
            self.holds(self.subject.guard(each), values)
            for each in earlier(self.subject, edge)
            if not self.subject.arrests(each)
        )


def _sizes(values: Iterable[float]) -> list[float]:
    """Return the sizes among some values, each once."""
    return sorted({float(f"{abs(u):.12g}") for u in values if 1e-12 < abs(u) < math.inf})
