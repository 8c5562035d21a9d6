"""What any verb prints fits 80 columns: help, lists, results, notes and errors.

Programs and schemas are printed as they are, for files.
"""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from gms_fsm.app.cli import app
from tests.identification.fits_made import record
from tests.scenario_files import OPEN_LOOP, STAGE, CommandLine, table

VERBS = [each.name for each in app.registered_commands]
PRINTED = [
    *(f"{verb} --help" for verb in VERBS),
    "--help",
    "chart --list",
    "check --list",
    "export --list",
    "run --list",
    "lesson",
    "check gms --law published",
    "check broken:overlap",
    "run open.toml --set run.monitors=['all']",
    "run open.toml --set model.C=[0.1,0.1] --set rig.velocity=0.0",
    "sweep open.toml --over F_s=1.5:2:2 --engine ifelse",
    "phenomena --model dahl --phenomenon hysteresis",
    "fit rig.toml",
    "export open.toml --to matlab",
    "debug open.toml",
    "lesson 99",
    "lesson 4",
    "run none.toml",
    "run open.toml --set model.lwa=signed",
    f"run open.toml --set rig.velocity={'0.1*sin(t)+' * 12}0.1*sin(x)",
    "chart bouc",
    "chart gms",
    "chart gms --law signed -o a.b",
    "export gms --law signed --to simulink",
    "plot open.toml",
    "simulate open.toml",
]


@pytest.fixture
def narrow(gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch) -> CommandLine:
    """Return the command line on a terminal of 80 columns, beside a few files."""
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("sys.stdin", io.StringIO("where\nwhy 1\nlist\nlog\nbranches\nquit\n"))
    columns = record().columns
    x, F = 1e3 * columns["position"], columns["force"]
    Path("rig.csv").write_text(table(["t", "x", "F"], columns["time"], x, F))
    Path("rig.toml").write_text(STAGE)
    Path("open.toml").write_text(OPEN_LOOP)
    return gms_fsm


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("arguments", PRINTED)
def test_no_line_is_longer_than_the_screen(arguments: str, narrow: CommandLine) -> None:
    done = narrow(*arguments.split())
    said = f"{done.out}\n{done.err}"
    assert said.strip()
    assert [line for line in said.splitlines() if len(line) > 80] == []
