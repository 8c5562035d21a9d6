"""A sweep file is refused unless it contains exactly what a sweep of so many runs has.

Shapes, types and indices are checked; nothing too large is unpacked; a file of another format is
identified as such.
"""

from __future__ import annotations

import functools
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gms_fsm
from gms_fsm import Sweep, simulate, sweep
from gms_fsm.errors import OutputError, TraceFileError
from tests.helpers import pulled_mass


@functools.cache
def whole() -> Sweep:
    """Return a sweep with rows and three runs, one of which cannot start."""
    values = {"F_c": [1.0, 0.9, -1.0], "k": np.full((3, 4), 25.0)}
    return sweep(*pulled_mass(), 8.0, values, engine="ifelse", output="t_eval", t_eval=[0.0, 8.0])


@pytest.fixture
def arrays(tmp_path: Path) -> dict[str, Any]:
    """Return the arrays of a file."""
    with np.load(whole().save(tmp_path / "runs.npz"), allow_pickle=False) as file:
        return dict(file)


def _load(arrays: dict[str, Any], folder: Path) -> Sweep:
    path = folder / "runs.npz"
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)
    return Sweep.load(path)


@pytest.mark.slow
def test_every_shape_and_type_is_checked(arrays: dict[str, Any], tmp_path: Path) -> None:
    assert len(_load(arrays, tmp_path)) == 3
    assert arrays["program"] == gms_fsm.__version__
    tried = 0
    for name, array in arrays.items():
        if name in ("format", "program", "elements"):
            continue
        changes = [array[np.newaxis], np.full(array.shape, 7)]
        if name not in ("edges", "transitions"):
            changes.append(array[:-1])
        for changed in changes:
            with pytest.raises(TraceFileError, match=r"runs\.npz: .*damaged"):
                _load(arrays | {name: changed}, tmp_path)
            tried += 1
        if not name.startswith("parameter_"):  # without it, it is valid for another sweep
            with pytest.raises(TraceFileError, match=r"runs\.npz: .*damaged"):
                _load({other: u for other, u in arrays.items() if other != name}, tmp_path)
    assert tried > 45


@pytest.mark.parametrize("place", ["run", "element", "edge"])
def test_the_log_refers_only_to_existing_runs_elements_and_edges(
    place: str, arrays: dict[str, Any], tmp_path: Path
) -> None:
    for value in (-1, 1000):
        log = arrays["transitions"].copy()
        log[place][2] = value
        with pytest.raises(TraceFileError, match=f"{place} must be within 0 to"):
            _load(arrays | {"transitions": log}, tmp_path)


def test_runs_are_in_order_and_there_are_some(arrays: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(TraceFileError, match="runs not in order"):
        _load(arrays | {"transitions": arrays["transitions"][::-1]}, tmp_path)
    own = [name for name in arrays if name.startswith("parameter_")]
    with pytest.raises(TraceFileError, match="no parameter"):
        _load({name: array for name, array in arrays.items() if name not in own}, tmp_path)
    runs = {"elements", "times", "edges", "format", "program"}
    empty = {name: array if name in runs else array[:0] for name, array in arrays.items()}
    with pytest.raises(TraceFileError, match="no run"):
        _load(empty, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rows_z", "transitions"])
def test_data_that_unpacks_to_more_than_a_sweep_has_is_not_unpacked(
    name: str, arrays: dict[str, Any], tmp_path: Path
) -> None:
    bomb = np.zeros(20_000_000)
    with pytest.raises(TraceFileError, match="unpacks to 160000128 bytes"):
        _load(arrays | {name: bomb}, tmp_path)
    with zipfile.ZipFile(tmp_path / "runs.npz") as archive:
        assert archive.getinfo(f"{name}.npy").compress_size < 200_000


def test_other_files_say_what_they_are(arrays: dict[str, Any], tmp_path: Path) -> None:
    other = {"format": np.array("gms-fsm sweep 9"), "program": np.array("4.2")}
    with pytest.raises(TraceFileError, match=r"format 'gms-fsm sweep 9' of gms-fsm 4\.2"):
        _load(arrays | other, tmp_path)
    with pytest.raises(TraceFileError, match=r"no such file; in .* there is runs.npz"):
        Sweep.load(tmp_path / "none.npz")
    content = whole().save(tmp_path / "whole.npz").read_bytes()
    trace = simulate(*pulled_mass(), 1.0).save(tmp_path / "trace.npz").read_bytes()
    for damage in (content[: len(content) // 2], b"", b"hello", trace):
        (tmp_path / "damaged.npz").write_bytes(damage)
        with pytest.raises(TraceFileError, match="not a sweep"):
            Sweep.load(tmp_path / "damaged.npz")
    with pytest.raises(OutputError, match=r"saved as .npz or .parquet, not '.csv'"):
        whole().save(tmp_path / "sweep.csv")
    with pytest.raises(OutputError, match="cannot write"):
        whole().save(tmp_path / "nowhere" / "sweep.npz")
