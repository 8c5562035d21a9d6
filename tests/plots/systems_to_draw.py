"""Charts and systems that the tests of pictures draw."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from gms_fsm import (
    GMS,
    GMSParameters,
    Prescribed,
    PulledSlider,
    Slider,
    Stribeck,
    simulate,
)
from gms_fsm.app.scenario import load_scenario, load_system
from gms_fsm.charts import CHARTS
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.systems.system import Body, Contact, Sampled, Spring, System, system_of
from gms_fsm.traces.trace import Trace

STICTION, END_STOP = CHARTS["stiction"], CHARTS["end-stop"]
BACKLASH, PLANAR = CHARTS["backlash"], CHARTS["planar-coulomb"]
TIMED = Chart(
    "Timed rest",
    parameters=("T_d", "F_c", "F_s"),
    states=(
        State("stuck", locked=True),
        State("slip", outputs={"F": "F_c * sgn(v)"}),
        State("rest", outputs={"F": "0"}),
    ),
    transitions=(
        Transition("fail", ("stuck", "slip"), "rest", guard="F > 2 * F_s"),
        Transition("release", "stuck", "slip", guard="F > F_s and after(T_d)"),
        Transition("arrest", "slip", "stuck", guard="v < 0"),
        Transition("on", "rest", "slip", guard="True"),
    ),
)
SHARED = Chart(
    "Spring with a limit",
    inputs=("v",),
    variables=("z",),
    parameters=("k", "F_c", Parameter("b", "Ns/m", ">= 0", per_element=False)),
    let={"limit": "F_c / k", "far": "abs(z) / limit"},
    states=(State("stick", flow={"z": "v"}), State("slip")),
    transitions=(
        Transition("go", "stick", "slip", guard="far > 1 and v * z > 0"),
        Transition("stop", "slip", "stick", guard="v * z <= 0"),
    ),
    outputs={"F": "k * z"},
    contact_outputs={"F": "F + b * v"},
)
DRY = {"F_c": 1.0, "F_s": 1.5, "b": 0.0}

GMS12 = GMS(  # more elements than are drawn one by one
    GMSParameters(
        np.linspace(0.5, 1.5, 12),
        np.full(12, 0.1),
        np.full(12, 1.0),
        sigma_2=0.4,
        stribeck=Stribeck(1.0, 1.5, 0.1),
        v_c=1e-6,
        weights=np.linspace(0.05, 0.2, 12),
    ),
    law="signed",
)

PULLED = System(
    "pulled mass",
    bodies=(Body("mass", inertia="m"),),
    springs=(Spring("pulled", "mass", k="K", rest="V * t"),),
    contacts=(Contact("pad", STICTION, DRY),),
    numbers={"m": 1.0, "K": 2.0, "V": 0.1},
)
BALL = System(
    "ball",
    bodies=(Body("ball", inertia="m", force="m * g"),),
    contacts=(Contact("floor", END_STOP, {"x_s": 1.0, "e": 0.5, "v_r": 1e-2}),),
    numbers={"m": 2.0, "g": 9.81},
)
BLOCKS = System(
    "two blocks on a belt",
    bodies=(
        Body("one", inertia="m", force="-k * q1 + k_c * (q2 - q1)", x="q1", v="w1"),
        Body("two", inertia="m", force="-k * q2 + k_c * (q1 - q2)", x="q2", v="w2"),
        Body("belt", velocity="V", x="x_b", v="w_b"),
    ),
    contacts=(
        Contact("pad1", STICTION, DRY, v="w1 - w_b"),
        Contact("pad2", STICTION, DRY, v="w2 - w_b"),
    ),
    numbers={"m": 1.0, "k": 2.0, "k_c": 1.3, "V": 0.1},
)
SERVO = System(
    "two-mass servo",
    bodies=(
        Body("motor", inertia="J_m", force="k_t * i", x="q_m", v="w_m", rotary=True),
        Body("load", inertia="J_l", x="q_l", v="w_l", rotary=True),
    ),
    contacts=(
        Contact("bearing", STICTION, DRY, v="w_m"),
        Contact("gear", BACKLASH, {"k": 200.0, "d": 0.05, "gap": 0.02}, v="w_m - 3 * w_l"),
    ),
    signals={"r": "0.5 * sin(2 * t)"},
    flow={"i": "(u - i) / tau"},
    sampled=(
        Sampled(
            "pid",
            period=1e-3,
            updates={"u": "k_p * (r - q_m) + I", "I": "I + k_i * period * (r - q_m)"},
        ),
    ),
    numbers={"J_m": 1e-3, "J_l": 5e-3, "k_t": 1.0, "k_p": 2.0, "k_i": 1.0, "tau": 2e-3},
)


SCENARIOS = Path(__file__).parents[2] / "gms_fsm" / "scenarios"

NUMBERS = dict.fromkeys(("m", "k", "k_c", "k_l", "P", "w", "d", "J", "r", "k_f"), 1.0)
TRAIN = System(
    "a train of four",
    bodies=(
        Body(
            "one",
            inertia="m",
            force="P * sin(w * t)",
            x="x_1",
            v="v_1",
        ),
        Body("two", inertia="m", x="x_2", v="v_2"),
        Body("three", inertia="m + J/r**2", x="x_3", v="v_3"),
        Body("four", inertia="m", force="-k_f*x_1", x="x_4", v="v_4"),
    ),
    springs=(
        Spring("left", "one", k="k"),
        Spring("near", "one", "two", k="k_c"),
        Spring("far", "one", "four", k="k_l"),
        Spring("oil", "two", "three", d="0.5 * d"),
        Spring("below", "three", k="k", rest="0.5 * r"),
    ),
    contacts=(
        Contact("slip", STICTION, DRY, v="v_2 - v_3"),
        Contact("dog", CHARTS["dog-clutch"], {"t_on": 1.0, "t_off": 2.0}, v="v_3 - v_4"),
        Contact("pads", STICTION, DRY, v="v_1"),
        Contact("differential", STICTION, DRY, v="v_1 + v_2 - v_4"),
    ),
    numbers=NUMBERS,
)
PLANE = System(
    "a puck",
    bodies=(Body("east", inertia=1.0), Body("north", inertia=1.0, x="y", v="w")),
    contacts=(Contact("floor", PLANAR, dict.fromkeys(PLANAR.parameter_names, 1.0), v=("v", "w")),),
)
RIGS = (Prescribed("0.1*sin(t)"), Slider(1.0, "0.3*t"), PulledSlider(1.0, 2.0, 0.1))


@cache
def systems() -> dict[str, System]:
    """Return the scenarios without a measured record, the rigs, and the systems of the tests."""
    found = {each.name: each for each in (PULLED, BALL, SERVO, TRAIN, PLANE)}
    found |= {rig.title: system_of(GMS12, rig) for rig in RIGS}
    for path in sorted(SCENARIOS.glob("*.toml")):
        text = path.read_text(encoding="utf-8")
        if "[record]" in text:
            continue
        if "[model]" in text and "[[body]]" not in text:
            loaded = load_scenario(path)
            found[path.stem] = system_of(loaded.model, loaded.rig)
        else:
            found[path.stem] = load_system(path)
    return found


@cache
def run(system: System) -> Trace:
    """Return a run of PULLED, BALL or BLOCKS that has switches."""
    initial = {"one.v": 0.1, "w2": 0.1, "q2": 0.2} if system is BLOCKS else {}
    return simulate(system, 3.0 if system is BALL else 10.0, initial=initial)
