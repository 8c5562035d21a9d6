"""Numbers in a replay page: binary columns in base64, each stored once.

Floats that guards read are stored bit for bit, so that the page computes the truths and margins of
the run; other values have seven digits. Rows at one instant mostly share their values, so a column
that does not change within instants is stored per instant.
"""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

UNSIGNED = ("u1", "u2", "u4")


def packed(values: ArrayLike) -> list[str]:
    """Return integers >= 0 as ``[type, base64]``, in the narrowest type.

    Increasing numbers are stored as their differences; the type is then ``+u1`` and so on.

    Examples
    --------
    >>> packed([0, 1, 300]), packed([3, 1])
    (['+u2', 'AAABACsB'], ['u1', 'AwE='])
    """
    numbers = np.asarray(values, dtype=np.int64)
    steps = np.diff(numbers, prepend=0)
    increasing = bool((steps >= 0).all())
    stored = steps if increasing else numbers
    largest = int(stored.max(initial=0))
    kind = next(kind for kind in UNSIGNED if largest <= np.iinfo(kind).max)
    return ["+" * increasing + kind, _base64(stored.astype(f"<{kind}"))]


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode()


class ColumnStore:
    """The columns of a run; equal ones are stored once.

    Parameters
    ----------
    instants : ndarray of int, shape (rows,)
        Index of the instant of each row.
    """

    def __init__(self, instants: NDArray[np.int64]) -> None:
        self.columns: list[Any] = []
        self._instants = instants
        self._first = np.flatnonzero(np.diff(instants, prepend=-1))
        self._known: dict[tuple[str, bytes], int] = {}

    def add(self, values: ArrayLike, *, exact: bool = True) -> int:
        """Store a column and return its number."""
        kind = "f8" if exact else "f4"
        with np.errstate(over="ignore", under="ignore"):
            column = np.broadcast_to(np.asarray(values, dtype=f"<{kind}"), self._instants.shape)
        key = (kind, column.tobytes())
        if key not in self._known:
            self._known[key] = len(self.columns)
            self.columns.append(self._stored(kind, column))
        return self._known[key]

    def _stored(self, kind: str, column: NDArray[Any]) -> list[str]:
        bits = column.view(f"u{kind[1]}")
        at_instants = column[self._first]
        if column.size and (bits == bits[0]).all():
            return [kind, "constant", _base64(column[:1])]
        if (at_instants.view(bits.dtype)[self._instants] == bits).all():
            return [kind, "instants", _base64(at_instants)]
        return [kind, "rows", _base64(column)]
