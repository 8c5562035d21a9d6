"""Public records come from a folder of the user's, with their licence.

If they are not there, the message says where to get them.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm.app.scenario import load_scenario
from gms_fsm.records import damper, tribometer
from tests.scenario_files import data_folder


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_tribometer_is_read_as_the_scenario_reads_it(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = data_folder()
    monkeypatch.setenv("GMS_FSM_DATA", str(folder))
    loaded = load_scenario("tribometer")
    record = tribometer(folder)
    assert loaded.record is not None
    for name, value in loaded.record.columns.items():
        np.testing.assert_array_equal(record.columns[name], value)
    assert record.notes[1:] == loaded.record.notes
    assert (record.name, record.licence[:3]) == ("tribometer", "MIT")
    assert record.between(20.0, 100.0).licence == record.licence
