"""Live charts: 500 frames of a bank of four elements, as SVG and as a GIF.

The limit for the SVG frames is 15 s. Run it from the project's root.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from gms_fsm import GMS, GMSParameters, Prescribed, Trace, simulate
from plots.charts.live_chart import LiveChart
from plots.film.animation import animate

FRAMES = 500


def run() -> Trace:
    """Fig. 4 of the paper with the signed law: a bank that breaks away and arrests."""
    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    return simulate(model, Prescribed("0.15*sin(2*pi*t/25)"), 100.0)


def main() -> None:
    """Print seconds."""
    trace = run()
    start = time.perf_counter()
    chart = LiveChart(trace, values=True)
    layout = time.perf_counter() - start
    times = [k * float(trace.t[-1]) / (FRAMES - 1) for k in range(FRAMES)]
    start = time.perf_counter()
    size = sum(len(chart.frame(chart.at(t))) for t in times)
    frames = time.perf_counter() - start
    print(f"layout, once            {layout:7.2f} s")
    print(f"{FRAMES} SVG frames          {frames:7.2f} s  ({1e-3 * size / FRAMES:.0f} kB each)")
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        path = animate(trace, Path(folder, "run.gif"), frames=FRAMES)
        film = time.perf_counter() - start
        print(f"{FRAMES} frames as a GIF     {film:7.2f} s  ({1e-6 * path.stat().st_size:.1f} MB)")


if __name__ == "__main__":
    main()
