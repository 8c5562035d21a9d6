"""A saved trace reads back equal to the last bit; a damaged or hostile file is rejected.

Files are written completely or not at all. Reading executes nothing and raises only
`TraceFileError`, whatever bytes the file contains.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import pickle
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gms_fsm import (
    Chart,
    ChartModel,
    Prescribed,
    State,
    Stribeck,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.errors import GMSError, OutputError, SignalError, TraceFileError
from gms_fsm.foundation.files import write_whole
from gms_fsm.traces.files import csv_files
from tests.helpers import pulled_mass, stick_slip

ENDINGS = pytest.mark.parametrize("ending", [".npz", ".csv"])
COLUMNS = ("t", "microstep", "x", "v", "z", "states", "s", "F", "F_elements", "dz")
TIMES = np.linspace(0, 30, 31)


def _own_chart() -> Trace:
    chart = Chart(
        'own "\u00e9", with\ncommas',
        ("v", "s", "t"),
        ("z", "w"),
        ("k", "c"),
        (
            State("rest", {"z": "v", "w": "0"}),
            State(
                "l\u00e4uft", {"z": "0", "w": "abs(v)"}, entry={"z": "z / 3"}, exit={"w": "w + 1"}
            ),
        ),
        (
            Transition(
                "go", "rest", "l\u00e4uft", "abs(z) >= s or t > 100", actions={"w": "c * w"}
            ),
            Transition("back", "l\u00e4uft", "rest", "not abs(v) > 0.05"),
        ),
        {"F": "k * z + 1e-3 * dw"},
    )
    model = ChartModel(
        chart,
        {"k": np.array([1 / 3, 2.0]), "c": 0.1},
        n=2,
        weights=[0.1, 0.3],  # type: ignore[arg-type]
        stribeck=Stribeck(1, 1.5, 0.02),
        sigma_2=0.1,
        title='mine; "quoted"\n\u00e9',
    )
    return simulate(model, Prescribed("0.3*sin(t)"), 20.0)


CASES: dict[str, Callable[[], Trace]] = {
    "expression": lambda: simulate(stick_slip("signed"), Prescribed("0.2*sin(2*pi*t/20)"), 30.0),
    "wanted times": lambda: simulate(
        stick_slip("published"), Prescribed("0.2*sin(2*pi*t/20)"), 30.0, t_eval=TIMES
    ),
    "record": lambda: simulate(
        stick_slip("signed"), Prescribed((TIMES, 0.3 * np.sin(TIMES))), 30.0, engine="ifelse"
    ),
    "closed loop": lambda: simulate(*pulled_mass(), 20.0, rtol=1e-4),
    "no transitions": lambda: simulate(stick_slip("signed"), Prescribed("0"), 1.0),
    "one row": lambda: simulate(stick_slip("signed"), Prescribed("0"), 1.0, t_eval=[0.5]),
    "own chart": _own_chart,
}
_made: dict[str, Trace] = {}


def made(case: str) -> Trace:
    """Run a case once."""
    if case not in _made:
        _made[case] = CASES[case]()
    return _made[case]


def equal(a: Trace, b: Trace) -> None:
    """Assert equality to the last bit, including the sign of zero."""
    for name in COLUMNS:
        one, other = np.asarray(getattr(a, name)), np.asarray(getattr(b, name))
        assert one.shape == other.shape, name
        if one.dtype.kind == "f":
            assert one.tobytes() == other.tobytes(), name
        else:
            np.testing.assert_array_equal(one, other, err_msg=name)
    assert a.transitions.dtype.names == b.transitions.dtype.names
    assert a.transitions.tolist() == b.transitions.tolist()
    for name in a.model.chart.variables:
        assert a.variable(name).tobytes() == b.variable(name).tobytes()


# --------------------------------------------------------------------------- round trips
@ENDINGS
@pytest.mark.parametrize("case", ["own chart", "record", "one row"])
def test_a_loaded_trace_equals_the_saved_one(case: str, ending: str, tmp_path: Path) -> None:
    trace = made(case)
    path = trace.save(tmp_path / f"run{ending}")
    assert path == tmp_path / f"run{ending}"
    loaded = Trace.load(path)
    equal(loaded, trace)
    assert loaded.model.title == trace.model.title
    assert loaded.rig.title == trace.rig.title
    assert dict(loaded.settings) == dict(trace.settings)
    assert loaded.model.chart == trace.model.chart
    assert loaded.model.weights.tolist() == trace.model.weights.tolist()
    assert loaded.model.stribeck == trace.model.stribeck
    assert "transitions" in repr(loaded)
    second = loaded.save(tmp_path / f"two{ending}")
    equal(Trace.load(second), trace)
    if ending == ".csv":
        assert path.read_bytes() == second.read_bytes()
    if case == "one row":
        return
    times = np.linspace(trace.t[0], trace.t[-1], 50)
    equal(loaded.sample(times), trace.sample(times))
    settings_: Any = {name: trace.settings[name] for name in ("rtol", "engine")}
    equal(simulate(loaded.model, loaded.rig, trace.settings["t_end"], **settings_), trace)  # type: ignore[arg-type]


def test_with_requested_times_the_npz_keeps_what_sampling_needs(tmp_path: Path) -> None:
    trace = made("wanted times")
    loaded = Trace.load(trace.save(tmp_path / "run.npz"))
    times = np.linspace(0.0, 30.0, 77)
    equal(loaded.sample(times), trace.sample(times))


@ENDINGS
def test_a_python_function_is_not_kept_and_says_so_when_it_is_needed(
    ending: str, tmp_path: Path
) -> None:
    trace = simulate(stick_slip("signed"), Prescribed(lambda t: 0.3), 5.0)
    loaded = Trace.load(trace.save(tmp_path / f"run{ending}"))
    equal(loaded, trace)
    assert list(loaded.columns()) == list(trace.columns())
    with pytest.raises(SignalError, match=r"'v' was a Python function.*t_eval"):
        loaded.sample([1.0])


@ENDINGS
def test_files_are_found_by_a_name_or_a_path_and_overwritten(ending: str, tmp_path: Path) -> None:
    path = str(tmp_path / f"run{ending}")
    made("own chart").save(path)
    made("no transitions").save(path)
    equal(Trace.load(path), made("no transitions"))
    expected = ["run.npz"] if ending == ".npz" else ["run.csv", "run.transitions.csv"]
    assert sorted(os.listdir(tmp_path)) == expected


@pytest.mark.parametrize(
    ("case", "at_once"),
    [("own chart", 1), ("closed loop", 7), ("no transitions", 7), ("one row", 1)],
)
def test_csv_has_one_line_for_each_row_whatever_is_written_at_once(
    case: str, at_once: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cell(value: object) -> str:
        text = repr(value) if isinstance(value, float) else str(value)
        return f'"{text}"' if any(c in text for c in ',"\n') else text

    def text(columns: dict[str, Any]) -> str:
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        return "".join(f"{','.join(map(cell, row))}\n" for row in [columns, *rows])

    monkeypatch.setattr(csv_files, "AT_ONCE", at_once)
    trace = made(case)
    path = trace.save(tmp_path / "run.csv")
    head, _, rows = path.read_bytes().decode().partition("\n")
    log = trace.transitions
    numbered = {n: log[n] + 1 if n == "element" else log[n] for n in log.dtype.names}
    assert rows == text(trace.columns())
    assert (tmp_path / "run.transitions.csv").read_bytes().decode() == text(numbered)
    assert trace.transitions_csv() == text(numbered)
    stamp = hashlib.sha256("\n".join(text(numbered).splitlines()).encode()).hexdigest()[:16]
    assert json.loads(head[2:])["log"] == stamp
    equal(Trace.load(path), trace)


def test_csv_is_csv(tmp_path: Path) -> None:
    trace = made("own chart")
    path = trace.save(tmp_path / "run.csv")
    with path.open(encoding="utf-8", newline="") as file:
        assert json.loads(file.readline()[2:])["format"].startswith("gms-fsm trace")
        rows = list(csv.DictReader(file))
    assert [float(row["t"]) for row in rows] == trace.t.tolist()
    assert [float(row["z2"]) for row in rows] == trace.z[:, 1].tolist()
    assert [row["state1"] for row in rows] == trace.states[:, 0].tolist()
    with (tmp_path / "run.transitions.csv").open(encoding="utf-8", newline="") as file:
        log = list(csv.DictReader(file))
    assert [int(row["element"]) - 1 for row in log] == trace.transitions.element.tolist()
    assert [float(row["F_after"]) for row in log] == trace.transitions.F_after.tolist()


@ENDINGS
@pytest.mark.parametrize(
    ("variables", "n"), [(("z", "z1"), 11), (("dz",), 1), (("F1",), 11), (("state1",), 11)]
)
def test_no_variable_takes_the_column_of_another(
    variables: tuple[str, ...], n: int, ending: str, tmp_path: Path
) -> None:
    states = (State("on", {name: f"v * {j + 2}" for j, name in enumerate(variables)}),)
    try:
        chart = Chart("columns", ("v",), variables, (), states, (), {"F": variables[-1]})
        model = ChartModel(chart, {}, n=n, stribeck=Stribeck(1, 1.5, 1e-3))
    except GMSError:
        return  # refused, too, is no mix-up
    initial = {name: np.arange(n) + 100.0 * j for j, name in enumerate(variables)}
    trace = simulate(model, Prescribed("1"), 1.0, initial=initial)
    columns = trace.columns()
    assert len(columns) == 5 + n * (len(variables) + 4)
    equal(Trace.load(trace.save(tmp_path / f"run{ending}")), trace)


def test_to_pandas_has_one_column_per_quantity_and_element() -> None:
    pytest.importorskip("pandas", reason="needs pandas (extra: pandas)")
    trace = made("own chart")
    frame = trace.to_pandas()
    names = "t microstep x v F z1 z2 w1 w2 state1 state2 s1 s2 F1 F2 dz1 dz2"
    assert " ".join(frame.columns) == names
    assert len(frame) == len(trace)
    assert frame["w2"].tolist() == trace.variable("w")[:, 1].tolist()
    assert frame["state2"].tolist() == trace.states[:, 1].tolist()


# --------------------------------------------------------------------------- whole or not at all
@pytest.mark.parametrize("error", [OSError("disk full"), RuntimeError("bug"), KeyboardInterrupt()])
@pytest.mark.parametrize("old", [None, b"the old file"])
def test_a_writer_that_fails_leaves_the_old_file_and_nothing_else(
    error: BaseException, old: bytes | None, tmp_path: Path
) -> None:
    path = tmp_path / "run.npz"
    if old is not None:
        path.write_bytes(old)

    def fail(file: Any) -> None:
        file.write(b"half of")
        raise error

    with pytest.raises(OutputError if isinstance(error, OSError) else type(error)) as caught:
        write_whole(path, fail)
    if isinstance(error, OSError):
        assert "disk full" in str(caught.value)
        assert str(path) in str(caught.value)
    assert (path.read_bytes() if path.exists() else None) == old
    assert len(list(tmp_path.iterdir())) == (old is not None)


@ENDINGS
def test_a_folder_that_cannot_be_written_is_an_output_error(ending: str, tmp_path: Path) -> None:
    trace = made("no transitions")
    (tmp_path / "file").write_text("not a folder")
    (tmp_path / f"folder{ending}").mkdir()
    for path in ("missing/run", "file/run", "folder"):
        with pytest.raises(OutputError, match="cannot write") as caught:
            trace.save(tmp_path / f"{path}{ending}")
        assert f"{path}{ending}" in str(caught.value) or ".transitions" in str(caught.value)
    assert sorted(os.listdir(tmp_path)) in (
        ["file", f"folder{ending}"],
        ["file", f"folder{ending}", "folder.transitions.csv"],
    )


# --------------------------------------------------------------------------- hostile files
def small() -> Trace:
    """A short run, so that its files are small."""
    if "small" not in _made:
        _made["small"] = simulate(stick_slip("signed"), Prescribed("0.3"), 2.0)
    return _made["small"]


def _bytes(ending: str) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory() as folder:
        small().save(Path(folder) / f"run{ending}")
        return {name: (Path(folder) / name).read_bytes() for name in os.listdir(folder)}


def _read_everything(path: Path) -> None:
    trace = Trace.load(path)
    for name in COLUMNS:
        getattr(trace, name)
    trace.columns()
    repr(trace)


def _loads_or_is_refused(files: dict[str, bytes]) -> None:
    """Load; only `TraceFileError` may be raised, and a loaded trace must be readable."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        for name, content in files.items():
            (Path(folder) / name).write_bytes(content)
        path = Path(folder) / next(name for name in files if "transitions" not in name)
        try:
            Trace.load(path)
        except TraceFileError:
            return
        _read_everything(path)


