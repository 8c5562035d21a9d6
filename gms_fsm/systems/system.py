"""Systems: bodies that move, contacts between them, and what drives both.

Bodies and controllers are smooth. Whatever switches is a contact: machines of one chart on one
relative velocity, which is linear in the bodies' velocities.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ExpressionError, ParameterError, shown
from gms_fsm.language import (
    Binary,
    Name,
    Negative,
    Number,
    Value,
    derivative,
    names_in,
    parse_value,
    renamed,
    spell,
)
from gms_fsm.systems._given import (
    Text,
    check_name,
    check_text,
    checked_numbers,
    mapping_of,
    several,
    texts_of,
)
from gms_fsm.systems.models import Model, check_bank
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Signal, as_signal

__all__ = ["Body", "Contact", "Mounting", "Sampled", "Several", "System", "system_of"]


@dataclass(frozen=True)
class Body:
    """A body with one degree of freedom: free, or moved with a given velocity.

    ``inertia * dv/dt = force`` minus what its contacts take from it.

    Parameters
    ----------
    name : str
        Unique in its system.
    inertia : str or float
        kg (or kg m^2, with angles); None for a body whose velocity is given.
    force : str or float
        N, over ``t``, the names of bodies, further states, signals and numbers.
    velocity : str or float, optional
        m/s, over ``t``, signals and numbers: the body moves like this whatever acts on it.
    x, v : str
        What its position and its velocity are called in texts.

    Examples
    --------
    >>> Body("load", inertia=1.0, force="K * (x_m - x_l)", x="x_l", v="v_l").v
    'v_l'
    """

    name: str
    inertia: Text | None = field(default=None, kw_only=True)
    force: Text = field(default="0", kw_only=True)
    velocity: Text | None = field(default=None, kw_only=True)
    x: str = field(default="x", kw_only=True)
    v: str = field(default="v", kw_only=True)

    def __post_init__(self) -> None:
        here = f"body {shown(self.name)}"
        if (self.inertia is None) == (self.velocity is None):
            raise ParameterError(
                "it has neither an inertia nor a velocity"
                if self.inertia is None
                else "it has an inertia and a velocity",
                place=here,
                advice="give inertia=... to a free body, velocity=... to a driven one",
            )
        for each in ("inertia", "force", "velocity"):
            if (text := getattr(self, each)) is not None:
                check_text(text, f"{here}: {each}")
        for name in (self.name, self.x, self.v):
            check_name(name, here)

    @property
    def driven(self) -> bool:
        """Whether its velocity is given."""
        return self.velocity is not None


@dataclass(frozen=True, init=False, eq=False)
class Contact:
    """Machines of one chart on one relative velocity.

    The contact takes its force F from each body, times that body's coefficient in `v`: its power is
    F v, whatever the gearing.

    Parameters
    ----------
    name : str
        Unique in its system.
    chart : Chart or Model
        A chart; or a friction model (`GMS`, `LuGre`, `ChartModel`), which brings its numbers.
    values : mapping, optional
        For each parameter of the chart a number, or one per element.
    v : str or sequence of str
        The relative velocity, linear in the bodies' velocities, such as ``"w_m - 3 * w_l"``; one
        for each velocity of the chart.
    n : int
        Number of elements.
    inputs : mapping of str to str or float
        For an input of the chart what it is, over the names of the system; those of the same name
        need not be given.
    period : float, optional
        s: the machines are asked at these ticks only, and what the chart gives out is held between
        them. Without a period the contact is continuous.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> Contact("bearing", GMS(GMSParameters.paper("stick-slip"), law="signed"), v="v_l").n
    4
    """

    name: str
    chart: Chart
    values: Mapping[str, float | FloatArray]
    v: tuple[str, ...]
    n: int
    inputs: Mapping[str, Text]
    period: float | None
    model: Model | None

    def __init__(
        self,
        name: str,
        chart: Chart | Model,
        values: Mapping[str, Any] | None = None,
        *,
        v: str | Iterable[str] = "v",
        n: int = 1,
        inputs: Mapping[str, Text] | None = None,
        period: float | None = None,
    ) -> None:
        here = f"contact {shown(name)}"
        model = None
        if isinstance(chart, Chart):
            values = checked_numbers(chart, {} if values is None else values, n, here)
        elif hasattr(chart, "chart") and hasattr(chart, "weights"):
            model = chart
            if values is not None or n != 1:
                raise ParameterError(
                    "a model brings its values and its number of elements", place=here
                )
            chart, values, n = model.chart, model.values, model.n
        else:
            raise ParameterError(
                "it must be a Chart, or a model such as GMS(parameters, law='signed')",
                place=f"{here}: chart",
                value=chart,
            )
        check_bank(chart, n, here)
        velocities = several(v, str, f"{here}: v")
        if len(velocities) != len(chart.velocities):
            raise ParameterError(
                f"v gives {len(velocities)} velocities, chart {chart.name!r} has "
                f"{', '.join(chart.velocities)}",
                place=here,
            )
        if period is not None:
            period = checked_scalar(f"{here}: period", period, "> 0")
        for each, value in {
            "name": name,
            "chart": chart,
            "values": values,
            "v": velocities,
            "n": n,
            "inputs": texts_of({} if inputs is None else inputs, f"{here}: inputs"),
            "period": period,
            "model": model,
        }.items():
            object.__setattr__(self, each, value)

    # What a `Model` has, so that everything that reads models reads contacts too.
    @property
    def title(self) -> str:
        """Name and chart."""
        return f"{self.name}: {self.chart.name if self.model is None else self.model.title}"

    @property
    def weights(self) -> FloatArray:
        """Threshold weights, shape (n,), m/N."""
        return np.ones(self.n) if self.model is None else self.model.weights

    @property
    def stribeck(self) -> Stribeck | None:
        """The Stribeck curve of its model, if it has one."""
        return None if self.model is None else self.model.stribeck

    @property
    def sigma_2(self) -> float:
        """Viscous friction of its model, Ns/m."""
        return 0.0 if self.model is None else self.model.sigma_2


@dataclass(frozen=True)
class Sampled:
    """A sampled controller: values that change at exact ticks only.

    Parameters
    ----------
    name : str
        Unique in its system.
    period : float
        s.
    updates : mapping of str to str
        For each value its text over the names of the system and ``period``; they run in this order
        and see the results before them.
    initial : mapping of str to float, optional
        Values before the first tick; 0 where not given.
    offset : float
        s: the first tick is at t_start + offset.

    Examples
    --------
    >>> Sampled("pid", period=1e-3, updates={"u": "k_p * (r - x)"}).period
    0.001
    """

    name: str
    period: float = field(kw_only=True)
    updates: Mapping[str, str] = field(kw_only=True)
    initial: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    offset: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        here = f"sampled {shown(self.name)}"
        put = object.__setattr__
        put(self, "period", checked_scalar(f"{here}: period", self.period, "> 0"))
        put(self, "offset", checked_scalar(f"{here}: offset", self.offset, ">= 0"))
        put(self, "updates", texts_of(self.updates, f"{here}: updates"))
        put(self, "initial", mapping_of(self.initial, f"{here}: initial"))
        if not self.updates:
            raise ParameterError("it updates nothing", place=here)
        for name in self.initial:
            if name not in self.updates:
                raise ParameterError(
                    f"initial has {shown(name)}, which is not updated",
                    place=here,
                    advice=f"its values are {', '.join(self.updates)}",
                )
        put(
            self,
            "initial",
            {
                name: checked_scalar(
                    f"{here}: initial[{name!r}]", self.initial.get(name, 0.0), "finite"
                )
                for name in self.updates
            },
        )


@dataclass(frozen=True, eq=False)
class System:
    """Bodies, the contacts between them, and what drives both.

    Parameters
    ----------
    name : str
        What it is called in pictures and messages.
    bodies : sequence of Body
        At least one.
    contacts : sequence of Contact
        Whatever switches.
    signals : mapping of str to signal, optional
        Functions of time, as those of a rig; texts may use the numbers.
    numbers : mapping of str to float, optional
        Constants.
    flow : mapping of str to str, optional
        Further smooth states, each with its time derivative: a current, an integrator.
    sampled : sequence of Sampled, optional
        Controllers with ticks.

    Raises
    ------
    ParameterError, ExpressionError
        If names clash, a text cannot be read, a velocity is not linear, an inertia is zero, or a
        lock cannot hold.

    Examples
    --------
    >>> from gms_fsm.charts.gms import gms_element
    >>> from gms_fsm import GMS, GMSParameters
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> system = System("pulled mass", bodies=(Body("mass", inertia="m", force="K*(V*t - x)"),),
    ...                 contacts=(Contact("pad", model),), numbers={"m": 1.0, "K": 2.0, "V": 0.1})
    >>> system.contact("pad").n
    4
    """

    name: str
    bodies: tuple[Body, ...] = field(kw_only=True)
    contacts: tuple[Contact, ...] = field(kw_only=True)
    signals: Mapping[str, Signal | str] = field(default_factory=dict, kw_only=True)
    numbers: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    flow: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    sampled: tuple[Sampled, ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        put, here = object.__setattr__, f"system {shown(self.name)}"
        for each, kind in (("bodies", Body), ("contacts", Contact), ("sampled", Sampled)):
            put(self, each, several(getattr(self, each), kind, f"{here}: {each}"))
        if not self.bodies:
            raise ParameterError("it has no bodies", place=here, advice="give at least one")
        if not self.contacts:
            raise ParameterError("it has no contacts", place=here, advice="give at least one")
        numbers = {
            name: checked_scalar(f"{here}: {name}", value, "finite")
            for name, value in mapping_of(self.numbers, f"{here}: numbers").items()
        }
        put(self, "numbers", numbers)
        put(self, "flow", texts_of(self.flow, f"{here}: flow"))
        put(self, "signals", mapping_of(self.signals, f"{here}: signals"))
        self._check_names(here)
        signals = {name: self._signal(name, given, here) for name, given in self.signals.items()}
        put(self, "signals", signals)
        # Imported here: the reader itself needs the classes of this module.
        from gms_fsm.systems._assembly import assembled

        assembled(self)  # refuses what cannot be read, while the user's line is at fault

    def _signal(self, name: str, given: Any, here: str) -> Signal | str:
        """Return a signal; one whose text names numbers stays a text."""
        if isinstance(given, str):
            owner = f"{here}, signal {name!r}"
            tree = self._read(given, ["t", *self.numbers], owner)
            if names_in(tree) - {"t"}:
                return given
        return as_signal(given)

    @staticmethod
    def _read(text: Text, names: Iterable[str], owner: str) -> Value:
        try:
            return parse_value(text if isinstance(text, str) else repr(float(text)), names)
        except ExpressionError as error:
            raise error.at(owner) from None

    def _check_names(self, here: str) -> None:
        groups: list[tuple[str, Iterable[str]]] = [("time", ["t"])]
        for body in self.bodies:
            alias = body.velocity == body.v and body.v in self.signals
            groups.append((f"body {body.name!r}", [body.x] if alias else [body.x, body.v]))
        groups += [("signal", self.signals), ("number", self.numbers), ("flow", self.flow)]
        groups += [(f"sampled {each.name!r}", each.updates) for each in self.sampled]
        owner: dict[str, str] = {}
        for kind, names in groups:
            for name in names:
                check_name(name, f"{here}, {kind}")
                if name in owner:
                    raise ParameterError(
                        f"the name {name!r} is used twice ({owner[name]} and {kind})",
                        place=here,
                        advice="every name must be unique; a body's names are x=... and v=...",
                    )
                owner[name] = kind
        parts: list[Body | Contact | Sampled] = [*self.bodies, *self.contacts, *self.sampled]
        seen: set[str] = set()
        for part in parts:
            check_name(part.name, f"{here}, {type(part).__name__.lower()}")
            if part.name in seen:
                raise ParameterError(f"the name {part.name!r} is used twice", place=here)
            seen.add(part.name)

    # ------------------------------------------------------------------ queries
    @property
    def names(self) -> tuple[str, ...]:
        """All names that its texts can use."""
        moved = (name for body in self.bodies for name in (body.x, body.v))
        updated = (name for each in self.sampled for name in each.updates)
        every = ("t", *moved, *self.flow, *updated, *self.signals, *self.numbers)
        return tuple(dict.fromkeys(every))

    def body(self, name: str) -> Body:
        """Return a body by name.

        Parameters
        ----------
        name : str
            One of its bodies' names.

        Returns
        -------
        Body
            That one.

        Raises
        ------
        ParameterError
            If there is none.
        """
        return _found(self.bodies, name, f"system {self.name!r} has no body")

    def contact(self, name: str) -> Contact:
        """Return a contact by name.

        Parameters
        ----------
        name : str
            One of its contacts' names.

        Returns
        -------
        Contact
            That one.

        Raises
        ------
        ParameterError
            If there is none.
        """
        return _found(self.contacts, name, f"system {self.name!r} has no contact")


Part = TypeVar("Part", "Body", "Contact")


def _found(parts: tuple[Part, ...], name: str, reason: str) -> Part:
    for each in parts:
        if each.name == name:
            return each
    known = ", ".join(repr(each.name) for each in parts)
    raise ParameterError(f"{reason} {shown(name)}", advice=f"there are {known}")


@dataclass(frozen=True)
class Mounting:
    """What moves the contacts of a system, as a `Rig` for everything that reads rigs.

    Parameters
    ----------
    system : System
        The system.
    """

    system: System

    @property
    def title(self) -> str:
        """The system's name."""
        return self.system.name

    @property
    def signals(self) -> Mapping[str, Signal]:
        """The system's signals that are functions of time alone."""
        every = self.system.signals.items()
        return {name: signal for name, signal in every if not isinstance(signal, str)}

    @property
    def numbers(self) -> Mapping[str, float]:
        """The system's."""
        return self.system.numbers

    @property
    def acceleration(self) -> str | None:
        """The balance of the first free body; None if all bodies are driven."""
        for body in self.system.bodies:
            if not body.driven:
                return f"({body.force} - F) / ({body.inertia})"
        return None


