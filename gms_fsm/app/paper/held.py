"""How a chart with held outputs differs from the same law evaluated inside the steps.

A chart with a sample time is asked at its ticks, and its outputs dz and F are held until the next
one. The force is therefore a staircase, and z follows v with a delay. Both are lags, proportional
to the sample time.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gms_fsm.app.paper import FIG3_END
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.traces.trace import Trace

__all__ = [
    "OSCILLATION",
    "PAPERS_FORCE",
    "PAPERS_PLACE",
    "RAMP",
    "Lag",
    "figure_3_lags",
    "lag_of",
]

RAMP, OSCILLATION = (0.0, 2.0), (4.0, FIG3_END)  # s: phases of the applied force of Fig. 3
PAPERS_FORCE, PAPERS_PLACE = 1e-4, 1e-6  # N and m: the residual that the paper reports for Fig. 3


@dataclass(frozen=True, eq=False)
class Lag:
    """Difference of a run with held outputs and a run with the law evaluated inside the steps.

    Parameters
    ----------
    period : float
        Sample time of the held outputs, s.
    t : ndarray, shape (m,), s
        The ticks.
    force : ndarray, shape (m,), N
        Difference of F at the ticks, just after the chart was asked.
    before : ndarray, shape (m,), N
        Difference of F just before the next tick, at the end of the held value.
    place : ndarray, shape (m,), m
        Difference of x at the ticks.
    """

    period: float
    t: FloatArray
    force: FloatArray
    before: FloatArray
    place: FloatArray

    def during(self, phase: tuple[float, float]) -> Lag:
        """Return the part in which begin <= t < end [s]."""
        inside = (self.t >= phase[0]) & (self.t < phase[1])
        return Lag(
            self.period, self.t[inside], self.force[inside], self.before[inside], self.place[inside]
        )

    @property
    def largest(self) -> tuple[float, float]:
        """Largest difference of F [N] and of x [m] at the ticks."""
        return float(np.abs(self.force).max()), float(np.abs(self.place).max())

    @property
    def median(self) -> tuple[float, float]:
        """Median difference of F [N] and of x [m] at the ticks."""
        return float(np.median(np.abs(self.force))), float(np.median(np.abs(self.place)))

    @property
    def largest_before(self) -> float:
        """Largest difference of F just before a tick, N."""
        return float(np.abs(self.before).max())


@functools.lru_cache(maxsize=8)  # claims and figures ask for the same runs
def lag_of(held: Trace, inside: Trace) -> Lag:
    """Compare a run with held outputs with one that evaluates the law inside its steps.

    Parameters
    ----------
    held : Trace
        A run with ``events="held"`` whose rows are its ticks.
    inside : Trace
        A run of the same model and rig, at least as long.

    Returns
    -------
    Lag
        The differences, held minus inside.
    """
    period = held.settings["step"]
    if not isinstance(period, float):
        raise TypeError(f"the run has step = {period!r}; it must have a sample time")
    other = inside.sample(held.t)
    return Lag(
        period,
        held.t[:-1],
        (held.F - other.F)[:-1],
        held.F[:-1] - other.F[1:],
        (held.x - other.x)[:-1],
    )


def figure_3_lags(traces: Mapping[str, Trace]) -> list[Lag]:
    """Compare the held charts of Fig. 3 with the if-else code evaluated inside the steps.

    Parameters
    ----------
    traces : mapping of str to Trace
        From `gms_fsm.app.paper.experiments.run`.

    Returns
    -------
    list of Lag
        One per sample time, the longest first.
    """
    held = [trace for name, trace in traces.items() if name.startswith("fig3_held_chart")]
    return sorted((lag_of(each, traces["fig3_step"]) for each in held), key=lambda lag: -lag.period)
