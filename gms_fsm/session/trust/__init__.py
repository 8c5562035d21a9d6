"""How far to trust a finished run: `trust_of` is what `Trace.trust` calls.

Every finding is made from what the run has seen: its rows, its log and its program. A run pays
nothing for it; it is computed when it is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from gms_fsm.errors import SignalError
from gms_fsm.session.trust._again import again as repeated
from gms_fsm.session.trust._meant import meant, unused
from gms_fsm.session.trust._motion import growth, impulses, not_unique, slides
from gms_fsm.session.trust._path import Track
from gms_fsm.session.trust._switches import switches
from gms_fsm.session.trust._values import not_finite, outside, sampling
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import KINDS, Doubt, Severity, Trust

__all__ = ["trust_of"]

TRIED = ("grazing", "close call")  # what a repeated run decides


def trust_of(trace: Trace, *, again: bool = False) -> Trust:
    """Return the findings about a run; see `gms_fsm.Trace.trust`."""
    if trace.which:
        run = replace(trace, firings=trace.every or trace.firings, which="", every=None)
        vars(run).update({k: u for k, u in vars(trace).items() if k in ("program", "seen")})
        whole = trust_of(run, again=again)
        return Trust(tuple(each for each in whole if each.contact in ("", trace.which)))
    try:
        found = [*_findings(trace.whole(), at_times=trace.stops is not trace.rows)]
    except SignalError as error:  # a Python function is not in a trace file
        return Trust((Doubt("not judged", "note", f"it cannot be judged: {error.reason}"),))
    if again:
        repeat = [*repeated(trace)]
        if all(each.severity == "note" for each in repeat):  # what was doubted holds
            found = [
                replace(each, severity="note") if each.kind in TRIED else each for each in found
            ]
        found += repeat
    found.sort(key=lambda each: (each.severity != "warning", KINDS.index(each.kind)))
    return Trust(tuple(found))


def _findings(trace: Trace, *, at_times: bool) -> Iterator[Doubt]:
    path = Track(trace)
    yield from sampling(path, steps=not at_times)
    if len(trace) > 1:
        yield from not_unique(path)
        yield from switches(path)
        yield from slides(path)
        yield from impulses(path)
    else:
        text = "from the end of a run alone, switches and slides cannot be judged"
        yield Doubt("not judged", "note", text)
    yield from _derivatives(trace)
    yield from unused(trace)
    for each in trace.what.system.machines:
        one = trace.contact(each.name)
        for find in (not_finite, outside, growth, *((meant,) if each.chart.velocities else ())):
            yield from find(one)


def _derivatives(trace: Trace) -> Iterator[Doubt]:
    """Yield the switches where derivatives are one-sided, or end."""
    for each in () if trace.derived is None else trace.derived.followed.doubts:
        text = f"derivatives at t = {each.t:.9g} s, where {each.place}: {each.reason}"
        severity: Severity = "note" if each.kind == "tie" else "warning"
        yield Doubt("sensitivity", severity, text, (each.t,))
