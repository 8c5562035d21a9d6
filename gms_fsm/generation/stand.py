"""The stand: one contact on a body that is moved or pushed as a motion says.

A chart that locks, strikes, or reads the acceleration is on a free body of 1 kg under a load; any
other is moved with a given velocity. Whatever else its guards read follows signals of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.parts import SUPPLIED
from gms_fsm.language import names_in
from gms_fsm.run.settings import Settings
from gms_fsm.run.simulate import simulate
from gms_fsm.systems.parts import Body, Contact
from gms_fsm.systems.system import System
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.trace import Trace
from gms_fsm.verification.reaching.points import GuardPoints

CONTACT, STRIKER = "contact", "striker"
MASS = 1.0  # kg
MOST_STEPS = 2000  # of a run
SETTINGS = Settings(engine="ifelse", max_steps=MOST_STEPS)
STRIKE = Chart(
    "one impact",
    inputs=("t",),
    parameters=(
        Parameter("t_hit", "s", per_element=False, meaning="when it strikes"),
        Parameter("v_hit", "m/s", per_element=False, meaning="velocity after it"),
    ),
    states=(State("waits", outputs={"F": "0"}), State("over", outputs={"F": "0"})),
    transitions=(
        Transition("strike", "waits", "over", guard="t >= t_hit", actions={"v": "v_hit"}),
    ),
)


@dataclass(frozen=True)
class Leg:
    """A part of a motion, in which signals are straight lines.

    Parameters
    ----------
    duration : float
        s.
    first, last : mapping of str to float
        The signals at both ends.
    """

    duration: float
    first: Mapping[str, float]
    last: Mapping[str, float]


@dataclass(frozen=True)
class Drive:
    """How a run begins, and what moves it.

    Parameters
    ----------
    state : str
        In which all elements begin.
    values : mapping of str to float
        Where variables, positions, and the velocities of a free body begin.
    t : float
        s, when it begins.
    legs : tuple of Leg
        One after the other.
    strike : tuple of float, optional
        When the body is struck, and its velocity after that.
    """

    state: str
    values: Mapping[str, float]
    t: float = 0.0
    legs: tuple[Leg, ...] = ()
    strike: tuple[float, float] | None = None

    @property
    def t_end(self) -> float:
        """When it ends, s."""
        end = self.t
        for leg in self.legs:
            end += leg.duration
        return end

    @property
    def level(self) -> Mapping[str, float]:
        """The signals at its end."""
        return self.legs[-1].last if self.legs else {}

    def cut(self, t: float) -> Drive:
        """Return the motion up to a time."""
        legs, start = list[Leg](), self.t
        for leg in self.legs:
            left = t - start
            if left <= 0.0:
                legs = legs or [Leg(0.0, leg.first, leg.first)]
                break
            if left < leg.duration:
                share = left / leg.duration
                last = {
                    name: u if u == leg.last[name] else u + share * (leg.last[name] - u)
                    for name, u in leg.first.items()
                }
                leg = Leg(left, leg.first, last)
            legs.append(leg)
            start += leg.duration
        strike = self.strike if self.strike is not None and self.strike[0] <= t else None
        return replace(self, legs=tuple(legs), strike=strike)

    def longer(self, share: float) -> Drive:
        """Return the motion with its last levels held for a share of its duration."""
        return self.then(Leg(share * (self.t_end - self.t), self.level, self.level))

    def then(self, *legs: Leg, strike: tuple[float, float] | None = None) -> Drive:
        """Return the motion with more legs."""
        return replace(self, legs=(*self.legs, *legs), strike=strike or self.strike)


@dataclass(frozen=True, eq=False)
class Stand:
    """A contact, and what moves it.

    Parameters
    ----------
    contact : Contact
        Of any system; only its chart, its numbers and its elements count.
    """

    contact: Contact
    chart: Chart = field(init=False)
    free: bool = field(init=False)

    def __post_init__(self) -> None:
        chart = self.contact.chart
        read = frozenset[str]().union(*map(names_in, chart.guards.values()))
        own = {*chart.parameter_names, *chart.variables, *chart.inputs, *chart.let}
        free = chart.locks or chart.sets_velocity or bool(read & {*chart.rate_names} - own)
        object.__setattr__(self, "chart", chart)
        object.__setattr__(self, "free", bool(free and chart.velocities))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Inputs of the chart that follow signals."""
        chart = self.chart
        supplied = {*SUPPLIED, *chart.velocities, "t", *(["s"] if self.contact.stribeck else [])}
        more = ("N",) if self.contact.load is not None else ()
        return (*(name for name in chart.inputs if name not in supplied), *more)

    @property
    def drives(self) -> Mapping[str, str]:
        """The signal that drives each velocity of the chart."""
        kind = "load" if self.free else "velocity"
        names = self.chart.velocities
        return {v: kind if len(names) == 1 else f"{kind}_{v}" for v in names}

    def at_rest(self) -> dict[str, float]:
        """Return signals that do nothing; an input is what its text says, if that is a number."""
        found = dict.fromkeys(self.drives.values(), 0.0)
        for name in self.inputs:
            try:
                found[name] = float(self.contact.inputs.get(name, 1.0))
            except ValueError:
                found[name] = 1.0
        return found

    def start(self, guards: GuardPoints, state: str, values: Mapping[str, float]) -> Drive:
        """Return the motion of no length that begins at a point of guards."""
        level = self.at_rest()
        for name, load in zip(self.chart.velocities, guards.loads, strict=False):
            level[self.drives[name]] = values.get(load if self.free else name, 0.0)
        if not guards.loads and not self.free:
            for name in self.chart.velocities:
                level[self.drives[name]] = values.get(name, 0.0)
        level |= {name: values[name] for name in self.inputs if name in values}
        own = [*self.chart.variables, "x", *(self.chart.velocities if self.free else ())]
        kept = {n: values[n] for n in own if n in values and n not in self.chart.hidden}
        legs = (Leg(0.0, level, level),)
        return Drive(state, kept, values.get("t", 0.0), legs)

    # ------------------------------------------------------------------ running
    def system(self, motion: Drive, striker: bool = False) -> System:
        """Return the system that a motion moves, with a striker if some motion needs one."""
        chart, signals = self.chart, dict[str, Any]()  # corners by name
        t = motion.t
        for leg in motion.legs:
            ends = ((t, leg.first), (t + leg.duration, leg.last))
            t += leg.duration
            for at, level in ends:
                for name, u in level.items():
                    corners = signals.setdefault(name, [])
                    if corners[-1:] != [(at, u)]:
                        corners.append((at, u))
        contact = self.contact.replaced(
            name=CONTACT, v=chart.velocities, inputs={name: name for name in self.inputs}
        )
        if not chart.velocities:
            machines: Any = (contact,)
            return System(f"{chart.name}", supervisors=machines, signals=signals)
        drives = self.drives
        bodies = tuple(
            Body(
                "body" if not i else f"body_{v}",
                **({"inertia": MASS, "force": drives[v]} if self.free else {"velocity": drives[v]}),
                x="x" if not i else f"x_{v}",
                v=v,
                rotary=chart.rotary,
            )
            for i, v in enumerate(chart.velocities)
        )
        contacts = [contact]
        if striker:
            t_hit, v_hit = motion.strike or (2.0 * motion.t_end - motion.t + 1.0, 0.0)
            hit = {"t_hit": t_hit, "v_hit": v_hit}
            contacts.append(Contact(STRIKER, STRIKE, hit, v=chart.velocities[0]))
        return System(chart.name, bodies=bodies, contacts=tuple(contacts), signals=signals)

    def initial(self, motion: Drive) -> dict[str, Any]:
        """Return the initial values of a motion."""
        n, chart = self.contact.n, self.chart
        found: dict[str, Any] = {f"{CONTACT}.states": [motion.state] * n}
        for name, value in motion.values.items():
            if name in chart.variables:
                found[f"{CONTACT}.{name}"] = [value] * n
            elif value:
                found[name] = value
        return found

    def run(
        self, motion: Drive, striker: bool | None = None, engine: str = "ifelse"
    ) -> tuple[Trace, str]:
        """Run a motion; return what was seen of the contact, and how the run failed, if it did."""
        striker = motion.strike is not None if striker is None else striker
        system = self.system(motion, striker)
        ended = ""
        try:
            trace = simulate(
                system,
                motion.t_end,
                t_start=motion.t,
                initial=self.initial(motion),
                settings=SETTINGS,
                engine=engine,
            )
        except SimulationError as error:
            trace, ended = error.trace, type(error).__name__
        return trace.contact(CONTACT), ended
