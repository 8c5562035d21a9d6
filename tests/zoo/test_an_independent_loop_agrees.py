"""What switches, and when, is that of SciPy between switches found by a loop of our own.

The loop (`tests.hybrid_reference`) and the equations are written by hand. At rtol 1e-10 the
sequence is the same, and times agree to 1e-7 s.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gms_fsm import Body, Contact, System, Trace, simulate
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts import CHARTS
from tests.hybrid_reference import Modes, Switch, Way, reference
from tests.systems_cases import PUCK, puck
from tests.zoo.zoo_cases import CURVE, ELASTO, KARNOPP, MODELICA, elasto_plastic, karnopp, modelica

TIMES = 1e-7  # s
ROUNDING = 1e-11  # N: an edge is not taken at the very point where the one back was
SMALLER = 1e-15  # m, and m^2/s


def side(mode: str) -> float:
    return 1.0 if mode.endswith("forward") else -1.0


def at_rest(_: float, y: Any) -> Any:
    return [y[0], 0.0]


# --------------------------------------------------------------------------- Karnopp
def karnopp_on_paper() -> list[Switch]:
    p = KARNOPP

    def load(t: float) -> float:
        return 2.5 * math.sin(3 * t) * math.sin(0.37 * t)

    def flow(modes: Modes) -> Any:
        def rates(t: float, y: Any) -> list[float]:
            if modes == ("stuck",):
                return [0.0, 0.0]
            starts = modes[0].startswith("start")
            friction = side(modes[0]) * p["F_s" if starts else "F_c"]
            viscous = 0.0 if starts else p["sigma_2"] * y[1]
            return [y[1], load(t) - friction - viscous]

        return rates

    def at_the_rim(_: float, y: Any) -> Any:
        return [y[0], math.copysign(p["D"], y[1])]

    def ways(modes: Modes) -> list[Way]:
        mode = modes[0]
        if mode == "stuck":
            return [
                Way(0, "start_forward", lambda t, _: load(t) - p["F_s"]),
                Way(0, "start_backward", lambda t, _: -load(t) - p["F_s"]),
            ]
        s = side(mode)
        if mode.startswith("start"):
            return [
                Way(0, "stuck", lambda t, _: p["F_s"] - s * load(t) - ROUNDING, at_rest),
                Way(0, mode.removeprefix("start_"), lambda _, y: s * y[1] - p["D"], at_the_rim),
            ]
        return [Way(0, "stuck", lambda _, y: p["D"] - s * y[1], at_rest)]

    return reference(flow, ways, [0.0, 0.0], ("stuck",), 20.0)[0]


# --------------------------------------------------------------------------- Modelica
def modelica_on_paper() -> list[Switch]:
    """Without the start modes, which last for no time."""
    p = MODELICA

    def load(t: float) -> float:
        return 2.5 * math.sin(3 * t)

    def normal(t: float) -> float:
        return 2 + 2.6 * math.sin(0.7 * t)

    def flow(modes: Modes) -> Any:
        def rates(t: float, y: Any) -> list[float]:
            if modes == ("stuck",):
                return [0.0, 0.0]
            if modes == ("free",):
                return [y[1], load(t)]
            fall = math.exp(-((abs(y[1]) / p["v_s"]) ** p["delta"]))
            mu = p["mu_c"] + (p["mu_s"] - p["mu_c"]) * fall
            friction = side(modes[0]) * mu * normal(t) + p["sigma_2"] * y[1]
            return [y[1], load(t) - friction]

        return rates

    def ways(modes: Modes) -> list[Way]:
        lift = Way(0, "free", lambda t, _: -normal(t))
        if modes == ("stuck",):
            limit = p["peak"] * p["mu_s"]
            return [
                lift,
                Way(0, "forward", lambda t, _: load(t) - limit * normal(t)),
                Way(0, "backward", lambda t, _: -load(t) - limit * normal(t)),
            ]
        if modes == ("free",):
            return [
                Way(0, "forward", lambda t, y: min(normal(t) - ROUNDING, y[1])),
                Way(0, "backward", lambda t, y: min(normal(t) - ROUNDING, -y[1])),
            ]
        return [lift, Way(0, "stuck", lambda _, y: -side(modes[0]) * y[1], at_rest)]

    return reference(flow, ways, [0.0, 0.0], ("stuck",), 20.0)[0]


# --------------------------------------------------------------------------- elasto-plastic
def elasto_plastic_on_paper() -> list[Switch]:
    p, (F_c, F_s, v_s) = ELASTO, CURVE

    def v(t: float) -> float:
        return 0.06 * math.cos(2 * t)

    def limit(t: float) -> float:
        return (F_c + (F_s - F_c) * math.exp(-((v(t) / v_s) ** 2))) / p["sigma_0"]

    def flow(modes: Modes) -> Any:
        def rates(t: float, y: Any) -> list[float]:
            z_ss, z_ba = limit(t), p["z_ba"]
            phase = (abs(y[0]) - 0.5 * (z_ss + z_ba)) / (z_ss - z_ba)
            alpha = {
                "elastic": 0.0,
                "mixed": 0.5 * (1.0 + math.sin(math.pi * phase)),
                "plastic": 1.0,
            }[modes[0]]
            return [v(t) * (1.0 - alpha * math.copysign(1.0, v(t)) * y[0] / z_ss)]

        return rates

    def ways(modes: Modes) -> list[Way]:
        turn = Way(0, "elastic", lambda t, y: -v(t) * y[0])
        past = lambda t, y, way: abs(y[0]) - p["z_ba"] - way * (limit(t) - p["z_ba"])  # noqa: E731
        beyond = lambda t, y: min(past(t, y, 0.9999), v(t) * y[0] - SMALLER)  # noqa: E731
        bent = lambda t, y: min(abs(y[0]) - p["z_ba"], v(t) * y[0] - SMALLER)  # noqa: E731
        return {
            "elastic": [Way(0, "mixed", bent)],
            "mixed": [Way(0, "plastic", beyond), turn],
            "plastic": [turn, Way(0, "mixed", lambda t, y: -past(t, y, 0.9998) - SMALLER)],
        }[modes[0]]

    return reference(flow, ways, [0.0], ("elastic",), 6.0, max_step=1e-3)[0]


# --------------------------------------------------------------------------- a puck in the plane
def puck_on_paper() -> list[Switch]:
    A, F_c, F_s, e = 1.4, PUCK["F_c"], PUCK["F_s"], PUCK["v_c"]

    def push(t: float) -> tuple[float, float]:
        return A * math.cos(0.2 * t), A * math.sin(0.4 * t)

    def flow(modes: Modes) -> Any:
        def rates(t: float, y: Any) -> list[float]:
            if modes == ("stuck",):
                return [0.0] * 6
            h, g = y[4:6]
            if modes == ("slip",):
                speed = math.hypot(y[2], y[3])
                h, g = y[2] / speed, y[3] / speed
            f, q = push(t)
            return [y[2], y[3], f - F_c * h, q - F_c * g, 0.0, 0.0]

        return rates

    def direction(t: float, y: Any) -> list[float]:
        size = math.hypot(*push(t))
        return [*y[:4], *(each / size for each in push(t))]

    def ways(modes: Modes) -> list[Way]:
        speed = lambda y: math.hypot(y[2], y[3])  # noqa: E731
        return {
            "stuck": [Way(0, "start", lambda t, _: math.hypot(*push(t)) - F_s, direction)],
            "start": [Way(0, "slip", lambda _, y: speed(y) - e)],
            "slip": [
                Way(
                    0, "stuck", lambda _, y: 0.5 * e - speed(y), lambda _, y: [*y[:2], 0, 0, *y[4:]]
                )
            ],
        }[modes[0]]

    return reference(flow, ways, [0.0] * 6, ("stuck",), 60.0, max_step=0.01)[0]


# --------------------------------------------------------------------------- seven parameters
NUMBERS = {"k_t": 2e3, "F_c": 1.0, "F_v": 0.4, "F_s": 1.5, "v_s": 0.02, "tau_L": 5e-3, "gamma": 1.0}
PULL = {"m": 1.0, "K": 2.0, "V": 0.1}


def seven_parameter() -> Trace:
    """Pull a mass."""
    system = System(
        "pulled mass",
        bodies=(Body("mass", inertia="m", force="K * (V * t - x)"),),
        contacts=(Contact("pad", CHARTS["seven-parameter"], NUMBERS),),
        numbers=PULL,
    )
    return simulate(system, 14.0, engine="ifelse", rtol=1e-10)


def seven_parameter_on_paper() -> list[Switch]:
    """Return the switches; the state is x, v, z, v_l, f and the time of the last switch."""
    p, signs = NUMBERS, {"stick": 0.0, "forward": 1.0, "backward": -1.0}

    def curve(y: Any) -> float:
        return float(y[4] / (1.0 + (y[3] / p["v_s"]) ** 2))

    def risen(t: float, y: Any) -> float:
        rest = t - y[5]
        return float(y[4] + (p["F_s"] - p["F_c"] - y[4]) * rest / (rest + p["gamma"]))

    def flow(modes: Modes) -> Any:
        sign = signs[modes[0]]

        def rates(t: float, y: Any) -> list[float]:
            x, v, z, v_l = y[:4]
            dry = sign * (p["F_c"] + curve(y)) if sign else p["k_t"] * z
            pull = PULL["K"] * (PULL["V"] * t - x)
            rate = (pull - dry - p["F_v"] * v) / PULL["m"]
            return [v, rate, 0.0 if sign else v, (v - v_l) / p["tau_L"], 0.0, 0.0]

        return rates

    def ways(modes: Modes) -> list[Way]:
        sign = signs[modes[0]]
        if sign:

            def rest(t: float, y: Any) -> list[float]:
                return [y[0], 0.0, sign * (p["F_c"] + curve(y)) / p["k_t"], y[3], curve(y), t]

            return [Way(0, "stick", lambda _, y: -sign * y[1], rest)]

        def leave(target: str, s: float) -> Way:
            def far(t: float, y: Any) -> float:
                return float(min(s * p["k_t"] * y[2] - p["F_c"] - risen(t, y), s * y[1]))

            return Way(0, target, far, lambda t, y: [*y[:4], risen(t, y), t])

        return [leave("forward", 1.0), leave("backward", -1.0)]

    start = [0.0] * 6
    return reference(flow, ways, start, ("stick",), 14.0, max_step=2e-3, rtol=1e-11)[0]


# --------------------------------------------------------------------------- scenarios/drill_string
J_T, J_B, K, C, C_R, C_B, U = 2122.0, 471.9698, 861.5336, 172.3067, 425.0, 50.0, 5800.0
W, R_B, MU_C, MU_S, GAMMA = 50000.0, 0.155575, 0.5, 0.8, 0.9
SIGNS = {"stuck": 0.0, "forward": 1.0, "backward": -1.0}


def drill_string() -> Trace:
    """Run the scenario."""
    loaded = load_scenario("drill_string", ["run.rtol=1e-10"])
    return loaded.simulate(engine="ifelse")


def drill_string_on_paper() -> list[Switch]:
    """Return the switches; the state is the twist and both speeds."""

    def load(y: Any) -> float:
        return float(C * (y[1] - y[2]) + K * y[0] - C_B * y[2])

    def flow(modes: Modes) -> Any:
        sign = SIGNS[modes[0]]

        def rates(_: float, y: Any) -> list[float]:
            twist, w_t, w_b = y
            rock = W * R_B * (MU_C + (MU_S - MU_C) * math.exp(-GAMMA * abs(w_b)))
            table = (U - C_R * w_t - C * (w_t - w_b) - K * twist) / J_T
            return [w_t - w_b, table, (load(y) - sign * rock) / J_B if sign else 0.0]

        return rates

    def ways(modes: Modes) -> list[Way]:
        sign = SIGNS[modes[0]]
        if sign:
            return [Way(0, "stuck", lambda _, y: -sign * y[2], lambda _, y: [y[0], y[1], 0.0])]
        limit = W * R_B * MU_S
        return [
            Way(0, "forward", lambda _, y: load(y) - limit),
            Way(0, "backward", lambda _, y: -load(y) - limit),
        ]

    return reference(flow, ways, [0.0] * 3, ("stuck",), 60.0)[0]


# --------------------------------------------------------------------------- all of them
# Of each: what runs, the same on paper, and the number of switches on paper.
LOOPS: dict[str, tuple[Callable[[], Trace], Callable[[], list[Switch]], int]] = {
    "karnopp": (lambda: karnopp().run("ifelse"), karnopp_on_paper, 29),
    "modelica": (lambda: modelica().run("ifelse"), modelica_on_paper, 24),
    "elasto-plastic": (lambda: elasto_plastic().run("ifelse"), elasto_plastic_on_paper, 16),
    "puck": (lambda: puck().run("ifelse"), puck_on_paper, 14),
    "seven parameters": (seven_parameter, seven_parameter_on_paper, 53),
    "drill string": (drill_string, drill_string_on_paper, 25),
}


@pytest.mark.every(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", LOOPS)
def test_the_switches_are_those_on_paper(name: str) -> None:
    """Modelica's start modes, which are over at once, are not on paper."""
    run, on_paper, count = LOOPS[name]
    trace, wanted = run(), on_paper()
    assert len(wanted) == count
    log = trace.transitions
    if name == "modelica":
        start = np.char.startswith(log.source.astype(str), "start_")
        assert start.sum() > 5
        assert (np.diff(log.t)[np.flatnonzero(start) - 1] < 1e-9).all()
        log = log[~start]
    target = [each.removeprefix("start_" if name == "modelica" else "-") for each in log.target]
    got = [*zip(log.source.tolist(), target, strict=True)]
    assert got == [(each.source, each.target) for each in wanted]
    np.testing.assert_allclose(log.t, [each.t for each in wanted], rtol=0, atol=TIMES)
    stuck = trace.states[:, 0] == "stuck"
    assert name not in ("karnopp", "puck") or set(trace.v[stuck].tolist()) == {0.0}
