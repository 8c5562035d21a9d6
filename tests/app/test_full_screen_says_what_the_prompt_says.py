"""The full-screen debugger and the line prompt give the same answers and show the same values."""

from __future__ import annotations

import re
from typing import Any

import pytest

pytest.importorskip("textual", reason="needs the extra tui")

from gms_fsm.debugger import Debugger, view
from gms_fsm.debugger._text import DRAWN
from gms_fsm.debugger.tui._app import FullScreen
from gms_fsm.debugger.tui._guards import why_rows
from gms_fsm.debugger.tui._spans import plain
from gms_fsm.foundation.quantities import trimmed
from tests.app.full_screen import LARGE, drive, session, settle
from tests.app.test_debugger_is_plain_text import EVERYTHING

COMMANDS = [each for each in EVERYTHING if not each.startswith("load")]


def _lines(text: str) -> str:
    return " ".join(text.split())


@pytest.mark.slow
def test_every_command_has_the_same_answer() -> None:
    async def action(app: FullScreen, pilot: Any) -> None:
        app.give(*COMMANDS)
        await settle(pilot)

    app = drive(action, LARGE)
    made = Debugger(session())
    made.commands.marks = DRAWN
    begins = [i for i, text in enumerate(app.said) if text.startswith("(t=")]
    assert len(begins) == len(COMMANDS)
    for begin, end, command in zip(begins, [*begins[1:], len(app.said)], COMMANDS, strict=True):
        assert app.said[begin] == f"{made.prompt}{command}"
        expected = made.reply(command)
        made.prompt = made.commands.prompt
        assert _lines("\n".join(app.said[begin + 1 : end])) == _lines(expected), command
    assert made.session.here == app.commands.session.here


def test_bars_of_margins_share_their_zero_with_values_of_any_size() -> None:
    """Also where v is 1e-14 m/s as the pad is arrested."""
    made = session("brake_squeal")
    made.goto(2.6e-3)
    made.next_transition()
    rows = why_rows(made.why("pad 1"), "pad 1", (), 80)
    zeros = {text.index("│") for text in (plain([row.line]) for row in rows) if "│" in text}
    assert len(zeros) == 1


@pytest.mark.slow
def test_panels_show_the_values_of_the_view_with_units() -> None:
    made = session()

    async def action(app: FullScreen, pilot: Any) -> None:
        app.give("next", "next", "next", "step 3")
        await settle(pilot)

    app = drive(action, LARGE, made)
    seen = view(made)
    shown = app.panels["elements"].shown
    rows = re.findall(r"^[▶ ] E\d.*", shown, re.MULTILINE)
    scales = seen.contacts[0].scales
    assert scales["z"].unit == scales["s"].unit == "mm"
    for row, each in zip(rows, seen.elements, strict=True):
        assert row.split()[-2 - len(each.edges) :]
        assert f" {each.state} " in row
        assert f" {scales['F'].text(each.F)} " in row
        if each.s is not None and each.ratio is not None:
            assert f" {scales['s'].text(each.s)} " in row
            assert f" {each.ratio:.3f} " in row
            assert f" {scales['z'].text(each.variables[0])} " in row
    why = made.why(app.commands.elements.address(0))
    text = app.panels["why"].shown
    for each in why:
        assert each.verdict in _lines(text)
        for clause in each.clauses:
            margin = trimmed(clause.scale.text(clause.margin)) if clause.relative else "0, rounding"
            pattern = (
                rf"{'✓' if clause.holds else '✗'} {re.escape(clause.text)} .* {re.escape(margin)} "
            )
            assert re.search(pattern, text), (pattern, text)
    log = [each for each in app.panels["events"].shown.splitlines() if each.strip()]
    assert len(log) == len(made.branch.log())
    for row, record in zip(log, made.branch.log(), strict=True):
        assert f"{record.t:.9g} s" in row
        assert record.edge in row
