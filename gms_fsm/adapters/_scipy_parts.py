"""What `gms_fsm.adapters.scipy` is given and returns."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.coupling.bank import FrictionBank
from gms_fsm.coupling.driven import Driven
from gms_fsm.coupling.stepping import FrictionState, Snapshot
from gms_fsm.errors import ParameterError, shown
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact


class ContactSwitch(NamedTuple):
    """An edge taken by an element.

    Parameters
    ----------
    t : float
        s.
    contact : str
        The friction's name: that of a contact; a model is called ``friction``, and of several
        ``friction1`` and so on.
    element : int
        Counted from 0.
    edge : str
        Its name in the chart.
    """

    t: float
    contact: str
    element: int
    edge: str


@dataclass(frozen=True, eq=False)
class Carried:
    """The frictions at the end of a call of `solve_ivp`, to begin the next one with.

    Parameters
    ----------
    driven : Driven
        The frictions.
    y : tuple of float
        Their own state.
    mode : tuple of int
        The states of their elements.
    several : bool
        Whether they were given as a sequence.
    """

    driven: Driven = field(repr=False)
    y: tuple[float, ...]
    mode: tuple[int, ...]
    several: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Of the frictions."""
        return tuple(bank.name for bank in self.driven.program.layout.banks)

    @property
    def states(self) -> dict[str, tuple[str, ...]]:
        """By friction the names of its elements' states."""
        return dict(zip(self.names, self.driven.states(self.mode), strict=True))


@dataclass(frozen=True, eq=False)
class SteppedFriction:
    """The frictions at the end of a call of `solve_ivp` with samples.

    Parameters
    ----------
    stepper : FrictionState or FrictionBank
        The frictions.
    snapshot : Snapshot
        Their state.
    given : tuple of Model or Contact
        The same, as given.
    """

    stepper: FrictionState | FrictionBank = field(repr=False)
    snapshot: Snapshot = field(repr=False)
    given: tuple[Model | Contact, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the frictions."""
        plain = [
            f"friction{k}" if self.several else "friction" for k in range(1, len(self.given) + 1)
        ]
        return tuple(
            getattr(each, "name", name) for each, name in zip(self.given, plain, strict=True)
        )

    @property
    def states(self) -> dict[str, tuple[str, ...]]:
        """By friction the names of its elements' states, at present."""
        found = self.stepper.states
        each = found if isinstance(self.stepper, FrictionBank) else (found,)
        return dict(zip(self.names, each, strict=True))  # type: ignore[arg-type]

    @property
    def several(self) -> bool:
        """Whether they were given as a sequence."""
        return isinstance(self.stepper, FrictionBank)


@dataclass(frozen=True, eq=False)
class Solution:
    """What `solve_ivp` returns.

    Parameters
    ----------
    t : ndarray, shape (rows,)
        s.
    y : ndarray, shape (n, rows)
        The caller's state.
    F : ndarray, shape (rows,) or (m, rows)
        Force of the friction, N; of several frictions one row each. At a switch it is the force
        just before it.
    switches : tuple of ContactSwitch
        All edges taken, in order.
    friction : Carried or SteppedFriction
        The frictions at the end: pass it on as `friction` to go on.
    nfev : int
        Number of calls of `fun`.
    success : bool
        Whether the end was reached.
    message : str
        Why not, otherwise.
    """

    t: FloatArray
    y: FloatArray
    F: FloatArray
    switches: tuple[ContactSwitch, ...] = field(repr=False)
    friction: Carried | SteppedFriction = field(repr=False)
    nfev: int
    success: bool
    message: str


def numbers(name: str, given: ArrayLike) -> FloatArray:
    """Return what a caller's function returned as an array."""
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise ParameterError(
            f"{name} returns {shown(given)}, which is no list of numbers"
        ) from None


class Caller:
    """The caller's functions, checked and counted.

    Parameters
    ----------
    fun, velocities : callable
        ``fun(t, y, F)``, and the velocity of each friction.
    several : bool
        Whether F is an array.
    n : int
        Number of components of y.
    """

    def __init__(
        self,
        fun: Callable[[float, FloatArray, Any], ArrayLike],
        velocities: Callable[[FloatArray], list[float]],
        several: bool,
        n: int,
    ) -> None:
        self.fun, self.velocities, self.several, self.n = fun, velocities, several, n
        self.nfev = 0

    def check(self, t: float, y: FloatArray, frictions: int) -> None:
        """Call both once, for clear errors."""
        if not callable(self.fun):
            raise ParameterError(
                "it must be a function", place="fun", value=self.fun, advice="fun(t, y, F) -> dy/dt"
            )
        v = self.velocities(y)
        if not all(map(math.isfinite, v)):
            raise ParameterError("it must be finite", place="velocity(y0)", value=v)
        self.rates(t, y, [0.0] * frictions)

    def rates(self, t: float, y: FloatArray, forces: list[float]) -> list[float]:
        """Return dy/dt with the forces of the frictions."""
        self.nfev += 1
        force = np.array(forces) if self.several else forces[0]
        dy = numbers("fun", self.fun(t, y, force))
        if dy.shape != (self.n,):
            raise ParameterError(
                f"fun returns the shape {dy.shape}, but y0 has {self.n} components"
            )
        found: list[float] = dy.tolist()
        return found
