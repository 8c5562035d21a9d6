"""Queries to the solver z3: texts as formulas over the reals, and answers with examples."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, TypeAlias

from gms_fsm.charts.nesting import AGE
from gms_fsm.errors import ExpressionError, ParameterError
from gms_fsm.foundation.extras import require
from gms_fsm.language import (
    CHOICES,
    COMPARISONS,
    EVENT,
    LARGEST_PRODUCT_POWER,
    LASTING,
    MATLAB_LIKE,
    Binary,
    Both,
    Call,
    Condition,
    Either,
    Name,
    Negative,
    Not,
    Number,
    Relation,
    Requirement,
    Value,
    evaluate,
    fold,
    integer_power,
    names_in,
    parse_condition,
    spell,
)
from gms_fsm.verification._subject import ChartSubject
from gms_fsm.verification.findings import Check, Finding, Status, listed

PATIENCE = 5.0  # s, per query to z3
MOST_OTHERS = 3  # elements whose forces are followed beside that of the element in question
HIGHEST_DEGREE = 16  # of a text as a polynomial; above it z3 runs out of memory before time
# Preferred numbers in an example, so that it is easy to follow.
NICE = tuple(Fraction(number) for number in (1, -1, 2, -2, 0, 0.5, -0.5, 3, -3, 0.25, -0.25, 4, -4))


def solver() -> Any:
    """Return the module z3; raise with installation advice if it is missing."""
    return require("z3", "check")


# --------------------------------------------------------------------------- texts over the reals
class Undecided(Exception):
    """A query could not be decided; the message is the reason."""


class GaveUp(Undecided):
    """A query could not be decided because z3 took too long."""


@dataclass(frozen=True)
class Dual:
    """A value and its slope: its one-sided rate of change, given the rates of the names."""

    value: Any
    slope: Any

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)


Duals: TypeAlias = Mapping[str, Dual]


class Reading:
    """Encodes the texts of one query; records denominators and the points where values jump."""

    def __init__(self) -> None:
        self.z3 = solver()
        self.denominators: list[tuple[Any, str]] = []
        self.breaks: list[Any] = []

    def value(self, node: Value, names: Duals) -> Dual:
        """Return a value with its slope."""
        _refuse_high_degree(node)
        return fold(node, _Formulas(self, names))

    def truth(self, condition: Condition, names: Duals) -> Any:
        """Return a condition as a formula."""
        return fold(condition, _Formulas(self, names))

    def margin(self, requirement: Requirement, names: Duals) -> Dual:
        """Return the margin of a requirement, positive where it holds."""
        pair = requirement.comparison
        left, right = self.value(pair.left, names), self.value(pair.right, names)
        if not requirement.holds:
            left, right = right, left
        return Dual(left.value - right.value, left.slope - right.slope)


class _Formulas:
    """The algebra of formulas over the reals, in which a value has a slope."""

    def __init__(self, reading: Reading, names: Duals) -> None:
        self.reading, self.names, self.z3 = reading, names, reading.z3
        self.zero, self.one = self.z3.RealVal(0), self.z3.RealVal(1)

    def number(self, value: float) -> Dual:
        return Dual(self.z3.RealVal(str(Fraction(value))), self.zero)

    def name(self, name: str) -> Dual:
        if name not in self.names:
            if name.startswith(EVENT):
                raise Undecided(f"the event {name.removeprefix(EVENT)} is not encoded")
            why = "" if name.startswith(LASTING) else " for a contact with several velocities"
            raise Undecided(f"{name} is not encoded{why}")
        return self.names[name]

    def negative(self, _: Negative, parts: Iterator[Dual]) -> Dual:
        return -next(parts)

    def binary(self, node: Binary, parts: Iterator[Dual]) -> Dual:
        a, b = parts
        match node.op:
            case "+":
                return Dual(a.value + b.value, a.slope + b.slope)
            case "-":
                return Dual(a.value - b.value, a.slope - b.slope)
            case "*":
                return _product(a, b)
        return self.quotient(a, b, node.right)

    def quotient(self, a: Dual, b: Dual, text: Value) -> Dual:
        self.reading.denominators.append((b.value, shown(text)))
        slope = (a.slope * b.value - a.value * b.slope) / (b.value * b.value)
        return Dual(a.value / b.value, slope)

    def power(self, node: Binary, parts: Iterator[Dual]) -> Dual:
        whole = integer_power(node.right)
        if whole is None:
            raise Undecided(
                f"only integer powers up to {LARGEST_PRODUCT_POWER} are encoded: {shown(node)}"
            )
        one = Dual(self.one, self.zero)
        result, factor = one, next(parts)
        for _ in range(abs(whole)):
            result = _product(result, factor)
        return self.quotient(one, result, node.left) if whole < 0 else result

    def call(self, node: Call, parts: Iterator[Dual]) -> Dual:
        match node.function:
            case "abs":
                return self.absolute(*parts)
            case "sgn":
                return self.sign(*parts)
            case "min":
                return self.least(*parts)
            case "max":
                return -self.least(*(-part for part in parts))
            case "floor":
                return self.floor(*parts)
            case "round":
                return self.nearest(*parts)
            case function if function in CHOICES:
                return self.choice(COMPARISONS[CHOICES[function]], *parts)
        raise Undecided(f"{node.function} is not encoded: {shown(node)}")

    def absolute(self, u: Dual) -> Dual:
        choose = self.z3.If
        corner = choose(u.slope >= 0, u.slope, -u.slope)
        slope = choose(u.value > 0, u.slope, choose(u.value < 0, -u.slope, corner))
        return Dual(choose(u.value >= 0, u.value, -u.value), slope)

    def sign(self, u: Dual) -> Dual:
        choose, one = self.z3.If, self.one
        self.reading.breaks.append(u.value)
        return Dual(choose(u.value > 0, one, choose(u.value < 0, -one, self.zero)), self.zero)

    def least(self, a: Dual, b: Dual) -> Dual:
        choose = self.z3.If
        corner = choose(a.slope <= b.slope, a.slope, b.slope)
        slope = choose(a.value < b.value, a.slope, choose(b.value < a.value, b.slope, corner))
        return Dual(choose(a.value <= b.value, a.value, b.value), slope)

    def floor(self, u: Dual) -> Dual:
        whole = self.z3.ToReal(self.z3.ToInt(u.value))
        self.reading.breaks.append(u.value - whole)
        return Dual(whole, self.zero)

    def nearest(self, u: Dual) -> Dual:
        choose, half = self.z3.If, self.z3.RealVal("1/2")
        whole = self.floor(Dual(u.value + half, u.slope)).value
        between = u.value + half == whole  # then the even one of two
        even = 2 * self.z3.ToReal(self.z3.ToInt(whole / 2))
        return Dual(choose(between, even, whole), self.zero)

    def choice(self, compare: Callable[[Any, Any], Any], a: Dual, b: Dual, *of: Dual) -> Dual:
        self.reading.breaks.append(a.value - b.value)
        holds = compare(a.value, b.value)
        yes, no = of
        return Dual(self.z3.If(holds, yes.value, no.value), self.z3.If(holds, yes.slope, no.slope))

    def relation(self, node: Relation, parts: Iterator[Dual]) -> Any:
        _refuse_high_degree(node.left)
        left = next(parts)
        _refuse_high_degree(node.right)
        return COMPARISONS[node.op](left.value, next(parts).value)

    def in_state(self, _element: int, _state: str) -> Any:
        raise TypeError("a guard depends on values, not on states")

    def negation(self, _: Not, parts: Iterator[Any]) -> Any:
        return self.z3.Not(next(parts))

    def both(self, _: Both, parts: Iterator[Any]) -> Any:
        return self.z3.And(list(parts))

    def either(self, _: Either, parts: Iterator[Any]) -> Any:
        return self.z3.Or(list(parts))


def _product(a: Dual, b: Dual) -> Dual:
    return Dual(a.value * b.value, a.slope * b.value + a.value * b.slope)


def shown(node: Value | Condition) -> str:
    """Return a tree as text, shortened if it is long."""
    text = spell(node, MATLAB_LIKE)
    return text if len(text) <= 60 else text[:57] + "..."


def _refuse_high_degree(node: Value) -> None:
    if (degree := _degree(node)) > HIGHEST_DEGREE:
        raise Undecided(f"a polynomial of degree {degree} is not attempted: {shown(node)}")


def _degree(node: Value) -> int:
    match node:
        case Number():
            return 0
        case Name():
            return 1
        case Binary("**", base, Number(power)):
            return int(_degree(base) * max(1.0, min(abs(power), 1e6)))
        case Binary("**", base, Negative(power)):
            return _degree(Binary("**", base, power))
        case Binary("*" | "/"):
            return sum(map(_degree, node.parts))
    return max(map(_degree, node.parts))


# --------------------------------------------------------------------------- asking
@dataclass(frozen=True)
class Answer:
    status: Status
    text: str
    counterexample: Mapping[str, float] = field(default_factory=dict)
    where: tuple[str, ...] = ()  # in place of what was asked about


class Prover:
    """The names of a chart, as its subject has them, as real symbols within the domain."""

    def __init__(self, subject: ChartSubject, domain: Sequence[str]) -> None:
        self.chart, self.subject, self.z3 = subject.chart, subject, solver()
        real, zero = self.z3.Real, self.z3.RealVal(0)
        # In the order in which an example fixes them: constants, inputs, variables.
        names = (*self.chart.parameter_names, *self.subject.inputs, *self.subject.variables)
        self.symbols = {name: real(name) for name in names}
        self.rates = {f"d{name}/dt": real(f"d{name}/dt") for name in self.subject.inputs}
        self.still = {name: Dual(symbol, zero) for name, symbol in self.symbols.items()}
        self.domain = [self._assumed(text, self.still) for text in domain]
        try:
            empty = self.find() is None
        except GaveUp:
            empty = False
        if empty:
            raise ParameterError(
                f"the domain {', '.join(domain)} is empty", advice="loosen its conditions"
            )

        self.others: list[dict[str, Dual]] = []
        self.unfollowed = ""  # why the force of the other elements is free
        if subject.rest:
            try:
                self.domain += self._rest(domain)
            except Undecided as reason:
                self.unfollowed = f"the force of the other elements is not followed: {reason}"

    def _rest(self, domain: Sequence[str]) -> list[Any]:
        """Return what the states and values of the other elements make of their force."""
        subject, real, z3 = self.subject, self.z3.Real, self.z3
        if not subject.shared:
            raise Undecided("here it only accelerates the bodies")
        if subject.facts.n - 1 > MOST_OTHERS:
            raise Undecided(f"there are {subject.facts.n - 1}")
        own, formulas = {*subject.elements}, []
        sums = {force: z3.RealVal(0) for force in subject.rest}
        for number in range(2, subject.facts.n + 1):
            mine = {name: Dual(real(f"{name}#{number}"), z3.RealVal(0)) for name in own}
            here, some = {**self.still, **mine}, []
            parts = {force: real(f"{force}#{number}") for force in sums}
            for forces in subject.own.values():
                reading = Reading()
                equal = [parts[f] == reading.value(tree, here).value for f, tree in forces.items()]
                some.append(z3.And(*equal, *(below != 0 for below, _ in reading.denominators)))
            formulas.append(z3.Or(some))
            for text in domain:
                if names_in(parse_condition(text, self.symbols)) & own:
                    formulas.append(self._assumed(text, here))
            sums = {force: total + parts[force] for force, total in sums.items()}
            self.others.append(here)
        return [*formulas, *(self.symbols[subject.rest[f]] == total for f, total in sums.items())]

    def _assumed(self, text: str, names: Duals) -> Any:
        reading = Reading()
        try:
            formula = reading.truth(parse_condition(text, self.symbols), names)
        except ExpressionError as error:
            raise error.at("domain") from None
        except Undecided as reason:
            raise ParameterError(
                f"domain {text!r}: {reason}", advice="write it differently"
            ) from None
        if reading.denominators:
            raise ParameterError(
                f"domain {text!r}: it contains a division",
                advice="write it without one, for example 'z > s' for 'z / s > 1'",
            )
        return formula

    def within(self, *states: str, waits: bool = True) -> list[Any]:
        """Return what holds in states: a lock holds the velocities at 0, and no stay is too long.

        An edge that is taken after a time ends a stay there; at ticks, at the next of them.
        """
        z3, subject, reading = self.z3, self.subject, Reading()
        found: list[Any] = []
        if any(map(subject.locked, states)):
            found += [self.symbols[name] == 0 for name in self.chart.velocities]
        late = z3.RealVal(str(Fraction(subject.facts.period or 0.0)))
        for state in states:
            for _, length in subject.waits(state) if waits else ():
                try:
                    end = reading.value(length, self.still).value
                except Undecided:
                    continue
                if not reading.denominators:
                    age = self.symbols[AGE]
                    found.append(z3.Or(age <= end + late, age <= late))
        return found

    def apart(self, point_of: frozenset[str]) -> None:
        """Raise `Undecided` if it is not known that a point with these names can be."""
        rest = {*self.subject.rest.values()}
        if point_of & rest and self.unfollowed:
            raise Undecided(self.unfollowed)
        if point_of & {f"d{name}/dt" for name in rest}:
            raise Undecided("how fast the force of the other elements changes is not followed")

    def find(self, *formulas: Any) -> Any:
        """Return a model of the formulas within the domain, or None."""
        solver = self.z3.SolverFor("QF_NRA")
        solver.set("timeout", int(1000 * PATIENCE))
        solver.add(*self.domain, *formulas)
        answer = solver.check()
        if answer == self.z3.unknown:
            raise GaveUp(f"z3 gave up after {PATIENCE:g} s")
        return solver.model() if answer == self.z3.sat else None

    def example(
        self, names: frozenset[str], *formulas: Any, more: Mapping[str, Any] | None = None
    ) -> dict[str, float] | None:
        """Return a point that satisfies the formulas, of simple numbers exact in floats.

        `more` are symbols beside those of the names.
        """
        model = self.find(*formulas)
        if model is None:
            return None
        self.apart(names)
        constants = len(self.chart.parameters)
        order = list(self.symbols.items())
        order[constants:constants] = self.rates.items()
        wanted = {name: symbol for name, symbol in order if name in names}
        wanted |= more or {}
        held, found = list(formulas), {}
        deadline = time.monotonic() + PATIENCE
        for name, symbol in wanted.items():
            value = model.evaluate(symbol, model_completion=True)
            for number in _candidates(_rational(value)):
                equal = symbol == self.z3.RealVal(str(number))
                if not self.z3.is_true(model.evaluate(equal, model_completion=True)):
                    if time.monotonic() > deadline or (other := self._maybe(*held, equal)) is None:
                        continue
                    model = other
                held.append(equal)
                found[name] = float(number)
                break
            else:
                values = {n: model.evaluate(u, model_completion=True) for n, u in wanted.items()}
                near = ", ".join(f"{n} = {_about(_rational(u))}" for n, u in values.items())
                raise Undecided(
                    f"fails over the reals near {near}, but no such point was found in floats"
                )
        return found

    def _maybe(self, *formulas: Any) -> Any:
        try:
            return self.find(*formulas)
        except GaveUp:
            return None

    def defined(self, reading: Reading, *case: Any) -> None:
        """Raise `Undecided` unless all quotients are defined within the domain."""
        for denominator, text in reading.denominators:
            if self.find(*case, denominator == 0) is not None:
                raise Undecided(
                    f"the denominator {text} can be 0 within the domain; exclude that, "
                    f"for example domain=['{text} > 0', ...]"
                )

    def settle(
        self,
        check: Check,
        where: tuple[str, ...],
        question: Callable[..., Answer],
        *about: object,
        case: str = "",
    ) -> Finding:
        """Run a query and return the answer, or the reason why there is none."""
        try:
            answer = question(self, *about)
        except Undecided as reason:
            answer = Answer("undecided", str(reason))
        where = answer.where or where
        return Finding(check, answer.status, where, answer.text, answer.counterexample, case)


def _rational(value: Any) -> Fraction:
    exact = value if hasattr(value, "as_fraction") else value.approx(30)
    fraction: Fraction = exact.as_fraction()
    return fraction


def _about(value: Fraction) -> str:
    try:
        return f"{float(value):.6g}"
    except OverflowError:
        return "outside the range of floats"


def _candidates(value: Fraction) -> Iterator[Fraction]:
    """Yield numbers that are exact in floats: simple ones, then ever closer to a value."""
    yield from NICE
    for scale in (2**4, 2**10, 2**20):
        middle = round(value * scale)
        for number in (Fraction(n, scale) for n in (middle, middle - 1, middle + 1)):
            if abs(number.numerator) < 2**53:
                yield number
    try:
        near = float(value)
    except OverflowError:
        return
    for close in (near, math.nextafter(near, math.inf), math.nextafter(near, -math.inf)):
        if math.isfinite(close):
            yield Fraction(close)


def enabled(guards: Sequence[Condition], point: Mapping[str, float]) -> bool:
    """Return whether the guards are true in floats, as the machine evaluates them."""
    try:
        return all(evaluate(guard, point) for guard in guards)
    except (ArithmeticError, ValueError):
        return False


def refuted(text: str, point: Mapping[str, float], seen: bool = True) -> Answer:
    return by_example("refuted", text, point, seen)


def by_example(status: Status, text: str, point: Mapping[str, float], seen: bool) -> Answer:
    if not seen:
        raise Undecided(f"fails over the reals at {listed(point)}, but rounding hides it in floats")
    return Answer(status, text, point)


def names_of(*trees: Value | Condition) -> frozenset[str]:
    return frozenset[str]().union(*map(names_in, trees))
