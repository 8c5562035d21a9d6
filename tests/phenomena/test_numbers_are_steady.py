"""Claim: the third digit of a number does not depend on the tolerance or on the scale of forces."""

from __future__ import annotations

import dataclasses

import pytest

from gms_fsm import LuGre, Stribeck, measure_phenomena
from gms_fsm.phenomena.measure import Bench
from tests.phenomena.cases import BENCH, known

pytestmark = pytest.mark.slow


def test_a_finer_tolerance_changes_nothing() -> None:
    for cell in measure_phenomena(["lugre", "stiction"], bench=Bench(rtol=1e-10)):
        one, other = known().cell(cell.model, cell.phenomenon.name), cell.measured
        assert one.verdict == other.verdict
        for a, b in zip(one.numbers, other.numbers, strict=True):
            where = f"{cell.model}, {cell.phenomenon.name}, {a.name}"
            assert a.value == pytest.approx(b.value, rel=2e-3, abs=1e-4), where


def test_forces_eight_times_as_large_show_the_same() -> None:
    forces = ("F_c", "F_s", "sigma_0", "sigma_1", "sigma_2", "mass", "stiffness")
    bench = dataclasses.replace(BENCH, **{name: 8 * getattr(BENCH, name) for name in forces})
    curve = Stribeck(bench.F_c, bench.F_s, bench.v_s)
    numbers = {name: getattr(bench, name) for name in ("sigma_0", "sigma_1", "sigma_2")}
    for cell in measure_phenomena({"lugre": LuGre(**numbers, stribeck=curve)}, bench=bench):
        one, other = known().cell("lugre", cell.phenomenon.name), cell.measured
        assert one.verdict == other.verdict
        for a, b in zip(one.numbers, other.numbers, strict=True):
            factor = 8.0 if a.unit in ("N", "mN", "mJ", "µJ") else 1.0
            assert factor * a.value == pytest.approx(b.value, rel=2e-3, abs=1e-3)
