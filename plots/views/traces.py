"""What is asked of a trace before anything of it is drawn."""

from __future__ import annotations

from gms_fsm.errors import ParameterError
from gms_fsm.traces.trace import Trace


def check_trace(trace: object, *, moving: bool = True) -> None:
    """Raise `ParameterError` unless an object is a trace of one contact, or supervisor."""
    if not isinstance(trace, Trace):
        raise ParameterError(
            "it must be a Trace, from simulate(...) or Trace.load(path)", place="trace", value=trace
        )
    # A system with several contacts refuses here, if there is one that could be drawn.
    if moving and not (trace.contacts and trace.model.chart.velocities):
        raise ParameterError(
            "a supervisor has no velocity and no force to draw",
            place="trace",
            value=trace,
            advice="its chart is drawn by plots.statechart, its run by plots.replay",
        )
