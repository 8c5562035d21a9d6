"""Integrators for systems that flow, and switch at located crossings.

This package knows nothing of what it integrates. A system is a handful of functions over plain
indexable numbers (lists in Python, arrays when compiled); a loop over it yields what happened.
"""

from integrators.hybrid import (
    MOST_SWITCHES,
    ROWS_AT_ONCE,
    Arc,
    Firing,
    HybridError,
    Livelock,
    NotFinite,
    Options,
    StepTooSmall,
    Stop,
    Switch,
    System,
    run,
)
from integrators.tableaux import BS23, DP45, EULER, HEUN, METHODS, RK4, Tableau

__all__ = [
    "BS23",
    "DP45",
    "EULER",
    "HEUN",
    "METHODS",
    "MOST_SWITCHES",
    "RK4",
    "ROWS_AT_ONCE",
    "Arc",
    "Firing",
    "HybridError",
    "Livelock",
    "NotFinite",
    "Options",
    "StepTooSmall",
    "Stop",
    "Switch",
    "System",
    "Tableau",
    "run",
]
