"""Named runs that laws hold for, each made once a session: `tests/laws` walks over them.

`CORPUS` has runs that reach their end, `FAILING` runs that stop with an error. A run is a small
object, made when it is asked for; `trace` computes it once per engine. Its groups say what a law
may assume: ``"rig"`` is a model on a rig, ``"system"`` anything else.
"""

from __future__ import annotations

import functools
import importlib.util
import math
import zlib
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    LuGre,
    Prescribed,
    PulledSlider,
    Sampled,
    Slider,
    State,
    Stribeck,
    Supervisor,
    System,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts import CHARTS, gms_element, timetable
from gms_fsm.charts.registry import entry
from gms_fsm.errors import GMSError
from gms_fsm.scenarios import shipped
from gms_fsm.systems.models import demonstration
from gms_fsm.systems.signals import Signal, as_signal
from gms_fsm.traces.failures import (
    LivelockError,
    NotFiniteError,
    NotUniqueError,
    SignalEndError,
    SimulationError,
    StepLimitError,
    StepSizeError,
)
from integrators.elementary import sin
from tests import supervisor_cases, systems_cases
from tests.helpers import (
    CURVE,
    FASTEST,
    FIG3_FORCE,
    FIG4_SINE,
    FunctionBelt,
    banging,
    bank,
    non_drifting,
    one_element,
    open_loop,
    pulled_mass,
    stick_slip,
    wear,
)
from tests.scenario_files import data_folder
from tests.soak import random_systems, trials
from tests.zoo import zoo_cases

ENGINES = ("ifelse", "machines", *(("compiled",) if importlib.util.find_spec("llvmlite") else ()))


# --------------------------------------------------------------------------- what a run is
@dataclass(frozen=True, eq=False)
class Run:
    """A subject of `simulate`, model and rig or a system, and its further arguments."""

    subject: tuple[Any, ...]
    t_end: float
    how: Mapping[str, Any] = field(default_factory=dict)

    def __call__(self, **more: Any) -> Trace:
        """Simulate it."""
        return simulate(*self.subject, self.t_end, **{**self.how, **more})

    def outcome(self, **more: Any) -> tuple[Trace | None, str]:
        """Return what was computed, and the error's name and text if it stopped."""
        try:
            return self(**more), ""
        except GMSError as error:
            return getattr(error, "trace", None), f"{type(error).__name__}: {error}"


Maker = Callable[[], Run]


def _on(model: Any, rig: Any, t_end: float, **how: Any) -> Maker:
    """A model on a rig."""
    return lambda: Run((model, rig), t_end, how)


def _case(make: Callable[[], systems_cases.Case]) -> Maker:
    def made() -> Run:
        case = make()
        return Run((case.system,), case.t_end, {"initial": dict(case.initial), "rtol": 1e-8})

    return made


# --------------------------------------------------------------------------- the paper's models
@dataclass(frozen=True, eq=False)
class TwoForces:
    """A rig of one's own with two signals, a number, time and position in its equation."""

    first: Any
    second: Any
    mass: float = 1.0
    title: str = field(default="two forces", init=False)
    acceleration: str = field(default="(F_a + F_b * cos(t) - 0.1 * x - F) / mass", init=False)

    @property
    def signals(self) -> Mapping[str, Signal]:
        """Both forces."""
        return {"F_a": as_signal(self.first), "F_b": as_signal(self.second)}

    @property
    def numbers(self) -> Mapping[str, float]:
        """The mass."""
        return {"mass": self.mass}


def _trial(family: str, seed: int, index: int) -> Run:
    one = trials.trial(family, seed, index)
    return Run((one.model, one.rig), one.t_end)


