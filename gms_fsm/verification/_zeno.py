"""The check *zeno* of charts with impacts, described in `gms_fsm.verification.prove`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from gms_fsm.charts.chart import Transition
from gms_fsm.charts.nesting import AGE
from gms_fsm.language import Condition, Requirement, Value, derivative, names_in, split
from gms_fsm.verification._flows import inclusive, moving, ways
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
from gms_fsm.verification._switching import changed
from gms_fsm.verification.findings import Finding


def zeno(prover: Prover) -> Iterator[Finding]:
    """Check that impacts do not follow each other ever sooner, within a finite time."""
    subject = prover.subject
    if subject.facts.period is not None:
        return
    for edge in prover.chart.transitions:
        sets = {*prover.chart.velocities} & {name for name, _ in subject.assigned(edge)}
        if edge.source == edge.target and sets:
            yield prover.settle("zeno", (edge.source, edge.name), _ever_sooner, edge)


def _ever_sooner(prover: Prover, edge: Transition) -> Answer:
    """Search for impacts that a load repeats, each after a share of the time of the one before.

    They pile up only where the guard still holds, or nearly, with the velocity just after an
    impact.
    """
    subject, z3 = prover.subject, prover.z3
    alone = not (subject.facts.pulled or subject.facts.struck)
    if len(prover.chart.velocities) > 1 or changed(subject, [edge]) - {
        *prover.chart.velocities,
        AGE,
    }:
        raise Undecided("impacts that change more than one velocity are not followed")
    v, zero = prover.chart.velocities[0], z3.RealVal(0)
    begun = {AGE: Dual(zero, zero)} if AGE in prover.still else {}
    reading = Reading()
    left = reading.value(dict(subject.assigned(edge))[v], prover.still)
    borders = [
        _border(reading, subject.guard(edge), here)
        for here in (prover.still, {**prover.still, **begun, v: left})
    ]
    prover.defined(reading)
    if alone and prover.find(*prover.within(edge.source), *borders) is None:
        return Answer("proved", "just after an impact its guard is out of reach for some time")
    if not alone:
        raise Undecided("other contacts may strike between two impacts")
    formulas = _bouncing(prover, edge, {**prover.still, **begun, v: Dual(zero, zero)})
    names = names_of(subject.guard(edge), *subject.trees(edge), subject.flows[edge.source, v])
    point = prover.example(names | {v}, *prover.within(edge.source), *formulas)
    if point is None:
        raise Undecided("whether impacts follow each other ever sooner was not found out")
    text = (
        "each impact leaves a share of the velocity, and the load returns the contact ever sooner"
    )
    seen = enabled([subject.guard(edge)], point)
    return refuted(f"{text}: endless switching within a finite time", point, seen)


def _border(reading: Reading, guard: Condition, here: Duals) -> Any:
    """Return where a guard holds, or nearly."""
    z3 = reading.z3
    return z3.Or(
        [
            z3.And([reading.margin(part, here).value >= 0 for part in way])
            for way in ways(split(guard))
        ]
    )


def _bouncing(prover: Prover, edge: Transition, stopped: Duals) -> list[Any]:
    """Return when impacts follow each other in a geometric row.

    The acceleration does not change, an impact reverses the velocity and leaves a share of it, the
    guard is entered at a place and holds for all lower velocities, and no other edge is enabled
    where the velocity vanishes.
    """
    subject, chart, z3, still = prover.subject, prover.chart, prover.z3, prover.still
    v, reading = chart.velocities[0], Reading()
    impact, flow = dict(subject.assigned(edge))[v], subject.flows[edge.source, v]
    known = {*chart.parameter_names}
    if not (
        names_in(flow) <= known | {subject.load, subject.mobility}
        and names_in(impact) <= known | {v}
        and names_in(subject.guard(edge)) <= known | {v, "x"}
    ):
        raise Undecided("impacts are followed under a force that does not change")
    share = _slope(reading, impact, v, known, still)
    velocity = still[v].value
    flowing = moving(prover, reading, edge.source, still)

    def lasts(part: Requirement) -> Any:
        here, end = reading.margin(part, flowing), reading.margin(part, stopped)
        read = names_in(part.relation)
        if "x" in read and v in read:
            raise Undecided("a comparison of x with v is not followed")
        touched = here.value == 0 if inclusive(part) else False
        if "x" in read:
            return z3.And(here.value == 0, z3.Or(here.slope > 0, touched))
        if v not in read:
            return z3.Or(here.value > 0, touched)
        pair = part.comparison
        slope = _slope(reading, pair.left, v, known, still) - _slope(
            reading, pair.right, v, known, still
        )
        slope = slope if part.holds else -slope
        straight = here.value - end.value == slope * velocity
        return z3.And(z3.Or(here.value > 0, touched), end.value >= 0, straight)

    placed = [
        z3.And([lasts(part) for part in way])
        for way in ways(split(subject.guard(edge)))
        if any("x" in names_in(part.relation) for part in way)
    ]
    others = [
        z3.Or([reading.margin(part, stopped).value < 0 for part in way])
        for _, other in chart.leaving(edge.source)
        if other.name != edge.name
        for way in ways(split(subject.guard(other)))
    ]
    formulas = [
        reading.value(impact, still).value == share * velocity,
        reading.value(impact, stopped).value == 0,
        share < 0,
        share > -1,
        velocity != 0,
        reading.value(flow, still).value * velocity > 0,
        z3.Or(placed),
        *others,
    ]
    prover.defined(reading)
    return formulas


def _slope(reading: Reading, tree: Value, v: str, known: set[str], names: Duals) -> Any:
    """Return how a value grows with the velocity, if it does so evenly."""
    slope = derivative(tree, v)
    if slope is None or not names_in(slope) <= known:
        raise Undecided("only velocities to the first power are followed")
    return reading.value(slope, names).value
