"""Drives the full-screen debugger without a terminal."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable
from html import unescape
from typing import Any

import pytest
from textual.pilot import Pilot

from gms_fsm.app.scenario import load_scenario, session_of
from gms_fsm.debugger.tui._app import FullScreen
from gms_fsm.session.session import Session

FIG_4 = "paper_fig4_stick_slip"
SMALL, LARGE = (80, 24), (200, 60)
WIDE = 12.2  # of a character in an exported picture


def session(scenario: str = FIG_4) -> Session:
    """Return a new session of a scenario."""
    return session_of(load_scenario(scenario))


async def settle(pilot: Pilot[Any]) -> None:
    """Wait until all commands have been answered and drawn."""
    app: Any = pilot.app
    quiet = 0
    for _ in range(1000):
        await pilot.pause()
        quiet = 0 if app.busy or app.waiting else quiet + 1
        if quiet == 3:  # once may be between two keys
            break
        await asyncio.sleep(0.005)
    assert not app.busy
    await pilot.pause()
    await pilot.pause()


async def press(pilot: Pilot[Any], *keys: str) -> None:
    """Press keys one after the other; commands wait for those before them."""
    await pilot.press(*keys)
    await settle(pilot)


def drive(
    action: Callable[[FullScreen, Pilot[Any]], Awaitable[None]],
    size: tuple[int, int] = SMALL,
    made: Session | None = None,
    **options: Any,
) -> FullScreen:
    """Open the debugger, let a function use it, and return it."""
    app = FullScreen(made or session(), "a title", **options)

    async def main() -> None:
        async with app.run_test(size=size) as pilot:
            await settle(pilot)
            await action(app, pilot)

    with pytest.MonkeyPatch.context() as patch:
        # Textual looks every 20 ms whether the process is idle, twice after each key.
        patch.setattr("textual._wait.SLEEP_GRANULARITY", 0.004, raising=False)
        patch.setattr("textual._wait.SLEEP_IDLE", 0.0004, raising=False)
        asyncio.run(main())
    return app


def typed(text: str) -> list[str]:
    """Return the keys that type a text."""
    names = {" ": "space", "=": "equals_sign", "-": "minus", ".": "full_stop", ":": "colon"}
    return [names.get(character, character) for character in text]


def screen_text(app: FullScreen) -> str:
    """Return what is on the screen, row by row."""
    rows: dict[float, dict[int, str]] = {}
    found = re.findall(
        r'<text class="[\w-]+-r\d+" x="([\d.]+)" y="([\d.]+)"[^>]*>(.*?)</text>',
        app.export_screenshot(),
    )
    for x, y, text in found:
        row = rows.setdefault(float(y), {})
        row |= enumerate(unescape(text).replace("\xa0", " "), round(float(x) / WIDE))
    return "\n".join(
        "".join(row.get(column, " ") for column in range(1 + max(row)))
        for _, row in sorted(rows.items())
    )