LUGRE = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4.0, stribeck=Stribeck(1.0, 1.5, 1e-3))
JUMPS = [0, 1, 1, 2, 2.5, 2.5, 2.5, 10], [0.1, 0.2, -0.3, -0.3, 0.5, 0.6, 0.7, 0]
_noise = np.random.default_rng(3)
SAMPLES = np.linspace(0, 10, 501), _noise.normal(size=501).cumsum() * 0.02
SIGNED, PUBLISHED = stick_slip("signed"), stick_slip("published")
PULLED = pulled_mass()
STARTED = {"x": 0.5, "v": 0.01, "z": [0, 0.001, 0.002, 0.003], "states": ["slip"] * 4}
GMS_RUNS: dict[str, Maker] = {
    "open loop": _on(SIGNED, open_loop(), 31.0),
    "open loop, published": _on(PUBLISHED, open_loop(), 31.0),
    "fig. 4, published": _on(PUBLISHED, Prescribed(FIG4_SINE), 100.0),
    "fig. 3": _on(*non_drifting("published"), 30.0),
    "fig. 3, slipping": _on(*non_drifting("signed", slipping=True), 12.0),
    "fig. 3, slipping, published": _on(*non_drifting("published", slipping=True), 12.0),
    "pulled mass": _on(*PULLED, 30.0),
    "slider": _on(PULLED[0], Slider(1.0, "2.5*sin(0.7*t)"), 12.0),
    "twelve elements": _on(bank(12), Prescribed("0.2*sin(2*pi*t/7)"), 14.0),
    "before zero": _on(SIGNED, open_loop(), 11.0, t_start=-20.5),
    "started": _on(*PULLED, 5.0, initial=STARTED),
    "lugre": _on(LUGRE, Prescribed("1e-3*(1.5+cos(10*t))"), 6.0),
    "lugre slider": _on(LUGRE, Slider(1.0, FIG3_FORCE), 6.0),
    "close to s": lambda: _trial("literature", 202, 41),  # steps at the edge of stability
    "close to s, often": lambda: _trial("literature", 306, 84),
    "four at once": _on(SIGNED, Prescribed(FIG4_SINE), 6.0),
    "velocity window": _on(one_element("signed", F_c=0.4, v_s=1e-3, k=0.7), open_loop(), 13.0),
}
METHODS: dict[str, dict[str, Any]] = {
    "bs23": {"method": "bs23"},
    "tight": {"rtol": 1e-10, "atol": 1e-13},
    "loose": {"rtol": 1, "atol": 1},  # integers
    "max_step": {"max_step": 1e-2},
    "dp45 on a grid": {"step": 1e-2},
    "euler": {"method": "euler", "step": 5.003e-3},
    "heun": {"method": "heun", "step": 5.003e-3},
    "rk4": {"method": "rk4", "step": 7.003e-3},
    "rk4 by step": {"method": "rk4", "step": 7.003e-3, "events": "step"},
    "euler by step": {"method": "euler", "step": 5.003e-3, "events": "step"},
    "dp45 by step": {"events": "step", "max_step": 1e-2},
    "bs23 by step": {"method": "bs23", "events": "step", "max_step": 1e-2},
    "t_eval": {"t_eval": np.linspace(0, 12, 777)},
    "held": {"events": "held", "step": 0.01},
}
_BASES = ("open loop", "fig. 4, published", "fig. 3, slipping", "pulled mass")
_SUBJECTS: dict[str, Callable[[], tuple[Any, Any]]] = {
    "open loop": lambda: (SIGNED, open_loop()),
    "fig. 4, published": lambda: (PUBLISHED, Prescribed(FIG4_SINE)),
    "fig. 3, slipping": lambda: non_drifting("signed", slipping=True),
    "pulled mass": lambda: PULLED,
}


def _by_method(place: int, name: str) -> tuple[str, Maker]:
    """Each method on one of four runs, in turn."""
    base = _BASES[place % len(_BASES)]
    return f"{base}, {name}", lambda: Run(_SUBJECTS[base](), 12.0, METHODS[name])


METHOD_RUNS = dict(_by_method(place, name) for place, name in enumerate(METHODS))
VELOCITIES: dict[str, Any] = {
    "a number": 0.1,
    "ramps": [(0, 0), (2, 0.2), (4, -0.2), (9, 0.3)],
    "ramps with jumps": list(zip(*JUMPS, strict=True)),
    "a jump at the start and at the end": [(0, 0.1), (0, 0.2), (10, -0.2), (10, 0.2)],
    "ramps that begin later": [(3, 0.2), (4, -0.2)],
    "a record": SAMPLES,
    "a record with jumps": JUMPS,
    "corners and jumps": "0.1*abs(sin(t)) + min(0.1, max(-0.1, sin(5*t))) + 0.1*sgn(cos(0.7*t))",
    "all functions": "0.4*tanh(sin(t))*exp(-0.1*t) + 0.1*cos(3*t)*sqrt(t)/(1 + t**2)"
    " + 0.05*(1.1 + cos(t))**0.5 - 0.02*2**cos(t) + 0.1*sin(t)*8**(sin(3*t)/3)",
    "a function": lambda t: 0.2 * math.sin(0.3 * t) + 0.05,
}
FORCES: dict[str, tuple[Any, Any]] = {
    "two records": (([0, 3, 3, 7, 12.0], [0, 1, 0.5, 2, 0]), (SAMPLES[0] * 1.2, SAMPLES[1])),
    "expression and ramps": ("sgn(sin(t))*2", [(0, 0), (5, 3), (5, -3)]),
}
SIGNAL_RUNS: dict[str, Maker] = {
    name: _on(SIGNED, Prescribed(signal), 10.0) for name, signal in VELOCITIES.items()
} | {name: _on(SIGNED, TwoForces(*forces), 12.0) for name, forces in FORCES.items()}


