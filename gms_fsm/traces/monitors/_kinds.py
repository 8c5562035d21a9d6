"""The kinds of monitors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.errors import ParameterError


def named(contact: str, name: str) -> str:
    """Return the name of a monitor, with that of its contact: ``gear: passivity``."""
    return f"{contact}: {name}" if contact else name


def elements_text(numbers: Iterable[int]) -> str:
    """Return the names of elements, numbered from 1."""
    words = [str(i + 1) for i in numbers]
    return f"element{'s' if len(words) > 1 else ''} {', '.join(words)}"


@dataclass(frozen=True)
class Chattering:
    """Repeated firing of one edge, back and forth, within a short time.

    A run that ends in a livelock (switching without progress in time) is reported here too.

    Parameters
    ----------
    times : int
        Number of firings, at least 2.
    within : float
        Length of the time window, s.
    contact : str
        The contact, in a system; without a name every one.

    Raises
    ------
    ParameterError
        If a number breaks its rule.
    """

    times: int = 20
    within: float = 0.1
    contact: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.times, int) or self.times < 2:
            raise ParameterError("it must be an integer >= 2", place="times", value=self.times)
        object.__setattr__(self, "within", checked_scalar("within", self.within, "> 0"))

    @property
    def name(self) -> str:
        """Name under which it is reported."""
        return named(self.contact, "chattering")


@dataclass(frozen=True)
class Invariant:
    """A condition that must hold at every row.

    Parameters
    ----------
    text : str
        Condition in the expression language; a number may have a unit, as in ``"v < 3 mm/s"``. It
        can use t, x, v, F; variables (z), the threshold s
        and parameters of each element, and must then hold for every element; z1, s1, F1 for a
        single element; and ``state == slip`` or ``state(1) == slip``. In a system it can use the
        system's names, and those of its contacts, such as ``gear.F``.
    contact : str
        A contact whose names it uses instead, in a system.
    """

    text: str
    contact: str = ""

    @property
    def name(self) -> str:
        """Name under which it is reported."""
        return named(self.contact, self.text)


@dataclass(frozen=True)
class Passivity:
    """No element creates energy: the energy taken from the motion covers the energy stored.

    Applies to elements whose force is that of a spring, with or without a damper:
    ``k * z + sigma * dz``. The heat, which is the integral of F_i v minus the increase of
    k z**2 / 2 since the start, must not be negative.

    Parameters
    ----------
    tolerance : float
        Allowed energy deficit as a fraction of the energy turned over. The uncertainty of the sums
        is added to it.
    contact : str
        The contact, in a system; without a name every one.

    Raises
    ------
    ParameterError
        If it is negative.
    """

    tolerance: float = 1e-4
    contact: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "tolerance", checked_scalar("tolerance", self.tolerance, ">= 0"))

    @property
    def name(self) -> str:
        """Name under which it is reported."""
        return named(self.contact, "passivity")


@dataclass(frozen=True)
class CoverageMonitor:
    """The states, edges and guard clauses (true and false) that the run has exercised.

    Parameters
    ----------
    contact : str
        The contact, in a system; without a name every one.
    """

    contact: str = ""

    @property
    def name(self) -> str:
        """Name under which it is reported."""
        return named(self.contact, "coverage")


Monitor: TypeAlias = Chattering | Invariant | Passivity | CoverageMonitor
ALL: tuple[Monitor, ...] = (Chattering(), Passivity(), CoverageMonitor())
KNOWN: Mapping[str, Monitor] = {monitor.name: monitor for monitor in ALL}
