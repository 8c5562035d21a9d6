"""Prove statements about a chart from its own guards and flows, or refute them by an example.

Theory of operation. Every text of the chart becomes a formula over the real numbers, and the solver
z3 is asked for a point where the statement fails. *Proved* means that there is none within the
domain. *Refuted* comes with one such point; its numbers are exact in floats, and every guard named
was evaluated there. *Settled by order*: two edges are enabled at once, as such a point shows, and
the machine takes the earlier one of the chart; no fault, but another order is another model.
*Undecided* comes with the reason.

- Over the reals, not floats: a proof says nothing about rounding.
- Over points, not trajectories: a refuting point need not lie on the path of any run.
- Inputs (``s``, ``v``) and their rates (``ds/dt``, ``dv/dt``) are free symbols: that s is a
  function of v is not used, so no transcendental function is needed. The rates are the same in
  both states of a switch; in closed loop dv/dt can jump with the force, which is not followed.
- ``sgn``, ``abs``, ``min`` and ``max`` are split by case, whole powers are products. ``exp``,
  ``sqrt``, ``sin``, ``cos``, ``tanh`` and other powers are not encoded: undecided. A quotient
  counts only where the domain proves its denominator nonzero.
- Priorities settle what is enabled at once, and hide edges; the other checks do not use them.

The checks. *determinism*: no two edges of one state are enabled at once, or their order settles
which is taken. *livelock*: no edge and a way back are enabled at one point. *reachability*, of the
graph and the guards alone: every state can be entered and left, every guard can hold where no
earlier edge goes first. *chattering*: no two states whose flows cross the
surfaces of the guards between them in opposite directions, each into the other's guard (to first
order in time; edges that assign variables are undecided). *stability*: no state has an unstable
equilibrium, for flows linear in the variable.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import combinations, islice, product
from typing import Any, Literal, TypeAlias, get_args

from gms_fsm._extras import require
from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.errors import ExpressionError, ParameterError, shown
from gms_fsm.language.expression import (
    MATLAB_LIKE,
    Binary,
    Both,
    Call,
    Condition,
    Either,
    InState,
    Name,
    Negative,
    Not,
    Number,
    Relation,
    Split,
    Value,
    evaluate,
    names_in,
    parse_condition,
    parse_value,
    spell,
    split,
)
from gms_fsm.language.expression import Literal as Comparative

__all__ = ["CHECKS", "Check", "Finding", "Report", "Status", "default_domain", "prove"]

Check: TypeAlias = Literal["determinism", "livelock", "reachability", "chattering", "stability"]
Status: TypeAlias = Literal["proved", "settled by order", "refuted", "undecided"]
CHECKS: tuple[Check, ...] = get_args(Check)

PATIENCE = 5.0  # s, for one question to z3
MOST_CYCLES = 200  # ways back; a friction chart has a handful
MOST_WAYS = 64  # alternatives of a guard
HIGHEST_DEGREE = 16  # of a text as a polynomial; beyond it z3 needs memory before it needs time
LARGEST_POWER = 8

# What the names of the shipped charts mean, as their parameters are checked; C > 0 and not >= 0,
# because with C = 0 the slip flow is no law but a standstill.
ASSUMED: Mapping[str, str] = {
    "s": "s > 0",
    "v_c": "v_c > 0",
    "C": "C > 0",
    "k": "k > 0",
    "sigma": "sigma >= 0",
    "sigma_0": "sigma_0 > 0",
    "sigma_1": "sigma_1 >= 0",
}
# Numbers an example is made of where they fit: a reader should see through it.
NICE = tuple(Fraction(number) for number in (1, -1, 2, -2, 0, 0.5, -0.5, 3, -3, 0.25, -0.25, 4, -4))


# --------------------------------------------------------------------------- the report
@dataclass(frozen=True)
class Finding:
    """One statement about a chart, and what became of it.

    Parameters
    ----------
    check : {"determinism", "livelock", "reachability", "chattering", "stability"}
        What was asked.
    status : {"proved", "settled by order", "refuted", "undecided"}
        The answer.
    where : tuple of str
        The states and edges it is about, in the order they are passed.
    text : str
        The answer in words.
    counterexample : mapping of str to float
        A point that refutes the statement, or at which the order settles it, name by name, exact
        in floats; rates of inputs are called ``ds/dt``. Empty if there is none, or if no point is
        needed (a state that no edge enters).
    case : str
        What of a state is meant, for stability: ``"z for v < 0"``.
    """

    check: Check
    status: Status
    where: tuple[str, ...]
    text: str
    counterexample: Mapping[str, float] = field(default_factory=dict)
    case: str = ""

    def __str__(self) -> str:
        place = ", ".join(self.where) or "the chart"
        lines = [f"{self.status:<9}  {place}{', ' if self.case else ''}{self.case}: {self.text}"]
        if self.counterexample:
            lines.append(f"{'':<9}  for example at {self.example}")
        return "\n".join(lines)

    @property
    def example(self) -> str:
        """The counterexample as text."""
        return _listed(self.counterexample)


@dataclass(frozen=True)
class Report:
    """What was proved of a chart, what was refuted, and what stayed undecided.

    Parameters
    ----------
    chart : Chart
        The chart.
    domain : tuple of str
        What was assumed, as conditions.
    findings : tuple of Finding
        Every statement, check by check; each check has at least one.
    """

    chart: Chart
    domain: tuple[str, ...]
    findings: tuple[Finding, ...]

    @property
    def refuted(self) -> tuple[Finding, ...]:
        """The findings that are refuted."""
        return tuple(f for f in self.findings if f.status == "refuted")

    @property
    def settled(self) -> tuple[Finding, ...]:
        """The findings that the order of the edges settles."""
        return tuple(f for f in self.findings if f.status == "settled by order")

    def of(self, check: Check) -> tuple[Finding, ...]:
        """Return the findings of one check.

        Parameters
        ----------
        check : {"determinism", "livelock", "reachability", "chattering", "stability"}
            Which.

        Returns
        -------
        tuple of Finding
            At least one.
        """
        return tuple(f for f in self.findings if f.check == check)

    def __str__(self) -> str:
        count = {s: sum(f.status == s for f in self.findings) for s in get_args(Status)}
        lines = [
            self.chart.name,
            f"assumed: {', '.join(self.domain) or 'nothing'}",
            "over the reals, not floats; over points, not trajectories",
            "inputs and their rates (ds/dt, dv/dt) are free, but alike in both states of a switch",
        ]
        for check in CHECKS:
            lines += ["", check]
            lines += [f"  {line}" for f in self.of(check) for line in str(f).splitlines()]
        lines += ["", ", ".join(f"{n} {status}" for status, n in count.items())]
        return "\n".join(lines)


def _listed(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value!r}".removesuffix(".0") for name, value in values.items())


# --------------------------------------------------------------------------- the entrance
def default_domain(chart: Chart) -> tuple[str, ...]:
    """Return what is assumed of a chart unless told otherwise.

    Parameters
    ----------
    chart : Chart
        The chart.

    Returns
    -------
    tuple of str
        For each name of the shipped charts that its guards, flows or assignments use, the rule its
        value has to keep; nothing for other names.

    Examples
    --------
    >>> from gms_fsm.charts import LUGRE, gms_element
    >>> default_domain(gms_element("signed")), default_domain(LUGRE)
    (('s > 0', 'C > 0', 'v_c > 0'), ('s > 0', 'sigma_0 > 0'))
    """
    trees: list[Value | Condition] = [*chart.guards.values(), *chart.flows.values()]
    trees += [tree for texts in chart.assignments.values() for tree in texts.values()]
    used = frozenset[str]().union(*map(names_in, trees))
    symbols = chart.inputs + chart.parameters
    return tuple(ASSUMED[name] for name in symbols if name in ASSUMED and name in used)


def prove(chart: Chart, domain: Sequence[str] | None = None) -> Report:
    """Check a chart for every point of a domain at once.

    Parameters
    ----------
    chart : Chart
        The chart; only its own texts are read.
    domain : sequence of str, optional
        Conditions on its names that are taken for granted, for example ``["s >= 0", "v_c > 0"]``.
        Left out, `default_domain`.

    Returns
    -------
    Report
        Findings, each proved, refuted by an example, or undecided with the reason.

    Raises
    ------
    MissingExtraError
        If z3 is not installed.
    ExpressionError
        If a condition cannot be read.
    ParameterError
        If the domain is empty, or uses what is not encoded.

    Examples
    --------
    >>> from gms_fsm.charts import gms_element
    >>> report = prove(gms_element("published"))  # doctest: +SKIP
    >>> finding, = report.refuted  # doctest: +SKIP
    >>> finding.check, finding.where, finding.counterexample  # doctest: +SKIP
    ('stability', ('slip',), {'C': 1.0, 'v': -1.0, 's': 1.0, 'z': 1.0})
    """
    if not hasattr(chart, "guards"):
        raise ParameterError(f"chart is {shown(chart)}; prove takes a Chart, of a model its .chart")
    if domain is None:
        domain = default_domain(chart)
    domain = (domain,) if isinstance(domain, str) else tuple(domain)
    prover = _Prover(chart, domain)
    checks = (_determinism, _livelock, _reachability, _chattering, _stability)
    return Report(chart, domain, tuple(found for check in checks for found in check(prover)))


# --------------------------------------------------------------------------- texts over the reals
class _Undecided(Exception):
    """A question stays open; the text is the reason."""


class _GaveUp(_Undecided):
    """... because z3 took too long."""


@dataclass(frozen=True)
class _Dual:
    """A value and its slope: its one-sided rate of change where the names change at theirs."""

    value: Any
    slope: Any


Duals: TypeAlias = Mapping[str, _Dual]


class _Reading:
    """Reads the texts of one question; keeps what has to be nonzero, and where a value jumps."""

    def __init__(self) -> None:
        self.z3 = require("z3", "check")
        self.denominators: list[tuple[Any, str]] = []
        self.breaks: list[Any] = []

    def value(self, node: Value, names: Duals) -> _Dual:
        if (degree := _degree(node)) > HIGHEST_DEGREE:
            raise _Undecided(f"a polynomial of degree {degree} is not tried: {_shown(node)}")
        return self._value(node, names)

    def _value(self, node: Value, names: Duals) -> _Dual:
        choose, zero = self.z3.If, self.z3.RealVal(0)
        match node:
            case Number(value):
                return _Dual(self.z3.RealVal(str(Fraction(value))), zero)
            case Name(name):
                return names[name]
            case Negative(operand):
                u = self._value(operand, names)
                return _Dual(-u.value, -u.slope)
            case Binary("**", base, exponent):
                return self._power(base, exponent, names)
            case Binary("/", left, right):
                return self._quotient(self._value(left, names), self._value(right, names), right)
            case Binary(op, left, right):
                a, b = self._value(left, names), self._value(right, names)
                if op == "*":
                    return _product(a, b)
                if op == "+":
                    return _Dual(a.value + b.value, a.slope + b.slope)
                return _Dual(a.value - b.value, a.slope - b.slope)
            case Call("abs", (argument,)):
                u = self._value(argument, names)
                corner = choose(u.slope >= 0, u.slope, -u.slope)
                slope = choose(u.value > 0, u.slope, choose(u.value < 0, -u.slope, corner))
                return _Dual(choose(u.value >= 0, u.value, -u.value), slope)
            case Call("sgn", (argument,)):
                u = self._value(argument, names)
                self.breaks.append(u.value)
                one = self.z3.RealVal(1)
                return _Dual(choose(u.value > 0, one, choose(u.value < 0, -one, zero)), zero)
            case Call("min" | "max" as function, (left, right)):
                a, b = self._value(left, names), self._value(right, names)
                if function == "max":
                    a, b = _Dual(-a.value, -a.slope), _Dual(-b.value, -b.slope)
                corner = choose(a.slope <= b.slope, a.slope, b.slope)
                slope = choose(
                    a.value < b.value, a.slope, choose(b.value < a.value, b.slope, corner)
                )
                least = choose(a.value <= b.value, a.value, b.value)
                return _Dual(least, slope) if function == "min" else _Dual(-least, -slope)
            case Call(function):
                raise _Undecided(f"{function} is not encoded: {_shown(node)}")

    def _power(self, base: Value, exponent: Value, names: Duals) -> _Dual:
        sign = 1
        power = exponent
        while isinstance(power, Negative):
            sign, power = -sign, power.operand
        if not isinstance(power, Number) or power.value not in range(LARGEST_POWER + 1):
            text = _shown(Binary("**", base, exponent))
            raise _Undecided(f"only whole powers up to {LARGEST_POWER} are encoded: {text}")
        one = _Dual(self.z3.RealVal(1), self.z3.RealVal(0))
        result, factor = one, self._value(base, names)
        for _ in range(int(power.value)):
            result = _product(result, factor)
        return result if sign > 0 else self._quotient(one, result, base)

    def _quotient(self, a: _Dual, b: _Dual, text: Value) -> _Dual:
        self.denominators.append((b.value, _shown(text)))
        slope = (a.slope * b.value - a.value * b.slope) / (b.value * b.value)
        return _Dual(a.value / b.value, slope)

    def truth(self, condition: Condition, names: Duals) -> Any:
        match condition:
            case Relation(op, left, right):
                a, b = self.value(left, names).value, self.value(right, names).value
                if op in ("<", "<="):
                    return a < b if op == "<" else a <= b
                return a > b if op == ">" else a >= b
            case Not(operand):
                return self.z3.Not(self.truth(operand, names))
            case Both(operands):
                return self.z3.And([self.truth(o, names) for o in operands])
            case Either(operands):
                return self.z3.Or([self.truth(o, names) for o in operands])
            case InState():
                raise TypeError("a guard depends on values, not on states")

    def margin(self, literal: Comparative, names: Duals) -> _Dual:
        """Return the margin of a literal: positive where it holds."""
        pair = literal.comparison
        left, right = self.value(pair.left, names), self.value(pair.right, names)
        if not literal.holds:
            left, right = right, left
        return _Dual(left.value - right.value, left.slope - right.slope)


def _product(a: _Dual, b: _Dual) -> _Dual:
    return _Dual(a.value * b.value, a.slope * b.value + a.value * b.slope)


def _shown(node: Value | Condition) -> str:
    text = spell(node, MATLAB_LIKE)
    return text if len(text) <= 60 else text[:57] + "..."


def _degree(node: Value) -> int:
    match node:
        case Name():
            return 1
        case Negative(operand):
            return _degree(operand)
        case Binary("**", base, Number(power)):
            return int(_degree(base) * max(1.0, min(abs(power), 1e6)))
        case Binary("**", base, Negative(power)):
            return _degree(Binary("**", base, power))
        case Binary("*" | "/", left, right):
            return _degree(left) + _degree(right)
        case Binary(_, left, right):
            return max(_degree(left), _degree(right))
        case Call(_, arguments):
            return max(map(_degree, arguments))
    return 0


# --------------------------------------------------------------------------- asking
@dataclass(frozen=True)
class _Answer:
    status: Status
    text: str
    counterexample: Mapping[str, float] = field(default_factory=dict)


class _Prover:
    """A chart's names as real symbols, within the domain."""

    def __init__(self, chart: Chart, domain: Sequence[str]) -> None:
        self.chart, self.z3 = chart, require("z3", "check")
        real, zero = self.z3.Real, self.z3.RealVal(0)
        # In the order an example fixes them: constants, what comes from outside, the own state.
        names = (*chart.parameters, *chart.inputs, *chart.variables)
        self.symbols = {name: real(name) for name in names}
        self.rates = {f"d{name}/dt": real(f"d{name}/dt") for name in chart.inputs}
        self.still = {name: _Dual(symbol, zero) for name, symbol in self.symbols.items()}
        self.domain = [self._assumed(text) for text in domain]
        try:
            empty = self.find() is None
        except _GaveUp:
            empty = False
        if empty:
            raise ParameterError(f"the domain {', '.join(domain)} holds nowhere; loosen it")

    def _assumed(self, text: str) -> Any:
        reading = _Reading()
        try:
            formula = reading.truth(parse_condition(text, self.symbols), self.still)
        except ExpressionError as error:
            raise error.at("domain") from None
        except _Undecided as reason:
            raise ParameterError(f"domain {text!r}: {reason}; write it otherwise") from None
        if reading.denominators:
            raise ParameterError(
                f"domain {text!r}: it divides; write it without, for example 'z > s' for "
                "'z / s > 1'"
            )
        return formula

    def find(self, *formulas: Any) -> Any:
        """Return a model of the formulas within the domain, or None where there is none."""
        solver = self.z3.SolverFor("QF_NRA")
        solver.set("timeout", int(1000 * PATIENCE))
        solver.add(*self.domain, *formulas)
        answer = solver.check()
        if answer == self.z3.unknown:
            raise _GaveUp(f"z3 gave up after {PATIENCE:g} s")
        return solver.model() if answer == self.z3.sat else None

    def example(self, names: frozenset[str], *formulas: Any) -> dict[str, float] | None:
        """Return a point of the formulas, made of simple numbers that floats hold exactly."""
        model = self.find(*formulas)
        if model is None:
            return None
        constants = len(self.chart.parameters)
        order = list(self.symbols.items())
        order[constants:constants] = self.rates.items()
        wanted = {name: symbol for name, symbol in order if name in names}
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
                raise _Undecided(f"fails over the reals near {near}, at no point found in floats")
        return found

    def _maybe(self, *formulas: Any) -> Any:
        try:
            return self.find(*formulas)
        except _GaveUp:
            return None

    def defined(self, reading: _Reading, *case: Any) -> None:
        """Leave a question open whose quotients are not all defined within the domain."""
        for denominator, text in reading.denominators:
            if self.find(*case, denominator == 0) is not None:
                raise _Undecided(
                    f"the denominator {text} can be 0 within the domain; say what it cannot be, "
                    f"for example domain=['{text} > 0', ...]"
                )

    def settle(
        self,
        check: Check,
        where: tuple[str, ...],
        question: Callable[..., _Answer],
        *about: object,
        case: str = "",
    ) -> Finding:
        """Ask a question; return the answer, or the reason for having none."""
        try:
            answer = question(self, *about)
        except _Undecided as reason:
            answer = _Answer("undecided", str(reason))
        return Finding(check, answer.status, where, answer.text, answer.counterexample, case)


