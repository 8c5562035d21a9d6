"""How a play bank predicts the damper: one record, one amplitude or one speed left out at a time.

Run as ``python docs/make_damper_study.py FOLDER``, the folder with the public records; it takes a
minute or two. Terms are chosen anew in each fold.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np

from gms_fsm.identification.bank import stop_operators
from gms_fsm.identification.folds import folds_of
from gms_fsm.identification.play_bank import PlayBank, play_bank
from gms_fsm.identification.problem.task import FitOptions
from gms_fsm.records import Record, damper


def predicted(bank: PlayBank, record: Record) -> np.ndarray:
    """Return the force of a bank along a record that is passed twice, without an offset."""
    motion = record.motion()
    x, low = motion.position, np.exp(-((motion.velocity / bank.v_s) ** 2))[:, None]
    z = stop_operators(np.concatenate([x, x]), bank.z_c)[-x.size :]
    k_f, k_b, d_f, d_b = bank.stiffness.T
    forward = (k_f + d_f * low) * np.maximum(0.0, z - bank.g)
    backward = (k_b + d_b * low) * np.minimum(0.0, z + bank.g)
    return (forward + backward).sum(axis=1) + bank.sigma_2 * motion.velocity


def scores(records: Sequence[Record], fold: str) -> dict[str, tuple[float, int]]:
    """Return error and number of rows of each record when it was left out."""
    found = {}
    for kept, left in folds_of(records, fold, FitOptions(free=("k",))).parts:
        bank = play_bank(kept, None)
        lost = [each.columns["force"] - predicted(bank, each) for each in kept]
        offset = float(np.concatenate(lost).mean())
        for record in left:
            error = predicted(bank, record) + offset - record.columns["force"]
            found[record.name] = float(np.sqrt(np.mean(error**2))), len(record)
    return found


if __name__ == "__main__":
    every = damper(sys.argv[1])
    for fold in ("record", "amplitude", "speed"):
        found = scores(every, fold)
        rmse, rows = np.array([*found.values()]).T
        print(f"{fold}: {np.sqrt((rows * rmse**2).sum() / rows.sum()):.0f} N over all rows")
        print("  " + " ".join(f"{each:.0f}" for each in rmse))
