"""Records are looked for where they may be, and a run keeps the part that its record covers.

What is refused is in `tests/refusals.py`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Trace
from gms_fsm.foundation.files import LIST
from gms_fsm.records.units import convert_numbers
from tests.scenario_files import (
    MEASURED,
    CommandLine,
    changed,
    nothing_written,
    one_message,
    sine_table,
    table,
)

GOOD = sine_table()
LINES = GOOD.splitlines()
EVEN = np.arange(60) * 0.01


def test_a_link_out_of_the_folder_is_not_followed(gms_fsm: CommandLine, tmp_path: Path) -> None:
    folder = tmp_path / "inside"
    folder.mkdir()
    (tmp_path / "secret.csv").write_text(GOOD)
    (folder / "own.csv").symlink_to(tmp_path / "secret.csv")
    (folder / "broken.toml").write_text(MEASURED)
    answer = gms_fsm("run", folder / "broken.toml", "-o", folder / "out")
    one_message(answer, "broken.toml", "'own.csv'", "outside")
    assert not (folder / "out").exists()


def test_the_data_folder_is_searched(
    gms_fsm: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = tmp_path / "data"
    data.mkdir()
    (tmp_path / "scenario.toml").write_text(MEASURED)
    monkeypatch.setenv("GMS_FSM_DATA", str(data))
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    one_message(answer, "scenario.toml", "'own.csv'", "no such file", str(data))
    (data / "own.csv").write_text(GOOD)
    assert gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out").code == 0


@pytest.mark.parametrize("head", [b"", b"t,x,F\n0,0,0\n"])
def test_a_line_of_1_GB_is_not_read(head: bytes, gms_fsm: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "scenario.toml").write_text(MEASURED)
    with (tmp_path / "own.csv").open("wb") as file:
        file.write(head)
        file.truncate(10**9)
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    one_message(answer, "own.csv", f"line {head.count(10) + 1}", "longer than 100000")
    nothing_written(tmp_path, {"scenario.toml", "own.csv"})


def test_a_record_that_ends_before_the_run_keeps_its_part(
    gms_fsm: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "scenario.toml").write_text(
        changed(MEASURED, "[output]", "[run]\nt_end = 10.0\n[output]")
    )
    (tmp_path / "own.csv").write_text(GOOD)
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    one_message(
        answer, "scenario.toml", "a sampled signal at t = 0.59 s", "t_end = 10.0", "partial.npz"
    )
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"partial.npz", LIST}
    part = Trace.load(tmp_path / "out" / "partial.npz")
    np.testing.assert_array_equal(part.t, [float(line.split(",")[0]) for line in LINES[1:]])


def test_a_constant_force_is_accepted(gms_fsm: CommandLine, tmp_path: Path) -> None:
    """R² is undefined then; the run is still valid."""
    (tmp_path / "scenario.toml").write_text(MEASURED)
    (tmp_path / "own.csv").write_text(table(["t", "x", "F"], EVEN, np.sin(6 * EVEN), 0 * EVEN))
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    assert answer.code == 0, answer.err
    assert "RMSE" in (tmp_path / "out" / "summary.md").read_text()


def test_five_rows_are_enough(gms_fsm: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "scenario.toml").write_text(MEASURED)
    (tmp_path / "own.csv").write_text("\n".join(LINES[:6]) + "\n")
    answer = gms_fsm("run", tmp_path / "scenario.toml", "-o", tmp_path / "out")
    assert answer.code == 0, answer.err
    assert len(Trace.load(tmp_path / "out" / "trace.npz")) == 5


def test_a_number_with_an_exponent_is_a_number_without_a_unit() -> None:
    """2e3 was read as 2 with the unit e3."""
    assert convert_numbers("force > 2e3") == "force > 2e3"
    assert float(convert_numbers("force > 2e3 mN").rpartition(">")[2]) == 2.0
    assert float(convert_numbers("time < 1.5E-1min").rpartition("<")[2]) == 9.0
