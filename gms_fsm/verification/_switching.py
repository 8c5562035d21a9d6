"""Edges taken at one instant: which comes first, what it assigns, and whether it ever ends.

All machines are asked at once; each takes its first enabled edge, and they are asked again. Such
rounds of all elements are followed here, as the run takes them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations_with_replacement, islice
from typing import Any

from gms_fsm.charts.chart import Transition
from gms_fsm.language import Not, evaluate
from gms_fsm.verification._prover import (
    Answer,
    Dual,
    Duals,
    Prover,
    Reading,
    Undecided,
    enabled,
    names_of,
    refuted,
)
from gms_fsm.verification._subject import ChartSubject, force_name

MOST_QUESTIONS = 400  # to z3, about one instant
MOST_ROUNDS = 12


# --------------------------------------------------------------------------- one edge
def earlier(subject: ChartSubject, edge: Transition) -> list[Transition]:
    """Return the edges that leave the same state with precedence."""
    leaving = [each for _, each in subject.chart.leaving(edge.source)]
    return leaving[: [each.name for each in leaving].index(edge.name)]


def untaken(prover: Prover, edge: Transition, here: Duals, certain: bool) -> list[Any]:
    """Return the formulas under which no earlier edge is taken instead.

    An arrest has precedence only where the velocity does not jump. If the formulas must be
    `certain` to hold, those of arrests, and what is not encoded, are left out.
    """
    subject, found = prover.subject, []
    for each in earlier(subject, edge):
        if certain and subject.arrests(each):
            continue
        reading = Reading()
        try:
            formula = reading.truth(Not(subject.guard(each)), here)
            prover.defined(reading)
        except Undecided:
            if not certain:
                raise
        else:
            found.append(formula)
    return found


def is_hidden(prover: Prover, edge: Transition, before: Sequence[Transition]) -> bool:
    """Return whether one of these edges is enabled wherever another one is."""
    subject, reading = prover.subject, Reading()
    formulas = [reading.truth(subject.guard(edge), prover.still), *prover.within(edge.source)]
    formulas += [reading.truth(Not(subject.guard(each)), prover.still) for each in before]
    prover.defined(reading)
    return prover.find(*formulas) is None


def after(prover: Prover, reading: Reading, edge: Transition, here: Duals) -> dict[str, Dual]:
    """Return the values after an edge; F and a are those before it."""
    subject = prover.subject
    before = subject.before[edge.source, edge.name].items()
    held = {name: reading.value(tree, here) for name, tree in before}
    there = dict(here)
    for name, tree in subject.assigned(edge):
        there[name] = reading.value(tree, {**there, **held})
    zero = prover.z3.RealVal(0)
    return there | dict.fromkeys(subject.landed(edge), Dual(zero, zero))


def changed(subject: ChartSubject, edges: Sequence[Transition]) -> frozenset[str]:
    """Return the names that edges assign."""
    return frozenset(
        name
        for edge in edges
        for name in (*(name for name, _ in subject.assigned(edge)), *subject.landed(edge))
    )


def follow_impulses(subject: ChartSubject, edges: Sequence[Transition]) -> None:
    """Raise `Undecided` if edges set the velocity, and what follows from that is not encoded."""
    sets = {name for edge in edges for name, _ in subject.assigned(edge)}
    if not sets & {*subject.chart.velocities}:
        return
    if any(map(subject.arrests, edges)):
        raise Undecided("an arrest is not taken where an impulse changes the velocity")
    if subject.facts.jumping:
        raise Undecided("inputs jump with an impulse")


def read_by(subject: ChartSubject, edges: Sequence[Transition]) -> frozenset[str]:
    """Return the names that decide which edges are taken on the way, and what these do."""
    sources = {edge.source for edge in edges}
    asked = [each for each in subject.chart.transitions if each.source in sources]
    return names_of(*(tree for edge in asked for tree in subject.trees(edge)))


# --------------------------------------------------------------------------- in floats
def endless(
    subject: ChartSubject, states: Sequence[str], points: Sequence[Mapping[str, float]]
) -> bool:
    """Return whether machines, asked in floats, come back to where they were without a pause."""
    states, here = list(states), [dict(point) for point in points]
    seen: list[tuple[list[str], list[dict[str, float]]]] = []
    for _ in range(4 * MOST_ROUNDS):
        if (states, here) in seen:
            return True
        seen.append((list(states), [dict(point) for point in here]))
        try:
            _share(subject, states, here)
            edges = [_first(subject, *each) for each in zip(states, here, strict=True)]
            if not any(edges):
                return False
            for i, edge in enumerate(edges):
                if edge is not None:
                    _take(subject, edge, here[i])
                    states[i] = edge.target
        except (ArithmeticError, ValueError):
            return False
    return False


def _first(subject: ChartSubject, state: str, here: Mapping[str, float]) -> Transition | None:
    leaving = (edge for _, edge in subject.chart.leaving(state))
    return next((edge for edge in leaving if enabled([subject.guard(edge)], here)), None)


def _take(subject: ChartSubject, edge: Transition, here: dict[str, float]) -> None:
    before = subject.before[edge.source, edge.name].items()
    held = {name: evaluate(tree, here) for name, tree in before}
    for name, tree in subject.assigned(edge):
        here[name] = evaluate(tree, {**here, **held})
    here |= dict.fromkeys(subject.landed(edge), 0.0)


def _share(subject: ChartSubject, states: Sequence[str], here: list[dict[str, float]]) -> None:
    """Give each of several elements the force of the others."""
    for force, rest in subject.rest.items() if len(here) > 1 else ():
        own = [evaluate(subject.own[q][force], at) for q, at in zip(states, here, strict=True)]
        for i, at in enumerate(here):
            at[rest] = sum(own[:i] + own[i + 1 :])


# --------------------------------------------------------------------------- several at once
def may_change(prover: Prover) -> frozenset[str]:
    """Return the names that other elements, and other contacts, can change within an instant."""
    subject, facts, chart = prover.subject, prover.subject.facts, prover.chart
    found = {*subject.rest.values(), *facts.jumping}
    if facts.pulled and subject.moves:
        loads = (force_name(subject.load, chart, force) for force in chart.force_names)
        found |= {*loads, subject.mobility}
    if facts.struck or (facts.n > 1 and chart.sets_velocity):
        found |= {*chart.velocities}
    return frozenset(found & {*prover.symbols})


def renewed(prover: Prover, here: Duals, mark: str) -> tuple[dict[str, Dual], list[Any]]:
    """Return names in which what others can change has other values and rates."""
    real, subject = prover.z3.Real, prover.subject
    fresh = {
        name: Dual(real(f"{name}{mark}"), real(f"d{name}/dt{mark}")) for name in may_change(prover)
    }
    assumed = [fresh[subject.mobility].value > 0] if subject.mobility in fresh else []
    return {**here, **fresh}, assumed


def others_switch(prover: Prover) -> bool:
    """Return whether it is not only other elements that change something within an instant."""
    return bool(may_change(prover) - {*prover.subject.rest.values()})


def others(prover: Prover) -> str:
    """Return in words what may happen at the same instant."""
    facts = prover.subject.facts
    if others_switch(prover):
        return "switches of other contacts" if facts.pulled or facts.struck else "jumps of inputs"
    return "switches of other elements"


def interrupted(prover: Prover, cycles: Sequence[tuple[Transition, ...]]) -> Answer | None:
    """Prove that no cycle can be passed, whatever others do meanwhile; None if one can."""
    for cycle in cycles:
        reading, here = Reading(), dict(prover.still)
        formulas = prover.within(cycle[0].source)
        for number, edge in enumerate(cycle):
            if number:
                here, assumed = renewed(prover, here, f"!{number}")
                formulas += assumed
            formulas.append(reading.truth(prover.subject.guard(edge), here))
            formulas += untaken(prover, edge, here, certain=True)
            if prover.subject.arrests(edge):  # not where the velocity has jumped
                for name in prover.chart.velocities:
                    v, began = here[name].value, prover.symbols[name]
                    formulas.append(prover.z3.Or(v == began, v == 0))
            here = after(prover, reading, edge, here)
        prover.defined(reading)
        if prover.find(*formulas) is not None:
            return None
    text = f"no cycle can be passed at one instant, even with {others(prover)}"
    return Answer("proved", text)


@dataclass
class Walks:
    """The rounds that elements can take at one instant, searched until none is left."""

    prover: Prover
    n: int
    questions: int = 0
    assigned: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        subject, chart = self.prover.subject, self.prover.chart
        self.assigned = changed(subject, chart.transitions)
        if self.n > 1 and self.prover.unfollowed:
            raise Undecided(self.prover.unfollowed)
        if self.n > 1 and (chart.sets_velocity or any(subject.before.values())):
            raise Undecided("elements that read F in actions, or set v, are not followed together")

    def search(self) -> Answer:
        """Return whether the elements can switch for ever at one instant."""
        for states in combinations_with_replacement(
            [state.name for state in self.prover.chart.states], self.n
        ):
            here: list[dict[str, Dual]] = [dict(self.prover.still)]
            here += map(dict, islice(self.prover.others, self.n - 1))
            formulas = self.prover.within(states[0]) if self.n == 1 else []
            if (found := self.follow([(states, here)], [], formulas, [])) is not None:
                return found
        who = f"the {self.n} elements together" if self.n > 1 else "cycles by turns"
        return Answer("proved", f"{who} come to an end at each instant")

    def follow(
        self,
        path: list[tuple[tuple[str, ...], list[dict[str, Dual]]]],
        edges: list[Transition],
        formulas: list[Any],
        strict: list[Any],
    ) -> Answer | None:
        """Follow all rounds from the end of a path; return a refutation if one is found."""
        prover, (states, here) = self.prover, path[-1]
        if len(path) > MOST_ROUNDS:
            raise Undecided(f"only {MOST_ROUNDS} rounds were followed, with different values")
        for taken, more, tight in self.rounds(states, self.shared(states, here)):
            held, firm = [*formulas, *more], [*strict, *tight]
            if not self.possible(held):
                continue
            there = []
            for names, edge in zip(here, taken, strict=True):
                reading = Reading()
                there.append(names if edge is None else after(prover, reading, edge, names))
                prover.defined(reading)
            target = tuple(
                state if edge is None else edge.target
                for state, edge in zip(states, taken, strict=True)
            )
            walk = [*edges, *(edge for edge in taken if edge is not None)]
            for before, values in path:
                if before == target:
                    closed = [
                        new[name].value == old[name].value
                        for new, old in zip(there, values, strict=True)
                        for name in sorted(self.assigned)
                    ]
                    if self.possible([*held, *firm, *closed]):
                        return self.refutation(path[0], walk, [*held, *firm, *closed])
            found = self.follow([*path, (target, there)], walk, held, firm)
            if found is not None:
                return found
        return None

    def possible(self, formulas: Sequence[Any]) -> bool:
        """Ask z3, but not for ever."""
        self.questions += 1
        if self.questions > MOST_QUESTIONS:
            raise Undecided(f"more than {MOST_QUESTIONS} ways to switch at one instant")
        return self.prover.find(*formulas) is not None

    def shared(
        self, states: Sequence[str], here: Sequence[Mapping[str, Dual]]
    ) -> list[dict[str, Dual]]:
        """Return the names of each element, with the force of the others."""
        found, subject = [dict(each) for each in here], self.prover.subject
        if self.n == 1:
            return found
        for force, rest in subject.rest.items():
            reading = Reading()
            own = [
                reading.value(subject.own[q][force], at) for q, at in zip(states, here, strict=True)
            ]
            self.prover.defined(reading)
            for i, each in enumerate(found):
                zero = self.prover.z3.RealVal(0)
                each[rest] = Dual(sum((u.value for u in own[:i] + own[i + 1 :]), zero), zero)
        return found

    def rounds(
        self, states: Sequence[str], here: Sequence[Duals]
    ) -> Iterator[tuple[tuple[Transition | None, ...], list[Any], list[Any]]]:
        """Yield the edges of a round, some of them None, and when they are taken."""
        ways: list[tuple[tuple[Transition | None, ...], list[Any], list[Any]]] = [((), [], [])]
        for state, names in zip(states, here, strict=True):
            options = self.options(state, names)
            ways = [
                ((*taken, edge), [*sure, *more], [*tight, *firm])
                for taken, sure, tight in ways
                for edge, more, firm in options
                if not taken or self.possible([*sure, *more])
            ]
        yield from (way for way in ways if any(way[0]))

    def options(
        self, state: str, names: Duals
    ) -> list[tuple[Transition | None, list[Any], list[Any]]]:
        """Return the edges that one element may take, and when."""
        prover, subject = self.prover, self.prover.subject
        found: list[tuple[Transition | None, list[Any], list[Any]]] = []
        leaving = [edge for _, edge in prover.chart.leaving(state)]
        reading = Reading()
        for edge in leaving:
            guard = reading.truth(subject.guard(edge), names)
            sure = untaken(prover, edge, names, certain=True)
            firm = untaken(prover, edge, names, certain=False)
            found.append((edge, [guard, *sure], firm))
        if self.n > 1:
            none = [reading.truth(Not(subject.guard(edge)), names) for edge in leaving]
            found.append((None, none, []))
        prover.defined(reading)
        return found

    def refutation(
        self,
        start: tuple[tuple[str, ...], list[dict[str, Dual]]],
        walk: Sequence[Transition],
        formulas: Sequence[Any],
    ) -> Answer:
        """Return an example, confirmed in floats."""
        prover, subject, (states, here) = self.prover, self.prover.subject, start
        follow_impulses(subject, walk)
        forces = [tree for each in subject.own.values() for tree in each.values()]
        # Of several elements some may wait, in states that the walk does not leave.
        asked = walk if self.n == 1 else prover.chart.transitions
        names = read_by(subject, asked) | self.assigned
        names |= names_of(*forces) if self.n > 1 else set()
        names -= {*subject.rest.values()} if self.n > 1 else set()
        own = names & {*subject.elements}
        called = {
            f"{name}{number}": (number, name)
            for number in range(2, self.n + 1)
            for name in sorted(own)
        }
        more = {text: here[number - 1][name].value for text, (number, name) in called.items()}
        point = prover.example(names, *formulas, more=more)
        if point is None:
            raise Undecided("fails over the reals, but no example was found")
        points = [{name: value for name, value in point.items() if name not in called}]
        for number in range(2, self.n + 1):
            mine = {name: point[text] for text, (k, name) in called.items() if k == number}
            points.append({**points[0], **mine})
        edges = tuple(dict.fromkeys(edge.name for edge in walk))
        who = f"{self.n} elements, in {', '.join(states)}, switch together" if self.n > 1 else ""
        text = f"{who or 'by turns they are taken'} at one instant: endless switching"
        answer = refuted(text, point, endless(subject, states, points))
        return replace(answer, where=(*states, *edges))


def by_turns(prover: Prover, n: int) -> Answer:
    """Return whether elements, or cycles by turns, can switch for ever at one instant."""
    return Walks(prover, n).search()