def _rational(value: Any) -> Fraction:
    exact = value if hasattr(value, "as_fraction") else value.approx(30)
    fraction: Fraction = exact.as_fraction()
    return fraction


def _about(value: Fraction) -> str:
    try:
        return f"{float(value):.6g}"
    except OverflowError:
        return "beyond floats"


def _candidates(value: Fraction) -> Iterator[Fraction]:
    """Yield numbers that floats hold exactly: simple ones, then ever closer to a value."""
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


def _enabled(guards: Sequence[Condition], point: Mapping[str, float]) -> bool:
    """Whether the machine itself, in floats, finds the guards true."""
    try:
        return all(evaluate(guard, point) for guard in guards)
    except (ArithmeticError, ValueError):
        return False


def _refuted(text: str, point: Mapping[str, float], seen: bool = True) -> _Answer:
    return _by_example("refuted", text, point, seen)


def _by_example(status: Status, text: str, point: Mapping[str, float], seen: bool) -> _Answer:
    if not seen:
        raise _Undecided(f"fails over the reals at {_listed(point)}, but rounding hides it there")
    return _Answer(status, text, point)


def _names(*trees: Value | Condition) -> frozenset[str]:
    return frozenset[str]().union(*map(names_in, trees))


# --------------------------------------------------------------------------- determinism
def _determinism(prover: _Prover) -> Iterator[Finding]:
    chart = prover.chart
    for state in chart.states:
        edges = [edge.name for _, edge in chart.leaving(state.name)]
        if len(edges) < 2:
            yield Finding("determinism", "proved", (state.name,), "fewer than two edges leave it")
        for pair in combinations(edges, 2):
            guards = [chart.guards[edge] for edge in pair]
            yield prover.settle("determinism", (state.name, *pair), _at_once, guards, pair[0])


