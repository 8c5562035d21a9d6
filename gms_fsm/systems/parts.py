"""The parts of a system: bodies, contacts and sampled controllers, as the user writes them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ParameterError, cut, shown
from gms_fsm.foundation.arguments import checked_kind, copied, one_of, refusing
from gms_fsm.foundation.display import displayed
from gms_fsm.foundation.equality import by_value
from gms_fsm.systems.given import (
    Text,
    check_name,
    check_text,
    checked_numbers,
    mapping_of,
    several,
    texts_of,
)
from gms_fsm.systems.models import Model, check_bank, is_model, with_values

Motion = Literal["along", "normal", "turning"]  # the first is the default
MOTIONS = get_args(Motion)
LOAD = "N"  # the input of a contact that multiplies its Stribeck curve
COUNTS = ("is_in", "count")  # of the elements in a state; the first where there is one element
DELAY = re.compile(r"\bdelay\(\s*([^\W\d][\w.]*)\s*,\s*(\d+)\s*\)")
MOST_DELAY = 1000  # ticks; each is a value of the system
LEAST_LOAD = 1e-9  # N; charts divide by thresholds


@refusing(instead={"mass": "inertia", "m": "inertia", "J": "inertia"})
@dataclass(frozen=True)
class Body:
    """A body with one degree of freedom: free, or moved with a given velocity.

    ``inertia * dv/dt = force`` minus what its contacts take from it.

    Parameters
    ----------
    name : str
        Unique in its system.
    inertia : str or float
        kg, or kg m^2 of one that turns; None for a body whose velocity is given.
    force : str or float
        N, or Nm, over ``t``, the names of bodies, further states, signals and numbers.
    velocity : str or float, optional
        m/s, or rad/s, over ``t``, signals and numbers: the body moves like this whatever acts on
        it.
    x, v : str
        What its position and its velocity are called in texts.
    motion : {"along", "normal", "turning"}
        How pictures show it: along the surface that it rubs on, normal to it, or turning, which
        is the same as ``rotary=True``.
    rotary : bool
        Whether it turns: its position is in rad, and contacts that move by it give a torque, Nm.
        Equations do not depend on it.

    Examples
    --------
    >>> Body("load", inertia=1.0, force="K * (x_m - x_l)", x="x_l", v="v_l").v
    'v_l'
    >>> Body("rotor", inertia=1e-3, x="phi", v="w", rotary=True).unit
    'rad'
    """

    name: str
    inertia: Text | None = field(default=None, kw_only=True)
    force: Text = field(default="0", kw_only=True)
    velocity: Text | None = field(default=None, kw_only=True)
    x: str = field(default="x", kw_only=True)
    v: str = field(default="v", kw_only=True)
    motion: Motion = field(default="along", kw_only=True)
    rotary: bool = field(default=False, kw_only=True)

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
        one_of(f"{here}: motion", self.motion, MOTIONS)
        if checked_kind(f"{here}: rotary", self.rotary, bool, "True or False"):
            if self.motion == "normal":
                raise ParameterError(
                    "what turns does not move normal to a surface",
                    place=f"{here}: motion",
                    value=self.motion,
                    advice="leave out motion=..., or rotary=True",
                )
            object.__setattr__(self, "motion", "turning")
        object.__setattr__(self, "rotary", self.motion == "turning")
        for each in ("inertia", "force", "velocity"):
            text = getattr(self, each)
            if text is not None and not isinstance(text, str):
                check_text(text, f"{here}: {each}")
        for name in (self.name, self.x, self.v):
            check_name(name, here)

    @property
    def driven(self) -> bool:
        """Whether its velocity is given."""
        return self.velocity is not None

    @property
    def unit(self) -> str:
        """Unit of its position."""
        return "rad" if self.rotary else "m"


@refusing()
@displayed("svg", "html")
@by_value()
@dataclass(frozen=True, init=False, eq=False)
class Contact:
    """Machines of one chart on one relative velocity.

    The contact takes its force F from each body, times that body's coefficient in `v`: its power is
    F v, whatever the gearing. Where v is that of a rotation it is in rad/s, F is a torque in Nm,
    and the units of the chart's numbers adapt.

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
        need not be given. A model with a Stribeck curve has the input N, a load in newtons, if it
        is given: F_c and F_s are then coefficients of friction, and the thresholds are
        ``weight * s(v) * N``. A load below 1e-9 N counts as 1e-9 N, since a threshold must be
        positive. What the contact supplies itself cannot be given: t, its velocities, and the s of
        a model.
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
            values = {} if values is None else values
        elif is_model(chart):
            model = chart
            if values is not None or n != 1:
                raise ParameterError(
                    "a model brings its values and its number of elements", place=here
                )
            chart, values, n = model.chart, model.values, model.n
            inputs = {**getattr(model, "inputs", {}), **({} if inputs is None else inputs)}
        else:
            raise ParameterError(
                "it must be a Chart, or a model such as GMS(parameters, law='signed')",
                place=f"{here}: chart",
                value=chart,
            )
        if not chart.velocities and not isinstance(self, Supervisor):
            raise ParameterError(
                f"chart {chart.name!r} has no velocity",
                place=here,
                advice="it is the chart of a Supervisor: supervisors=(Supervisor(...),), in a "
                "file [[supervisor]]",
            )
        if model is None:
            values = checked_numbers(chart, values, n, here)
        check_bank(chart, n, here)
        velocities = several(v, str, f"{here}: v")
        if len(velocities) != len(chart.velocities):
            raise ParameterError(
                f"v gives {len(velocities)} velocities, chart {chart.name!r} has "
                f"{', '.join(chart.velocities)}",
                place=here,
            )
        given = texts_of({} if inputs is None else inputs, f"{here}: inputs")
        for each in given:
            if cure := _instead(each, chart, model):
                reason = f"inputs has {shown(each)}, which the contact supplies itself"
                raise ParameterError(reason, place=here, advice=cure)
        if period is not None:
            period = checked_scalar(f"{here}: period", period, "> 0")
        parts = {"name": name, "chart": chart, "values": values, "v": velocities, "n": n}
        vars(self).update(parts, inputs=given, period=period, model=model)

    def __repr__(self) -> str:
        count = f"{self.n} element{'s' * (self.n != 1)}"
        return f"<Contact {cut(self.name)!r}: {cut(self.chart.name)}, {count}, v = {self.v[0]}>"

    def with_model(self, model: Model) -> Contact:
        """Return the same contact with another model of the same shape."""
        check_bank(model.chart, model.n, f"contact {shown(self.name)}")
        return self.replaced(model=model, chart=model.chart, values=model.values, n=model.n)

    def with_values(self, values: Mapping[str, ArrayLike]) -> Contact:
        """Return the same contact with some of its numbers replaced."""
        if self.model is not None:
            return self.with_model(with_values(self.model, values))
        given = {**self.values, **values}
        place = f"contact {shown(self.name)}"
        return self.replaced(values=checked_numbers(self.chart, given, self.n, place))

    def replaced(self, **fields: Any) -> Contact:
        """Return the same contact with other fields, which fit together."""
        new: Contact = copied(self, **fields)
        return new

    # What a `Model` has, so that everything that reads models reads contacts too.
    @property
    def title(self) -> str:
        """Name and chart."""
        return f"{self.name}: {self.chart.name if self.model is None else self.model.title}"

    @property
    def weights(self) -> FloatArray:
        """Threshold weights, shape (n,), m/N, or rad/Nm."""
        return np.ones(self.n) if self.model is None else self.model.weights

    @property
    def stribeck(self) -> Stribeck | None:
        """The Stribeck curve of its model, if it has one."""
        return None if self.model is None else self.model.stribeck

    @property
    def load(self) -> Text | None:
        """What its Stribeck curve is multiplied by, if its input N is no input of the chart."""
        chart = self.chart
        own = {*chart.inputs, *chart.variables, *chart.parameter_names, *chart.let}
        return None if self.stribeck is None or LOAD in own else self.inputs.get(LOAD)

    @property
    def sigma_2(self) -> float:
        """Viscous friction of its model, Ns/m, or Nms/rad."""
        return 0.0 if self.model is None else self.model.sigma_2


