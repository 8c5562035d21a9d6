"""Rows that are counted as they come instead of being kept: the truths of guards, for coverage."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.lowering.generated import SIGNALS, CarefulText, ieee, load, quickened
from gms_fsm.lowering.printing.counting import Counting, CountPlaces
from gms_fsm.run.problem import Problem

LARGE = 10_000  # places of tables up to which Python may copy them at each row


def of_every_step(start: Problem) -> Problem:
    """Return a run that keeps its end, and hands out the row of every step."""
    return replace(start, options=replace(start.options, times=None))


@dataclass(frozen=True, eq=False)
class CountTables:
    """The counts of rows of many runs; runs add to them.

    Parameters
    ----------
    counting : Counting
        What is counted, and where.
    counts : ndarray of int
        By the truths of guards, of each element.
    near : ndarray of float
        How near both sides of each comparison came, infinity if not yet.
    """

    counting: Counting
    counts: NDArray[np.int64]
    near: NDArray[np.float64]

    @classmethod
    def empty(cls, counting: Counting) -> CountTables:
        """Return tables without counts."""
        counts = np.zeros(counting.counts, dtype=np.int64)
        return cls(counting, counts, np.full(counting.distances, np.inf))

    def copy(self) -> CountTables:
        """Return tables with the same counts."""
        return CountTables(self.counting, self.counts.copy(), self.near.copy())

    def become(self, other: CountTables) -> None:
        """Take over the counts of other tables."""
        self.counts[:], self.near[:] = other.counts, other.near

    def add(self, other: CountTables) -> None:
        """Add the counts of other runs."""
        np.add(self.counts, other.counts, out=self.counts)
        np.minimum(self.near, other.near, out=self.near)

    def parts(self) -> Iterator[tuple[CountPlaces, NDArray[np.int64], NDArray[np.float64]]]:
        """Yield for each contact its places, counts, one row for each element, and distances."""
        for own, n, counts, apart in self.counting.parts():
            yield own, self.counts[counts].reshape(n, -1), self.near[apart]


@dataclass(eq=False)
class RowCounter:
    """Counts the rows of a run that Python takes.

    Parameters
    ----------
    tables : CountTables
        Where they are counted, by `put`.
    p : tuple
        The numbers of the program.
    """

    tables: CountTables
    p: Any
    _counts: list[int] = field(init=False)
    _near: list[float] = field(init=False)

    def __post_init__(self) -> None:
        self._fast, self._careful = _functions(self.tables.counting.source)
        self._counts, self._near = self.tables.counts.tolist(), self.tables.near.tolist()

    def __call__(self, t: float, y: list[float], mode: Sequence[int]) -> None:
        """Count a row."""
        before = self._counts[:], self._near[:]
        try:
            self._fast(t, y, mode, self.p, self._counts, self._near)
        except (ArithmeticError, ValueError):  # perhaps after some elements
            self._counts[:], self._near[:] = before
            self._careful(t, y, list(mode), self.p, self._counts, self._near)

    def put(self) -> None:
        """Put the counts into the tables."""
        self.tables.counts[:], self.tables.near[:] = self._counts, self._near


@functools.lru_cache(maxsize=64)
def _functions(source: str) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return the function that counts a row, and the same where Python would raise."""

    def fails(*_: Any) -> None:
        raise ArithmeticError

    fast = quickened(load("counting", source, SIGNALS))["count"]
    return fast, ieee(fails, CarefulText("counting", source, SIGNALS)["count"])