def _at_once(prover: _Prover, guards: Sequence[Condition], first: str) -> _Answer:
    reading = _Reading()
    formulas = [reading.truth(guard, prover.still) for guard in guards]
    prover.defined(reading)
    point = prover.example(_names(*guards), *formulas)
    if point is None:
        return _Answer("proved", "never enabled at once")
    text = f"both are enabled at once; the machine takes the earlier, {first}"
    return _by_example("settled by order", text, point, _enabled(guards, point))


# --------------------------------------------------------------------------- livelock
def _livelock(prover: _Prover) -> Iterator[Finding]:
    cycles = list(islice(_cycles(prover.chart), MOST_CYCLES + 1))
    if not cycles:
        yield Finding("livelock", "proved", (), "no edge has a way back")
    for cycle in cycles[:MOST_CYCLES]:
        where = tuple(name for edge in cycle for name in (edge.source, edge.name))
        yield prover.settle("livelock", where, _all_around, cycle)
    if len(cycles) > MOST_CYCLES:
        text = f"more than {MOST_CYCLES} ways back; the others were not checked"
        yield Finding("livelock", "undecided", (), text)


def _cycles(chart: Chart) -> Iterator[tuple[Transition, ...]]:
    """Yield every way from a state back to it that passes no state twice."""

    def extend(path: tuple[Transition, ...], first: int) -> Iterator[tuple[Transition, ...]]:
        passed = {chart.state_index(edge.source) for edge in path}
        for _, edge in chart.leaving(path[-1].target if path else chart.states[first].name):
            target = chart.state_index(edge.target)
            if target == first:
                yield (*path, edge)
            elif target > first and target not in passed:  # each cycle once, from its first state
                yield from extend((*path, edge), first)

    for first in range(len(chart.states)):
        yield from extend((), first)


