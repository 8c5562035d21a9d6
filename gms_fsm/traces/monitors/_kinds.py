"""What a run can be watched for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.errors import ParameterError

__all__ = ["ALL", "KNOWN", "Chattering", "Coverage", "Invariant", "Monitor", "Passivity"]


@dataclass(frozen=True)
class Chattering:
    """An element that takes one edge, there and back, again and again in a short time.

    A run that ends in a livelock, switching while time stands still, is reported here too.

    Parameters
    ----------
    times : int
        How often, at least 2.
    within : float
        In how many seconds.

    Raises
    ------
    ParameterError
        If a number breaks its rule.
    """

    times: int = 20
    within: float = 0.1

    def __post_init__(self) -> None:
        if not isinstance(self.times, int) or self.times < 2:
            raise ParameterError("it must be a whole number >= 2", place="times", value=self.times)
        object.__setattr__(self, "within", checked_scalar("within", self.within, "> 0"))

    @property
    def name(self) -> str:
        """Under which it is reported."""
        return "chattering"


@dataclass(frozen=True)
class Invariant:
    """A condition that has to hold at every row.

    Parameters
    ----------
    text : str
        In the expression language. It can name t, x, v, F; of each element its variables (z), its
        threshold s and its parameters, then it has to hold for every element; single elements as
        z1, s1, F1; and ask ``state == slip`` or ``state(1) == slip``.
    """

    text: str

    @property
    def name(self) -> str:
        """Under which it is reported."""
        return self.text


@dataclass(frozen=True)
class Passivity:
    """No element makes energy out of nothing: what it took from the motion, less what it stores.

    For elements whose force is a spring's, with or without a damper: ``k * z + sigma * dz``. Heat
    is the integral of F_i v less the rise of k z**2 / 2 since the start; it must not be negative.

    Parameters
    ----------
    tolerance : float
        The share of the energy turned over that may be missing. The uncertainty of the sums is
        added to it.

    Raises
    ------
    ParameterError
        If it is negative.
    """

    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        object.__setattr__(self, "tolerance", checked_scalar("tolerance", self.tolerance, ">= 0"))

    @property
    def name(self) -> str:
        """Under which it is reported."""
        return "passivity"


@dataclass(frozen=True)
class Coverage:
    """Which states, edges and clauses of the guards, true and false, the run has seen."""

    @property
    def name(self) -> str:
        """Under which it is reported."""
        return "coverage"


Monitor: TypeAlias = Chattering | Invariant | Passivity | Coverage
ALL: tuple[Monitor, ...] = (Chattering(), Passivity(), Coverage())
KNOWN: Mapping[str, Monitor] = {monitor.name: monitor for monitor in ALL}
