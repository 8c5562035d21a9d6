"""The seven-parameter model on a pulled mass, against an independent loop around SciPy.

At rtol 1e-10: the same sequence, and times to 1e-7 s.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import Body, Contact, System, Trace, simulate
from gms_fsm.charts import CHARTS
from tests.hybrid_reference import Modes, Switch, Way, reference

SEVEN = CHARTS["seven-parameter"]
NUMBERS = {"k_t": 2e3, "F_c": 1.0, "F_v": 0.4, "F_s": 1.5, "v_s": 0.02, "tau_L": 5e-3, "gamma": 1.0}
PULL = {"m": 1.0, "K": 2.0, "V": 0.1}
T_END = 14.0


def run(length: float = 1.0, *, engine: str = "ifelse", rtol: float = 1e-10) -> Trace:
    """Pull the mass, with all lengths multiplied."""
    values = NUMBERS | {
        "k_t": NUMBERS["k_t"] / length,
        "F_v": NUMBERS["F_v"] / length,
        "v_s": NUMBERS["v_s"] * length,
    }
    system = System(
        "pulled mass",
        bodies=(Body("mass", inertia="m", force="K * (V * t - x)"),),
        contacts=(Contact("pad", SEVEN, values),),
        numbers={"m": 1.0 / length, "K": 2.0 / length, "V": 0.1 * length},
    )
    return simulate(system, T_END, engine=engine, rtol=rtol)


def on_paper(p: dict[str, Any]) -> list[Switch]:
    """Return the switches; the state is x, v, z, v_l, f and the time of the last switch."""
    signs = {"stick": 0.0, "forward": 1.0, "backward": -1.0}

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
    return reference(flow, ways, start, ("stick",), T_END, max_step=2e-3, rtol=1e-11)[0]


@pytest.mark.slow
def test_the_switches_are_those_of_an_independent_loop() -> None:
    wanted, log = on_paper(NUMBERS), run().transitions
    assert len(wanted) == 53
    assert [(row.source, row.target) for row in log] == [(w.source, w.target) for w in wanted]
    np.testing.assert_allclose(log.t, [each.t for each in wanted], rtol=0, atol=1e-7)