def _assigned(chart: Chart, edge: Transition) -> list[tuple[str, Value]]:
    """Return the assignments of an edge in the order they are done."""
    places = (("exit", edge.source), ("action", edge.name), ("entry", edge.target))
    return [item for place in places for item in chart.assignments[place].items()]


def _all_around(prover: _Prover, cycle: tuple[Transition, ...]) -> _Answer:
    chart = prover.chart
    steps = [step for edge in cycle for step in _assigned(chart, edge)]
    assigned = frozenset(name for name, _ in steps)
    guards = [chart.guards[edge.name] for edge in cycle]

    def around(passes: int) -> tuple[list[Any], Duals]:
        reading, formulas, here = _Reading(), [], dict(prover.still)
        for edge in cycle * passes:
            formulas.append(reading.truth(chart.guards[edge.name], here))
            for name, tree in _assigned(chart, edge):
                here[name] = reading.value(tree, here)
        prover.defined(reading)
        return formulas, here

    once, end = around(1)
    if prover.find(*once) is None:
        return _Answer("proved", "never all enabled at one point")
    closed = [end[name].value == prover.symbols[name] for name in sorted(assigned)]
    names = _names(*guards, *(tree for _, tree in steps)) | assigned
    point = prover.example(names, *once, *closed)
    if point is not None:
        text = "all are enabled at one point: endless switching"
        return _refuted(text, point, _comes_back(chart, cycle, point))
    if prover.find(*around(2)[0]) is None:
        return _Answer("proved", "what it assigns ends it before a second pass")
    return _Answer("undecided", "each pass assigns other values; no more than two were followed")