class Several:
    """Stands where a run has one model, in a system with several contacts.

    Parameters
    ----------
    system : System
        The system.
    """

    def __init__(self, system: System) -> None:
        self._system = system

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        known = ", ".join(repr(each.name) for each in self._system.contacts)
        raise ParameterError(
            f"system {self._system.name!r} has the contacts {known}",
            advice=f"say which one: trace.contact({self._system.contacts[0].name!r})",
        )


# --------------------------------------------------------------------------- from a model on a rig
def system_of(model: Model, rig: Rig, period: float | None = None) -> System:
    """Return a model on a rig as a system: one body, called body, and one contact, called friction.

    Parameters
    ----------
    model, rig
        What runs.
    period : float, optional
        s: of a discrete contact.

    Returns
    -------
    System
        With the rig's signals and numbers.

    Raises
    ------
    ParameterError
        If the rig's acceleration is not linear in F.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, PulledSlider
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> system_of(model, PulledSlider(1.0, 2.0, 0.1)).bodies[0].force
    'stiffness * (speed * t - x)'
    """
    if rig.acceleration is None:
        body = Body("body", velocity="v")
    else:
        for name in ({*rig.signals} | {*rig.numbers}) & {"F"}:
            raise ParameterError(
                f"the name {name!r} is used twice, for the friction force too",
                place=f"rig {rig.title!r}",
            )
        names = ["t", "x", "v", "F", *rig.signals, *rig.numbers]
        force, inertia = _balance(parse_value(rig.acceleration, names), rig)
        body = Body("body", inertia=spell(inertia), force=spell(force))
    return System(
        rig.title,
        bodies=(body,),
        contacts=(Contact("friction", model, period=period),),
        signals=dict(rig.signals),
        numbers=rig.numbers,
    )


