"""Every command has help whose examples work, names are completed, and no failure ends it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from gms_fsm.debugger import COMMANDS, help_of, view
from gms_fsm.session.session import Session
from tests.app.test_debugger_transcripts import FIG_4, answers
from tests.inspection.sessions import a_system, debugger, fig4, locked, warming

BEFORE = {  # so that there is something to clear, to compare and to load
    fig4: ("goto 20", "watch x", "b arrest", "poke z1=0.1", "save mine.json"),
    warming: ("goto 0.1", "watch x", "b arrest", "poke w1=0.1", "save mine.json"),
    a_system: ("watch w1", "b slip", "poke q1=0.1", "save mine.json"),
    locked: ("goto 5", "watch x", "b stuck", "poke x=0.1", "save mine.json"),
}


@pytest.mark.every(4)
@pytest.mark.slow
@pytest.mark.parametrize("made", BEFORE)
def test_the_examples_of_every_command_work(
    made: Callable[[], Session], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.txt").write_text("step 2\nback\n")
    overview = debugger(made()).reply("help")
    assert len(overview.splitlines()) < 24
    for name, command in COMMANDS.items():
        assert (f"{name} ({command.alias})" if command.alias else name) in overview
        asked = debugger(made())
        text = asked.reply(f"help {name}")
        assert text.startswith(command.usage.split()[0])
        assert "{" not in text
        examples = help_of(name, asked.session).examples
        assert examples
        for example in examples:
            assert f"example: {example}" in text
            assert not [line for line in BEFORE[made] if "error" in asked.reply(line)]
            if name != "plot":
                assert "error:" not in asked.reply(example), example


@pytest.mark.parametrize(
    ("made", "line", "text", "words"),
    [
        (fig4, "", "st", "step"),
        (fig4, "", "b", "back break breaks branches branch"),
        (fig4, "b fires ", "break_", "break_away_forward break_away_backward"),
        (fig4, "break ", "sl", "slip"),
        (fig4, "b ", "ch", "changes"),
        (fig4, "back ", "un", "until"),
        (fig4, "until ", "z", "z1 z2 z3 z4"),
        (fig4, "p ", "state(", "state(1) state(2) state(3) state(4)"),
        (fig4, "poke ", "state1", "state1="),
        (fig4, "poke state1=", "s", "stick slip"),
        (fig4, "why ", "", "1 2 3 4 break_away_forward break_away_backward arrest"),
        (fig4, "why 1 ", "arr", "arrest"),
        (fig4, "help ", "go", "goto"),
        (fig4, "branch ", "", "0"),
        (fig4, "element ", "", "1 2 3 4"),
        (fig4, "clear ", "", "all"),
        (fig4, "unwatch ", "", "all"),
        (fig4, "goto ", "", ""),
        (lambda: warming(2), "poke ", "w", "w1= w2="),
        (a_system, "until ", "bank.state", " ".join(f"bank.state({i})" for i in range(1, 5))),
        (a_system, "poke ", "r", ""),
        (a_system, "poke ", "q", "q1= q2="),
    ],
)
def test_completion(made: Callable[[], Session], line: str, text: str, words: str) -> None:
    asked = debugger(made())
    whole = line + text
    found = (
        asked.completedefault(text, whole, len(line), len(whole))
        if line
        else asked.completenames(text)
    )
    assert sorted(found) == sorted(words.split())


def test_an_unexpected_failure_does_not_end_the_session(monkeypatch: pytest.MonkeyPatch) -> None:
    made = debugger(fig4())
    monkeypatch.setattr(made.commands, "do_where", lambda arg: 1 / 0)
    assert made.reply("where") == "error: ZeroDivisionError: division by zero"
    assert made.reply("print t") == "0 s"


@pytest.mark.matrix
@pytest.mark.slow
def test_plot(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "branches.svg"
    said = answers(FIG_4, f"plot {path}", "goto 25", "poke z1=0", f"plot {path}", "branches")
    for answer in (said[0], said[3]):
        assert answer.replace("\n", "").replace(" ", "").startswith("writtento")
    assert said[4].count("at its end") == 2
    assert path.stat().st_size > 5000


def test_an_empty_line_repeats_a_move_only_when_typed() -> None:
    assert answers(FIG_4, "step 2", "", "print t")[1] == ""
    made = debugger(fig4())
    made.typed = True
    assert made.reply("") == ""
    assert made.reply("step 2").startswith("row 2")
    assert made.reply("").startswith("row 4")
    made.reply("print t")
    assert made.reply("").startswith("row 6")


def test_the_view_of_a_system_is_plain_data() -> None:
    made = debugger(a_system())
    made.reply("goto 1.02")
    seen = view(made.session)
    assert [body.name for body in seen.bodies] == ["one", "two"]
    assert [each.title for each in seen.values] == ["further states", "sampled pid", "signals"]
    assert [contact.name for contact in seen.contacts] == ["pad", "bank"]
    assert len(seen.elements) == 5
