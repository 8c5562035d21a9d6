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
    LuGre,
    Prescribed,
    Slider,
    State,
    Stribeck,
    Trace,
    Transition,
    simulate,
)
from gms_fsm._files import write_whole
from gms_fsm.errors import GMSError, OutputError, SignalError, TraceFileError
from gms_fsm.traces import _csv
from tests import older_files
from tests.helpers import non_drifting, pulled_mass, stick_slip

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
    "ramps": lambda: simulate(
        stick_slip("signed"), Prescribed([(0, 0), (1, 0.5), (9, 0.5), (9, -0.5)]), 15.0
    ),
    "record": lambda: simulate(
        stick_slip("signed"), Prescribed((TIMES, 0.3 * np.sin(TIMES))), 30.0, engine="ifelse"
    ),
    "closed loop": lambda: simulate(*pulled_mass(), 20.0, rtol=1e-4),
    "force": lambda: simulate(*non_drifting("signed", slipping=True), 6.0),
    "no transitions": lambda: simulate(stick_slip("signed"), Prescribed("0"), 1.0),
    "one row": lambda: simulate(stick_slip("signed"), Prescribed("0"), 1.0, t_eval=[0.5]),
    "lugre": lambda: simulate(
        LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3)),
        Slider(1.0, [(0, 0), (2, 0.5)]),
        3.0,
    ),
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
@pytest.mark.parametrize("case", CASES)
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
    assert len(loaded) == len(trace)
    assert "transitions" in repr(loaded)


@ENDINGS
@pytest.mark.parametrize("case", CASES)
def test_saving_a_loaded_trace_writes_the_same(case: str, ending: str, tmp_path: Path) -> None:
    first = made(case).save(tmp_path / f"one{ending}")
    second = Trace.load(first).save(tmp_path / f"two{ending}")
    equal(Trace.load(second), made(case))
    if ending == ".csv":
        assert first.read_bytes() == second.read_bytes()


@ENDINGS
@pytest.mark.parametrize("case", [c for c in CASES if c not in ("one row", "wanted times")])
def test_a_loaded_trace_can_be_sampled_and_run_again(
    case: str, ending: str, tmp_path: Path
) -> None:
    trace = made(case)
    loaded = Trace.load(trace.save(tmp_path / f"run{ending}"))
    times = np.linspace(trace.t[0], trace.t[-1], 50)
    equal(loaded.sample(times), trace.sample(times))
    settings_ = dict(trace.settings)
    again = simulate(
        loaded.model,
        loaded.rig,
        settings_["t_end"],  # type: ignore[arg-type]
        rtol=settings_["rtol"],
        engine=settings_["engine"],  # type: ignore[arg-type]
    )
    equal(again, trace)


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


