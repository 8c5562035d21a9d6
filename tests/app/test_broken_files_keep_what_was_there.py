"""A scenario or record that breaks leaves what was there before it, and the rows it had computed.

What is refused is in `tests/refusals.py`; here: exit code 2, one line, and the files.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Trace
from gms_fsm.app.scenario import load_scenario
from gms_fsm.foundation.files import LIST
from gms_fsm.foundation.quantities import convert_numbers
from tests.scenario_files import (
    MEASURED,
    OPEN_LOOP,
    Answer,
    CommandLine,
    changed,
    nothing_written,
    one_message,
    sine_table,
    table,
)

GOOD = sine_table()
EVEN = np.arange(60) * 0.01
SIGNAL = """{ file = "own.csv", time = { column = "t", unit = "s" }, value = { column = "x", \
unit = "mm/s" } }"""


def run(gms_fsm: CommandLine, text: str, record: str = GOOD) -> Answer:
    """Run a scenario beside a record."""
    Path("given.toml").write_text(text)
    Path("own.csv").write_text(record)
    return gms_fsm("run", "given.toml", "-o", "out")


# --------------------------------------------------------------------------- files
@pytest.mark.parametrize(
    ("name", "head", "said"),
    [
        ("given.toml", b"", ["given.toml", "larger than 1000000 bytes"]),
        ("own.csv", b"", ["own.csv", "line 1", "longer than 100000"]),
        ("own.csv", b"t,x,F\n0,0,0\n", ["own.csv", "line 3", "longer than 100000"]),
    ],
)
def test_a_gigabyte_is_not_read(
    name: str, head: bytes, said: list[str], gms_fsm: CommandLine, tmp_path: Path
) -> None:
    Path("given.toml").write_text(MEASURED)
    Path("own.csv").write_text(GOOD)
    with Path(name).open("wb") as file:
        file.write(head)
        file.truncate(10**9)
    one_message(gms_fsm("run", "given.toml", "-o", "out"), *said)
    nothing_written(tmp_path, {"given.toml", "own.csv"})


def test_a_record_is_looked_for_in_the_data_folder_and_behind_no_link(
    gms_fsm: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, inside = tmp_path / "data", tmp_path / "inside"
    data.mkdir()
    inside.mkdir()
    Path("given.toml").write_text(MEASURED)
    monkeypatch.setenv("GMS_FSM_DATA", str(data))
    answer = gms_fsm("run", "given.toml", "-o", "out")
    one_message(answer, "given.toml", "'own.csv'", "no such file", str(data))
    (data / "own.csv").write_text(GOOD)
    assert gms_fsm("run", "given.toml", "-o", "out").code == 0
    (inside / "own.csv").symlink_to(data / "own.csv")
    (inside / "given.toml").write_text(MEASURED)
    answer = gms_fsm("run", inside / "given.toml", "-o", inside / "out")
    one_message(answer, "given.toml", "'own.csv'", "outside")
    assert not (inside / "out").exists()


def test_an_earlier_result_survives_a_broken_file(gms_fsm: CommandLine) -> None:
    assert run(gms_fsm, OPEN_LOOP).code == 0
    before = {path.name: path.read_bytes() for path in Path("out").iterdir()}
    answer = run(gms_fsm, changed(OPEN_LOOP, "t_end = 1.0", "t_end = -1.0"))
    assert answer.code == 2
    assert {path.name: path.read_bytes() for path in Path("out").iterdir()} == before


@pytest.mark.parametrize(
    ("old", "new", "reached", "why"),
    [
        ("0.1*sin(t)", "0.1*sqrt(0.5 - t)", 0.4, ["not finite"]),
        ("0.1*sin(t)", "9**9**9**9*t", 0.0, ["not finite"]),
        ("0.1*sin(t)", "0.1/(t - 0.5)", 0.4, ["step size"]),
        ('"0.1*sin(t)"', SIGNAL, 0.59, ["a sampled signal at t = 0.59 s", "t_end = 1.0"]),
    ],
)
def test_a_run_that_fails_midway_keeps_its_part(
    old: str, new: str, reached: float, why: list[str], gms_fsm: CommandLine
) -> None:
    answer = run(gms_fsm, changed(OPEN_LOOP, old, new))
    one_message(answer, "given.toml", "t = ", "partial.npz", *why)
    assert [line for line in answer.err.splitlines() if line.startswith("error: given.toml")]
    assert {path.name for path in Path("out").iterdir()} == {"partial.npz", LIST}
    part = Trace.load("out/partial.npz")
    assert len(part) == 0 or reached <= part.t[-1] < 1.0


def test_a_record_that_ends_before_the_run_keeps_its_part(gms_fsm: CommandLine) -> None:
    answer = run(gms_fsm, changed(MEASURED, "[output]", "[run]\nt_end = 10.0\n[output]"))
    one_message(answer, "a sampled signal at t = 0.59 s", "t_end = 10.0", "partial.npz")
    np.testing.assert_array_equal(Trace.load("out/partial.npz").t, EVEN.round(2))


# --------------------------------------------------------------------------- what is no mistake
@pytest.mark.parametrize(
    ("record", "rows"),
    [
        (table(["t", "x", "F"], EVEN, np.sin(6 * EVEN), 0 * EVEN), 60),  # R² is undefined
        ("\n".join(GOOD.splitlines()[:6]) + "\n", 5),
    ],
)
def test_a_constant_force_and_five_rows_are_enough(
    record: str, rows: int, gms_fsm: CommandLine
) -> None:
    answer = run(gms_fsm, MEASURED, record)
    assert answer.code == 0, answer.err
    assert "RMSE" in Path("out/summary.md").read_text()
    assert len(Trace.load("out/trace.npz")) == rows


def test_a_number_with_an_exponent_is_a_number_without_a_unit() -> None:
    """2e3 was read as 2 with the unit e3."""
    assert convert_numbers("force > 2e3") == "force > 2e3"
    assert float(convert_numbers("force > 2e3 mN").rpartition(">")[2]) == 2.0
    assert float(convert_numbers("time < 1.5E-1min").rpartition("<")[2]) == 9.0


def test_dots_in_texts_and_numbers_are_not_keys(tmp_path: Path) -> None:
    numbers = ", ".join(f"[{i}.5, 0.1]" for i in range(100))
    text = changed(OPEN_LOOP, '"0.1*sin(t)"', f"[{numbers}]")
    text = changed(text, '"open loop"', '"1. Here. And so on ... e.g. v.i.z. a.b.c/d.e.f"')
    (tmp_path / "a.toml").write_text(text)
    assert load_scenario(tmp_path / "a.toml").title.startswith("1. Here.")
    assert load_scenario(tmp_path / "a.toml", ["rig.velocity=.5*sin(t)"]).rig.signals["v"]


@pytest.mark.filterwarnings("default:published law")
def test_a_warning_of_a_scenario_is_printed_once(gms_fsm: CommandLine) -> None:
    text = changed(OPEN_LOOP, '"signed"', '"published"')
    answer = run(gms_fsm, changed(text, "F_s = 1.5", "F_s = 1.0"))
    assert answer.code == 0, answer.err
    assert answer.err.count("never arrests") == 1
