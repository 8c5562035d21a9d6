"""A trace file that no run can have written is rejected; unusual but valid ones are read.

Each case was found by fuzzing.
"""

from __future__ import annotations

import io
import json
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.errors import (
    TraceFileError,
)
from gms_fsm.traces.trace import dwell_times
from tests.helpers import stick_slip


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("saved") / "run.npz"
    simulate(stick_slip("signed"), Prescribed("0.3"), 3.0).save(path)
    return path.read_bytes()


def rewritten(saved: bytes, path: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    with np.load(io.BytesIO(saved)) as file:
        arrays = dict(file)
    change(arrays)
    with path.open("wb") as out:
        np.savez(out, **arrays)
    return path


def test_a_trace_without_an_engine_name_can_be_sampled(saved: bytes, tmp_path: Path) -> None:
    def change(arrays: dict[str, Any]) -> None:
        header = json.loads(str(arrays["header"]))
        header["settings"] = {}
        arrays["header"] = np.array(json.dumps(header))

    trace = Trace.load(rewritten(saved, tmp_path / "run.npz", change))
    assert len(trace.sample([0.5, 1.0]).columns()["F"]) == 2
    assert dwell_times(trace).sum() == pytest.approx(12.0)


@pytest.mark.parametrize("value", [1e308, np.inf, np.nan])
def test_samples_that_overflow_are_not_finite(value: float, saved: bytes, tmp_path: Path) -> None:
    def change(arrays: dict[str, Any]) -> None:
        arrays["rows_y"][1::2] = value
        arrays["rows_y"][::2] = -value

    trace = Trace.load(rewritten(saved, tmp_path / "run.npz", change))
    sampled = trace.sample(np.linspace(0.1, 2.9, 5))
    assert not np.isfinite(sampled.z).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["header", "rows_y", "log_edge"])
def test_an_array_that_unpacks_to_a_thousand_times_its_size_is_rejected(
    name: str, saved: bytes, tmp_path: Path
) -> None:
    """A file of half a megabyte took half a gigabyte of memory."""
    path, head = tmp_path / "run.npz", io.BytesIO()
    shape, kind = ((), "<U40000000") if name == "header" else ((20_000_000,), "<f8")
    np.lib.format.write_array_header_1_0(
        head, {"descr": kind, "fortran_order": False, "shape": shape}
    )
    with (
        zipfile.ZipFile(io.BytesIO(saved)) as old,
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new,
    ):
        for member in old.namelist():
            with new.open(member, "w") as file:
                if member != f"{name}.npy":
                    file.write(old.read(member))
                    continue
                file.write(head.getvalue())
                for _ in range(160):
                    file.write(bytes(1_000_000))
    assert path.stat().st_size < 1_000_000
    with pytest.raises(TraceFileError, match=rf"run\.npz: {name} unpacks to 160"):
        Trace.load(path)


@pytest.mark.slow
def test_a_long_run_at_rest_is_accepted(tmp_path: Path) -> None:
    """Everything but the times of such a trace is compressed a thousandfold, and it must load."""
    times = np.linspace(0, 1, 100_000)
    trace = simulate(stick_slip("signed"), Prescribed("0"), 1.0, t_eval=times, engine="ifelse")
    path = trace.save(tmp_path / "run.npz")
    assert Trace.load(path).z.shape == (100_000, 4)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rows_mode", "log_edge"])
def test_bytes_are_not_made_longer_before_their_number_is_checked(
    name: str, saved: bytes, tmp_path: Path
) -> None:
    """Integers have eight bytes in a trace, and may have one in its file."""
    rows = 200_000

    def change(arrays: dict[str, Any]) -> None:
        for column in ("rows_t", "rows_microstep", "rows_y", "observed_v", "observed_F"):
            arrays[column] = np.repeat(arrays[column][:1], rows, axis=0)
        for column in ("t", "machine", "edge", "numbers"):
            arrays[f"log_{column}"] = np.repeat(arrays[f"log_{column}"][:1], rows, axis=0)
        arrays[name] = np.zeros(rows * (80 if name == "rows_mode" else 8), dtype=np.uint8)

    path = rewritten(saved, tmp_path / "run.npz", change)
    tracemalloc.start()
    try:
        with pytest.raises(TraceFileError):
            Trace.load(path)
        assert tracemalloc.get_traced_memory()[1] < 2 * path.stat().st_size
    finally:
        tracemalloc.stop()