@pytest.mark.parametrize("at_once", [1, 7, _csv.AT_ONCE])
@pytest.mark.parametrize("case", CASES)
def test_csv_has_one_line_for_each_row_whatever_is_written_at_once(
    case: str, at_once: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cell(value: object) -> str:
        text = repr(value) if isinstance(value, float) else str(value)
        return f'"{text}"' if any(c in text for c in ',"\n') else text

    def text(columns: dict[str, Any]) -> str:
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        return "".join(f"{','.join(map(cell, row))}\n" for row in [columns, *rows])

    monkeypatch.setattr(_csv, "AT_ONCE", at_once)
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
    assert list(frame.columns) == [
        "t",
        "microstep",
        "x",
        "v",
        "F",
        "z1",
        "z2",
        "w1",
        "w2",
        "state1",
        "state2",
        "s1",
        "s2",
        "F1",
        "F2",
        "dz1",
        "dz2",
    ]
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


@pytest.mark.parametrize("name", ["run", "run.txt", "run.npz.gz", "run.NPZ.bak", ".npz"])
def test_other_endings_are_rejected(name: str, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"\.npz or \.csv"):
        made("no transitions").save(tmp_path / name)
    with pytest.raises(TraceFileError, match=r"\.npz or \.csv"):
        Trace.load(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


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
@settings(max_examples=250, deadline=None)
@given(mutations)
def test_a_damaged_npz_loads_or_is_rejected(changes: list[tuple[str, float, int]]) -> None:
    (content,) = _bytes_of(".npz").values()
    _loads_or_is_refused({"run.npz": _damaged(content, changes)})


@pytest.mark.slow
@settings(max_examples=250, deadline=None)
@given(mutations, st.booleans())
def test_a_damaged_csv_loads_or_is_rejected(
    changes: list[tuple[str, float, int]], log: bool
) -> None:
    files = dict(_bytes_of(".csv"))
    name = "run.transitions.csv" if log else "run.csv"
    files[name] = _damaged(files[name], changes)
    _loads_or_is_refused(files)


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
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


def _with_header(arrays: dict[str, Any], change: Callable[[dict[str, Any]], object]) -> None:
    header = json.loads(str(arrays["header"]))
    change(header)
    arrays["header"] = np.array(json.dumps(header))


def _set(*path: Any, value: Any) -> Callable[[dict[str, Any]], None]:
    """Change one place of an archive's arrays, or of its header."""

    def change(arrays: dict[str, Any]) -> None:
        if path[0] != "header":
            arrays[path[0]] = value(arrays[path[0]]) if callable(value) else value
            return

        def inside(header: dict[str, Any]) -> None:
            place: Any = header
            for key in path[1:-1]:
                place = place[key]
            place[path[-1]] = value

        _with_header(arrays, inside)

    return change


def _set_stops(name: str, value: Callable[[Any], Any]) -> Callable[[dict[str, Any]], None]:
    """Add stops to an archive's arrays, one of them changed."""

    def change(arrays: dict[str, Any]) -> None:
        columns = ("t", "microstep", "y", "mode")
        arrays |= {f"stops_{each}": arrays[f"rows_{each}"] for each in columns}
        arrays[f"stops_{name}"] = value(arrays[f"stops_{name}"])

    return change


HOSTILE = {
    "y has a column too few": _set("rows_y", value=lambda a: a[:, :-1]),
    "y has a column too many": _set("rows_y", value=lambda a: np.hstack([a, a])),
    "y is flat": _set("rows_y", value=lambda a: a[:, 0]),
    "y has three axes": _set("rows_y", value=lambda a: a[:, :, None]),
    "stops y has a column too few": _set_stops("y", lambda a: a[:, :-1]),
    "stops y is flat": _set_stops("y", lambda a: a[:, 0]),
    "y holds text": _set("rows_y", value=lambda a: a.astype("U32")),
    "y is complex": _set("rows_y", value=lambda a: a + 1j),
    "t is shorter": _set("rows_t", value=lambda a: a[:-1]),
    "t has two axes": _set("rows_t", value=lambda a: a[:, None]),
    "t is one number": _set("rows_t", value=np.float64(0)),
    "t holds text": _set("rows_t", value=lambda a: a.astype("U32")),
    "t goes backward": _set("rows_t", value=lambda a: a[::-1]),
    "t is not finite": _set("rows_t", value=lambda a: a * np.nan),
    "microstep is shorter": _set("rows_microstep", value=lambda a: a[:-1]),
    "a state number is too large": _set("rows_mode", value=lambda a: a + 2),
    "a state number is negative": _set("rows_mode", value=lambda a: a - 1),
    "state numbers have a column too few": _set("rows_mode", value=lambda a: a[:, :-1]),
    "state numbers are text": _set("rows_mode", value=lambda a: a.astype("U4")),
    "state numbers are fractions": _set("rows_mode", value=lambda a: a + 0.5),
    "stops have a wrong state number": _set_stops("mode", lambda a: a + 7),
    "F is shorter": _set("observed_F", value=lambda a: a[:-1]),
    "F holds text": _set("observed_F", value=lambda a: a.astype("U32")),
    "s has a column too few": _set("observed_s", value=lambda a: a[:, :-1]),
    "dz is missing": lambda arrays: arrays.pop("observed_dz"),
    "the log is missing": lambda arrays: arrays.pop("log_t"),
    "the log has no edges": lambda arrays: arrays.pop("log_edge"),
    "the log has two axes": _set("log_t", value=lambda a: a[:, None]),
    "the log's times are text": _set("log_t", value=lambda a: a.astype("U32")),
    "the log's times are records": _set("log_t", value=np.zeros(3, dtype=[("a", "f8")])),
    "the log's edges are shorter": _set("log_edge", value=lambda a: a[:-1]),
    "the log's edges are fractions": _set("log_edge", value=lambda a: a + 0.5),
    "the log's edges are negative": _set("log_edge", value=lambda a: a.astype(np.int64) - 1),
    "the log's edges are too large": _set("log_edge", value=lambda a: a + 99),
    "the log's edges are huge": _set("log_edge", value=lambda a: a.astype(np.uint64) + 2**63),
    "the log's edges are 2**32 too large": _set(
        "log_edge", value=lambda a: a.astype(np.int64) + 2**32
    ),
    "the log's machines are text": _set("log_machine", value=lambda a: a.astype("U4")),
    "the log has an element too many": _set("log_machine", value=lambda a: a + 99),
    "the log's numbers are one too few": _set("log_numbers", value=lambda a: a[:, :-1]),
    "the log's numbers are flat": _set("log_numbers", value=lambda a: a[:, 0]),
    "the header is missing": lambda arrays: arrays.pop("header"),
    "the header is a number": lambda arrays: arrays.update(header=np.zeros(3)),
    "the header is no JSON": lambda arrays: arrays.update(header=np.array("{not json")),
    "the header is a list": lambda arrays: arrays.update(header=np.array("[]")),
    "the header is deep": lambda arrays: arrays.update(header=np.array("[" * 100_000)),
    "another format": _set("header", "format", value="gms-fsm trace 99"),
    "an unknown key": _set("header", "surprise", value=1),
    "no elements": _set("header", "model", "n", value=0),
    "minus one element": _set("header", "model", "n", value=-1),
    "more elements than weights": _set("header", "model", "n", value=5),
    "very many elements": _set("header", "model", "n", value=10**15),
    "weights that are none": _set("header", "model", "weights", value=["heavy"]),
    "weights under zero": _set("header", "model", "weights", value=[-1.0] * 4),
    "a value is missing": _set("header", "model", "values", value={}),
    "a value is a list too long": _set("header", "model", "values", "k", value=[1.0] * 99),
    "a value is text": _set("header", "model", "values", "k", value="stiff"),
    "F_c is zero": _set("header", "model", "stribeck", "F_c", value=0),
    "the curve is missing": _set("header", "model", "stribeck", value=None),
    "an unknown rig": _set("header", "rig", "title", value="a cart"),
    "a rig without its mass": _set("header", "rig", "title", value="slider pushed by a force"),
    "a rig without its numbers": _set(
        "header", "rig", "title", value="slider pulled through a spring"
    ),
    "a rig with other numbers": _set(
        "header",
        "rig",
        value={
            "title": "slider pulled through a spring",
            "acceleration": "1",
            "numbers": {"mass": 1, "gravity": 9.81},
            "signals": {},
        },
    ),
    "a signal that is missing": _set("header", "rig", "signals", value={}),
    "a signal of no kind": _set("header", "rig", "signals", "v", value={"kind": "magic"}),
    "a signal that cannot be read": _set(
        "header", "rig", "signals", "v", value={"kind": "formula", "text": "t +"}
    ),
    "a signal that runs backward": _set(
        "header",
        "rig",
        "signals",
        "v",
        value={"kind": "corners", "times": [1, 0], "values": [0, 0], "held": True},
    ),
    "a flow that runs code": _set(
        "header", "model", "chart", "states", 0, "flow", "z", value="__import__('os').getpid()"
    ),
    "a guard that runs code": _set(
        "header", "model", "chart", "transitions", 0, "guard", value="exec('1') > 0"
    ),
    "a state name that runs code": _set(
        "header", "model", "chart", "states", 0, "name", value="x = 1\nimport os"
    ),
    "a parameter that is no name": _set(
        "header", "model", "chart", "parameters", value=["k", "sigma", "C", "v_c = 1; import os"]
    ),
    "states that are none": _set("header", "model", "chart", "states", value=[]),
    "an edge to nowhere": _set(
        "header", "model", "chart", "transitions", 0, "target", value="nowhere"
    ),
    "an input no model supplies": _set("header", "model", "chart", "inputs", value=["v", "s", "u"]),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_a_hostile_npz_is_rejected(case: str, tmp_path: Path) -> None:
    arrays = _arrays()
    HOSTILE[case](arrays)
    path = tmp_path / "run.npz"
    with path.open("wb") as file:
        np.savez(file, **arrays)
    with pytest.raises(TraceFileError):
        Trace.load(path)


HOSTILE_LOGS = {  # in files of format 1
    "it is missing": lambda arrays: arrays.pop("transitions"),
    "it has no columns": _set("transitions", value=np.zeros(3)),
    "it has other columns": _set("transitions", value=np.zeros(3, dtype=[("a", "f8")])),
    "it has two axes": _set("transitions", value=lambda a: a[:, None]),
    "its times are text": _set(
        "transitions",
        value=lambda a: a.astype([(n, "U9" if n == "t" else a.dtype[n]) for n in a.dtype.names]),
    ),
    "it has an element too many": _set(
        "transitions", value=lambda a: np.array([(0.0, 99, *list(r)[2:]) for r in a], a.dtype)
    ),
    "it names contacts": _set(
        "transitions", value=lambda a: np.zeros(3, [*a.dtype.descr, ("contact", a.dtype["edge"])])
    ),
}


@pytest.mark.parametrize("case", HOSTILE_LOGS)
def test_a_hostile_log_of_format_1_is_rejected(case: str, tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    arrays = older_files.format_1(made("expression"), path)
    assert len(Trace.load(older_files.write(path, arrays))) == len(made("expression"))
    HOSTILE_LOGS[case](arrays)
    with pytest.raises(TraceFileError):
        Trace.load(older_files.write(path, arrays))


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


def _lines(change: Callable[[list[str]], object], name: str = "run.csv") -> dict[str, bytes]:
    files = dict(_bytes_of(".csv"))
    lines = files[name].decode().split("\n")
    change(lines)
    files[name] = "\n".join(lines).encode()
    return files


def _replace(line: int, old: str, new: str, name: str = "run.csv") -> dict[str, bytes]:
    def change(lines: list[str]) -> None:
        assert old in lines[line]
        lines[line] = lines[line].replace(old, new, 1)

    return _lines(change, name)


LOG = "run.transitions.csv"
HOSTILE_CSV: dict[str, Callable[[], dict[str, bytes]]] = {
    "no header": lambda: _lines(lambda lines: lines.pop(0)),
    "no head line": lambda: _lines(lambda lines: lines.pop(1)),
    "only a header": lambda: _lines(lambda lines: lines.__delitem__(slice(1, None))),
    "bad JSON": lambda: _replace(0, '"model"', "model"),
    "deep JSON": lambda: _lines(lambda lines: lines.__setitem__(0, "# {" + '"a":[' * 50_000)),
    "a missing column": lambda: _replace(1, ",v,", ",u,"),
    "a missing state column": lambda: _replace(1, "state2", "stateB"),
    "a column twice": lambda: _replace(1, ",v,", ",x,"),
    "a short row": lambda: _replace(3, ",", ""),
    "a long row": lambda: _replace(3, ",", ",,"),
    "a word for a number": lambda: _replace(3, ",0,", ",soon,"),
    "an unknown state": lambda: _replace(3, "stick", "glue"),
    "a fraction of a micro-step": lambda: _replace(3, ",0,", ",0.5,"),
    "a huge micro-step": lambda: _replace(3, ",0,", f",{10**30},"),
    "an endless cell": lambda: _replace(3, ",0,", f",{'0' * 200_000},"),
    "no log": lambda: {"run.csv": _bytes_of(".csv")["run.csv"]},
    "an empty log": lambda: {**_bytes_of(".csv"), LOG: b""},
    "a log without a column": lambda: _replace(0, "edge", "ledge", LOG),
    "a log with a short row": lambda: _replace(1, ",", "", LOG),
    "a log with a word for a number": lambda: _replace(1, ",1,", ",one,", LOG),
    "a log with a huge element": lambda: _replace(1, ",1,", f",{10**30},", LOG),
    "no text": lambda: {**_bytes_of(".csv"), "run.csv": b"# {\xff\xfe\x00}"},
    "a log that is no text": lambda: {**_bytes_of(".csv"), LOG: b"\xff\xfe\x00"},
    "a hostile flow": lambda: _replace(0, '"z": "v"', '"z": "__import__(\'os\').getpid()"'),
}


@pytest.mark.parametrize("case", HOSTILE_CSV)
def test_a_hostile_csv_is_rejected(case: str, tmp_path: Path) -> None:
    for name, content in HOSTILE_CSV[case]().items():
        (tmp_path / name).write_bytes(content)
    with pytest.raises(TraceFileError):
        Trace.load(tmp_path / "run.csv")


@pytest.mark.parametrize("name", ["none.npz", "none.csv"])
def test_a_missing_file_is_named(name: str, tmp_path: Path) -> None:
    with pytest.raises(TraceFileError, match=rf"{name}: no such file"):
        Trace.load(tmp_path / name)


@ENDINGS
def test_a_folder_is_not_a_trace(ending: str, tmp_path: Path) -> None:
    (tmp_path / f"run{ending}").mkdir()
    with pytest.raises(TraceFileError):
        Trace.load(tmp_path / f"run{ending}")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.99])
def test_a_truncated_npz_is_rejected(share: float, tmp_path: Path) -> None:
    (content,) = _bytes_of(".npz").values()
    (tmp_path / "run.npz").write_bytes(content[: int(share * len(content))])
    with pytest.raises(TraceFileError, match=r"run\.npz"):
        Trace.load(tmp_path / "run.npz")
