"""Claim: the motion of a long record is a table beside the saved scenario, and runs to the bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import GMSError
from gms_fsm.app.scenario import load_scenario
from gms_fsm.identification import _saved
from tests.identification.fits_made import small

pytest.importorskip("llvmlite", reason="fits take long without machine code")


@pytest.fixture
def saved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(_saved, "LONGEST", 10)
    return small().save(tmp_path / "fitted.toml")


def test_the_run_is_the_same(saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_saved, "LONGEST", 10_000)
    whole = small().save(tmp_path / "whole.toml")
    assert saved.stat().st_size < 1500 < whole.stat().st_size
    assert (tmp_path / "fitted.csv").read_text().startswith("t_s,v\n")
    one, other = (load_scenario(path).simulate() for path in (saved, whole))
    assert np.array_equal(one.t, other.t)
    assert np.array_equal(one.F, other.F)


def test_a_table_that_is_gone_is_named(saved: Path) -> None:
    saved.with_suffix(".csv").unlink()
    with pytest.raises(GMSError, match=r"fitted\.toml: .*signals.*fitted\.csv"):
        load_scenario(saved)


@pytest.mark.parametrize("name", ["../fitted.csv", "a\\u0000b.csv"])
def test_a_table_elsewhere_is_refused(name: str, saved: Path) -> None:
    saved.write_text(saved.read_text().replace('"fitted.csv"', f'"{name}"'))
    with pytest.raises(GMSError, match=r"file is .*; it is (outside the folder|no file name)"):
        load_scenario(saved)


def test_a_wrong_column_is_named(saved: Path) -> None:
    saved.write_text(saved.read_text().replace('v.value = "v"', 'v.value = "w"'))
    with pytest.raises(GMSError, match="no column 'w'"):
        load_scenario(saved)
