"""Prints the function that counts what guards saw at a row, for coverage.

It stands apart from the program: a run that does not count does not know it.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass, replace

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.equality import ByIdentity
from gms_fsm.foundation.text import visible
from gms_fsm.language import Binary, Relation, relations
from gms_fsm.lowering.places import total
from gms_fsm.lowering.printing.lines import CodeLine, numbered
from gms_fsm.lowering.printing.lock_functions import LockFunctions
from gms_fsm.lowering.printing.names import computed_names
from gms_fsm.lowering.printing.plan import ProgramPlan
from gms_fsm.systems.reading.assembly import Bank

FEW = 10  # comparisons up to which a table of all truth vectors is small
MOST = 2_000_000  # places in all tables of a system


@dataclass(frozen=True)
class AskedTogether:
    """Guards of edges that leave a state, with one count for all their truths together.

    Parameters
    ----------
    state : int
        Number of the state.
    edges : tuple of int
        Numbers of the edges in the chart.
    comparisons : tuple of Relation
        All that they consist of; the first is the highest bit of a place.
    first : int
        Place of the counts, of which each element has its own.
    nearest : int
        Place of the distances between both sides of each comparison, for each place.
    """

    state: int
    edges: tuple[int, ...]
    comparisons: tuple[Relation, ...]
    first: int
    nearest: int

    @property
    def size(self) -> int:
        """Number of counts of an element."""
        return int(2 ** len(self.comparisons))

    @property
    def of_element(self) -> slice:
        """The places of its counts among those of an element."""
        return slice(self.first, self.first + self.size)

    @property
    def apart(self) -> slice:
        """The places of its distances among those of the chart."""
        return slice(self.nearest, self.nearest + self.size * len(self.comparisons))


@dataclass(frozen=True)
class CountPlaces:
    """Where the counts of one chart are.

    Parameters
    ----------
    groups : tuple of AskedTogether
        At least one for each state, in their order.
    counts, distances : int
        Places for each element, and for all together.
    """

    groups: tuple[AskedTogether, ...]
    counts: int
    distances: int

    @classmethod
    def of(cls, chart: Chart) -> CountPlaces | None:
        """Return the places for a chart; None if a guard has too many comparisons."""
        groups: list[AskedTogether] = []
        counts = distances = 0
        for number, state in enumerate(chart.states):
            for edges, parts in _together(chart, state.name):
                if len(parts) > FEW:
                    return None
                groups.append(AskedTogether(number, edges, parts, counts, distances))
                counts += groups[-1].size
                distances += groups[-1].size * len(parts)
        return cls(tuple(groups), counts, distances)


def _together(chart: Chart, state: str) -> list[tuple[tuple[int, ...], tuple[Relation, ...]]]:
    """Return the edges that leave a state in groups of few comparisons, and these."""
    found: list[tuple[tuple[int, ...], tuple[Relation, ...]]] = [((), ())]
    for number, edge in enumerate(chart.transitions):
        if edge.source != state:
            continue
        own = relations(chart.guards[edge.name])
        edges, parts = found[-1]
        every = tuple(dict.fromkeys((*parts, *own)))
        if len(every) <= FEW or not edges:
            found[-1] = (*edges, number), every
        else:
            found.append(((number,), tuple(dict.fromkeys(own))))
    return found


@dataclass(frozen=True)
class Counting:
    """How the rows of a system are counted.

    Parameters
    ----------
    source : str
        The text of the function ``count``.
    places : tuple of CountPlaces
        Of each contact.
    sizes : tuple of int
        Number of elements of each.
    """

    source: str
    places: tuple[CountPlaces, ...]

    sizes: tuple[int, ...]

    @property
    def counts(self) -> int:
        """Number of all counts."""
        return sum(n * own.counts for n, own in zip(self.sizes, self.places, strict=True))

    @property
    def distances(self) -> int:
        """Number of all distances."""
        return sum(own.distances for own in self.places)

    @property
    def size(self) -> int:
        """Number of all places."""
        return self.counts + self.distances

    def parts(self) -> Iterator[tuple[CountPlaces, int, slice, slice]]:
        """Yield for each contact its places, its elements, its counts and its distances in all."""
        first = nearest = 0
        for own, n in zip(self.places, self.sizes, strict=True):
            end, last = first + n * own.counts, nearest + own.distances
            yield own, n, slice(first, end), slice(nearest, last)
            first, nearest = end, last


def counting_of(plan: ProgramPlan) -> Counting | None:
    """Return how the rows of a program are counted; None if it would take too much room."""
    return _counting(ByIdentity(plan))


@functools.lru_cache(maxsize=64)
def _counting(plan: ByIdentity[ProgramPlan]) -> Counting | None:
    banks = plan.it.read.banks
    places = [own for bank in banks if (own := CountPlaces.of(bank.chart)) is not None]
    if len(places) < len(banks):
        return None
    made = Counting("", (*places,), tuple(bank.n for bank in banks))
    if made.size > MOST:
        return None
    return replace(made, source=_CountPrinter(plan.it).text(made))


class _CountPrinter(LockFunctions):
    """Prints the function."""

    def text(self, counting: Counting) -> str:
        """Return the function with the numbers of the states."""
        banks = self.read.banks
        lines = self.before_guards(
            computed_names(edge.guard) for bank in banks for edge in bank.edges
        )
        for bank, (own, _, counts, apart) in zip(banks, counting.parts(), strict=True):
            branches: dict[str, list[CodeLine]] = {state: [] for state in bank.states}
            for group in own.groups:
                first = str(counts.start + group.first), f"{own.counts} * i"
                branches[bank.states[group.state]] += self.counted(bank, group, first, apart.start)
            lines += self.loop(bank.index, "live", (), branches)
        head = [f"# {visible(self.plan.title)}: counts what guards see"]
        head += [*(numbered(states.values()) for states in self.names.states), self.marks]
        code = self.function(
            f"count(t, y, mode, p, {self.own_name('counts')}, {self.own_name('near')})",
            "Count the truths of the guards of each element, and how near their sides came.",
            lines,
            "live",
        )
        return "\n".join([*head, "", "", *code]) + "\n"

    def own_name(self, name: str) -> str:
        """Return a name that nothing else has."""
        while name in self.names.taken:
            name += "_"
        return name

    def counted(
        self, bank: Bank, group: AskedTogether, first: tuple[str, str], nearest: int
    ) -> list[CodeLine]:
        """Write the count of the guards of a group."""
        counts, near, place = map(self.own_name, ("counts", "near", "place"))
        if not group.comparisons:
            return [CodeLine(f"{counts}[{total(first)}] += 1")]
        meant = {
            before: after
            for number in group.edges
            for before, after in zip(
                relations(bank.chart.guards[bank.edges[number].name]),
                relations(bank.edges[number].guard),
                strict=True,
            )
        }
        lines = [CodeLine(f"{place} = 0")]
        for bit, part in enumerate(reversed(group.comparisons)):
            its = meant[part]
            lines += [
                CodeLine(f"if {self.spell(its)}:", computed_names(its)),
                CodeLine(f"    {place} += {1 << bit}"),
            ]
        start, many = str(nearest + group.nearest), len(group.comparisons)
        lines += [
            CodeLine(f"{counts}[{total([*first, place])}] += 1"),
            CodeLine(f"{place} = {total([start, f'{many} * {place}'])}"),
        ]
        for number, part in enumerate(group.comparisons):
            its = meant[part]
            at = f"{near}[{total([str(number), place])}]"
            apart = self.spell(Binary("-", its.left, its.right))
            text = f"{at} = min({at}, abs({apart}))"
            lines.append(CodeLine(text, computed_names(its)))
        return lines
