"""Monitors: properties checked on a run.

They are evaluated on the rows and the transition log after the run has ended or failed, so they
cost nothing in a run without monitors. They see every accepted step and both sides of every
firing; with `t_eval` the requested rows and both sides of every stop; with ``output="end"`` the
log only, which suffices for `Chattering` alone.
"""

from gms_fsm.traces.monitors._examining import checked, examine, watched
from gms_fsm.traces.monitors._kinds import (
    Chattering,
    CoverageMonitor,
    Invariant,
    Monitor,
    Passivity,
)

__all__ = [
    "Chattering",
    "CoverageMonitor",
    "Invariant",
    "Monitor",
    "Passivity",
    "checked",
    "examine",
    "watched",
]