def _instead(name: str, chart: Chart, model: Model | None) -> str:
    """Return what to do instead of giving an input that a contact supplies; empty for others."""
    if name == "t":
        return "it is the time"
    if name == "s" and model is not None:
        return "its model has thresholds; a load on them is inputs={'N': ...}"
    return "give v=... instead" if name in chart.velocities else ""


@refusing(ParameterError, "what moves is a Contact")
class Supervisor(Contact):
    """A machine that is no contact: its chart has no velocity, and its outputs are signals.

    Parameters
    ----------
    name : str
        Unique in its system; its outputs are called ``name.output`` in all texts of the system.
    chart : Chart
        With ``velocities=()``.
    values : mapping, optional
        For each parameter of the chart a number.
    inputs : mapping of str to str or float
        For an input of the chart what it is, over the names of the system, the outputs of other
        supervisors, and ``is_in(pad.stuck)`` or ``count(pad.slip)``.
    period : float, optional
        s: as for a `Contact`.

    Raises
    ------
    ParameterError
        If its chart has a velocity, or an input is not bound.

    Examples
    --------
    >>> from gms_fsm import Chart, State, System, Transition, simulate
    >>> heater = Chart("thermostat", inputs=("T",), velocities=(),
    ...     states=(State("off", outputs={"u": "0"}), State("on", outputs={"u": "1"})),
    ...     transitions=(Transition("switch_on", "off", "on", guard="T < 19"),
    ...                  Transition("switch_off", "on", "off", guard="T > 21")))
    >>> room = System("room", supervisors=(Supervisor("heater", heater),),
    ...               flow={"T": "30 * heater.u - T"})
    >>> [str(edge) for edge in simulate(room, 3.0).transitions.edge[:3]]
    ['switch_on', 'switch_off', 'switch_on']
    """

    def __init__(
        self,
        name: str,
        chart: Chart,
        values: Mapping[str, Any] | None = None,
        *,
        inputs: Mapping[str, Text] | None = None,
        period: float | None = None,
    ) -> None:
        if not isinstance(chart, Chart) or chart.velocities:
            raise ParameterError(
                "it must be a Chart with velocities=()",
                place=f"supervisor {shown(name)}: chart",
                value=chart,
                advice="a chart that moves is that of a Contact",
            )
        super().__init__(name, chart, values, v=(), inputs=inputs, period=period)

    def __repr__(self) -> str:
        return f"<Supervisor {cut(self.name)!r}: {cut(self.chart.name)}>"