def _comes_back(chart: Chart, cycle: Sequence[Transition], point: Mapping[str, float]) -> bool:
    """Whether floats too are led around the cycle and back to the same point."""
    here = dict(point)
    for edge in cycle:
        if not _enabled([chart.guards[edge.name]], here):
            return False
        for name, tree in _assigned(chart, edge):
            here[name] = evaluate(tree, here)
    return here == point


# --------------------------------------------------------------------------- reachability
def _reachability(prover: _Prover) -> Iterator[Finding]:
    chart = prover.chart
    guards = {
        edge.name: prover.settle("reachability", (edge.name,), _can_hold, edge)
        for edge in chart.transitions
    }
    possible = [e for e in chart.transitions if guards[e.name].status != "refuted"]
    certain = [e for e in possible if guards[e.name].status == "proved"]
    entered = _entered(chart, certain), _entered(chart, possible)
    left = {edge.source for edge in certain}, {edge.source for edge in possible}
    for state in chart.states:
        yield _in_graph(state.name, *entered, "it can be entered", "no chain of edges leads to it")
        if len(chart.states) > 1:
            yield _in_graph(state.name, *left, "it can be left", "no edge leaves it")
    yield from guards.values()


def _can_hold(prover: _Prover, edge: Transition) -> _Answer:
    chart, reading = prover.chart, _Reading()
    formula = reading.truth(chart.guards[edge.name], prover.still)
    prover.defined(reading)
    if prover.find(formula) is None:
        return _Answer("refuted", f"its guard can never hold: {_shown(chart.guards[edge.name])}")
    earlier = []
    for _, other in chart.leaving(edge.source):
        if other.name == edge.name:
            break
        earlier.append(other.name)
    hidden = [reading.truth(Not(chart.guards[name]), prover.still) for name in earlier]
    prover.defined(reading)
    if prover.find(formula, *hidden) is None:
        names = ", ".join(earlier)
        text = f"never taken: wherever its guard holds, an earlier edge goes first ({names})"
        return _Answer("refuted", text)
    return _Answer("proved", "its guard can hold")


