"""A custom table of positions and the scenario of the how-to page give a figure and a summary."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Trace
from tests.helpers import ROOT
from tests.scenario_files import CommandLine, table

pytest.importorskip("matplotlib", reason="the picture needs the extra 'plots'")

PAGE = ROOT / "docs" / "howto" / "measured-record.md"


def own_table() -> str:
    """Return 12 s of a stage that moves back and forth by 0.5 mm, with its friction force.

    The friction is that of Maxwell slip elements, computed with the stop operator, row by row.
    """
    t = np.arange(2400) * 0.005
    position = 0.5e-3 * np.sin(2 * np.pi * t / 4)
    k = 1e3 * np.array([10.0, 15.0, 10.0, 5.0])
    s = 2.35 * np.array([0.25, 0.35, 0.25, 0.15]) / k
    z, force = np.zeros(4), np.zeros(t.size)
    for row, dx in enumerate(np.diff(position), start=1):
        z = np.clip(z + dx, -s, s)
        force[row] = k @ z
    noise = np.random.default_rng(4).standard_normal((2, t.size))
    columns = ["time [s]", "position [mm]", "friction [N]"]
    return table(columns, t, 1e3 * position + 2e-5 * noise[0], force + 0.05 * noise[1])


@pytest.fixture
def command(gms_fsm: CommandLine, tmp_path: Path) -> CommandLine:
    """The command line beside the table and the scenario of the page."""
    blocks = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (scenario,) = (each for each in blocks if 'file = "rig.csv"' in each and "[model]" in each)
    (tmp_path / "rig.csv").write_text(own_table())
    (tmp_path / "rig.toml").write_text(scenario)
    return gms_fsm


@pytest.mark.slow
def test_table_and_scenario_become_picture_and_summary(
    command: CommandLine, tmp_path: Path
) -> None:
    done = command("run", "rig.toml", "-o", "out")
    assert done.code == 0, done.err
    assert "out/summary.md" in done.out
    assert (tmp_path / "out" / "overview.png").read_bytes().startswith(b"\x89PNG")
    summary = (tmp_path / "out" / "summary.md").read_text(encoding="utf-8")
    assert summary.startswith("# rig\n")
    for said in ("signed law", "weights", "R²", "RMSE", "time constant 0.02 s", "rig.csv"):
        assert said in summary, said
    assert 0.99 < float(summary.partition("R² = ")[2].split(",")[0]) < 1.0
    trace = Trace.load(tmp_path / "out" / "trace.npz")
    assert len(trace) == 2400
    assert len(trace.transitions) > 20
    assert np.abs(np.ptp(trace.x) - 1e-3) < 2e-5
    log = (tmp_path / "out" / "transitions.csv").read_text().splitlines()
    assert len(log) == len(trace.transitions) + 1


@pytest.mark.slow
def test_the_readmes_overrides_work(command: CommandLine, tmp_path: Path) -> None:
    changes = ("model.law=published", "record.smoothing=0.05", "output.figures=[]")
    done = command("run", "rig.toml", "--live", *(p for each in changes for p in ("--set", each)))
    assert done.code == 0, done.err
    assert "|z|/s" in done.err
    summary = (tmp_path / "out" / "rig" / "summary.md").read_text(encoding="utf-8")
    assert "published law" in summary
    assert "time constant 0.05 s" in summary
