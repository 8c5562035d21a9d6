"""Systems with bodies and contacts that several tests run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from gms_fsm import Body, Contact, System, Trace, simulate
from gms_fsm.charts import CHARTS
from tests.helpers import FASTEST

STICTION, BACKLASH = CHARTS["stiction"], CHARTS["backlash"]
END_STOP, DOG_CLUTCH = CHARTS["end-stop"], CHARTS["dog-clutch"]
PLANAR = CHARTS["planar-coulomb"]
DRY = {"F_c": 1.0, "F_s": 1.5, "b": 0.0}


@dataclass(frozen=True)
class Case:
    """A system and a run of it."""

    system: System
    t_end: float
    initial: Mapping[str, Any] = field(default_factory=dict)
    atol: float | None = None

    def run(self, engine: str = FASTEST) -> Trace:
        """Run it at rtol 1e-10."""
        return simulate(
            self.system,
            self.t_end,
            initial=dict(self.initial),
            engine=engine,
            rtol=1e-10,
            atol=self.atol,
        )


def pulled_mass() -> Case:
    """A mass with stiction, pulled through a spring: stick-slip with a closed form."""
    return Case(
        System(
            "pulled mass",
            bodies=(Body("mass", inertia="m", force="K * (V * t - x)"),),
            contacts=(Contact("pad", STICTION, DRY),),
            numbers={"m": 1.0, "K": 2.0, "V": 0.1},
        ),
        60.0,
    )


BLOCKS = {"m1": 1.0, "m2": 1.2, "k": 2.0, "k_c": 1.3, "V": 0.1}


def two_blocks() -> Case:
    """Two coupled blocks with stiction on a belt."""
    return Case(
        System(
            "two blocks on a belt",
            bodies=(
                Body("one", inertia="m1", force="-k * q1 + k_c * (q2 - q1)", x="q1", v="w1"),
                Body("two", inertia="m2", force="-k * q2 + k_c * (q1 - q2)", x="q2", v="w2"),
                Body("belt", velocity="V", x="x_b", v="w_b"),
            ),
            contacts=(
                Contact("pad1", STICTION, DRY, v="w1 - w_b"),
                Contact("pad2", STICTION, DRY, v="w2 - w_b"),
            ),
            numbers=BLOCKS,
        ),
        60.0,
        {"one.v": 0.1, "two.v": 0.1, "two.x": 0.2},
    )


PUCK = {"F_c": 1.15, "F_s": 1.3, "v_c": 1e-4}


def puck() -> Case:
    """A puck with Coulomb friction in the plane, driven along a curve."""
    return Case(
        System(
            "puck",
            bodies=(
                Body("bx", inertia="m", force="A * cos(0.2 * t)", x="qx", v="vx"),
                Body("by", inertia="m", force="A * sin(0.4 * t)", x="qy", v="vy"),
            ),
            contacts=(Contact("pad", PLANAR, PUCK, v=("vx", "vy")),),
            numbers={"m": 1.0, "A": 1.4},
        ),
        60.0,
        atol=1e-14,
    )


SERVO = {"J_m": 1e-3, "J_l": 5e-3, "k_t": 1.0, "k_p": 2.0, "k_d": 0.08, "k_i": 1.0, "tau": 2e-3}
BEARING_M = {"F_c": 0.02, "F_s": 0.03, "b": 1e-3}
BEARING_L = {"F_c": 0.1, "F_s": 0.15, "b": 5e-3}
GEAR = {"k": 200.0, "d": 0.05, "gap": 0.02}


def servo() -> Case:
    """A two-mass servo with backlash, stiction on both sides, and a smooth controller."""
    return Case(
        System(
            "two-mass servo",
            bodies=(
                Body("motor", inertia="J_m", force="k_t * i", x="q_m", v="w_m"),
                Body("load", inertia="J_l", x="q_l", v="w_l"),
            ),
            contacts=(
                Contact("bearing_m", STICTION, BEARING_M, v="w_m"),
                Contact("gear", BACKLASH, GEAR, v="w_m - w_l"),
                Contact("bearing_l", STICTION, BEARING_L, v="w_l"),
            ),
            signals={"r": "0.5 * sin(2 * t)"},
            flow={
                "i": "(k_p * (r - q_l) - k_d * w_m + k_i * integral - i) / tau",
                "integral": "r - q_l",
            },
            numbers=SERVO,
        ),
        3.0,
        atol=1e-13,
    )


BALL = {"x_s": 1.0, "e": 0.8, "v_r": 1e-3}


def ball() -> Case:
    """A ball that falls 1 m onto a stop and comes to rest."""
    return Case(
        System(
            "ball",
            bodies=(Body("ball", inertia="m", force="m * g"),),
            contacts=(Contact("floor", END_STOP, BALL),),
            numbers={"m": 2.0, "g": 9.81},
        ),
        6.0,
    )


def impact() -> Case:
    """A mass that hits another one, which is at rest."""
    return Case(
        System(
            "two masses",
            bodies=(
                Body("a", inertia="m1", x="x1", v="v1"),
                Body("b", inertia="m2", x="x2", v="v2"),
            ),
            contacts=(Contact("stop", END_STOP, {"x_s": 0.1, "e": 0.5, "v_r": 1e-6}, v="v1 - v2"),),
            numbers={"m1": 1.0, "m2": 3.0},
        ),
        1.0,
        {"a.v": 1.0},
    )


def gear_box() -> Case:
    """A dog clutch with ratio 3, closed from 0.5 s to 2 s, with a torque on one side."""
    return Case(
        System(
            "gear box",
            bodies=(
                Body("a", inertia="J1", force="M", x="q1", v="w1"),
                Body("b", inertia="J2", x="q2", v="w2"),
            ),
            contacts=(Contact("dog", DOG_CLUTCH, {"t_on": 0.5, "t_off": 2.0}, v="w1 - N * w2"),),
            numbers={"J1": 1.0, "J2": 2.0, "N": 3.0, "M": 0.5},
        ),
        3.0,
        {"a.v": 10.0},
    )


def pushed_against_a_stop(*, stop_first: bool = False) -> Case:
    """A mass with stiction that is pushed against an end stop, and pulled off again."""
    pad = Contact("pad", STICTION, DRY)
    stop = Contact("stop", END_STOP, {"x_s": 0.2, "e": 0.4, "v_r": 1e-2})
    return Case(
        System(
            "mass at a stop",
            bodies=(Body("mass", inertia="m", force="A * sin(w * t)"),),
            contacts=(stop, pad) if stop_first else (pad, stop),
            numbers={"m": 1.0, "A": 4.0, "w": 0.5},
        ),
        20.0,
        {"x": 0.1},
    )


def clutched_bearings() -> Case:
    """Two bodies with stiction each, joined by a dog clutch; a torque grows on the second."""
    return Case(
        System(
            "clutched bearings",
            bodies=(
                Body("a", inertia="J1", x="q1", v="w1"),
                Body("b", inertia="J2", force="R * t", x="q2", v="w2"),
            ),
            contacts=(
                Contact("bearing_a", STICTION, {"F_c": 1.0, "F_s": 1.5, "b": 0.2}, v="w1"),
                Contact("dog", DOG_CLUTCH, {"t_on": 1.0, "t_off": 50.0}, v="w1 - w2"),
                Contact("bearing_b", STICTION, {"F_c": 2.0, "F_s": 3.0, "b": 0.1}, v="w2"),
            ),
            numbers={"J1": 1.0, "J2": 2.0, "R": 0.5},
        ),
        12.0,
    )


# --------------------------------------------------------------------------- masses in a row
def mass(name: str, m: float, force: str = "0") -> Body:
    """A free body."""
    return Body(name, inertia=repr(m), force=force, x=f"x_{name}", v=f"v_{name}")


def pad(name: str, v: str, F_c: float, F_s: float) -> Contact:
    """Stiction."""
    return Contact(name, STICTION, {"F_c": F_c, "F_s": F_s, "b": 0.0}, v=v)


def stop(name: str, v: str, x_s: float = 0.5, e: float = 0.6, v_r: float = 1e-3) -> Contact:
    """An end stop."""
    return Contact(name, END_STOP, {"x_s": x_s, "e": e, "v_r": v_r}, v=v)


def cradle(*, pads: bool) -> Case:
    """Newton's cradle of four balls, which touch, with or without friction."""
    names = ["a", "b", "c", "d"]
    contacts = [
        stop(f"hit_{k}", f"v_{one} - v_{other}", x_s=0.0, e=0.999, v_r=1e-9)
        for k, (one, other) in enumerate(pairwise(names))
    ]
    friction = [pad(f"pad_{name}", f"v_{name}", 0.1, 0.2) for name in names]
    start = {"v_a": 1.0, "x_a": -0.1} | ({"pad_a.states": ["forward"]} if pads else {})
    bodies = [mass(name, 1.0) for name in names]
    system = System("cradle", bodies=bodies, contacts=contacts + friction * pads)
    return Case(system, 0.1006, start)


def hit() -> System:
    """A ball that hits another, which friction stops within a hundredth of a second."""
    contacts = (
        stop("hit", "v_a - v_b", x_s=0.1, e=0.5, v_r=1e-6),
        pad("pad", "v_b", 1e3, 1.5e3),
    )
    return System("hit", bodies=(mass("a", 1.0), mass("b", 3.0)), contacts=contacts)


CASES = {
    each.__name__: each
    for each in (
        pulled_mass,
        two_blocks,
        puck,
        servo,
        ball,
        impact,
        gear_box,
        pushed_against_a_stop,
        clutched_bearings,
    )
}
