"""The glossary has, in order, the words that the product prints, and every symbol with its unit."""

import re
from typing import get_args

import pytest

from gms_fsm.charts.gms import LAWS, PARAMETERS
from gms_fsm.charts.parameters import SIGMA_2, STRIBECK, WEIGHTS, Parameter
from gms_fsm.charts.zoo.bristles.lugre import LUGRE
from gms_fsm.traces.monitors._kinds import KNOWN
from gms_fsm.verification.findings import Status
from tests.helpers import ROOT

PAGE = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
ENTRIES = re.findall(r"^- \*\*(.+?)\*\*: ", PAGE, re.MULTILINE)
TERMS = ("share", "weight", "rig", "bank", "held out", "0 (rounding)", "AND", "nuisance", "poke")
PRINTED = [*LAWS, *KNOWN, *get_args(Status), *(each.name for each in LUGRE.states), *TERMS]


def test_the_words_are_in_alphabetical_order() -> None:
    assert [*sorted(ENTRIES, key=str.casefold)] == ENTRIES
    assert len(ENTRIES) > 50


@pytest.mark.parametrize("word", PRINTED)
def test_a_word_that_is_printed_is_explained(word: str) -> None:
    listed = [each for entry in ENTRIES for each in entry.split(", ")]
    assert word in listed or f"`{word}`" in PAGE or f"*{word.capitalize()}*" in PAGE


@pytest.mark.parametrize(
    "each",
    [*PARAMETERS, *STRIBECK, *LUGRE.parameters, SIGMA_2, WEIGHTS],
    ids=lambda each: each.name,
)
def test_a_symbol_has_its_unit(each: Parameter) -> None:
    rows = [line.split(" | ") for line in PAGE.splitlines() if line.startswith("| ")]
    units = [unit for row in rows if f"`{each.name}`" in row[1] for unit in row[2].split(", ")]
    assert each.unit in units
