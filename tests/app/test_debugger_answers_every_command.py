"""Every command answers; a mistake is one message, never a traceback, and the session continues."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import Prescribed
from gms_fsm.debugger import ALIASES, COMMANDS, Debugger, help_of
from gms_fsm.session.session import Session
from tests.app.test_debugger_transcripts import FIG_4, answers, talk
from tests.helpers import FIG4_SINE, stick_slip


def _debugger(*, typed: bool = False) -> Debugger:
    session = Session(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)
    made = Debugger(session, "", io.StringIO(), io.StringIO())
    made.typed = typed
    return made


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_usage_and_an_example_that_works(
    name: str, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    made = _debugger()
    text = made.reply(f"help {name}")
    assert text.startswith(COMMANDS[name].usage.split()[0])
    for example in help_of(name, made.session).examples:
        assert f"example: {example}" in text
        for line in ("goto 20", "watch x", "b arrest", "poke z1=0.1", "run", "save mine.json"):
            assert "error" not in made.reply(line)
        if name != "plot":
            assert "error:" not in made.reply(example)


def test_the_overview_names_every_command() -> None:
    text = _debugger().reply("help")
    assert len(text.splitlines()) < 24
    for name, each in COMMANDS.items():
        assert (f"{name} ({each.alias})" if each.alias else name) in text


@pytest.mark.parametrize(
    ("alias", "name"),
    [
        ("s", "step"),
        ("b", "break"),
        ("n", "next"),
        ("c", "continue"),
        ("u", "until"),
        ("w", "where"),
        ("p", "print"),
        ("l", "list"),
        ("q", "quit"),
    ],
)
def test_short_names_are_those_of_pdb(alias: str, name: str) -> None:
    assert ALIASES[alias] == name


def test_an_unexpected_failure_does_not_end_the_session(monkeypatch: pytest.MonkeyPatch) -> None:
    made = _debugger()
    monkeypatch.setattr(made.commands, "do_where", lambda arg: 1 / 0)
    assert made.reply("where") == "error: ZeroDivisionError: division by zero"
    assert made.reply("print t") == "0"


@pytest.mark.slow
def test_plot(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "branches.svg"
    said = answers(FIG_4, f"plot {path}", "goto 25", "poke z1=0", f"plot {path}", "branches")
    for answer in (said[0], said[3]):
        assert answer.replace("\n", "").replace(" ", "").startswith("writtento")
    assert said[4].count("at its end") == 2
    assert path.stat().st_size > 5000


def test_where_shows_every_element_and_the_states_over_time() -> None:
    said = answers(FIG_4, "goto 100", "goto 25", "where")[2].splitlines()
    assert said[0] == "t = 24.9999735 s, row 73, micro-step 3, branch 0"
    assert " ".join(said[3].split()) == "> 1 slip -2.276 1.5 1.517 [########> -1.669 1:yn"
    assert said[6].split()[-1] == "1:yy*"
    ribbons = {line.split()[0]: line[6:] for line in said if line.startswith(" E")}
    assert len(ribbons) == 4
    for ribbon in ribbons.values():
        assert len(ribbon) == 74
        assert set(ribbon) == {"-", "#"}
    # Element 1 slips through 25 s, element 2 does not.
    assert ribbons["E1"][17:19] == "##"
    assert ribbons["E2"][17:19] == "#-"
    assert said[-2].index("^") == 6 + 18


def test_an_empty_line_repeats_a_move_only_when_typed() -> None:
    assert answers(FIG_4, "step 2", "", "print t")[1] == ""
    made = _debugger(typed=True)
    assert made.reply("") == ""
    assert made.reply("step 2").startswith("row 2")
    assert made.reply("").startswith("row 4")
    made.reply("print t")
    assert made.reply("").startswith("row 6")


def test_the_end_of_input_is_a_quiet_quit() -> None:
    assert talk(FIG_4, "goto 25").endswith("(t=25.0000 s) \n")
    assert talk(FIG_4, "goto 25", "q", "goto 50").endswith("(t=25.0000 s) q\n")


@pytest.mark.parametrize(
    ("line", "text", "words"),
    [
        ("", "st", ["step"]),
        ("", "b", ["back", "break", "breaks", "branches", "branch"]),
        ("b fires ", "break_", ["break_away_forward", "break_away_backward"]),
        ("break ", "sl", ["slip"]),
        ("break ", "te", ["tested"]),
        ("until ", "z", ["z1", "z2", "z3", "z4"]),
        ("p ", "state(", ["state(1)", "state(2)", "state(3)", "state(4)"]),
        ("poke ", "state1", ["state1="]),
        ("poke state1=", "s", ["stick", "slip"]),
        ("why ", "", ["1", "2", "3", "4", "break_away_forward", "break_away_backward", "arrest"]),
        ("why 1 ", "arr", ["arrest"]),
        ("element ", "", ["1", "2", "3", "4"]),
        ("help ", "go", ["goto"]),
        ("branch ", "", ["0"]),
        ("clear ", "", ["all"]),
        ("unwatch ", "", ["all"]),
        ("goto ", "", []),
    ],
)
def test_completion(line: str, text: str, words: list[str]) -> None:
    made = _debugger()
    whole = line + text
    if line:
        found = made.completedefault(text, whole, len(line), len(whole))
    else:
        found = made.completenames(text)
    assert sorted(found) == sorted(words)
