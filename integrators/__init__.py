"""Integrators for systems that flow, and switch at located crossings.

This package knows nothing about what it integrates. `Equations` are a handful of functions over
plain indexable numbers (lists in Python, arrays when compiled); a loop over them yields events.
"""

from integrators.crossings import FOR_A_GUARD, FOR_A_SIGN, WAITING
from integrators.hybrid import (
    MOST_SWITCHES,
    ROWS_AT_ONCE,
    Arc,
    Entangled,
    Equations,
    Event,
    Firing,
    HybridError,
    Livelock,
    LoopOptions,
    NotFinite,
    Refused,
    Slide,
    StepTooSmall,
    Stop,
    Switching,
    TooManySteps,
    run,
)
from integrators.runners.ticks import Ticks
from integrators.sliding import (
    LIVE,
    Functions,
    Held,
    Surfaces,
    arm_on,
    look,
    sliding_scratch,
    slope_on,
)
from integrators.switching.jolts import JUMPED, LET_GO
from integrators.tableaux import BS23, DP45, EULER, HEUN, METHODS, RK4, Tableau

__all__ = [
    "BS23",
    "DP45",
    "EULER",
    "FOR_A_GUARD",
    "FOR_A_SIGN",
    "HEUN",
    "JUMPED",
    "LET_GO",
    "LIVE",
    "METHODS",
    "MOST_SWITCHES",
    "RK4",
    "ROWS_AT_ONCE",
    "WAITING",
    "Arc",
    "Entangled",
    "Equations",
    "Event",
    "Firing",
    "Functions",
    "Held",
    "HybridError",
    "Livelock",
    "LoopOptions",
    "NotFinite",
    "Refused",
    "Slide",
    "StepTooSmall",
    "Stop",
    "Surfaces",
    "Switching",
    "Tableau",
    "Ticks",
    "TooManySteps",
    "arm_on",
    "look",
    "run",
    "sliding_scratch",
    "slope_on",
]
