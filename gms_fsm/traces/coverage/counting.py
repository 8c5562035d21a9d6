"""Counting the coverage of runs: of one from its rows and its log, of many from tables and logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.chart import Chart
from gms_fsm.language import COMPARISONS, Relation, names_in, values_of
from gms_fsm.lowering.printing.counting import FEW, CountPlaces
from gms_fsm.traces.coverage.counts import ChartCoverage, EdgeCoverage, StateCoverage
from gms_fsm.traces.coverage.decisions import Decision, decisions
from gms_fsm.traces.coverage.total import Coverage
from gms_fsm.traces.scope import guard_columns
from gms_fsm.traces.trace import Trace

BITS = 63  # comparisons that fit a whole number of numpy

Asked = tuple[Mapping[str, tuple[int, ...]], Mapping[str, tuple[float, ...]]]


def of_trace(trace: Trace) -> Coverage:
    """Return what a run has tried.

    It sees every accepted step and both sides of every firing; with requested rows these and both
    sides of every stop; of a run that kept its end only, the log.
    """
    whole = trace.whole()
    views = {name: whole.contact(name) for name in trace.subject.machines}
    return Coverage({name: of_view(view) for name, view in (views or {trace.which: whole}).items()})


def of_view(trace: Trace) -> ChartCoverage:
    """Return what a run has tried of the chart of one contact, as whose view it is given."""
    chart, places, mode = trace.model.chart, trace.places, trace.modes.T
    element, edge = trace.firings.machine - places.first, trace.firings.edge - places.first_edge
    log = FiredEdges(np.zeros_like(element), element, edge, mode[:, -1:].T)
    if len(trace) == 1 and trace.t[0] != trace.settings.get("t_start"):  # the end alone
        return of_log(chart, LogCounts.of(chart, log))
    found = LogCounts.of(chart, replace(log, first=mode[:, :1].T))
    values = _Values(trace, chart, mode)
    asked = [values.asked(row, not each.any()) for row, each in enumerate(found.taken)]
    return found.coverage(chart, _per_element(mode, len(chart.states)), asked, watched=1)


@dataclass(frozen=True, eq=False)
class FiredEdges:
    """The log of some runs.

    Parameters
    ----------
    run, element, edge : ndarray of int, shape (firings,)
        In order of time within each run.
    last : ndarray of int, shape (runs, n)
        Number of the state of each element at the end; negative if the run could not start.
    first : ndarray of int, shape (runs, n), optional
        The same at the start. If it is unknown it is what the element first leaves, or its last.
    """

    run: NDArray[Any]
    element: NDArray[Any]
    edge: NDArray[Any]
    last: NDArray[Any]
    first: NDArray[Any] | None = None

    def taken(self, chart: Chart) -> NDArray[np.int64]:
        """Return how often each element took each edge, shape (edges, n)."""
        edges, n = len(chart.transitions), self.last.shape[1]
        return _table((self.edge, self.element), (edges, n))

    def entered(self, chart: Chart) -> NDArray[np.int64]:
        """Return how often each element entered each state, shape (states, n)."""
        numbers = {state.name: number for number, state in enumerate(chart.states)}
        first = self.first
        if first is None:
            first = self.last.copy()
            sources = np.array([numbers[edge.source] for edge in chart.transitions], dtype=np.int64)
            # Of several values for one place the last one stays: that of the first firing.
            first[self.run[::-1], self.element[::-1]] = sources[self.edge[::-1]]
        found = _per_element(first[(first >= 0).all(axis=1)].T, len(numbers))
        for edge, times in zip(chart.transitions, self.taken(chart), strict=True):
            found[numbers[edge.target]] += times
        return found


@dataclass(frozen=True, eq=False)
class LogCounts:
    """What the logs of some runs show of one chart, to be added up.

    Parameters
    ----------
    taken, entered : ndarray of int, shape (edges, n) and (states, n)
        How often each element took each edge and entered each state.
    runs : int
        Number of runs that have started.
    """

    taken: NDArray[np.int64]
    entered: NDArray[np.int64]
    runs: int

    @classmethod
    def of(cls, chart: Chart, log: FiredEdges) -> LogCounts:
        """Return the counts of some logs."""
        runs = int((log.last >= 0).all(axis=1).sum())
        return cls(log.taken(chart), log.entered(chart), runs)

    def __add__(self, other: LogCounts) -> LogCounts:
        return LogCounts(
            self.taken + other.taken, self.entered + other.entered, self.runs + other.runs
        )

    def coverage(
        self, chart: Chart, rows: NDArray[np.int64], asked: Sequence[Asked], watched: int
    ) -> ChartCoverage:
        """Return the coverage of a chart, with the rows in each state and what guards saw there."""
        states = zip(chart.states, rows.tolist(), self.entered.tolist(), strict=True)
        edges = zip(chart.transitions, self.taken.tolist(), asked, strict=True)
        return ChartCoverage(
            chart,
            tuple(StateCoverage(state.name, tuple(a), tuple(b)) for state, a, b in states),
            tuple(EdgeCoverage(edge.name, edge.source, tuple(a), *b) for edge, a, b in edges),
            self.runs,
            watched,
        )


def of_log(chart: Chart, log: LogCounts) -> ChartCoverage:
    """Return what is known of runs that kept no rows: states and edges."""
    rows = np.zeros_like(log.entered)
    return log.coverage(chart, rows, [({}, {})] * len(chart.transitions), watched=0)


def of_tables(
    chart: Chart,
    log: LogCounts,
    places: CountPlaces,
    counts: NDArray[np.int64],
    near: NDArray[np.float64],
) -> ChartCoverage:
    """Return what is known of runs whose rows were counted as they came.

    The counts have shape (n, `CountPlaces.counts`), near shape (`CountPlaces.distances`,).
    """
    rows = np.zeros_like(log.entered)
    asked: list[Asked] = [({}, {})] * len(chart.transitions)
    guards = decisions(chart)
    for group in places.groups:
        table = counts[:, group.of_element]
        rows[group.state] = table.sum(axis=1)
        seen, many = np.flatnonzero(table.any(axis=0)), len(group.comparisons)
        distances = near[group.apart].reshape(group.size, many)[seen]
        for edge in group.edges:
            parts = guards[chart.transitions[edge].name].comparisons
            bits = [group.comparisons.index(part) for part in parts]
            true = (seen[:, np.newaxis] >> (many - 1 - np.array(bits, dtype=np.int64))) & 1
            apart = np.where(true, 0.0, distances[:, bits])
            asked[edge] = _by_vector(true, table[:, seen].T, apart, not log.taken[edge].any())
    return log.coverage(chart, rows, asked, watched=log.runs)


def _by_vector(
    true: NDArray[np.int64], rows: NDArray[np.int64], apart: NDArray[Any], margins: bool
) -> Asked:
    """Return counts and least distances by truth vector; each occurs in one row or more."""
    asked, closest = dict[str, Any](), dict[str, Any]()
    found = ["".join(map(str, each)) for each in true.tolist()]
    for vector in sorted({*found}):
        mine = np.array([each == vector for each in found])
        asked[vector] = tuple(rows[mine].sum(axis=0).tolist())
        if margins:
            closest[vector] = tuple(apart[mine].min(axis=0).tolist())
    return asked, closest


class _Values:
    """The comparisons of a chart at the rows of a run, each computed once."""

    def __init__(self, trace: Trace, chart: Chart, mode: NDArray[Any]) -> None:
        self.chart, self.mode = chart, mode
        self.decisions = decisions(chart)
        self.states = [state.name for state in chart.states]
        parts = {part for each in self.decisions.values() for part in each.comparisons}
        self.columns = guard_columns(trace, frozenset[str]().union(*map(names_in, parts)))
        # As the engine compares: 1/0 is infinite there, and not an error as in Python.
        self.truth = {part: COMPARISONS[part.op](*self._sides(part)) for part in parts}
        self._inside: dict[str, tuple[NDArray[Any], NDArray[Any]]] = {}

    def _sides(self, part: Relation) -> list[NDArray[np.float64]]:
        """Return what is left and right of a comparison, at all places."""
        found = []
        for side in (part.left, part.right):
            values = values_of(side, {name: self.columns[name] for name in names_in(side)})
            found.append(np.broadcast_to(values, self.mode.shape).ravel())
        return found

    def inside(self, state: str) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the places in a state, among those of all elements, and the elements."""
        if state not in self._inside:
            at = np.flatnonzero(self.mode == self.states.index(state))
            self._inside[state] = at, at // self.mode.shape[1]
        return self._inside[state]

    def asked(self, row: int, margins: bool) -> Asked:
        """Return the truth vectors seen by the guard of an edge, and how close it came."""
        edge = self.chart.transitions[row]
        decision = self.decisions[edge.name]
        at, element = self.inside(edge.source)
        if not at.size:
            return {}, {}
        size = len(decision.comparisons)
        code = np.zeros(at.size, dtype=np.int64 if size < BITS else object)
        for part in decision.comparisons:
            code *= 2
            code += self.truth[part][at]
        codes, rows = _rows(code, element, len(self.mode), size)
        vectors = [f"{each:0{size}b}" if size else "" for each in codes.tolist()]
        asked = dict(zip(vectors, map(tuple, rows.tolist()), strict=True))
        if not margins:
            return asked, {}
        return asked, self._closest(decision, vectors, [code == each for each in codes], at)

    def _closest(
        self,
        decision: Decision,
        vectors: Sequence[str],
        own: Sequence[NDArray[np.bool_]],
        at: NDArray[Any],
    ) -> dict[str, tuple[float, ...]]:
        """Return for each truth vector how close its false comparisons came to being true."""
        least = np.zeros((len(vectors), len(decision.comparisons)))
        for number, part in enumerate(decision.comparisons):
            left, right = (side[at] for side in self._sides(part))
            with np.errstate(invalid="ignore"):
                distance = np.abs(left - right)
            distance[np.isnan(distance)] = np.inf
            for place, vector in enumerate(vectors):
                if vector[number] == "0":
                    least[place, number] = distance[own[place]].min()
        return dict(zip(vectors, map(tuple, least.tolist()), strict=True))


def _rows(
    code: NDArray[Any], element: NDArray[Any], n: int, size: int
) -> tuple[NDArray[Any], NDArray[np.int64]]:
    """Return the truth vectors that occur, as numbers, and for each the rows of each element."""
    codes = None
    if size > FEW:  # too many to have a row for each
        codes, code = np.unique(code, return_inverse=True)
    count = 2**size if codes is None else len(codes)
    rows = _table((code, element), (count, n))
    if codes is None:
        codes = np.flatnonzero(rows.any(axis=1))
        rows = rows[codes]
    return codes, rows


def _per_element(mode: NDArray[Any], states: int) -> NDArray[np.int64]:
    """Return how often each state occurs for each element, shape (states, n)."""
    elements = np.broadcast_to(np.arange(len(mode))[:, np.newaxis], mode.shape)
    return _table((mode.ravel(), elements.ravel()), (states, len(mode)))


def _table(places: tuple[NDArray[Any], NDArray[Any]], shape: tuple[int, int]) -> NDArray[np.int64]:
    """Return how often each place occurs."""
    numbers = np.ravel_multi_index(places, shape)
    return np.bincount(numbers, minlength=shape[0] * shape[1]).reshape(shape)
