"""Parameters of the models: the Stribeck curve and the element arrays, checked when built."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.errors import ParameterError, shown

__all__ = ["PAPER_COLUMNS", "FloatArray", "GMSParameters", "Stribeck"]

FloatArray: TypeAlias = NDArray[np.float64]

DIP_WIDTH = 6.1  # in v_s: beyond it exp(-(v/v_s)**2) is under 1e-16, the curve is flat
PAPER_COLUMNS = ("non-drifting", "stick-slip")


def checked_scalar(name: str, value: Any, rule: str) -> float:
    """Return value as a float if it keeps the rule, one of ``> 0``, ``>= 0``, ``finite``."""
    try:
        if isinstance(value, str | bytes):  # float("100") is a number
            raise TypeError
        number = float(value)
    except (TypeError, ValueError):
        raise ParameterError(f"{name} is {shown(value)}; it must be a number") from None
    except OverflowError:  # a whole number that no float can hold
        raise ParameterError(f"{name} is too large a number; it must be finite") from None
    if not math.isfinite(number):
        raise ParameterError(f"{name} is {number!r}; it must be finite")
    if (rule == "> 0" and number <= 0) or (rule == ">= 0" and number < 0):
        raise ParameterError(f"{name} is {number!r}; it must be {rule}")
    return number


def checked_array(name: str, values: ArrayLike, n: int | None, rule: str) -> FloatArray:
    """Return a read-only copy, shape (n,), if every entry keeps the rule."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ParameterError(f"{name} is {shown(values)}; it must be a list of numbers") from None
    except OverflowError:
        raise ParameterError(f"{name} has too large a number; it must be finite") from None
    if array.ndim != 1 or array.size == 0:
        raise ParameterError(
            f"{name} has shape {array.shape}; it must be a flat list of numbers, not empty"
        )
    if n is not None and array.size != n:
        raise ParameterError(f"{name} has {array.size} entries, but there are {n} elements")
    broken = ~np.isfinite(array)
    if rule != "finite":
        broken |= array <= 0 if rule == "> 0" else array < 0
    for i in np.flatnonzero(broken)[:1]:
        checked_scalar(f"{name}[{i}] (element {i + 1})", float(array[i]), rule)
    array.setflags(write=False)
    return array


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
        Naming the parameter, its value and the rule. With s = 0 both ``z >= s`` and ``z <= -s``
        could hold at once, and z / s means nothing, hence F_c > 0.

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
        for name in ("F_c", "F_s", "v_s"):
            object.__setattr__(self, name, checked_scalar(name, getattr(self, name), "> 0"))
        if self.F_s < self.F_c:
            raise ParameterError(
                f"F_s is {self.F_s!r}, F_c is {self.F_c!r}; stiction must be at least the Coulomb "
                "friction (F_s >= F_c)"
            )

    @property
    def text(self) -> str:
        """The curve in the expression language; every reader computes this text."""
        return "F_c + (F_s - F_c) * exp(-(v / v_s)**2)"

    @property
    def dip(self) -> float:
        """Speed [m/s] outside of which the curve is flat; drivers stop at +dip and -dip."""
        return DIP_WIDTH * self.v_s

    def __call__(self, v: ArrayLike) -> FloatArray:
        """Return s(v) [N] for velocities v [m/s], any shape (for pictures and reports)."""
        ratio = np.asarray(v, dtype=np.float64) / self.v_s
        return np.asarray(self.F_c + (self.F_s - self.F_c) * np.exp(-ratio * ratio))


