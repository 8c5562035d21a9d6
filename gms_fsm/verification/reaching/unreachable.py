"""Proofs that an edge is never taken, or never directly after another one.

An edge alone: its guard contradicts what its source holds, a stay in the source is too short, or an
earlier edge is enabled wherever it is (the check *reachability* of `gms_fsm.verification.prove`).

An edge after another one: comparisons that hold when the first is taken, and whose margins never
fall in the state between, still hold when the second is asked; if they contradict its guard, it is
not taken. Only margins of variables, of x and of the time count, which do not jump; what the state
does to them is its flow. Everything else is free, so a proof holds for any motion and any load.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.charts.parameters import checked_values
from gms_fsm.errors import GMSError
from gms_fsm.language import Condition, Requirement, names_in, split
from gms_fsm.systems.parts import Contact
from gms_fsm.verification._checks import can_hold
from gms_fsm.verification._flows import inclusive, moving, ways
from gms_fsm.verification._prover import Prover, Reading, Undecided, shown
from gms_fsm.verification._subject import subject_of
from gms_fsm.verification._switching import after
from gms_fsm.verification.facts import ContactFacts
from gms_fsm.verification.prove import default_domain


class Nowhere:
    """Proofs about the edges of one chart, for all numbers that its rules allow."""

    def __init__(self, chart: Chart) -> None:
        subject = subject_of(ContactFacts(chart))
        self.domain = (*default_domain(chart), *subject.assumed)
        self.prover = Prover(subject, self.domain)

    def edge(self, edge: Transition) -> str:
        """Return why an edge is never taken; empty if that is not proved."""
        try:
            answer = can_hold(self.prover, edge)
        except Undecided:
            return ""
        return answer.text if answer.status == "refuted" else ""

    def pair(self, first: Transition, second: Transition) -> str:
        """Return why an edge never directly follows another one; empty if that is not proved."""
        try:
            kept = [part for part in self._candidates(first, second) if self._kept(first, part)]
            if not kept:
                return ""
            reading, prover = Reading(), self.prover
            formulas = [
                reading.truth(prover.subject.guard(second), prover.still),
                *prover.within(second.source, waits=False),
                *(self._holds(reading, part) for part in kept),
            ]
            prover.defined(reading)
            if prover.find(*formulas) is not None:
                return ""
        except Undecided:
            return ""
        said = ", ".join(dict.fromkeys(shown(part.relation) for part in kept))
        return f"after {first.name}, {said} holds as long as {second.source} lasts"

    def _candidates(self, first: Transition, second: Transition) -> Iterator[Requirement]:
        """Yield what may hold between: what the first edge asks, and the opposite of the second."""
        guards = self.prover.subject.guard
        steady = {*self.prover.subject.variables, "t", "x"} - {*self.prover.chart.velocities}
        known = steady | {*self.prover.chart.parameter_names}
        for guard, turned in ((guards(first), False), (guards(second), True)):
            for way in ways(split(guard)):
                for part in way:
                    if names_in(part.relation) <= known:
                        yield replace(part, holds=not part.holds) if turned else part

    def _kept(self, first: Transition, part: Requirement) -> bool:
        """Return whether a comparison holds after an edge, and until the state is left."""
        prover, reading = self.prover, Reading()
        there = after(prover, reading, first, prover.still)
        margin = reading.margin(part, there).value
        fails = margin < 0 if inclusive(part) else margin <= 0
        formulas = [
            reading.truth(prover.subject.guard(first), prover.still),
            *prover.within(first.source, waits=False),
        ]
        prover.defined(reading)
        if prover.find(*formulas, fails) is not None:
            return False
        reading = Reading()
        moved = moving(prover, reading, first.target, prover.still)
        slope = reading.margin(part, moved).slope
        prover.defined(reading)
        if reading.breaks:  # it jumps
            return False
        return prover.find(*prover.within(first.target, waits=False), slope < 0) is None

    def _holds(self, reading: Reading, part: Requirement) -> Condition:
        margin = reading.margin(part, self.prover.still).value
        found: Condition = margin >= 0 if inclusive(part) else margin > 0
        return found


def numbers_fit(contact: Contact) -> bool:
    """Return whether the numbers of a contact fulfil what is assumed in proofs by default."""
    chart = contact.chart
    strict = tuple(
        replace(each, rule=each.assumed or each.rule, assumed="") for each in chart.parameters
    )
    try:
        checked_values(strict, contact.values, contact.n)
    except GMSError:
        return False
    return True
