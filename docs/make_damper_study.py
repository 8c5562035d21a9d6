"""How a play bank predicts the damper: one record, one amplitude or one speed left out at a time.

Run as ``python docs/make_damper_study.py FOLDER``, the folder with the public records; it takes a
minute or two. Terms are chosen anew in each fold, and every row of a record counts.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence

import numpy as np

from gms_fsm.identification.candidates import play_bank
from gms_fsm.identification.fit import fitted, task_of
from gms_fsm.identification.folds import folds_of
from gms_fsm.identification.problem.task import FitOptions
from gms_fsm.records import Record, damper


def scores(records: Sequence[Record], fold: str) -> dict[str, tuple[float, int]]:
    """Return error and number of rows of each record when it was left out."""
    found = {}
    for kept, left in folds_of(records, fold, FitOptions(free=("k",))).parts:
        start = play_bank(kept, None)
        options = FitOptions(free=start.free, search="local")
        fit = fitted(task_of(kept, start.model, {}, options), intervals=False)
        for record in left:
            error = fit.predict(record) - record.columns["force"]
            found[record.name] = float(np.sqrt(np.mean(error**2))), len(record)
    return found


if __name__ == "__main__":
    warnings.simplefilter("ignore")  # what is left out is outside of the training
    every = damper(sys.argv[1])
    for fold in ("record", "amplitude", "speed"):
        rmse, rows = np.array([*scores(every, fold).values()]).T
        print(f"{fold}: {np.sqrt((rows * rmse**2).sum() / rows.sum()):.0f} N over all rows")
        print("  " + " ".join(f"{each:.0f}" for each in rmse))
