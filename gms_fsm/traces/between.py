"""States between two rows of one arc, by interpolation, and the time of a change, by bisection."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.lowering.observing import armed, rate
from gms_fsm.lowering.program import Program
from gms_fsm.traces.rows import Rows

HALVINGS = 60  # bisections between two rows


def first_true(low: float, high: float, holds: Callable[[float], bool]) -> float:
    """Return the point at which a condition becomes true, found by bisection.

    Examples
    --------
    >>> first_true(0.0, 1.0, lambda t: t >= 0.3)
    0.3
    """
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def interpolated(
    program: Program,
    mode: list[int],
    t0: float,
    y0: FloatArray,
    t1: float,
    y1: FloatArray,
    t: float,
) -> FloatArray:
    """Return the state at t between two rows of one arc, by cubic Hermite interpolation.

    The slopes come from the flow.
    """
    with np.errstate(all="ignore"):  # as in a run, overflow gives inf
        return _hermite(t0, y0, t1, y1, *slopes(program, mode, t0, y0, t1, y1), t)


def _hermite(
    t0: Any, y0: FloatArray, t1: Any, y1: FloatArray, first: FloatArray, last: FloatArray, t: Any
) -> FloatArray:
    h = t1 - t0
    theta = (t - t0) / h
    rise = y1 - y0
    bend = h * first - rise
    twist = rise - h * last - bend
    value: FloatArray = y0 + theta * (rise + (1 - theta) * (bend + theta * twist))
    return value


def slopes(
    program: Program, mode: list[int], t0: float, y0: FloatArray, t1: float, y1: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the one-sided dy/dt at two adjacent rows of one arc, seen from between them."""
    # The signs inside the interval; at its ends they may be about to change.
    held = armed(program, 0.5 * (t0 + t1), (0.5 * (y0 + y1)).tolist(), mode)
    at_start, at_end = (rate(program, t, y.tolist(), mode, held) for t, y in ((t0, y0), (t1, y1)))
    return at_start, at_end


def between(program: Program, table: Rows, left: NDArray[np.intp], times: FloatArray) -> FloatArray:
    """Return the states at times in a run, each at or after the row of an index in `left`."""
    y = np.array(table.y[left])
    inside = (times != table.t[left]) & (left + 1 < len(table))
    if not inside.any():
        return y
    rows, which = np.unique(left[inside], return_inverse=True)
    t, states, modes = table.t.tolist(), table.y, table.mode
    with np.errstate(all="ignore"):
        ends = np.array(
            [
                slopes(program, modes[i].tolist(), t[i], states[i], t[i + 1], states[i + 1])
                for i in rows.tolist()
            ]
        )[which]
        i = left[inside]
        t0, t1, at = (each[:, None] for each in (table.t[i], table.t[i + 1], times[inside]))
        y[inside] = _hermite(t0, states[i], t1, states[i + 1], ends[:, 0], ends[:, 1], at)
    return y
