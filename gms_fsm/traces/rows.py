"""The rows of a run: times, micro-steps, states y and modes, as columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.display import short_repr


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
