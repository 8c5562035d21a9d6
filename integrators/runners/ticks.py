"""What ticks when: increasing times, and at each of them what ticks, as bits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Ticks:
    """All ticks of a run.

    Parameters
    ----------
    times : ndarray of float, shape (m,)
        Increasing, s.
    bits : ndarray of int, shape (m,)
        At each time what ticks, as bits: samplers, or discrete machines.
    """

    times: NDArray[np.float64]
    bits: NDArray[np.int64]

    @classmethod
    def none(cls) -> Ticks:
        """Return no ticks."""
        return cls(np.zeros(0), np.zeros(0, dtype=np.int64))

    @classmethod
    def of(cls, times: list[NDArray[np.float64]], bits: list[Any]) -> Ticks:
        """Return all ticks in order, from the increasing times and the bits of each clock."""
        every = times[0] if len(times) == 1 else np.unique(np.concatenate(times))
        found = np.zeros(len(every), dtype=np.int64)
        for own, bit in zip(times, bits, strict=True):
            found[np.searchsorted(every, own)] |= bit
        return cls(every, found)

    def __len__(self) -> int:
        return len(self.times)

    def at(self, t: float) -> int:
        """Return what ticks at a time."""
        row = int(np.searchsorted(self.times, t))
        return int(self.bits[row]) if row < len(self) and self.times[row] == t else 0

    def after(self, t: float, bit: int) -> float | None:
        """Return the first tick of a bit after a time; None if there is none.

        Examples
        --------
        >>> ticks = Ticks.of([np.array([0.1, 0.2])], [1])
        >>> ticks.after(0.1, 1), ticks.after(0.2, 1)
        (0.2, None)
        """
        for row in range(int(np.searchsorted(self.times, t, "right")), len(self)):
            if self.bits[row] & bit:
                return float(self.times[row])
        return None

    def between(self, t: float, t_end: float) -> Ticks:
        """Return the ticks from a time on, before another one."""
        rows = slice(*np.searchsorted(self.times, [t, t_end]).tolist())
        return Ticks(self.times[rows], self.bits[rows])
