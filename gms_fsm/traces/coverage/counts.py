"""What runs have tried of one chart, as counts that can be added.

Counts have one number for each element. Those of runs are added by ``+``, so the coverage of
several runs, of a sweep or of several files is the sum of theirs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias, TypeVar

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import ParameterError, shown
from gms_fsm.foundation.display import short_repr
from gms_fsm.traces.coverage.decisions import Decision, decisions

Counts: TypeAlias = tuple[int, ...]
Numbers = TypeVar("Numbers", Counts, tuple[float, ...])


class Score(NamedTuple):
    """How many of some things were seen."""

    seen: int
    of: int

    @property
    def percent(self) -> float:
        """The same in percent; 100 if there is nothing to see."""
        return 100.0 * self.seen / self.of if self.of else 100.0


@dataclass(frozen=True)
class StateCoverage:
    """How often a state was seen.

    Parameters
    ----------
    name : str
        The state.
    rows : tuple of int
        Rows in it, for each element; 0 of runs whose rows were not counted.
    entries : tuple of int
        How often each element entered it; a run that begins in it has entered it.
    """

    name: str
    rows: Counts
    entries: Counts

    @property
    def seen(self) -> tuple[bool, ...]:
        """Whether each element was ever in it; it may have been put there."""
        return tuple(a + b > 0 for a, b in zip(self.rows, self.entries, strict=True))

    def __add__(self, other: StateCoverage) -> StateCoverage:
        rows, entries = _sum(self.rows, other.rows), _sum(self.entries, other.entries)
        return StateCoverage(self.name, rows, entries)


@dataclass(frozen=True)
class EdgeCoverage:
    """How often an edge was taken from one of its sources, and what its guard saw there.

    Parameters
    ----------
    edge, source : str
        The edge, and the state that it leaves.
    taken : tuple of int
        How often each element took it.
    asked : mapping of str to tuple of int
        For each truth vector of the guard that was seen in the source, such as ``"10"``, the number
        of rows for each element. Comparisons are in the order of the text.
    closest : mapping of str to tuple of float
        Of an edge that was never taken: for each truth vector how close each comparison that is
        false in it came to being true; 0 for a true one.
    """

    edge: str
    source: str
    taken: Counts
    asked: Mapping[str, Counts]
    closest: Mapping[str, tuple[float, ...]]

    def __add__(self, other: EdgeCoverage) -> EdgeCoverage:
        taken = _sum(self.taken, other.taken)
        asked = dict(self.asked)
        for vector, rows in other.asked.items():
            asked[vector] = _sum(asked.get(vector, ()), rows)
        closest: dict[str, tuple[float, ...]] = {}
        if not any(taken):
            closest = dict(self.closest)
            for vector, margins in other.closest.items():
                closest[vector] = tuple(map(min, margins, closest.get(vector, margins)))
        return EdgeCoverage(self.edge, self.source, taken, _sorted(asked), _sorted(closest))


@short_repr
@dataclass(frozen=True)
class ChartCoverage:
    """What runs have tried of one chart.

    Parameters
    ----------
    chart : Chart
        The chart.
    states : tuple of StateCoverage
        In the order of the chart.
    edges : tuple of EdgeCoverage
        One for each edge and each state that it leaves.
    runs : int
        Number of runs.
    watched : int
        Number of runs whose rows were counted. Of the others only states and edges are known.
    """

    chart: Chart
    states: tuple[StateCoverage, ...]
    edges: tuple[EdgeCoverage, ...]
    runs: int
    watched: int

    def __add__(self, other: ChartCoverage) -> ChartCoverage:
        if self.chart != other.chart:
            raise ParameterError(
                f"it is of another chart, {shown(other.chart.name)}",
                advice=f"what is added must be of {shown(self.chart.name)}, with the same texts",
            )
        n = max(self.n, other.n)
        mine, its = self._padded(n), other._padded(n)
        return ChartCoverage(
            self.chart,
            tuple(a + b for a, b in zip(mine.states, its.states, strict=True)),
            tuple(a + b for a, b in zip(mine.edges, its.edges, strict=True)),
            self.runs + other.runs,
            self.watched + other.watched,
        )

    def _padded(self, n: int) -> ChartCoverage:
        """Return the same with counts for so many elements."""
        if n == self.n:
            return self
        none = (0,) * n
        return replace(
            self,
            states=tuple(
                StateCoverage(each.name, _sum(each.rows, none), _sum(each.entries, none))
                for each in self.states
            ),
            edges=tuple(
                replace(
                    each,
                    taken=_sum(each.taken, none),
                    asked={vector: _sum(rows, none) for vector, rows in each.asked.items()},
                )
                for each in self.edges
            ),
        )

    @property
    def n(self) -> int:
        """Number of elements; of runs with different numbers the largest."""
        return len(self.states[0].entries)

    @property
    def decisions(self) -> Mapping[str, Decision]:
        """The guards by the names of their edges."""
        return decisions(self.chart)

    def edge(self, edge: str, source: str) -> EdgeCoverage:
        """Return the counts of an edge that leaves a state."""
        return next(each for each in self.edges if (each.edge, each.source) == (edge, source))

    def asked(self) -> Iterator[tuple[EdgeCoverage, Decision, int]]:
        """Yield every comparison of every guard: its edge, its guard, its number in the guard."""
        for each in self.edges:
            decision = self.decisions[each.edge]
            for number in range(len(decision.comparisons)):
                yield each, decision, number

    @property
    def scores(self) -> dict[str, Score]:
        """How much was seen: of ``states``, ``edges``, ``clauses`` and ``MC/DC``.

        A clause is one comparison of a guard in one source, and counts once for true and once for
        false. For MC/DC it must have decided the guard alone, once true and once false. The last
        two are left out if the rows of no run were counted.
        """
        states = [any(each.seen) for each in self.states]
        edges = [any(each.taken) for each in self.edges]
        found = {
            "states": Score(sum(states), len(states)),
            "edges": Score(sum(edges), len(edges)),
        }
        if not self.watched:
            return found
        sides, decided = list[bool](), list[bool]()
        for each, decision, number in self.asked():
            sides += ["1" in _column(each, number), "0" in _column(each, number)]
            decided.append(all(decision.shown(each.asked, number)))
        return {
            **found,
            "clauses": Score(sum(sides), len(sides)),
            "MC/DC": Score(sum(decided), len(decided)),
        }


def _column(each: EdgeCoverage, number: int) -> set[str]:
    """Return which truth values a comparison had."""
    return {vector[number] for vector in each.asked}


def _sum(a: Counts, b: Counts) -> Counts:
    """Return the sum of two counts, the shorter one filled up with 0."""
    if len(a) == len(b):
        return tuple(x + y for x, y in zip(a, b, strict=True))
    longer, shorter = sorted((a, b), key=len, reverse=True)
    return _sum(longer, shorter + (0,) * (len(longer) - len(shorter)))


def _sorted(found: Mapping[str, Numbers]) -> dict[str, Numbers]:
    return dict(sorted(found.items()))
