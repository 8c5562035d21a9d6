"""The check *release* of charts with locked states, described in `gms_fsm.verification.prove`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from gms_fsm.charts.chart import Transition
from gms_fsm.language import split
from gms_fsm.verification._flows import (
    holding,
    inclusive,
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
    names_of,
    refuted,
)
from gms_fsm.verification._switching import (
    after,
    changed,
    earlier,
    may_change,
    others,
    renewed,
    untaken,
)
from gms_fsm.verification.findings import Finding


def release(prover: Prover) -> Iterator[Finding]:
    """Check that whoever lets go of a lock is not pushed back into one at once."""
    chart, subject = prover.chart, prover.subject
    if not subject.moves:
        return
    if subject.facts.period is not None:
        yield Finding("release", "proved", (), "it switches at ticks only")
        return
    pairs = [
        (edge, back)
        for edge in chart.transitions
        if subject.locked(edge.source) and not subject.locked(edge.target)
        for _, back in chart.leaving(edge.target)
        if subject.locked(back.target)
    ]
    if not pairs:
        text = "no edge that leaves a locked state is followed by one that enters one"
        yield Finding("release", "proved", (), text if chart.locks else "no state is locked")
    for edge, back in pairs:
        where = (edge.source, edge.name, edge.target, back.name)
        yield prover.settle("release", where, _pushed_back, edge, back)
    if pairs and may_change(prover):
        yield prover.settle("release", (), _pushed_back_by_others, pairs)


def _pushed_back_by_others(
    prover: Prover, pairs: Sequence[tuple[Transition, Transition]]
) -> Answer:
    """Prove that nobody is pushed back, whatever others give after the release."""
    for edge, back in pairs:
        of_edge, reading, z3 = Reading(), Reading(), prover.z3
        there, assumed = renewed(prover, after(prover, of_edge, edge, prover.still), "!")
        formulas = [*assumed, *prover.within(edge.source)]
        formulas.append(of_edge.truth(prover.subject.guard(edge), prover.still))
        moved = moving(prover, reading, edge.target, there)
        loose = []
        for way in ways(split(prover.subject.guard(back))):
            margins = [reading.margin(part, moved) for part in way]
            loose.append(z3.And([holding(z3, m) for m in margins]))
        for each in (of_edge, reading):
            prover.defined(each)
        if prover.find(*formulas, z3.Or(*loose, *(u == 0 for u in reading.breaks))) is not None:
            return Answer("undecided", f"{others(prover)} at the same instant are not followed")
    return Answer("proved", f"nor with {others(prover)} at the same instant")


def _for_ever(prover: Prover, edge: Transition, back: Transition, there: Duals) -> list[Any]:
    """Return when the same edge is enabled again, and for a while, after the way back."""
    subject, z3, reading = prover.subject, prover.z3, Reading()
    end = after(prover, reading, back, there)
    margins = [
        [reading.margin(part, prover.still).value for part in way]
        for way in ways(split(subject.guard(edge)))
    ]
    prover.defined(reading)
    closed = [
        end[name].value == prover.symbols[name] for name in sorted(changed(subject, [edge, back]))
    ]
    return [*closed, z3.Or([z3.And([m > 0 for m in way]) for way in margins])]


def _pushed_back(prover: Prover, edge: Transition, back: Transition) -> Answer:
    """Search for a load at which a contact lets go, and the flow leads into the guard back.

    Each comparison of that guard must hold at the point and after it, or become true from zero. A
    margin that stays at zero, or a point where a flow jumps, is not decided to first order.
    """
    subject, z3 = prover.subject, prover.z3
    of_edge, of_flow, of_guard = Reading(), Reading(), Reading()
    there = after(prover, of_edge, edge, prover.still)
    let_go = [*prover.within(edge.source), of_edge.truth(subject.guard(edge), prover.still)]
    moved = moving(prover, of_flow, edge.target, there)
    strict, loose, reached = [], [], []
    for way in ways(split(subject.guard(back))):
        here = [(part, of_guard.margin(part, moved)) for part in way]
        growing = [z3.And(m.value == 0, m.slope > 0) for _, m in here]
        strict.append(
            z3.And(
                [
                    z3.Or(m.value > 0, grows, *([m.value == 0] if inclusive(part) else []))
                    for (part, m), grows in zip(here, growing, strict=True)
                ]
            )
        )
        loose.append(z3.And([holding(z3, m) for _, m in here]))
        reached.append(z3.And([m.value >= 0 for _, m in here]))
    breaks: list[Any] = [*of_flow.breaks, *of_guard.breaks]
    for reading in (of_edge, of_flow, of_guard):
        prover.defined(reading, *let_go)
    names = moving_names(prover, [subject.guard(back)], (edge.target,))
    names |= names_of(*subject.trees(edge))
    beside = [*earlier(subject, edge), *rivals(prover, back)]
    names |= names_of(*map(subject.guard, beside), *subject.trees(back))
    pushed = [*let_go, z3.Or(strict), *(u != 0 for u in breaks)]
    firm = [
        *untaken(prover, edge, prover.still, certain=False),
        *passed_over(prover, back, moved, by_order=True),
    ]
    text = f"after {edge.name} the contact is pushed back, and {back.name} locks it again"
    if edge.source == back.target:
        point = prover.example(names, *pushed, *firm, *_for_ever(prover, edge, back, there))
        if point is not None:
            return refuted(f"{text}: endless switching", point)
    point = prover.example(names, *pushed, *firm)
    if point is not None:
        return refuted(text, point)
    sure = [
        *untaken(prover, edge, prover.still, certain=True),
        *untaken(prover, back, there, certain=True),
    ]
    if prover.find(*pushed, *sure) is not None:
        raise Undecided("another edge may be taken instead")
    at_break = z3.And(z3.Or([u == 0 for u in breaks]), z3.Or(reached))
    if prover.find(*let_go, *sure, z3.Or(*loose, at_break)) is not None:
        raise Undecided("not decided to first order: a flow jumps, or a margin stays at zero")
    return Answer("proved", f"{back.name} cannot follow at once")
