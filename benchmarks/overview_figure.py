"""Time to write pictures of a run with 100,000 rows (Fig. 4 motion, 100 s).

The limit is 5 s for the overview. Run it with ``python benchmarks/overview_figure.py``.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gms_fsm import GMS, GMSParameters, Prescribed, Trace, simulate
from gms_fsm.app.paper import FIG4_END, VELOCITY
from plots import figures

ROWS = 100_000
LIMIT = 5.0  # s


def main(rounds: int = 3) -> None:
    """Print a table of medians."""
    model = GMS(GMSParameters.paper("stick-slip"), law="published")
    run = simulate(model, Prescribed(VELOCITY), FIG4_END, t_eval=np.linspace(0.0, FIG4_END, ROWS))
    pictures: dict[str, Callable[[Trace], Figure]] = {
        "overview": figures.overview,
        "ribbons_figure": figures.ribbons_figure,
    }
    print(f"{len(run)} rows, {len(run.transitions)} transitions; the limit is {LIMIT:g} s")
    with tempfile.TemporaryDirectory() as folder:
        for name, draw in pictures.items():
            for ending in ("png", "svg"):
                path = Path(folder) / f"{name}.{ending}"
                times = []
                for _ in range(rounds):
                    fresh = replace(run)  # without the cached forces
                    start = time.perf_counter()
                    figures.save(draw(fresh), path)
                    times.append(time.perf_counter() - start)
                size = path.stat().st_size / 1e3
                print(f"{path.name:24}{statistics.median(times):8.2f} s{size:10.0f} kB")


if __name__ == "__main__":
    main()
