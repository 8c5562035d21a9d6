"""Empty cells and NaN are refused, left out or interpolated, as asked, and the notes count them.

Where a force is missing the motion goes on; nothing that was filled in is compared.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gms_fsm import Record

ROWS = 30
T = 0.5 * np.arange(ROWS)
LINE = {"time": T, "position": 3.0 * T - 1.0, "force": 2.0 - 0.25 * T}  # exact in binary


def read(tmp_path: Path, holes: dict[str, list[int]], empty: str = "", **options: Any) -> Record:
    """Read the table with holes in some rows, counted from 0."""
    lines = ["t,x,F"]
    for i in range(ROWS):
        cells = [
            empty if i in holes.get(name, []) else repr(float(v[i])) for name, v in LINE.items()
        ]
        lines.append(",".join(map(str, cells)))
    (tmp_path / "rig.csv").write_text("\n".join(lines))
    return Record.from_csv(tmp_path / "rig.csv", time="t", position="x", force="F", **options)


@pytest.mark.parametrize("empty", ["", " ", "NaN", "OVR", "[n/a]"])
def test_rows_without_a_motion_are_left_out_and_without_a_force_not_compared(
    tmp_path: Path, empty: str
) -> None:
    record = read(tmp_path, {"position": [5], "force": [8, 9]}, empty, missing="drop")
    for name in ("time", "position"):
        np.testing.assert_array_equal(record.columns[name], np.delete(LINE[name], 5))
    assert record.rows[~record.chosen].tolist() == [10, 11]
    assert record.notes == (
        "2 row(s) without a force are not compared, rows 10, 11",
        "1 row(s) with an empty cell or NaN are left out, row 7",
    )
    long = read(tmp_path, {"position": list(range(10, 18))}, empty, missing="drop").notes
    assert "8 row(s)" in long[0]
    assert "rows 12, 13, 14, 15, 16 and 3 more" in long[0]
    assert "1 gap(s) in time" in long[1]
    assert "after row 11" in long[1]
    at_ends = read(tmp_path, {"time": [5], "force": [0, 1, ROWS - 1]}, empty, missing="drop")
    assert (len(at_ends), int(at_ends.chosen.sum())) == (ROWS - 1, ROWS - 4)


@pytest.mark.parametrize("empty", ["", "nan", "OVR"])
def test_a_motion_is_interpolated_in_time_and_not_compared(tmp_path: Path, empty: str) -> None:
    record = read(tmp_path, {"position": [5, 6], "force": [8]}, empty, missing="interpolate")
    for name in ("time", "position"):  # a line is met exactly
        np.testing.assert_array_equal(record.columns[name], LINE[name])
    assert np.flatnonzero(~record.chosen).tolist() == [5, 6, 8]
    assert np.isnan(record.columns["force"][8])
    assert "2 empty cell(s) or NaN of the motion are interpolated" in record.notes[1]


def test_interpolation_follows_the_times_not_the_rows() -> None:
    time = np.array([0.0, 1.0, 4.0, 5.0, 6.0, 7.0])
    x = np.array([0.0, np.nan, 8.0, 0.0, 0.0, 0.0])
    record = Record.from_arrays(time=time, position=x, missing="interpolate")
    assert record.columns["position"].tolist() == [0.0, 2.0, 8.0, 0.0, 0.0, 0.0]
    assert "index 1" in record.notes[0]


def test_gaps_in_rows_that_are_not_selected_are_no_matter(tmp_path: Path) -> None:
    for missing in ("error", "drop", "interpolate"):
        record = read(tmp_path, {"force": [12]}, where="force < 1e9", missing=missing)
        assert (len(record), int(record.chosen.sum())) == (ROWS, ROWS - 1)
        assert not any("interpolated" in note or "empty cell or" in note for note in record.notes)


@pytest.mark.slow
@given(
    position=st.sets(st.integers(1, ROWS - 2), max_size=12),
    force=st.sets(st.integers(1, ROWS - 2), max_size=12),
    missing=st.sampled_from(["drop", "interpolate"]),
)
def test_any_holes(position: set[int], force: set[int], missing: Any) -> None:
    columns = {name: value.copy() for name, value in LINE.items()}
    columns["position"][list(position)] = np.nan
    columns["force"][list(force)] = np.nan
    record = Record.from_arrays(**columns, missing=missing)
    dropped = sorted(position) if missing == "drop" else []
    for name in ("time", "position"):
        left = np.delete(LINE[name], dropped)
        np.testing.assert_allclose(record.columns[name], left, rtol=1e-15)
    np.testing.assert_array_equal(
        record.columns["force"][record.chosen], np.delete(LINE["force"], sorted(position | force))
    )