mutations = st.lists(
    st.tuples(
        st.sampled_from(["flip", "cut", "insert", "drop", "zero"]),
        st.floats(0, 1, exclude_max=True),
        st.integers(1, 255),
    ),
    min_size=1,
    max_size=4,
)


def _damaged(content: bytes, changes: list[tuple[str, float, int]]) -> bytes:
    data = bytearray(content)
    for kind, place, amount in changes:
        i = int(place * len(data))
        if kind == "flip" and data:
            data[i] ^= amount
        elif kind == "cut":
            del data[i:]
        elif kind == "insert":
            data[i:i] = bytes([amount]) * 3
        elif kind == "drop":
            del data[i : i + amount]
        elif kind == "zero":
            data[i : i + amount] = bytes(len(data[i : i + amount]))
    return bytes(data)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(mutations)
def test_a_damaged_npz_loads_or_is_rejected(changes: list[tuple[str, float, int]]) -> None:
    (content,) = _bytes_of(".npz").values()
    _loads_or_is_refused({"run.npz": _damaged(content, changes)})


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(mutations, st.booleans())
def test_a_damaged_csv_loads_or_is_rejected(
    changes: list[tuple[str, float, int]], log: bool
) -> None:
    files = dict(_bytes_of(".csv"))
    name = "run.transitions.csv" if log else "run.csv"
    files[name] = _damaged(files[name], changes)
    _loads_or_is_refused(files)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(mutations, st.sampled_from(["rows_t", "rows_y", "rows_mode", "log_edge", "header"]))
