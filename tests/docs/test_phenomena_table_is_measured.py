"""Claim: the table of docs/howto/phenomena.md is that of a run, with every included chart."""

from __future__ import annotations

import pytest

from gms_fsm import measure_phenomena
from gms_fsm.charts import CHARTS
from tests.helpers import ROOT

TABLE = (ROOT / "docs" / "howto" / "phenomena_table.txt").read_text(encoding="utf-8")
AGAIN = "run docs/make_phenomena.py (make gallery)"


def test_every_chart_is_in_it() -> None:
    missing = [
        name for name in CHARTS if f"| {name} |" not in TABLE and f"- {name} does not" not in TABLE
    ]
    assert missing == [], AGAIN


@pytest.mark.slow
def test_three_models_measured_again() -> None:
    fresh = measure_phenomena(["lugre", "gms-signed", "stiction"]).markdown().splitlines()
    assert [line for line in fresh if line not in TABLE.splitlines()] == [], AGAIN
