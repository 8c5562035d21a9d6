"""Recovery study: are the parameters that made a record found, and do intervals hold the truth.

    python benchmarks/recovery.py                  16 draws on a designed motion, white and AR(0.95)
    python benchmarks/recovery.py --motion DATA    on the tribometer's motion (a folder with its
                                                   record), AR(0.95) noise of 0.1 N

A bank of four GMS elements makes the force; noise is drawn; `initial_bank` and `fit` start from the
record alone. Found is the global minimum if the residual is as small as the noise. The fit knows
what it cannot know from such a record: the Coulomb friction that scales the weights, and v_c.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from gms_fsm import (
    GMS,
    Fit,
    GMSParameters,
    Prescribed,
    Record,
    Stribeck,
    excite,
    fit,
    initial_bank,
    simulate,
)
from gms_fsm.records.public_sets import tribometer

WEIGHTS = np.array([20e-6, 45e-6, 90e-6, 150e-6])  # m/N, with F_c = 1 N
K = np.array([0.25, 0.3, 0.25, 0.2]) * 2.33 / WEIGHTS
TRUTH = GMS(
    GMSParameters(
        K,
        np.zeros(4),
        np.full(4, 5e-4),
        sigma_2=100.0,
        stribeck=Stribeck(1.0, 1.3, 2e-4),
        v_c=5e-6,
        weights=WEIGHTS,
    ),
    law="signed",
)
VALUES = {f"k{i + 1}": float(value) for i, value in enumerate(K)}
VALUES |= {f"weights{i + 1}": float(value) for i, value in enumerate(WEIGHTS)}
VALUES |= {"C": 5e-4, "F_s": 1.3, "v_s": 2e-4, "sigma_2": 100.0, "offset": 0.0}
FREE = ("k", "weights", "C", "F_s", "v_s", "sigma_2")
CORRELATION = 0.95


def designed() -> Record:
    """Return a motion that tells all parameters apart."""
    return excite(400e-6, [5e-5, 2e-4, 1e-3, 3e-3], rate=200)


def of_tribometer(folder: Path) -> Record:
    """Return 60 s of the tribometer's motion."""
    motion = tribometer(folder).between(20, 80).motion(0.02)
    return Record.from_arrays(
        time=motion.time - motion.time[0], position=motion.position, velocity=motion.velocity
    )


def noise(seed: int, rows: int, correlation: float) -> np.ndarray:
    """Return noise of unit variance."""
    white = np.random.default_rng(seed).standard_normal(rows)
    return np.asarray(lfilter([np.sqrt(1.0 - correlation**2)], [1.0, -correlation], white))


def recovered(motion: Record, deviation: float, correlation: float, seed: int) -> Fit:
    """Return the fit to one draw of noise, from a start that knows the record only."""
    t, v = motion.columns["time"], motion.motion().velocity
    run = simulate(
        TRUTH, Prescribed((t, v)), t[-1], t_start=t[0], t_eval=t, rtol=1e-9, engine="compiled"
    )
    record = Record.from_arrays(
        time=t, velocity=v, force=run.F + deviation * noise(100 + seed, t.size, correlation)
    )
    given = initial_bank(record, 4).parameters
    start = given.replaced(
        v_c=TRUTH.parameters.v_c,
        weights=given.weights * given.stribeck.F_c,
        stribeck=Stribeck(1.0, 1.1, given.stribeck.v_s),
    )
    return fit(record, GMS(start, law="signed"), free=FREE, tied=("C",), seed=seed, progress=False)


def study(motion: Record, deviation: float, correlation: float, draws: int) -> None:
    """Print what is found in several draws."""
    found, opened, inside = 0, 0, defaultdict[str, list[bool]](list)
    for seed in range(draws):
        fitted = recovered(motion, deviation, correlation, seed)
        ratio = fitted.training["rmse"] / deviation
        found += ratio < (1.02 if correlation == 0.0 else 1.1)
        opened += bool(fitted.open)
        for each in fitted.table:
            if each.told:
                inside[each.name].append(each.low <= VALUES[each.name] <= each.high)
        missed = [name for name, hits in inside.items() if fitted[name].told and not hits[-1]]
        print(
            f"draw {seed:2d}: residual / noise {ratio:.4f}, {fitted.seconds:.0f} s, "
            f"{fitted.effective_rows:.0f} effective rows, cannot be told: "
            f"{', '.join(fitted.open) or '-'}; outside: {', '.join(missed) or '-'}",
            flush=True,
        )
    every = [hit for hits in inside.values() for hit in hits]
    print(
        f"{motion.name}, noise {deviation} N, correlation {correlation}: global minimum "
        f"{found}/{draws}; something cannot be told in {opened}/{draws}; the intervals of what is "
        f"told hold the truth in {100.0 * float(np.mean(every)):.1f} %\n",
        flush=True,
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motion", type=Path, help="folder with the tribometer's record")
    parser.add_argument("--draws", type=int, default=16)
    chosen = parser.parse_args()
    if chosen.motion is None:
        for each in (0.0, CORRELATION):
            study(designed(), 0.02, each, chosen.draws)
    else:
        study(of_tribometer(chosen.motion), 0.1, CORRELATION, chosen.draws)
