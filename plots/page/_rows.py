"""The rows of a run that a replay page shows, and their numbers in the trace.

All rows at instants with transitions are kept. Of the others, a long run keeps what can be seen,
the extremes in short intervals; a short run gets samples between its rows, so that curves look
smooth.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gms_fsm.errors import ParameterError, SignalError
from gms_fsm.lowering.layout import SystemLayout
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.views import picked

SMOOTH, FEWEST_ROWS = 4000, 200  # samples are added up to these; the first is for one element
MOST_ROWS = 20_000  # away from transitions, for one element; a longer run is thinned
MOST_AT_TRANSITIONS = 80_000  # of a page, at and next to instants with transitions
VALUES = 20_000  # of a long run away from transitions, about
MOST_COMPONENTS = 12  # with more, the elements' variables are not searched for extremes
SMALL = 10_000  # so many rows of transitions also keep the rows next to their instants


@dataclass(frozen=True, eq=False)
class PageRows:
    """The rows of a page.

    Parameters
    ----------
    trace : Trace
        The run with these rows.
    number : ndarray of int, shape (rows,)
        Number of each row in the trace, or of the row before it.
    between : ndarray of int, shape (rows,)
        0 for a row of the trace, 1 for one after that row, 2 for one before the first row.
    """

    trace: Trace
    number: NDArray[np.int64]
    between: NDArray[np.int64]

    def at(self, chosen: NDArray[np.bool_]) -> PageRows:
        """Return some of the rows."""
        trace = self.trace
        if "seen" in vars(trace) or trace.stored:
            part = picked(trace, chosen)
        else:  # observed only at the rows that are shown
            rows = trace.rows.at(chosen)
            part = replace(trace, rows=rows, stops=rows)
            vars(part)["program"] = trace.program
        return PageRows(part, self.number[chosen], self.between[chosen])


def page_rows(trace: Trace, window: tuple[float, float] | None = None) -> PageRows:
    """Return the rows that a page shows."""
    found = _with_microsteps(trace)
    if window is not None:
        t = found.trace.t
        found = found.at((t >= window[0]) & (t <= window[1]))
    layout = trace.program.layout
    smooth = max(FEWEST_ROWS, SMOOTH // (layout.n + 1))
    if len(found.trace) < smooth:
        found = _refined(found, smooth)
    run = found.trace
    instants = np.isin(run.t, run.t[run.microstep > 0])
    at_transitions = int(instants.sum())
    if at_transitions > MOST_AT_TRANSITIONS:
        raise ParameterError(
            f"this part of the run has {at_transitions} rows at transitions, more than the "
            f"{MOST_AT_TRANSITIONS} that a page holds",
            place="window",
            value=window,
            advice="give a shorter window = (t0, t1), in s",
        )
    kept = instants.copy()
    if at_transitions <= SMALL:  # so that curves reach every jump
        kept[1:] |= instants[:-1]
        kept[:-1] |= instants[1:]
    kept[[0, -1]] = True
    others = np.flatnonzero(~kept)
    few = others.size <= MOST_ROWS // (layout.n + 1)
    kept[others if few else others[_seen(run.rows.y[others], layout)]] = True
    return found if kept.all() else found.at(kept)


def _seen(y: NDArray[np.float64], layout: SystemLayout) -> NDArray[np.int64]:
    """Return the rows with the lowest and highest values of components in short intervals.

    Of many elements only what they share is asked; their variables turn where it does.
    """
    places = [layout.y.index(name) for name in layout.y.shared]
    if y.shape[1] <= MOST_COMPONENTS:
        places = list(range(y.shape[1]))
    count = min(max(VALUES // (2 * max(len(places), 1) * (layout.n + 3)), 50), len(y))
    bounds = np.linspace(0, len(y), count + 1).astype(int)[:-1]
    sizes = np.diff(np.append(bounds, len(y)))
    keep = [bounds]
    for column in y[:, places].T:
        for extreme in (np.fmax, np.fmin):
            at = np.flatnonzero(column == np.repeat(extreme.reduceat(column, bounds), sizes))
            _, first = np.unique(np.searchsorted(bounds, at, side="right"), return_index=True)
            keep.append(at[first])
    return np.unique(np.concatenate(keep))


def _with_microsteps(trace: Trace) -> PageRows:
    """Return the rows of a run with both sides of every stop, even if it has requested times."""
    stops, rows = trace.stops, trace.rows
    number = np.arange(len(rows))
    if (trace.microstep > 0).any() or not (stops.microstep > 0).any():
        return PageRows(trace, number, np.zeros(len(rows), dtype=np.int64))
    alone = ~np.isin(rows.t, stops.t)  # at a stop, its own rows show more
    pairs = zip(vars(stops).values(), vars(rows.at(alone)).values(), strict=True)
    table = Rows(*(np.concatenate(pair) for pair in pairs))
    order = np.argsort(table.t, kind="stable")
    table = table.at(order)
    # The last row of an instant is the requested one, if there is one.
    found = np.searchsorted(rows.t, table.t, side="right") - 1
    last = np.append(np.diff(table.t) > 0, True)
    own = last & (found >= 0) & (rows.t[found] == table.t)
    run = replace(trace, rows=table, stops=table, stored={})
    return PageRows(run, np.maximum(found, 0), np.where(found < 0, 2, ~own))


def _refined(found: PageRows, wanted: int) -> PageRows:
    """Return the rows with samples between them, if these can be computed."""
    run = found.trace
    if not run.t[-1] > run.t[0]:
        return found
    try:
        refined = run.refined(wanted - len(run) + 2)
    except (SignalError, ArithmeticError, ValueError):
        return found  # a signal that is not in the file, or a last row that cannot be computed
    new = ~np.isin(refined.t, run.t)
    # Recomputed rows should equal those of the file; otherwise the file takes precedence.
    seen = run.seen
    for name, column in refined.seen.items():
        if not np.allclose(column[~new], seen[name], rtol=1e-9, equal_nan=True):
            return found
    number, between = np.zeros((2, len(refined)), dtype=np.int64)
    number[~new], between[~new], between[new] = found.number, found.between, 1
    between[refined.t < run.t[found.between != 2].min()] = 2
    return PageRows(refined, np.maximum.accumulate(number), between)
