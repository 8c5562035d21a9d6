"""Times at which a formula jumps or starts to change, so that steps cannot miss what it does.

Step-size control sees only a few stages of a step, and misses a pulse between them. So a formula is
sampled before the run. Where it is constant for a while and then changes, steps must end at the
beginning of the change, at its end and at some points inside; error control does the rest.
Formulas that never rest, such as a sine, get no such times. Where floor of what grows steadily with
the time jumps is known exactly.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import as_floats
from gms_fsm.errors import ParameterError
from gms_fsm.language import MATLAB_LIKE, Value, derivative, evaluate, names_in, spell, values_of

SAMPLES = 4096  # a pulse that lies between two of them is missed
REST = 1e-5  # of the whole range: smaller changes between two samples count as none
LONG = SAMPLES // 100  # samples; a rest must be at least this long to count
INSIDE = 8  # parts into which a change is divided
MOST_STEPS = 1_000_000  # of floor and round in a run


@functools.lru_cache(maxsize=256)
def waking_times(tree: Value, t_start: float, t_end: float) -> tuple[float, ...]:
    """Return the times that steps may not jump over.

    Examples
    --------
    >>> from gms_fsm.language import parse_value
    >>> times = waking_times(parse_value("exp(-((t - 3) / 0.01)**2)", ["t"]), 0.0, 8.0)
    >>> len(times), round(times[0], 2), round(times[-1], 2)
    (9, 2.96, 3.04)
    >>> waking_times(parse_value("sin(t)", ["t"]), 0.0, 8.0)
    ()
    """
    t = t_start + (t_end - t_start) / SAMPLES * np.arange(SAMPLES + 1)
    values = values_of(tree, {"t": t})
    if not np.isfinite(values).all():
        return ()
    moves = np.abs(np.diff(values)) > REST * np.ptp(values)
    awake = ~_rests(moves)
    if awake.all() or not awake.any():
        return ()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], awake, [False]]).astype(np.int8)))
    found = [
        np.linspace(t[first], t[last], INSIDE + 1)
        for first, last in zip(edges[::2], edges[1::2], strict=True)
    ]
    return tuple(as_floats(np.unique(np.concatenate(found))))


def step_times(
    steps: Sequence[Value],
    shared: Mapping[str, float],
    own: Mapping[str, Sequence[float]],
    t_start: float,
    t_end: float,
) -> set[float]:
    """Return when values that grow steadily with the time are whole numbers.

    Examples
    --------
    >>> from gms_fsm.language import parse_value
    >>> sorted(step_times([parse_value("t / T", "tT")], {"T": 0.5}, {}, 0.2, 1.6))
    [0.5, 1.0, 1.5]
    """
    found = set[float]()
    for u in steps:
        rows = [dict(shared)]
        if inside := names_in(u) & {*own}:
            several = zip(*(own[name] for name in inside), strict=True)
            rows = [dict(shared) | dict(zip(inside, row, strict=True)) for row in several]
        slope = derivative(u, "t")
        assert slope is not None
        for values in rows:
            try:
                rate = float(evaluate(slope, values))
                start = float(evaluate(u, {**values, "t": 0.0}))
            except (ArithmeticError, ValueError):  # the run itself says why
                continue
            ends = sorted((start + rate * t_start, start + rate * t_end))
            if not math.isfinite(rate) or not all(map(math.isfinite, ends)) or rate == 0.0:
                continue
            first, last = math.floor(ends[0]) + 1, math.ceil(ends[1])
            if last - first > MOST_STEPS:
                raise ParameterError(
                    f"it jumps {last - first} times in this run",
                    place=f"floor({spell(u, MATLAB_LIKE)})",
                    advice=f"at most {MOST_STEPS} jumps; a shorter run, or a longer period",
                )
            times = (np.arange(first, last, dtype=np.float64) - start) / rate
            found.update(as_floats(times[(times > t_start) & (times < t_end)]))
    return found


def _rests(moves: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which intervals belong to a long rest."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], moves, [True]]).astype(np.int8)))
    rests = np.zeros(moves.size, dtype=np.bool_)
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if last - first >= LONG:
            rests[first:last] = True
    return rests