def loaded(model: Model | Contact) -> bool:
    """Return whether thresholds follow a load besides the velocity."""
    return isinstance(model, Contact) and model.load is not None


@refusing(instead={"sample_time": "period"})
@by_value("updates")
@dataclass(frozen=True, eq=False)
class Sampled:
    """A sampled controller: values that change at exact ticks only.

    Parameters
    ----------
    name : str
        Unique in its system.
    period : float
        s.
    updates : mapping of str to str, or callable
        For each value its text over the names of the system and ``period``; they run in this order
        and see the results before them. ``delay(u, 3)`` is what u was three ticks before, kept in
        further values, of a sampler called pid ``pid__u__1``, ``pid__u__2`` and ``pid__u__3``.
        A Python function is called with the values that its parameters name (``t`` and ``period``
        among them), and returns those of `outputs`: a number, or one for each. `simulate` and
        `Session` call it, and what it returned is then in their runs as records.
    outputs : sequence of str, optional
        What a function returns.
    initial : mapping of str to float, optional
        Values before the first tick; 0 where not given, what is delayed as what it comes from.
    offset : float
        s: the first tick is at t_start + offset. Period, offset and start count as the decimal
        numbers that are written, so that ticks of several rates coincide exactly: ten periods of
        0.1 ms are one of 1 ms. What ticks at one instant does so in the order listed, functions
        first.

    Examples
    --------
    >>> Sampled("pid", period=1e-3, updates={"u": "k_p * (r - x)"}).period
    0.001
    >>> Sampled("pd", period=1e-3, updates=lambda x, v: -9.0 * x - v, outputs=("u",)).outputs
    ('u',)
    """

    name: str
    period: float = field(kw_only=True)
    updates: Any = field(kw_only=True)  # texts by name, or a function
    outputs: tuple[str, ...] = field(default=(), kw_only=True)
    initial: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    offset: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        here = f"sampled {shown(self.name)}"
        put = object.__setattr__
        put(self, "period", checked_scalar(f"{here}: period", self.period, "> 0"))
        put(self, "offset", checked_scalar(f"{here}: offset", self.offset, ">= 0"))
        put(self, "initial", mapping_of(self.initial, f"{here}: initial"))
        put(self, "outputs", several(self.outputs, str, f"{here}: outputs"))
        if callable(self.updates) != bool(self.outputs):
            raise ParameterError(
                "its outputs have no names"
                if not self.outputs
                else "texts have outputs by their own names",
                place=f"{here}: outputs",
                advice='outputs=("u",) names what a Python function returns',
            )
        if not callable(self.updates):
            given = texts_of(self.updates, f"{here}: updates")
            put(self, "updates", _with_delays(given, self.name, here))
        if not self.updates:
            raise ParameterError(
                "it updates nothing", place=here, advice='give updates, such as {"u": "k_p * x"}'
            )
        for name in self.initial:
            if name not in self.values:
                raise ParameterError(
                    f"initial has {shown(name)}, which is not updated",
                    place=here,
                    advice=f"its values are {', '.join(self.values)}",
                )
        first, delayed = dict(self.initial), self.delayed
        for name in self.values if first else ():
            if name in first:
                first[name] = checked_scalar(f"{here}: initial[{name!r}]", first[name], "finite")
        before = {
            name: first.get(name, first.get(delayed.get(name, name), 0.0)) for name in self.values
        }
        put(self, "initial", before)

    @property
    def values(self) -> tuple[str, ...]:
        """The names of what it updates."""
        return self.outputs or tuple(self.updates)

    @property
    def delayed(self) -> dict[str, str]:
        """The values that are kept of others, each with what it is kept of."""
        lead = f"{self.name}__"
        return {
            name: name.removeprefix(lead).rpartition("__")[0]
            for name in self.values
            if name.startswith(lead)
        }


