"""``debug --tui`` says what it needs: Textual, a terminal, a valid scenario."""

from __future__ import annotations

import io
import sys

import pytest

from gms_fsm import Prescribed
from gms_fsm.debugger.tui import run_tui
from gms_fsm.errors import SessionError
from gms_fsm.session.session import Session
from tests.helpers import ROOT, stick_slip
from tests.scenario_files import CommandLine, one_message

FIG_4 = ROOT / "scenarios" / "paper_fig4_stick_slip.toml"


def test_without_textual_the_extra_is_named(
    gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "textual", None)
    one_message(
        gms_fsm("debug", "--tui", FIG_4),
        "the full-screen debugger needs textual, which is not installed",
        'pip install "gms-fsm[tui]"',
        "without --tui answers at a prompt",
    )


def test_without_a_terminal_the_prompt_is_offered(gms_fsm: CommandLine) -> None:
    pytest.importorskip("textual", reason="needs the extra tui")
    one_message(
        gms_fsm("debug", "--tui", FIG_4), "needs a terminal", "without --tui it reads commands"
    )


def test_a_terminal_that_cannot_place_text_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("textual", reason="needs the extra tui")
    for name in ("stdin", "stdout"):
        file = io.StringIO()
        monkeypatch.setattr(file, "isatty", lambda: True)
        monkeypatch.setattr(sys, name, file)
    monkeypatch.setenv("TERM", "dumb")
    with pytest.raises(SessionError, match="needs a terminal"):
        run_tui(Session(stick_slip("signed"), Prescribed("0.1"), 1.0))


def test_a_mistake_in_the_scenario_is_one_message(gms_fsm: CommandLine) -> None:
    one_message(gms_fsm("debug", "--tui", "no.toml"), "no.toml")
    one_message(gms_fsm("debug", "--tui", FIG_4, "--set", "model.law=none"), "law")


def test_light_is_for_the_full_screen(gms_fsm: CommandLine) -> None:
    done = gms_fsm("debug", "--light", FIG_4)
    assert done.code == 2
    assert "it is an option of --tui" in done.err
