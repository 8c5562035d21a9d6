"""The full-screen debugger clips no text, on small and on large terminals."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("textual", reason="needs the extra tui")

from gms_fsm import Prescribed
from gms_fsm.debugger.tui._app import PAGES, FullScreen
from gms_fsm.debugger.tui._widgets import Panel
from gms_fsm.session.session import Session
from tests.app.full_screen import LARGE, SMALL, drive, press, screen_text, session, settle
from tests.helpers import FIG4_SINE, bank

pytestmark = pytest.mark.slow


def _check(app: FullScreen, size: tuple[int, int]) -> set[str]:
    """Assert that each visible panel is on the screen and its lines fit; return their names."""
    whole = app.screen.region
    assert (whole.width, whole.height) == size
    seen = set()
    for panel in app.screen.query(Panel):
        if not panel.display or not panel.region.height or not panel.region.width:
            continue
        seen.add(str(panel.id))
        assert whole.contains_region(panel.region), panel.id
        inside = panel.scrollable_content_region
        assert inside.height >= 1, panel.id
        assert inside.width >= 20, panel.id
        for row in panel.rows:
            text = "".join(span.text for span in row.line)
            wide = panel.max_scroll_x + inside.width  # the chart can be scrolled sideways
            assert len(text.rstrip()) <= wide, (panel.id, text)
        assert panel.max_scroll_y + inside.height >= len(panel.rows), panel.id
    for name in ("#status", "#line", "#keys"):
        assert whole.contains_region(app.query_one(name).region), name
    status = screen_text(app).splitlines()[: app.status.region.height]
    assert f"t = {app.seen.t:.9g} s" in status[0]
    for contact in app.seen.contacts:
        assert any(contact.here.written("F") in text for text in status)
    bar = app.keys
    assert bar.places[-1][1] <= size[0]
    assert [place[2] for place in bar.places[-2:]] == ["help", "leave"]
    return seen


@pytest.mark.every(4)
@pytest.mark.parametrize(
    ("scenario", "sizes"),
    [
        ("brake_squeal", [SMALL]),
        ("twelve", [SMALL, LARGE]),
        ("ball_screw_table", [(120, 36)]),
        ("drill_string", [(132, 43)]),
    ],
)
def test_every_panel_is_on_the_screen_and_its_lines_fit(
    scenario: str, sizes: list[tuple[int, int]]
) -> None:
    async def action(app: FullScreen, pilot: Any) -> None:
        app.give("next", "next")
        app.action_break()
        for size in sizes:
            await pilot.resize_terminal(*size)
            await settle(pilot)
            seen = _check(app, size)
            assert ("events" in seen) == (size[0] > 100)
            for _ in range(1, PAGES if app.small else 1):
                await press(pilot, "v")
                seen |= _check(app, size)
            assert seen == {"chart", "why", "ribbons", "elements", "events", "session", "answers"}
            await press(pilot, "question_mark")
            assert app.screen.region.contains_region(app.screen.query_one(Panel).region)
            await press(pilot, "escape")

    drive(
        action,
        sizes[0],
        Session(bank(12), Prescribed(FIG4_SINE), 100.0)
        if scenario == "twelve"
        else session(scenario),
    )


def test_the_chart_of_an_element_is_whole_at_every_size() -> None:
    parts = ("stick", "slip  ◉ ACTIVE", "dz = sgn(v) * C * (1 - z / s)", "[z >= s && v > v_c]")

    async def action(app: FullScreen, pilot: Any) -> None:
        app.give("goto 25")
        for size in (SMALL, (100, 30), (120, 36), LARGE):
            await pilot.resize_terminal(*size)
            await settle(pilot)
            text = screen_text(app)
            for part in (*parts, "E1", "E2", "E3", "E4"):
                assert part in text, size
            chart = app.panels["chart"]
            assert chart.max_scroll_y == 0
            assert chart.max_scroll_x == 0

    drive(action)


def test_a_tiny_terminal_does_no_harm() -> None:
    async def action(app: FullScreen, pilot: Any) -> None:
        app.give("next", "why 1")
        for size in ((40, 12), (10, 4)):
            await pilot.resize_terminal(*size)
            await settle(pilot)
            await press(pilot, "v", "v", "question_mark", "escape", "d")
        assert app.commands.session.branch.cursor == 11

    drive(action)
