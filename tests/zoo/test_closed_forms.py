"""Dahl, the reset integrator and Maxwell-slip equal closed forms and stop operators.

All three are functions of the displacement between its turning points, which are known for the
given motion. The errors are below 1e-7 of the scale.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from gms_fsm import Trace, simulate
from tests.zoo.zoo_cases import BANK, CASES, DAHL, RESET

SMALL = 1e-7


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


def along(times: np.ndarray, branch: Callable[[float, float], float]) -> np.ndarray:
    """Follow ``branch(value, displacement)`` from turn to turn; return its values at the times."""
    ends, value, last, found = turns(6.0), 0.0, 0.0, []
    for t in times:
        while ends and ends[0] <= t:
            value, last = branch(value, place(ends[0]) - last), place(ends.pop(0))
        found.append(branch(value, place(t) - last))
    return np.array(found)


def run(name: str) -> Trace:
    case = CASES[name]()
    grid = np.linspace(0.0, case.t_end, 1501)
    return simulate(case.system, case.t_end, engine="ifelse", rtol=1e-10, t_eval=grid)


def test_dahl() -> None:
    """F goes to F_c sgn(dx) exponentially with the displacement since the last turn."""
    k, F_c = DAHL["sigma_0"], DAHL["F_c"]

    def branch(F: float, dx: float) -> float:
        goal = math.copysign(F_c, dx)
        return goal - (goal - F) * math.exp(-k * abs(dx) / F_c)

    trace = run("dahl")
    error = np.abs(trace.F - along(trace.t, branch)).max()
    assert error < SMALL * F_c


def test_reset_integrator() -> None:
    """z is a stop operator; the force is by state."""
    p = RESET

    def branch(z: float, dx: float) -> float:
        return min(max(z + dx, -p["z_0"]), p["z_0"])

    trace = run("reset-integrator")
    z, v = along(trace.t, branch), np.array([speed(t) for t in trace.t])
    stick = trace.states[:, 0] == "stick"
    assert 100 < stick.sum() < len(trace) - 100
    assert np.abs(trace.variable("z")[:, 0] - z).max() < SMALL * p["z_0"]
    F = p["sigma_0"] * np.where(stick, 1 + p["a_0"], 1.0) * z + np.where(stick, p["sigma_1"] * v, 0)
    F_s = (1 + p["a_0"]) * p["sigma_0"] * p["z_0"]
    assert np.abs(trace.F - F).max() < SMALL * F_s
    assert trace.F.max() == pytest.approx(F_s, rel=0.05)


def test_maxwell_slip() -> None:
    """Each element is a stop operator; their sum is F."""
    trace, total = run("maxwell-slip"), np.zeros(1501)
    for i, (k, F_c) in enumerate(zip(BANK["k"], BANK["F_c"], strict=True)):
        own = along(trace.t, lambda F, dx, k=k, F_c=F_c: min(max(F + k * dx, -F_c), F_c))
        assert np.abs(k * trace.variable("z")[:, i] - own).max() < SMALL * F_c
        total += own
    assert np.abs(trace.F - total).max() < SMALL
    assert len(trace.transitions) > 40


def test_maxwell_slip_closes_inner_loops_and_scales_branches_by_two() -> None:
    """Masing: a branch after a turn is the initial-loading curve, twice as large."""
    trace, ends = run("maxwell-slip"), turns(6.0)

    def loading(dx: float) -> float:
        pairs = zip(BANK["k"], BANK["F_c"], strict=True)
        return sum(min(k * abs(dx), F_c) for k, F_c in pairs)

    first = np.searchsorted(trace.t, ends[0])
    last = np.searchsorted(trace.t, ends[1])
    rows = slice(first, last)  # the first turn is beyond all thresholds but that of element 4
    drop = [2 * loading(0.5 * (place(t) - place(ends[0]))) for t in trace.t[rows]]
    top = loading(place(ends[0]))
    assert trace.F[rows] == pytest.approx(top - np.array(drop), abs=SMALL)
