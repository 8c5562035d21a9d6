"""The part of a run that a picture shows: a window in time."""

from __future__ import annotations

from gms_fsm.errors import ParameterError
from gms_fsm.errors import shown as written
from gms_fsm.traces.trace import Trace

Window = tuple[float, float]


def window_of(trace: Trace, window: Window | None) -> Window:
    """Return the window, or the whole run for None."""
    first, last = float(trace.t[0]), float(trace.t[-1])
    if window is None:
        return first, last
    try:
        begin, end = (float(t) for t in window)
    except (TypeError, ValueError):
        begin, end = last, first
    if not (first <= begin < end <= last):
        raise ParameterError(
            f"window is {written(window)}",
            advice=f"it must be two times (t0, t1) with t0 < t1 inside the run, {first:g} "
            f"to {last:g} s",
        )
    return begin, end
