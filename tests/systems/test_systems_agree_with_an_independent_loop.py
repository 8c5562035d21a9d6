"""Systems switch in the same order and at the same times as an independent loop around SciPy.

The loop (`tests.hybrid_reference`) and the equations of each case are written by hand.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from gms_fsm import Trace
from tests.hybrid_reference import Modes, Switch, Way, reference
from tests.systems_cases import (
    BEARING_L,
    BEARING_M,
    BLOCKS,
    DRY,
    GEAR,
    PUCK,
    SERVO,
    puck,
    servo,
    two_blocks,
)

TIMES = 1e-7  # s


def agree(trace: Trace, names: Sequence[str], wanted: list[Switch]) -> None:
    """Assert the same switches in the same order, and equal times."""
    log = trace.transitions
    got = [(names.index(str(row.contact)), str(row.source), str(row.target)) for row in log]
    assert len(got) == len(wanted)
    assert got == [(each.contact, each.source, each.target) for each in wanted]
    np.testing.assert_allclose(log.t, [each.t for each in wanted], rtol=0, atol=TIMES)


def sign(mode: str) -> float:
    return {"forward": 1.0, "backward": -1.0, "stuck": 0.0}[mode]


# --------------------------------------------------------------------------- two blocks on a belt
def blocks() -> list[Switch]:
    p, F_c, F_s = BLOCKS, DRY["F_c"], DRY["F_s"]
    masses = p["m1"], p["m2"]

    def load(i: int, y: Any) -> float:
        one, other = y[2 * i], y[2 - 2 * i]
        return float(-p["k"] * one + p["k_c"] * (other - one))

    def flow(modes: Modes) -> Any:
        def rates(_: float, y: Any) -> list[float]:
            found = []
            for i, mode in enumerate(modes):
                moves = (load(i, y) - sign(mode) * F_c) / masses[i]
                found += [y[2 * i + 1], 0.0 if mode == "stuck" else moves]
            return found

        return rates

    def ways(modes: Modes) -> list[Way]:
        found = []
        for i, mode in enumerate(modes):

            def with_the_belt(_: float, y: Any, i: int = i) -> Any:
                return [*y[: 2 * i + 1], p["V"], *y[2 * i + 2 :]]

            if mode == "stuck":
                found.append(Way(i, "forward", lambda _, y, i=i: load(i, y) - F_s))
                found.append(Way(i, "backward", lambda _, y, i=i: -load(i, y) - F_s))
            else:
                found.append(
                    Way(
                        i,
                        "stuck",
                        lambda _, y, i=i, mode=mode: -sign(mode) * (y[2 * i + 1] - p["V"]),
                        with_the_belt,
                    )
                )
        return found

    return reference(flow, ways, [0.0, p["V"], 0.2, p["V"]], ("stuck", "stuck"), 60.0)[0]


@pytest.mark.slow
def test_two_blocks_on_a_belt() -> None:
    wanted = blocks()
    assert len(wanted) > 40
    assert {each.contact for each in wanted} == {0, 1}
    agree(two_blocks().run(), ("pad1", "pad2"), wanted)


# --------------------------------------------------------------------------- a puck in the plane
def puck_on_paper() -> list[Switch]:
    A, F_c, F_s, e = 1.4, PUCK["F_c"], PUCK["F_s"], PUCK["e"]

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


@pytest.mark.slow
def test_coulomb_friction_in_the_plane() -> None:
    wanted = puck_on_paper()
    assert sum(each.target == "stuck" for each in wanted) >= 4
    agree(puck().run(), ("pad",), wanted)


# --------------------------------------------------------------------------- two-mass servo
def servo_on_paper(t_end: float) -> list[Switch]:
    p = SERVO

    def gear(mode: str, y: Any) -> float:
        x, v = y[0] - y[2], y[1] - y[3]
        if mode == "apart":
            return 0.0
        edge = GEAR["gap"] if mode == "right" else -GEAR["gap"]
        return float(GEAR["k"] * (x - edge) + GEAR["d"] * v)

    def loads(mode: str, y: Any) -> tuple[float, float]:
        return float(p["k_t"] * y[4] - gear(mode, y)), gear(mode, y)

    def flow(modes: Modes) -> Any:
        def rates(t: float, y: Any) -> list[float]:
            found, r = [], 0.5 * math.sin(2 * t)
            for load, mode, v, bearing, J in zip(
                loads(modes[1], y),
                (modes[0], modes[2]),
                (y[1], y[3]),
                (BEARING_M, BEARING_L),
                (p["J_m"], p["J_l"]),
                strict=True,
            ):
                moves = (load - sign(mode) * bearing["F_c"] - bearing["b"] * v) / J
                found += [v, 0.0 if mode == "stuck" else moves]
            voltage = p["k_p"] * (r - y[2]) - p["k_d"] * y[1] + p["k_i"] * y[5]
            return [*found, (voltage - y[4]) / p["tau"], r - y[2]]

        return rates

    def ways(modes: Modes) -> list[Way]:
        found, mesh = [], modes[1]
        for i, (contact, bearing) in enumerate(((0, BEARING_M), (2, BEARING_L))):
            mode, place = modes[contact], 2 * i + 1

            def stopped(_: float, y: Any, place: int = place) -> Any:
                return [*y[:place], 0.0, *y[place + 1 :]]

            if mode == "stuck":
                for target, s in (("forward", 1.0), ("backward", -1.0)):
                    found.append(
                        Way(
                            contact,
                            target,
                            lambda _, y, i=i, s=s, F_s=bearing["F_s"]: s * loads(mesh, y)[i] - F_s,
                        )
                    )
            else:
                found.append(
                    Way(
                        contact,
                        "stuck",
                        lambda _, y, place=place, mode=mode: -sign(mode) * y[place],
                        stopped,
                    )
                )
        if mesh == "apart":
            for target, s in (("right", 1.0), ("left", -1.0)):

                def closed(_: float, y: Any, s: float = s) -> float:
                    return float(min(s * (y[0] - y[2]) - GEAR["gap"], s * (y[1] - y[3])))

                found.append(Way(1, target, closed))
        else:
            s = 1.0 if mesh == "right" else -1.0
            found.append(Way(1, "apart", lambda _, y: -s * gear(mesh, y)))
        return sorted(found, key=lambda way: way.contact)

    start = ("stuck", "apart", "stuck")
    return reference(flow, ways, [0.0] * 6, start, t_end, max_step=2e-3)[0]


@pytest.mark.slow
def test_a_two_mass_servo_without_sampling() -> None:
    wanted = servo_on_paper(3.0)
    assert {each.contact for each in wanted} == {0, 1, 2}
    agree(servo().run(), ("bearing_m", "gear", "bearing_l"), wanted)
