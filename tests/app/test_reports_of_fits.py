"""Claim: the report of a fit says what was fitted, how well, and what cannot be told, in files."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Fit, Record
from gms_fsm.app import fit_report
from gms_fsm.app.fit_report import report_files, write_report
from gms_fsm.app.scenario import load_scenario
from gms_fsm.errors import OutputError
from gms_fsm.foundation.extras import missing
from gms_fsm.identification.result import Choice, ChoiceRow
from tests.identification.fits_made import small, two_records, with_profiles, with_table

pytest.importorskip("llvmlite", reason="fits take long without machine code")

FILES = {"report.md", "parameters.csv", "residuals.csv", "fitted.toml"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("matplotlib", reason="the figure needs the extra 'plots'")
    place = tmp_path_factory.mktemp("report")
    assert small().report(place) == place / "report.md"  # which finds write_report
    return place


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the figure, which takes longest."""
    monkeypatch.setattr(fit_report, "_draw", lambda *_: [])


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.matrix
@pytest.mark.slow
def test_the_page_names_its_files_every_parameter_and_score(folder: Path) -> None:
    written = {path.name for path in folder.iterdir()}
    wanted = set(report_files()) - {"fitted.csv"}  # for a long motion
    assert wanted | FILES | {"fit.png"} <= written
    page, fit = (folder / "report.md").read_text(encoding="utf-8"), small()
    for name in wanted - {"report.md"}:
        assert f"({name})" in page
    assert (folder / "fit.png").read_bytes().startswith(b"\x89PNG")
    for each in fit.table:
        value, interval = each.shown
        assert f"| {each.name} | {value} | {interval} | {each.unit} |" in page
    assert fit.held_out is not None
    for score in (fit.training, fit.held_out):
        assert f"| {score['rmse']:.4g} | {score['r2']:.4f} | {score['rows']:.0f} |" in page
    assert f"repeatability: {fit.floor:.4g} N" in page
    assert "0 s <= t < 8 s; held out: 8 s <= t < 12 s" in page.replace("&lt;", "<")
    assert f"count {fit.effective_rows:.0f} independent rows" in page


@pytest.mark.usefixtures("undrawn")
def test_what_cannot_be_told_is_named(tmp_path: Path) -> None:
    page = write_report(with_table(5), tmp_path).read_text(encoding="utf-8")
    doubts = page.partition("## What the record cannot tell")[2].partition("##")[0]
    assert f"- {small().weakest}\n" in doubts.replace("\\", "")
    assert "- cannot be told: parameter_2\n" in doubts
    assert ("never slipped: element" in doubts) == bool(small().never_slipped)


@pytest.mark.usefixtures("undrawn")
def test_elements_that_never_slipped_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Fit, "never_slipped", (2, 4))
    monkeypatch.setattr(Fit, "open_profiles", ())
    page = write_report(with_table(5), tmp_path).read_text(encoding="utf-8")
    assert "- never slipped: element 2, 4; it acts as a spring" in page
    assert "- fit as well" not in page


@pytest.mark.matrix
@pytest.mark.slow
def test_profiles_are_there_exactly_when_something_is_open(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="the figure needs the extra 'plots'")
    names = {"profiles.png", "profiles.svg"}
    page = write_report(with_profiles(1), tmp_path).read_text(encoding="utf-8")
    doubts = page.partition("## What the record cannot tell")[2].partition("##")[0]
    assert "![Profiles of what cannot be told](profiles.png)" in doubts
    assert "values of v_c0 from 6.31e-09 to 1.58e-06 m/s\n" in doubts
    assert "a profile is at most as high" in doubts
    assert "a better fit was met" not in page
    assert names <= {path.name for path in tmp_path.iterdir()}
    assert two_records().open == ()
    page = write_report(two_records(), tmp_path).read_text(encoding="utf-8")
    assert "profiles" not in page
    assert not names & {path.name for path in tmp_path.iterdir()}  # of the fit before


@pytest.mark.usefixtures("undrawn")
def test_a_better_fit_met_on_the_walk_is_said(tmp_path: Path) -> None:
    """A fit searches from there; where that did not help, the page says so."""
    found = with_profiles(1)
    (given,) = found.open_profiles
    lower = replace(given, rise=given.rise - 20.0)
    found = replace(found, assessed=replace(found.assessed, open_profiles=(lower,)))
    page = write_report(found, tmp_path).read_text(encoding="utf-8")
    assert f"- a better fit was met on the way (rise {lower.rise.min():.3g})" in page


