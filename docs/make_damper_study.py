"""How a play bank predicts the damper: one record, one amplitude or one speed left out at a time.

Run as ``python docs/make_damper_study.py FOLDER``, the folder with the public records; it takes
some minutes. Terms are chosen anew in each fold. Of each record left out, six stretches of four
seconds are predicted, too, as records that begin in the midst of a motion: from the state that a
prediction begins in by default, and from one estimated from their first second.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from gms_fsm import Fit
from gms_fsm.identification.candidates import play_bank
from gms_fsm.identification.fit import fitted, task_of
from gms_fsm.identification.folds import folds_of
from gms_fsm.identification.problem.task import FitOptions
from gms_fsm.records import Record, damper
from gms_fsm.records.parts import thinned

ROWS = 900  # of each record that a bank is fitted to; all are predicted
CUTS, LENGTH, LEAD = 6, 4.0, 1.0  # stretches; s, of which the state is estimated from the first


def trained(records: Sequence[Record]) -> Fit:
    """Return the play bank of some records."""
    start = play_bank(records, None)
    options = FitOptions(free=start.free, weight="rows")
    few = [thinned(record, ROWS) for record in records]
    return fitted(task_of(few, start.model, {}, options), intervals=False)


def scored(fit: Fit, record: Record, initial: Any = None, lead: float = 0.0) -> tuple[float, int]:
    """Return the error behind the first seconds of a record, and the number of rows there."""
    error = fit.predict(record, initial) - record.columns["force"]
    error = error[record.columns["time"] >= record.columns["time"][0] + lead]
    return float(np.sqrt(np.mean(error**2))), error.size


def pooled(errors: Sequence[tuple[float, int]]) -> float:
    """Return the error over all rows, from pairs of an error and a number of rows."""
    rmse, rows = np.array(errors).T
    return float(np.sqrt((rows * rmse**2).sum() / rows.sum()))


if __name__ == "__main__":
    warnings.simplefilter("ignore")  # what lies outside of the training is what is asked for
    every = damper(sys.argv[1])
    default, estimated = list[tuple[float, int]](), list[tuple[float, int]]()
    for fold in ("record", "amplitude", "speed"):
        found = list[tuple[float, int]]()
        for kept, left in folds_of(every, fold, FitOptions(free=("k",))).parts:
            fit = trained(kept)
            found += [scored(fit, record) for record in left]
            last = left[0].columns["time"][-1] - 2.0 * LEAD
            for begin in last * np.arange(1, CUTS + 1) / CUTS if fold == "record" else ():
                part = left[0].between(begin, begin + LENGTH)
                default.append(scored(fit, part, None, LEAD))
                estimated.append(scored(fit, part, "estimate", LEAD))
        print(f"{fold}: {pooled(found):.0f} N over all rows")
        print("  " + " ".join(f"{rmse:.0f}" for rmse, _ in found), flush=True)
    worst = max(b[0] / a[0] for a, b in zip(default, estimated, strict=True))
    print(
        f"{len(default)} stretches, behind their first second: {pooled(default):.0f} N by default, "
        f"{pooled(estimated):.0f} N from an estimated state, at worst {worst:.2f} times the default"
    )
