"""A record or condition that cannot be computed is rejected with a message in bounded time.

Each case was found by fuzzing.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm.app.scenario import load_scenario
from gms_fsm.errors import (
    RecordError,
    ScenarioError,
)
from gms_fsm.records.record import Column
from gms_fsm.records.units import convert_numbers
from tests.scenario_files import MEASURED, changed, read_table, sine_table, table

LONG = "x" * 50_000


def record(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "own.csv"
    path.write_text(text, encoding="utf-8")
    return path


COLUMNS = {"time": Column("t", "s"), "position": Column("x", "mm"), "force": Column("F", "N")}


def test_a_condition_that_cannot_be_computed_is_refused(tmp_path: Path) -> None:
    path = record(tmp_path, sine_table())
    with pytest.raises(RecordError, match="cannot be computed"):
        read_table(path, COLUMNS, where="sqrt(force) > 1 N")  # force is negative now and then


def test_a_number_with_an_exponent_is_a_number_without_a_unit() -> None:
    """2e3 was read as 2 with the unit e3."""
    assert convert_numbers("force > 2e3") == "force > 2e3"
    assert float(convert_numbers("force > 2e3 mN").rpartition(">")[2]) == 2.0
    assert float(convert_numbers("time < 1.5E-1min").rpartition("<")[2]) == 9.0


def test_a_number_of_many_digits_is_read_once(tmp_path: Path) -> None:
    """The pattern gave up its digits one by one and read them again: hours for 500 kB."""
    path = record(tmp_path, sine_table())
    with pytest.raises(RecordError, match="where"):
        read_table(path, COLUMNS, where="1" * 500_000)


@pytest.mark.parametrize("scale", [1e200, 1e300, 1e308])
def test_positions_too_large_for_a_motion_are_refused(scale: float, tmp_path: Path) -> None:
    t = np.arange(50) * 0.01
    path = record(tmp_path, table(["t", "x"], t, scale * np.sin(t)))
    columns = {"time": Column("t", "s"), "position": Column("x", "m")}
    try:
        motion = read_table(path, columns).motion()
    except RecordError as error:
        refused: RecordError | None = error
    else:
        refused = None
        assert np.isfinite(motion.velocity).all()
    assert refused is None or "outliers" in str(refused)
    assert (refused is None) == (scale < 1e308)


@pytest.mark.parametrize("change", ["column", "unit", "cell", "head"])
def test_long_cells_do_not_make_long_messages(change: str, tmp_path: Path) -> None:
    text, columns = sine_table(), dict(COLUMNS)
    if change == "column":
        columns["force"] = Column(LONG, "N")
    elif change == "cell":
        text = text.replace("0.01,", f"{LONG},", 1)
    elif change == "head":
        text = text.replace("F", LONG, 1)
    if change == "unit":
        scenario = changed(MEASURED, 'unit = "N"', f'unit = "{LONG}"')
        (tmp_path / "rig.toml").write_text(scenario)
        record(tmp_path, text)
        with pytest.raises(ScenarioError) as caught:
            load_scenario(tmp_path / "rig.toml")
        assert len(str(caught.value)) < 2000
        return
    with pytest.raises(RecordError) as refused:
        read_table(record(tmp_path, text), columns)
    assert len(str(refused.value)) < 2000
