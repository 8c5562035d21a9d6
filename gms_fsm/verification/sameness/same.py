"""Whether two charts do the same for all values of their names, state by state.

Theory of operation. Under a matching of states and names (`matching`), two charts do the same if
each pair of states has the same flows and forces, and takes the same edge wherever it takes one.
Of the edges that leave a state the first enabled one is taken, so that the question is not whether
guards are equal, but whether the first enabled edges lead to the same: target, values, events. It
is asked of all edges, and again without those that lock the contact only where the velocity passes
0, which are not taken where it jumps. F, a, events and ages are free; what z3 does not know, such
as ``exp``, is equal where its text is equal.

*Equivalent* is said of the reals. *Different* comes with values at which both charts, evaluated in
floats, differ. Whatever is left is *undecided*, with the reason.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import ParameterError
from gms_fsm.language import (
    Both,
    Condition,
    Name,
    Value,
    evaluate,
    parse_condition,
)
from gms_fsm.language.normal import renamed_in
from gms_fsm.verification._prover import Prover, Reading, Undecided
from gms_fsm.verification.sameness.asking import (
    Differ,
    Limits,
    Point,
    Questioner,
    apart,
    empty,
)
from gms_fsm.verification.sameness.canonical import canonical
from gms_fsm.verification.sameness.matching import Matching, matchings
from gms_fsm.verification.sameness.meaning import EdgeMeaning, meaning_of

Verdict: TypeAlias = Literal["equal", "equivalent", "different", "undecided"]
PROVED = "z3 finds no values at which they differ"
SHOWN = 3  # names in a sentence
WRITTEN = "only names, order and spelling differ"
Edges: TypeAlias = Sequence[EdgeMeaning]


@dataclass(frozen=True)
class Sameness:
    """Whether two charts do the same.

    Parameters
    ----------
    verdict : {"equivalent", "different", "undecided"}
        The result.
    reason : str
        In words.
    point : mapping of str to float
        Values at which they differ, by the names of the second chart.
    """

    verdict: Verdict
    reason: str
    point: Mapping[str, float] = field(default_factory=dict)


def sameness(a: Chart, b: Chart) -> tuple[Sameness, Matching]:
    """Return whether two charts do the same, and what of one stands for what of the other.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT
    >>> found, _ = sameness(GMS_ELEMENT["signed"], GMS_ELEMENT["published"])  # doctest: +SKIP
    >>> found.reason  # doctest: +SKIP
    "the flow of 'z' in state 'slip' is another one"
    """
    first: tuple[Sameness, Matching] | None = None
    unknown: tuple[Sameness, Matching] | None = None
    for matching in matchings(a, b):
        found = _under(a, b, matching)
        if found.verdict == "equivalent":
            return found, matching
        if found.verdict == "undecided":
            unknown = unknown or (found, matching)
        first = first or (found, matching)
    assert first is not None  # there is at least one way
    return unknown or first


def _under(a: Chart, b: Chart, found: Matching) -> Sameness:
    """Return whether two charts do the same, under one matching."""
    try:
        _check_parts(a, b, found)
        pair = _Pair(a, b, found)
        undecided = [reason for reason in pair.checks() if reason]
    except Differ as error:
        if found.guessed:
            some = ", ".join(found.guessed[:SHOWN])
            more = f" and {len(found.guessed) - SHOWN} more"
            which = f"{some}{more if len(found.guessed) > SHOWN else ''}"
            reason = f"{error.what}, but {which} could be matched in another way"
            return Sameness("undecided", reason, error.point)
        return Sameness("different", error.what, error.point)
    except Undecided as reason:
        return Sameness("undecided", str(reason))
    except ParameterError as error:
        return Sameness("undecided", str(empty(error)))
    if undecided:
        return Sameness("undecided", undecided[0])
    by = PROVED if pair.proved else WRITTEN
    return Sameness("equivalent", by)


# --------------------------------------------------------------------------- what has a name
def _check_parts(a: Chart, b: Chart, found: Matching) -> None:
    """Raise `Differ` if something has no counterpart, or another kind of values."""
    for kind, pairs, own, other in (
        ("state", found.states, [s.name for s in a.states], [s.name for s in b.states]),
        ("variable", found.variables, _declared(a), _declared(b)),
        ("parameter", found.parameters, a.parameter_names, b.parameter_names),
    ):
        for name in own:
            if name not in pairs:
                raise Differ(f"{kind} {name!r} is in the first only")
        for name in other:
            if name not in pairs.values():
                raise Differ(f"{kind} {name!r} is in the second only")
    if len(a.velocities) != len(b.velocities):
        raise Differ("they have other numbers of velocities")
    if {found.names.get(n, n) for n in a.force_names} != {*b.force_names}:
        raise Differ("they give out other quantities")
    if found.states[a.default_state.name] != b.default_state.name:
        raise Differ("they begin in other states")
    for state in a.states:
        if state.locked != b.states[b.state_index(found.states[state.name])].locked:
            raise Differ(f"only one of them locks the contact in state {state.name!r}")
    for name, its in found.variables.items():
        if a.initial.get(name, 0.0) != b.initial.get(its, 0.0):
            raise Differ(f"variable {name!r} begins with another value")
    for each in (a.declared[name] for name in a.parameter_names):
        other_one = b.declared[found.parameters[each.name]]
        for what in ("unit", "per_element"):
            if getattr(each, what) != getattr(other_one, what):
                raise Differ(f"parameter {each.name!r} has another {what.replace('_', ' ')}")


def _declared(chart: Chart) -> list[str]:
    return [name for name in chart.variables if name not in chart.hidden]


class _Pair:
    """Two charts in the names of the second, and what is asked about them."""

    def __init__(self, a: Chart, b: Chart, found: Matching) -> None:
        self.a, self.b, self.found = a, b, found
        self.one, self.other = meaning_of(a, found.names), meaning_of(b)
        self.proved = False
        trees = [tree for said in (self.one, self.other) for _, tree in said.texts()]
        self.names = [name for name in self.other.chart.variables if name not in b.durations]
        self.names = [n for n in self.names if n in found.names.values()] + [*b.velocities]
        self.quiz = Questioner(b, [*trees, *map(Name, self.names)], found.loose)

    def checks(self) -> Iterator[str]:
        """Ask about everything; yield what is undecided, and raise `Differ` at what differs."""
        for question in self._questions():
            try:
                question()
            except Undecided as reason:
                yield str(reason)

    def _questions(self) -> Iterator[Any]:
        a, b, states = self.one, self.other, self.found.states
        yield self._rules
        for name in self.names:
            yield lambda name=name: self._value(
                a.start.get(name), b.start.get(name), name, f"what the start gives to {name!r}"
            )
        for force in self.b.force_names:
            yield lambda force=force: self._value(
                a.totals.get(force), b.totals.get(force), force, f"{force!r} of the contact"
            )
        for state, its in states.items():
            locked = self.b.states[self.b.state_index(its)].locked
            for name in self.names:
                if (its, name) in b.flows and (state, name) in a.flows:
                    yield lambda s=state, q=its, n=name, k=locked: self._value(
                        a.flows[s, n], b.flows[q, n], "", f"the flow of {n!r} in state {q!r}", k
                    )
            for force in self.b.force_names:
                one, other = a.forces[state, force], b.forces[its, force]
                if one is not None and other is not None:
                    yield lambda u=one, w=other, f=force, q=its, k=locked: self._value(
                        u, w, "", f"{f!r} in state {q!r}", k
                    )
            for some in (True, False):
                yield lambda s=state, q=its, k=locked, some=some: self._choice(
                    [e for e in a.edges[s] if some or not e.arrests],
                    [e for e in b.edges[q] if some or not e.arrests],
                    q,
                    k,
                )

    def _rules(self) -> None:
        """Ask whether the parameters may have the same values."""
        new: dict[str, Value] = {old: Name(its) for old, its in self.found.parameters.items()}
        every = []
        for chart in (self.a, self.b):
            texts = [f"{p.name} {bound.text}" for p in chart.parameters for bound in p.bounds]
            rules = [parse_condition(text, chart.parameter_names) for text in texts]
            every.append([renamed_in(r, new) if chart is self.a else r for r in rules])
        one, other = every
        if {*map(canonical, one)} == {*map(canonical, other)}:
            return
        self.proved = True
        quiz = Questioner(self.b, [*one, *other], ruled=False)
        quiz.same_truth(_all(one), _all(other), "the rules of the parameters")

    def _value(
        self, one: Value | None, other: Value | None, name: str, what: str, locked: bool = False
    ) -> None:
        one, other = (Name(name) if each is None else each for each in (one, other))
        if canonical(one) != canonical(other):
            self.proved = True
            self.quiz.same_value(one, other, f"{what} is another one", locked)

    # ------------------------------------------------------------------ the first enabled edge
    def _choice(self, one: Edges, other: Edges, state: str, locked: bool) -> None:
        """Ask whether the first enabled edge leads to the same."""
        pairs = {
            (i, k): self._outcomes(mine, its)
            for i, mine in enumerate([*one, None])
            for k, its in enumerate([*other, None])
        }
        texts = [canonical(each.guard) for each in one], [canonical(each.guard) for each in other]
        if texts[0] == texts[1] and all(pairs[i, i] == [] for i in range(len(one))):
            return
        self.proved = True
        what = f"the edge taken in state {state!r}"

        def differ(point: Point, least: Limits) -> str:
            i, k = _first(one, point), _first(other, point)
            values = pairs[i, k]
            if values is not None and not any(apart(u, w, point, least) for _, u, w in values):
                return ""
            mine, its = _named(one, i), _named(other, k)
            if mine == its:
                return f"edge {mine!r} does something else in state {state!r}"
            return f"{what} is another one: {mine} or {its}"

        def formula(prover: Prover, reading: Reading) -> Any:
            z3 = prover.z3
            taken = [_taken(self.quiz, edges, prover, reading) for edges in (one, other)]
            some = []
            for (i, k), values in pairs.items():
                if values == []:
                    continue
                both = [taken[0][i], taken[1][k]]
                for _, u, w in values or []:
                    one_, other_ = (
                        reading.value(self.quiz.opaque.hidden(each), prover.still).value
                        for each in (u, w)
                    )
                    some.append(z3.And(*both, one_ != other_))
                if values is None:
                    some.append(z3.And(*both))
            return z3.Or(some)

        left = [each for values in pairs.values() for each in values or []]
        mine: list[Value | Condition] = [each.guard for each in one]
        its: list[Value | Condition] = [each.guard for each in other]
        sides = [*mine, *(u for _, u, _ in left)], [*its, *(w for _, _, w in left)]
        self.quiz.settle(sides, formula, differ, what, locked)

    def _outcomes(
        self, one: EdgeMeaning | None, other: EdgeMeaning | None
    ) -> list[tuple[str, Value, Value]] | None:
        """Return the values that two edges may leave differently; None if more differs."""
        if one is None or other is None:
            return [] if one is other else None
        same = (
            self.found.states[one.edge.target] == other.edge.target
            and one.edge.impulse == other.edge.impulse
            and one.arrests == other.arrests
            and one.emits == other.emits
        )
        if not same:
            return None
        found = []
        for name in self.names:
            u, w = one.values.get(name, Name(name)), other.values.get(name, Name(name))
            if canonical(u) != canonical(w):
                found.append((name, u, w))
        return found


def _all(rules: list[Condition]) -> Condition:
    return Both(tuple(rules))


def _named(edges: Edges, number: int) -> str:
    return edges[number].edge.name if number < len(edges) else "none"


def _first(edges: Edges, point: Point) -> int:
    """Return the number of the first enabled edge, or how many there are."""
    return next((i for i, e in enumerate(edges) if evaluate(e.guard, point)), len(edges))


def _taken(quiz: Questioner, edges: Edges, prover: Prover, reading: Reading) -> list[Any]:
    """Return when each edge is the first enabled one, and when none is."""
    z3, found, before = prover.z3, list[Any](), list[Any]()
    for each in edges:
        guard = quiz.truth(each.guard, prover, reading)
        found.append(z3.And(guard, *before))
        before.append(z3.Not(guard))
    return [*found, z3.And(*before) if before else z3.BoolVal(True)]
