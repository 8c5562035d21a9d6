"""The chattering monitor: one edge of an element that fires many times within a short time."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.quantities import named_numbers
from gms_fsm.traces.failures import LivelockError
from gms_fsm.traces.monitors._kinds import Chattering, elements_text
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import ChatteringVerdict, Episode


def chattering(monitor: Chattering, trace: Trace, error: Exception | None) -> ChatteringVerdict:
    livelock = isinstance(error, LivelockError) and _switched_last(trace)
    episodes = _episodes(monitor, trace) if len(trace.transitions) >= monitor.times else ()
    parts = [f"livelock: {error}"] if livelock else []
    for first in episodes[:1]:
        span = first.t_last - first.t_first
        others = f" ({elements_text(e.element for e in episodes[1:])} too)" if episodes[1:] else ""
        back = " and ".join(first.back)
        parts.append(
            f"{elements_text([first.element])}{others} took {first.edge}"
            f"{f', and back {back},' if back else ''} {first.count} times in {span:.3g} s, from "
            f"t = {first.t_first:.9g} s ({named_numbers(first.values)}): {_advice(trace, first)}"
        )
    quiet = f"no element took an edge {monitor.times} times within {monitor.within:g} s"
    return ChatteringVerdict(not parts, "; ".join(parts) or quiet, episodes, livelock)


def _switched_last(trace: Trace) -> bool:
    """Return whether the contact was among those that switched when the run ended."""
    log, every = trace.firings, trace.firings if trace.every is None else trace.every
    return not len(every) or (len(log) > 0 and bool(log.t[-1] == every.t[-1]))


def _advice(trace: Trace, episode: Episode) -> str:
    texts = [
        f"{edge} [{trace.model.chart.guard_text(edge)}]" for edge in (episode.edge, *episode.back)
    ]
    gap = ", as arrest does by |v| <= v_c, or raise v_c"
    gap = gap if "v_c" in trace.model.chart.parameter_names else ""
    return (
        f"the guards {' and '.join(texts)} hold alternately; leave a gap between them{gap}"
        if episode.back
        else f"the guard {texts[0]} is immediately true again; let the edge's target have another"
    )


def _episodes(monitor: Chattering, trace: Trace) -> tuple[Episode, ...]:
    """Return the longest episode of each element that chattered."""
    log, variables = trace.transitions, trace.model.chart.variables
    names, codes = np.unique(log["edge"], return_inverse=True)
    found: dict[int, tuple[int, NDArray[np.int64]]] = {}
    for i in np.flatnonzero(np.bincount(log["element"]) >= monitor.times).tolist():
        own = log["element"] == i
        for code in range(len(names)):
            taken = np.flatnonzero(own & (codes == code))
            longest = _longest(log["t"][taken], monitor)
            if longest and (i not in found or longest[1] - longest[0] > len(found[i][1])):
                found[i] = code, taken[longest[0] : longest[1]]
    episodes = []
    for i, (code, taken) in found.items():
        first = log[taken[0]]
        meanwhile = log[taken[0] : taken[-1] + 1]
        others = np.unique(meanwhile["edge"][meanwhile["element"] == i]).tolist()
        edge = str(names[code])
        seen = {name: float(first.z) for name in variables[:1]}
        seen |= {"s": float(first.s), "v": float(first.v)}
        values = {name: value for name, value in seen.items() if not math.isnan(value)}
        back, end = tuple(other for other in others if other != edge), float(log["t"][taken[-1]])
        episodes.append(Episode(i, edge, back, len(taken), float(first.t), end, values))
    return tuple(episodes)


def _longest(times: FloatArray, monitor: Chattering) -> tuple[int, int] | None:
    """Return start and end of the longest run of firings, any `times` consecutive ones `within`."""
    ahead = monitor.times - 1
    if times.size <= ahead:
        return None
    close = np.zeros(times.size + 1, dtype=np.int8)
    close[1 : times.size - ahead + 1] = times[ahead:] - times[:-ahead] <= monitor.within
    turns = np.flatnonzero(np.diff(close, append=0))
    if not turns.size:
        return None
    begins, ends = turns[::2], turns[1::2]
    k = int(np.argmax(ends - begins))
    return int(begins[k]), int(ends[k]) + ahead
