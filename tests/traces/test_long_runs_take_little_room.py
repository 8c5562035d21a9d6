"""Nothing of a long run is kept or written twice, and only a part of it is in memory as text.

A firing takes 56 bytes until its names are read, a state in a file one byte.
"""

from __future__ import annotations

import io
import pickle
import tracemalloc
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Trace, Transition, simulate
from gms_fsm.traces.files.archives import write_arrays
from tests import older_files
from tests.helpers import FASTEST, pulled_mass, same_bits

ENGINES = ["ifelse", *({FASTEST} - {"ifelse"})]


def bytes_of(trace: Trace) -> int:
    firings = trace.firings
    return sum(each.nbytes for each in vars(firings).values() if isinstance(each, np.ndarray))


# --------------------------------------------------------------------------- the log
@pytest.mark.parametrize("engine", ENGINES)
def test_a_firing_takes_56_bytes(engine: str) -> None:
    trace = simulate(*pulled_mass(), 20.0, engine=engine)
    assert len(trace.firings) > 4
    assert bytes_of(trace) == 56 * len(trace.firings)
    assert bytes_of(pickle.loads(pickle.dumps(trace))) == bytes_of(trace)


def test_saving_and_showing_a_run_does_not_spell_out_its_log(tmp_path: Path) -> None:
    trace = simulate(*pulled_mass(), 20.0)
    for name in ("run.npz", "run.csv"):
        again = Trace.load(trace.save(tmp_path / name))
        assert repr(again) == repr(trace)
        assert bytes_of(again) == 56 * len(trace.firings)
        assert "records" not in {*vars(trace.firings), *vars(again.firings)}


# --------------------------------------------------------------------------- rows


# --------------------------------------------------------------------------- archives
def test_states_and_codes_have_one_byte(tmp_path: Path) -> None:
    trace = simulate(*pulled_mass(), 20.0)
    arrays = older_files.arrays_of(trace.save(tmp_path / "run.npz"))
    for name in ("rows_mode", "rows_microstep", "log_machine", "log_edge"):
        assert arrays[name].dtype == np.uint8, name
    again = Trace.load(tmp_path / "run.npz")
    assert again.rows.mode.dtype == trace.rows.mode.dtype == np.int64
    assert again.rows.microstep.dtype == trace.rows.microstep.dtype == np.int64


@pytest.mark.slow
def test_a_chart_of_more_than_256_states_is_saved(tmp_path: Path) -> None:
    count = 300
    chart = Chart(
        "many",
        ("t",),
        outputs={"F": "0"},
        states=tuple(State(f"s{k}") for k in range(count)),
        transitions=tuple(
            Transition(f"e{k}", f"s{k}", f"s{k + 1}", f"t >= {k + 0.5}") for k in range(count - 1)
        ),
    )
    trace = simulate(ChartModel(chart, {}, n=1), Prescribed("0"), 1.0 * count)
    assert trace.states[-1, 0] == "s299"
    arrays = older_files.arrays_of(trace.save(tmp_path / "run.npz"))
    assert arrays["rows_mode"].dtype == arrays["log_edge"].dtype == np.uint16
    same_bits(trace, Trace.load(tmp_path / "run.npz"))


@pytest.mark.parametrize(
    ("array", "packed"),
    [
        (np.zeros(50_000), True),
        (np.repeat(np.arange(5.0), 10_000).reshape(-1, 5).T, True),
        (np.random.default_rng(1).random(50_000), False),
        (np.random.default_rng(1).random((50_000, 2))[::2, 1:], False),
        # At rest, then moving: what the start promises does not hold.
        (np.concatenate([np.zeros(20_000), np.random.default_rng(1).random(30_000)]), False),
        (np.array("text " * 1000), True),
        (np.empty(0), False),
        (np.float64(3.0), False),
    ],
    ids=["constant", "few values", "random", "strided", "rest", "text", "empty", "a number"],
)
def test_what_shrinks_is_compressed(array: Any, packed: bool, tmp_path: Path) -> None:
    file = io.BytesIO()
    write_arrays(file, {"a": array})
    (info,) = zipfile.ZipFile(file).infolist()
    assert (info.compress_size < 0.5 * info.file_size) == packed
    assert (info.compress_type == zipfile.ZIP_DEFLATED) == packed
    file.seek(0)
    np.testing.assert_array_equal(np.load(file)["a"], array)


# --------------------------------------------------------------------------- CSV
@pytest.mark.matrix
@pytest.mark.slow
def test_csv_is_written_part_by_part(tmp_path: Path) -> None:
    """All rows as text and as Python numbers took 30 MB for 20,000 rows, and 1.3 GB for 800,000."""
    trace = simulate(*pulled_mass(), 20.0, t_eval=np.linspace(0.0, 20.0, 10_000))
    assert trace.F.size == 10_000  # what is observed belongs to the trace
    tracemalloc.start()
    try:
        trace.save(tmp_path / "run.csv")
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.reset_peak()
        before = tracemalloc.get_traced_memory()[0]
        again = Trace.load(tmp_path / "run.csv")
        loaded, peak = (each - before for each in tracemalloc.get_traced_memory())
    finally:
        tracemalloc.stop()
    assert (tmp_path / "run.csv").stat().st_size > 3_500_000
    assert most < 10_000_000
    assert peak < 2.5 * loaded + 12_000_000
    same_bits(trace, again)
