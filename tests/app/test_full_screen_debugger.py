"""The full-screen debugger answers keys and clicks: step, back, break, poke, compare, why."""

from __future__ import annotations

import asyncio
import io
import itertools
import sys
from typing import Any

import pytest

pytest.importorskip("textual", reason="needs the extra tui")

from gms_fsm import Prescribed
from gms_fsm.app.verbs.console import CLEARED, opening
from gms_fsm.debugger import COMMANDS
from gms_fsm.debugger.tui import _app, run_tui
from gms_fsm.debugger.tui._app import FullScreen
from gms_fsm.debugger.tui._keys import KEYS
from gms_fsm.debugger.tui._spans import DARK, LIGHT
from gms_fsm.debugger.tui._widgets import Help
from gms_fsm.errors import SessionError
from gms_fsm.session.session import Session
from tests.app.full_screen import (
    FIG_4,
    LARGE,
    SMALL,
    drive,
    press,
    screen_text,
    session,
    settle,
    typed,
)
from tests.app.test_debugger_transcripts import answers
from tests.helpers import FIG4_SINE, ROOT, stick_slip
from tests.inspection.test_sessions_tell_what_the_run_saw import torn
from tests.scenario_files import CommandLine, one_message

pytestmark = pytest.mark.slow
MIDDLE = (140, 45)
ANSWER = "arrest does not fire: |z| < s is false by 0.776 m."


def _row(app: FullScreen) -> int:
    return app.commands.session.branch.cursor


def _all_said(app: FullScreen, texts: list[str]) -> None:
    said = "\n".join(app.said).replace("µ", "u")  # as the prompt writes it in plain text
    for text in texts:
        assert text.replace("\n  by", " by") in said


@pytest.mark.matrix
def test_keys_find_out_why_on_a_small_screen() -> None:
    """Numbers before keys, moves, elements, zoom, help, colours; and out."""

    async def action(app: FullScreen, pilot: Any) -> None:
        await press(pilot, "2", "5")
        assert "why at 25 s" in screen_text(app)
        await press(pilot, "backspace", "escape")
        assert "why at" not in screen_text(app)
        assert app.number == ""
        await press(pilot, "2", "5", "w")
        seen = screen_text(app)
        for text in (ANSWER, "-0.7762 m", "✗ |z| < s", "24.9999735 s"):
            assert text in seen
        assert ANSWER in app.panels["why"].shown.replace("\n  ", " ")
        assert ANSWER in app.said
        theme = app.theme
        await press(pilot, "d")
        assert app.theme != theme
        assert screen_text(app) == seen
        await press(pilot, "home", "1", "0", "s")
        assert _row(app) == 10
        await press(pilot, "3", "left")
        assert _row(app) == 7
        await press(pilot, "1", "2", ".", "5", "g")
        assert app.said[-2].startswith("row 30, t = 12.4999735 s")
        await press(pilot, "3", "e")
        assert app.commands.element == 2
        await press(pilot, "9", "e")
        assert app.said[-1] == "error: there is no element 9; there are 1 to 4"
        await press(pilot, "1", "e", "5", "0", "g", "plus")
        assert app.span[1] - app.span[0] == pytest.approx(25.0)
        assert app.span[0] < app.commands.session.here.t < app.span[1]
        await press(pilot, "minus", "minus")
        assert app.span == (0.0, 100.0)
        await press(pilot, "question_mark")
        assert isinstance(app.screen, Help)
        for key in KEYS:
            assert f"{key.shown:<4}{key.says}" in app.screen.panel.shown
        for name in COMMANDS:
            assert name in app.screen.panel.shown
        await press(pilot, "down", "escape")
        assert not isinstance(app.screen, Help)
        await press(pilot, "ctrl+c")
        assert app.is_running
        assert [each.message for each in app._notifications] == ["q quits"]
        await press(pilot, "q")

    assert drive(action).return_value == 0


def test_moves_end_where_those_of_the_prompt_end() -> None:
    pressed = ["s", "n", "right", "n", "n", "left", "N", "end", "left", "home", "shift+right"]
    lines = [
        *["step", "next", "step", "next", "next", "back", "prev"],
        *["goto 100", "back", "goto 0", "next"],
    ]

    async def action(app: FullScreen, pilot: Any) -> None:
        await press(pilot, *pressed)
        asked = [line.partition(") ")[2] for line in app.said if line.startswith("(t=")]
        assert [each.removesuffix(".0") for each in asked] == lines
        _all_said(app, answers(FIG_4, *lines))
        await press(pilot, "home", "n", "s", "s", "s", "s", "1", "e", "b", "c", "w")
        said = answers(FIG_4, "next", *["step"] * 4, "break valid arrest element 1", "continue")
        assert said[6].startswith("breakpoint 1: valid arrest, element 1\nrow ")
        _all_said(app, said[5:])
        assert "● break" in app.panels["why"].shown
        assert "● 1 valid arrest, element 1; hits: 1" in app.panels["session"].shown
        await press(pilot, "home", "7", "b")
        assert app.said[-1] == "error: stick has 2 edges, so there is no edge 7"
        await press(pilot, "home", "n", "s", "s")
        assert app.commands.element == 2
        assert "FIRED E3 stick → slip  break_away_forward" in screen_text(app).splitlines()[0]
        assert "break_away_forward FIRED" in app.panels["chart"].shown
        await press(pilot, "f", "s")
        assert app.commands.element == 2  # another one fired, which is not followed
        assert "FIRED E4" in screen_text(app).splitlines()[0]
        await press(pilot, "home", "1", "e", "2", "b")
        points = app.commands.session.breakpoints
        assert [point.name for point in points] == ["arrest", "break_away_backward"]

    drive(action, LARGE)


