"""A scenario selects monitors; gms-fsm run prints and writes their verdicts, and exits with 0."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from gms_fsm import Trace
from gms_fsm.app.report import monitor_lines, run_scenario
from gms_fsm.app.scenario import load_scenario, session_of
from gms_fsm.traces.failures import LivelockError
from gms_fsm.traces.monitors import Invariant
from tests.corpus import run
from tests.scenario_files import (
    OPEN_LOOP,
    CommandLine,
    changed,
    one_message,
)

MONITORS = ["abs(z) <= 0.01*s", "passivity", "coverage", "chattering"]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "given.toml"
    file.write_text(changed(OPEN_LOOP, "t_end = 1.0", f"t_end = 1.0\nmonitors = {MONITORS}"))
    return file


def test_verdicts_are_printed_and_written(gms_fsm: CommandLine, path: Path, tmp_path: Path) -> None:
    done = gms_fsm("run", path, "-o", tmp_path / "out", "--set", "output.every=0.5")
    assert done.code == 0
    trace = Trace.load(tmp_path / "out" / "trace.npz")
    assert (len(trace), list(trace.monitors)) == (3, MONITORS)  # few rows are no obstacle
    lines = monitor_lines(trace)
    assert lines[0].startswith("monitor abs(z) <= 0.01*s (not ok): first broken at t = ")
    assert lines[1].startswith("monitor passivity (ok): ")
    assert lines[2].startswith("monitor coverage (not ok): ")
    summary = (tmp_path / "out" / "summary.md").read_text()
    assert "\n## Monitors\n\n- monitor abs(z)" in summary
    for line in lines:
        assert f"{line}\n" in done.out
        assert f"- {line}\n" in summary
    done = gms_fsm("run", path, "-o", tmp_path / "out", "--set", "run.monitors=[]")
    assert "onitor" not in done.out + (tmp_path / "out" / "summary.md").read_text()


def test_the_arguments_of_simulate_include_them(path: Path) -> None:
    given = load_scenario(path).arguments["monitors"]
    assert given[0] == Invariant("abs(z) <= 0.01*s")
    assert len(given) == 4
    assert "monitors" not in load_scenario(path, ["run.monitors=[]"]).arguments
    assert session_of(load_scenario(path)).step().row == 1  # the debugger has none
    assert len(load_scenario(path, ["run.monitors=['all']"]).arguments["monitors"]) == 3


def test_a_run_that_fails_reports_them_too(
    gms_fsm: CommandLine, path: Path, tmp_path: Path
) -> None:
    done = gms_fsm("run", path, "-o", tmp_path / "out", "--set", "rig.velocity=0.1*sqrt(0.5 - t)")
    one_message(done, "not finite", "partial.npz", "monitor passivity (ok)", "monitor coverage")
    assert list(Trace.load(tmp_path / "out" / "partial.npz").monitors) == MONITORS


def test_a_livelock_is_reported_once(path: Path, tmp_path: Path) -> None:
    """The models of scenario files have none, so a custom chart replaces them."""
    loaded = load_scenario(path, ["run.monitors=['all']"])
    model, rig = run("chattering").subject
    loaded = replace(loaded, model=model, rig=rig)
    loaded.arguments["t_end"] = run("chattering").t_end
    with pytest.raises(LivelockError) as caught:
        run_scenario(loaded, tmp_path / "out")
    assert str(caught.value).count("chattering") == 1
    assert any("monitor coverage" in note for note in caught.value.__notes__)
    kept = Trace.load(tmp_path / "out" / "partial.npz").monitors["chattering"]
    assert not kept.ok
