"""Questions about two texts: equal for all values, or a point at which they differ."""

from __future__ import annotations

import functools
import math
import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import MissingExtraError, ParameterError
from gms_fsm.language import (
    CHOICES,
    EVENT,
    Binary,
    Call,
    Condition,
    Name,
    Value,
    evaluate,
    integer_power,
    names_in,
    parse_condition,
)
from gms_fsm.language.tree import rebuilt, walk
from gms_fsm.verification._prover import NICE, Prover, Reading, Undecided
from gms_fsm.verification._subject import subject_of
from gms_fsm.verification.facts import ContactFacts
from gms_fsm.verification.sameness.canonical import canonical, rewritten

ENCODED = {"abs", "sgn", "min", "max", "floor", "round", *CHOICES}
TRIES = 400  # points at which what is not encoded is compared
ROUNDING = 1e-12, 0.0  # of the larger of two values, and of any: known to differ over the reals
CLEARLY = 1e-7, 1e-9  # the same, where that is not known
NUDGE = 1e-7  # a difference that ends so near by is one of rounding
Point: TypeAlias = dict[str, float]
Limits: TypeAlias = tuple[float, float]
Sides: TypeAlias = tuple[Sequence[Value | Condition], Sequence[Value | Condition]]
Differs: TypeAlias = Callable[[Point, Limits], str]


class Differ(Exception):
    """Two texts differ; the message says in what, `point` where."""

    def __init__(self, what: str, point: Mapping[str, float] | None = None) -> None:
        super().__init__(what)
        self.what, self.point = what, dict(point or {})


@dataclass(frozen=True)
class Opaque:
    """Parts of trees that are not encoded, which stand as names: equal texts are equal values."""

    parts: dict[str, Value]

    def hidden(self, tree: Value) -> Value:
        """Return a value in which such parts are names."""
        match tree:
            case Call(function) if function not in ENCODED:
                return self._named(tree)
            case Binary("**", _, exponent) if integer_power(exponent) is None:
                return self._named(tree)
        return rebuilt(tree, self.hidden)

    def _named(self, tree: Value) -> Value:
        text = canonical(tree)
        self.parts[text] = tree
        return Name(text)


