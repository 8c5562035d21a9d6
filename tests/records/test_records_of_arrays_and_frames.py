"""Arrays and data frames give the record that the same numbers in a file give.

If they cannot, the message names array and index, or column and row.
"""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Record, RecordError
from gms_fsm.records import Column
from tests.scenario_files import table

T = np.arange(40) * 0.25
X = np.sin(T)
F = np.cos(3 * T)


def same(one: Record, other: Record) -> None:
    assert one.columns.keys() == other.columns.keys()
    for name, value in one.columns.items():
        np.testing.assert_array_equal(value, other.columns[name])
    np.testing.assert_array_equal(one.chosen, other.chosen)


def in_file(tmp_path: Path, **options: Any) -> Record:
    (tmp_path / "rig.csv").write_text(table(["t_s", "x_mm", "F_N"], T, X, F))
    return Record.from_csv(tmp_path / "rig.csv", **options)


@pytest.mark.parametrize(
    "force", ["F_N", ("F_N", "N"), ("F_N", "N", 1), Column("F_N", "N")], ids=repr
)
def test_a_column_can_be_given_in_four_ways(tmp_path: Path, force: Any) -> None:
    record = in_file(tmp_path, force=force)
    same(record, Record.from_arrays(time=T, position=1e-3 * X, force=F))
    assert (record.name, record.path) == ("rig", tmp_path / "rig.csv")
    assert repr(record) == "<Record 'rig': 40 rows, 9.75 s, position, force>"
    some = in_file(tmp_path, where="time < 2 s or time > 3 s", name="x" * 10_000)
    assert "40 rows (35 selected), 9.75 s" in repr(some)
    assert len(repr(some)) < 300


@pytest.mark.parametrize("kind", [list, tuple, np.asarray, np.ma.asarray, np.float32])
def test_anything_like_an_array_is_copied_and_cannot_be_changed(kind: Any) -> None:
    given = Record.from_arrays(time=kind([0, 1, 2, 3, 4, 5]), velocity=kind([0, 1, 2, 3, 4, 5]))
    assert given.columns["velocity"].tolist() == [0, 1, 2, 3, 4, 5]
    assert given.columns["velocity"].dtype == float
    time = T.copy()
    record = Record.from_arrays(time=time, position=X)
    time[0] = 9.0
    assert record.columns["time"].tolist() == T.tolist()
    for array in (*record.columns.values(), record.chosen, record.rows):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0


# --------------------------------------------------------------------------- data frames
@pytest.fixture
def pandas() -> Any:
    return pytest.importorskip("pandas", reason="data frames need the extra 'pandas'")


def test_a_frame_is_read_as_its_file(tmp_path: Path, pandas: Any) -> None:
    record = in_file(tmp_path, where="force > 0 N", force=("F_N", "mN", -1))
    frame = pandas.read_csv(tmp_path / "rig.csv")
    again = Record.from_dataframe(frame, where="force > 0 N", force=("F_N", "mN", -1), name="a")
    same(record, again)
    assert again.name == "a"
    assert f"{(F < 0).sum()} of 40 rows are selected" in again.notes[0]


@pytest.mark.parametrize("kind", ["float64", "Float64", "object"])
def test_gaps_of_every_kind(pandas: Any, kind: str) -> None:
    frame = pandas.DataFrame({"t_s": T, "x_mm": X, "F_N": F}, dtype=kind)
    frame.loc[8, "F_N"] = None
    with pytest.raises(RecordError, match="row 8, column 'F_N': not a finite number"):
        Record.from_dataframe(frame)
    for missing in ("drop", "interpolate"):
        record = Record.from_dataframe(frame, missing=missing)
        assert (len(record), np.flatnonzero(~record.chosen).tolist()) == (40, [8])


def test_wrong_frames_are_named(pandas: Any) -> None:
    frame = pandas.DataFrame({"t_s": T, "x_mm": X, "F": F})
    with pytest.raises(RecordError, match=r"no column 'F_N' \(for force\); columns: 't_s', 'x_mm'"):
        Record.from_dataframe(frame)
    assert len(Record.from_dataframe(frame, force=None)) == 40
    double = pandas.concat([frame, frame["F"]], axis=1)
    with pytest.raises(RecordError, match="several columns 'F'"):
        Record.from_dataframe(double, force="F")
    frame["t_s"] = pandas.to_datetime(frame["t_s"], unit="s")
    with pytest.raises(RecordError, match=r"column 't_s' is not an array.*datetime64.*seconds"):
        Record.from_dataframe(frame, force="F")
    with pytest.raises(RecordError, match="no column is given for 'time'"):
        Record.from_dataframe(frame, time=None)  # type: ignore[arg-type]


# --------------------------------------------------------------------------- what a record can do


def test_parts_side_by_side_share_no_row() -> None:
    record = Record.from_arrays(time=T, position=X, force=F, name="rig")
    parts = record.between(None, 5.0), record.between(5.0)
    for name in record.columns:
        joined = np.concatenate([part.columns[name] for part in parts])
        np.testing.assert_array_equal(joined, record.columns[name])
    assert record.between(1.0, 5.0).columns["time"].tolist() == T[(T >= 1) & (T < 5)].tolist()
    assert record.between(1.0, 5.0).rows.tolist() == [*range(4, 20)]
    assert parts[0].name == "rig"


def test_a_part_of_a_part_keeps_the_selection(tmp_path: Path) -> None:
    record = in_file(tmp_path, where="force > 0 N")
    part = record.between(1.0, 8.0).between(2.0, 7.0)
    expected = (record.columns["time"] >= 2.0) & (record.columns["time"] < 7.0)
    np.testing.assert_array_equal(part.chosen, record.chosen[expected])


def test_a_motion_is_computed_once() -> None:
    record = Record.from_arrays(time=T, position=X)
    assert record.motion() is record.motion(None)
    assert record.motion(0.5) is record.motion(0.5)
    assert record.motion(0.5) is not record.motion()
    assert record.between(0.0, 5.0).motion().time.size == 20


def test_it_can_be_sent_to_another_process() -> None:
    record = Record.from_arrays(time=T, position=X)
    again = pickle.loads(pickle.dumps(record))
    same(record, again)
    np.testing.assert_array_equal(again.motion().velocity, record.motion().velocity)