# --------------------------------------------------------------------------- charts of one's own
ORDER = Chart(
    "Stateflow's order",
    inputs=("t",),
    variables=("z", "w"),
    states=(
        State("a", {"z": "0", "w": "0"}, exit={"z": "z + 1", "w": "z"}),
        State("b", {"z": "0", "w": "1"}, entry={"z": "z + 0.5", "w": "w + z"}),
    ),
    transitions=(Transition("go", "a", "b", "t >= 1", actions={"z": "10 * z", "w": "w * z"}),),
    outputs={"F": "z"},
)

JUMPING = Chart(
    "functions that jump",
    inputs=("t", "v"),
    variables=("z", "n"),
    parameters=("k", "T"),
    states=(
        State(
            "on",
            {
                "z": "v + mod(t, T) + 0.1 * round(3 * z) - if(t > 2 and z < 1, 0.3, 0.1 * z)",
                "n": "0",
            },
        ),
        State("off", {"z": "0.2 * floor(2 * v) - z + 0.1 * noise(t / 0.3, 7)", "n": "0"}),
    ),
    transitions=(
        Transition("rest", "on", "off", "floor(2 * z) > n", actions={"n": "mod(n + 1, 3)"}),
        Transition(
            "go", "off", "on", "after(0.3) and (round(n) == 1 or mod(t, 1) > if(v > 0, 0.5, 0.8))"
        ),
    ),
    outputs={"F": "k * quantise(saturate(z, -1, 1), 0.25) + if(v >= 0, 0.1, -0.1)"},
)
WORDS = Chart(
    "words as names",
    inputs=("v",),
    variables=("z",),
    parameters=("floor", "mod", "saturate"),
    states=(State("round", {"z": "v - mod * z"}), State("tooth", {"z": "v - floor * z"})),
    transitions=(
        Transition("quantise", "round", "tooth", "z > saturate and round(2 * z) >= 1"),
        Transition("if_gt", "tooth", "round", "z < -saturate"),
    ),
    outputs={"F": "floor * z + mod"},
)


RISING = ("1 + 0.3 * t", "-1 + 0.3 * t")  # p' below and above q = 0
FALLING = ("1 - 0.3 * t", "-1 - 0.3 * t")


def relay(
    flows: tuple[str, str] = RISING,
    guards: tuple[str, str] = ("p > q", "p < q"),
    n: int = 1,
) -> ChartModel:
    """A variable p pushed towards q from both sides, along which the run slides."""
    below, above = flows
    chart = Chart(
        "relay",
        inputs=("t",),
        variables=("p", "q"),
        parameters=("k",),
        states=(
            State("below", flow={"p": below, "q": "0"}),
            State("above", flow={"p": above, "q": "0"}),
            State("off", flow={"p": "0", "q": "0"}),
        ),
        transitions=(
            Transition("rise", "below", "above", guard=guards[0]),
            Transition("fall", "above", "below", guard=guards[1]),
        ),
        outputs={"F": "k * p"},
    )
    return ChartModel(chart, {"k": 1.0}, n=n)


def coulomb(outputs: str = "F_c * sgn(v)") -> ChartModel:
    """Coulomb friction without stiction: a sign."""
    chart = Chart(
        "Coulomb friction",
        inputs=("v", "x"),
        variables=("z",),
        parameters=("F_c",),
        states=(State("on", flow={"z": "0"}),),
        outputs={"F": outputs},
    )
    return ChartModel(chart, {"F_c": 1.0})


def runs_down(C: Any) -> ChartModel:
    """Elements that come to rest on z = 0, each in its time."""
    chart = Chart(
        "runs down",
        inputs=("v",),
        variables=("z",),
        parameters=("C",),
        states=(State("on", flow={"z": "v - C * sgn(z)"}),),
        outputs={"F": "z"},
    )
    return ChartModel(chart, {"C": C}, n=len(C))


class Belt:
    """A mass on a belt that moves."""

    title = "mass on a moving belt"
    acceleration = "(stiffness * (0 - x) - F - F_b * sgn(v - w)) / mass"

    def __init__(self, w: str) -> None:
        self.signals = {"w": as_signal(w)}
        self.numbers = {"mass": 1.0, "stiffness": 4.0, "F_b": 1.0}


# An element that slips holds v at 0 for a tenth of a millisecond.
HELD = GMS(
    GMSParameters(
        [82e3, 146e3, 110e3],
        [29, 2.6, 114],
        [2.8e-3, 2.16e-3, 1.53e-3],
        sigma_2=1.3,
        stribeck=Stribeck(2.88, 3.155, 8.8e-3),
        v_c=3.3e-6,
        weights=[3.9e-6, 3e-6, 2.15e-6],
    ),
    law="signed",
)
PUSHED = Slider(1.4, "2.9*sin(4.7*t)")
# One element with a threshold of two micrometres.
MICROMETRES = GMS(
    GMSParameters(
        [4e6],
        [3e3],
        [1e-5],
        sigma_2=250,
        stribeck=Stribeck(8, 9.5, 5e-4),
        v_c=7.3e-7,
        weights=[1 / 4e6],
    ),
    law="signed",
)


