"""Friction that a controller adds to its force, so that its plant seems to have none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.coupling.joint import Line
from gms_fsm.coupling.stepping import FrictionState
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import refusing
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

__all__ = ["Compensator"]


@refusing()
class Compensator:
    """The friction of a plant, as its controller predicts it tick by tick.

    A `FrictionState` follows the velocity of the reference, the measured one, or a mixture. Between
    ticks it is a straight line, so reversals, break-aways and arrests are located within the
    sample. `gms_fsm.export` writes it as C99, with the same bits.

    Parameters
    ----------
    model_or_fit : Model, Contact or Fit
        Friction with one velocity and without locks; of a fit its model.
    period : float
        s, > 0: of the controller.
    feedback : float
        From 0, the reference only (feedforward), to 1, the measured velocity only.
    gain : float
        >= 0: the share of the friction that is compensated. With feedback, more than there is
        makes the loop hunt.
    limit : float
        N, > 0: the largest force.
    initial, engine
        As for `gms_fsm.FrictionState`.

    Attributes
    ----------
    friction : FrictionState
        Its time, elements and switches.

    Raises
    ------
    ParameterError
        If the friction cannot be stepped, or an argument violates its rule.

    Examples
    --------
    >>> from gms_fsm import Compensator, LuGre, Stribeck
    >>> joint = LuGre(sigma_0=1e4, sigma_1=10.0, sigma_2=0.4, stribeck=Stribeck(1.0, 1.5, 0.01))
    >>> compensator = Compensator(joint, 1e-3, limit=1.2)
    >>> [round(compensator.advance(v), 3) for v in (0.01, 0.1, 0.1)]
    [0.149, 1.04, 1.04]
    """

    def __init__(
        self,
        model_or_fit: Any,
        period: float,
        *,
        feedback: float = 0.0,
        gain: float = 1.0,
        limit: float = math.inf,
        initial: Mapping[str, Any] | None = None,
        engine: str | None = None,
    ) -> None:
        given = model_or_fit
        if not hasattr(given, "chart"):  # a Fit is of a higher room
            given = getattr(given, "model", given)
        self.friction = FrictionState(given, initial=initial, engine=engine)
        self.period = checked_scalar("period", period, "> 0")
        self.feedback = checked_scalar("feedback", feedback, ">= 0")
        if self.feedback > 1.0:
            raise ParameterError("it must be from 0 to 1", place="feedback", value=feedback)
        self.gain = checked_scalar("gain", gain, ">= 0")
        self.limit = math.inf if limit == math.inf else checked_scalar("limit", limit, "> 0")
        self.initial = initial
        self._v = 0.0

    def __repr__(self) -> str:
        return f"<Compensator of {self.model!r}, every {self.period!r} s>"

    @property
    def model(self) -> Model | Contact:
        """The friction that it predicts."""
        return self.friction.model

    def advance(self, reference: float, measured: float | None = None, **inputs: Line) -> float:
        """Advance by a tick, and return the force to add.

        Parameters
        ----------
        reference : float
            m/s: the velocity that is wanted at the end of the sample that begins. A loop that acts
            later by some ticks needs that of so many ticks later.
        measured : float, optional
            m/s: the measured velocity; needed with feedback.
        **inputs : (float, float)
            Further inputs of a contact, as for `gms_fsm.FrictionState.advance`.

        Returns
        -------
        float
            N: the friction at the end of the sample times the gain, within the limit.

        Raises
        ------
        ParameterError, SimulationError
            As in `gms_fsm.FrictionState.advance`, or if the measured velocity is missing; the
            compensator stays as it was.
        """
        v = _finite("reference", reference)
        if self.feedback > 0.0:
            if measured is None:
                raise ParameterError(
                    "it is needed",
                    place="measured",
                    advice="give the measured velocity, or feedback=0.0",
                )
            v += self.feedback * (_finite("measured", measured) - v)
        force = self.gain * self.friction.advance(self._v, v, self.period, **inputs)
        self._v = v
        return min(max(force, -self.limit), self.limit)


def _finite(name: str, value: float) -> float:
    if type(value) is float and math.isfinite(value):
        return value
    return checked_scalar(name, value, "finite")
