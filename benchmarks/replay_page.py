"""Replay pages: size, time to write and to open, frames per second while playing.

Run: ``python -m benchmarks.replay_page`` (extra ``replay``, package playwright, program chromium).
Without a graphics processor, so the browser draws with the processor as well.
"""

from __future__ import annotations

import shutil
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

from gms_fsm import Trace, simulate
from plots.page.replay import write_replay
from tests.helpers import FIG4_SINE, Prescribed, bank, pulled_mass, stick_slip

SECONDS = 4.0
RUNS: dict[str, Callable[[], Trace]] = {
    "Fig. 4": lambda: simulate(stick_slip("published"), Prescribed(FIG4_SINE), 100.0),
    "pulled mass, 60 s": lambda: simulate(*pulled_mass(), 60.0),
    "20 elements, 100 s": lambda: simulate(bank(20), Prescribed("0.15*sin(2*pi*t/5)"), 100.0),
    "pulled mass, 800,000 rows": lambda: simulate(*pulled_mass(), 22_300.0, engine="compiled"),
}
# Every row once; reading the layout forces the browser to compute it within the measured time.
WALK = """() => {
    const times = [], step = Math.max(1, Math.floor(frames.t.length / 1000));
    for (let k = 0; k < frames.t.length; k += step) {
        const begin = performance.now();
        show(k);
        document.body.getBoundingClientRect();
        times.push(performance.now() - begin);
    }
    return times;
}"""
# The times between pictures while the page plays.
PLAY = """(seconds) => new Promise((done) => {
    const times = [];
    show(0);
    setPlaying(true);
    let last = performance.now();
    const begin = last;
    requestAnimationFrame(function next(now) {
        times.push(now - last);
        last = now;
        if (now - begin < 1000 * seconds) requestAnimationFrame(next);
        else { pause(); done(times.slice(2)); }
    });
})"""


def at(times: list[float], share: float) -> float:
    """Return the time that this share of the times does not exceed."""
    return sorted(times)[int(share * (len(times) - 1))]


def measure(page: Page, name: str) -> None:
    """Print the frames of one view of a page."""
    walk, played = page.evaluate(WALK), page.evaluate(PLAY, SECONDS)
    rate = 1000.0 / statistics.mean(played)
    print(
        f"  {name:<12} a row takes {at(walk, 0.5):4.1f} ms (99 %: {at(walk, 0.99):4.1f}); playing, "
        f"{rate:4.1f} frames/s (99 % of them within {at(played, 0.99):4.1f} ms)"
    )


def main() -> None:
    """Print the figures of each run, view by view."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        for name, make in RUNS.items():
            trace = make()
            begin = time.perf_counter()
            path = write_replay(Path(folder, "page.html"), trace)
            spent = time.perf_counter() - begin
            page = browser.new_page(viewport={"width": 1366, "height": 657})
            begin = time.perf_counter()
            page.goto(path.as_uri())
            opened = time.perf_counter() - begin
            print(
                f"{name}: {len(trace)} rows, {len(trace.transitions)} transitions; "
                f"{path.stat().st_size / 1e6:.2f} MB, written in {spent:.2f} s, opened in "
                f"{opened:.2f} s"
            )
            for tab in page.get_by_role("tab").all():
                tab.click()
                measure(page, tab.inner_text())
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