def _entered(chart: Chart, edges: Sequence[Transition]) -> set[str]:
    found = {chart.default_state.name}
    while fresh := {e.target for e in edges if e.source in found} - found:
        found |= fresh
    return found


def _in_graph(state: str, certain: set[str], possible: set[str], yes: str, no: str) -> Finding:
    if state in certain:
        return Finding("reachability", "proved", (state,), yes)
    if state in possible:
        text = f"perhaps {no}: a guard is undecided"
        return Finding("reachability", "undecided", (state,), text)
    return Finding("reachability", "refuted", (state,), no)


# --------------------------------------------------------------------------- chattering
def _chattering(prover: _Prover) -> Iterator[Finding]:
    pairs = [
        (there, back)
        for there, back in combinations(prover.chart.transitions, 2)
        if there.source == back.target != there.target == back.source
    ]
    if not pairs:
        yield Finding("chattering", "proved", (), "no two states have edges there and back")
    for there, back in pairs:
        where = (there.source, there.name, back.source, back.name)
        yield prover.settle("chattering", where, _pushed, there, back)


def _pushed(prover: _Prover, there: Transition, back: Transition) -> _Answer:
    """Look for a point from which each flow pushes into the guard that leaves its state.

    A comparison is on its surface where its margin is zero. Each guard needs one there whose margin
    grows under the own flow and falls under the other; its other margins must be positive, or zero
    and growing. Zero and at rest, or the place of a jump of a flow, is not decided to first order.
    """
    chart, z3 = prover.chart, prover.z3
    if _assigned(chart, there) or _assigned(chart, back):
        raise _Undecided("an edge assigns variables; the flow after a jump is not followed")
    guards = [chart.guards[edge.name] for edge in (there, back)]
    of_flows, of_guards = _Reading(), _Reading()
    moved = [_moved(prover, of_flows, edge.source) for edge in (there, back)]
    at_break = z3.Or([u == 0 for u in of_flows.breaks])
    strict, loose = [], []
    for pair in product(*(_ways(split(guard)) for guard in guards)):
        if not _at_one_time(prover, [*pair[0], *pair[1]]):
            continue
        crossed, touched, growing, not_falling, reached = [], [], [], [], []
        for way, own, other in zip(pair, moved, reversed(moved), strict=True):
            here = [of_guards.margin(part, own) for part in way]
            across = [of_guards.margin(part, other).slope for part in way]
            turning = zip(here, across, strict=True)
            crossed.append(z3.Or([z3.And(m.value == 0, m.slope > 0, n < 0) for m, n in turning]))
            touched.append(z3.Or([m.value == 0 for m in here]))
            growing += [z3.Or(m.value > 0, z3.And(m.value == 0, m.slope > 0)) for m in here]
            not_falling += [z3.Or(m.value > 0, z3.And(m.value == 0, m.slope >= 0)) for m in here]
            reached += [m.value >= 0 for m in here]
        strict.append(z3.And(*crossed, *growing))
        loose += [z3.And(*crossed, *not_falling), z3.And(at_break, *touched, *reached)]
    if not strict:
        return _Answer("proved", "their guards never open at one place and time")
    breaks = [*of_flows.breaks, *of_guards.breaks]
    prover.defined(of_flows)
    prover.defined(of_guards)
    flows = [chart.flows[edge.source, x] for edge in (there, back) for x in chart.variables]
    names = _names(*guards, *flows)
    names |= {f"d{name}/dt" for name in _names(*guards) & {*chart.inputs} - {"t", "x"}}
    names |= names & {"x"} and {"v"} & {*chart.inputs}
    point = prover.example(names, z3.Or(strict), *(u != 0 for u in breaks))
    if point is not None:
        place = _surface(guards[0], point)
        text = f"on {place} each flow pushes into the other's guard: endless switching"
        return _refuted(text, point)
    if of_guards.breaks:
        raise _Undecided("sgn jumps in a guard")
    if prover.find(z3.Or(loose)) is not None:
        raise _Undecided("not to first order: where a flow jumps, or a margin rests at zero")
    return _Answer("proved", "on no surface do both flows push into the other's guard")