def _broken(*edges: Transition) -> ChartModel:
    """The signed element with other edges."""
    sound = gms_element("signed")
    chart = Chart(
        "broken",
        sound.inputs,
        sound.variables,
        sound.parameters,
        sound.states,
        edges,
        sound.outputs,
    )
    values = {"k": 1, "sigma": 0.1, "C": 0.1, "v_c": 0.2}
    return ChartModel(chart, values, n=2, stribeck=Stribeck(1.0, 1.5, 1e-3), weights=[2, 1])


def go(guard: str, **actions: str) -> ChartModel:
    return _broken(Transition("go", "stick", "slip", guard=guard, actions=actions))


def odd_names() -> ChartModel:
    """Names and titles of any letters, actions of every kind, numbers that no decimal is."""
    chart = Chart(
        'own "\u00e9", with\ncommas',
        ("v", "s", "t"),
        ("z", "w"),
        ("k", "c"),
        (
            State("rest", {"z": "v", "w": "0"}),
            State(
                "l\u00e4uft", {"z": "0", "w": "abs(v)"}, entry={"z": "z / 3"}, exit={"w": "w + 1"}
            ),
        ),
        (
            Transition("go", "rest", "l\u00e4uft", "abs(z) >= s or t > 100", {"w": "c * w"}),
            Transition("back", "l\u00e4uft", "rest", "not abs(v) > 0.05"),
        ),
        {"F": "k * z + 1e-3 * dw"},
    )
    return ChartModel(
        chart,
        {"k": np.array([1 / 3, 2.0]), "c": 0.1},
        n=2,
        weights=[0.1, 0.3],
        stribeck=CURVE,
        sigma_2=0.1,
        title='mine; "quoted"\n\u00e9',
    )


# Edges by the time in a state, from several states, and at once.
LAMP = Chart(
    "lamp",
    parameters=("T",),
    states=(
        State("red", outputs={"F": "1"}),
        State("green", outputs={"F": "2"}),
        State("broken", outputs={"F": "0"}),
        State("passing", outputs={"F": "3"}),
    ),
    transitions=(
        Transition("fails", ("red", "green"), "broken", guard="v > 0.5"),
        Transition("go", "red", "passing", guard="after(T)"),
        Transition("through", "passing", "green", guard="True"),
        Transition("stop", "green", "red", guard="after(2 * T)"),
    ),
)

# States in states: what is inherited, histories, ages of outer states, entries and exits.
LIGHT = ChartModel(
    Chart(
        "two-level light",
        variables=("n", "u"),
        parameters=("T",),
        states=(
            State("off", outputs={"F": "0"}, exit={"u": "0.5 * u"}),
            State(
                "on",
                flow={"u": "age"},
                entry={"n": "n + 1"},
                exit={"n": "0.5 * n"},
                outputs={"F": "u + v"},
                states=(
                    State("red", entry={"u": "u - 1"}, exit={"n": "n + 10"}),
                    State(
                        "go",
                        states=(State("amber"), State("green", flow={"u": "2"})),
                        initial="green",
                    ),
                ),
                initial="go",
                history=True,
            ),
        ),
        transitions=(
            Transition("fails", "on", "off", guard="after(5 * T)"),
            Transition("again", "off", "on", guard="after(T)"),
            Transition("slow", "on.go.green", "on.go.amber", guard="after(T)"),
            Transition("stop", "on.go", "on.red", guard="after(1.5 * T)", actions={"u": "u / 2"}),
            Transition("start", "on.red", "on.go", guard="after(1.3 * T)"),
        ),
    ),
    {"T": 0.3},
)

# Held after a slow while, released after a push that lasted: conditions that have to go on.
HEALS = ChartModel(
    Chart(
        "heals",
        variables=("z",),
        parameters=("k", "z_s", "T"),
        states=(
            State("stick", flow={"z": "v"}),
            State("slip", flow={"z": "0"}),
            State("held", flow={"z": "v"}),
        ),
        outputs={"F": "k * z"},
        transitions=(
            Transition("break_away", "stick", "slip", guard="abs(z) > z_s"),
            Transition("heal", ("slip", "stick"), "held", guard="duration(abs(v) < 0.3) >= T"),
            Transition(
                "tear", "held", "slip", guard="abs(z) > 2 * z_s and duration(v > 0) > T / 2"
            ),
        ),
    ),
    {"k": [1.0, 2.0], "z_s": [0.05, 0.1], "T": [0.1, 0.15]},
    n=2,
)