def test_a_damaged_array_in_a_valid_archive_loads_or_is_rejected(
    changes: list[tuple[str, float, int]], member: str
) -> None:
    (content,) = _bytes_of(".npz").values()
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(name, _damaged(data, changes) if name == f"{member}.npy" else data)
    _loads_or_is_refused({"run.npz": out.getvalue()})


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=300), st.sampled_from([b"", b"PK\x03\x04", b"\x93NUMPY\x01\x00", b"# {"]))
def test_random_bytes_are_rejected(content: bytes, start: bytes) -> None:
    for name in ("run.npz", "run.csv"):
        _loads_or_is_refused({name: start + content})


_files: dict[str, dict[str, bytes]] = {}


def _bytes_of(ending: str) -> dict[str, bytes]:
    if ending not in _files:
        _files[ending] = _bytes(ending)
    return _files[ending]


def _arrays() -> dict[str, Any]:
    (content,) = _bytes_of(".npz").values()
    with np.load(io.BytesIO(content)) as file:
        return dict(file)


class _Bomb:
    """Executes something when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = str(path)

    def __reduce__(self) -> tuple[Any, ...]:
        return (open, (self.path, "w"))


@pytest.mark.parametrize("member", ["rows_y", "header", "log_edge", "observed_F"])
def test_a_pickle_in_a_trace_is_not_opened(member: str, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    arrays = _arrays()
    arrays[member] = np.array([_Bomb(canary)], dtype=object)
    path = tmp_path / "run.npz"
    with path.open("wb") as file:
        np.savez(file, allow_pickle=True, **arrays)
    with pytest.raises(TraceFileError):
        Trace.load(path)
    path.write_bytes(pickle.dumps(_Bomb(canary)))
    with pytest.raises(TraceFileError):
        Trace.load(path)
    assert not canary.exists()


def test_an_array_that_claims_to_be_endless_is_refused(tmp_path: Path) -> None:
    (content,) = _bytes_of(".npz").values()
    path = tmp_path / "run.npz"
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        head, {"descr": "<f8", "fortran_order": False, "shape": (10**15,)}
    )
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, head.getvalue() if name == "rows_t.npy" else old.read(name))
    with pytest.raises(TraceFileError):
        Trace.load(path)


def test_a_single_array_is_not_a_trace(tmp_path: Path) -> None:
    with (tmp_path / "run.npz").open("wb") as file:
        np.save(file, np.zeros(3))
    with pytest.raises(TraceFileError):
        Trace.load(tmp_path / "run.npz")


@ENDINGS
def test_a_folder_is_not_a_trace(ending: str, tmp_path: Path) -> None:
    (tmp_path / f"run{ending}").mkdir()
    with pytest.raises(TraceFileError):
        Trace.load(tmp_path / f"run{ending}")
