"""The cases: where each comes from, its equations by hand, and its closed form.

The equations are those of `automata.py`; the system that gms-fsm reads is the file of the same name
in `cases`. `references.py` computes from this what is expected there.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from benchmarks.conformance.automata import (
    LOCKED,
    Contact,
    Edge,
    Mechanism,
    backlash,
    dog_clutch,
    element,
    end_stop,
    more,
    stiction,
)

HERE = Path(__file__).parent / "cases"
FLOATS = SimpleNamespace(mpf=float, pi=math.pi, small=1e-10, zero=1e-13)
Expected = Mapping[str, Any]


@dataclass(frozen=True)
class Case:
    """A case.

    Parameters
    ----------
    title, source : str
        What it asks, and where it comes from.
    t_end : float
        s.
    build : callable, optional
        ``build(numbers)`` returns its equations.
    closed : callable, optional
        ``closed(mpmath)`` returns exact values: ``t0, t1 ...`` of switches, end states by name.
    formula : str
        The closed form in words.
    initial : mapping
        Where it starts, for gms-fsm; all else at 0.
    refused : str
        Why there is no answer; one of `run.REASONS`.
    mass : mapping
        By body, where the momentum stays the same.
    logged : bool
        Whether the switches are compared; not where the motion has more than one right log.
    plain : callable, optional
        ``plain(t, y)`` for a solver without any events, from ``start``.
    start : mapping
        Initial state of `plain` by name.
    tolerance : mapping
        Of times, and of end states.
    """

    title: str
    source: str
    t_end: float
    build: Callable[[Any], Mechanism] | None = None
    closed: Callable[[Any], Expected] | None = None
    formula: str = ""
    initial: Mapping[str, Any] = field(default_factory=dict)
    refused: str = ""
    mass: Mapping[str, float] = field(default_factory=dict)
    logged: bool = True
    plain: Callable[[float, Any], Sequence[float]] | None = None
    start: Mapping[str, float] = field(default_factory=dict)
    tolerance: Mapping[str, float] = field(default_factory=lambda: {"t": 1e-6, "end": 1e-6})


def wave(rate: Any, s: str = "_s", c: str = "_c") -> dict[str, dict[str, Any]]:
    """Return further states that are sin and cos of rate * t; the second starts at 1."""
    return {s: {c: rate}, c: {s: -rate}}


CASES: dict[str, Case] = {}


# --------------------------------------------------------------------------- locks and impacts
def _thrown(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"mass": (N(1), {})},
        [
            end_stop("stop", {"mass": 1}, N("0.5"), N("0.6"), N("1e-3")),
            stiction("pad", {"mass": 1}, N("0.01"), N("0.01")),
        ],
        start={"v_mass": N(1), "pad": "forward"},
        numbers=n,
    )


def _thrown_closed(m: Any) -> Expected:
    v = m.sqrt(m.mpf("0.99"))
    hit = (1 - v) * 100
    return {"t0": hit, "t1": hit, "t2": hit + 60 * v, "mass.x": m.mpf("-17.32"), "mass.v": 0}


CASES["lock-swallows-momentum"] = Case(
    "A mass on stiction strikes an end stop and slides back",
    "gms-fsm: the lock of the pad took the momentum after the impact",
    70.0,
    _thrown,
    _thrown_closed,
    "uniform deceleration: v^2 = 1 - 2 (0.01)(0.5) at the stop, 0.6 of v after it",
    {"mass.v": 1.0, "pad.states": ["forward"]},
)


def _microscopic(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"a": (N(1), {}), "b": (N(1), {})},
        [
            end_stop("stop", {"a": 1, "b": -1}, N(0), N("0.6"), N("1e-3")),
            stiction("pad", {"b": 1}, N("2e-6"), N("2e-6")),
        ],
        start={"v_a": N(1), "x_a": N("-0.5")},
        numbers=n,
    )


CASES["microscopic-pad"] = Case(
    "A body on a pad of 2 micronewton is struck",
    "gms-fsm: the pad held the body like a wall",
    2.0,
    _microscopic,
    lambda m: {
        "t0": m.mpf("0.5"),
        "t1": m.mpf("0.5"),
        "a.v": m.mpf("0.2"),
        "b.v": m.mpf("0.8") - m.mpf("3e-6"),
        "b.x": m.mpf("1.2") - m.mpf("2.25e-6"),
    },
    "0.2 and 0.8 after the impact with e = 0.6; then the pad brakes with 2e-6",
    {"a.v": 1.0, "a.x": -0.5},
)


def _cradle(n: Any) -> Mechanism:
    N, balls = n.mpf, [f"b{i}" for i in range(1, 6)]
    stops = [
        end_stop(f"c{i}", {a: 1, b: -1}, N(0), N(1)) for i, (a, b) in enumerate(pairwise(balls), 1)
    ]
    return Mechanism(
        {ball: (N(1), {}) for ball in balls},
        [*stops, end_stop("wall", {"b5": 1}, N("0.5"), N(1))],
        start={"x_b1": N(-1), "v_b1": N(1)},
        numbers=n,
    )


CASES["newtons-cradle"] = Case(
    "Newton's cradle: five balls that touch, a wall behind the last one",
    "textbook; impacts one after the other (see Brogliato, Nonsmooth Mechanics)",
    3.0,
    _cradle,
    lambda m: {
        **{f"t{i}": [1, 1, 1, 1, m.mpf("1.5"), 2, 2, 2, 2][i] for i in range(9)},
        "b1.x": -1,
        "b1.v": -1,
        "b3.v": 0,
        "b5.x": 0,
        "b5.v": 0,
    },
    "one ball in, one ball out; at 2 s it is back",
    {"b1.x": -1.0, "b1.v": 1.0},
)


def _cradle_on_pads(n: Any) -> Mechanism:
    N, balls = n.mpf, ["b1", "b2", "b3"]
    return Mechanism(
        {ball: (N(1), {}) for ball in balls},
        [
            *(stiction(f"p{ball[1]}", {ball: 1}, N("0.1"), N("0.1")) for ball in balls),
            end_stop("c1", {"b1": 1, "b2": -1}, N(0), N(1)),
            end_stop("c2", {"b2": 1, "b3": -1}, N(0), N(1)),
        ],
        start={"x_b1": N(-1), "v_b1": N(1), "p1": "forward"},
        numbers=n,
    )


CASES["cradle-on-pads"] = Case(
    "Newton's cradle whose balls stick on pads",
    "as above, with friction; numbers chosen by us",
    12.0,
    _cradle_on_pads,
    lambda m: {
        **{f"t{i}": 10 - m.sqrt(80) for i in range(6)},
        "t6": m.mpf(10),
        "b2.v": 0,
        "b3.x": 4,
        "b3.v": 0,
    },
    "the last ball leaves with v^2 = 1 - 2 (0.1)(1), the others stop at once",
    {"b1.x": -1.0, "b1.v": 1.0, "p1.states": ["forward"]},
)


def _carries(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"a": (N(1), {}), "b": (N(1), {}), "c": (N(2), {})},
        [
            end_stop("stop", {"a": 1, "b": -1}, N(0), N("0.5"), N("1e-3")),
            dog_clutch("clutch", {"b": 1, "c": -1}, N(0), N(2)),
        ],
        start={"x_a": N(-1), "v_a": N(1), "clutch": "engaged"},
        numbers=n,
    )


CASES["clutch-carries-impulse"] = Case(
    "An engaged dog clutch passes an impact on",
    "chosen by us",
    3.0,
    _carries,
    lambda m: {
        "t0": 1,
        "t1": 2,
        "a.v": m.mpf("-0.125"),
        "b.v": m.mpf("0.375"),
        "c.x": m.mpf("0.75"),
    },
    "1 kg strikes 1 + 2 kg with e = 0.5",
    {"a.x": -1.0, "a.v": 1.0, "clutch.states": ["engaged"]},
    mass={"a": 1.0, "b": 1.0, "c": 2.0},
)


def _rest(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"a": (N(2), {}), "b": (N(1), {"1": N(1)}), "d": (N(2), {})},
        [
            end_stop("stop", {"b": 1}, N(0), N("0.5"), N("1e-3")),
            end_stop("hit", {"a": 1, "b": -1}, N(0), N("0.5"), N("1e-3")),
            end_stop("yank", {"b": 1, "d": -1}, N(0), N("0.5"), N("1e-3")),
        ],
        start={"x_a": N(-1), "v_a": N(1), "x_d": N(2), "v_d": N(-1), "stop": "rest"},
        numbers=n,
    )


CASES["rest-carries-a-push"] = Case(
    "A body pressed against a stop is struck from one side and then from the other",
    "chosen by us",
    2.9,
    _rest,
    lambda m: {
        "t0": 1,
        "t1": 2,
        "t2": 2,
        "a.v": m.mpf("-0.5"),
        "b.v": m.mpf("-0.1"),
        "b.x": m.mpf("-0.495"),
        "d.v": m.mpf("-0.5"),
    },
    "against the stop b is a wall; away from it b leaves with -(2/3)(1.5)",
    {"a.x": -1.0, "a.v": 1.0, "d.x": 2.0, "d.v": -1.0, "stop.states": ["rest"]},
)


def _ball(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"ball": (N(2), {"1": 2 * N("9.81")})},
        [end_stop("floor", {"ball": 1}, N(1), N("0.8"), N("1e-3"))],
        numbers=n,
    )


def _ball_closed(m: Any) -> Expected:
    g, v = m.mpf("9.81"), m.sqrt(2 * m.mpf("9.81"))
    times = [v / g]
    while v > m.mpf("1e-3"):
        v *= m.mpf("0.8")
        times.append(times[-1] + 2 * v / g)
    return {**{f"t{i}": t for i, t in enumerate(times)}, "ball.x": 1, "ball.v": 0, "floor.F": 2 * g}


CASES["ball-with-rest"] = Case(
    "A ball bounces ever lower and comes to rest",
    "textbook",
    5.0,
    _ball,
    _ball_closed,
    "intervals 2 v e^k / g until v e^k is below the rest speed",
)


def _ball_without_rest(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"ball": (N(2), {"1": 2 * N("9.81")})},
        [end_stop("floor", {"ball": 1}, N(1), N("0.8"))],
        numbers=n,
    )


CASES["zeno-ball"] = Case(
    "A ball without a state of rest",
    "textbook (Zeno)",
    5.0,
    _ball_without_rest,
    formula="infinitely many impacts before sqrt(2/g) (1 + e)/(1 - e) = 4.06 s",
    refused="zeno",
)


def _rattle(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"mass": (N(1), {"1": N(1)})},
        [
            end_stop("right", {"mass": 1}, N("0.1"), N("0.5")),
            end_stop("left", {"mass": -1}, N("0.1"), N("0.5")),
        ],
        start={"v_mass": N(-1)},
        numbers=n,
    )


CASES["zeno-backlash"] = Case(
    "Rigid backlash under a constant load",
    "chosen by us (Zeno)",
    5.0,
    _rattle,
    formula="after the last impact on the left, impacts on the right at intervals that halve",
    initial={"mass.v": -1.0},
    refused="zeno",
)


def _rocking(n: Any) -> Mechanism:
    N = n.mpf
    p2, edge, r = N(4), N("0.2"), N("0.9")
    foot = Contact(
        "foot",
        {"block": 1},
        {"right": {"x": -p2, "1": p2 * edge}, "left": {"x": -p2, "1": -p2 * edge}},
        (
            Edge("right", "rock_left", "left", [more("-x", strict=False), more("-v")], back=-r),
            Edge("left", "rock_right", "right", [more("x", strict=False), more("v")], back=-r),
        ),
    )
    return Mechanism({"block": (N(1), {})}, [foot], start={"x_block": N("0.1")}, numbers=n)


def _rocking_closed(m: Any) -> Expected:
    edge, height = m.mpf("0.2"), m.mpf("0.1")
    times = [m.acosh(1 / (1 - height / edge)) / 2]
    while times[-1] < 6:
        energy = m.mpf("0.81") * height * (2 * edge - height)
        height = edge - m.sqrt(edge**2 - energy)
        times.append(times[-1] + m.acosh(1 / (1 - height / edge)))
    return {f"t{i}": t for i, t in enumerate(times[:-1])}


CASES["rocking"] = Case(
    "A block rocks on its two edges",
    "Housner (1963), linearised; numbers chosen by us",
    6.0,
    _rocking,
    _rocking_closed,
    "quarter periods acosh(1/(1 - x/alpha))/p, the energy of each half is r^2 of the one before",
    {"block.x": 0.1},
)


def _gear_box(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"a": (N(1), {"1": N("0.5")}), "b": (N(2), {})},
        [dog_clutch("clutch", {"a": 1, "b": -3}, N("0.5"), N("1.5"))],
        start={"v_a": N(10)},
        numbers=n,
    )


CASES["dog-clutch"] = Case(
    "A dog clutch engages a gear of ratio 3",
    "after Benveniste et al. (2019); numbers chosen by us",
    2.0,
    _gear_box,
    lambda m: {
        "t0": m.mpf("0.5"),
        "t1": m.mpf("1.5"),
        "b.v": 3 * m.mpf("10.25") / 11 + m.mpf("1.5") / 11,
        "a.v": 3 * (3 * m.mpf("10.25") / 11 + m.mpf("1.5") / 11) + m.mpf("0.25"),
    },
    "the impulse keeps 3 J_a w_a + J_b w_b",
    {"a.v": 10.0},
)


def _window(n: Any) -> Mechanism:
    N = n.mpf
    window = [more("-v", -N("0.1"))]
    pad = Contact(
        "pad",
        {"mass": 1},
        {"stuck": LOCKED, "forward": {"1": N(1)}},
        [Edge("forward", "enter_forward", "stuck", window, takes=True)],
    )
    return Mechanism(
        {"mass": (N(1), {})}, [pad], start={"v_mass": N(1), "pad": "forward"}, numbers=n
    )


CASES["karnopp-window"] = Case(
    "Karnopp's window takes the momentum that is left on purpose",
    "Karnopp (1985), with a wide window; numbers chosen by us",
    2.0,
    _window,
    lambda m: {"t0": m.mpf("0.9"), "mass.x": m.mpf("0.495"), "mass.v": 0},
    "uniform deceleration from 1 to D = 0.1",
    {"mass.v": 1.0, "pad.states": ["forward"]},
)


def _valve(n: Any) -> Mechanism:
    N = n.mpf
    area, spring, preload = N("7.373657906574696e-5"), N("1488.578099595049"), N("8.54503372291542")
    force = {"1": 6895 * 18 * area - preload, "_s": 6895 * 4 * area, "x_valve": -spring}
    return Mechanism(
        {"valve": (N("0.0003361185937456267"), force)},
        [
            stiction("seal", {"valve": 1}, N(1), N(1)),
            end_stop("right", {"valve": 1}, N("0.001016"), N("0.3"), N(1) / 300),
            end_stop("left", {"valve": -1}, N(0), N("0.3"), N(1) / 300),
        ],
        flow=wave(500 * n.pi),
        start={"_c": N(1)},
        numbers=n,
    )


CASES["stick-slip-valve"] = Case(
    "A valve on a seal between two stops, under a pulsating pressure",
    "after SciML/OrdinaryDiffEq.jl #3222, its numbers; from t = 0, held by the seal, to 12 ms",
    0.012,
    _valve,
    tolerance={"t": 1e-8, "end": 1e-6},
)


# --------------------------------------------------------------------------- locks that share
def _chain(n: Any) -> Mechanism:
    N, names = n.mpf, ("v0", "v1", "v2")
    rows = [{"v0": 1}, {"v1": 1, "v0": -1}, {"v2": 1, "v1": -1}]
    pads = [stiction(f"p{i}", row, N(1), N("1.5")) for i, row in enumerate(rows)]
    masses = zip(names, ("0.7", "2.3", "1.1"), strict=True)
    return Mechanism(
        {body: (N(m), {"t": N(3)}) for body, m in masses},
        [*pads, end_stop("stop", rows[1], N("0.5"), N("0.6"), N("1e-3"))],
        numbers=n,
    )


CASES["three-stuck-bodies"] = Case(
    "Three bodies stuck on each other under growing forces",
    "gms-fsm: the run stood still at 1e-123 s",
    0.5,
    _chain,
    lambda m: {"t0": m.mpf(1) / 6, "v2.v": m.mpf(2) / 3 / m.mpf("4.1")},
    "all move as one after 9 t = 1.5: v = (4.5 (t^2 - 1/36) - (t - 1/6))/4.1",
)


def _gears_at_rest(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"v0": (N("0.4"), {"x_v0": N(-20)}), "v1": (N("4.77"), {"_s": N(1)})},
        [
            stiction("gear", {"v1": 1, "v0": -3}, N(4), N(5)),
            stiction("clutch", {"v1": 1, "v0": -1}, N(4), N(5)),
        ],
        flow=wave(N(1)),
        start={"_c": N(1)},
        numbers=n,
    )


CASES["gears-at-rest"] = Case(
    "Two gears on the same two bodies hold both",
    "gms-fsm: the run stood still",
    10.0,
    _gears_at_rest,
    lambda m: {"v0.v": 0, "v1.v": 0, "gear.F": -m.sin(10) / 2, "clutch.F": 3 * m.sin(10) / 2},
    "two locks, two bodies: nothing moves; the forces are -sin(t)/2 and 3 sin(t)/2",
)


def _geared(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {
            "a": (N(1), {"_s": N(3)}),
            "b": (N("0.5"), {"x_b": N("-0.5")}),
            "c": (N("0.8"), {"_c2": N("0.2")}),
        },
        [
            stiction("brake", {"a": 1}, N(1), N("1.5")),
            stiction("gear", {"b": 1, "a": -2}, N("0.8"), N("0.8")),
            stiction("belt", {"c": 1, "b": N("0.5")}, N("0.4"), N("0.4")),
        ],
        flow=wave(N(1)) | wave(N(2), "_s2", "_c2"),
        start={"_c": N(1), "_c2": N(1)},
        numbers=n,
    )


CASES["geared-locks"] = Case(
    "A brake and two slipping gears on three bodies",
    "gms-fsm: releases and arrests at one instant were logged that do not happen",
    10.0,
    _geared,
)


def _ladder(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"a": (N(1), {}), "b": (N(1), {}), "c": (N(1), {}), "d": (N(1), {"t": N(1)})},
        [
            stiction("brake", {"a": 1}, N(1), N("1.5")),
            stiction("g1", {"b": 1, "a": -2}, N(50), N(50)),
            stiction("g2", {"c": 1, "b": -2}, N(50), N(50)),
            stiction("g3", {"d": 1, "c": N("-0.5")}, N(50), N(50)),
        ],
        numbers=n,
    )


CASES["gear-ladder"] = Case(
    "A ramp releases four geared bodies at one instant, as one body",
    "gms-fsm: releases and arrests at one instant were logged that do not happen",
    3.0,
    _ladder,
    lambda m: {
        "t0": m.mpf("0.75"),
        "a.v": m.mpf("0.2475"),
        "b.v": m.mpf("0.495"),
        "c.v": m.mpf("0.99"),
    },
    "one body of 1 + 4 + 16 + 4 kg: v = (t^2 - t + 0.1875)/25",
)


def _belt(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"slider": (N(1), {})},
        [stiction("pad", {"slider": 1, "belt": -1}, N("0.5"), N("0.7"))],
        driven={"belt": [(0, N(0)), (N(1), N("0.1")), (N("1.3"), N(-1)), (N(3), N(-1))]},
        numbers=n,
    )


CASES["belt-with-reversals"] = Case(
    "A slider on a belt that reverses",
    "gms-fsm: release, arrest, release were logged where one release is right; 1 kg",
    4.0,
    _belt,
    lambda m: {"t0": 1, "t1": m.mpf("3.2"), "slider.x": m.mpf("-1.74"), "slider.v": -1},
    "follows the belt, then -0.5 m/s2 until it has the belt's speed",
)


def _jerked(n: Any) -> Mechanism:
    N = n.mpf
    line = [(0, N("0.1")), (N(1), N("0.1")), (N(1), N("-0.5")), (N(5), N("-0.5"))]
    return Mechanism(
        {"slider": (N(1), {})},
        [stiction("pad", {"slider": 1, "belt": -1}, N("0.5"), N("0.7"))],
        driven={"belt": line},
        start={"v_slider": N("0.1")},
        numbers=n,
    )


CASES["belt-that-jumps"] = Case(
    "The velocity of a belt jumps under a slider that is stuck on it",
    "chosen by us",
    3.0,
    _jerked,
    lambda m: {"t0": 1, "t1": m.mpf("2.2"), "slider.v": m.mpf("-0.5"), "slider.x": m.mpf("-0.54")},
    "released at the jump, -0.5 m/s2 for 1.2 s",
    {"slider.v": 0.1},
)

CASES["friction-on-a-prescribed-motion"] = Case(
    "Friction with a stuck mode on a shaft whose motion is prescribed",
    "after modelica/ModelicaStandardLibrary #4129 and #4272 (Inertial stuck); cos(t)",
    5.0,
    formula="no force can hold a prescribed motion, so that there is no stuck mode",
    refused="driven",
)


CASES["inertial-stuck"] = Case(
    "A bearing on a piston that follows a prescribed crank",
    "after modelica/ModelicaStandardLibrary #4272 (Inertial stuck), which gives no numbers; cos(t)",
    3.0,
    closed=lambda m: {
        "piston.x": m.sin(3),
        "piston.v": m.cos(3),
        "bearing.F": -1,
        "rod.F": m.sin(3) + 1,
    },
    formula="x = sin(t); the bearing never holds: its force changes from 1 to -1 at pi/2",
    initial={"piston.v": 1.0, "bearing.states": ["forward"]},
    logged=False,
)


# --------------------------------------------------------------------------- stick-slip and control
def _pulled(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"mass": (N(1), {"t": N("0.2"), "x_mass": N(-2)})},
        [stiction("pad", {"mass": 1}, N(1), N("1.5"))],
        numbers=n,
    )


def _pulled_closed(m: Any) -> Expected:
    w = m.sqrt(2)
    slip = 2 / w * (m.pi - m.atan(m.mpf("0.25") * w / m.mpf("0.1")))
    times = [m.mpf("7.5")]
    while times[-1] < 30:
        times.append(times[-1] + (slip if len(times) % 2 else 5))
    return {f"t{i}": t for i, t in enumerate(times[:-1])}


CASES["pulled-mass"] = Case(
    "Stick-slip of a mass pulled through a spring",
    "textbook",
    30.0,
    _pulled,
    _pulled_closed,
    "stick 2 (F_s - F_c)/(K V), slip 2/w (pi - atan((F_s - F_c) w/(K V)))",
)


def _hunting(n: Any) -> Mechanism:
    N = n.mpf
    force = {"x_mass": N(-3), "v_mass": N(-6), "I": N(-4), "1": N(3)}
    return Mechanism(
        {"mass": (N(1), force)},
        [stiction("pad", {"mass": 1}, N(1), N("1.5"))],
        flow={"I": {"x_mass": N(1), "1": N(-1)}},
        numbers=n,
    )


CASES["hunting-pid"] = Case(
    "A PID controller hunts around its reference",
    "gains after Canudas de Wit, Olsson, Astrom and Lischinsky (1995); friction chosen by us",
    60.0,
    _hunting,
)


def _backlash(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"a": (N(1), {}), "b": (N(3), {})},
        [backlash("gap", {"a": 1, "b": -1}, N(100), N(0), N("0.1"))],
        start={"v_a": N(1)},
        numbers=n,
    )


def _backlash_closed(m: Any) -> Expected:
    touch, flight = m.pi / m.sqrt(100 / m.mpf("0.75")), m.mpf("0.2")
    times = [m.mpf("0.1")]
    while times[-1] < 2:
        times.append(times[-1] + (touch if len(times) % 2 else flight))
    return {f"t{i}": t for i, t in enumerate(times[:-1])}


CASES["backlash-impacts"] = Case(
    "Two masses with backlash between elastic flanks",
    "textbook",
    2.0,
    _backlash,
    _backlash_closed,
    "half sine waves of pi/sqrt(k/mu) on a flank, 0.2 s across the gap",
    {"a.v": 1.0},
    mass={"a": 1.0, "b": 3.0},
)


def _tie(n: Any) -> Mechanism:
    N = n.mpf
    numbers = [(100, "1"), (100, "1"), (100, "1"), (50, "0.5"), (200, "2")]
    bank = [element("bank", i, {"slide": 1}, N(k), N(F)) for i, (k, F) in enumerate(numbers, 1)]
    line = [(0, N("0.1")), (N(1), N("0.1")), (N(2), N("-0.1")), (N(3), N("-0.1"))]
    return Mechanism({}, bank, driven={"slide": line}, numbers=n)


CASES["tie-of-elements"] = Case(
    "Five elements break away, turn and break away again together",
    "chosen by us",
    3.0,
    _tie,
    lambda m: {
        **{
            f"t{i}": [m.mpf("0.1"), m.mpf("1.5"), m.mpf("1.5") + m.sqrt(m.mpf("0.2"))][i // 5]
            for i in range(15)
        },
        "bank.F": m.mpf("-5.5"),
        "bank.z_4": m.mpf("-0.01"),
    },
    "z = 0.1 t up to 0.01; back by 0.02 = 0.1 (t - 1.5)^2",
)


def _corners(n: Any) -> Mechanism:
    N = n.mpf
    corners = [(0, "0"), (1, "1.5"), (2, "1"), (3, "1.5625"), (4, "-1.5625"), (5, "0")]
    return Mechanism(
        {"mass": (N(1), {"u": N(1)})},
        [stiction("pad", {"mass": 1}, N(1), N("1.5"))],
        signals={"u": [(N(t), N(u)) for t, u in corners]},
        numbers=n,
    )


CASES["corners"] = Case(
    "A load whose corner touches the break-away force, and another that passes it",
    "chosen by us",
    6.0,
    _corners,
    lambda m: {"t0": 2 + m.mpf("0.5") / m.mpf("0.5625")},
    "at t = 1 the load is F_s and does not exceed it; it does at 2 + 0.5/0.5625",
)

PULSES = [(2, 3), (70, -3)]  # s, N
WIDTH = "0.001"


def _pulses(n: Any) -> Mechanism:
    N, line = n.mpf, [(n.mpf(0), n.mpf(0))]
    for t, top in PULSES:
        line += [(t - N(WIDTH), N(0)), (N(t), N(top)), (t + N(WIDTH), N(0))]
    return Mechanism(
        {"mass": (N("0.01"), {"u": N(1)})},
        [stiction("pad", {"mass": 1}, N("0.5"), N(1))],
        signals={"u": line},
        numbers=n,
        known=False,
    )


CASES["pulses"] = Case(
    "Two pulses of 2 ms in 100 s, written as a formula",
    "chosen by us",
    100.0,
    _pulses,
    lambda m: {"t0": 2 - m.mpf(2) / 3000, "t2": 70 - m.mpf(2) / 3000},
    "released where 3 (1 - |t - 2|/0.001) = F_s = 1",
)


def _record(n: Any) -> Mechanism:
    N = n.mpf
    table = tomllib.loads((HERE / "record.toml").read_text(encoding="utf-8"))["signals"]["load"]
    line = zip(table["times"], table["values"], strict=True)
    return Mechanism(
        {"mass": (N(1), {"load": N(1)})},
        [stiction("pad", {"mass": 1}, N(1), N("1.5"))],
        signals={"load": [(N(str(t)), N(str(u))) for t, u in line]},
        numbers=n,
    )


CASES["record"] = Case(
    "A measured load of 41 rows", "made with random numbers, three digits each", 10.0, _record
)

CASES["rates"] = Case(
    "Samplers of 50 us, 0.5 ms and 3.3 ms: the slow ones read the fast one",
    "gms-fsm: some slow ticks read a value one fast tick old",
    0.04001,
    closed=lambda m: {
        "fast_count": m.mpf(801),
        "wrong_1": m.mpf(0),
        "wrong_2": m.mpf(0),
        "count_1": m.mpf(81),
        "count_2": m.mpf(13),
    },
    formula="ticks 10 and 66 of the fast one; listed first, it ticks first",
)


# --------------------------------------------------------------------------- sliding modes
def _coulomb(n: Any) -> Mechanism:
    N = n.mpf
    return Mechanism(
        {"mass": (N(1), {"_s": N(2)})},
        [stiction("pad", {"mass": 1}, N(1), N(1))],
        flow=wave(N(1)),
        start={"_c": N(1)},
        numbers=n,
    )


def _signed(v: float) -> float:
    return math.copysign(1.0, v) if v else 0.0


CASES["sliding-in-and-out"] = Case(
    "Coulomb friction F_c sgn(v) under a sine: at rest the motion slides along v = 0",
    "textbook (Filippov); the reference is stiction with F_s = F_c",
    10.0,
    _coulomb,
    plain=lambda t, y: [y[1], 2.0 * math.sin(t) - _signed(y[1])],
    start={"mass.x": 0.0, "mass.v": 0.0},
)

CASES["repelling-sliding"] = Case(
    "Negative friction at v = 0: both directions and rest are solutions",
    "Filippov (1988): repelling sliding",
    1.0,
    formula="v = 0.5 t, v = -0.5 t and v = 0 all satisfy the equations",
    refused="not unique",
    plain=lambda t, y: [y[1], 0.5 * _signed(y[1])],
    start={"mass.x": 0.0, "mass.v": 0.0},
)


def _two_states(n: Any) -> Mechanism:
    N = n.mpf
    above = {"p": {"1": N(-2)}, "q": {"1": N("1.5")}}
    below = {"p": {"1": N(2)}, "q": {"1": N(-3)}}
    plane = Contact(
        "plane",
        {"slide": 1},
        {"above": {}, "below": {}},
        (
            Edge("above", "fall", "below", [({"q": 1, "p": -1}, True)]),
            Edge("below", "rise", "above", [({"p": 1, "q": -1}, True)]),
        ),
        rates={"above": above, "below": below},
    )
    line = [(0, N(0)), (N(1), N(0))]
    return Mechanism(
        {}, [plane], driven={"slide": line}, start={"p": N("1.5"), "q": N(1)}, numbers=n
    )


def _on_the_plane(m: Any) -> Expected:
    return {"plane.p": m.mpf(31) / 34, "plane.q": m.mpf(31) / 34}


_TEST1 = "p = q is reached at 1/7 s at 17/14; with 10 parts of 17 above, both fall at 6/17"
CASES["chattering-between-states"] = Case(
    "Two states whose flows push back across p = q",
    "OpenModelica/OpenModelica #12190, Test1",
    1.0,
    _two_states,
    _on_the_plane,
    _TEST1,
    {"plane.p": [1.5], "plane.q": [1.0]},
    logged=False,
)
CASES["chattering-with-sgn"] = Case(
    "The same written with sgn",
    "OpenModelica/OpenModelica #12190, Test1",
    1.0,
    closed=_on_the_plane,
    formula=_TEST1,
    initial={"plane.p": [1.5], "plane.q": [1.0]},
    plain=lambda t, y: [
        -2.0 * _signed(y[0] - y[1]),
        -0.75 + 2.25 * _signed(y[0] - y[1]),
    ],
    start={"plane.p": 1.5, "plane.q": 1.0},
)


def _both(n: Any) -> Mechanism:
    N = n.mpf
    pad = Contact(
        "pad",
        {"mass": 1},
        {"one": {}, "other": {}},
        (
            Edge("one", "over", "other", [more("v", strict=False)]),
            Edge("other", "back", "one", [more("-v", strict=False)]),
        ),
    )
    return Mechanism({"mass": (N(1), {})}, [pad], numbers=n)


CASES["guards-that-hold-together"] = Case(
    "Two opposite guards hold at one instant",
    "chosen by us",
    1.0,
    _both,
    formula="v >= 0 and v <= 0 both hold at v = 0",
    refused="livelock",
)