Ways: TypeAlias = list[tuple[Comparative, ...]]


def _ways(parts: Split) -> Ways:
    """Return the alternatives under which a split condition holds."""
    if isinstance(parts, Comparative):
        return [(parts,)]
    word, inner = parts
    ways = [_ways(part) for part in inner]
    if word == "either":
        return [way for some in ways for way in some]
    if math.prod(map(len, ways)) > MOST_WAYS:
        raise _Undecided(f"a guard has more than {MOST_WAYS} alternatives")
    return [tuple(part for way in some for part in way) for some in product(*ways)]


def _at_one_time(prover: _Prover, parts: Sequence[Comparative]) -> bool:
    """Whether comparisons of inputs alone allow both guards.

    Inputs run alike in both states, so both guards need them at one time: ``v > v_c`` in the one
    and ``abs(v) <= v_c`` in the other is no chattering, though both are about to change at v_c.
    """
    variables = {*prover.chart.variables}
    alike = [part.relation for part in parts if not names_in(part.relation) & variables]
    reading = _Reading()
    formulas = [reading.truth(relation, prover.still) for relation in alike]
    prover.defined(reading)
    return prover.find(*formulas) is not None


def _moved(prover: _Prover, reading: _Reading, state: str) -> Duals:
    """Return every name with its rate in a state."""
    chart, symbols = prover.chart, prover.symbols
    rates = {name: prover.rates[f"d{name}/dt"] for name in chart.inputs}
    if "t" in rates:
        rates["t"] = prover.z3.RealVal(1)
    if {"x", "v"} <= {*rates}:
        rates["x"] = symbols["v"]
    for name in chart.variables:
        rates[name] = reading.value(chart.flows[state, name], prover.still).value
    return {**prover.still, **{name: _Dual(symbols[name], rate) for name, rate in rates.items()}}


