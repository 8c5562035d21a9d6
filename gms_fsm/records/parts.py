"""Parts of records: fewer rows, or the same rows of which fewer are selected."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gms_fsm.records.record import Record


def some_rows(record: Record, rows: NDArray[np.bool_] | slice) -> Record:
    """Return a record with some of its rows."""
    columns = {name: values[rows] for name, values in record.columns.items()}
    found = replace(record, columns=columns, chosen=record.chosen[rows], rows=record.rows[rows])
    for array in (*columns.values(), found.chosen, found.rows):
        array.flags.writeable = False
    return found


def thinned(record: Record, rows: int) -> Record:
    """Return every n-th row of a record, so that about as many are left as asked for."""
    return some_rows(record, slice(None, None, max(1, len(record) // rows)))


def only(record: Record, rows: NDArray[np.bool_]) -> Record:
    """Return a record of which no other rows are selected; its motion is that of all of them."""
    return replace(record, chosen=record.chosen & rows)