@pytest.mark.slow
def test_tables_have_all_digits(folder: Path) -> None:
    rows = table(folder / "parameters.csv")
    assert [row["name"] for row in rows] == [each.name for each in small().table]
    for row, each in zip(rows, small().table, strict=True):
        numbers = float(row["value"]), float(row["low"]), float(row["high"])
        assert numbers == (each.value, each.low, each.high)
    (part,) = small().residuals()
    found = table(folder / "residuals.csv")
    assert [float(row["measured_N"]) for row in found] == part.measured.tolist()
    assert [float(row["modelled_N"]) for row in found] == part.modelled.tolist()
    assert [row["use"] == "held out" for row in found] == part.held.tolist()
    assert [row["use"] == "training" for row in found] == part.rows.tolist()
    again = Record.from_csv(folder / "residuals.csv", position="x_m", force="residual_N")
    assert np.array_equal(again.columns["force"], part.measured - part.modelled)


@pytest.mark.slow
def test_the_scenario_runs_and_gives_the_fitted_force(folder: Path) -> None:
    (part,) = small().residuals()
    trace = load_scenario(folder / "fitted.toml").simulate(t_eval=part.t)
    offset = next(each.value for each in small().table if each.name == "offset")
    spread = float(np.std(part.measured - part.modelled))
    assert np.abs(trace.F + offset - part.modelled).max() < 0.05 * spread


@pytest.mark.usefixtures("undrawn")
def test_several_records_have_a_table_and_say_licences_and_notes_once(tmp_path: Path) -> None:
    task = two_records().task
    records = tuple(replace(each, licence="MIT; somebody") for each in task.records)
    notes = ("long: velocity: as measured", "short: velocity: as measured", "long: 2 gaps", "other")
    fit = replace(two_records(), task=replace(task, records=records), notes=notes)
    page = write_report(fit, tmp_path).read_text(encoding="utf-8")
    assert "| record | training [N] | held out [N] |" in page
    for part in two_records().residuals():
        rmse = np.sqrt(np.mean((part.measured - part.modelled)[part.rows] ** 2))
        assert f"| {part.record.name} | {rmse:.4g} | – |" in page
    assert "no rows were held out" in page
    assert "repeatability is not known" in page
    said = ("licence of all records: MIT; somebody", "all records: velocity: as measured")
    for each in (*said, "long: 2 gaps", "other"):
        assert page.count(f"- {each}\n") == 1


@pytest.mark.usefixtures("undrawn")
def test_candidates_and_an_interruption_are_said(tmp_path: Path) -> None:
    rows = tuple(ChoiceRow(name, "simple", 3, 0.1, 0.99, -5.0, 1.0) for name in ("one", "two"))
    stopped = "The search was interrupted: this is the best so far."
    chosen = replace(small(), choice=Choice(rows, "two"), stopped=stopped)
    page = write_report(chosen, tmp_path).read_text(encoding="utf-8")
    assert "| one | simple | 3 | 0.1 | 0.9900 | -5 | – | – | 1 |  |" in page
    assert "| **two** | simple | 3 | 0.1 | 0.9900 | -5 | – | – | 1 |  |" in page
    assert page.splitlines()[2] == f"**{stopped}**"


def test_without_matplotlib_the_texts_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> list[str]:
        raise missing("matplotlib", "plots")

    monkeypatch.setattr(fit_report, "_draw", refused)
    with pytest.warns(UserWarning, match="no figure was drawn: figures and animations need"):
        page = write_report(small(), tmp_path).read_text(encoding="utf-8")
    assert "- no figure was drawn: figures and animations need matplotlib" in page
    assert {path.name for path in tmp_path.iterdir()} >= FILES
    assert not list(tmp_path.glob("fit.*"))


@pytest.mark.usefixtures("undrawn")
def test_a_motion_too_long_for_a_scenario_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> Path:
        raise OutputError("it would have 1316456 bytes", place="fitted.toml")

    monkeypatch.setattr(Fit, "save", refused)
    with pytest.warns(UserWarning, match="no scenario was written"):
        page = write_report(small(), tmp_path).read_text(encoding="utf-8")
    assert "- no scenario was written: fitted.toml: it would have 1316456 bytes" in page
    assert "gms-fsm run" not in page
