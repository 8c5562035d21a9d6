"""A bank of the tribometer's training rows, run as it is, explains at least 99.5 % of them."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Prescribed, initial_bank, simulate
from gms_fsm.records import tribometer
from tests.helpers import FASTEST
from tests.scenario_files import data_folder

TRAIN = (20.0, 100.0)


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 15])
def test_the_bank_explains_the_training_rows(n: int) -> None:
    record = tribometer(data_folder())
    model = initial_bank(record, n, train=TRAIN)
    assert model.n == n
    motion = record.motion()
    rows = motion.time < TRAIN[1]
    trace = simulate(
        model,
        Prescribed((motion.time, motion.velocity)),
        TRAIN[1],
        t_start=float(motion.time[0]),
        t_eval=motion.time[rows],
        engine=FASTEST,
    )
    trained = motion.time[rows] >= TRAIN[0]
    modelled = np.interp(motion.time[rows], trace.t, trace.F)[trained]
    measured = record.columns["force"][rows][trained]
    r2 = 1.0 - np.var(measured - modelled) / np.var(measured)  # with an offset
    assert r2 >= 0.995