def _surface(guard: Condition, point: Mapping[str, float]) -> str:
    """Name the surface of a guard that a point lies on."""
    for part in (part.comparison for way in _ways(split(guard)) for part in way):
        if evaluate(part.left, point) == evaluate(part.right, point):
            return f"{_shown(part.left)} = {_shown(part.right)}"
    return f"the surface of {_shown(guard)}"


# --------------------------------------------------------------------------- stability
def _stability(prover: _Prover) -> Iterator[Finding]:
    chart = prover.chart
    for state in chart.states:
        for variable in chart.variables:
            flow = chart.flows[state.name, variable]
            by_sign = "v" in names_in(flow) & {*chart.inputs}
            for sign in ("v > 0", "v < 0", "v = 0") if by_sign else ("",):
                yield prover.settle(
                    "stability",
                    (state.name,),
                    _equilibrium,
                    flow,
                    variable,
                    sign,
                    case=f"{variable} for {sign}" if sign else variable,
                )


def _equilibrium(prover: _Prover, flow: Value, variable: str, sign: str) -> _Answer:
    if others := sorted(names_in(flow) & {*prover.chart.variables} - {variable}):
        raise _Undecided(f"the flow depends on {', '.join(others)} too")
    case = []
    if sign:
        v = prover.symbols["v"]
        case = [{"v > 0": v > 0, "v < 0": v < 0, "v = 0": v == 0}[sign]]

    def at(place: Any) -> _Dual:
        reading, one = _Reading(), prover.z3.RealVal(1)
        value = reading.value(flow, {**prover.still, variable: _Dual(place, one)})
        prover.defined(reading, *case)
        return value

    here, elsewhere = prover.symbols[variable], prover.z3.Real(f"{variable}'")
    rate, slope = at(here).value, at(here).slope
    if prover.find(*case, at(elsewhere).value != rate + slope * (elsewhere - here)) is not None:
        raise _Undecided(f"the flow is not linear in {variable}")
    point = prover.example(names_in(flow) | {variable}, *case, rate == 0, slope > 0)
    if point is not None:
        place = _place(prover, flow, variable, case)
        return _refuted(f"unstable: {variable} runs away from {place}", point)
    if prover.find(*case, rate == 0) is None:
        return _Answer("proved", f"no equilibrium: d{variable}/dt is never 0")
    if prover.find(*case, slope >= 0) is None:
        return _Answer("proved", f"stable: {_place(prover, flow, variable, case)} attracts")
    if prover.find(*case, rate != 0) is None:
        return _Answer("proved", f"neutral: {variable} stays where it is")
    return _Answer("proved", "no equilibrium is unstable; some are neutral")


def _place(prover: _Prover, flow: Value, variable: str, case: Sequence[Any]) -> str:
    """Name the equilibrium of a flow where a simple text does."""
    chart = prover.chart
    names = sorted(names_in(flow) & {*chart.inputs, *chart.parameters} - {"v"})
    simple = ["0", *names, *(f"{a} / {b}" for a in names for b in names if a != b)]
    for text in (sign + text for text in simple for sign in ("", "-")):
        reading = _Reading()
        try:
            place = reading.value(parse_value(text, names), prover.still)
            rate = reading.value(flow, {**prover.still, variable: place}).value
            prover.defined(reading, *case)
            if prover.find(*case, rate != 0) is None:
                return f"{variable} = {text}"
        except _GaveUp:
            break
        except _Undecided:
            continue
    return "its equilibrium"