def test_branches_are_poked_compared_and_marked_where_they_differ() -> None:
    async def action(app: FullScreen, pilot: Any) -> None:
        await press(pilot, "5", "g", "o", "o")
        assert app.commands.session.current == 0
        await press(pilot, "2", "5", "g", "p", *typed("-1.4"), "enter", "escape", "x")
        assert [branch.parent for branch in app.commands.session.branches] == [None, 0]
        _all_said(app, answers(FIG_4, "goto 25", "poke z1=-1.4", "compare"))
        tree = " ".join(app.panels["session"].shown.split())
        assert "▶ branch 1 from 0 at 24.9999735 s: z1 = -1.4" in tree
        one, other = (branch.trace() for branch in app.commands.session.branches)
        ribbon: Any = app.ribbon
        start, end = ribbon.span
        middle = [start + (end - start) * (i + 0.5) / ribbon.parts for i in range(ribbon.parts)]
        rows = [[trace.t.searchsorted(t, "right") - 1 for t in middle] for trace in (one, other)]
        pairs = zip(*rows, strict=True)
        expected = [bool((one.states[a] != other.states[b]).any()) for a, b in pairs]
        last = ribbon.rows[-2].line
        assert last[0].text.strip() == "differs"
        assert [mark == "≠" for mark in last[1].text] == expected
        assert any(expected)
        await press(pilot, "o")
        assert app.commands.session.current == 0

    drive(action, MIDDLE)


def test_commands_are_completed_remembered_and_repeated() -> None:
    async def action(app: FullScreen, pilot: Any) -> None:
        prompt = app.prompt
        await press(pilot, "colon", *typed("br"), "tab")
        assert prompt.value == "br"
        assert "break" in screen_text(app).splitlines()[-1]
        assert "branches" in screen_text(app).splitlines()[-1]
        await press(pilot, *typed("eak ar"), "tab")
        assert prompt.value == "break arrest "
        await press(pilot, "enter")
        assert app.focused is None  # keys are keys again after a command
        await press(pilot, "colon", *typed("goto 25"), "enter", "colon", "up")
        assert prompt.value == "goto 25"
        await press(pilot, "up")
        assert prompt.value == "break arrest"
        await press(pilot, "up", "down", "down")
        assert prompt.value == ""
        await press(pilot, *typed("poke z1"), "tab")
        assert prompt.value == "poke z1="
        await press(pilot, "escape", "s")
        assert app.focused is None
        assert app.said[-2].startswith("(t=25.0000 s) step")
        await press(
            pilot, "home", "colon", *typed("step 3"), "enter", "colon", "enter", "colon", "enter"
        )
        assert _row(app) == 9
        await press(pilot, "colon", *typed("quit"), "enter")

    assert drive(action, light=True).return_value == 0


def test_a_panel_that_fails_does_not_end_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("division by zero")

    async def action(app: FullScreen, pilot: Any) -> None:
        monkeypatch.setattr("gms_fsm.debugger.tui._app.chart_states", broken)
        await press(pilot, "s")
        assert app.panels["chart"].shown == "cannot be shown here: division by zero"
        assert _row(app) == 1

    assert drive(action, MIDDLE).return_code in (0, None)


