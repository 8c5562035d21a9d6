"""A trace file that is hostile is refused, costs little, and executes nothing.

What is refused by one wrong value is in `tests/refusals.py`; damaged and random bytes are tried by
`tests.soak.fuzz`. Each case here was found by fuzzing.
"""

from __future__ import annotations

import io
import json
import pickle
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.errors import TraceFileError
from gms_fsm.traces.trace import dwell_times
from tests.helpers import stick_slip
from tests.refusals import saved

ARCHIVE = saved(".npz")["run.npz"]


def rewritten(path: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    """Return a file with the arrays of a short run, some of them changed."""
    with np.load(io.BytesIO(ARCHIVE)) as file:
        arrays = dict(file)
    change(arrays)
    with path.open("wb") as out:
        np.savez(out, allow_pickle=True, **arrays)
    return path


def repacked(
    target: Any, name: str, write: Callable[[Any], object], kind: int = zipfile.ZIP_STORED
) -> None:
    """Write the archive anew, with one of its members written by a function."""
    with zipfile.ZipFile(io.BytesIO(ARCHIVE)) as old, zipfile.ZipFile(target, "w", kind) as new:
        for member in old.namelist():
            with new.open(member, "w") as file:
                if member == f"{name}.npy":
                    write(file)
                else:
                    file.write(old.read(member))


def claims(kind: str, *shape: int) -> bytes:
    """Return the head of an array of this kind and shape."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        head, {"descr": kind, "fortran_order": False, "shape": shape}
    )
    return head.getvalue()


# --------------------------------------------------------------------------- hostile files
class Bomb:
    """Executes something when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = str(path)

    def __reduce__(self) -> tuple[Any, ...]:
        return (open, (self.path, "w"))


@pytest.mark.parametrize("member", ["rows_y", "header", "log_edge", "observed_F"])
def test_a_pickle_in_a_trace_is_not_opened(member: str, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    bomb = np.array([Bomb(canary)], dtype=object)
    path = rewritten(tmp_path / "run.npz", lambda arrays: arrays.update({member: bomb}))
    with pytest.raises(TraceFileError):
        Trace.load(path)
    path.write_bytes(pickle.dumps(Bomb(canary)))
    with pytest.raises(TraceFileError):
        Trace.load(path)
    assert not canary.exists()


def test_an_array_that_claims_to_be_endless_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    repacked(path, "rows_t", lambda file: file.write(claims("<f8", 10**15)))
    with pytest.raises(TraceFileError):
        Trace.load(path)


@pytest.mark.every(3)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["header", "rows_y", "log_edge"])
def test_an_array_that_unpacks_to_a_thousand_times_its_size_is_rejected(
    name: str, tmp_path: Path
) -> None:
    """A file of half a megabyte took half a gigabyte of memory."""
    path = tmp_path / "run.npz"
    head = claims("<U40000000") if name == "header" else claims("<f8", 20_000_000)

    def write(file: Any) -> None:
        file.write(head)
        for _ in range(160):
            file.write(bytes(1_000_000))

    repacked(path, name, write, zipfile.ZIP_DEFLATED)
    assert path.stat().st_size < 1_000_000
    with pytest.raises(TraceFileError, match=rf"run\.npz: {name} unpacks to 160"):
        Trace.load(path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rows_mode", "log_edge"])
def test_bytes_are_not_made_longer_before_their_number_is_checked(
    name: str, tmp_path: Path
) -> None:
    """Integers have eight bytes in a trace, and may have one in its file."""
    rows = 200_000

    def change(arrays: dict[str, Any]) -> None:
        for column in ("rows_t", "rows_microstep", "rows_y", "observed_v", "observed_F"):
            arrays[column] = np.repeat(arrays[column][:1], rows, axis=0)
        for column in ("t", "machine", "edge", "numbers"):
            arrays[f"log_{column}"] = np.repeat(arrays[f"log_{column}"][:1], rows, axis=0)
        arrays[name] = np.zeros(rows * (80 if name == "rows_mode" else 8), dtype=np.uint8)

    path = rewritten(tmp_path / "run.npz", change)
    tracemalloc.start()
    try:
        with pytest.raises(TraceFileError):
            Trace.load(path)
        assert tracemalloc.get_traced_memory()[1] < 2 * path.stat().st_size
    finally:
        tracemalloc.stop()


# --------------------------------------------------------------------------- unusual, but valid
def test_a_trace_without_an_engine_name_can_be_sampled(tmp_path: Path) -> None:
    def change(arrays: dict[str, Any]) -> None:
        header = json.loads(str(arrays["header"]))
        header["settings"] = {}
        arrays["header"] = np.array(json.dumps(header))

    trace = Trace.load(rewritten(tmp_path / "run.npz", change))
    assert len(trace.sample([0.5, 1.0]).columns()["F"]) == 2
    assert dwell_times(trace).sum() == pytest.approx(8.0)


@pytest.mark.parametrize("value", [1e308, np.inf, np.nan])
def test_samples_that_overflow_are_not_finite(value: float, tmp_path: Path) -> None:
    def change(arrays: dict[str, Any]) -> None:
        arrays["rows_y"][1::2] = value
        arrays["rows_y"][::2] = -value

    trace = Trace.load(rewritten(tmp_path / "run.npz", change))
    sampled = trace.sample(np.linspace(0.1, 1.9, 5))
    assert not np.isfinite(sampled.z).all()


@pytest.mark.matrix
@pytest.mark.slow
def test_a_long_run_at_rest_is_accepted(tmp_path: Path) -> None:
    """Everything but the times of such a trace is compressed a thousandfold, and it must load."""
    times = np.linspace(0, 1, 100_000)
    trace = simulate(stick_slip("signed"), Prescribed("0"), 1.0, t_eval=times, engine="ifelse")
    path = trace.save(tmp_path / "run.npz")
    assert Trace.load(path).z.shape == (100_000, 4)
