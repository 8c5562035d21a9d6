"""The debugger's output is plain text, as wide as the terminal, with colour only there."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys

import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, Transition
from gms_fsm.app.scenario import load_scenario, run_debugger
from gms_fsm.debugger import COMMANDS, Debugger
from gms_fsm.session.session import Session
from tests.app.test_debugger_transcripts import FIG_4, SCENARIOS, talk
from tests.helpers import FIG4_SINE, ROOT, bank

EVERYTHING = (
    "help",
    *(f"help {name}" for name in COMMANDS),
    *["where", "list", "why", "next", "where", "list", "why 2", "goto 25", "where", "log 50"],
    "watch z1 / s1 + z2 / s2 + z3 / s3 + z4 / s4 + t + x + v + F + s + z1 * z2 * z3",
    "b valid break_away_backward element 2 if z1 < 0.1 and z2 < 0.2 and z3 < 0.3 or v < 0",
    "breaks",
    "until state(1) == stick and state(2) == stick and v > 0 and z1 > 0.01",
    "c",
    "goto 24",
    "poke z1=-0.123456789 z2=0.123456789 z3=0.2 z4=0.1 state1=slip state2=slip",
    *["run", "branches", "compare 0 1"],
    "print unknown_name_that_is_rather_long + another_one > 3 ",
    "nonsense " + "very long " * 20,
    "poke " + "z1=0 " * 30 + "q",
    "load " + "x" * 200,
    "until " + "(" * 90,
    "goto 1e9",
    "where",
)


class Terminal(io.StringIO):
    """A text file that claims to be a terminal."""

    encoding = "utf-8"  # type: ignore[assignment]

    def isatty(self) -> bool:
        return True


def _bank(n: int) -> Session:
    return Session(bank(n), Prescribed(FIG4_SINE), 100.0)


def _wordy() -> Session:
    """Long names, long guards, many edges."""
    states = tuple(State(f"a_state_with_a_long_name_{i}", {"z": "v"}) for i in range(3))
    edges = tuple(
        Transition(
            f"an_edge_with_a_name_that_does_not_end_{i}_{j}",
            states[i].name,
            states[j].name,
            guard=" and ".join(f"z * {10 + i + j + m} > s + k * v**2" for m in range(6)),
        )
        for i in range(3)
        for j in range(3)
        if i != j
    )
    name = "a chart with a name of many words " * 3
    chart = Chart(name, ("v", "s"), ("z",), ("k",), states, edges, {"F": "k * z"})
    model = ChartModel(chart, {"k": 1.0}, n=12, stribeck=Stribeck(1.0, 1.5, 1e-3))
    return Session(model, Prescribed(FIG4_SINE), 100.0)


@pytest.mark.slow
def test_nothing_is_wider_than_80_columns() -> None:
    prompts = re.compile(r"^\(t=[^)]*\) ")
    for line in talk(FIG_4, *EVERYTHING).splitlines():
        if not prompts.match(line):  # except the echo of a long command
            assert len(line) <= 80, line
        assert line.isascii()
        assert "\x1b" not in line


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("session", [_bank(12), _wordy()], ids=["12", "wordy"])
def test_nor_with_twelve_elements_or_long_names(session: Session) -> None:
    made = Debugger(session, "A title that is quite long " * 5, io.StringIO(), io.StringIO())
    for command in EVERYTHING:
        for line in made.reply(command).splitlines():
            assert len(line) <= 80, (command, line)
    made.run()
    head = made.stdout.getvalue().splitlines()  # type: ignore[attr-defined]
    assert all(len(line) <= 80 for line in head[:-1])


def _on_a_terminal(monkeypatch: pytest.MonkeyPatch, **environment: str) -> str:
    for name in ("NO_COLOR", "TERM"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    out = Terminal()
    loaded = load_scenario(SCENARIOS / f"{FIG_4}.toml")
    run_debugger(loaded, io.StringIO("goto 25\nwhy 1\nwhere\nlist\nquit\n"), out)
    return out.getvalue()


def test_a_terminal_gets_colour_without_extra_information(monkeypatch: pytest.MonkeyPatch) -> None:
    text = _on_a_terminal(monkeypatch, TERM="xterm")
    assert "\x1b[90mfalse\x1b[0m" in text
    bare = re.sub(r"\x1b\[[0-9;]*m", "", text)
    assert "\x1b" not in bare  # colours only: nothing is redrawn, the cursor never moves
    assert all(len(line) <= 80 for line in bare.splitlines())
    plain = talk(FIG_4, "goto 25", "why 1", "where", "list", "quit")
    for drawn, mark in zip("✗✓░█─▓═│║┌┐└┘╔╗╚╝µ", "ny.#-#=||++++++++u", strict=True):
        bare = bare.replace(drawn, mark)
    assert bare.replace("=", "-").replace("#", "-") == plain.replace("=", "-").replace("#", "-")


@pytest.mark.parametrize("columns", [60, 160])
def test_a_terminal_gets_lines_of_its_width(columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    text = _on_a_terminal(monkeypatch, TERM="xterm", COLUMNS=str(columns))
    lines = [line.rstrip() for line in re.sub(r"\x1b\[[0-9;]*m", "", text).splitlines()]
    assert all(len(line) <= columns for line in lines)
    assert max(map(len, lines)) > columns - 10
    ribbon = next(line for line in lines if line.startswith(" E1 "))
    assert len(lines[lines.index(ribbon) - 1]) == columns  # its axis
    sentence = "help lists the commands, where shows everything, quit exits."
    assert (sentence in lines) == (columns >= len(sentence))


@pytest.mark.parametrize("environment", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
def test_no_colour_where_it_is_not_wanted(
    environment: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = _on_a_terminal(monkeypatch, **environment)
    assert text == talk(FIG_4, "goto 25", "why 1", "where", "list", "quit")
    assert text.isascii()


def _piped(script: str, **environment: str) -> subprocess.CompletedProcess[bytes]:
    code = (
        "import sys; from gms_fsm.app.scenario import run_debugger; "
        "from gms_fsm.app.scenario import load_scenario; "
        f"sys.exit(run_debugger(load_scenario('{FIG_4}')))"
    )
    return subprocess.run(
        [sys.executable, "-c", code],
        input=script.encode(),
        capture_output=True,
        check=False,
        cwd=ROOT,
        env={**os.environ, **environment},
    )


@pytest.mark.parametrize(
    ("script", "code"),
    [("next\nquit\n", 0), ("nxt\nquit\n", 1), ("goto 0,15\nnext\n", 1), ("# a remark\n\n", 0)],
)
def test_a_script_with_a_mistake_ends_with_exit_code_1(script: str, code: int) -> None:
    """At the prompt a mistake is answered, and leaves no trace."""
    made = Debugger(_bank(1), "", io.StringIO(script), io.StringIO())
    assert made.run() == code
    made = Debugger(_bank(1), "", io.StringIO(script), io.StringIO())
    made.typed = True
    assert made.run() == 0


@pytest.mark.slow
def test_a_pipe_gets_plain_text_and_an_exit_code() -> None:
    """Also where it cannot carry a character that was typed; here a command that there is not."""
    done = _piped("goto 25\nwhy 1\nfrage nach ß und →\nq", PYTHONIOENCODING="ascii:surrogateescape")
    assert done.returncode == 1, done.stderr
    assert done.stderr == b""
    text = done.stdout.replace(b"\r\n", b"\n")
    assert text.startswith(talk(FIG_4, "goto 25", "why 1").rpartition("(t=")[0].encode("ascii"))
    assert b"error: there is no command" in text
