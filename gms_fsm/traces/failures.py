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
    reason : str
        What happened.
    trace : Trace
        The part of the run before the error.
    t : float, optional
        When, s.
    place : str, optional
        Where: an element, an edge, a signal.
    advice : str, optional
        What to try.
    """

    def __init__(
        self,
        reason: str,
        trace: Trace,
        *,
        t: float | None = None,
        place: str = "",
        advice: str = "",
    ) -> None:
        super().__init__(reason, place=place, advice=advice)
        self.trace, self.t = trace, t
        self.kept = ".trace"  # where the run up to there is: here, or a file

    def __str__(self) -> str:
        return f"{self.happened}; the run up to there is kept in {self.kept}"

    @property
    def happened(self) -> str:
        """The text without a word on where the run is kept, for those who show the run itself."""
        scene = self.place
        if self.t is not None:
            scene = f"{scene} at t = {self.t!r} s" if scene else f"t = {self.t!r} s"
        return GMSError.__str__(self.replaced(place=scene))


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