OWN_RUNS: dict[str, Maker] = {
    "conditions that last": _on(HEALS, Prescribed("sin(2 * t)"), 6.0),
    "states in states": _on(LIGHT, Prescribed("0.2 * sin(t)"), 6.0),
    "ages": _on(ChartModel(LAMP, {"T": 0.3}), Prescribed("0"), 5.0),
    "odd names": _on(odd_names(), Prescribed("0.3*sin(t)"), 20.0),
    "wear": _on(wear(), Prescribed("0.3*sin(2*pi*t/17)"), 40.0),
    "wear, pulled": _on(wear(1), PulledSlider(1, 2, 0.1), 40.0, method="rk4", step=7.003e-3),
    "functions that jump": _on(
        ChartModel(JUMPING, {"k": 1.0, "T": [0.7, 1.1]}, n=2),
        Prescribed("0.6*cos(1.3*t) + if(mod(t, 2) < 1, 0.2, -0.1)"),
        9.0,
    ),
    "functions that jump, pulled": _on(
        ChartModel(JUMPING, {"k": 1.0, "T": 0.7}), PulledSlider(1.0, 2.0, 0.3), 9.0
    ),
    "words as names": _on(
        ChartModel(WORDS, {"floor": 2.0, "mod": 0.1, "saturate": [0.3, 0.4]}, n=2),
        Prescribed("0.5*sin(t)"),
        20.0,
    ),
    "order of actions": _on(
        ChartModel(ORDER, {}, n=2, stribeck=CURVE),
        Prescribed("0"),
        2.0,
        initial={"z": [2.0, 3.0], "w": [0.0, 0.0]},
    ),
    "sliding": _on(relay(FALLING), Prescribed("0"), 5.0, initial={"p": [-0.1], "q": [0.0]}),
    "held at standstill": _on(HELD, PUSHED, 0.4),
    "micrometres": _on(MICROMETRES, PulledSlider(40, 1600, 1.8e-3), 8.0),
    "coulomb": _on(coulomb(), PulledSlider(1.0, 2.0, 0.1), 10.0),
    "on a belt": _on(coulomb("0 * F_c"), Belt("0.1 * cos(t)"), 1.2, initial={"v": 0.1}),
    "runs down": _on(
        runs_down([1.0, 2.0, 2.0, 0.1]), Slider(1e9, "0"), 2.0, initial={"z": [1.0, 1.0, -1.0, 1.0]}
    ),
    "an infinite side": _on(go("exp(1e4 + z) > 0"), Prescribed("0.1"), 1.0),
    "divided by zero": _on(go("1 / (z - z) > 0"), Prescribed("0.1"), 1.0),
    "fast switching": _on(banging(1e-2), Prescribed("1"), 2.0),
}


# --------------------------------------------------------------------------- the zoo
SOFT = {"k_t": 2e3, "v_s": 0.02}  # or the mass would ring at 50 Hz


def _demonstration(name: str) -> Maker:
    """A chart of the zoo with the numbers of its demonstration."""

    def made() -> Run:
        if name == "seven-parameter":
            model = ChartModel(CHARTS[name], {**entry(name).demonstration.values, **SOFT})
            return Run((model, PulledSlider(1.0, 2.0, 0.1)), 11.0)
        drive = Prescribed("2e-3 * (cos(3 * t) + 0.9 * cos(9.3 * t))")
        return Run((demonstration(entry(name)), drive), 4.0)

    return made


DEMONSTRATIONS = ("rate-state-ageing", "rate-state-slip", "bouc-wen", "seven-parameter")
ZOO_RUNS: dict[str, Maker] = {
    **{name: _case(functools.partial(make)) for name, make in zoo_cases.CASES.items()},
    **{name: _demonstration(name) for name in DEMONSTRATIONS},
}


# --------------------------------------------------------------------------- systems
def rates() -> System:
    """Two contacts with periods, and two samplers, one of them with an offset."""
    return System(
        "several rates",
        bodies=(
            Body("slide", velocity="60 * cos(100 * t)"),
            Body("other", inertia=1.0, force="30 * (x - x_o) + u", x="x_o", v="v_o"),
        ),
        contacts=(
            Contact("fast", SIGNED, v="v_o", period=1e-4),
            Contact("pad", SIGNED, v="v", period=1.1e-3),
        ),
        sampled=(
            Sampled("slow", period=7e-4, offset=2e-4, updates={"w": "e - 0.1 * v"}),
            Sampled("often", period=5e-5, updates={"e": "x - x_o", "u": "e + w"}),
        ),
    )


def loaded() -> System:
    """Two contacts whose normal force varies, and one whose threshold is an input."""
    lugre = LuGre(sigma_0=10.0, sigma_1=0.2, sigma_2=0.1, stribeck=Stribeck(0.3, 0.5, 0.01))
    bound = Contact(
        "bound", SIGNED.chart, SIGNED.values, n=4, v="v", inputs={"s": "w + 0.1 * abs(x)"}
    )
    return System(
        "loaded",
        bodies=(Body("mass", inertia=1.0, force="2 * sin(t)", x="x", v="v"),),
        contacts=(
            Contact("pad", SIGNED, v="v", inputs={"N": "2 + 1.5 * sin(3 * t)"}),
            Contact("oil", lugre, v="v", inputs={"N": "1 + 0.1 * t"}),
            bound,
        ),
        signals={"w": "0.2 + 0.01 * t"},
    )


