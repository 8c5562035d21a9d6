"""A sweep file is refused unless it contains exactly what a sweep of so many runs has.

Shapes, types and indices are checked; nothing too large is unpacked; a file of another format is
identified as such.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gms_fsm
from gms_fsm import Sweep, sweep
from gms_fsm.errors import TraceFileError
from tests.helpers import pulled_mass


@pytest.fixture(scope="module")
def arrays(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return the arrays of a file with rows and three runs, one of which cannot start."""
    values = {"F_c": [1.0, 0.9, -1.0], "k": np.full((3, 4), 25.0)}
    made = sweep(*pulled_mass(), 8.0, values, engine="ifelse", output="t_eval", t_eval=[0.0, 8.0])
    assert len(made.transitions) > 4
    path = made.save(tmp_path_factory.mktemp("sweep") / "runs.npz")
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _load(arrays: dict[str, Any], folder: Path) -> Sweep:
    path = folder / "runs.npz"
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)
    return Sweep.load(path)


def test_an_unchanged_file_is_read(arrays: dict[str, Any], tmp_path: Path) -> None:
    assert len(_load(arrays, tmp_path)) == 3
    assert arrays["program"] == gms_fsm.__version__


NAMES = [
    "t", "x", "v", "F", "z", "outcome", "message", "states", "times", "rows_x", "rows_v",
    "rows_F", "rows_z", "parameter_F_c", "parameter_k", "transitions", "edges",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_every_shape_and_type_is_checked(name: str, arrays: dict[str, Any], tmp_path: Path) -> None:
    assert set(NAMES) | {"format", "program", "elements"} == set(arrays)
    array = arrays[name]
    changes = [array[np.newaxis], np.full(array.shape, 7), None]
    if name not in ("edges", "transitions"):
        changes.append(array[:-1])
    for changed in changes:
        others = {other: value for other, value in arrays.items() if other != name}
        if changed is None and name.startswith("parameter_"):
            continue  # valid for another sweep
        with pytest.raises(TraceFileError, match=r"runs\.npz: not a sweep, or damaged"):
            _load(others | ({} if changed is None else {name: changed}), tmp_path)


@pytest.mark.parametrize("place", ["run", "element", "edge"])
@pytest.mark.parametrize("value", [-1, 1000])
def test_the_log_refers_only_to_existing_runs_elements_and_edges(
    place: str, value: int, arrays: dict[str, Any], tmp_path: Path
) -> None:
    log = arrays["transitions"].copy()
    log[place][2] = value
    with pytest.raises(TraceFileError, match=f"{place} must be within 0 to"):
        _load(arrays | {"transitions": log}, tmp_path)


def test_runs_are_in_order(arrays: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(TraceFileError, match="runs not in order"):
        _load(arrays | {"transitions": arrays["transitions"][::-1]}, tmp_path)


def test_a_sweep_file_needs_runs_and_parameters(arrays: dict[str, Any], tmp_path: Path) -> None:
    own = [name for name in arrays if name.startswith("parameter_")]
    with pytest.raises(TraceFileError, match="no parameter"):
        _load({name: array for name, array in arrays.items() if name not in own}, tmp_path)
    runs = {"elements", "times", "edges", "format", "program"}
    empty = {name: array if name in runs else array[:0] for name, array in arrays.items()}
    with pytest.raises(TraceFileError, match="no run"):
        _load(empty, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["t", "z", "message", "states", "rows_z", "transitions"])
def test_data_that_unpacks_to_more_than_a_sweep_has_is_not_unpacked(
    name: str, arrays: dict[str, Any], tmp_path: Path
) -> None:
    bomb = np.zeros(20_000_000)
    with pytest.raises(TraceFileError, match="unpacks to 160000128 bytes"):
        _load(arrays | {name: bomb}, tmp_path)
    with zipfile.ZipFile(tmp_path / "runs.npz") as archive:
        assert archive.getinfo(f"{name}.npy").compress_size < 200_000


def test_another_format_is_named(arrays: dict[str, Any], tmp_path: Path) -> None:
    other = {"format": np.array("gms-fsm sweep 9"), "program": np.array("4.2")}
    with pytest.raises(TraceFileError, match=r"format 'gms-fsm sweep 9' of gms-fsm 4\.2"):
        _load(arrays | other, tmp_path)
    older = {name: array for name, array in arrays.items() if name not in other}
    with pytest.raises(TraceFileError, match="not a sweep"):
        _load(older, tmp_path)
