"""A guard as a function of its comparisons, and which of them decide it (masking MC/DC).

A truth vector is a text with one character for each comparison of a guard: ``"10"`` is the first
true, the second false.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.equality import ByIdentity
from gms_fsm.language import Both, Condition, Either, Not, Relation, clauses, relations


@dataclass(frozen=True)
class Decision:
    """A guard and its comparisons.

    Parameters
    ----------
    guard : Condition
        The guard.
    comparisons : tuple of Relation
        In the order of the text; one that occurs twice is the same.

    Examples
    --------
    >>> from gms_fsm.language import parse_condition
    >>> guard = Decision.of(parse_condition("z >= s and (v > 0 or v < -1)", "zsv"))
    >>> guard.holds("110"), guard.holds("100")
    (True, False)
    >>> [guard.decides("110", i) for i in range(3)]
    [True, True, False]
    """

    guard: Condition
    comparisons: tuple[Relation, ...]

    @classmethod
    def of(cls, guard: Condition) -> Decision:
        """Return the decision of a guard."""
        return cls(guard, tuple(dict.fromkeys(relations(guard))))

    @property
    def clauses(self) -> tuple[Condition, ...]:
        """The parts of the guard that are joined by "and"."""
        return clauses(self.guard)

    def holds(self, vector: str, part: Condition | None = None) -> bool:
        """Return whether the guard, or a part of it, is true for a truth vector."""
        known = {each: truth == "1" for each, truth in zip(self.comparisons, vector, strict=True)}
        return _truth(self.guard if part is None else part, known)

    def decides(self, vector: str, number: int) -> bool:
        """Return whether the guard would change with one comparison alone."""
        turned = "0" if vector[number] == "1" else "1"
        other = f"{vector[:number]}{turned}{vector[number + 1 :]}"
        return self.holds(vector) != self.holds(other)

    def shown(self, vectors: Iterable[str], number: int) -> tuple[bool, bool]:
        """Return whether a comparison was seen to decide the guard: while true, while false."""
        deciding = {vector[number] for vector in vectors if self.decides(vector, number)}
        return "1" in deciding, "0" in deciding


def decisions(chart: Chart) -> Mapping[str, Decision]:
    """Return the decision of each guard of a chart, by the name of its edge."""
    return _decisions(ByIdentity(chart))


@functools.lru_cache(maxsize=64)
def _decisions(chart: ByIdentity[Chart]) -> Mapping[str, Decision]:
    return {name: Decision.of(guard) for name, guard in chart.it.guards.items()}


def _truth(condition: Condition, known: Mapping[Relation, bool]) -> bool:
    match condition:
        case Relation():
            return known[condition]
        case Not(operand):
            return not _truth(operand, known)
        case Both(operands):
            return all(_truth(each, known) for each in operands)
        case Either(operands):
            return any(_truth(each, known) for each in operands)
    raise TypeError("a guard depends on values, not on states")
