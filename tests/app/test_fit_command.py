"""``gms-fsm fit`` fits the record of a scenario, writes a report, and answers mistakes once."""

from __future__ import annotations

import inspect
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm.app._tables import FitTable
from gms_fsm.app.fits import load_fit
from gms_fsm.identification import fit
from tests.identification.fits_made import record, small
from tests.scenario_files import CommandLine, changed, nothing_written, one_message, table

pytest.importorskip("matplotlib", reason="the report has a figure")

SCENARIO = """\
title = "stage"

[model]
kind = "GMS"
law = "signed"
k = [8000.0, 4000.0]
shares = [0.6, 0.4]
C = 20.0
v_c = 1e-6
stribeck = { F_c = 2.0, F_s = 2.1, v_s = 1e-3 }

[rig]
kind = "record"

[record]
file = "rig.csv"
time = { column = "t", unit = "s" }
position = { column = "x", unit = "mm" }
force = { column = "F", unit = "N" }

[fit]
free = ["k"]
train = [0.0, 8.0]
test = [8.0, 12.0]
cycles = 2.0
search = "local"
"""

GIVEN = {"rig.csv", "rig.toml"}


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    columns = record().columns
    x = 1e3 * columns["position"]
    (tmp_path / "rig.csv").write_text(table(["t", "x", "F"], columns["time"], x, columns["force"]))
    path = tmp_path / "rig.toml"
    path.write_text(SCENARIO)
    return path


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
    again = gms_fsm("run", "out/fitted.toml", "-o", "again", "--set", "output.figures=[]")
    assert again.code == 0, again.err


def test_keys_can_be_overridden(gms_fsm: CommandLine, scenario: Path) -> None:
    done = gms_fsm("fit", scenario, "--set", "fit.free=['k2']", "--set", "fit.nuisance=[]")
    assert done.code == 0, done.err
    assert "k2" in done.out
    assert "k1" not in done.out
    assert "offset" not in done.out
    assert "start with out/rig-fit/report.md" in done.out


def test_the_table_gives_the_arguments(scenario: Path) -> None:
    given = ["fit.bounds.k=[1e3, 1e5]", "record.smoothing=0.05", "fit.seed=3"]
    options = load_fit(scenario, given).task.options
    assert (options.free, options.train, options.test) == (("k",), (0.0, 8.0), (8.0, 12.0))
    assert options.bounds == {"k": (1e3, 1e5)}
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


def test_a_system_is_fitted(gms_fsm: CommandLine, scenario: Path, tmp_path: Path) -> None:
    system = small().save(tmp_path / "first.toml").read_text(encoding="utf-8")
    record = "[record]" + SCENARIO.partition("[record]")[2].partition("[fit]")[0]
    table = '[fit]\nfree = ["friction.k"]\nsearch = "local"\n'
    (tmp_path / "system.toml").write_text(f"{system}\n{record}\n{table}")
    done = gms_fsm("fit", "system.toml", "-o", "out")
    assert done.code == 0, done.err
    assert "friction.k1" in done.out
    assert "note: a fit ignores [run]" in done.err
    (tmp_path / "system.toml").write_text(f"{system}\n{record}")
    one_message(gms_fsm("run", "system.toml"), "add a table [fit]")


def test_a_run_ignores_the_table(gms_fsm: CommandLine, scenario: Path) -> None:
    done = gms_fsm("run", scenario, "-o", "out", "--set", "output.figures=[]")
    assert (done.code, done.err) == (0, "")


def test_what_a_fit_does_not_use_is_said(scenario: Path) -> None:
    loaded = load_fit(scenario, ["run.t_end=5.0", "initial.z=[0.0, 0.0]"])
    assert loaded.notes == ("a fit ignores [run] and [initial]",)
    assert load_fit(scenario).notes == ()


