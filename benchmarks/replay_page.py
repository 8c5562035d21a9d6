"""Size of the replay page of the Fig. 4 run, and the time per frame in Chromium.

Run: ``python benchmarks/replay_page.py`` (extra ``replay``, package playwright, program chromium).
"""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

from gms_fsm import GMS, GMSParameters, Prescribed, simulate
from plots.replay import write_replay

# Every row once; reading the layout forces the browser to compute it within the measured time.
WALK = """() => {
    const times = [];
    for (let k = 0; k < data.frames.t.length; k++) {
        const begin = performance.now();
        show(k);
        document.body.getBoundingClientRect();
        times.push(performance.now() - begin);
    }
    return times.sort((a, b) => a - b);
}"""


def main() -> None:
    """Print size, writing time, and time per frame: whole run in view, and zoomed in."""
    rig = Prescribed("0.15*sin(2*pi*t/25)")
    runs = [
        simulate(GMS(GMSParameters.paper("stick-slip"), law=law), rig, 100.0)
        for law in ("published", "signed")
    ]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        for name, traces in (("one run", runs[:1]), ("two runs", runs)):
            begin = time.perf_counter()
            path = write_replay(Path(folder, "page.html"), *traces)
            spent = time.perf_counter() - begin
            print(f"{name}: {path.stat().st_size / 1e3:.0f} kB, written in {spent:.2f} s")
            page = browser.new_page(viewport={"width": 1400, "height": 900})
            page.goto(path.as_uri())
            for zoom in ("whole run", "zoomed 16 times"):
                times = page.evaluate(WALK)
                middle, high = times[len(times) // 2], times[int(0.99 * len(times))]
                print(f"  {zoom}: {middle:.1f} ms per frame (99 % below {high:.1f} ms)")
                for _ in range(4):
                    page.keyboard.press("+")
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
