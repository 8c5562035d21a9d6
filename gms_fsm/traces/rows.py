"""The rows of a run: times, micro-steps, states y and modes, as columns.

States and modes of long runs with many elements are in blocks, each of which stores a row or a
column only where it changes: of elements that break away one by one most are at rest, and whole
rows would take memory that grows with the square of their number.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.display import short_repr


class RowBlock(NamedTuple):
    """Some rows: the first one, and of those that differ from the one before, what changes."""

    numbers: NDArray[np.intp]  # of each row its place in the values
    first: NDArray[Any]
    places: NDArray[np.intp]
    values: NDArray[Any]

    @classmethod
    def of(cls, table: NDArray[Any]) -> RowBlock:
        """Return rows without what repeats, bit for bit: rows, and columns like the first row."""
        bits = table.view(np.int64)
        differs = np.append(True, (bits[1:] != bits[:-1]).any(axis=1))
        places = np.flatnonzero((bits != bits[0]).any(axis=0))
        values = table[np.ix_(differs, places)]
        return cls(np.cumsum(differs) - 1, table[0].copy(), places, values)

    def taken(self, rows: NDArray[np.intp]) -> NDArray[Any]:
        """Return some rows, whole."""
        table = np.repeat(self.first[np.newaxis], len(rows), axis=0)
        table[:, self.places] = self.values[self.numbers[rows]]
        return table


@dataclass(frozen=True, eq=False)
class PackedTable:
    """A table in blocks that is read like an array; what is read of it is an array.

    Examples
    --------
    >>> table = np.array([[0.0, 5.0], [1.0, 5.0], [2.0, 5.0]])
    >>> packed = PackedTable.of([RowBlock.of(table[:2]), RowBlock.of(table[2:])])
    >>> packed.shape, packed[-1].tolist(), packed[1:, 1].tolist()
    ((3, 2), [2.0, 5.0], [5.0, 5.0])
    """

    blocks: tuple[RowBlock, ...]
    ends: NDArray[np.intp]  # of the blocks

    @classmethod
    def of(cls, blocks: Iterable[RowBlock]) -> PackedTable:
        """Return the table of some blocks, at least one."""
        blocks = tuple(blocks)
        return cls(blocks, np.cumsum([each.numbers.size for each in blocks]))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self), self.blocks[0].first.size

    def __len__(self) -> int:
        return int(self.ends[-1])

    def __getitem__(self, key: Any) -> Any:
        rows, columns = key if isinstance(key, tuple) else (key, slice(None))
        chosen, width = np.arange(len(self))[rows], np.arange(self.shape[1])[columns]
        wanted = np.atleast_1d(chosen)
        owners = np.searchsorted(self.ends, wanted, "right")
        made = np.empty((wanted.size, *width.shape), self.blocks[0].first.dtype)
        for owner in np.unique(owners).tolist():
            block, here = self.blocks[owner], owners == owner
            within = wanted[here] - (self.ends[owner] - block.numbers.size)
            made[here] = block.taken(within)[:, columns]
        return made if chosen.ndim else made[0]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self[:], dtype)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # what copying and pickling ask for
            raise AttributeError(name)
        return getattr(self[:], name)


@short_repr
@dataclass(frozen=True, eq=False)
class Rows:
    """Times, micro-steps, states y and modes, row by row.

    The modes are those of the elements, then one flag per surface: whether the motion slides on it
    (`gms_fsm.lowering.layout`).
    """

    t: FloatArray
    microstep: NDArray[np.int64]
    y: FloatArray
    mode: NDArray[np.int64]

    def __len__(self) -> int:
        return int(self.t.size)

    @property
    def lasting(self) -> NDArray[np.bool_]:
        """Which rows begin or end an interval: not those between two micro-steps of an instant."""
        passed = np.diff(self.t) != 0.0
        if not passed.any():
            return np.ones(len(self), dtype=bool)
        found: NDArray[np.bool_] = np.append(False, passed) | np.append(passed, False)
        return found

    def at(self, chosen: NDArray[Any] | slice) -> Rows:
        """Return some of the rows."""
        return Rows(self.t[chosen], self.microstep[chosen], self.y[chosen], self.mode[chosen])


def packed(rows: Rows) -> Rows:
    """Return rows, at least one, with their states and modes as one block."""
    y, mode = (PackedTable.of([RowBlock.of(table)]) for table in (rows.y, rows.mode))
    return Rows(rows.t, rows.microstep, cast("Any", y), cast("Any", mode))


def joined(parts: Sequence[Rows]) -> Rows:
    """Return packed rows that follow each other as one table."""
    tables: Any = [(each.y, each.mode) for each in parts]
    y, mode = (
        PackedTable.of(block for table in column for block in table.blocks)
        for column in zip(*tables, strict=True)
    )
    t = np.concatenate([each.t for each in parts])
    microstep = np.concatenate([each.microstep for each in parts])
    return Rows(t, microstep, cast("Any", y), cast("Any", mode))


def merged(rows: Rows, stops: Rows) -> Rows:
    """Merge two tables in time order; rows present in both are kept once."""
    if rows is stops or not len(stops):
        return rows
    rows = rows.at(~_found_in(rows, stops))
    t = np.concatenate([rows.t, stops.t])
    microstep = np.concatenate([rows.microstep, stops.microstep])
    rank = np.concatenate([np.ones(len(rows)), np.zeros(len(stops))])
    order = np.lexsort((microstep, rank, t))
    return Rows(
        t[order],
        microstep[order],
        np.concatenate([rows.y, stops.y])[order],
        np.concatenate([rows.mode, stops.mode])[order],
    )


def _found_in(rows: Rows, stops: Rows) -> NDArray[np.bool_]:
    """Return which rows are also among the stops, bit for bit."""
    found = np.isin(rows.t, stops.t)
    if not found.any():
        return found

    def texts(table: Rows) -> list[bytes]:
        columns = table.t, table.microstep, table.y, table.mode
        both = np.column_stack([np.asarray(column, np.float64) for column in columns])
        return [row.tobytes() for row in both]

    known = set(texts(stops))
    found[found] = [text in known for text in texts(rows.at(found))]
    return found
