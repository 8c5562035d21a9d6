"""Make the pictures of terminals in docs/images; run it with ``make gallery``."""

from __future__ import annotations

import asyncio
import io
import re
from pathlib import Path

from rich.console import Console, Group

from gms_fsm.app.live import LiveView
from gms_fsm.app.scenario import load_scenario, session_of
from gms_fsm.debugger.tui._app import FullScreen
from gms_fsm.foundation.files import write_whole
from gms_fsm.run.simulate import Moment

FOLDER = Path(__file__).parent / "images"
SCENARIOS = Path(__file__).parents[1] / "gms_fsm" / "scenarios"
FONTS = "DejaVu Sans Mono, Menlo, Consolas, monospace"


def main() -> None:
    """Write every picture."""
    fig_4 = "paper_fig4_stick_slip"
    screen("debugger_why", fig_4, (124, 38), "goto 100", "goto 25", "why 1")
    screen("debugger_small", fig_4, (80, 24), "goto 100", "goto 87.4", "next", "why 1")
    screen(
        "debugger_branches",
        fig_4,
        (150, 46),
        "break valid arrest element 1",
        "continue",
        "continue",
        "poke z1=-1.4",
        "compare",
        "next",
        light=True,
    )
    steps = "element pad 1", "goto 0.01", "goto 0.0026", "next"
    screen("debugger_brake", "brake_squeal", (124, 42), *steps)
    live("live", "pulled_mass", 0.29)


def screen(
    name: str, scenario: str, size: tuple[int, int], *lines: str, light: bool = False
) -> None:
    """Write the full-screen debugger after some commands."""
    loaded = load_scenario(SCENARIOS / f"{scenario}.toml")
    app = FullScreen(session_of(loaded), loaded.title, light=light)

    async def show() -> str:
        async with app.run_test(size=size) as pilot:
            app.give(*lines)
            while app.busy:
                await pilot.pause(0.05)
            await pilot.pause(0.5)
            return app.export_screenshot(title="gms-fsm debug --tui")

    save(name, asyncio.run(show()))


def live(name: str, scenario: str, t: float) -> None:
    """Write the live view of a run at a time."""
    loaded = load_scenario(SCENARIOS / f"{scenario}.toml")
    console = Console(record=True, file=io.StringIO(), width=80, force_terminal=True)
    moments: list[Moment] = []
    loaded.simulate(progress=moments.append)
    view = LiveView(console, 0.0, loaded.arguments["t_end"], detail=True, pace=1.0)
    console.print(Group(*view.picture(moments[-1].at(t))), highlight=False)
    save(name, console.export_svg(title="gms-fsm run --live --pace 1"))


def save(name: str, svg: str) -> None:
    """Write a picture that needs no network: with the fonts of the reader's machine."""
    svg = re.sub(r"@font-face \{.*?\}", "", svg, flags=re.DOTALL).replace("Fira Code", FONTS)
    svg = re.sub(r"[ \t]+\n", "\n", svg)
    write_whole(FOLDER / f"{name}.svg", lambda file: file.write(svg.encode()))


if __name__ == "__main__":
    main()
