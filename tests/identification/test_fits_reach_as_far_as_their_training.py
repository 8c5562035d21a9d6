"""A fit goes on from the state a record begins in, says what lies outside, and is read back."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import ChartModel, Fit, Record
from gms_fsm.errors import RecordError
from gms_fsm.identification.bank import stop_operators
from gms_fsm.identification.choose import simplest
from gms_fsm.identification.play_bank import SPRING_WITH_PLAY, play_bank
from tests.identification.records import (
    FREE,
    NOISE,
    START,
    TRUTH,
    fitted,
    measured,
    plain,
    rubbed,
    sine,
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:.*outside of what was trained on"),
]
T = np.arange(0.0, 12.0, 0.01)


def stroke(begin: float, end: float, record: Record | None = None) -> Record:
    return (rubbed(12.0) if record is None else record).between(begin, end)


def test_a_state_is_estimated_from_the_first_seconds() -> None:
    short = stroke(9.3, 9.75)  # no way back: no run-in, and all elements are deflected
    found = plain()
    without = found.score(short)["rmse"]
    assert found.score(short, "estimate", lead=0.1)["rmse"] < min(2.0 * NOISE, 0.5 * without)
    bare = replace(short, columns={k: v for k, v in short.columns.items() if k != "force"})
    with pytest.raises(RecordError, match="no force in its first"):
        found.predict(bare, "estimate")


def test_a_given_state_is_where_a_prediction_begins() -> None:
    short, found = stroke(9.3, 9.75), plain()
    low, high = (found.predict(short, {"z": z})[0] for z in ([-3e-5, -3e-5], [3e-5, 3e-5]))
    assert high - low == pytest.approx(6e-5 * (found["k1"].value + found["k2"].value), rel=1e-3)


def test_a_gap_splits_a_fit_and_the_state_behind_it_is_found() -> None:
    record = rubbed(6.0)
    t = record.columns["time"]
    kept = (t < 5.0) | ((t > 8.3) & (t < 8.9))  # behind the gap less than a stroke
    columns = {name: value[kept] for name, value in record.columns.items()}
    cut = Record.from_arrays(**columns, name="cut")
    found = fitted(cut)
    assert found["k1"].value == pytest.approx(2e4, rel=0.02)
    assert found.training["rmse"] == pytest.approx(NOISE, rel=0.1)
    assert "the states in which 1 stretch(es) begin were found, too" in found.notes
    assert np.isfinite(found.predict(cut)).all()


def test_a_missing_force_is_not_compared() -> None:
    record = rubbed(6.0)
    force = record.columns["force"].copy()
    force[200:400] = np.nan
    given = {name: value for name, value in record.columns.items() if name != "force"}
    found = fitted(Record.from_arrays(**given, force=force, missing="drop"))
    assert found.training["rows"] == len(record) - 200
    assert found["k1"].value == pytest.approx(2e4, rel=0.02)


def test_what_lies_outside_is_said() -> None:
    wide = measured(TRUTH, sine(9e-4, 2.0, 2.0))
    assert plain().outside(stroke(8.0, 12.0)) == ()
    assert "the amplitude is 900 µm, in training at most 300 µm" in plain().outside(wide)
    with pytest.warns(UserWarning, match="outside of what was trained on: the amplitude"):
        plain().predict(wide)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plain().predict(stroke(8.0, 12.0))


def test_a_fit_is_read_back(tmp_path: Path) -> None:
    path = plain().save(tmp_path / "fit.json")
    again = Fit.load(path)
    assert again.table == plain().table
    assert again.training == plain().training
    assert again.held_out == plain().held_out
    late = stroke(9.3, 24.0)
    np.testing.assert_array_equal(again.predict(late), plain().predict(late))
    path.write_text('{"format": "x"}')
    with pytest.raises(RecordError, match="this is not a fit"):
        Fit.load(path)


def test_the_simplest_model_has_no_term_that_cannot_be_told() -> None:
    found = fitted(rubbed(4.0), START, (*FREE, "sigma_2"))
    assert found.open == ("sigma_2",)
    simple = simplest(found)
    assert not simple.open
    assert {each.name for each in simple.table} >= {"k1", "k2", "weights1", "weights2"}
    assert simple.training["rmse"] < 1.01 * found.training["rmse"]
    assert "left out, as the records cannot tell them" in simple.notes[-1]


def test_records_count_alike_if_asked_and_where_lengths_differ_much() -> None:
    other = measured(TRUTH, sine(3e-4, 2.0, 1.0), NOISE, seed=1)
    long = rubbed(6.0)
    assert fitted([long, other], free=["k"]).task.fine.weights
    assert not fitted([long, other], free=["k"], weight="rows").task.fine.weights
    alike = fitted([long, other], free=["k"], weight="records")
    rows = [int(each.rows.sum()) for each in alike.task.fine.courses]
    weighed = [n * w**2 for n, w in zip(rows, alike.task.fine.weights, strict=True)]
    assert weighed[0] == pytest.approx(weighed[1])


def with_play(x: np.ndarray, begun: float, where: float = 0.0) -> Record:
    """Return the record of a spring with 3 mm of play, from a deflection.

    It slips at 6 mm, and then unevenly, as no model has it.
    """
    z = stop_operators(np.append(x[0] - begun, x), [6e-3])[1:, 0]
    force = 1e4 * np.maximum(0.0, z - 3e-3) + 2e4 * np.minimum(0.0, z + 3e-3)
    force += np.where(np.abs(z) < 6e-3, 0.1 * np.sin(40.0 * T), 8.0 * np.sin(0.6 * T))
    return Record.from_arrays(time=T, position=x + where, force=force)


def played() -> Fit:
    record = with_play(3e-2 * np.sin(2.0 * np.pi * T / 3.0), 0.0)
    bank = play_bank([record], None)
    assert len(bank.used) <= 4
    return fitted(record, ChartModel(SPRING_WITH_PLAY, bank.values, n=len(bank.z_c)), bank.used)


def test_a_play_bank_is_found_without_a_search() -> None:
    assert played().training["r2"] > 0.95


@pytest.mark.parametrize("where", [0.0, 0.04])
def test_a_state_is_estimated_in_strokes_that_begin_off_the_middle_of_the_play(
    where: float,
) -> None:
    found = played()
    for side in (1.0, -1.0):
        stroke = side * 5e-4 * (1.0 - np.cos(2.0 * np.pi * T / 3.0))
        touching = with_play(stroke, side * 2.7e-3, where)
        default = found.score(touching)["rmse"]
        assert found.score(touching, "estimate")["rmse"] < 0.3 * default
        free = with_play(8.0 * stroke, -side * 2.7e-3, where)  # nothing is touched
        assert found.score(free, "estimate")["rmse"] < 1.1 * found.score(free)["rmse"]


@pytest.mark.every(6)
@pytest.mark.parametrize("smoothing", [0.0, 0.002, 0.005, 0.01, 0.02])
def test_an_inertia_under_a_smoothing_is_covered_or_doubted(smoothing: float) -> None:
    t = np.arange(1000) * 0.005
    w, u = 2.0 * np.pi * 8.0, 2.0 * np.pi * 1.1
    x = 1e-3 * np.sin(w * t) + 3e-3 * np.sin(u * t)
    mass = -1e-3 * w**2 * np.sin(w * t) - 3e-3 * u**2 * np.sin(u * t)  # of 1 kg
    z = stop_operators(x, [1e-4])[:, 0]
    noise = 0.05 * np.random.default_rng(1).standard_normal(t.size)
    record = Record.from_arrays(time=t, position=x, force=2e4 * z + mass + noise)
    chart = {"k_f": 2e4, "k_b": 2e4, "d_f": 0.0, "d_b": 0.0, "g": 0.0, "z_c": 1e-4, "v_s": 1.0}
    model = ChartModel(SPRING_WITH_PLAY, chart)
    found = fitted(
        record, model, ["k_f", "k_b"], nuisance=["offset", "inertia"], smoothing=smoothing
    )["inertia"]
    assert found.low <= 1.0 <= found.high or "depends on the smoothing" in found.note


def test_a_velocity_given_as_a_position_is_noticed() -> None:
    v = 0.02 * np.sin(2.0 * np.pi * T / 2.0)
    force = 2.0 * np.tanh(v / 1e-3)
    model = ChartModel(
        SPRING_WITH_PLAY,
        {
            **dict.fromkeys(("k_f", "k_b"), 1e3),
            "d_f": 0.0,
            "d_b": 0.0,
            "g": 0.0,
            "z_c": 1e-3,
            "v_s": 1.0,
        },
    )
    with pytest.warns(UserWarning, match="if the column is a velocity, give velocity="):
        fitted(Record.from_arrays(time=T, position=v, force=force), model, ["k_f", "k_b"])
