"""How values and margins of guards change in a state, as the checks to first order need it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any, TypeAlias

from gms_fsm.charts.chart import Transition
from gms_fsm.language import Condition, Not, Requirement, Split, derivative, names_in, split
from gms_fsm.verification._prover import Dual, Duals, Prover, Reading, Undecided, names_of
from gms_fsm.verification._subject import ChartSubject
from gms_fsm.verification._switching import earlier

MOST_WAYS = 64  # alternatives per guard

Ways: TypeAlias = list[tuple[Requirement, ...]]


def moving(prover: Prover, reading: Reading, state: str, here: Duals) -> Duals:
    """Return every name with its rate of change in a state, at some values of the names."""
    subject = prover.subject
    rates = {name: prover.rates[f"d{name}/dt"] for name in subject.inputs}
    if "t" in rates:
        rates["t"] = prover.z3.RealVal(1)
    if subject.mobility:
        rates[subject.mobility] = prover.z3.RealVal(0)
    if "x" in rates and (velocity := _velocity(subject)):
        rates["x"] = here[velocity].value
    for name in subject.variables:
        rates[name] = reading.value(subject.flows[state, name], here).value
    return {**here, **{name: Dual(here[name].value, rate) for name, rate in rates.items()}}


def bent(prover: Prover, reading: Reading, state: str, moved: Duals) -> Duals:
    """Return every name with its second rate, given those with their rates."""
    subject, zero = prover.subject, prover.z3.RealVal(0)
    second = {name: prover.z3.Real(f"dd{name}") for name in subject.inputs}
    second |= dict.fromkeys({"t", subject.mobility} & {*second}, zero)
    for name in subject.variables:
        second[name] = reading.value(subject.flows[state, name], moved).slope
    if "x" in second and (velocity := _velocity(subject)):
        second["x"] = moved[velocity].slope
    return {**moved, **{name: Dual(moved[name].value, rate) for name, rate in second.items()}}


def bend_apart(
    prover: Prover, reading: Reading, part: Requirement, own: Duals, other: Duals
) -> Any:
    """Return when a margin that both flows touch rises under one and falls under the other.

    Where it is not linear, nothing is said.
    """
    changing = {*prover.subject.inputs, *prover.subject.variables}
    for side in (part.comparison.left, part.comparison.right):
        for name in names_in(side) & changing:
            slope = derivative(side, name)
            if slope is None or names_in(slope) & changing:
                return True
    rise, fall = (reading.margin(part, names).slope for names in (own, other))
    return prover.z3.And(rise > 0, fall < 0)


def _velocity(subject: ChartSubject) -> str:
    """Return the name of the rate of x; empty if the chart has none."""
    v = next(iter(subject.chart.velocities), "")
    return v if v in (*subject.inputs, *subject.variables) else ""


def moving_names(
    prover: Prover, guards: Sequence[Condition], states: Sequence[str]
) -> frozenset[str]:
    """Return what decides how guards change in states: their names, rates, and the flows."""
    subject = prover.subject
    flows = [subject.flows[state, name] for state in states for name in subject.variables]
    names = names_of(*guards, *flows)
    steady = {"t", "x", subject.mobility}
    names |= {f"d{name}/dt" for name in names_of(*guards) & {*subject.inputs} - steady}
    return names | (names & {"x"} and frozenset({_velocity(subject)}))


def ways(parts: Split) -> Ways:
    """Return the alternatives under which a split condition holds."""
    if isinstance(parts, Requirement):
        return [(parts,)]
    word, inner = parts
    found = [ways(part) for part in inner]
    if word == "either":
        return [way for some in found for way in some]
    if math.prod(map(len, found)) > MOST_WAYS:
        raise Undecided(f"a guard has more than {MOST_WAYS} alternatives")
    return [tuple(part for way in some for part in way) for some in product(*found)]


def holding(z3: Any, margin: Dual) -> Any:
    """Return the formula that a margin is positive, or zero and does not fall."""
    return z3.Or(margin.value > 0, z3.And(margin.value == 0, margin.slope >= 0))


def inclusive(part: Requirement) -> bool:
    """Return whether a comparison holds where both sides are equal."""
    return part.comparison.strict != part.holds


def rivals(prover: Prover, edge: Transition) -> list[Transition]:
    """Return the other edges that leave the same state."""
    return [each for _, each in prover.chart.leaving(edge.source) if each.name != edge.name]


def _steady(prover: Prover, state: str, part: Requirement) -> Any:
    """Return when a comparison stays as it is, since its velocity does not change; None if unknown.

    A load that does not change makes the velocity linear in time.
    """
    subject, known = prover.subject, {*prover.chart.parameter_names}
    if not subject.moves or len(prover.chart.velocities) > 1:
        return None
    v, load = prover.chart.velocities[0], subject.load
    if not names_in(part.relation) <= known | {v}:
        return None
    if not names_in(subject.flows[state, v]) <= known | {load, subject.mobility}:
        return None
    return prover.rates[f"d{load}/dt"] == 0


def passed_over(prover: Prover, edge: Transition, here: Duals, by_order: bool = False) -> list[Any]:
    """Return when no other edge of the same state holds at a point, or just after it.

    Of those later in order it may suffice that they do not hold at the point, if the edge itself
    holds just after it.
    """
    z3, found, first = prover.z3, [], earlier(prover.subject, edge)
    for each in rivals(prover, edge):
        reading = Reading()
        if by_order and each not in first:
            found.append(reading.truth(Not(prover.subject.guard(each)), here))
        else:
            for way in ways(split(prover.subject.guard(each))):
                margins = [(part, reading.margin(part, here)) for part in way]
                strict = [(part, m) for part, m in margins if not inclusive(part)]
                falls = [z3.And(m.value == 0, m.slope < 0) for _, m in strict]
                rest = [
                    z3.And(m.value == 0, m.slope == 0, steady)
                    for part, m in strict
                    if (steady := _steady(prover, edge.source, part)) is not None
                ]
                found.append(z3.Or(*(m.value < 0 for _, m in margins), *falls, *rest))
        prover.defined(reading)
        found += [u != 0 for u in reading.breaks]
    return found
