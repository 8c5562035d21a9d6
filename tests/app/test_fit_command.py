"""``gms-fsm fit`` fits the record of a scenario, writes a report, and answers mistakes once."""

from __future__ import annotations

import inspect
from dataclasses import replace
from pathlib import Path

import pytest

from gms_fsm.app._tables import FitTable
from gms_fsm.app.fits import load_fit
from gms_fsm.identification import fit
from tests.identification.fits_made import record, small
from tests.scenario_files import STAGE, CommandLine, changed, one_message, table

pytest.importorskip("matplotlib", reason="the report has a figure")


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    columns = record().columns
    x = 1e3 * columns["position"]
    (tmp_path / "rig.csv").write_text(table(["t", "x", "F"], columns["time"], x, columns["force"]))
    path = tmp_path / "rig.toml"
    path.write_text(STAGE)
    return path


@pytest.mark.slow
def test_a_scenario_is_fitted_and_reported(
    gms_fsm: CommandLine, scenario: Path, tmp_path: Path
) -> None:
    done = gms_fsm("fit", scenario, "-o", "out")
    assert (done.code, done.err) == (0, "")
    for said in ("k1", "k2", "offset", "N/m", "95 % interval", "training RMSE", "held out RMSE"):
        assert said in done.out
    assert "repeatability" in done.out
    assert done.out.rstrip().endswith("start with out/report.md")
    page = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert page.startswith("# GMS, 2 elements, signed law, fitted to rig\n")
    for given in ("out/fitted.toml", scenario):  # a run ignores the table [fit]
        again = gms_fsm("run", given, "-o", "again", "--set", "output.figures=[]")
        assert (again.code, again.err) == (0, "")


def test_the_table_gives_the_arguments(scenario: Path) -> None:
    given = ["fit.bounds.k=[1e3, 1e5]", "record.smoothing=0.05", "fit.seed=3", "fit.nuisance=[]"]
    options = load_fit(scenario, given).task.options
    assert (options.free, options.train, options.test) == (("k",), (0.0, 8.0), (8.0, 12.0))
    assert (options.bounds, options.nuisance) == ({"k": (1e3, 1e5)}, ())
    assert (options.smoothing, options.seed, options.most_steps) == (0.05, 3, None)


def test_its_keys_and_defaults_are_those_of_the_function() -> None:
    asked = inspect.signature(fit.fit).parameters
    own = {"records", "model", "smoothing", "progress"}
    assert set(FitTable.model_fields) == set(asked) - own
    defaults = FitTable(free=["k"]).options(None)
    for name in set(asked) - own - {"free", "fixed"}:
        wanted = asked[name].default
        empty = {"bounds": {}, "tied": (), "linear": ()}.get(name, wanted)
        assert getattr(defaults, name) == empty, name


@pytest.mark.matrix
@pytest.mark.slow
def test_a_system_is_fitted(gms_fsm: CommandLine, scenario: Path, tmp_path: Path) -> None:
    system = small().save(tmp_path / "first.toml").read_text(encoding="utf-8")
    record = "[record]" + STAGE.partition("[record]")[2].partition("[fit]")[0]
    table = '[fit]\nfree = ["friction.k"]\nsearch = "local"\n'
    (tmp_path / "system.toml").write_text(f"{system}\n{record}\n{table}")
    done = gms_fsm("fit", "system.toml", "-o", "out")
    assert done.code == 0, done.err
    assert "friction.k1" in done.out
    assert "note: a fit ignores [run]" in done.err
    (tmp_path / "system.toml").write_text(f"{system}\n{record}")
    one_message(gms_fsm("run", "system.toml"), "add a table [fit]")


def test_what_a_fit_does_not_use_is_said(scenario: Path) -> None:
    loaded = load_fit(scenario, ["run.t_end=5.0", "initial.z=[0.0, 0.0]"])
    assert loaded.notes == ("a fit ignores [run] and [initial]",)
    assert load_fit(scenario).notes == ()


def test_a_file_without_the_table_or_a_record(gms_fsm: CommandLine, scenario: Path) -> None:
    text = changed(STAGE, 'kind = "record"', 'kind = "prescribed"\nvelocity = "0.1"')
    head, _, rest = text.partition("[record]")
    scenario.write_text(head + "[run]\nt_end = 1.0\n[fit]" + rest.partition("[fit]")[2])
    one_message(gms_fsm("fit", scenario), "there is no table [record]", "measured force")
    scenario.write_text(STAGE.partition("[fit]")[0])
    one_message(gms_fsm("fit", scenario), "there is no table [fit]", "free = ")


def test_a_folder_of_the_users_is_refused_before_the_search(
    gms_fsm: CommandLine, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "report.md").write_text("mine")
    done = gms_fsm("fit", scenario, "-o", "out")
    one_message(done, "report.md", "was not written by gms-fsm")
    assert (tmp_path / "out" / "report.md").read_text() == "mine"


@pytest.mark.slow
def test_ctrl_c_keeps_the_best_so_far(
    gms_fsm: CommandLine, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = "The search was interrupted: this is the best so far."
    stopped = replace(small(), stopped=said)
    monkeypatch.setattr(fit, "fitted", lambda *_, **__: stopped)
    done = gms_fsm("fit", scenario)
    assert done.code == 130
    assert f"note: {said}" in done.err
    assert "start with out/rig-fit/report.md" in done.out
    assert said in (tmp_path / "out" / "rig-fit" / "report.md").read_text(encoding="utf-8")

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(fit, "fitted", interrupted)
    done = gms_fsm("fit", scenario, "-o", "nothing")
    assert done.code == 130
    assert "nothing was written" in done.err
    assert "Traceback" not in done.err