def switched() -> System:
    """A pad that is oiled at given times; its force is seen late, its variable at once."""
    pad = Chart(
        "pad",
        parameters=("F_c", "b"),
        variables=("k",),
        states=(
            State("dry", outputs={"F": "F_c * tanh(v / 0.01) + k"}, entry={"k": "k + v"}),
            State("oiled", outputs={"F": "b * v"}),
        ),
        transitions=(
            Transition("oil", "dry", "oiled", event="oil"),
            Transition("dry_up", "oiled", "dry", guard="after(0.25)"),
        ),
    )
    seer = Chart(
        "seer",
        inputs=("u",),
        velocities=(),
        variables=("n",),
        states=(State("low", flow={"n": "u"}), State("high", entry={"n": "n + u"})),
        transitions=(
            Transition("rise", "low", "high", guard="u > 0.1"),
            Transition("fall", "high", "low", guard="u < 0.1 + 0 * n"),
        ),
    )
    return System(
        "oiled by hand",
        bodies=(Body("slide", velocity="v"),),
        contacts=(Contact("pad", pad, {"F_c": 2.0, "b": 1.0}),),
        supervisors=(
            Supervisor("hand", timetable({"oil": OILED})),
            Supervisor("seer", seer, inputs={"u": "pad.k"}),
        ),
        signals={"v": "0.3 * sin(7 * t)"},
        sampled=(
            Sampled("late", period=0.01, updates={"F": "pad.F", "u": "delay(F, 3) + delay(x, 1)"}),
        ),
    )


OILED = (0.0, 0.2, 1.0, 4 / 3)


def belt(speed: Any = "0.1") -> System:
    """Two blocks on a belt, with a contact of each kind: locked, a bank, in the plane."""
    stiction = {"F_c": 1.0, "F_s": 1.5, "b": 0.0}
    oil = Chart(
        "viscous in the plane",
        velocities=("v", "w"),
        variables=("p", "q"),
        states=(State("slip", flow={"p": "v", "q": "w - q"}, outputs={"F": "v + p", "F_w": "w"}),),
    )
    return System(
        "two blocks on a belt, and oil",
        bodies=(
            Body("one", inertia="m", force="1.3 * (q2 - q1) - 2 * q1 + 4 * sin(t)", x="q1", v="w1"),
            Body("two", inertia=1.2, force="1.3 * (q1 - q2) - 2 * q2 + i", x="q2", v="w2"),
            Body("belt", velocity="r", x="x_b", v="w_b"),
        ),
        contacts=(
            Contact("pad", CHARTS["stiction"], stiction, v="w1 - w_b"),
            Contact("bank", SIGNED, v="w2 - w_b"),
            Contact("oil", oil, v=("w1", "w1 - w2")),
        ),
        signals={"r": speed},
        numbers={"m": 1.0},
        flow={"i": "q1 - i"},
    )


def dry(switching: bool) -> Chart:
    """Return Coulomb friction: as two states, or as a sign."""
    if not switching:
        states = (State("on", outputs={"F": "F_c * sgn(v)"}),)
        return Chart("sign", inputs=("v",), parameters=("F_c",), states=states)
    return Chart(
        "two states",
        parameters=("F_c",),
        states=(State("fwd", outputs={"F": "F_c"}), State("bwd", outputs={"F": "-F_c"})),
        transitions=(
            Transition("go", "bwd", "fwd", guard="v > 0"),
            Transition("back", "fwd", "bwd", guard="v < 0"),
        ),
    )


def side_by_side() -> System:
    """Three bodies on dry friction of each kind, one of them with a ratio of 3."""
    names, masses, forces = "abc", (1.0, 1.0, 0.5), ("0.2 * t", "0.3 * t", "0.25 * t")
    bodies = tuple(
        Body(name, inertia=m, force=force, x=f"x{name}", v=f"v{name}")
        for name, m, force in zip(names, masses, forces, strict=True)
    )
    contacts = (
        Contact("one", dry(True), {"F_c": 1.0}, v="va"),
        Contact("two", dry(False), {"F_c": 1.0}, v="3 * vb"),
        Contact("three", dry(False), {"F_c": 1.0}, v="vc"),
    )
    return System("side by side", bodies=bodies, contacts=contacts)


BESIDE = {"va": 1.0, "vb": 0.5, "vc": 0.3}
RANDOM_SEED, RANDOM_SHAPES = 7, 8