def test_clicks_give_commands() -> None:
    async def action(app: FullScreen, pilot: Any) -> None:
        await press(pilot, "3", "0", "g")
        assert await pilot.click(app.panels["elements"].body, offset=(4, 3))
        await settle(pilot)
        assert app.commands.element == 2
        events = app.panels["events"]
        events.scroll_to(y=0, animate=False)
        await pilot.pause()
        assert await pilot.click(events.body, offset=(4, 1))
        await settle(pilot)
        assert _row(app) == app.commands.session.branch.firing_rows(999)[1]
        why = app.panels["why"]
        line = next(i for i, row in enumerate(why.rows) if row.command)
        assert await pilot.click(why.body, offset=(4, line))
        await settle(pilot)
        assert [point.kind for point in app.commands.session.breakpoints] == ["valid"]
        ribbon: Any = app.ribbon
        assert await pilot.click(ribbon.body, offset=(ribbon.lead + ribbon.parts // 2, 3))
        await settle(pilot)
        assert app.commands.session.here.t == pytest.approx(50.0, abs=4.0)
        assert ribbon.rows[3].line  # still there
        keys_line = app.keys
        left, _, _ = next(place for place in keys_line.places if "steps('back')" in place[2])
        row = _row(app)
        assert await pilot.click(keys_line, offset=(left + 2, 0))
        await settle(pilot)
        assert _row(app) == row - 1

    drive(action, MIDDLE)


def test_escape_stops_a_long_move_and_leaving_does_not_wait_for_one() -> None:
    made = Session(stick_slip("published"), Prescribed(FIG4_SINE), 1e9)

    async def action(app: FullScreen, pilot: Any) -> None:
        app.give("goto 1e9")
        for _ in range(200):
            await asyncio.sleep(0.01)
            if "working" in screen_text(app).splitlines()[0]:
                break
        else:
            pytest.fail("it does not say that it works")
        await press(pilot, "escape")
        assert "stopped" in app.said
        assert 0.0 < app.commands.session.here.t < 1e9
        await press(pilot, "left")
        assert any(text.endswith(" s) back") for text in app.said[-3:])
        app.give("goto 1e9")
        await asyncio.sleep(0.3)
        await pilot.press("q")

    assert drive(action, SMALL, made).return_value == 0


def _luminance(colour: str) -> float:
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


@pytest.mark.parametrize(
    ("palette", "grounds"), [(DARK, ("#10151b", "#171d25")), (LIGHT, ("#fbfbf9", "#f1f1ec"))]
)
def test_every_colour_can_be_read_on_its_ground(palette: Any, grounds: tuple[str, ...]) -> None:
    for style, ground in itertools.product(palette.values(), grounds):
        front, _, own = style.partition(" on ")
        pair = sorted(_luminance(c[-7:]) for c in (front, own or ground))
        assert (pair[1] + 0.05) / (pair[0] + 0.05) >= 4.5, (style, ground)


def test_it_says_what_it_needs(gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    """Textual, a terminal that can place text, a valid scenario; --light is an option of it."""
    path = ROOT / "gms_fsm/scenarios" / f"{FIG_4}.toml"
    one_message(
        gms_fsm("debug", "--tui", path), "needs a terminal", "without --tui it reads commands"
    )
    one_message(gms_fsm("debug", "--tui", path, "--set", "model.law=none"), "law")
    done = gms_fsm("debug", "--light", path)
    assert (done.code, "it is an option of --tui" in done.err) == (2, True)
    for name in ("stdin", "stdout"):
        file = io.StringIO()
        monkeypatch.setattr(file, "isatty", lambda: True)
        monkeypatch.setattr(sys, name, file)
    monkeypatch.setenv("TERM", "dumb")
    with pytest.raises(SessionError, match="needs a terminal"):
        run_tui(session())


def test_without_textual_the_extra_is_named(
    gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "textual", None)
    one_message(
        gms_fsm("debug", "--tui", ROOT / "gms_fsm/scenarios" / f"{FIG_4}.toml"),
        "the full-screen debugger needs textual, which is not installed",
        'pip install "gms-fsm[tui]"',
        "without --tui answers at a prompt",
    )


@pytest.mark.matrix
def test_a_key_without_its_number_asks_and_old_answers_go(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_app, "TRANSCRIPT", 20)

    async def action(app: FullScreen, pilot: Any) -> None:
        await press(pilot, "g", *typed("25"), "enter", "escape")
        assert "goto 25" in "".join(app.said)
        await press(pilot, *"wnwnwn")
        assert len(app.said) == 20

    drive(action, LARGE)


@pytest.mark.matrix
def test_a_guard_without_sides_and_a_run_that_fails_are_shown() -> None:
    async def action(app: FullScreen, pilot: Any) -> None:
        assert "z > 0.1 || v > 9" in app.panels["why"].shown
        await press(pilot, "2", "g", "w")
        assert "cannot be computed here" in app.panels["why"].shown

    drive(action, LARGE, torn())

    async def failing(app: FullScreen, pilot: Any) -> None:
        await press(pilot, "end")
        assert "the run cannot continue" in screen_text(app)

    made = Session(stick_slip("published"), Prescribed(FIG4_SINE), 40.0, max_steps=60)
    drive(failing, LARGE, made)


def test_on_a_terminal_it_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("stdin", "stdout"):
        file = io.StringIO()
        monkeypatch.setattr(file, "isatty", lambda: True)
        monkeypatch.setattr(sys, name, file)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(FullScreen, "run", lambda _: 3)
    assert run_tui(session()) == 3


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such terminal")
def test_while_it_opens_a_line_says_so_and_keys_are_not_echoed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import pty
    import termios

    outer, inner = pty.openpty()
    shown = io.StringIO()
    monkeypatch.setattr(shown, "isatty", lambda: True)
    with open(outer, "wb", buffering=0), open(inner) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        monkeypatch.setattr(sys, "stdout", shown)
        monkeypatch.setenv("TERM", "xterm")
        echo = [termios.tcgetattr(terminal)[3] & termios.ECHO]
        with opening("the debugger"):
            echo.append(termios.tcgetattr(terminal)[3] & termios.ECHO)
            assert shown.getvalue() == "opening the debugger ...\r"
        echo.append(termios.tcgetattr(terminal)[3] & termios.ECHO)
    assert echo == [termios.ECHO, 0, termios.ECHO]
    assert shown.getvalue().endswith(CLEARED)
