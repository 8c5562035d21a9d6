"""Integrators for systems that flow, and switch at located crossings.

This package knows nothing about what it integrates. `Equations` are a handful of functions over
plain indexable numbers (lists in Python, arrays when compiled); a loop over them yields events.
"""

from integrators.crossings import FOR_GUARD, WAITING
from integrators.hybrid import (
    MOST_SWITCHES,
    ROWS_AT_ONCE,
    Arc,
    Equations,
    Event,
    Firing,
    HybridError,
    Livelock,
    NotFinite,
    Options,
    Slide,
    StepTooSmall,
    Stop,
    Switch,
    TooManySteps,
    run,
)
from integrators.sliding import LIVE, Functions, Held, Surfaces, look, sliding_scratch, slope_on
from integrators.tableaux import BS23, DP45, EULER, HEUN, METHODS, RK4, Tableau

__all__ = [
    "BS23",
    "DP45",
    "EULER",
    "FOR_GUARD",
    "HEUN",
    "LIVE",
    "METHODS",
    "MOST_SWITCHES",
    "RK4",
    "ROWS_AT_ONCE",
    "WAITING",
    "Arc",
    "Equations",
    "Event",
    "Firing",
    "Functions",
    "Held",
    "HybridError",
    "Livelock",
    "NotFinite",
    "Options",
    "Slide",
    "StepTooSmall",
    "Stop",
    "Surfaces",
    "Switch",
    "Tableau",
    "TooManySteps",
    "look",
    "run",
    "sliding_scratch",
    "slope_on",
]
