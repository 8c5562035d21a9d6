"""`source` executes the commands in a file as if they were typed, up to the first error."""

from __future__ import annotations

from pathlib import Path

import pytest

from gms_fsm.debugger import Debugger
from tests.inspection.sessions import debugger, fig4


def sourced(path: Path, text: str) -> tuple[Debugger, list[str]]:
    """Return the debugger that executed a file, and its answer without line breaks inside."""
    path.write_text(text, encoding="utf-8")
    made = debugger(fig4())
    return made, made.reply(f"source {path}").replace("\n  ", " ").split("\n")


def test_it_answers_as_the_prompt_does(tmp_path: Path) -> None:
    made, said = sourced(tmp_path / "mine.txt", "# to the first switch\n\nnext\n  why 1  \n")
    typed = debugger(fig4())
    expected = []
    for command in ("next", "why 1"):
        prompt = typed.commands.prompt
        expected += [f"{prompt}{command}", *typed.reply(command).replace("\n  ", " ").split("\n")]
    assert said == expected
    assert made.commands.refused == 0


def test_it_stops_at_the_first_error_and_names_file_and_line(tmp_path: Path) -> None:
    path = tmp_path / "mine.txt"
    made, said = sourced(path, "step 3\n# a comment\nstpe\nstep 50\n")
    assert (
        "".join(said)
        .replace(" ", "")
        .endswith(
            f"error:{path},line3:thereisnocommand'stpe';didyoumean'step'?helplistsallcommands".replace(
                " ", ""
            )
        )
    )
    assert made.session.here.row == 3
    assert made.commands.refused == 1


def test_quit_in_a_file_leaves(tmp_path: Path) -> None:
    made, _ = sourced(tmp_path / "mine.txt", "step\nquit\nstep 50\n")
    assert made.commands.left
    assert made.session.here.row == 1


def test_a_file_may_source_another_but_not_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "inner.txt").write_text("step 2\n", encoding="utf-8")
    made, said = sourced(
        Path("outer.txt"), "source inner.txt\nsource inner.txt\nsource outer.txt\n"
    )
    assert made.session.here.row == 4
    assert "outer.txt, line 3: outer.txt: it is a file of commands that sources itself" in said[-1]


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mine.bin"
    path.write_bytes(b"\xff\xfe\x00step")
    assert "no file of commands" in " ".join(debugger(fig4()).reply(f"source {path}").split())
