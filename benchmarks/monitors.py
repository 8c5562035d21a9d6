"""Cost of all monitors together: the pulled mass, 60 s, alternately with and without them.

Processor time, medians of interleaved rounds; the limit is 15 %. Run it from the project's root.
"""

from __future__ import annotations

import statistics
import time

import numpy as np

from gms_fsm import GMS, GMSParameters, PulledSlider, Stribeck, Trace, simulate
from gms_fsm.traces.monitors import examine

ROUNDS = 40
MONITORS = ("all", "abs(z) <= 1.6*s")


def run(monitors: tuple[str, ...]) -> Trace:
    """Return a run with 72 transitions of four elements, 2044 rows."""
    k = np.array([40.0, 30.0, 20.0, 10.0])
    parameters = GMSParameters(
        k,
        [0.4, 0.3, 0.2, 0.1],
        [0.02] * 4,
        sigma_2=0.4,
        v_c=1e-6,
        weights=1 / (4 * k),
        stribeck=Stribeck(F_c=1.0, F_s=1.5, v_s=0.05),
    )
    model = GMS(parameters, law="signed")
    return simulate(model, PulledSlider(1.0, 2.0, 0.1), 60.0, monitors=monitors)


def main() -> None:
    """Print the ratio, and where the time goes."""
    without, watched = [], []
    for _ in range(ROUNDS):
        for monitors, times in (((), without), (MONITORS, watched)):
            start = time.process_time()
            trace = run(monitors)
            times.append(time.process_time() - start)
    ratio = statistics.median(b / a for a, b in zip(without, watched, strict=True))
    print(f"{len(trace)} rows, {len(trace.transitions)} transitions, {ROUNDS} rounds")
    print(f"without monitors   {1e3 * statistics.median(without):7.2f} ms")
    print(f"with all of them   {1e3 * statistics.median(watched):7.2f} ms   ratio {ratio:.3f}")
    trace = run(())
    start = time.process_time()
    examine(trace, "0 <= t and v <= 1")
    first = time.process_time() - start
    print(f"v, s, F of all rows, also needed to read the trace: {1e3 * first:.2f} ms")
    for name in ("chattering", "passivity", "coverage", MONITORS[1]):
        times = []
        for _ in range(ROUNDS):
            start = time.process_time()
            examine(trace, name)
            times.append(time.process_time() - start)
        print(f"  {name:<18} {1e3 * statistics.median(times):6.2f} ms")


if __name__ == "__main__":
    main()
