"""Live pages of all shipped scenarios: 40 slider sets each have the floats of Python, in Chromium.

Measured too: size of the engine's text, time of a run against machine code, and while dragging the
inputs and the runs that are drawn.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm.exporters.live import live_engine
from gms_fsm.scenarios import shipped
from tests.plots.browser import browser
from tests.plots.live_pages import FOUND, differing, live_scenario

__all__ = ["browser"]

SETS, AT_ONCE = 40, 5
DATA = "GMS_FSM_DATA" in os.environ
NO_PAGE = {"earthquake"}  # it needs a method of SciPy
NAMES = [name for name in shipped() if name not in NO_PAGE and (DATA or name != "tribometer")]
TIMED = """(numbers) => {
    const dialled = wordsNow(), times = [];
    for (let k = 0; k < 30; k++) {
        const begin = performance.now();
        engines[live.number].run(dialled);
        times.push(performance.now() - begin);
    }
    return times.sort((a, b) => a - b)[10];
}"""
# Whether the memory has room for the run as it was written: else it is computed twice.
HAS_ROOM = """() => {
    const engine = new Engine(ENGINES[0]), { rows } = engine.rooms;
    engine.run([]);
    return engine.rooms.rows === rows;
}"""
# Inputs, and runs that were drawn, per second.
DRAGGED = """async (count) => {
    const dial = [...dials.values()].find(({ first, value }) => first && value > 0);
    const begin = performance.now();
    let drawn = 0;
    for (let k = 0, last = runs[0].found; k < count; k++) {
        await new Promise((then) => requestAnimationFrame(then));
        if (runs[0].found !== last) drawn += 1;
        last = runs[0].found;
        turn(dial, dial.given.value * (1 + 0.01 * (k % 7)));
    }
    return [count, drawn].map((each) => (1000 * each) / (performance.now() - begin));
}"""


@pytest.mark.parametrize("name", NAMES)
def test_all_floats_are_those_of_python(browser: Any, name: str, tmp_path: Path) -> None:
    scenario = live_scenario(name)
    path = scenario.page(tmp_path / "page.html")
    page = browser.new_page(viewport={"width": 1366, "height": 768})
    page.goto(path.as_uri())
    while not page.evaluate("(document.querySelector('#took') ?? {}).textContent"):
        page.wait_for_timeout(50)
    first = page.evaluate("live.took")
    sets = scenario.sets(SETS, page.evaluate("Object.keys(variant().engine)"))
    bad = count = switches = 0
    for k in range(0, SETS, AT_ONCE):
        for numbers, found in zip(
            sets[k : k + AT_ONCE], page.evaluate(FOUND, sets[k : k + AT_ONCE]), strict=True
        ):
            trace = scenario.run(numbers)
            wrong, floats = differing(found, trace)
            bad, count, switches = bad + wrong, count + floats, switches + len(trace.firings)
    here, python = page.evaluate(TIMED), compiled_time(scenario)
    inputs, drawn = page.evaluate(DRAGGED, 100)
    has_room = page.evaluate(HAS_ROOM)
    page.close()
    size = len(live_engine(scenario.start({}), name).text)
    print(
        f"{name}: {bad} of {count} floats differ in {SETS} runs, {switches} switches; "
        f"engine {size} bytes; run {here:.2f} ms, compiled {python:.2f} ms, "
        f"ratio {here / python:.1f}; first run {first:.0f} ms; "
        f"{inputs:.0f} inputs/s, {drawn:.0f} drawn/s"
    )
    assert bad == 0
    assert has_room


def compiled_time(scenario: Any) -> float:
    """Return the time of the compiled loop alone, ms."""
    from gms_fsm.run.recording.compiled_run import CompiledRun

    times = []
    for _ in range(30):
        run = CompiledRun(scenario.start({}))
        begin = time.perf_counter()
        while run.advance():
            pass
        times.append(1e3 * (time.perf_counter() - begin))
    return float(np.sort(times)[10])
