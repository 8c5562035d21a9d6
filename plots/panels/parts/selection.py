"""The part of a run that is drawn: its rows, time window, elements, and suitable units."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError, SignalError
from gms_fsm.errors import shown as written
from gms_fsm.foundation.quantities import scale_of
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.views import picked
from plots.views.traces import check_trace
from plots.views.window import Window, window_of

__all__ = ["has_threshold", "shown"]

SMOOTH = 2000  # points per curve
MOST_ROWS = 20_000  # a longer run is thinned


def has_threshold(trace: Trace) -> bool:
    """Return whether s(v) is a threshold of the chart: it is an input, and there are edges.

    Parameters
    ----------
    trace : Trace
        The run.

    Returns
    -------
    bool
        If False, neither |z|/s = 1 nor a margin to it has a meaning.
    """
    return "s" in trace.model.chart.inputs and bool(trace.model.chart.transitions)


class PartOptions(TypedDict, total=False):
    """What panels have in common; see `plots.panels`."""

    window: Window | None
    elements: Sequence[int] | None


@dataclass(frozen=True, eq=False)
class RunPart:
    """The part of a run that a panel shows: elements, counted from 0, in a time interval."""

    run: Trace
    given: Window | None
    elements: list[int]

    @property
    def window(self) -> Window:
        """Begin and end, s."""
        return window_of(self.run, self.given)

    @cached_property
    def rows(self) -> Trace:
        """The rows worth drawing."""
        return shown(self.run, self.given)


def selected(
    trace: Trace,
    window: Window | None = None,
    elements: Sequence[int] | None = None,
    *,
    moving: bool = True,
) -> RunPart:
    """Return the part of a run that the options of a panel choose."""
    check_trace(trace, moving=moving)
    return RunPart(trace, window, checked_elements(trace, elements))


def shown(trace: Trace, window: Window | None = None) -> Trace:
    """Return the rows worth drawing.

    Samples are added between rows that are far apart, so that curves are smooth. A very long run is
    reduced to the lowest and highest values in every short interval and all rows at which a state
    changes; the omitted rows would not be visible.

    Parameters
    ----------
    trace : Trace
        The run.
    window : (float, float), optional
        Time interval, s; by default the whole run.

    Returns
    -------
    Trace
        Trace with these rows, and the whole transition log.

    Raises
    ------
    ParameterError
        If the window is not within the run.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> run = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0)
    >>> part = shown(run, (1.0, 2.5))
    >>> float(part.t[0]), float(part.t[-1]), len(part) > 1000
    (1.0, 2.5, True)
    """
    begin, end = checked_window(trace, window)
    times = trace.t if trace.rows is trace.stops else np.union1d(trace.t, trace.stops.t)
    grid = np.linspace(begin, end, SMOOTH)
    sampled = False
    if times.size > 1:
        right = np.searchsorted(times, grid).clip(1, times.size - 1)
        # Only where rows are far apart, and at the ends of the window.
        far = times[right] - times[right - 1] > 1.5 * (grid[1] - grid[0])
        far[[0, -1]] = True
        wanted = np.setdiff1d(grid[far], times)
        if wanted.size:
            try:
                rows = trace.sample(wanted).stops  # all rows, both sides of every stop, the samples
                trace = replace(trace, rows=rows, stops=rows, stored={})
                sampled = True
            except SignalError:  # from a file, driven by a Python function: use the rows alone
                pass
    low = int(np.searchsorted(trace.t, begin))
    high = int(np.searchsorted(trace.t, end, side="right"))
    if not sampled:  # one more row on either side lets curves reach the ends of the window
        low, high = max(low - 1, 0), high + 1
    keep = np.arange(len(trace))[low:high]
    if keep.size < len(trace):
        if sampled:  # nothing is known yet, so observe the rows in the window only
            rows = trace.rows.at(keep)
            trace = replace(trace, rows=rows, stops=rows)
        else:
            trace = picked(trace, keep)
    return trace if len(trace) <= MOST_ROWS else picked(trace, _telling_rows(trace))


def _telling_rows(trace: Trace) -> NDArray[np.intp]:
    size = -(-len(trace) // (MOST_ROWS // 5))
    count = -(-len(trace) // size)
    start = size * np.arange(count)
    keep = [start, np.array([len(trace) - 1])]
    pad = count * size - len(trace)
    ratio = (trace.z / trace.s).T if "s" in trace.model.chart.inputs else ()
    for column in (trace.x, trace.v, trace.F, *trace.z.T, *ratio):
        values = np.nan_to_num(np.pad(column, (0, pad), mode="edge")).reshape(count, size)
        keep += [start + values.argmin(axis=1), start + values.argmax(axis=1)]
    switched = np.flatnonzero((np.diff(trace.rows.mode, axis=0) != 0).any(axis=1))
    micro = np.flatnonzero(trace.microstep > 0)
    keep += [switched, switched + 1, micro, np.maximum(micro - 1, 0)]
    return np.unique(np.minimum(np.concatenate(keep), len(trace) - 1))


def checked_window(trace: Trace, window: Window | None) -> Window:
    """Return the window, or the whole run for None."""
    check_trace(trace)
    return window_of(trace, window)


def checked_elements(trace: Trace, elements: Iterable[int] | None) -> list[int]:
    """Return the chosen elements, or all for None."""
    if elements is None:
        return list(range(trace.n))
    try:
        chosen = list(elements)
    except TypeError:
        chosen = []
    whole = all(map(is_whole, chosen))
    if (
        not chosen
        or not whole
        or len(set(chosen)) < len(chosen)
        or not (0 <= min(chosen) <= max(chosen) < trace.n)
    ):
        raise ParameterError(
            f"elements is {written(elements)}",
            advice=f"it must be a list of different integers from 0 to {trace.n - 1} "
            "(labels count from 1)",
        )
    return [int(i) for i in chosen]


def one_element(trace: Trace, element: Any) -> int:
    """Return the number of an element; raise `ParameterError` if there is no such one."""
    check_trace(trace)
    if not is_whole(element) or not 0 <= element < trace.n:
        raise ParameterError(
            f"it must be an integer from 0 to {trace.n - 1} (labels count from 1)",
            place="element",
            value=element,
        )
    return int(element)


def checked_row(trace: Trace, row: Any, t: Any = None) -> int:
    """Return the number of a row, from 0; with a time, that of the last row at or before it."""
    if t is not None:
        first, last = float(trace.t[0]), float(trace.t[-1])
        if not is_number(t) or not first <= t <= last:
            raise ParameterError(
                f"it must be a time in the run, {first:g} to {last:g} s", place="t", value=t
            )
        return int(np.searchsorted(trace.t, t, side="right")) - 1
    if not is_whole(row) or not -len(trace) <= row < len(trace):
        raise ParameterError(
            f"it must be an integer from {-len(trace)} to {len(trace) - 1}", place="row", value=row
        )
    return int(row) % len(trace)


def is_whole(value: object) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def is_number(value: object) -> bool:
    return isinstance(value, (int, float, np.number)) and not isinstance(value, bool)


def scaled(values: NDArray[np.float64], unit: str) -> tuple[float, str]:
    """Return the factor and the prefixed unit that suit the values.

    Examples
    --------
    >>> scaled(np.array([0.0, 2e-4]), "m/s")
    (1000000.0, 'µm/s')
    """
    finite = np.abs(values[np.isfinite(values)])
    scale = scale_of(float(finite.max(initial=0.0)), unit)
    return scale.factor, scale.unit


def dotted(unit: str) -> str:
    """Return a unit with dots in its products, or a text that ends with it.

    Examples
    --------
    >>> dotted("300 mNs/m"), dotted("Nm/rad"), dotted("Nms/rad")
    ('300 mN·s/m', 'N·m/rad', 'N·m·s/rad')
    """
    return re.sub(r"N(?=[sm])", "N·", unit).replace("N·ms", "N·m·s")