def _balance(acceleration: Value, rig: Rig) -> tuple[Value, Value]:
    """Split an acceleration into (force - F) / inertia."""
    match acceleration:
        case Binary("/", numerator, inertia) if "F" not in names_in(inertia):
            force, sign = _without_force(numerator)
            if sign == -1:
                return force, inertia
    slope = derivative(acceleration, "F")
    if slope is None or "F" in names_in(slope) or slope == Number(0.0):
        raise ParameterError(
            f"the acceleration is {rig.acceleration!r}",
            place=f"rig {rig.title!r}",
            advice="it must be linear in F, for example '(F_a - F) / mass'",
        )
    if slope == Number(-1.0):
        force, sign = _without_force(acceleration)
        if sign == -1:
            return force, Number(1.0)
    inertia = Binary("/", Number(-1.0), slope)
    return Binary("*", renamed(acceleration, {"F": Number(0.0)}), inertia), inertia


def _without_force(tree: Value) -> tuple[Value, int]:
    """Return a sum without its term F, and the sign of that term; 0 if there is no such term."""
    match tree:
        case Name("F"):
            return Number(0.0), 1
        case Negative(operand):
            rest, sign = _without_force(operand)
            return rest if rest == Number(0.0) else Negative(rest), -sign
        case Binary("+" | "-" as op, left, right):
            inside, other = names_in(left), names_in(right)
            if "F" in inside and "F" not in other:
                rest, sign = _without_force(left)
                if rest == Number(0.0):
                    return right if op == "+" else Negative(right), sign
                return Binary(op, rest, right), sign
            if "F" in other and "F" not in inside:
                rest, sign = _without_force(right)
                if rest == Number(0.0):
                    return left, sign if op == "+" else -sign
                return Binary(op, left, rest), sign if op == "+" else -sign
    return tree, 0
