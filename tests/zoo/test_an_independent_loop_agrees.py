"""Karnopp, Modelica's modes and the elasto-plastic model against SciPy, one arc after another.

The loop (`tests.hybrid_reference`) and the equations are written by hand. At rtol 1e-10 the
sequence is the same, and times agree to 1e-7 s.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gms_fsm import Trace
from tests.hybrid_reference import Modes, Switch, Way, reference
from tests.zoo.zoo_cases import CURVE, ELASTO, KARNOPP, MODELICA, elasto_plastic, karnopp, modelica

TIMES = 1e-7  # s
ROUNDING = 1e-11  # N: an edge is not taken at the very point where the one back was
SMALLER = 1e-15  # m, and m^2/s


def agree(trace: Trace, wanted: list[Switch]) -> None:
    """Assert the same switches in the same order, and equal times."""
    log = trace.transitions
    got = list(zip(log.source.tolist(), log.target.tolist(), strict=True))
    assert got == [(each.source, each.target) for each in wanted]
    np.testing.assert_allclose(log.t, [each.t for each in wanted], rtol=0, atol=TIMES)


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


def test_karnopp() -> None:
    wanted = karnopp_on_paper()
    assert {each.target for each in wanted} == {
        "stuck",
        "start_forward",
        "start_backward",
        "forward",
        "backward",
    }
    trace = karnopp().run("ifelse")
    agree(trace, wanted)
    assert set(trace.v[trace.states[:, 0] == "stuck"].tolist()) == {0.0}


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


def test_modelica() -> None:
    wanted = modelica_on_paper()
    assert {each.target for each in wanted} == {"stuck", "forward", "backward", "free"}
    log = modelica().run("ifelse").transitions
    start = np.char.startswith(log.source.astype(str), "start_")
    assert start.sum() > 5
    assert (np.diff(log.t)[np.flatnonzero(start) - 1] < 1e-9).all()  # over at once
    kept = log[~start]
    got = [(each.source, each.target.removeprefix("start_")) for each in kept]
    assert got == [(each.source, each.target) for each in wanted]
    np.testing.assert_allclose(kept.t, [each.t for each in wanted], rtol=0, atol=TIMES)


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


def test_elasto_plastic() -> None:
    wanted = elasto_plastic_on_paper()
    assert {each.target for each in wanted} == {"elastic", "mixed", "plastic"}
    agree(elasto_plastic().run("ifelse"), wanted)
