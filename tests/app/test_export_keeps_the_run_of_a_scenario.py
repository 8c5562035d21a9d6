"""``gms-fsm export`` begins where a scenario begins, with its tolerances and initial values."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from tests.helpers import ROOT
from tests.scenario_files import MEASURED, CommandLine, table


def test_a_record_without_a_run_table(gms_fsm: CommandLine) -> None:
    t = np.round(0.5 + 0.01 * np.arange(60), 2)
    Path("own.csv").write_text(table(["t", "x", "F"], t, 3 + np.sin(6 * t), np.cos(6 * t)))
    Path("own.toml").write_text(MEASURED)
    assert gms_fsm("export", "own.toml", "--to", "c99", "-o", "out").code == 0
    assert "/* Begin at t = 0.5 s. */" in Path("out/own.h").read_text()
    assert Path("out/own_record.csv").read_text().splitlines()[1].startswith("0.5,")
    x = re.search(r"w\[\d+\]\.f = (\S+); /\* buffers\.now\.y \*/", Path("out/own.c").read_text())
    assert x
    assert 1e-3 < float(x[1]) < 5e-3  # m; the record says mm


def test_a_contact_has_the_tolerance_of_its_scenario(gms_fsm: CommandLine) -> None:
    text = (ROOT / "scenarios" / "servo.toml").read_text()
    Path("servo.toml").write_text(text.replace("[run]", "[run]\nrtol = 1e-3"))
    bearing = ("export", "servo.toml", "--contact", "bearing")
    assert gms_fsm(*bearing, "--to", "c99", "-o", "out").code == 0
    readme = Path("out/README-bearing-c99.md").read_text()
    assert re.search(r"relative tolerance 0\.001\.", readme)
    # A format without the engine has no use for it.
    assert gms_fsm(*bearing, "--to", "st").code == 0