@dataclass(frozen=True, eq=False)
class GMSParameters:
    """Parameters of a bank of n GMS elements.

    Parameters
    ----------
    k : array_like, shape (n,)
        Bristle stiffness, N/m, > 0.
    sigma : array_like, shape (n,)
        Bristle damping, Ns/m, >= 0.
    C : array_like, shape (n,)
        Attraction rate of the slip law, >= 0; m/s with unit weights (the paper).
    sigma_2 : float
        Viscous friction, Ns/m, >= 0.
    stribeck : Stribeck
        The curve common to all elements.
    v_c : float
        Velocity under which an element may arrest, m/s, > 0.
    weights : array_like, shape (n,), optional
        Threshold weights w_i, m/N, > 0: element i slips at ``|z_i| = w_i s(v)``. Left out they are
        1 m/N, which is the paper's reading (it compares z in m with s(v) in N).

    Raises
    ------
    ParameterError
        Naming the parameter, its value and the rule.

    Examples
    --------
    >>> p = GMSParameters([100, 50], [1, 1], [0.1, 0.1], sigma_2=0.4,
    ...                   stribeck=Stribeck(1.0, 1.5, 1e-3), v_c=1e-6)
    >>> p.n, p.weights.tolist()
    (2, [1.0, 1.0])
    """

    k: FloatArray
    sigma: FloatArray
    C: FloatArray
    sigma_2: float
    stribeck: Stribeck
    v_c: float
    weights: FloatArray

    def __init__(
        self,
        k: ArrayLike,
        sigma: ArrayLike,
        C: ArrayLike,
        *,
        sigma_2: float,
        stribeck: Stribeck,
        v_c: float,
        weights: ArrayLike | None = None,
    ) -> None:
        stiffness = checked_array("k", k, None, "> 0")
        n = stiffness.size
        if not isinstance(stribeck, Stribeck):
            raise ParameterError(
                f"stribeck is {stribeck!r}; it must be a Stribeck, for example "
                "Stribeck(1, 1.5, 1e-3)"
            )
        values = {
            "k": stiffness,
            "sigma": checked_array("sigma", sigma, n, ">= 0"),
            "C": checked_array("C", C, n, ">= 0"),
            "sigma_2": checked_scalar("sigma_2", sigma_2, ">= 0"),
            "stribeck": stribeck,
            "v_c": checked_scalar("v_c", v_c, "> 0"),
            "weights": checked_array(
                "weights", np.ones(n) if weights is None else weights, n, "> 0"
            ),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def n(self) -> int:
        """Number of elements."""
        return int(self.k.size)

    def with_weights(self, weights: ArrayLike) -> GMSParameters:
        """Return the same parameters with other threshold weights.

        Parameters
        ----------
        weights : array_like, shape (n,)
            w_i, m/N, > 0.

        Returns
        -------
        GMSParameters
            A new object.
        """
        return GMSParameters(
            self.k,
            self.sigma,
            self.C,
            sigma_2=self.sigma_2,
            stribeck=self.stribeck,
            v_c=self.v_c,
            weights=weights,
        )

    @classmethod
    def paper(cls, column: str) -> GMSParameters:
        """Return a column of the paper's Table I (SI units, unit weights).

        Parameters
        ----------
        column : {"non-drifting", "stick-slip"}
            Which experiment.

        Returns
        -------
        GMSParameters
            Four elements.

        Raises
        ------
        ParameterError
            If there is no such column.

        Examples
        --------
        >>> GMSParameters.paper("stick-slip").C.tolist()
        [0.1, 0.05, 0.025, 0.0001]
        """
        if column == "non-drifting":
            return cls(
                [100, 10, 1, 0.1],
                [10, 0.1, 1, 1],
                [1, 1, 1, 1],
                sigma_2=4,
                stribeck=Stribeck(F_c=1, F_s=1.5, v_s=1e-3),
                v_c=1e-6,
            )
        if column == "stick-slip":
            return cls(
                [0.7, 0.7, 0.7, 0.7],
                [0.3, 0.4, 0.5, 0.6],
                [0.1, 0.05, 0.025, 1e-4],
                sigma_2=0.1,
                stribeck=Stribeck(F_c=0.4, F_s=1.5, v_s=1e-3),
                v_c=1e-6,
            )
        raise ParameterError(
            f"Table I has no column {column!r}; it has {' and '.join(map(repr, PAPER_COLUMNS))}"
        )

    @classmethod
    def from_shares(
        cls,
        alpha: ArrayLike,
        k: ArrayLike,
        *,
        C: float,
        stribeck: Stribeck,
        v_c: float,
        sigma: ArrayLike | None = None,
        sigma_2: float = 0.0,
    ) -> GMSParameters:
        """Return parameters in Al-Bender's form: element i carries the share alpha_i of friction.

        ``w_i = alpha_i / k_i`` and ``C_i = alpha_i C / k_i``, so that in steady slip the forces
        ``k_i z_i`` add up to s(v).

        Parameters
        ----------
        alpha : array_like, shape (n,)
            Shares, > 0, sum 1.
        k : array_like, shape (n,)
            Stiffness, N/m, > 0.
        C : float
            Attraction parameter of the whole bank, N/s, >= 0.
        stribeck : Stribeck
            The curve.
        v_c : float
            m/s, > 0.
        sigma : array_like, shape (n,), optional
            Bristle damping, Ns/m; none when left out.
        sigma_2 : float
            Viscous friction, Ns/m.

        Returns
        -------
        GMSParameters
            With weights in m/N.

        Raises
        ------
        ParameterError
            If the shares do not add up to 1, or a parameter breaks its rule.

        Examples
        --------
        >>> p = GMSParameters.from_shares([0.5, 0.5], [40, 10], C=2.0,
        ...                               stribeck=Stribeck(1, 1.5, 1e-3), v_c=1e-4)
        >>> p.weights.tolist(), p.C.tolist()
        ([0.0125, 0.05], [0.025, 0.1])
        """
        stiffness = checked_array("k", k, None, "> 0")
        shares = checked_array("alpha", alpha, stiffness.size, "> 0")
        rate = checked_scalar("C", C, ">= 0")
        total = math.fsum(shares)
        if abs(total - 1.0) > 1e-9:
            raise ParameterError(f"alpha adds up to {total!r}; the shares must add up to 1")
        return cls(
            stiffness,
            np.zeros(stiffness.size) if sigma is None else sigma,
            shares * rate / stiffness,
            sigma_2=sigma_2,
            stribeck=stribeck,
            v_c=v_c,
            weights=shares / stiffness,
        )


def as_floats(values: FloatArray) -> list[float]:
    """Return plain Python floats; the readable engine is three times faster on lists."""
    floats: list[float] = values.tolist()
    return floats
