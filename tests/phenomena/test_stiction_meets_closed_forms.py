"""Claim: stiction breaks away at F_s at all rates, and sticks and slips with the period and the
amplitude of the closed form.
"""

from __future__ import annotations

import math

import pytest

from gms_fsm import PhenomenaTable, measure_phenomena
from tests.phenomena.cases import BENCH, DRY

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
