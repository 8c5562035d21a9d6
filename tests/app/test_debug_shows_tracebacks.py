"""A user's mistake is one message and exit code 2; with ``--debug`` it is a traceback with causes.

``--debug`` is accepted before or after the verb.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.errors import GMSError, ScenarioError, TraceFileError
from tests.helpers import ROOT, stick_slip
from tests.scenario_files import OPEN_LOOP, CommandLine, changed, one_message


@pytest.fixture(autouse=True)
def _files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Return a folder with a valid and an invalid scenario, and a valid and an invalid trace."""
    monkeypatch.chdir(tmp_path)
    Path("good.toml").write_text(OPEN_LOOP)
    Path("bad.toml").write_text(changed(OPEN_LOOP, '"signed"', '"singed"'))
    Path("stops.toml").write_text(changed(OPEN_LOOP, "0.1*sin(t)", "sqrt(0.5 - t)"))
    Path("escape.toml").write_text(OPEN_LOOP + '\n"\\u001b[31m[bold]\\u0007" = 1\n')
    simulate(stick_slip("signed"), Prescribed("0.3"), 2.0).save("good.npz")
    Path("bad.npz").write_bytes(Path("good.npz").read_bytes()[:-100])


MISTAKES = [
    ("run", "none.toml"),
    ("run", "bad.toml"),
    ("run", "stops.toml"),
    ("plot", "bad.npz"),
    ("check", "gms"),
]


@pytest.mark.parametrize("arguments", MISTAKES, ids=" ".join)
def test_with_debug_the_error_comes_through(
    arguments: tuple[str, ...], gms_fsm: CommandLine
) -> None:
    if arguments[0] == "plot":
        pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    one_message(gms_fsm(*arguments))
    for with_debug in (("--debug", *arguments), (*arguments, "--debug")):
        with pytest.raises(GMSError):
            gms_fsm(*with_debug)


def test_usage_errors_are_unchanged(gms_fsm: CommandLine) -> None:
    """An unknown verb or option: usage and exit code 2, with --debug too."""
    for arguments in (("nonsense",), ("run",), ("run", "good.toml", "--nonsense")):
        for debug in ((), ("--debug",)):
            answer = gms_fsm(*debug, *arguments)
            assert answer.code == 2
            assert "Usage" in answer.err
            assert "Traceback" not in answer.err


def test_debug_changes_nothing_on_success(gms_fsm: CommandLine) -> None:
    plain, debug = gms_fsm("code", "--law", "signed"), gms_fsm("code", "--law", "signed", "--debug")
    assert plain.code == debug.code == 0
    assert plain.out == debug.out


def test_after_two_dashes_it_is_an_argument(gms_fsm: CommandLine) -> None:
    one_message(gms_fsm("run", "--", "--debug"), "--debug: no such file")


def test_the_traceback_shows_causes_that_the_message_omits(gms_fsm: CommandLine) -> None:
    """The cause of "damaged trace file" is the error of zipfile."""
    pytest.importorskip("matplotlib", reason="needs the extra plots")
    with pytest.raises(TraceFileError) as caught:
        gms_fsm("plot", "bad.npz", "--debug")
    assert caught.value.__context__ is not None
    assert not caught.value.__suppress_context__
    with pytest.raises(ScenarioError) as caught_scenario:
        gms_fsm("run", "bad.toml", "--debug")
    assert "singed" in str(caught_scenario.value.__context__)


def test_a_message_contains_no_terminal_codes(gms_fsm: CommandLine) -> None:
    answer = gms_fsm("run", "escape.toml")
    one_message(answer, r"\x1b[31m[bold]\x07")
    assert "\x1b[31m" not in answer.message


def test_help_names_it(gms_fsm: CommandLine) -> None:
    assert "--debug" in gms_fsm("--help").out


@pytest.mark.slow
@pytest.mark.parametrize("debug", [False, True])
def test_in_a_shell(debug: bool, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from gms_fsm.app.cli import main; main()", "run", "none.toml"]
        + ["--debug"] * debug,
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == (1 if debug else 2)
    assert ("Traceback" in done.stderr) == debug
    assert "none.toml: no such file" in done.stderr
    assert done.stdout == ""
