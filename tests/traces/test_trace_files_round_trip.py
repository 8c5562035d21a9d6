"""What the files of a trace are, beyond that they give it back (`tests/laws`).

They are written completely or not at all.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, Trace, simulate
from gms_fsm.errors import GMSError, OutputError, SignalError
from gms_fsm.foundation.files import write_whole
from gms_fsm.traces.files import csv_files
from tests.corpus import belt, run, trace
from tests.helpers import same_bits, stick_slip

ENDINGS = pytest.mark.parametrize("ending", [".npz", ".csv"])


def still(**how: Any) -> Trace:
    """A run without transitions."""
    return simulate(stick_slip("signed"), Prescribed("0"), 1.0, **how)


@ENDINGS
def test_no_firings_and_one_row(ending: str, tmp_path: Path) -> None:
    for one in (still(), still(t_eval=[0.5])):
        same_bits(Trace.load(one.save(tmp_path / f"run{ending}")), one)


@ENDINGS
@pytest.mark.parametrize("name", ["a function", "a function in a system"])
def test_a_python_function_is_not_kept_and_says_so_when_it_is_needed(
    name: str, ending: str, tmp_path: Path
) -> None:
    one = trace("a function")
    if name != "a function":
        one = simulate(belt(lambda t: 0.1), 2.0, **run("every kind of contact").how)
    read = Trace.load(one.save(tmp_path / f"run{ending}"))
    same_bits(read, one)
    with pytest.raises(SignalError, match=r"'[vr]' was a Python function.*t_eval"):
        read.sample([1.0])


@ENDINGS
def test_files_are_found_by_a_name_or_a_path_and_overwritten(ending: str, tmp_path: Path) -> None:
    path = str(tmp_path / f"run{ending}")
    trace("odd names").save(path)
    still().save(path)
    same_bits(Trace.load(path), still())
    expected = ["run.npz"] if ending == ".npz" else ["run.csv", "run.transitions.csv"]
    assert sorted(os.listdir(tmp_path)) == expected


@pytest.mark.parametrize(("name", "at_once"), [("odd names", 1), ("pulled mass", 7)])
def test_csv_has_one_line_for_each_row_whatever_is_written_at_once(
    name: str, at_once: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cell(value: object) -> str:
        text = repr(value) if isinstance(value, float) else str(value)
        return f'"{text}"' if any(c in text for c in ',"\n') else text

    def text(columns: dict[str, Any]) -> str:
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        return "".join(f"{','.join(map(cell, row))}\n" for row in [columns, *rows])

    monkeypatch.setattr(csv_files, "AT_ONCE", at_once)
    one = trace(name)
    path = one.save(tmp_path / "run.csv")
    head, _, rows = path.read_bytes().decode().partition("\n")
    log = one.transitions
    numbered = {n: log[n] + 1 if n == "element" else log[n] for n in log.dtype.names}
    assert rows == text(one.columns())
    assert (tmp_path / "run.transitions.csv").read_bytes().decode() == text(numbered)
    assert one.transitions_csv() == text(numbered)
    stamp = hashlib.sha256("\n".join(text(numbered).splitlines()).encode()).hexdigest()[:16]
    assert json.loads(head[2:])["log"] == stamp
    same_bits(Trace.load(path), one)


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
    one = simulate(model, Prescribed("1"), 1.0, initial=initial)
    columns = one.columns()
    assert len(columns) == 5 + n * (len(variables) + 4)
    same_bits(Trace.load(one.save(tmp_path / f"run{ending}")), one)


def test_columns_carry_the_names_of_elements_and_contacts() -> None:
    names = "t microstep x v F z1 z2 w1 w2 state1 state2 s1 s2 F1 F2 dz1 dz2"
    assert " ".join(trace("odd names").columns()) == names
    whole = trace("every kind of contact")
    found = list(whole.columns())
    assert found[:9] == ["t", "microstep", "q1", "w1", "q2", "w2", "x_b", "i", "w_b"]
    assert {"pad.F", "pad.F shared", "pad.state1", "bank.z4", "bank.F4", "bank.dz4"} <= {*found}
    assert {"oil.w", "oil.F_w", "oil.p1", "oil.dq1", "oil.F_w1"} <= {*found}
    assert list(whole.contact("bank").columns())[:5] == ["t", "microstep", "x", "v", "F"]


@pytest.mark.parametrize("contact", ["", "pad"])
def test_columns_and_logs_are_tables_of_pandas(contact: str) -> None:
    pandas = pytest.importorskip("pandas", reason="needs pandas (extra: pandas)")
    one = trace("every kind of contact")
    one = one.contact(contact) if contact else one
    frame, log = one.to_pandas(), one.transitions
    columns = one.columns()
    assert list(frame.columns) == list(columns)
    for name in columns:
        np.testing.assert_array_equal(frame[name], columns[name], name)
    frame = pandas.DataFrame(log)
    assert list(frame.columns) == [*log.dtype.names]
    assert frame["edge"].tolist() == log.edge.tolist()
    assert set(frame["contact"]) == ({contact} if contact else {"pad", "bank"})


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
    (tmp_path / "file").write_text("not a folder")
    (tmp_path / f"folder{ending}").mkdir()
    for path in ("missing/run", "file/run", "folder"):
        with pytest.raises(OutputError, match="cannot write") as caught:
            still().save(tmp_path / f"{path}{ending}")
        assert f"{path}{ending}" in str(caught.value) or ".transitions" in str(caught.value)
    assert sorted(os.listdir(tmp_path)) in (
        ["file", f"folder{ending}"],
        ["file", f"folder{ending}", "folder.transitions.csv"],
    )
