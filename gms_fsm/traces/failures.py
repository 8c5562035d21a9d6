"""Errors raised during a run; each keeps what was computed up to then."""

from __future__ import annotations

from gms_fsm.errors import GMSError
from gms_fsm.traces.trace import Trace

__all__ = [
    "CallbackError",
    "LivelockError",
    "LockError",
    "NotFiniteError",
    "NotUniqueError",
    "SignalEndError",
    "SimulationError",
    "StepLimitError",
    "StepSizeError",
]


class SimulationError(GMSError, RuntimeError):
    """A run could not continue; `trace` has everything computed up to then.

    Parameters
    ----------
    reason : str
        What happened.
    trace : Trace
        The part of the run before the error.
    t : float, optional
        Time of the failure, s.
    place : str, optional
        The element, edge or signal concerned.
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
        self.kept = ".trace"  # where the partial run is: this attribute, a file, or nowhere

    def __str__(self) -> str:
        if not self.kept:
            return self.happened
        return f"{self.happened}; the run so far is kept in {self.kept}"

    @property
    def happened(self) -> str:
        """The message without the part that says where the run is kept."""
        scene = self.place
        if self.t is not None:
            scene = f"{scene} at t = {self.t!r} s" if scene else f"t = {self.t!r} s"
        return GMSError.__str__(self.replaced(place=scene))


class LivelockError(SimulationError):
    """States keep switching without progress in time, or in time and state."""


class LockError(SimulationError):
    """A lock would take a velocity that has jumped, or what moved it leaves no way out."""


class NotUniqueError(SimulationError):
    """Several surfaces attract the motion at once: how it goes on there is not unique."""


class StepSizeError(SimulationError):
    """The step size fell below the resolution of the clock."""


class StepLimitError(SimulationError):
    """The step limit (`max_steps`) was reached, or a stiff run would need far more steps."""


class NotFiniteError(SimulationError):
    """A signal or a flow returned NaN or infinity."""


class SignalEndError(SimulationError):
    """A sampled signal ends before the run does."""


class CallbackError(SimulationError):
    """A callback changed values, or the state of an element, which it may only read."""
