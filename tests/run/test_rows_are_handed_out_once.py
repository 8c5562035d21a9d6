"""A trace has rows of its own, also where the compiled engine hands out its columns uncopied."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import simulate, sweep
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun
from gms_fsm.run.settings import Settings
from gms_fsm.systems.mounted import mounted
from tests.helpers import pulled_mass

pytest.importorskip("llvmlite", reason="needs the extra fast")
TIMES = np.linspace(0.0, 20.0, 501)


def test_the_next_run_does_not_write_into_the_rows_of_the_one_before() -> None:
    model, rig = pulled_mass()
    run = CompiledRun(Problem.of(model, rig, 20.0, Settings(engine="compiled", t_eval=TIMES)))
    while run.advance():
        pass
    first = run.recorder.trace()
    kept = [first.t.copy(), first.rows.y.copy(), first.modes.copy(), first.microstep.copy()]
    other, rig = pulled_mass(np.array([50.0, 20.0, 20.0, 10.0]))
    run.reset(mounted(other, rig))
    while run.advance():
        pass
    second = run.recorder.trace()
    assert not np.array_equal(second.z, first.z)
    for column, before in zip(
        [first.t, first.rows.y, first.modes, first.microstep], kept, strict=True
    ):
        np.testing.assert_array_equal(column, before)


def test_a_sweep_has_the_rows_of_each_run() -> None:
    model, rig = pulled_mass()
    k = model.parameters.k * np.linspace(0.8, 1.2, 130)[:, None]  # two runs in each task
    found = sweep(model, rig, 20.0, {"k": k}, t_eval=TIMES)
    for run in (0, 1, 2, 3, 129):
        other, _ = pulled_mass()
        alone = simulate(
            type(other)(other.parameters.replaced(k=k[run]), law="signed"),
            rig,
            20.0,
            engine="compiled",
            t_eval=TIMES,
        )
        np.testing.assert_array_equal(found.rows["z"][run], alone.z)
