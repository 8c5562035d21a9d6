"""The parameters of a bank of GMS elements, checked at construction."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.gms import PARAMETERS, TABLE_I, WHICH_C
from gms_fsm.charts.parameters import (
    SIGMA_2,
    WEIGHTS,
    FloatArray,
    checked_array,
    checked_scalar,
    is_list,
)
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import copied, nearest, refusing, unknown
from gms_fsm.foundation.display import displayed, short_repr
from gms_fsm.foundation.equality import by_value

RULES = {each.name: each.rule for each in PARAMETERS}
EVERY = {each.name: each for each in (*PARAMETERS, SIGMA_2, WEIGHTS)}  # in the order of checks


@refusing(ParameterError, "shares are for GMSParameters.from_shares", instead={"shares": "alpha"})
@displayed("html")
@short_repr
@by_value()
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
        Velocity below which an element may arrest, m/s, > 0.
    weights : array_like, shape (n,), optional
        Threshold weights w_i, m/N, > 0: element i slips at ``|z_i| = w_i s(v)``. If omitted, they
        are 1 m/N, which is the paper's reading (it compares z in m with s(v) in N).

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
        stiffness = checked_array("k", k, None, RULES["k"])
        given = {"sigma": sigma, "C": C, "sigma_2": sigma_2, "v_c": v_c, "stribeck": stribeck}
        given["weights"] = np.ones(stiffness.size) if weights is None else weights
        found = _checked(given, stiffness.size)
        vars(self).update({"stribeck": stribeck, "k": stiffness} | found)

    @property
    def n(self) -> int:
        """Number of elements."""
        return int(self.k.size)

    def replaced(self, **given: Any) -> GMSParameters:
        """Return the same parameters with some of them replaced.

        Parameters
        ----------
        **given : float, array_like of shape (n,), or Stribeck
            By name.

        Returns
        -------
        GMSParameters
            A new object; what is given is checked.

        Raises
        ------
        ParameterError
            If there is no such parameter, or a value violates its rule.

        Examples
        --------
        >>> GMSParameters.paper("stick-slip").replaced(v_c=1e-5).v_c
        1e-05
        """
        for name in given:
            if name not in EVERY and name != "stribeck":
                error = unknown("parameter", name, vars(self))
                if own := nearest(name, self.stribeck.numbers):
                    cure = f"{own} is a number of the curve: give stribeck=Stribeck(...)"
                    raise error.replaced(advice=cure)
                raise error
        new: GMSParameters = copied(self, **_checked(given, self.n))
        return new

    def with_weights(self, weights: ArrayLike) -> GMSParameters:
        """Return the same parameters with different threshold weights.

        Parameters
        ----------
        weights : array_like, shape (n,)
            w_i, m/N, > 0.

        Returns
        -------
        GMSParameters
            A new object.
        """
        return self.replaced(weights=weights)

    @classmethod
    def paper(cls, column: str) -> GMSParameters:
        """Return a column of the paper's Table I (SI units, unit weights).

        Parameters
        ----------
        column : {"non-drifting", "stick-slip"}
            The experiment.

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
        if not isinstance(column, str) or column not in TABLE_I:
            raise unknown("column of Table I", column, TABLE_I)
        found = TABLE_I[column]
        numbers: Any = found.values
        assert found.stribeck is not None
        return cls(**numbers, sigma_2=found.sigma_2, stribeck=found.stribeck)

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
        """Return parameters in Al-Bender's form: element i carries a share alpha_i of the friction.

        ``w_i = alpha_i / k_i`` and ``C_i = alpha_i C / k_i``, so that in steady slip the forces
        ``k_i z_i`` add up to s(v).

        Parameters
        ----------
        alpha : array_like, shape (n,)
            Shares, > 0, that add up to 1.
        k : array_like, shape (n,)
            Stiffness, N/m, > 0.
        C : float
            Attraction rate of the whole bank, N/s, >= 0: a slipping element follows s(v) in the
            time ``F_c / C``.
        stribeck : Stribeck
            The curve.
        v_c : float
            m/s, > 0.
        sigma : array_like, shape (n,), optional
            Bristle damping, Ns/m; zero if omitted.
        sigma_2 : float
            Viscous friction, Ns/m.

        Returns
        -------
        GMSParameters
            With weights in m/N.

        Raises
        ------
        ParameterError
            If the shares do not add up to 1, or a parameter violates its rule.

        Examples
        --------
        >>> p = GMSParameters.from_shares([0.5, 0.5], [40, 10], C=2.0,
        ...                               stribeck=Stribeck(1, 1.5, 1e-3), v_c=1e-4)
        >>> p.weights.tolist(), p.C.tolist()
        ([0.0125, 0.05], [0.025, 0.1])
        """
        stiffness = checked_array("k", k, None, RULES["k"])
        shares = checked_array("alpha", alpha, stiffness.size, "> 0")
        if is_list(C):
            raise ParameterError(
                "with shares it is one number [N/s]", place="C", value=C, advice=WHICH_C
            )
        rate = checked_scalar("C", C, RULES["C"])
        total = math.fsum(shares)
        if abs(total - 1.0) > 1e-9:
            raise ParameterError(
                f"the shares add up to {total!r}", place="alpha", advice="they must add up to 1"
            )
        return cls(
            stiffness,
            np.zeros(stiffness.size) if sigma is None else sigma,
            shares * rate / stiffness,
            sigma_2=sigma_2,
            stribeck=stribeck,
            v_c=v_c,
            weights=shares / stiffness,
        )


def _checked(given: Mapping[str, Any], n: int) -> dict[str, Any]:
    """Return values that satisfy their rules, by name."""
    found: dict[str, Any] = {}
    if "stribeck" in given:
        found["stribeck"] = given["stribeck"]
        if not isinstance(found["stribeck"], Stribeck):
            raise ParameterError(
                "it must be a Stribeck, for example Stribeck(1, 1.5, 1e-3)",
                place="stribeck",
                value=found["stribeck"],
            )
    for name, each in EVERY.items():
        if name in given:
            value = given[name]
            found[name] = (
                checked_array(name, value, n, each.rule)
                if each.per_element
                else checked_scalar(name, value, each.rule)
            )
    return found
