"""A record written as CSV reads back equal to the last bit; files of others are kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Record, excite

COLUMNS = {
    "position": ("x_m", "m"),
    "velocity": ("v_m_s", "m/s"),
    "force": ("F_N", "N"),
    "normal": ("N_N", "N"),
}


def record(seed: int = 0, **given: object) -> Record:
    rng = np.random.default_rng(seed)
    columns = {name: rng.normal(size=40) * 10.0 ** rng.integers(-9, 9, 40) for name in COLUMNS}
    return Record.from_arrays(**({"time": np.cumsum(rng.random(40) + 1e-3)} | columns | given))


@pytest.mark.parametrize("left_out", [(), ("normal",), ("velocity", "force"), ("position",)])
def test_it_reads_back_equal(left_out: tuple[str, ...], tmp_path: Path) -> None:
    given = record(**dict.fromkeys(left_out))
    path = given.to_csv(tmp_path / "own.csv")
    named = {name: None if name in left_out else column for name, column in COLUMNS.items()}
    found = Record.from_csv(path, **named)
    assert sorted(found.columns) == sorted(given.columns)
    for name, value in given.columns.items():
        np.testing.assert_array_equal(found.columns[name], value, err_msg=name)


def test_a_motion_for_a_rig_reads_back_equal(tmp_path: Path) -> None:
    motion = excite(2e-3, [1e-3, 5e-3])
    path = motion.to_csv(str(tmp_path / "motion.csv"))
    found = Record.from_csv(path, position=("x_m", "m"), velocity=("v_m_s", "m/s"), force=None)
    for name in ("time", "position", "velocity"):
        np.testing.assert_array_equal(found.columns[name], motion.columns[name])
    head = path.read_text(encoding="utf-8").splitlines()[:2]
    assert head == ["t_s,x_m,v_m_s", "0.0,0.0,0.0"]


def test_a_missing_force_is_an_empty_cell(tmp_path: Path) -> None:
    (tmp_path / "raw.csv").write_text(
        "t_s,x_mm,F_N,N_N\n" + "".join(f"{i},{i},{i if i != 3 else ''},{i}\n" for i in range(9))
    )
    given = Record.from_csv(
        tmp_path / "raw.csv", normal="N_N", where="normal > 3.5 N or time < 3 s"
    )
    path = given.to_csv(tmp_path / "own.csv")
    assert path.read_text().splitlines()[4] == "3.0,0.003,,3.0"
