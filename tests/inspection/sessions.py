"""Sessions that several tests walk, and what their debuggers say."""

from __future__ import annotations

import io

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    Prescribed,
    Sampled,
    State,
    Stribeck,
    System,
    Transition,
)
from gms_fsm.charts import gms_element
from gms_fsm.debugger import Debugger
from gms_fsm.session.session import Session
from tests.helpers import FIG4_SINE, pulled_mass, stick_slip
from tests.systems_cases import CASES, STICTION


def fig4(t_end: float = 100.0) -> Session:
    """Fig. 4 under the published law."""
    return Session(stick_slip("published"), Prescribed(FIG4_SINE), t_end)


def pulled(t_end: float = 20.0) -> Session:
    """The mass pulled through a spring."""
    return Session(*pulled_mass(), t_end)


def both_ways() -> ChartModel:
    """Element 2 breaks away at z = 1 and is arrested there immediately, again and again."""
    law = gms_element("signed")
    edges = (
        Transition("go", "stick", "slip", guard="z >= s and v > v_c"),
        Transition("stay", "slip", "stick", guard="z >= s"),
    )
    chart = Chart(
        "broken", law.inputs, law.variables, law.parameters, law.states, edges, law.outputs
    )
    values = {"k": 1.0, "sigma": 0.1, "C": 0.1, "v_c": 1e-6}
    return ChartModel(chart, values, n=2, weights=[2.0, 1.0], stribeck=Stribeck(1.0, 1.5, 1e-3))


def warming(n: int = 1, t_end: float = 8.0) -> Session:
    """A chart of one's own, moved back and forth; w decays while the contact moves."""
    chart = Chart(
        "warming contact",
        ("v", "s"),
        ("z", "w"),
        ("k", "tau"),
        (
            State("static", {"z": "v", "w": "0"}),
            State("rising", {"z": "v", "w": "(1 - w) / tau"}),
            State("kinetic", {"z": "0", "w": "-w / tau"}),
        ),
        (
            Transition("break_away", "static", "rising", guard="abs(z) >= s"),
            Transition("let_go", "rising", "kinetic", guard="w > 0.5"),
            Transition("arrest", "kinetic", "static", guard="abs(v) <= 0.01", actions={"z": "0"}),
        ),
        {"F": "k * z"},
    )
    values = {"k": 1.0, "tau": 1.0}
    model = ChartModel(chart, values, n=n, stribeck=Stribeck(0.1, 0.2, 0.1), weights=[1.0] * n)
    return Session(model, Prescribed("0.2*sin(t)"), t_end)


def pushed(period: float | None = None) -> System:
    """A mass with stiction that a sampled controller pushes, and a GMS bank on a second mass."""
    pid = Sampled("pid", period=0.05, updates={"u": "4 * (0.5 - q1)", "count": "count + 1"})
    return System(
        "pushed mass",
        bodies=(
            Body("one", inertia="m", force="u - k * (q1 - q2)", x="q1", v="w1"),
            Body("two", inertia=2.0, force="k * (q1 - q2) + i", x="q2", v="w2"),
        ),
        contacts=(
            Contact("pad", STICTION, {"F_c": 0.2, "F_s": 0.3, "b": 0.1}, v="w1", period=period),
            Contact("bank", stick_slip("signed"), v="w2"),
        ),
        numbers={"m": 1.0, "k": 2.0},
        signals={"r": "0.1 * sin(t)"},
        flow={"i": "r - i"},
        sampled=(pid,),
    )


def a_system(t_end: float = 2.0, period: float | None = None) -> Session:
    """A session of the pushed mass."""
    return Session(pushed(period), t_end)


def locked(t_end: float = 12.0) -> Session:
    """A mass with stiction pulled through a spring."""
    return Session(CASES["pulled_mass"]().system, t_end)


def debugger(session: Session, script: str = "", title: str = "") -> Debugger:
    """Return a debugger that reads a script, and prints into a text."""
    return Debugger(session, title, io.StringIO(script), io.StringIO())
