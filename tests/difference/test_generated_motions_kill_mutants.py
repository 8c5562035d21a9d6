"""Claim: generated motions tell the mutants of guards apart that are not proved to do the same."""

from __future__ import annotations

import pytest

from gms_fsm import generate
from gms_fsm.charts.registry import charts
from tests.difference.mutants import guard_mutants, judged, killed
from tests.helpers import ROOT

TABLE = (ROOT / "docs" / "howto" / "coverage_table.txt").read_text(encoding="utf-8")
ROWS = {
    row.split("`")[1]: [cell.strip() for cell in row.split("|")[2:-1]]
    for row in TABLE.splitlines()
    if row.startswith("| `")
}


@pytest.fixture(autouse=True)
def with_z3() -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["dog-clutch", "gms-signed"])
def test_the_table_of_the_docs_is_what_is_found(name: str) -> None:
    """If this fails, run: python docs/make_coverage.py."""
    chart = charts()[name]
    found = generate(chart)
    verdicts = judged(found, chart)
    dead, left, same = (len(verdicts[each]) for each in ("killed", "left", "same"))
    runs, *_, killed_of, alike = ROWS[name]
    assert (runs, killed_of, alike) == (str(len(found.runs)), f"{dead} of {dead + left}", str(same))


def test_the_table_has_all_charts_with_edges_and_nothing_open() -> None:
    assert [*ROWS] == [name for name, chart in charts().items() if chart.transitions]
    assert {row[4] for row in ROWS.values()} == {"0"}
    for name, row in ROWS.items():
        dead, of = map(int, row[6].split(" of "))
        assert dead >= 0.9 * of, name


def test_a_chart_is_not_told_from_itself() -> None:
    chart = charts()["dog-clutch"]
    found = generate(chart)
    assert not any(killed(run, chart) for run in found.runs)


def test_mutants_change_one_thing_each() -> None:
    chart = charts()["end-stop"]
    guards = [each.guard for each in guard_mutants(chart) if each.edge == "bounce"]
    for wanted in (
        "x > x_s and v > v_r",
        "x < x_s and v > v_r",
        "not x >= x_s and v > v_r",
        "x >= x_s or v > v_r",
        "v > v_r",
        "x >= 1.1 * x_s and v > v_r",
        "x >= -x_s and v > v_r",
    ):
        assert wanted in guards
    assert len(guards) == len({*guards})
    assert chart.guard_text("bounce") not in guards