class Questioner:
    """Compares texts of two charts, in the names of the second, within its rules.

    Parameters
    ----------
    chart : Chart
        The second chart.
    trees : iterable of Value or Condition
        All that will be asked about.
    loose : frozenset of str
        Names whose values in the two charts may differ: what differs by them is undecided.
    ruled : bool
        Whether the rules of its names are assumed.
    """

    def __init__(
        self,
        chart: Chart,
        trees: Iterable[Value | Condition],
        loose: frozenset[str] = frozenset(),
        *,
        ruled: bool = True,
    ) -> None:
        self.chart, self.loose, self.opaque = chart, loose, Opaque({})
        every = [*trees]
        shown = [rewritten(tree, self.opaque.hidden) for tree in every]
        names = {name for tree in (*every, *shown) for name in names_in(tree)}
        self.names = sorted(names - {*chart.parameter_names})
        known = {*chart.parameter_names, *self.names}
        self.rules = tuple(
            f"{name} {bound.text}"
            for name, each in chart.declared.items()
            if name in known and ruled
            for bound in each.bounds
        )

    @functools.cached_property
    def prover(self) -> Prover | MissingExtraError:
        """What asks z3; or why there is none."""
        subject = subject_of(ContactFacts(self.chart))
        plain = replace(subject, inputs=tuple(self.names), variables=(), rest={}, moves=False)
        try:
            return Prover(plain, self.rules)
        except MissingExtraError as error:
            return error

    def asked(self) -> Prover:
        """Return the prover; `Undecided` if z3 is not installed."""
        if isinstance(self.prover, MissingExtraError):
            raise Undecided(f"the texts differ, and {self.prover}")
        return self.prover

    # ------------------------------------------------------------------ what is asked
    def same_value(self, one: Value, other: Value, what: str, locked: bool = False) -> None:
        """Raise `Differ` or `Undecided` unless two values are equal everywhere."""
        if canonical(one) == canonical(other):
            return

        def differ(point: Point, least: Limits) -> str:
            return what if apart(one, other, point, least) else ""

        def formula(prover: Prover, reading: Reading) -> Any:
            u, w = (
                reading.value(self.opaque.hidden(each), prover.still).value for each in (one, other)
            )
            return u != w

        self.settle(((one,), (other,)), formula, differ, what, locked)

    def same_truth(self, one: Condition, other: Condition, what: str) -> None:
        """Raise `Differ` or `Undecided` unless two conditions hold at the same points."""
        if canonical(one) == canonical(other):
            return

        def differ(point: Point, _: Limits) -> str:
            return what if bool(evaluate(one, point)) != bool(evaluate(other, point)) else ""

        def formula(prover: Prover, reading: Reading) -> Any:
            u, w = (self.truth(each, prover, reading) for each in (one, other))
            return u != w

        self.settle(((one,), (other,)), formula, differ, what, False)

    def truth(self, tree: Condition, prover: Prover, reading: Reading) -> Any:
        """Return a condition as a formula."""
        return reading.truth(rewritten(tree, self.opaque.hidden), prover.still)

    def settle(
        self,
        sides: Sides,
        formula: Callable[[Prover, Reading], Any],
        differ: Differs,
        what: str,
        locked: bool,
    ) -> None:
        """Raise `Differ` where a formula can hold, and floats agree; `Undecided` if not known.

        `sides` are the texts of both charts that the formula is made of.
        """
        trees = (*sides[0], *sides[1])
        names = frozenset[str]().union(*map(names_in, trees))
        hidden = frozenset[str]().union(
            *(names_in(rewritten(tree, self.opaque.hidden)) for tree in trees)
        )
        try:
            prover, reading = self.asked(), Reading()
            asked = [formula(prover, reading), *self._within(prover, names, locked)]
            if prover.find(*asked) is None:
                self._defined(prover, sides, asked[1:])
                return
            if names & self.loose:
                raise Undecided("histories and durations are compared by their texts only")
            if not hidden & self.opaque.parts.keys():
                self._example(prover, reading, names, asked, differ)
        except Undecided as reason:
            self._tried(names, differ, locked)
            raise Undecided(f"{what}: {reason}") from None
        self._tried(names, differ, locked)
        some = ", ".join(sorted(hidden & self.opaque.parts.keys()))
        raise Undecided(f"{what}: {some} is not encoded, and the texts differ")

    def _defined(self, prover: Prover, sides: Sides, within: list[Any]) -> None:
        """Raise `Undecided` if only one of the charts divides by what can be 0."""
        one, other = (
            {canonical(node): node for tree in side for node in self._partial(tree)}
            for side in sides
        )
        for text in one.keys() ^ other.keys():
            node, reading = (one | other)[text], Reading()
            if text not in self.opaque.parts:
                below = reading.value(self.opaque.hidden(node), prover.still).value
                if prover.find(below == 0, *within) is None:
                    continue
            raise Undecided(f"only one of them has {text}, which may be undefined or a divisor 0")

    def _partial(self, tree: Value | Condition) -> Iterator[Value]:
        """Yield what a tree divides by, and what of it is not encoded."""
        for node in walk(tree):
            match node:
                case Binary("/", _, below):
                    yield below
                case Binary("**", base, exponent):
                    if (integer_power(exponent) or 0) < 0:
                        yield base
                    if canonical(node) in self.opaque.parts:
                        yield node
                case Call() if canonical(node) in self.opaque.parts:
                    yield node

    def _example(
        self,
        prover: Prover,
        reading: Reading,
        names: frozenset[str],
        asked: list[Any],
        differ: Differs,
    ) -> None:
        """Raise `Differ` with an example; `Undecided` if they differ where nothing is defined."""
        defined = [below != 0 for below, _ in reading.denominators]
        point = prover.example(names, *asked, *defined)
        if point is None:
            texts = ", ".join(dict.fromkeys(text for _, text in reading.denominators))
            raise Undecided(f"the denominator {texts} can be 0 within the rules")
        try:
            said = differ(point, ROUNDING)
        except (ArithmeticError, ValueError):
            said = ""
        if not said:
            raise Undecided("they differ over the reals, but rounding hides it in floats")
        raise Differ(said, point)

    def _within(self, prover: Prover, names: frozenset[str], locked: bool) -> list[Any]:
        """Return what holds of names by themselves: times are not negative, locks are at rest."""
        symbols, found = prover.symbols, list[Any]()
        for name in sorted(names):
            if name in self.chart.hidden:
                found.append(symbols[name] >= 0)
            if name.startswith(EVENT):
                found.append(prover.z3.Or(symbols[name] == 0, symbols[name] == 1))
            if locked and name in self._still:
                found.append(symbols[name] == 0)
        return found

    @property
    def _still(self) -> set[str]:
        """The names that are 0 while the contact is locked."""
        rates = {*self.chart.rate_names} - {*self.chart.parameter_names, *self.chart.variables}
        return {*self.chart.velocities} | rates

    # ------------------------------------------------------------------ in floats
    def _tried(self, names: frozenset[str], differ: Differs, locked: bool) -> None:
        """Raise `Differ` at one of many points, if it shows a difference."""
        if names & self.loose:
            return
        for point in self._points(names, locked):
            try:
                said = differ(point, CLEARLY)
                near = said and differ({n: u * (1.0 + NUDGE) for n, u in point.items()}, CLEARLY)
            except (ArithmeticError, ValueError):
                continue
            if near:
                raise Differ(said, {name: u for name, u in point.items() if name in names})

    def _points(self, names: frozenset[str], locked: bool) -> Iterator[Point]:
        """Yield points of simple numbers within the rules, the same ones every time."""
        dice = random.Random(1)
        simple = [float(each) for each in NICE] + [0.1, -0.1, 10.0, -10.0, 0.01, 100.0]
        every = {*names, *(n for rule in self.rules for n in self._named_in(rule))}
        rules = [parse_condition(rule, every) for rule in self.rules]
        for _ in range(TRIES):
            point = {name: dice.choice(simple) for name in sorted(every)}
            for name in every:
                if name.startswith(EVENT):
                    point[name] = float(dice.random() < 0.5)
                if name in self.chart.hidden:
                    point[name] = abs(point[name])
                if locked and name in self._still:
                    point[name] = 0.0
            if all(evaluate(rule, point) for rule in rules):
                yield point

    def _named_in(self, rule: str) -> frozenset[str]:
        return names_in(parse_condition(rule, {*self.chart.parameter_names, *self.names}))


def apart(one: Value, other: Value, point: Point, least: Limits) -> bool:
    """Return whether two values differ at a point, by more than rounding."""
    u, w = evaluate(one, point), evaluate(other, point)
    limit = least[0] * max(abs(u), abs(w)) + least[1]
    return math.isfinite(u) and math.isfinite(w) and abs(u - w) > limit


def empty(error: ParameterError) -> Undecided:
    """Return what is said where no values satisfy the rules."""
    return Undecided(f"no values satisfy the rules: {error.reason}")
