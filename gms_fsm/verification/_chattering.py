"""The check *chattering*, described in `gms_fsm.verification.prove`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, product
from typing import Any

from gms_fsm.charts.chart import Transition
from gms_fsm.language import Condition, Requirement, evaluate, names_in, split
from gms_fsm.verification._flows import (
    bend_apart,
    bent,
    holding,
    moving,
    moving_names,
    passed_over,
    rivals,
    ways,
)
from gms_fsm.verification._prover import (
    Answer,
    Duals,
    Prover,
    Reading,
    Undecided,
    refuted,
    shown,
)
from gms_fsm.verification._switching import (
    earlier,
    is_hidden,
    may_change,
    others,
    renewed,
    untaken,
)
from gms_fsm.verification.findings import Finding

JUMPS = "an edge assigns variables; the flow after a jump is not followed"


def chattering(prover: Prover) -> Iterator[Finding]:
    """Check that no two flows push toward each other across a guard surface."""
    if prover.subject.facts.period is not None:
        yield Finding("chattering", "proved", (), "it switches at ticks only")
        return
    pairs = [
        (there, back)
        for there, back in combinations(prover.chart.transitions, 2)
        if there.source == back.target != there.target == back.source
    ]
    if not pairs:
        yield Finding("chattering", "proved", (), "no two states have edges in both directions")
    for there, back in pairs:
        where = (there.source, there.name, back.source, back.name)
        yield prover.settle("chattering", where, _pushed, there, back)
    if pairs and may_change(prover):
        yield prover.settle("chattering", (), _pushed_by_others, pairs)


def _pushed_by_others(prover: Prover, pairs: Sequence[tuple[Transition, Transition]]) -> Answer:
    """Prove that no two states alternate, whatever others give in each of them."""
    z3 = prover.z3
    for there, back in pairs:
        if prover.subject.assigned(there) or prover.subject.assigned(back):
            raise Undecided(JUMPS)
        other, assumed = renewed(prover, prover.still, "!")
        formulas, touched = [*assumed, *prover.within(there.source)], list[Any]()
        for edge, names in ((there, prover.still), (back, other)):
            reading = Reading()
            moved = moving(prover, reading, edge.source, names)
            loose = []
            for way in ways(split(prover.subject.guard(edge))):
                margins = [reading.margin(part, moved) for part in way]
                loose.append(z3.And([holding(z3, m) for m in margins]))
                touched += [m.value == 0 for m in margins]
            prover.defined(reading)
            jumps = [u == 0 for u in reading.breaks]
            touched += jumps
            formulas.append(z3.Or(*loose, *jumps))
        if prover.find(*formulas, z3.Or(touched)) is not None:
            return Answer("undecided", f"{others(prover)} at the same instant are not followed")
    return Answer("proved", f"nor with {others(prover)} at the same instant")


def _pushed(prover: Prover, there: Transition, back: Transition) -> Answer:
    """Search for a point at which each flow pushes into the guard that leaves its state.

    A comparison is on its surface where its margin is zero. Each guard needs one such comparison,
    whose margin grows under its own flow and falls under the other; its other margins must be
    positive, or zero and growing. A margin at rest at zero, or a point where a flow jumps, is not
    decided to first order; so is a margin that both flows touch, if they bend it apart.
    """
    subject, z3 = prover.subject, prover.z3
    for edge in (there, back):
        arrests = [each for each in earlier(subject, edge) if subject.arrests(each)]
        if arrests and is_hidden(prover, edge, arrests):
            text = f"{edge.name} is taken only where the velocity jumps: {arrests[0].name} has "
            return Answer("proved", f"{text}precedence")
    beside = [each for edge in (there, back) for each in rivals(prover, edge)]
    guards = [subject.guard(edge) for edge in (there, back)]
    resting = prover.within(there.source, back.source)
    of_flows, of_guards = Reading(), Reading()
    moved = [moving(prover, of_flows, edge.source, prover.still) for edge in (there, back)]
    strict, loose = _meetings(prover, (there, back), of_flows, of_guards, moved)
    if not strict:
        return Answer("proved", "their guards never become true at the same place and time")
    breaks = [*of_flows.breaks, *of_guards.breaks]
    prover.defined(of_flows)
    prover.defined(of_guards)
    names = moving_names(
        prover, [*guards, *map(subject.guard, beside)], (there.source, back.source)
    )
    calm, firm = (
        [u != 0 for u in breaks],
        [
            u
            for edge, here in zip((there, back), moved, strict=True)
            for u in passed_over(prover, edge, here)
        ],
    )
    point = prover.example(names, z3.Or(strict), *resting, *calm, *firm)
    if point is not None:
        place = _surface(guards[0], point)
        one = all(isinstance(split(guard), Requirement) for guard in guards)
        follows = "a sliding mode, if not endless switching" if one else "endless switching"
        text = f"on {place} each flow pushes into the other's guard: {follows}"
        return refuted(text, point)
    if of_guards.breaks:
        raise Undecided("a value jumps in a guard")
    sure = [
        formula
        for edge in (there, back)
        for formula in untaken(prover, edge, prover.still, certain=True)
    ]
    if prover.find(z3.Or(loose), *resting, *sure) is None:
        text = "there is no surface on which both flows push into the other's guard"
        return Answer("proved", text)
    if beside and prover.find(z3.Or(strict), *resting, *calm) is not None:
        raise Undecided("another edge may be taken instead")
    raise Undecided("not decided to first order: a flow jumps, or a margin stays at zero")


def _meetings(
    prover: Prover,
    pair: Sequence[Transition],
    of_flows: Reading,
    of_guards: Reading,
    moved: Sequence[Duals],
) -> tuple[list[Any], list[Any]]:
    """Return where both flows push into the guards, and where they may do so, for all ways."""
    subject, z3 = prover.subject, prover.z3
    bends = [
        bent(prover, of_flows, edge.source, own) for edge, own in zip(pair, moved, strict=True)
    ]
    at_break = z3.Or([u == 0 for u in of_flows.breaks])
    strict, loose = [], []
    for both in product(*(ways(split(subject.guard(edge))) for edge in pair)):
        if not _at_one_time(prover, [*both[0], *both[1]]):
            continue
        if any(map(subject.assigned, pair)):
            raise Undecided(JUMPS)
        crossed, touched, growing, not_falling, reached = [], [], [], [], []
        tangent = []
        for way, own, other, bend in zip(
            both, moved, reversed(moved), (bends, bends[::-1]), strict=True
        ):
            here = [of_guards.margin(part, own) for part in way]
            across = [of_guards.margin(part, other).slope for part in way]
            across_it = zip(here, across, strict=True)
            crossed.append(z3.Or([z3.And(m.value == 0, m.slope > 0, n < 0) for m, n in across_it]))
            touched.append(z3.Or([m.value == 0 for m in here]))
            apart = [bend_apart(prover, of_guards, part, *bend) for part in way]
            turning = zip(here, across, apart, strict=True)
            tangent.append(
                z3.Or([z3.And(m.value == 0, m.slope == 0, n == 0, u) for m, n, u in turning])
            )
            growing += [z3.Or(m.value > 0, z3.And(m.value == 0, m.slope > 0)) for m in here]
            not_falling += [holding(z3, m) for m in here]
            reached += [m.value >= 0 for m in here]
        strict.append(z3.And(*crossed, *growing))
        loose += [z3.And(*crossed, *not_falling), z3.And(at_break, *touched, *reached)]
        loose.append(z3.And(*tangent, *not_falling))
    return strict, loose


def _at_one_time(prover: Prover, parts: Sequence[Requirement]) -> bool:
    """Return whether the comparisons of inputs alone allow both guards.

    Inputs are the same in both states, so both guards must allow them at one time: ``v > v_c`` in
    one and ``abs(v) <= v_c`` in the other is not chattering, though both are about to change at
    v_c.
    """
    variables = {*prover.subject.variables}
    if prover.subject.moves:
        variables.add("x")  # the same in both states, but not its second rate
    alike = [part.relation for part in parts if not names_in(part.relation) & variables]
    reading = Reading()
    formulas = [reading.truth(relation, prover.still) for relation in alike]
    prover.defined(reading)
    return prover.find(*formulas) is not None


def _surface(guard: Condition, point: Mapping[str, float]) -> str:
    """Describe the surface of a guard on which a point lies."""
    for part in (part.comparison for way in ways(split(guard)) for part in way):
        if evaluate(part.left, point) == evaluate(part.right, point):
            return f"{shown(part.left)} = {shown(part.right)}"
    return f"the surface of {shown(guard)}"
