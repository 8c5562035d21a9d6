"""How often 95 % intervals of fits hold the truth, under noise that is correlated from row to row.

``python -m tests.soak.coverage [DRAWS] [searched]``: the forward simulator is `stop_operators`, the
noise AR(0.95), 200 draws by default; between 90 and 99 % of the intervals of every parameter and of
the offset must hold. With ``searched`` the threshold is found, too, which takes some minutes.
"""

from __future__ import annotations

import sys

import numpy as np

from gms_fsm import ChartModel, Record, fit
from gms_fsm.identification.bank import stop_operators
from gms_fsm.identification.play_bank import SPRING_WITH_PLAY
from tests.identification.records import noise

TRUTH = {"k_f": 2e4, "k_b": 3e4, "z_c": 2e-4, "sigma_2": 20.0, "offset": 0.1}
CORRELATION = 0.95


def hits(draw: int, names: list[str]) -> list[bool]:
    """Return which intervals of one draw hold."""
    t = np.arange(2000) * 0.01
    v = 2e-3 * np.sin(2.0 * np.pi * t / 2.0) + 1e-3 * np.sin(2.0 * np.pi * t / 0.7)
    x = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (v[1:] + v[:-1]))])
    z = stop_operators(x, [TRUTH["z_c"]])[:, 0]
    force = TRUTH["k_f"] * np.maximum(z, 0.0) + TRUTH["k_b"] * np.minimum(z, 0.0)
    force += TRUTH["sigma_2"] * v + TRUTH["offset"] + 0.3 * noise(draw, t.size, CORRELATION)
    record = Record.from_arrays(time=t, velocity=v, force=force)
    start = {"k_f": 1e4, "k_b": 1e4, "d_f": 0.0, "d_b": 0.0, "g": 0.0, "v_s": 1.0}
    model = ChartModel(SPRING_WITH_PLAY, {**start, "z_c": TRUTH["z_c"]})
    found = fit(record, model, free=names, search="local", begin="relaxed", progress=False)
    return [found[name].low <= TRUTH[name] <= found[name].high for name in (*names, "offset")]


if __name__ == "__main__":
    draws = int(next((each for each in sys.argv[1:] if each.isdigit()), "200"))
    names = ["k_f", "k_b", "sigma_2", *(["z_c"] if "searched" in sys.argv else [])]
    held = np.zeros(len(names) + 1)
    for draw in range(draws):
        held += hits(draw, names)
    for name, count in zip([*names, "offset"], held, strict=True):
        print(f"{name:8s} {count:.0f} of {draws}")
    sys.exit(int(not ((held >= 0.9 * draws) & (held <= 0.99 * draws)).all()))
