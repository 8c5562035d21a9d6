"""Claim: LuGre drifts and forgets; GMS remembers, lags and rests; its published law makes energy.

With every verdict comes a number, or the reason why there is none.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from gms_fsm import PhenomenaTable, measure_phenomena
from gms_fsm.phenomena.limits import LIMITS
from gms_fsm.phenomena.measure import PHENOMENA
from tests.phenomena.cases import MODELS, known

pytestmark = pytest.mark.slow


@pytest.fixture
def table() -> PhenomenaTable:
    return known()


@pytest.mark.parametrize(
    ("model", "phenomenon", "verdict"),
    [
        ("lugre", "drift", "shows wrongly"),
        ("lugre", "memory", "does not show"),
        ("lugre", "lag", "shows"),
        ("lugre", "break-away", "shows"),
        ("lugre", "vibration", "shows wrongly"),
        ("gms-signed", "drift", "shows"),
        ("gms-signed", "memory", "shows"),
        ("gms-signed", "hysteresis", "shows"),
        ("gms-signed", "lag", "shows"),
        ("gms-signed", "passivity", "shows"),
        ("gms-published", "passivity", "shows wrongly"),
        ("stiction", "hysteresis", "does not show"),
        ("stiction", "lag", "does not show"),
        ("stiction", "stick-slip", "shows"),
        ("backlash", "lag", "does not apply"),
    ],
)
def test_the_verdict(table: PhenomenaTable, model: str, phenomenon: str, verdict: str) -> None:
    assert table.cell(model, phenomenon).verdict == verdict


@pytest.mark.slow
def test_the_seven_parameters_show_what_their_page_says() -> None:
    shown = {"break-away", "stribeck", "lag", "stick-slip"}
    found = measure_phenomena(["seven-parameter"], [*shown, "hysteresis"])
    assert {e.phenomenon.name for e in found if e.measured.verdict == "shows"} == shown
    assert found.cell("seven-parameter", "hysteresis").verdict == "does not show"


def test_no_verdict_without_a_number(table: PhenomenaTable) -> None:
    for cell in table:
        found = cell.measured
        assert found.said
        assert bool(found.numbers) == (found.verdict != "does not apply"), cell.model
        assert bool(found.curves) == bool(found.numbers)
        assert all(number.unit for number in found.numbers)


def test_the_published_law_makes_more_than_it_takes(table: PhenomenaTable) -> None:
    signed, published = (table.cell(f"gms-{law}", "passivity") for law in ("signed", "published"))
    assert signed.number("energy made") == 0.0
    assert published.number("energy made") > 1.0  # mJ
    assert published.number("energy taken in all cycles") < 0.0


def test_every_limit_is_used_and_has_a_reason(table: PhenomenaTable) -> None:
    used = {name for each in table.phenomena for name in each.limits}
    assert used == set(LIMITS)
    assert all(each.meaning and each.reason and each.value > 0.0 for each in LIMITS.values())


def test_numbers_of_a_column_have_the_same_decimals(table: PhenomenaTable) -> None:
    lines = [line.split(" | ")[1:] for line in table.markdown().splitlines()[2:]]
    for column in zip(*lines, strict=True):
        cells = [text.removesuffix(" |") for text in column if re.search(r"\d", text)]
        forms = {re.sub(r"\d", "0", re.sub(r"^. −?\d+", "", text)) for text in cells}
        assert len(forms) == 1, cells


@pytest.mark.matrix
def test_what_slides_away_has_no_number_in_the_table() -> None:
    away = measure_phenomena(["rate-state-slip"], ["hysteresis"])
    found = away.cell("rate-state-slip", "hysteresis")
    assert max(each.value for each in found.numbers) < 1e3  # no kilometre in micrometres
    assert np.abs(found.curves[0].x).max() < 1e3
    assert away.markdown().splitlines()[-1] == "| rate-state-slip | ✗ slides away |"


def test_the_table_is_complete(table: PhenomenaTable) -> None:
    assert table.models == MODELS
    assert [each.name for each in table.phenomena] == list(PHENOMENA)
    lines = table.markdown().splitlines()
    assert len(lines) == 2 + 4  # without backlash
    assert all(line.count(" | ") == len(PHENOMENA) for line in lines)
    assert table.left_out() == {"backlash": "backlash is play with elastic flanks, not friction"}
    rows = table.csv().splitlines()
    assert rows[0] == "model,phenomenon,verdict,quantity,value,unit,said"
    assert len(rows) == 1 + sum(max(1, len(cell.measured.numbers)) for cell in table)


def test_a_model_without_an_inner_loop_has_no_gap_in_the_table(table: PhenomenaTable) -> None:
    """A gap of 0.0 % is that of a closed loop, and a spring has none."""
    memory = next(each for each in table.phenomena if each.name == "memory")
    said = {model: memory.brief(table.cell(model, "memory")) for model in table.models}
    assert said["gms-signed"] == "0.0 %"
    assert said["gms-published"] == "no loop"
    assert table.cell("gms-published", "memory").number("gap") < 1e-3  # µm


def test_every_experiment_says_which_numbers_show_it(table: PhenomenaTable) -> None:
    assert all(any(digit in each.shows_if for digit in "1259") for each in table.phenomena)