def _random(index: int) -> Maker:
    def made() -> Run:
        one = random_systems.trial(RANDOM_SEED, index, RANDOM_SHAPES)
        return Run((one.system,), random_systems.T_END, one.how)

    return made


SYSTEM_RUNS: dict[str, Maker] = {
    **{
        f"supervisor {make.__name__.replace('_', ' ')}": _case(make)
        for make in supervisor_cases.CASES
    },
    **{
        f"system {name.replace('_', ' ')}": _case(make)
        for name, make in systems_cases.CASES.items()
    },
    "several rates": lambda: Run((rates(),), 0.16, {"t_start": 0.1}),
    "loads": lambda: Run((loaded(),), 8.0),
    "events at given times": lambda: Run((switched(),), 2.0),
    "every kind of contact": lambda: Run(
        (belt(),), 12.0, {"initial": {"q2": 0.2, "pad.states": ["backward"]}}
    ),
    "cradle with pads": _case(functools.partial(systems_cases.cradle, pads=True)),
    "dry friction side by side": lambda: Run((side_by_side(),), 8.0, {"initial": BESIDE}),
    "hit, by step": lambda: Run(
        (systems_cases.hit(),),
        0.5,
        {"initial": {"v_a": 1.0}, "events": "step", "method": "rk4", "step": 0.01},
    ),
    **{f"random system {k}": _random(k) for k in range(RANDOM_SHAPES - 1)},  # the last one stops
}


# --------------------------------------------------------------------------- scenarios
def _scenario(name: str) -> Maker:
    def made() -> Run:
        with pytest.MonkeyPatch.context() as patch:
            if name == "tribometer":
                patch.setenv("GMS_FSM_DATA", str(data_folder()))
            read = load_scenario(name)
        how = {key: u for key, u in read.arguments.items() if key not in ("engine", "t_end")}
        *subject, t_end = read.subject
        if name == "tribometer":  # its record has thousands of rows
            t_end *= 0.1
            how["t_eval"] = [t for t in how["t_eval"] if t <= t_end]
        return Run(tuple(subject), t_end, how)

    return made


OF_SCIPY = {"earthquake"}  # its steps are those of LAPACK, which differ between machines
SCENARIOS = tuple(name for name in shipped() if name not in OF_SCIPY)
SCENARIO_RUNS: dict[str, Maker] = {f"scenario {name}": _scenario(name) for name in SCENARIOS}


# --------------------------------------------------------------------------- runs that stop
def flow_of(text: str) -> ChartModel:
    """Two variables with one flow and no edges."""
    chart = Chart(
        "flow", ("v", "t"), ("z",), ("k",), (State("on", {"z": text}),), (), {"F": "k * z"}
    )
    return ChartModel(chart, {"k": 1.0}, n=2, stribeck=CURVE)


BOTH_WAYS = _broken(
    Transition("break_away", "stick", "slip", guard="abs(z) >= s and abs(v) <= v_c"),
    Transition("arrest", "slip", "stick", guard="abs(v) <= v_c and abs(z) < 10 * s"),
)
SELF_LOOP = _broken(Transition("again", "stick", "stick", guard="z >= s"))
TIMES = np.linspace(0, 35, 701)
RECORD = TIMES, np.array([0.2 * sin(2 * np.pi * t / 20) for t in TIMES.tolist()])
_UP = {"initial": {"z": [0.1, 1.0]}}
_RK4 = {"method": "rk4", "step": 0.01}
_BY_STEP = {"events": "step", "max_step": 0.05}
_Failure = tuple[type[SimulationError], Maker]
FAILURES: dict[str, _Failure] = {
    "livelock": (LivelockError, _on(BOTH_WAYS, Prescribed("0.15"), 20.0)),
    "self-loop": (LivelockError, _on(SELF_LOOP, Prescribed("0.5"), 5.0)),
    "chattering": (LivelockError, _on(banging(1e-8), Prescribed("1"), 10.0)),
    "no slope": (LivelockError, _on(flow_of("0"), FunctionBelt(), 5.0, initial={"v": 1.0})),
    "blow-up": (StepSizeError, _on(flow_of("z * z"), Prescribed("0"), 2.0, **_UP)),
    "blow-up, bs23": (
        StepSizeError,
        _on(flow_of("z * z"), Prescribed("0"), 2.0, method="bs23", rtol=1e-4, **_UP),
    ),
    "blow-up by step": (
        StepSizeError,
        _on(flow_of("z * z"), Prescribed("0"), 2.0, **_BY_STEP, **_UP),
    ),
    "blow-up, rk4": (NotFiniteError, _on(flow_of("z * z"), Prescribed("0"), 20.0, **_RK4, **_UP)),
    "blow-up, rk4 by step": (
        NotFiniteError,
        _on(flow_of("z * z"), Prescribed("0"), 20.0, events="step", **_RK4, **_UP),
    ),
    "pole of t": (StepSizeError, _on(flow_of("1 / (1 - t)**2"), Prescribed("0"), 2.0)),
    "infinite at once": (NotFiniteError, _on(flow_of("1 / (k - 1)"), Prescribed("0"), 2.0)),
    "root of a negative": (NotFiniteError, _on(PUBLISHED, Prescribed("0.1*sqrt(3 - t)"), 10.0)),
    "root, fixed steps": (
        NotFiniteError,
        _on(PUBLISHED, Prescribed("0.1*sqrt(3 - t)"), 10.0, **_RK4),
    ),
    "exp overflows": (NotFiniteError, _on(PUBLISHED, Prescribed("exp(800*(t - 2.9))"), 10.0)),
    "division by zero": (SimulationError, _on(SIGNED, Prescribed("0.1/(2 - t)"), 10.0)),
    "nothing at the start": (NotFiniteError, _on(SIGNED, Prescribed("sqrt(-1 - t)"), 10.0)),
    "a guard of NaN": (NotFiniteError, _on(go("0 / (z - z) > 0"), Prescribed("0.1"), 1.0)),
    "an action of NaN": (
        NotFiniteError,
        _on(go("z >= 0.05", z="1 / (z - z)"), Prescribed("0.1"), 1.0),
    ),
    "the record ends": (SignalEndError, _on(SIGNED, Prescribed(RECORD), 61.0)),
    "the record ends, rk4": (SignalEndError, _on(SIGNED, Prescribed(RECORD), 61.0, **_RK4)),
    "both sides lead away": (
        NotUniqueError,
        _on(coulomb("-F_c * sgn(v)"), Slider(1.0, "0.1"), 1.0),
    ),
    "too many steps": (StepLimitError, _on(*PULLED, 60.0, max_steps=300)),
    "random system 7": (LivelockError, _random(7)),
}

