"""The command line does its verbs, and answers a mistake with one message and exit code 2."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import gms_fsm
from gms_fsm import GMS, GMSParameters, Prescribed
from gms_fsm.lowering.program import lower
from tests.helpers import ROOT


def run(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "from gms_fsm.app.cli import main; main()", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        check=False,
        env={**os.environ, "COLUMNS": "200", "PYTHONPATH": str(ROOT)},
    )


@pytest.mark.parametrize("law", ["signed", "published"])
def test_code_prints_the_generated_program(law: str) -> None:
    done = run("code", "--law", law)
    assert done.returncode == 0, done.stderr
    model = GMS(GMSParameters.paper("stick-slip"), law=law)  # type: ignore[arg-type]
    head, _, body = lower(model, Prescribed("0.15*sin(2*pi*t/25)")).source.partition("\n\n")
    assert done.stdout.startswith(head)
    assert done.stdout.endswith(body)


def test_code_for_other_rigs() -> None:
    assert "stiffness * (speed * t - x)" in run("code", "--law", "signed", "--rig", "pulled").stdout
    assert "(F_a - F) / mass" in run("code", "--law", "signed", "--rig", "slider").stdout


def test_version_and_help() -> None:
    assert run("--version").stdout == f"gms-fsm {gms_fsm.__version__}\n"
    help_text = run("--help").stdout
    assert "paper" in help_text
    assert "code" in help_text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["code"], "--law"),
        (["code", "--law", "singed"], "signed"),
        (["nonsense"], "nonsense"),
        (["paper", "--force", "0.1*"], "column 5: the text ends too early"),
        (["paper", "--force", "0.1*x"], "unknown name 'x'"),
        (["paper", "--force", "__import__('os')"], "unknown function '__import__'"),
        (["paper", "--velocity", "0.1*sqrt(2 - t)"], "not finite"),
        (["paper", "-o", "file/out"], "choose another folder"),
    ],
)
def test_a_mistake_is_one_message_and_exit_code_2(
    arguments: list[str], said: str, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("in the way")
    done = run(*arguments, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert said in done.stderr
    assert "Traceback" not in done.stderr + done.stdout
    assert done.stderr.count("error:") <= 1


def test_a_failed_run_keeps_what_it_had(tmp_path: Path) -> None:
    done = run("paper", "-o", "out", "--force", "0.1*sqrt(3 - t)", cwd=tmp_path)
    assert done.returncode == 2
    assert "partial.npz" in done.stderr
    assert gms_fsm.Trace.load(tmp_path / "out" / "partial.npz").t[-1] > 2.9
