"""The Stribeck curve, common to all elements of a model."""

from __future__ import annotations

import functools
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import STRIBECK, FloatArray, checked_values
from gms_fsm.language import Value, parse_value
from gms_fsm.language._vectors import values_of

__all__ = ["Stribeck"]

DIP_WIDTH = 6.1  # in v_s: beyond this exp(-(v/v_s)**2) is below 1e-16 and the curve is flat


@dataclass(frozen=True)
class Stribeck:
    """The Stribeck curve ``s(v) = F_c + (F_s - F_c) * exp(-(v / v_s)**2)``, eq. (2).

    Parameters
    ----------
    F_c : float
        Coulomb friction, N, > 0.
    F_s : float
        Stiction, N, >= F_c.
    v_s : float
        Stribeck velocity, m/s, > 0.

    Raises
    ------
    ParameterError
        Naming the parameter, its value and the rule. F_c > 0 is required because with s = 0 both
        ``z >= s`` and ``z <= -s`` could hold at once, and z / s would be undefined.

    Examples
    --------
    >>> curve = Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3)
    >>> float(curve(0.0)), float(curve(1.0))
    (1.5, 1.0)
    """

    F_c: float
    F_s: float
    v_s: float

    def __post_init__(self) -> None:
        for name, value in checked_values(STRIBECK, asdict(self)).items():
            object.__setattr__(self, name, value)

    @property
    def text(self) -> str:
        """The curve in the expression language; every reader evaluates this text."""
        return "F_c + (F_s - F_c) * exp(-(v / v_s)**2)"

    @property
    def dip(self) -> float:
        """Speed [m/s] beyond which the curve is flat; integrators stop at +dip and -dip."""
        return DIP_WIDTH * self.v_s

    def __call__(self, v: ArrayLike) -> FloatArray:
        """Return s(v) [N] for velocities v [m/s] of any shape, computed exactly as in a run."""
        return values_of(_tree(self.text), {"v": np.asarray(v, dtype=np.float64), **asdict(self)})


@functools.cache
def _tree(text: str) -> Value:
    return parse_value(text, ("v", *(each.name for each in STRIBECK)))
