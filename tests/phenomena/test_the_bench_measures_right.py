"""Claim: what the bench measures is right: closed forms, an independent run, steady digits.

Stiction breaks away at F_s at all rates, and sticks and slips with the period and the amplitude of
the closed form; steady friction is the Stribeck curve; the loops of Maxwell elements close.
"""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gms_fsm import LuGre, PhenomenaTable, Prescribed, Stribeck, measure_phenomena, simulate
from gms_fsm.phenomena.measure import Bench
from tests.phenomena.cases import BENCH, CURVE, DRY, MAXWELL, known

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def table() -> PhenomenaTable:
    return measure_phenomena({"dry": DRY}, ["break-away", "vibration", "stick-slip"])


def test_break_away_at_F_s(table: PhenomenaTable) -> None:
    found = table.cell("dry", "break-away")
    forces = [each.value for each in found.numbers if "break-away force at" in each.name]
    assert len(forces) == 6
    assert forces == pytest.approx([1.5] * 6, rel=1e-9)
    assert found.verdict == "does not show"


def test_period_and_amplitude(table: PhenomenaTable) -> None:
    K, V, m, drop = BENCH.stiffness, BENCH.speed, BENCH.mass, BENCH.F_s - BENCH.F_c
    w = math.sqrt(K / m)
    slip = 2 / w * (math.pi - math.atan(drop * w / (K * V)))
    stick = 2 * drop / (K * V)
    found = table.cell("dry", "stick-slip")
    assert found.verdict == "shows"
    assert found.number("period") == pytest.approx(slip + stick, rel=1e-4)
    assert found.number("amplitude of the spring force") == pytest.approx(
        math.hypot(drop, K * V / w), rel=1e-4
    )
    # Slow motion at the ends of the slip counts as stick: a little more than the closed form.
    share = found.number("share of the period in stick")
    assert stick / (slip + stick) < share < stick / (slip + stick) + 0.02


def test_vibration_releases_it_at_its_break_away_force(table: PhenomenaTable) -> None:
    found = table.cell("dry", "vibration")
    assert found.verdict == "shows"
    assert found.numbers[0].value == pytest.approx(1.0, abs=0.02)


def test_steady_friction_is_the_stribeck_curve() -> None:
    for model in ("lugre", "gms-signed"):
        (curve,) = known().cell(model, "stribeck").curves
        v = 1e-3 * curve.x
        assert v[0] == pytest.approx(1e-5, rel=1e-3)
        assert v[-1] == pytest.approx(0.1, rel=1e-3)
        assert np.abs(curve.y - CURVE(v) - BENCH.sigma_2 * v).max() < 1e-5


def test_the_drift_of_lugre_is_that_of_scipy() -> None:
    table = known()
    force = table.cell("lugre", "break-away").number("break-away force at 0.1 N/s")

    def flow(t, y):
        _, v, z = y
        ramp = np.interp(t, (0.0, 2.0, 4.0), (0.0, 0.6 * force, 0.3 * force))
        push = ramp + (0.1 * force * math.sin(4 * math.pi * (t - 4.0)) if t > 4.0 else 0.0)
        s = 1.0 + 0.5 * math.exp(-((v / 1e-3) ** 2))
        dz = v - BENCH.sigma_0 * abs(v) * z / s
        friction = BENCH.sigma_0 * z + BENCH.sigma_1 * dz + BENCH.sigma_2 * v
        return [v, push - friction, dz]

    # Points of equal phase: the drift per period does not depend on the phase.
    times = 4.0 + 0.5 * np.array([10.0, 20.0])
    run = solve_ivp(
        flow, (0.0, 14.0), [0.0, 0.0, 0.0], "LSODA", times, rtol=1e-9, atol=1e-13, max_step=0.01
    )
    drift = 1e6 * (run.y[0, 1] - run.y[0, 0]) / 10.0
    measured = table.cell("lugre", "drift").number("drift per period")
    assert measured == pytest.approx(drift, rel=0.01)
    assert drift > 1.0  # µm


def test_loops_of_maxwell_elements_close_on_the_bench() -> None:
    maxwell = measure_phenomena({"maxwell": MAXWELL}, ["memory"]).cell("maxwell", "memory")
    lugre = known().cell("lugre", "memory")
    assert maxwell.verdict == "shows"
    assert maxwell.number("gap of the inner loops over their stroke") < 0.05  # %
    assert lugre.number("gap of the inner loops over their stroke") > 10.0


def test_in_prescribed_motion_to_rounding() -> None:
    stops = np.array([0.0, 40e-6, 5e-6, 30e-6, 5e-6, 40e-6])  # m
    velocity, t = [], 0.0
    for one, after in itertools.pairwise(stops.tolist()):
        velocity += [(t, np.sign(after - one) * 1e-5)]
        t += abs(after - one) / 1e-5
        velocity += [(t, np.sign(after - one) * 1e-5)]
    ends = np.cumsum(np.abs(np.diff(stops)) / 1e-5)
    trace = simulate(
        MAXWELL, Prescribed(velocity), float(ends[-1]), t_eval=ends, engine="ifelse", rtol=1e-10
    )
    top, bottom, _, bottom_again, top_again = trace.F.tolist()
    assert len(trace.transitions) > 6  # elements do yield, and turn, on the way
    assert bottom_again == pytest.approx(bottom, abs=1e-9)
    assert top_again == pytest.approx(top, abs=1e-9)


def compared(table: PhenomenaTable, factor: float = 1.0) -> None:
    """Assert that numbers are those known, forces times a factor."""
    for cell in table:
        one, other = known().cell(cell.model, cell.phenomenon.name), cell.measured
        assert one.verdict == other.verdict
        for a, b in zip(one.numbers, other.numbers, strict=True):
            scale = factor if a.unit in ("N", "mN", "mJ", "µJ") else 1.0
            where = f"{cell.model}, {cell.phenomenon.name}, {a.name}"
            assert scale * a.value == pytest.approx(b.value, rel=2e-3, abs=1e-3), where


@pytest.mark.matrix
def test_a_finer_tolerance_changes_nothing() -> None:
    compared(measure_phenomena(["lugre", "stiction"], bench=Bench(rtol=2e-10)))


@pytest.mark.matrix
def test_forces_eight_times_as_large_show_the_same() -> None:
    forces = ("F_c", "F_s", "sigma_0", "sigma_1", "sigma_2", "mass", "stiffness")
    bench = dataclasses.replace(BENCH, **{name: 8 * getattr(BENCH, name) for name in forces})
    curve = Stribeck(bench.F_c, bench.F_s, bench.v_s)
    numbers = {name: getattr(bench, name) for name in ("sigma_0", "sigma_1", "sigma_2")}
    compared(measure_phenomena({"lugre": LuGre(**numbers, stribeck=curve)}, bench=bench), 8.0)
