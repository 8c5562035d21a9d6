"""``gms-fsm sweep`` runs a scenario over a grid; its files contain what `sweep` returns."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Sweep, sweep
from gms_fsm.app.scenario import load_scenario
from gms_fsm.app.sweeps import axis
from tests.scenario_files import (
    OPEN_LOOP,
    CommandLine,
    changed,
)

SWEPT = ("--over", "F_s=1:2:3", "--over", "v_s=1e-3:1e-1:3,log", "--engine", "ifelse")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "given.toml"
    file.write_text(OPEN_LOOP)
    return file


@pytest.mark.slow
def test_every_combination_is_run_as_python_runs_it_and_shown(
    gms_fsm: CommandLine, path: Path, tmp_path: Path
) -> None:
    slipping = "model.weights=[0.05, 0.02]"
    changes = ("--set", "run.t_end=20.0", "--set", slipping)
    done = gms_fsm("sweep", path, *SWEPT, "-o", tmp_path / "out", *changes)
    assert (done.code, done.err) == (0, "")
    found = Sweep.load(tmp_path / "out" / "sweep.npz")
    F_s, v_s = np.linspace(1.0, 2.0, 3), np.geomspace(1e-3, 1e-1, 3)
    assert found.parameters["F_s"].tolist() == np.repeat(F_s, 3).tolist()
    assert found.parameters["v_s"].tolist() == np.tile(v_s, 3).tolist()
    loaded = load_scenario(path, [slipping])
    wanted = sweep(loaded.model, loaded.rig, 20.0, found.parameters, engine="machines")
    for name in ("t", "x", "v", "F", "z", "transitions"):
        assert getattr(found, name).tobytes() == getattr(wanted, name).tobytes()
    assert len(found.transitions)
    assert f"9 runs, 0 failed, {len(found.transitions)} transitions; 3 files in" in done.out
    with (tmp_path / "out" / "runs.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["run"]) for row in rows] == list(range(9))
    for name, values in found.columns().items():
        assert [row[name] for row in rows] == [str(value) for value in values.tolist()]
    summary = (tmp_path / "out" / "summary.md").read_text(encoding="utf-8")
    assert "- F_s: 3 values from 1 to 2 N, linear\n" in summary
    assert "- v_s: 3 values from 0.001 to 0.1 m/s, logarithmic\n" in summary
    assert "| F_s [N] | v_s [m/s] | outcome | transitions | t [s] |" in summary
    assert summary.count("| ok |") == 9


def test_a_long_table_is_cut_and_names_the_full_file(
    gms_fsm: CommandLine, path: Path, tmp_path: Path
) -> None:
    over = ("--over", "F_s=1:2:101", "--engine", "ifelse", "--set", "run.t_end=0.01")
    gms_fsm("sweep", path, *over, "-o", tmp_path / "out")
    summary = (tmp_path / "out" / "summary.md").read_text(encoding="utf-8")
    assert summary.count("| ok |") == 100
    assert "The first 100 runs; `runs.csv` has all 101." in summary
    assert len((tmp_path / "out" / "runs.csv").read_text().splitlines()) == 102


def test_a_run_that_fails_is_a_row_and_reported(
    gms_fsm: CommandLine, path: Path, tmp_path: Path
) -> None:
    over = ("--over", "F_s=0.5:1.5:2", "--engine", "ifelse")
    done = gms_fsm("sweep", path, *over, "-o", tmp_path / "out")
    assert done.code == 0
    assert "2 runs, 1 failed" in done.out
    said = "ParameterError: F_s is 0.5, F_c is 1.0; stiction must be at least the Coulomb friction"
    assert f"first failure: run 0: {said}" in done.out
    summary = (tmp_path / "out" / "summary.md").read_text(encoding="utf-8")
    assert f"- run 0: {said}" in summary


def test_rows_are_kept_if_requested_monitors_are_not_and_a_run_has_its_own_folder(
    gms_fsm: CommandLine, path: Path, tmp_path: Path
) -> None:
    path.write_text(changed(OPEN_LOOP, "figures = []", "figures = []\nevery = 0.25"))
    over = ("--over", "F_s=1:2:2", "--engine", "ifelse", "--set", 'run.monitors=["all"]')
    done = gms_fsm("sweep", path, *over)
    assert "note: a sweep has no monitors: run.monitors is ignored" in done.err
    assert gms_fsm("run", path).code == 0
    assert {folder.name for folder in (tmp_path / "out").iterdir()} == {"given", "given-sweep"}
    found = Sweep.load(tmp_path / "out" / "given-sweep" / "sweep.npz")
    assert found.times.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert found.rows["z"].shape == (2, 5, 2)


def test_both_ends_of_an_axis_are_exact() -> None:
    for text in ("F_s=0.1:0.7:7", "F_s=0.1:0.7:7,log", " F_s = 0.1 : 0.7 : 7 , log "):
        found = axis(text)
        assert found.name == "F_s"
        assert (found.values[0], found.values[-1], found.values.size) == (0.1, 0.7, 7)


def test_an_interrupted_sweep_writes_nothing(
    gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stops(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    Path("a.toml").write_text(OPEN_LOOP)
    monkeypatch.setattr("gms_fsm.app.sweeps.sweep_scenario", stops)
    answer = gms_fsm("sweep", "a.toml", "--over", "F_s=1.5:2:2", "-o", "out")
    assert answer.code == 130
    assert "interrupted; nothing was written" in answer.err