# --------------------------------------------------------------------------- all of them
RIG_RUNS = {**GMS_RUNS, **METHOD_RUNS, **SIGNAL_RUNS, **OWN_RUNS}
CORPUS: dict[str, Maker] = {**RIG_RUNS, **ZOO_RUNS, **SYSTEM_RUNS, **SCENARIO_RUNS}
FAILING: dict[str, Maker] = {name: make for name, (_, make) in FAILURES.items()}
# One of each kind, for laws that cost more than two runs.
FEW = (
    "open loop", "fig. 3, slipping, published", "pulled mass", "pulled mass, rk4",
    "open loop, rk4 by step", "ramps with jumps", "lugre slider", "wear", "sliding", "karnopp",
    "maxwell-slip", "system two blocks", "system puck", "system servo",
    "system pushed against a stop", "several rates", "every kind of contact", "random system 3",
)  # fmt: skip
# One of each kind of run, for laws over the whole corpus; make foreign runs the others, too.
KINDS = (
    *FEW,
    "fig. 3", "twelve elements", "before zero", "started", "velocity window",
    "open loop, bs23", "fig. 4, published, euler", "fig. 3, slipping, dp45 by step",
    "fig. 4, published, held", "open loop, t_eval", "open loop, dp45 on a grid",
    "a jump at the start and at the end", "a record with jumps", "all functions", "a function",
    "odd names", "order of actions", "held at standstill", "an infinite side",
    "divided by zero", "elasto-plastic", "rate-state-slip", "system impact", "system gear box",
    "loads", "scenario pulled_mass", "scenario servo",
)  # fmt: skip
QUICK = (  # for make quick
    "pulled mass", "open loop, rk4 by step", "ramps with jumps", "wear", "sliding", "karnopp",
    "system two blocks", "random system 3",
)  # fmt: skip


@functools.cache
def run(name: str) -> Run:
    """Return a run by its name."""
    return {**CORPUS, **FAILING}[name]()


@functools.cache
def trace(name: str, engine: str = FASTEST) -> Trace:
    """Return the trace of a run, computed once."""
    return run(name)(engine=engine)


@functools.cache
def outcome(name: str, engine: str = FASTEST) -> tuple[Trace | None, str]:
    """Return how a run ended, computed once."""
    return run(name).outcome(engine=engine)


def each(names: Iterable[str], kept: Collection[str] | None = None) -> pytest.MarkDecorator:
    """Parametrise a test by the names of runs, most of them slow; those not kept are `matrix`."""
    slow, matrix = pytest.mark.slow, pytest.mark.matrix
    values = [
        pytest.param(
            name,
            marks=[slow] * (name not in QUICK) + [matrix] * (kept is not None and name not in kept),
        )
        for name in names
    ]
    return pytest.mark.parametrize("name", values)


def in_turn(name: str) -> str:
    """Return one engine for a run, always the same: pairs, where the product would cost more."""
    return ENGINES[zlib.crc32(name.encode()) % len(ENGINES)]
