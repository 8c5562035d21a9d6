"""Dahl, Bouc-Wen, the reset integrator and Maxwell-slip follow their laws to 1e-7 of their size.

All are functions of the displacement between its turning points, which are known for the motion.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import pytest

from gms_fsm import Body, Contact, Prescribed, System, Trace, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.systems.models import ChartModel
from tests.zoo.zoo_cases import BANK, CASES, DAHL, NESTED_V, RESET

Law: TypeAlias = Callable[[float, float], float]  # of a value and a displacement in one direction
BOUC_WEN = {"k": 1e5, "alpha": 0.1, "D": 1e-4, "A": 1.0, "beta": 0.7, "gamma": 0.2}


def place(t: float) -> float:
    """The displacement of the cases, m."""
    return 1e-4 * (math.sin(2 * t) + 3 * math.sin(5 * t))


def speed(t: float) -> float:
    return 1e-4 * (2 * math.cos(2 * t) + 15 * math.cos(5 * t))


def turns(t_end: float) -> list[float]:
    """Times at which the displacement turns, by bisection."""
    grid, found = np.linspace(0.0, t_end, 6001), []
    for low, high in itertools.pairwise(grid):
        if speed(low) * speed(high) < 0.0:
            for _ in range(80):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if speed(low) * speed(middle) <= 0.0 else (middle, high)
            found.append(0.5 * (low + high))
    return found


def along(times: np.ndarray, law: Law) -> np.ndarray:
    """Follow a law from turn to turn; return its values at the times."""
    ends, value, last, found = turns(6.0), 0.0, 0.0, []
    for t in times:
        while ends and ends[0] <= t:
            value, last = law(value, place(ends[0]) - last), place(ends.pop(0))
        found.append(law(value, place(t) - last))
    return np.array(found)


@functools.cache
def run(name: str, p: float = 0.0) -> Trace:
    if name != "bouc-wen":
        system = CASES[name]().system
    else:
        pad = Contact("pad", CHARTS[name], {**BOUC_WEN, "p": p})
        system = System("driven", bodies=(Body("body", velocity=NESTED_V),), contacts=(pad,))
    return simulate(system, 6.0, engine="ifelse", rtol=1e-10, t_eval=np.linspace(0.0, 6.0, 1501))


# --------------------------------------------------------------------------- the laws
def dahl(F: float, dx: float) -> float:
    """F goes to F_c sgn(dx) exponentially with the displacement since the last turn."""
    goal = math.copysign(DAHL["F_c"], dx)
    return goal - (goal - F) * math.exp(-DAHL["sigma_0"] * abs(dx) / DAHL["F_c"])


def stop(limit: float, k: float = 1.0) -> Law:
    """A stop operator."""
    return lambda F, dx: min(max(F + k * dx, -limit), limit)


def bouc_wen(p: int) -> Law:
    """dz/dx is 1 - c w^p with w = |z| / D and a constant c, between reversals and zeros of z."""
    c, back = (BOUC_WEN["beta"] + sign * BOUC_WEN["gamma"] for sign in (1, -1))
    root, root_back = math.sqrt(c), math.sqrt(back)

    def advanced(w: float, travel: float) -> float:
        if w < 0.0:  # towards zero
            needed = math.log(1.0 - back * w) / back
            value = (1.0 - (1.0 - back * w) * math.exp(-back * travel)) / back
            if p == 2:
                needed = -math.atan(root_back * w) / root_back
                value = math.tan(math.atan(root_back * w) + root_back * travel) / root_back
            return value if travel < needed else advanced(0.0, travel - needed)
        if p == 1:
            return (1.0 - (1.0 - c * w) * math.exp(-c * travel)) / c
        return math.tanh(math.atanh(root * w) + root * travel) / root

    def law(z: float, dx: float) -> float:
        sign, D = math.copysign(1.0, dx), BOUC_WEN["D"]
        return sign * D * advanced(sign * z / D, abs(dx) / D)

    return law


# Of each: the run, what follows the law in it, the law, and its size.
LAWS: dict[str, tuple[tuple[str, float], Callable[[Trace], np.ndarray], Law, float]] = {
    "dahl": (("dahl", 0.0), lambda trace: trace.F, dahl, DAHL["F_c"]),
    "reset integrator": (
        ("reset-integrator", 0.0),
        lambda trace: trace.z[:, 0],
        stop(RESET["z_0"]),
        RESET["z_0"],
    ),
    **{
        f"maxwell-slip, element {i + 1}": (
            ("maxwell-slip", 0.0),
            lambda trace, i=i: BANK["k"][i] * trace.z[:, i],
            stop(F_c, BANK["k"][i]),
            F_c,
        )
        for i, F_c in enumerate(BANK["F_c"])
    },
    **{
        f"bouc-wen, exponent {p}": (
            ("bouc-wen", float(p)),
            lambda trace: trace.z[:, 0],
            bouc_wen(p),
            BOUC_WEN["D"] * (1 / 0.9) ** (1 / p),
        )
        for p in (1, 2)
    },
}


@pytest.mark.parametrize("name", LAWS)
def test_it_follows_its_law(name: str) -> None:
    which, seen, law, size = LAWS[name]
    trace = run(*which)
    wanted = along(trace.t, law)
    assert abs(wanted).max() > 0.9 * size
    np.testing.assert_allclose(seen(trace), wanted, rtol=0, atol=1e-7 * size)


def test_the_force_of_the_reset_integrator_is_by_state() -> None:
    p, trace = RESET, run("reset-integrator")
    v = np.array([speed(t) for t in trace.t])
    stick = trace.states[:, 0] == "stick"
    assert 100 < stick.sum() < len(trace) - 100
    share, damper = np.where(stick, 1 + p["a_0"], 1.0), np.where(stick, p["sigma_1"] * v, 0.0)
    F_s = (1 + p["a_0"]) * p["sigma_0"] * p["z_0"]
    assert np.abs(trace.F - p["sigma_0"] * share * trace.z[:, 0] - damper).max() < 1e-7 * F_s
    assert trace.F.max() == pytest.approx(F_s, rel=0.05)


def test_the_force_of_bouc_wen_is_shared() -> None:
    trace, k = run("bouc-wen", 2.0), BOUC_WEN["k"]
    wanted = 0.1 * k * trace.x + 0.9 * k * trace.z[:, 0]
    np.testing.assert_allclose(trace.F, wanted, rtol=0, atol=1e-12 * k)


@pytest.mark.parametrize("p", [1.0, 1.5, 4.0])
def test_bouc_wen_saturates_where_the_docstring_says(p: float) -> None:
    model = ChartModel(CHARTS["bouc-wen"], {**BOUC_WEN, "A": 1.3, "p": p})
    trace = simulate(model, Prescribed("1e-2"), 1.0, engine="ifelse", rtol=1e-9)
    assert trace.z[-1, 0] == pytest.approx(BOUC_WEN["D"] * (1.3 / 0.9) ** (1 / p), rel=1e-6)


def test_maxwell_slip_closes_inner_loops_and_scales_branches_by_two() -> None:
    """Masing: a branch after a turn is the initial-loading curve, twice as large."""
    trace, ends = run("maxwell-slip"), turns(6.0)
    assert len(trace.transitions) > 40

    def loading(dx: float) -> float:
        pairs = zip(BANK["k"], BANK["F_c"], strict=True)
        return sum(min(k * abs(dx), F_c) for k, F_c in pairs)

    # The first turn is beyond all thresholds but that of element 4.
    rows = slice(*np.searchsorted(trace.t, ends[:2]))
    drop = [2 * loading(0.5 * (place(t) - place(ends[0]))) for t in trace.t[rows]]
    top = loading(place(ends[0]))
    assert trace.F[rows] == pytest.approx(top - np.array(drop), abs=1e-7)
