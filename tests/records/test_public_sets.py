"""Public records come from a folder of the user's, with their licence.

If they are not there, the message says where to get them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import RecordError
from gms_fsm.app.scenario import load_scenario
from gms_fsm.records import damper, tribometer
from tests.helpers import ROOT
from tests.scenario_files import data_folder

HEAD = "t_s,x_mm,v_mm_s,F_N\n"


def test_the_damper_has_thirteen_tests() -> None:
    folder = data_folder("damper/test00.csv") / "damper"
    records = damper(folder)
    assert [record.name for record in records] == [f"test{number:02d}" for number in range(13)]
    for record in records:
        lines = (folder / f"{record.name}.csv").read_text().splitlines()
        assert len(record) == len(lines) - 1
        values = np.array([line.split(",") for line in lines[1:]], dtype=float).T
        for name, factor, value in zip(
            ("time", "position", "velocity", "force"), (1.0, 1e-3, 1e-3, 1.0), values, strict=True
        ):
            np.testing.assert_array_equal(record.columns[name], factor * value)
        assert record.licence.startswith("CC BY-SA 4.0")
        assert f"licence: {record.licence}" in record.notes
        # Friction opposes the motion.
        assert np.mean(record.columns["force"] * record.columns["velocity"]) > 0.0


def test_the_tribometer_is_read_as_the_scenario_reads_it(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = data_folder()
    monkeypatch.setenv("GMS_FSM_DATA", str(folder))
    loaded = load_scenario(ROOT / "scenarios" / "tribometer.toml")
    record = tribometer(folder)
    assert loaded.record is not None
    for name, value in loaded.record.columns.items():
        np.testing.assert_array_equal(record.columns[name], value)
    assert record.notes[1:] == loaded.record.notes
    assert (record.name, record.licence[:3]) == ("tribometer", "MIT")


def test_parts_keep_the_licence() -> None:
    record = tribometer(data_folder())
    assert record.between(20.0, 100.0).licence == record.licence


@pytest.mark.parametrize("read", [damper, tribometer])
def test_a_missing_folder_says_where_to_get_the_data(read: object, tmp_path: Path) -> None:
    assert callable(read)
    for folder in (tmp_path / "gone", tmp_path):
        with pytest.raises(RecordError) as caught:
            read(folder)
        assert str(folder) in str(caught.value)
        assert "github.com" in str(caught.value)
        assert ("MIT" in str(caught.value)) or ("CC BY-SA 4.0" in str(caught.value))
    with pytest.raises(RecordError, match="there is no such folder"):
        read(tmp_path / "gone")


def test_a_missing_or_damaged_file_is_named(tmp_path: Path) -> None:
    for number in range(12):
        rows = "".join(f"{i},{i},{i},{i}\n" for i in range(9))
        (tmp_path / f"test{number:02d}.csv").write_text(HEAD + rows)
    with pytest.raises(RecordError, match=r"there is no test12\.csv"):
        damper(tmp_path)
    (tmp_path / "test12.csv").write_text(HEAD + "0,0,0,a\n" * 9)
    with pytest.raises(RecordError, match=r"test12\.csv: row 2, column 'F_N': 'a'"):
        damper(tmp_path)
