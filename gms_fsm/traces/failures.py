"""Errors of a run that began: each holds what was computed up to there."""

from __future__ import annotations

from gms_fsm.errors import GMSError
from gms_fsm.traces.trace import Trace

__all__ = [
    "CallbackError",
    "LivelockError",
    "NotFiniteError",
    "SignalEndError",
    "SimulationError",
    "StepLimitError",
    "StepSizeError",
]


class SimulationError(GMSError, RuntimeError):
    """A run could not go on; `trace` holds all that was computed up to there.

    Parameters
    ----------
    message : str
        What happened, where, with which values, and what to try.
    trace : Trace
        The part of the run before the error.
    """

    def __init__(self, message: str, trace: Trace) -> None:
        super().__init__(message)
        self.trace = trace


class LivelockError(SimulationError):
    """States switch again and again without progress of time, or of time and state."""


class StepSizeError(SimulationError):
    """The step size fell under the resolution of the clock."""


class StepLimitError(SimulationError):
    """The steps are used up (`max_steps`), or a stiff run would need many more than there are."""


class NotFiniteError(SimulationError):
    """A signal or a flow returned NaN or infinity."""


class SignalEndError(SimulationError):
    """A sampled signal ends before the run does."""


class CallbackError(SimulationError):
    """A callback changed what it may only look at: values, or the state of an element."""