MISTAKES: dict[str, tuple[list[str], list[str]]] = {
    "wrong name": (["fit.free=['kk']"], ["[fit]", "'kk'", "did you mean 'k'?"]),
    "near key": (["fit.fre=['k']"], ["fit.fre", "did you mean 'free'?"]),
    "empty": (["fit.free=[]"], ["fit.free"]),
    "bounds": (["fit.bounds.k=[2.0, 1.0]"], ["[fit]", "bounds", "not below the highest"]),
    "three bounds": (["fit.bounds.k=[1.0, 2.0, 3.0]"], ["fit.bounds.k"]),
    "bounds of another": (["fit.bounds.C=[1.0, 2.0]"], ["[fit]", "'C'", "not among the free"]),
    "no rows": (["fit.train=[50.0, 60.0]"], ["50"]),
    "search": (["fit.search=genetic"], ["fit.search", "'hops', 'local' or 'de'"]),
    "nuisance": (["fit.nuisance=['bias']"], ["fit.nuisance", "'offset'"]),
    "measured": (["fit.measured=G"], ["[fit]", "'G'"]),
    "column": (["record.force.column=f"], ["rig.csv", "'f'"]),
    "cycles": (["fit.cycles=-1.0"], ["fit.cycles"]),
    "most_steps": (["fit.most_steps=0"], ["fit.most_steps"]),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_one_message_and_nothing_is_written(
    name: str, gms_fsm: CommandLine, scenario: Path, tmp_path: Path
) -> None:
    overrides, said = MISTAKES[name]
    options = [part for each in overrides for part in ("--set", each)]
    one_message(gms_fsm("fit", scenario, "-o", "out", *options), *said)
    nothing_written(tmp_path, GIVEN)


def test_a_file_without_the_table(gms_fsm: CommandLine, scenario: Path) -> None:
    scenario.write_text(SCENARIO.partition("[fit]")[0])
    one_message(gms_fsm("fit", scenario), "there is no table [fit]", "free = ")


def test_a_file_without_a_record(gms_fsm: CommandLine, scenario: Path) -> None:
    text = changed(SCENARIO, 'kind = "record"', 'kind = "prescribed"\nvelocity = "0.1"')
    head, _, rest = text.partition("[record]")
    scenario.write_text(head + "[run]\nt_end = 1.0\n[fit]" + rest.partition("[fit]")[2])
    one_message(gms_fsm("fit", scenario), "there is no table [record]", "measured force")


def test_a_record_without_a_force(gms_fsm: CommandLine, scenario: Path) -> None:
    scenario.write_text(changed(SCENARIO, 'force = { column = "F", unit = "N" }\n', ""))
    one_message(gms_fsm("fit", scenario), "force")


@pytest.mark.parametrize("constant", ["x", "F"])
def test_a_constant_record(
    constant: str, gms_fsm: CommandLine, scenario: Path, tmp_path: Path
) -> None:
    columns = {"x": 1e3 * record().columns["position"], "F": record().columns["force"]}
    columns[constant] = np.full(600, 0.25)
    values: Any = (record().columns["time"], columns["x"], columns["F"])
    (tmp_path / "rig.csv").write_text(table(["t", "x", "F"], *values))
    one_message(gms_fsm("fit", scenario, "-o", "out"), "constant")
    nothing_written(tmp_path, GIVEN)


def test_a_file_that_is_not_there(gms_fsm: CommandLine) -> None:
    one_message(gms_fsm("fit", "none.toml"), "none.toml", "no such file")


def test_a_folder_of_the_users_is_refused_before_the_search(
    gms_fsm: CommandLine, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "report.md").write_text("mine")
    done = gms_fsm("fit", scenario, "-o", "out")
    one_message(done, "report.md", "was not written by gms-fsm")
    assert (tmp_path / "out" / "report.md").read_text() == "mine"


def test_ctrl_c_keeps_the_best_so_far(
    gms_fsm: CommandLine, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, said = fit.fitted, "The search was interrupted: this is the best so far."
    monkeypatch.setattr(fit, "fitted", lambda *a, **o: replace(whole(*a, **o), stopped=said))
    done = gms_fsm("fit", scenario, "-o", "out")
    assert done.code == 130
    assert f"note: {said}" in done.err
    assert said in (tmp_path / "out" / "report.md").read_text(encoding="utf-8")


def test_ctrl_c_before_anything_was_found(
    gms_fsm: CommandLine, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(fit, "fitted", interrupted)
    done = gms_fsm("fit", scenario, "-o", "out")
    assert done.code == 130
    assert "nothing was written" in done.err
    assert "Traceback" not in done.err