def _with_delays(updates: Mapping[str, str], sampler: str, here: str) -> Mapping[str, str]:
    """Return updates in which delayed values have names, and are handed on after all others."""
    if not any("delay" in text for text in updates.values()):
        return updates
    longest: dict[str, int] = {}

    def named(found: re.Match[str]) -> str:
        name, ticks = found[1], int(found[2])
        if not 1 <= ticks <= MOST_DELAY:
            raise ParameterError(
                f"{found[0]} has {ticks} ticks", place=here, advice=f"1 to {MOST_DELAY:,} are kept"
            )
        longest[name] = max(ticks, longest.get(name, 0))
        return kept(name, ticks)

    def kept(name: str, ticks: int) -> str:
        return f"{sampler}__{name.replace('.', '__')}__{ticks}"

    texts = {name: DELAY.sub(named, text) for name, text in updates.items()}
    for name, text in texts.items():
        if re.search(r"\bdelay\s*\(", text):
            raise ParameterError(
                f"{name} is {updates[name]!r}",
                place=f"{here}: updates",
                advice="delay takes a name and a number of ticks: delay(u, 3)",
            )
    for name, ticks in longest.items():
        texts |= {kept(name, k): kept(name, k - 1) for k in range(ticks, 1, -1)}
        texts[kept(name, 1)] = name
    return texts
