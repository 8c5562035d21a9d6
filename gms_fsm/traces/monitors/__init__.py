"""Monitors: what a run is watched for.

They look at the rows and the transition log once the run has ended or failed, so a run without
monitors does nothing for them. What they see: every accepted step and both sides of every firing;
with `t_eval` the wanted rows and both sides of every stop; with ``output="end"`` the log alone,
which is enough for `Chattering` only.
"""

from gms_fsm.traces.monitors._examining import checked, examine, watched
from gms_fsm.traces.monitors._kinds import Chattering, Coverage, Invariant, Monitor, Passivity

__all__ = [
    "Chattering",
    "Coverage",
    "Invariant",
    "Monitor",
    "Passivity",
    "checked",
    "examine",
    "watched",
]
