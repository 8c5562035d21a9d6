"""The Stribeck curve: friction in steady sliding, which falls from F_s at rest to F_c at speed.

`Stribeck` is the curve common to all elements of a model, the input ``s`` of their charts.
`stribeck_text` is its text, for charts that name the curve themselves, for example with a load.

References
----------
B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, "A Survey of Models, Analysis Tools and
Compensation Methods for the Control of Machines with Friction", Automatica 30(7), 1083-1138 (1994),
doi:10.1016/0005-1098(94)90209-7, for the exponent and the load.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import STRIBECK, TINY, FloatArray, checked_values
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import refusing
from gms_fsm.language import Value, parse_value, values_of
from integrators import elementary

DIP_WIDTH = 6.1  # in v_s: beyond this exp(-(v/v_s)**2) is below 1e-16 and the curve is flat
GAUSSIAN = 2.0  # the exponent of eq. (2)
FINEST = 2.0**55  # its inverse is a quarter of the last bit of 1
INFINITY = math.inf


def stribeck_text(
    F_c: str = "F_c",
    F_s: str = "F_s",
    v_s: str = "v_s",
    delta: str | float = GAUSSIAN,
    *,
    v: str = "v",
    load: str = "",
    stops: bool = False,
) -> str:
    """Return the text ``F_c + (F_s - F_c) * exp(-(abs(v) / v_s)**delta)`` of a Stribeck curve.

    Examples
    --------
    >>> stribeck_text()
    'F_c + (F_s - F_c) * exp(-(v / v_s)**2)'
    >>> stribeck_text("mu_c", "mu_s", delta="delta", load="N")
    'N * (mu_c + (mu_s - mu_c) * exp(-(abs(v) / v_s)**delta))'
    """
    F_c, F_s, v_s, v, load = (_part(each) for each in (F_c, F_s, v_s, v, load))
    if str(delta) in ("2", "2.0"):
        power = f"({v} / {v_s})**2"
    else:
        power = f"(abs({v}) / {v_s})**{_part(str(delta))}"
    if stops:
        power = f"min({power}, {DIP_WIDTH**2:g})"
    curve = f"{F_c} + ({F_s} - {F_c}) * exp(-{power})"
    return f"{load} * ({curve})" if load else curve


def _part(text: str) -> str:
    """Return a text that can be multiplied."""
    simple = not text or text.isidentifier() or text.replace(".", "", 1).isdigit()
    return text if simple else f"({text})"


_TEXTS = stribeck_text(delta="delta"), stribeck_text(delta=GAUSSIAN)


@refusing()
@dataclass(frozen=True)
class Stribeck:
    """The Stribeck curve ``s(v) = F_c + (F_s - F_c) * exp(-abs(v / v_s)**delta)``, eq. (2).

    Parameters
    ----------
    F_c : float
        Coulomb friction, N, > 0.
    F_s : float
        Stiction, N, >= F_c.
    v_s : float
        Stribeck velocity, m/s, > 0.
    delta : float
        Exponent, 0.1 to 20; that of eq. (2) is 2, the default.

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
    delta: float = GAUSSIAN

    def __post_init__(self) -> None:
        for name, value in checked_values(STRIBECK, vars(self)).items():
            object.__setattr__(self, name, value)
        if self.v_s < TINY:
            raise ParameterError(
                f"it must be at least {TINY:g}: one over it would be infinite",
                place="v_s",
                value=self.v_s,
            )

    @property
    def numbers(self) -> Mapping[str, float]:
        """The numbers that the text names."""
        found: dict[str, float] = dict(vars(self))
        if self.delta == GAUSSIAN:
            del found["delta"]
        return found

    @property
    def text(self) -> str:
        """The curve in the expression language."""
        return _TEXTS[self.delta == GAUSSIAN]

    @property
    def tree(self) -> Value:
        """The curve as runs compute it, with v * (1 / v_s): the division does not wait for v."""
        return _tree(self.text)

    @property
    def dip(self) -> float:
        """Speed [m/s] beyond which the curve is flat; integrators stop at +dip and -dip."""
        return dip_of(self.v_s, self.delta)

    @property
    def flat(self) -> float:
        """Speed [m/s] beyond which the curve is F_c to the last bit."""
        return _flat(self.F_c, self.F_s, self.v_s, self.delta)

    def __call__(self, v: ArrayLike) -> FloatArray:
        """Return s(v) [N] for velocities v [m/s] of any shape, computed exactly as in a run."""
        return values_of(self.tree, {"v": np.asarray(v, dtype=np.float64), **self.numbers})


# These two are functions of numbers, so that exports can translate them.
def dip_of(v_s: float, delta: float) -> float:
    """Return the speed beyond which a curve is flat, `Stribeck.dip`.

    Examples
    --------
    >>> round(dip_of(1e-3, 2.0), 6)
    0.0061
    """
    width: float = elementary.power(DIP_WIDTH, GAUSSIAN / delta)
    return width * v_s


def flat_of(F_c: float, F_s: float, v_s: float, delta: float) -> float:
    """Return the speed beyond which a curve is F_c to the last bit, `Stribeck.flat`.

    There the rest is less than a quarter of the distance from F_c to the next number.

    Examples
    --------
    >>> round(flat_of(0.4, 1.5, 1e-3, 2.0), 6)
    0.006256
    """
    share = (F_s - F_c) / F_c * FINEST
    if not share < INFINITY:
        return INFINITY
    width: float = elementary.power(elementary.log(max(share, 1.0)), 1.0 / delta)
    return width * v_s * (1.0 + 1e-9)


_flat = functools.lru_cache(maxsize=256)(flat_of)  # a curve is asked again for each run


@functools.cache
def _tree(text: str) -> Value:
    text = text.replace("/ v_s", "* (1 / v_s)")
    return parse_value(text, ("v", *(each.name for each in STRIBECK)))
