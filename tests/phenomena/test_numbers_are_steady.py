"""Claim: the third digit of a number does not depend on the tolerance or on the scale of forces."""

from __future__ import annotations

import dataclasses

import pytest

from gms_fsm import LuGre, Stribeck, measure_phenomena
from gms_fsm.phenomena.measure import Bench
from tests.phenomena.cases import BENCH

pytestmark = pytest.mark.slow


def test_a_finer_tolerance_changes_nothing() -> None:
    models = ["lugre", "gms-signed", "stiction"]
    usual, finer = measure_phenomena(models), measure_phenomena(models, bench=Bench(rtol=1e-10))
    for one, other in zip(usual, finer, strict=True):
        assert one.measured.verdict == other.measured.verdict
        for a, b in zip(one.measured.numbers, other.measured.numbers, strict=True):
            where = f"{one.model}, {one.phenomenon.name}, {a.name}"
            assert a.value == pytest.approx(b.value, rel=2e-3, abs=1e-4), where


def test_forces_eight_times_as_large_show_the_same() -> None:
    forces = ("F_c", "F_s", "sigma_0", "sigma_1", "sigma_2", "mass", "stiffness")
    large = dataclasses.replace(BENCH, **{name: 8 * getattr(BENCH, name) for name in forces})
    tables = []
    for bench in (BENCH, large):
        curve = Stribeck(bench.F_c, bench.F_s, bench.v_s)
        model = LuGre(
            sigma_0=bench.sigma_0, sigma_1=bench.sigma_1, sigma_2=bench.sigma_2, stribeck=curve
        )
        tables.append(measure_phenomena({"lugre": model}, bench=bench))
    for one, other in zip(*tables, strict=True):
        assert one.measured.verdict == other.measured.verdict
        for a, b in zip(one.measured.numbers, other.measured.numbers, strict=True):
            factor = 8.0 if a.unit in ("N", "mN", "mJ", "µJ") else 1.0
            assert factor * a.value == pytest.approx(b.value, rel=2e-3, abs=1e-3)
