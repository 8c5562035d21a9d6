"""A cell in a row excluded by ``where`` need not be a number, and the message says so.

Instruments write units below the header, words where a sensor was off, and remarks at the end.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Record
from gms_fsm.app.scenario import load_scenario
from gms_fsm.errors import RecordError
from gms_fsm.records.record import Column
from tests.scenario_files import OPEN_LOOP, read_table

COLUMNS = {"time": Column("t", "s"), "position": Column("x", "mm"), "force": Column("F", "N")}
ROWS = [f"{0.01 * i:.2f},{0.5 * i:.1f},{i % 7}" for i in range(20)]  # rows 2 to 21 of the file


def _read(tmp_path: Path, changes: dict[int, str], where: str = "") -> Record:
    """Read the table with some rows changed; the header is row 1."""
    lines = ["t,x,F", *ROWS]
    for number, text in changes.items():
        lines[number - 1] = text
    path = tmp_path / "own.csv"
    path.write_text("\n".join(lines) + "\n")
    return read_table(path, COLUMNS, where)


def test_words_below_the_units(tmp_path: Path) -> None:
    record = _read(tmp_path, {2: "s,mm,N", 3: "-,-,-"}, "time >= 0 s")
    assert any("3 cell(s)" in note and "row 3" in note and "'-'" in note for note in record.notes)


def test_words_before_and_after(tmp_path: Path) -> None:
    changes = {2: "0.00,n/a,off", 3: "0.01,n/a,off", 21: "end,of,file"}
    record = _read(tmp_path, changes, "time > 0.015 s")
    assert (len(record), record.rows.min()) == (17, 4)
    assert all(np.isfinite(column).all() for column in record.columns.values())


def test_the_force_may_be_a_word_in_excluded_rows(tmp_path: Path) -> None:
    record = _read(tmp_path, {10: "0.08,4.0,overload"}, "force < 100 N")
    assert len(record) == 20
    assert np.flatnonzero(~record.chosen).tolist() == [8]
    assert record.columns["position"][8] == 0.004


@pytest.mark.parametrize("cell", ["lost", "nan", "inf", ""])
def test_a_row_without_a_position_between_selected_rows(tmp_path: Path, cell: str) -> None:
    record = _read(tmp_path, {10: f"0.08,{cell},1"}, "time < 0.075 s or time > 0.085 s")
    assert len(record) == 19
    assert 0.08 not in record.columns["time"]
    assert record.chosen.all()
    assert any("1 row(s) without time or position" in note for note in record.notes)


def test_a_measured_signal_has_where_too(tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text("\n".join(["t,v", "s,m/s", *_signal_rows()]) + "\n")
    signal = (
        '{ file = "own.csv", time = { column = "t", unit = "s" }, value = { column = "v", '
        'unit = "m/s" }, WHERE }'
    )
    path = tmp_path / "own.toml"
    path.write_text(OPEN_LOOP.replace('"0.1*sin(t)"', signal.replace(", WHERE", "")))
    with pytest.raises(RecordError, match=r"row 5, column 'v': 'off' is not a number.*where = "):
        load_scenario(path)
    path.write_text(
        OPEN_LOOP.replace('"0.1*sin(t)"', signal.replace("WHERE", 'where = "velocity < 9 m/s"'))
    )
    corners = load_scenario(path).rig.signals["v"]
    assert corners.times.tolist() == [0.0, 0.5, 1.5, 2.0, 3.0]  # type: ignore[union-attr]
    assert corners.values.tolist() == [0.0, 0.1, 0.3, 0.4, 0.6]  # type: ignore[union-attr]


def _signal_rows() -> list[str]:
    return ["0,0", "0.5,0.1", "1.0,off", "1.5,0.3", "2.0,0.4", "2.5,99", "3.0,0.6"]
