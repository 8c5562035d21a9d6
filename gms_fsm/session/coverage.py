"""coverage(): what runs have tried of the charts in them, of one run or of many."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import refusing
from gms_fsm.run.sweep import Sweep
from gms_fsm.session.session import Session
from gms_fsm.traces.coverage.counting import of_trace
from gms_fsm.traces.coverage.total import Coverage
from gms_fsm.traces.trace import Trace

__all__ = ["Coverage", "Covered", "coverage"]

Covered: TypeAlias = Trace | Sweep | Session | Coverage


@refusing()
def coverage(what: Covered | Iterable[Covered]) -> Coverage:
    """Count what runs have tried of their charts: states, edges, clauses of guards, MC/DC.

    Parameters
    ----------
    what : Trace, Sweep, Session, Coverage, or several of these
        Of the same charts. Of a session all branches are run to their ends and count, each from the
        start of the run. Of a sweep states and edges are known, clauses only with
        ``sweep(..., coverage=True)``.

    Returns
    -------
    Coverage
        Printed, it says what was never taken and why; ``+`` adds those of other runs.

    Raises
    ------
    ParameterError
        If it is no run, or charts differ.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> found = coverage(simulate(model, Prescribed("0.2"), 3.0))
    >>> found.scores["edges"], found.lowest
    (Score(seen=1, of=3), ('MC/DC', 16.666666666666668))
    """
    match what:
        case Coverage():
            return what
        case Trace():
            return of_trace(what)
        case Sweep():
            if what.coverage is None:
                raise ParameterError(
                    "a sweep that was read from a file has no coverage",
                    place="what",
                    advice="take it before saving: coverage(sweep(...)).save('coverage.json')",
                )
            return what.coverage
        case Session():
            return Coverage.merged(of_trace(what.tree.trace(each)) for each in what.tree.forks)
    if not isinstance(what, Iterable) or isinstance(what, str | dict):
        raise ParameterError(
            "it must be a Trace, a Sweep, a Session, a Coverage, or several of these",
            place="what",
            value=what,
        )
    return Coverage.merged(coverage(each) for each in what)
