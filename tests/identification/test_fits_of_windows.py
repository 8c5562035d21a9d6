"""Fits look at training rows only, run in where a record begins in motion, and run again saved."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Record, System, fit
from gms_fsm.app.scenario import load_scenario
from tests.identification.records import bank, measured, sine

pytest.importorskip("llvmlite", reason="fits take long without machine code")

TRUTH = bank([2e4, 5e3], [5e-5, 1e-4])
START = bank([1e4, 1e4], [4e-5, 9e-5])


@functools.cache
def _record(cycles: float = 6.0) -> Record:
    return measured(TRUTH, sine(3e-4, 2.0, cycles), 0.01, 0)


def test_test_rows_are_not_read() -> None:
    record = _record()
    force = record.columns["force"].copy()
    force[record.columns["time"] >= 8.0] = 1e6
    spoilt = replace(record, columns={**record.columns, "force": force})
    one, two = (
        fit(each, START, free=("k", "weights"), train=(0, 8), test=(8, 20), search="local")
        for each in (record, spoilt)
    )
    assert [each.value for each in one.table] == [each.value for each in two.table]
    assert [each.low for each in one.table] == [each.low for each in two.table]
    assert one.held_out is not None
    assert two.held_out is not None
    assert one.held_out["rmse"] == pytest.approx(0.01, rel=0.1)
    assert two.held_out["rmse"] > 1e5


def test_a_record_that_begins_in_motion_runs_in() -> None:
    whole = _record(12.0)
    late = whole.between(9.3, 24.0)  # in the middle of a stroke, all elements deflected
    found = fit(late, START, free=("k", "weights"), search="local")
    assert found.begin == "run in"
    assert found["k1"].value == pytest.approx(2e4, rel=0.01)
    assert found.training["rmse"] == pytest.approx(0.01, rel=0.05)
    relaxed = fit(late, START, free=("k", "weights"), search="local", begin="relaxed")
    assert relaxed.training["rmse"] > 0.02


def test_a_record_that_begins_relaxed_in_motion_is_found_out() -> None:
    t = np.linspace(0.0, 8.0, 1601)
    v = 1e-3 * np.cos(np.pi * t)
    motion = Record.from_arrays(time=t, velocity=v)
    found = fit(measured(TRUTH, motion, 0.01, 0), START, free=("k", "weights"), search="local")
    assert found.begin == "relaxed"
    assert found["k1"].value == pytest.approx(2e4, rel=0.01)


def test_parts_of_one_record_predict_each_other() -> None:
    whole = _record(12.0)
    found = fit(whole.between(0, 12), START, free=("k", "weights"), search="local")
    rest = whole.between(13.1, 24.0)
    assert found.predict(rest).shape == (len(rest),)
    assert found.score(rest)["rmse"] == pytest.approx(0.01, rel=0.1)


def test_the_saved_scenario_gives_the_same_force(tmp_path: Path) -> None:
    record = _record(3.0)
    found = fit(record, START, free=("k", "weights"), nuisance=(), search="local")
    loaded = load_scenario(found.save(tmp_path / "fitted.toml"))
    assert isinstance(loaded.system, System)
    run = loaded.simulate(t_eval=record.columns["time"], rtol=1e-9)
    contact = run.contact("friction")
    assert pytest.approx(found.predict(record), abs=1e-7) == contact.F
    assert loaded.scenario.title == "GMS, 2 elements, signed law fitted to synthetic"


def test_several_records_are_one_experiment() -> None:
    motions = [sine(3e-4, 2.0, 3.0), sine(1e-4, 1.0, 4.0)]
    both = [measured(TRUTH, motion, 0.01, i) for i, motion in enumerate(motions)]
    found = fit(both, START, free=("k", "weights"), search="local")
    alone = fit(both[0], START, free=("k", "weights"), search="local")
    assert found.training["rows"] == sum(map(len, both))
    assert found["k1"].value == pytest.approx(2e4, rel=0.01)
    width = [each["k2"].high - each["k2"].low for each in (found, alone)]
    assert width[0] < width[1]
