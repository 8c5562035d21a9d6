"""Rigs: the mechanical systems that the friction acts in. A rig defines x, v and dv/dt.

Each rig states its equation of motion as text, just as a chart states its flows.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import Parameter, checked_scalar
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import refusing
from gms_fsm.foundation.display import short_repr
from gms_fsm.foundation.equality import by_value
from gms_fsm.systems.given import mapping_of
from gms_fsm.systems.signals import Signal, SignalLike, as_signal
from gms_fsm.systems.springs import Spring

if TYPE_CHECKING:
    from gms_fsm.records.record import Record


MASS = Parameter("mass", "kg", "> 0", per_element=False, meaning="mass")
STIFFNESS = Parameter(
    "stiffness", "N/m", "> 0", per_element=False, meaning="stiffness of the spring"
)


class Rig(Protocol):
    """The interface of a rig to a simulation."""

    @property
    def title(self) -> str:
        """A title for figures and summaries."""

    @property
    def signals(self) -> Mapping[str, Signal]:
        """Input signals by name; one named ``v`` prescribes the velocity."""

    @property
    def numbers(self) -> Mapping[str, float]:
        """Constants of the equation of motion."""

    @property
    def acceleration(self) -> str | None:
        """Text of dv/dt in t, x, v, F, the signals and the numbers; None if v is prescribed."""


@refusing()
@short_repr
@by_value()
@dataclass(frozen=True, eq=False)
class Prescribed:
    """Open loop: the velocity is prescribed.

    Parameters
    ----------
    velocity : signal
        v(t), m/s: an expression in t, ramps, arrays or a callable; or a `Record`, which gives its
        motion and its inputs.
    inputs : mapping of str to signal, optional
        Inputs of the chart, by their names: a load ``{"N": "10 + sin(t)"}``. They replace what the
        model gives to these.

    Examples
    --------
    >>> Prescribed("0.2*sin(2*pi*t/20)").title
    'prescribed velocity'
    """

    velocity: SignalLike | Record = field(compare=False)
    inputs: Mapping[str, SignalLike] = field(default_factory=dict, compare=False)
    signals: Mapping[str, Signal] = field(init=False, repr=False)

    title = "prescribed velocity"
    acceleration = None
    parameters: ClassVar[tuple[Parameter, ...]] = ()

    def __post_init__(self) -> None:
        velocity: Any = self.velocity
        given = mapping_of(self.inputs, "inputs")
        if hasattr(velocity, "motion"):  # a record: no class of it, which takes SciPy to import
            motion = velocity.motion()
            given = {n: (motion.time, u) for n, u in velocity.inputs.items()} | given
            velocity = (motion.time, motion.velocity)
        found = {name: as_signal(each) for name, each in given.items()}
        object.__setattr__(self, "inputs", found)
        object.__setattr__(self, "signals", {"v": as_signal(velocity), **found})

    @property
    def numbers(self) -> Mapping[str, float]:
        """No constants."""
        return {}


@refusing()
@short_repr
@by_value()
@dataclass(frozen=True, eq=False)
class Slider:
    """Closed loop: a mass pushed by a force, ``m dv/dt = F_a(t) - F``.

    Parameters
    ----------
    mass : float
        kg, > 0.
    force : signal
        F_a(t), N.

    Examples
    --------
    >>> Slider(1.0, [(0, 0), (2, 0.5)]).mass
    1.0
    """

    mass: float
    force: SignalLike = field(compare=False)
    signals: Mapping[str, Signal] = field(init=False, repr=False)

    title = "slider pushed by a force"
    acceleration = "(F_a - F) / mass"
    parameters: ClassVar[tuple[Parameter, ...]] = (MASS,)

    def __post_init__(self) -> None:
        _check(self)
        object.__setattr__(self, "signals", {"F_a": as_signal(self.force)})

    @property
    def numbers(self) -> Mapping[str, float]:
        """The mass."""
        return {each.name: getattr(self, each.name) for each in self.parameters}


@refusing()
@by_value()
@dataclass(frozen=True, eq=False)
class PulledSlider:
    """Closed loop: a mass pulled through a spring whose end moves at constant speed.

    ``m dv/dt = stiffness * (speed * t - x) - F``.

    Parameters
    ----------
    mass : float
        kg, > 0.
    stiffness : float
        Stiffness of the spring, N/m, > 0.
    speed : float
        Speed of the spring's far end, m/s.

    Examples
    --------
    >>> PulledSlider(1.0, 2.0, 0.1).numbers
    {'mass': 1.0, 'stiffness': 2.0, 'speed': 0.1}
    """

    mass: float
    stiffness: float
    speed: float

    title = "slider pulled through a spring"
    acceleration = "(stiffness * (speed * t - x) - F) / mass"
    # The force in the acceleration, as the system of a model on this rig declares it.
    springs = (Spring("spring", "body", k="stiffness", rest="speed * t"),)
    parameters: ClassVar[tuple[Parameter, ...]] = (
        MASS,
        STIFFNESS,
        Parameter("speed", "m/s", per_element=False, meaning="speed of the spring's far end"),
    )

    def __post_init__(self) -> None:
        _check(self)

    @property
    def signals(self) -> Mapping[str, Signal]:
        """No signals."""
        return {}

    @property
    def numbers(self) -> Mapping[str, float]:
        """The mass, stiffness and speed."""
        return {each.name: getattr(self, each.name) for each in self.parameters}


@refusing()
@by_value()
@dataclass(frozen=True, eq=False)
class Belt:
    """Closed loop: a mass on a moving belt, tied to a wall by a spring and a damper.

    A string under a bow, a pad on a disc. x and v are the motion of the mass over the belt, as the
    friction sees it: v is 0 while it sticks, and a run that starts at rest starts on the belt.
    ``m dv/dt = -stiffness * (x + speed * t) - damping * v - F``; from where its spring is slack the
    mass is at ``x + speed * t - damping * speed / stiffness``.

    Parameters
    ----------
    mass : float
        kg, > 0.
    stiffness : float
        Stiffness of the spring, N/m, > 0.
    speed : float
        Speed of the belt, m/s.
    damping : float
        Damping, Ns/m, >= 0.

    Examples
    --------
    >>> Belt(1.0, 2.0, 0.1).numbers
    {'mass': 1.0, 'stiffness': 2.0, 'speed': 0.1, 'damping': 0.0}
    """

    mass: float
    stiffness: float
    speed: float
    damping: float = 0.0

    title = "mass on a moving belt"
    acceleration = "(stiffness * (-speed * t - x) - damping * v - F) / mass"
    springs = (Spring("spring", "body", k="stiffness", d="damping", rest="-speed * t"),)
    parameters: ClassVar[tuple[Parameter, ...]] = (
        MASS,
        STIFFNESS,
        Parameter("speed", "m/s", per_element=False, meaning="speed of the belt"),
        Parameter("damping", "Ns/m", ">= 0", per_element=False, meaning="damping of the spring"),
    )

    def __post_init__(self) -> None:
        _check(self)

    @property
    def signals(self) -> Mapping[str, Signal]:
        """No signals."""
        return {}

    @property
    def numbers(self) -> Mapping[str, float]:
        """The mass, stiffness, speed and damping."""
        return {each.name: getattr(self, each.name) for each in self.parameters}


@short_repr
@by_value()
@dataclass(frozen=True, eq=False)
class TextRig:
    """Any rig as its texts, numbers and signals: what a file keeps of a rig of your own.

    Parameters
    ----------
    title : str
        For figures and summaries.
    acceleration : str or None
        dv/dt over t, x, v, F, the signals and the numbers; None if v is prescribed.
    signals : mapping of str to signal
        As those of any rig.
    numbers : mapping of str to float
        Constants.

    Examples
    --------
    >>> TextRig("pushed", "(P - F) / m", {"P": "sin(t)"}, {"m": 1.0}).numbers["m"]
    1.0
    """

    title: str
    acceleration: str | None
    signals: Mapping[str, Any]
    numbers: Mapping[str, float]

    def __post_init__(self) -> None:
        signals = {name: as_signal(given) for name, given in self.signals.items()}
        object.__setattr__(self, "signals", signals)


def _check(rig: Slider | PulledSlider | Belt) -> None:
    for each in rig.parameters:
        number = checked_scalar(each.name, getattr(rig, each.name), each.rule)
        object.__setattr__(rig, each.name, number)


def with_numbers(rig: Rig, values: Mapping[str, ArrayLike]) -> Rig:
    """Return a rig with some of its numbers replaced.

    Parameters
    ----------
    rig : Rig
        A frozen dataclass with its numbers as fields.
    values : mapping
        By a name from ``rig.numbers``; other names are ignored.

    Returns
    -------
    Rig
        A new rig, checked.

    Raises
    ------
    ParameterError
        If a value violates its rule.

    Examples
    --------
    >>> with_numbers(PulledSlider(1.0, 2.0, 0.1), {"speed": 0.2}).speed
    0.2
    """
    new: Any = {name: values[name] for name in rig.numbers if name in values}
    if new and not dataclasses.is_dataclass(rig):
        raise ParameterError(
            "its numbers cannot be changed, because it is no dataclass",
            place=f"rig {rig.title!r}",
            advice="make it a frozen dataclass with its numbers as fields",
        )
    return dataclasses.replace(rig, **new) if new else rig  # type: ignore[type-var]
