"""Checking monitors against a model, and evaluating them on a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from gms_fsm.errors import ParameterError, keyed, shown
from gms_fsm.foundation.arguments import listed, there_are, unknown
from gms_fsm.systems.mounted import Mounted
from gms_fsm.traces.monitors._chattering import chattering
from gms_fsm.traces.monitors._coverage import coverage
from gms_fsm.traces.monitors._invariants import invariant_verdict, read_invariant
from gms_fsm.traces.monitors._kinds import (
    ALL,
    KNOWN,
    Chattering,
    CoverageMonitor,
    Invariant,
    Monitor,
    Passivity,
)
from gms_fsm.traces.monitors._passivity import passivity
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import Verdict


def checked(
    monitors: str | Iterable[str | Monitor], what: Mounted, output: str = "all"
) -> dict[str, Monitor]:
    """Check monitors and return them by name.

    Parameters
    ----------
    monitors : str or iterable of str or Monitor
        ``"chattering"``, ``"passivity"``, ``"coverage"``, ``"all"`` for these three, or the text
        of an invariant; in a system also with a contact before it: ``"gear: passivity"``.
    what : Mounted
        What is to be monitored. In a system with several contacts a monitor without a contact,
        unless it is an invariant, stands for one of each.
    output : {"all", "t_eval", "end"}
        Rows that the run will have.

    Returns
    -------
    dict of str to Monitor
        Monitors by name.

    Raises
    ------
    ParameterError
        If one is unknown, given twice, or needs rows that the run will not have.
    ExpressionError
        If an invariant cannot be read.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> from gms_fsm.systems.mounted import mounted
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> list(checked(["all", "z <= s"], mounted(model, Prescribed("0.2"))))
    ['chattering', 'passivity', 'coverage', 'z <= s']
    """
    given = (
        [monitors]
        if isinstance(monitors, str | Monitor)
        else listed("monitors", monitors, "names of monitors, or monitors")
    )
    found: dict[str, Monitor] = {}
    for i, each in enumerate(given):
        with keyed("monitors", i):
            for monitor in _monitors(each, what.machines):
                _check(monitor, what, found, output)
                found[monitor.name] = monitor
    return found


def _check(monitor: Monitor, what: Mounted, others: Mapping[str, Monitor], output: str) -> None:
    """Refuse a monitor that is given twice, or that the run cannot have."""
    if monitor.name in others:
        raise ParameterError(
            f"monitors contains {shown(monitor.name)} twice", advice="give it once"
        )
    if isinstance(monitor, Invariant):
        read_invariant(monitor, what)
    if output == "end" and not isinstance(monitor, Chattering):
        raise ParameterError(
            f"the monitor {shown(monitor.name)} needs the rows of a run, but output is 'end'",
            advice="use output='all'",
        )


def _monitors(given: str | Monitor, known: Sequence[str]) -> list[Monitor]:
    """Return the monitors that an entry stands for."""
    contact, text = "", given
    if isinstance(given, str) and ":" in given:
        contact, _, text = (part.strip() for part in given.partition(":"))
    elif isinstance(given, Monitor):
        contact = given.contact
    if contact and contact not in known:
        raise ParameterError(
            f"monitors contains {shown(given if isinstance(given, str) else given.name)}: "
            f"there is no contact {contact!r}",
            advice=there_are(contact, known)
            if known
            else "a model on a rig has one contact, so leave its name out",
        )
    found = [*ALL] if text == "all" else [_monitor(text)]
    if contact:
        return [replace(each, contact=contact) for each in found]
    every = known if len(known) > 1 else [""]
    return [
        replace(each, contact=name)
        for name in every
        for each in found
        if not isinstance(each, Invariant)
    ] + [each for each in found if isinstance(each, Invariant)]


def _monitor(given: str | Monitor) -> Monitor:
    if isinstance(given, Monitor):
        return given
    if not isinstance(given, str):
        raise ParameterError(
            f"monitors contains {shown(given)}",
            advice=f"a monitor is {', '.join(map(repr, KNOWN))}, the text of an invariant, or "
            "an object of gms_fsm.traces.monitors",
        )
    word = given.strip()
    if word.isidentifier() and word not in KNOWN:
        error = unknown("monitor", word, [*KNOWN, "all"])
        raise error.replaced(advice=f"{error.advice}, and invariants such as 'abs(z) <= 2*s'")
    return KNOWN.get(word) or Invariant(given)


def examine(
    trace: Trace,
    monitors: str | Iterable[str | Monitor],
    error: Exception | None = None,
) -> dict[str, Verdict]:
    """Evaluate monitors on a run.

    Parameters
    ----------
    trace : Trace
        A run, possibly read from a file.
    monitors : str or iterable of str or Monitor
        As for `checked`.
    error : Exception, optional
        The error that ended the run.

    Returns
    -------
    dict of str to Verdict
        Verdicts by monitor name.

    Raises
    ------
    ParameterError, ExpressionError
        As for `checked`.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> found = examine(trace, ["coverage", "z <= 0.3"])
    >>> found["coverage"].never[0], round(found["z <= 0.3"].t, 9)
    ('edge break_away_backward', 1.5)
    """
    whole = trace.whole()
    found: dict[str, Verdict] = {}
    for name, monitor in checked(monitors, trace.subject).items():
        run, rows = trace, whole
        if monitor.contact:
            run, rows = (each.contact(monitor.contact) for each in (trace, whole))
        match monitor:
            case Chattering():
                found[name] = chattering(monitor, run, error)
            case Invariant():
                found[name] = invariant_verdict(monitor, rows)
            case Passivity():
                found[name] = passivity(monitor, rows)
            case CoverageMonitor():
                found[name] = coverage(rows)
    return found


def watched(trace: Trace, monitors: Iterable[Monitor], error: Exception | None = None) -> Trace:
    """Return a run with the verdicts of its monitors.

    Parameters
    ----------
    trace, monitors, error
        As in `examine`.

    Returns
    -------
    Trace
        The same run, with `Trace.monitors`.
    """
    return trace.with_monitors(examine(trace, monitors, error))
